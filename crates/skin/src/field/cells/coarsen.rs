//! Takes short edges out of a surface that is much finer than what is asked of it.
//!
//! A vertex is moved onto one beside it where that changes neither what is connected nor much of the shape. Rounds go through the
//! vertices in their order, so that the result is the same everywhere.

use glam::DVec3;

use crate::body::area_vector;

/// Rounds; each takes out about a third of what can go.
const MOST_ROUNDS: usize = 24;

/// Rounds end when one takes out less than this share of the vertices.
const LEAST_SHARE: f64 = 0.01;

/// A normal may turn by 60° at once.
const MIN_NORMAL_COSINE: f64 = 0.5;

/// The surface may move by this share of the length of edges at once.
const DRIFT: f64 = 0.2;

/// Neighbours of a vertex that it is tried to be moved onto.
const TRIES: usize = 4;

/// The least height of a triangle, share of its longest edge, unless it was lower before.
const MIN_HEIGHT: f64 = 0.1;

/// `triangles` without edges below `edge_m` where that goes, and with none that became longer than `longest_m`.
pub(super) fn coarsen(positions: &[DVec3], triangles: Vec<[u32; 3]>, edge_m: f64, longest_m: f64) -> Vec<[u32; 3]> {
    let mut mesh = Mesh::new(positions, triangles, edge_m, longest_m);
    for _ in 0..MOST_ROUNDS {
        let (taken, left) = mesh.round();
        if (taken as f64) < LEAST_SHARE * left as f64 {
            break;
        }
    }
    let alive = mesh.is_alive;
    mesh.triangles.into_iter().zip(alive).filter(|(_, is_alive)| *is_alive).map(|(corners, _)| corners).collect()
}

struct Mesh<'a> {
    positions: &'a [DVec3],
    triangles: Vec<[u32; 3]>,
    is_alive: Vec<bool>,
    /// Per vertex its triangles.
    around: Vec<Vec<u32>>,
    /// Per vertex whether it can be moved onto no other, as long as the surface up to two edges away stays as it is.
    is_stuck: Vec<bool>,
    edge_m: f64,
    longest_m: f64,
}

impl<'a> Mesh<'a> {
    fn new(positions: &'a [DVec3], triangles: Vec<[u32; 3]>, edge_m: f64, longest_m: f64) -> Self {
        let mut around = vec![Vec::new(); positions.len()];
        for (triangle, corners) in (0..).zip(&triangles) {
            corners.iter().for_each(|&corner| around[corner as usize].push(triangle));
        }
        let (is_alive, is_stuck) = (vec![true; triangles.len()], vec![false; positions.len()]);
        Self { positions, triangles, is_alive, around, is_stuck, edge_m, longest_m }
    }

    /// How many vertices one round takes out, and how many are left.
    fn round(&mut self) -> (usize, usize) {
        let mut is_changed = vec![false; self.positions.len()];
        let (mut taken, mut left) = (0, 0);
        let (mut ring, mut other) = (Vec::new(), Vec::new());
        for vertex in 0..self.positions.len() as u32 {
            if self.around[vertex as usize].is_empty() {
                continue;
            }
            left += 1;
            if is_changed[vertex as usize] || self.is_stuck[vertex as usize] {
                continue;
            }
            let Some(onto) = self.target(vertex, &mut ring, &mut other) else {
                self.is_stuck[vertex as usize] = true;
                continue;
            };
            self.collapse(vertex, onto);
            for &(near, _) in &ring {
                is_changed[near as usize] = true;
                let corners = self.around[near as usize].iter().flat_map(|&triangle| self.triangles[triangle as usize]);
                corners.for_each(|corner| self.is_stuck[corner as usize] = false);
            }
            taken += 1;
            left -= 1;
        }
        (taken, left)
    }

