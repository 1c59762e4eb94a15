//! Cuts long edges of a surface, which bends nothing: windows end at corners that are nearer to other points.

use std::collections::HashMap;

use glam::DVec3;

use crate::body::{QuickHasher, Topology};

/// Rounds of cuts; each halves edges. More than any surface needs.
const MOST_ROUNDS: usize = 40;

/// A surface whose long edges are cut.
pub(super) struct Refined {
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Per triangle the one that it is a part of.
    pub(super) parent: Vec<u32>,
    /// Per triangle whether its edges have not been looked at: an edge that is short enough once stays so.
    is_new: Vec<bool>,
}

/// Cuts all edges of `topology` in two that are longer than `shortest` and than what `wanted` gives at their middles, again and
/// again while there are fewer than `most` triangles. `None` if there is no such edge.
pub(super) fn refine(
    topology: &Topology,
    shortest: f64,
    wanted: impl Fn(DVec3) -> f64,
    most: usize,
) -> Option<Refined> {
    let mut refined = Refined {
        positions: topology.positions.clone(),
        triangles: topology.triangles.clone(),
        parent: (0..topology.triangles.len() as u32).collect(),
        is_new: vec![true; topology.triangles.len()],
    };
    let mut is_cut = false;
    for _ in 0..MOST_ROUNDS {
        if refined.triangles.len() >= most || !refined.cut(shortest, &wanted) {
            break;
        }
        is_cut = true;
    }
    is_cut.then_some(refined)
}

impl Refined {
    /// Cuts long edges once; whether there was one.
    fn cut(&mut self, shortest: f64, wanted: &impl Fn(DVec3) -> f64) -> bool {
        let mut middles: HashMap<(u32, u32), u32, QuickHasher> = HashMap::default();
        for (&[a, b, c], _) in self.triangles.iter().zip(&self.is_new).filter(|(_, is_new)| **is_new) {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                let key = (from.min(to), from.max(to));
                let [p, q] = [key.0, key.1].map(|v| self.positions[v as usize]);
                let (length, middle) = (p.distance(q), (p + q) / 2.0);
                if length > shortest && !middles.contains_key(&key) && length > wanted(middle) {
                    middles.insert(key, self.positions.len() as u32);
                    self.positions.push(middle);
                }
            }
        }
        if middles.is_empty() {
            return false;
        }
        let (triangles, parents) = (std::mem::take(&mut self.triangles), std::mem::take(&mut self.parent));
        self.is_new.clear();
        for (corners, parent) in triangles.into_iter().zip(parents) {
            let [a, b, c] = corners;
            let middle = |(from, to): (u32, u32)| middles.get(&(from.min(to), from.max(to))).copied();
            let cuts = [(a, b), (b, c), (c, a)].map(middle);
            let (parts, count) = self.parts(corners, cuts);
            self.triangles.extend_from_slice(&parts[..count]);
            self.parent.extend(std::iter::repeat_n(parent, count));
            self.is_new.extend(std::iter::repeat_n(count > 1, count));
        }
        true
    }

    /// The parts of a triangle whose edges are cut at `cuts`, and how many they are.
    fn parts(&self, corners: [u32; 3], cuts: [Option<u32>; 3]) -> ([[u32; 3]; 4], usize) {
        let turned = |by: usize| [0, 1, 2].map(|k| corners[(k + by) % 3]);
        let apart = |a: u32, b: u32| self.positions[a as usize].distance_squared(self.positions[b as usize]);
        match cuts {
            [None, None, None] => ([corners; 4], 1),
            [Some(ab), Some(bc), Some(ca)] => {
                let [a, b, c] = corners;
                ([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]], 4)
            }
            cuts if cuts.iter().flatten().count() == 1 => {
                let edge = cuts.iter().position(Option::is_some).unwrap_or(0);
                let (middle, [a, b, c]) = (cuts[edge].unwrap_or(0), turned(edge));
                ([[a, middle, c], [middle, b, c], corners, corners], 2)
            }
            cuts => {
                // Turned so that the last edge, from c to a, is whole.
                let whole = cuts.iter().position(Option::is_none).unwrap_or(0);
                let [a, b, c] = turned(whole + 1);
                let [ab, bc] = [1, 2].map(|step| cuts[(whole + step) % 3].unwrap_or(0));
                let rest = match apart(a, bc) < apart(ab, c) {
                    true => [[a, ab, bc], [a, bc, c]],
                    false => [[a, ab, c], [ab, bc, c]],
                };
                ([[ab, b, bc], rest[0], rest[1], corners], 3)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::area_vector;

    #[test]
    fn cuts_keep_area_sides_and_connections() {
        // A box of one unit without its top, two triangles a side: whatever is cut, it stays one surface.
        let corner = |i: u32| DVec3::new((i & 1).into(), (i >> 1 & 1).into(), (i >> 2).into());
        let positions: Vec<DVec3> = (0..8).map(corner).collect();
        let faces = [[0, 2, 3, 1], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles: Vec<[u32; 3]> = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let topology = Topology::new(&positions, &triangles);
        // Fine around one corner, so that triangles with one, two and three cut edges occur.
        let fine = DVec3::new(1.0, 0.3, 0.1);
        let refined = refine(&topology, 0.05, |p| 0.4 * p.distance(fine), 100_000).unwrap();
        let cut = Topology::new(&refined.positions, &refined.triangles);
        assert!(refined.triangles.len() > 100, "{}", refined.triangles.len());
        assert_eq!((cut.parts(), cut.flaws.degenerate, cut.flaws.branching_edges), (1, 0, 0));
        let mut area = vec![0.0; topology.triangles.len()];
        for (&corners, &parent) in refined.triangles.iter().zip(&refined.parent) {
            let own = area_vector(corners.map(|v| refined.positions[v as usize]));
            let whole = area_vector(topology.corners(parent));
            assert!(own.normalize().distance(whole.normalize()) < 1e-12);
            area[parent as usize] += own.length() / 2.0;
        }
        assert!(area.iter().all(|area| (area - 0.5).abs() < 1e-12), "{area:?}");
        // With nothing to cut it gives `None`, and the limit of triangles ends the cuts.
        assert!(refine(&topology, 2.0, |_| 0.0, 100_000).is_none());
        assert!(refine(&topology, 0.0, |_| 0.0, 50).unwrap().triangles.len() < 200);
    }
}
