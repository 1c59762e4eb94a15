//! Nodes and the ways between them, and the shortest lengths along these (Dijkstra).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The ways of a surface, which has many, in one list; and those that lead from taxel to taxel.
#[derive(Default)]
pub(super) struct Net {
    /// Per node where its ways begin in `ways`.
    first: Vec<u32>,
    /// The nodes beside each node and the ways there, m, one node after the other.
    ways: Vec<(u32, f64)>,
    /// Further ones, of the last nodes: the taxels.
    of_taxels: Vec<Vec<(u32, f64)>>,
}

impl Net {
    /// Of `nodes` nodes with the `ways` between two, each of them in both directions; the last nodes are the `taxels`.
    pub(super) fn new(nodes: usize, taxels: usize, ways: &[(u32, u32, f64)]) -> Self {
        let mut first = vec![0_u32; nodes + 1];
        for &(a, b, _) in ways {
            first[a as usize + 1] += 1;
            first[b as usize + 1] += 1;
        }
        (1..first.len()).for_each(|node| first[node] += first[node - 1]);
        let mut next = first.clone();
        let mut both = vec![(0, 0.0); 2 * ways.len()];
        for &(a, b, length_m) in ways {
            for (from, to) in [(a, b), (b, a)] {
                both[next[from as usize] as usize] = (to, length_m);
                next[from as usize] += 1;
            }
        }
        Self { first, ways: both, of_taxels: vec![Vec::new(); taxels] }
    }

    /// The node of the first taxel.
    fn first_taxel(&self) -> usize {
        self.first.len() - 1 - self.of_taxels.len()
    }

    /// Adds a way between the taxels `a` and `b`.
    pub(super) fn join(&mut self, a: usize, b: usize, length_m: f64) {
        let first = self.first_taxel();
        self.of_taxels[a].push(((first + b) as u32, length_m));
        self.of_taxels[b].push(((first + a) as u32, length_m));
    }

    /// The lengths of the shortest ways from taxel `from` to all taxels, m, infinite beyond `limit_m`. They are final for those `wanted`;
    /// others may be too long.
    pub(super) fn lengths(&self, from: usize, limit_m: f64, wanted: Option<&[usize]>) -> Vec<f64> {
        let first_taxel = self.first_taxel();
        let mut lengths = vec![f64::INFINITY; self.first.len() - 1];
        // Non-negative floats sort like their bits.
        let mut open = BinaryHeap::from([(Reverse(0_u64), (first_taxel + from) as u32)]);
        lengths[first_taxel + from] = 0.0;
        let mut is_wanted = vec![false; if wanted.is_some() { self.of_taxels.len() } else { 0 }];
        wanted.iter().copied().flatten().for_each(|&taxel| is_wanted[taxel] = true);
        let mut missing = wanted.map_or(usize::MAX, <[usize]>::len);
        // Each entry is a shorter length of a node than before, or is skipped.
        while let Some((Reverse(bits), node)) = open.pop() {
            let length = f64::from_bits(bits);
            if length > lengths[node as usize] {
                continue;
            }
            let taxel = (node as usize).checked_sub(first_taxel);
            if let Some(wanted) = taxel.and_then(|taxel| is_wanted.get_mut(taxel))
                && std::mem::replace(wanted, false)
            {
                missing -= 1;
                if missing == 0 {
                    break;
                }
            }
            let own = &self.ways[self.first[node as usize] as usize..self.first[node as usize + 1] as usize];
            let further = taxel.map_or(&[][..], |taxel| &self.of_taxels[taxel]);
            for &(next, step) in own.iter().chain(further) {
                let through = length + step;
                if through < lengths[next as usize] && through <= limit_m {
                    lengths[next as usize] = through;
                    open.push((Reverse(through.to_bits()), next));
                }
            }
        }
        lengths.split_off(first_taxel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_follow_the_ways_of_the_surface_and_those_between_taxels() {
        // Corners 0 to 3 in a ring of sides 1, 2, 3, 4; taxels 0 and 1 at corners 0 and 2, taxel 2 nowhere.
        let ways = [(0, 1, 1.0), (1, 2, 2.0), (2, 3, 3.0), (3, 0, 4.0), (4, 0, 0.5), (5, 2, 0.25)];
        let mut net = Net::new(7, 3, &ways);
        assert_eq!(net.lengths(0, f64::INFINITY, None), [0.0, 3.75, f64::INFINITY]);
        assert_eq!(net.lengths(1, 3.7, None), [f64::INFINITY, 0.0, f64::INFINITY]);
        net.join(1, 2, 10.0);
        net.join(2, 0, 1.0);
        assert_eq!(net.lengths(1, f64::INFINITY, None), [3.75, 0.0, 4.75]);
        assert_eq!(net.lengths(0, f64::INFINITY, Some(&[2]))[2], 1.0);
    }
}