    /// The vertices beside `vertex`, ascending, each with the number of triangles that it shares with it.
    fn ring(&self, vertex: u32, ring: &mut Vec<(u32, u32)>) {
        ring.clear();
        for &triangle in &self.around[vertex as usize] {
            for corner in self.triangles[triangle as usize] {
                if corner == vertex {
                    continue;
                }
                match ring.iter_mut().find(|(near, _)| *near == corner) {
                    Some((_, count)) => *count += 1,
                    None => ring.push((corner, 1)),
                }
            }
        }
        ring.sort_unstable();
    }

    /// The vertex that `vertex` can be moved onto; `ring` has those beside it.
    fn target(&self, vertex: u32, ring: &mut Vec<(u32, u32)>, other: &mut Vec<(u32, u32)>) -> Option<u32> {
        self.ring(vertex, ring);
        let borders: Vec<u32> = ring.iter().filter(|(_, count)| *count == 1).map(|(near, _)| *near).collect();
        if ring.iter().any(|(_, count)| *count > 2) || !(borders.is_empty() || borders.len() == 2) {
            return None;
        }
        let at = |vertex: u32| self.positions[vertex as usize];
        let is_candidate = |near: u32| borders.is_empty() || borders.contains(&near);
        let mut near: Vec<(f64, u32)> = ring
            .iter()
            .filter(|(near, _)| is_candidate(*near))
            .map(|&(near, _)| (at(near).distance(at(vertex)), near))
            .filter(|(length, _)| *length < self.edge_m)
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let fits = |&(_, onto): &(f64, u32)| {
            if let [a, b] = borders[..] {
                let along = (at(b) - at(a)).normalize_or_zero();
                if (at(vertex) - at(a)).reject_from_normalized(along).length() > DRIFT * self.edge_m {
                    return false;
                }
            }
            self.keeps_connections(vertex, onto, ring, other) && self.keeps_shape(vertex, onto)
        };
        near.into_iter().take(TRIES).find(fits).map(|(_, onto)| onto)
    }

    /// Whether the two have no more neighbours in common than the triangles between them.
    fn keeps_connections(&self, vertex: u32, onto: u32, ring: &[(u32, u32)], other: &mut Vec<(u32, u32)>) -> bool {
        self.ring(onto, other);
        let shared = ring.iter().find(|(near, _)| *near == onto).map_or(0, |(_, count)| *count as usize);
        let common: Vec<u32> = ring
            .iter()
            .map(|(near, _)| *near)
            .filter(|near| other.binary_search_by_key(near, |(corner, _)| *corner).is_ok())
            .collect();
        // Of a tetrahedron, nothing would be left.
        let is_doubled = |&triangle: &u32| {
            let corners = self.triangles[triangle as usize];
            !corners.contains(&vertex) && corners.iter().all(|corner| *corner == onto || common.contains(corner))
        };
        common.len() == shared && !self.around[onto as usize].iter().any(is_doubled)
    }

