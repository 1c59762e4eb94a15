//! Shortest paths along the edges of a surface (Dijkstra).

use std::collections::BinaryHeap;

use super::queue::QueueEntry;
use crate::body::Topology;

/// Per vertex the length of the shortest path to it along edges, m, from the vertices with finite lengths in `known_m`.
pub(super) fn along_edges(topology: &Topology, known_m: Vec<f64>) -> Vec<f64> {
    let mut beside: Vec<(u32, u32)> = (0..topology.across.len() as u32)
        .flat_map(|edge| {
            let (from, to) = topology.ends(edge);
            [(from, to), (to, from)]
        })
        .collect();
    beside.sort_unstable();
    beside.dedup();
    let mut first = vec![0_usize; topology.positions.len() + 1];
    beside.iter().for_each(|&(from, _)| first[from as usize + 1] += 1);
    (1..first.len()).for_each(|vertex| first[vertex] += first[vertex - 1]);
    let mut lengths_m = known_m;
    let entry = |distance_m: f64, what: u32| QueueEntry { distance_m, turn: what, what };
    let known = lengths_m.iter().zip(0..).filter(|(length, _)| length.is_finite());
    let mut queue: BinaryHeap<QueueEntry> = known.map(|(&length, vertex)| entry(length, vertex)).collect();
    while let Some(QueueEntry { distance_m, what: vertex, .. }) = queue.pop() {
        if distance_m > lengths_m[vertex as usize] {
            continue;
        }
        let here = topology.positions[vertex as usize];
        for &(_, other) in &beside[first[vertex as usize]..first[vertex as usize + 1]] {
            let length = distance_m + here.distance(topology.positions[other as usize]);
            if length < lengths_m[other as usize] {
                lengths_m[other as usize] = length;
                queue.push(entry(length, other));
            }
        }
    }
    lengths_m
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn paths_go_along_edges_to_what_is_connected() {
        // Two squares in a row, each of two triangles, and a triangle apart.
        let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let positions = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0), at(2.0, 0.0), at(2.0, 1.0)];
        let apart = [at(9.0, 0.0), at(9.0, 1.0), at(8.0, 0.0)];
        let triangles = [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2], [6, 7, 8]];
        let topology = Topology::new(&[&positions[..], &apart].concat(), &triangles);
        let mut known = vec![f64::INFINITY; 9];
        known[0] = 0.5;
        let lengths = along_edges(&topology, known);
        let wanted = [0.5, 1.5, 0.5 + 2.0_f64.sqrt(), 1.5, 2.5, 1.5 + 2.0_f64.sqrt()];
        assert!(lengths.iter().zip(wanted).all(|(length, wanted)| (length - wanted).abs() < 1e-12), "{lengths:?}");
        assert!(lengths[6..].iter().all(|length| length.is_infinite()));
    }
}
