//! Taxels without a value as bridges: the taxels around a connected set of them are each other's neighbours.

use super::skin::Skin;

/// In no bridge.
const NONE: u32 = u32::MAX;

/// The bridges of a frame; they are made anew only when other taxels are without a value.
#[derive(Clone, Debug, Default)]
pub(super) struct Bridges {
    /// The taxels without a value, ascending.
    without: Vec<u32>,
    /// By taxel the bridge that it is part of, or [`NONE`].
    bridge_of: Vec<u32>,
    /// By bridge the end of its part of `around`.
    ends: Vec<u32>,
    /// Taxels with a value around each bridge, ascending.
    around: Vec<u32>,
    /// Memory of a search.
    open: Vec<u32>,
}

impl Bridges {
    /// Makes the bridges of the taxels `without` a value, ascending; of equal ones and those the body lacks nothing comes.
    pub(super) fn set(&mut self, skin: &Skin, without: &[u32]) {
        if self.without == without && self.bridge_of.len() == skin.nodes() {
            return;
        }
        for &node in &self.without {
            if let Some(bridge) = self.bridge_of.get_mut(node as usize) {
                *bridge = NONE;
            }
        }
        self.bridge_of.resize(skin.nodes(), NONE);
        self.without.clear();
        self.without.extend(without.iter().filter(|node| (**node as usize) < skin.nodes()));
        self.ends.clear();
        self.around.clear();
        // One that is not yet in a bridge.
        const OPEN: u32 = NONE - 1;
        for &node in &self.without {
            self.bridge_of[node as usize] = OPEN;
        }
        for index in 0..self.without.len() {
            let start = self.without[index];
            if self.bridge_of[start as usize] != OPEN {
                continue;
            }
            let (bridge, first) = (self.ends.len() as u32, self.around.len());
            self.bridge_of[start as usize] = bridge;
            self.open.clear();
            self.open.push(start);
            while let Some(node) = self.open.pop() {
                for &other in skin.beside(node) {
                    match self.bridge_of[other as usize] {
                        NONE => self.around.push(other),
                        OPEN => {
                            self.bridge_of[other as usize] = bridge;
                            self.open.push(other);
                        }
                        _ => {}
                    }
                }
            }
            self.around[first..].sort_unstable();
            let mut kept = first;
            for at in first..self.around.len() {
                if kept == first || self.around[kept - 1] != self.around[at] {
                    self.around[kept] = self.around[at];
                    kept += 1;
                }
            }
            self.around.truncate(kept);
            self.ends.push(kept as u32);
        }
    }

    /// Whether a node has a value.
    pub(super) fn has_value(&self, node: u32) -> bool {
        self.bridge_of.get(node as usize).is_none_or(|&bridge| bridge == NONE)
    }

    /// The taxels around the bridge that `node`, without a value, is part of.
    fn around(&self, node: u32) -> &[u32] {
        let bridge = self.bridge_of[node as usize] as usize;
        let first = bridge.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.around[first as usize..self.ends[bridge] as usize]
    }

    /// Calls `each` with the neighbours of `node`, which has a value, also over bridges; some may come twice.
    pub(super) fn beside(&self, skin: &Skin, node: u32, mut each: impl FnMut(u32)) {
        if self.without.is_empty() {
            skin.beside(node).iter().copied().for_each(each);
            return;
        }
        for &other in skin.beside(node) {
            if self.has_value(other) {
                each(other);
            } else {
                self.around(other).iter().copied().filter(|&beyond| beyond != node).for_each(&mut each);
            }
        }
    }

    /// Whether `node`, which has a value, is beside one that has none.
    pub(super) fn is_beside_one(&self, skin: &Skin, node: u32) -> bool {
        !self.without.is_empty() && skin.beside(node).iter().any(|&other| !self.has_value(other))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::touch::layouts;

    fn beside(bridges: &Bridges, skin: &Skin, node: u32) -> Vec<u32> {
        let mut found = BTreeSet::new();
        bridges.beside(skin, node, |other| {
            found.insert(other);
        });
        found.into_iter().collect()
    }

    #[test]
    fn neighbours_of_taxels_without_a_value_are_each_others() {
        let skin = layouts::grid(7, 1, 0.01);
        let mut bridges = Bridges::default();
        bridges.set(&skin, &[]);
        assert_eq!(beside(&bridges, &skin, 3), [2, 4]);
        bridges.set(&skin, &[2, 3, 6]);
        assert_eq!([1, 4, 5].map(|node| beside(&bridges, &skin, node)), [vec![0, 4], vec![1, 5], vec![4]]);
        assert!(bridges.is_beside_one(&skin, 5) && !bridges.is_beside_one(&skin, 0));
        // Another set leaves nothing of the one before.
        bridges.set(&skin, &[5]);
        assert_eq!([3, 4, 6].map(|node| beside(&bridges, &skin, node)), [vec![2, 4], vec![3, 6], vec![4]]);
        bridges.set(&skin, &[]);
        assert_eq!(beside(&bridges, &skin, 5), [4, 6]);
        // All around a taxel in the middle, and what the body does not have.
        let cross = layouts::grid(3, 3, 0.01);
        let mut bridges = Bridges::default();
        bridges.set(&cross, &[4, 99]);
        assert_eq!(beside(&bridges, &cross, 1), [0, 2, 3, 5, 7]);
    }
}