    fn keeps_shape(&self, vertex: u32, onto: u32) -> bool {
        let corners_of = |corners: [u32; 3]| corners.map(|corner| self.positions[corner as usize]);
        let longest =
            |[a, b, c]: [DVec3; 3]| a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a)).sqrt();
        let step = self.positions[onto as usize] - self.positions[vertex as usize];
        self.around[vertex as usize].iter().all(|&triangle| {
            let corners = self.triangles[triangle as usize];
            let before = corners_of(corners);
            let normal = area_vector(before).normalize_or_zero();
            if step.dot(normal).abs() > DRIFT * self.edge_m {
                return false;
            }
            if corners.contains(&onto) {
                return true;
            }
            let after = corners_of(corners.map(|corner| if corner == vertex { onto } else { corner }));
            let (spanned, side, side_before) = (area_vector(after), longest(after), longest(before));
            let height = |twice: f64, side: f64| twice / (side * side);
            let least = MIN_HEIGHT.min(height(area_vector(before).length(), side_before));
            side <= self.longest_m.max(side_before)
                && height(spanned.length(), side) >= least
                && spanned.dot(normal) >= MIN_NORMAL_COSINE * spanned.length()
        })
    }

    fn collapse(&mut self, vertex: u32, onto: u32) {
        for triangle in std::mem::take(&mut self.around[vertex as usize]) {
            let corners = self.triangles[triangle as usize];
            if corners.contains(&onto) {
                self.is_alive[triangle as usize] = false;
                for corner in corners.into_iter().filter(|corner| *corner != vertex) {
                    self.around[corner as usize].retain(|other| *other != triangle);
                }
            } else {
                let moved = corners.map(|corner| if corner == vertex { onto } else { corner });
                self.triangles[triangle as usize] = moved;
                self.around[onto as usize].push(triangle);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Topology;

    /// A box of one unit without a top, each of its five faces of 40 × 40 squares.
    fn fine_box() -> Topology {
        let (n, mut soup) = (40_u32, Vec::new());
        let faces =
            [(DVec3::ZERO, DVec3::Y, DVec3::X), (DVec3::ZERO, DVec3::X, DVec3::Z), (DVec3::ZERO, DVec3::Z, DVec3::Y)];
        let far = [(DVec3::X, DVec3::Y, DVec3::Z), (DVec3::Y, DVec3::Z, DVec3::X)];
        for (from, u, v) in faces.into_iter().chain(far) {
            let at = |i: u32, j: u32| from + (u * f64::from(i) + v * f64::from(j)) / f64::from(n);
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                soup.extend([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
        let triangles: Vec<[u32; 3]> = (0..soup.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        Topology::new(&soup, &triangles)
    }

    #[test]
    fn what_is_stuck_can_be_moved_nowhere() {
        let fine = fine_box();
        let mut mesh = Mesh::new(&fine.positions, fine.triangles.clone(), 0.2, 0.4);
        let (mut ring, mut other) = (Vec::new(), Vec::new());
        for round in 0..MOST_ROUNDS {
            mesh.round();
            let stuck: Vec<u32> = (0..).zip(&mesh.is_stuck).filter(|(_, is)| **is).map(|(vertex, _)| vertex).collect();
            assert!(stuck.iter().all(|&vertex| mesh.target(vertex, &mut ring, &mut other).is_none()), "round {round}");
            // In the end all are.
            let left = mesh.around.iter().filter(|triangles| !triangles.is_empty()).count();
            assert!(round + 1 < MOST_ROUNDS || (stuck.len() == left && left > 10), "{} of {left}", stuck.len());
        }
    }

    #[test]
    fn a_fine_box_without_a_top_keeps_its_shape_and_its_border() {
        let fine = fine_box();
        assert_eq!((fine.parts(), fine.flaws.flipped_edges), (1, 0));
        let coarse = coarsen(&fine.positions, fine.triangles.clone(), 0.2, 0.4);
        let coarse = Topology::new(&fine.positions, &coarse);
        assert!(coarse.triangles.len() < fine.triangles.len() / 20, "{}", coarse.triangles.len());
        assert_eq!((coarse.parts(), coarse.flaws.degenerate, coarse.flaws.doubled), (1, 0, 0));
        assert_eq!((coarse.flaws.branching_edges, coarse.flaws.flipped_edges), (0, 0));
        let area = |of: &Topology| {
            (0..of.triangles.len() as u32).map(|t| area_vector(of.corners(t)).length() / 2.0).sum::<f64>()
        };
        // Its eight edges may be cut off by the drift of a round, and lose 2 − √2 of that in area.
        let most = 8.0 * (2.0 - 2.0_f64.sqrt()) * DRIFT * 0.2;
        assert!((area(&coarse) - 5.0).abs() < most, "{}", area(&coarse));
        for edge in 0..3 * coarse.triangles.len() as u32 {
            let (a, b) = coarse.ends(edge);
            assert!(coarse.positions[a as usize].distance(coarse.positions[b as usize]) <= 0.4);
        }
    }
}
