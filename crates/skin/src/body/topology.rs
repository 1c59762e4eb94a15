//! The topology of triangles: neighbours across edges, boundaries, connected parts.
//!
//! Exporters split vertices along seams, and real meshes have triangles without area, edges with three triangles and loose
//! parts. These are handled and counted.

use std::collections::{HashMap, HashSet};

use glam::DVec3;

/// Vertices within this share of the largest coordinate are welded: four units in the last place of single precision, two
/// for each of two roundings.
const WELD_TOLERANCE: f64 = 1.0 / (1 << 22) as f64;

/// Minimum height of a triangle, share of its longest edge; others are degenerate.
const MIN_HEIGHT: f64 = 1e-9;

/// Hashes whole numbers of a mesh, millions at once: three times as fast as the standard hasher, which guards against keys that are
/// chosen to collide.
pub type QuickHasher = foldhash::fast::FixedState;

/// No triangle, vertex or part.
pub const NONE: u32 = u32::MAX;

/// Triangles with welded vertices and known neighbours.
///
/// Edge 3·t + k of triangle t runs from its corner k to corner (k + 1) mod 3.
#[derive(Clone, Debug, Default)]
pub struct Topology {
    /// Welded vertices, m.
    pub positions: Vec<DVec3>,
    /// Per vertex given, the welded one; [`NONE`] for one that is not finite.
    pub welded: Vec<u32>,
    /// Valid triangles over the welded vertices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Per valid triangle its index among those given.
    pub given: Vec<u32>,
    /// Per edge the same edge of the triangle beyond, or [`NONE`].
    pub across: Vec<u32>,
    /// Per triangle the connected part it belongs to; parts count from 0 in the order of the triangles.
    pub part: Vec<u32>,
    /// Counted defects.
    pub flaws: Flaws,
}

/// Counts of a mesh's defects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flaws {
    /// Triangles without area, or with a corner that is not there or not finite; left out.
    pub degenerate: usize,
    /// Triangles over the same three vertices as another; left out.
    pub doubled: usize,
    /// Edges of more than two triangles; nothing crosses them.
    pub branching_edges: usize,
    /// Edges whose two triangles disagree on what is outside; nothing crosses them.
    pub flipped_edges: usize,
    /// Edges of one triangle, at the surface's boundary.
    pub boundary_edges: usize,
}

impl Topology {
    /// The topology of `triangles` over `positions`, in m.
    #[must_use]
    pub fn new(positions: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        Self::of_groups(positions, triangles, &|_| 0)
    }

    /// The same, where only vertices of the same group are welded.
    #[must_use]
    #[doc(hidden)]
    pub fn of_groups(positions: &[DVec3], triangles: &[[u32; 3]], group_of: &dyn Fn(u32) -> u32) -> Self {
        let mut topology = Self::default();
        topology.weld(positions, group_of);
        topology.take(triangles);
        topology.join();
        topology.divide();
        topology
    }

    fn weld(&mut self, positions: &[DVec3], group_of: &dyn Fn(u32) -> u32) {
        let largest = positions.iter().filter(|p| p.is_finite()).map(|p| p.abs().max_element()).fold(0.0, f64::max);
        let within = (largest * WELD_TOLERANCE).max(f64::MIN_POSITIVE);
        // Cubes much larger than the tolerance, so that most points need only one.
        let side = 8.0 * within;
        let cube = |p: DVec3| (p / side).floor().to_array().map(|steps| steps as i64);
        // By group and cube its last vertex, and by vertex the one before in its cube.
        let mut last: HashMap<(u32, [i64; 3]), u32, QuickHasher> =
            HashMap::with_capacity_and_hasher(positions.len() / 2, QuickHasher::default());
        let mut before: Vec<u32> = Vec::new();
        for (&p, given) in positions.iter().zip(0..) {
            if !p.is_finite() {
                self.welded.push(NONE);
                continue;
            }
            let group = group_of(given);
            let (low, high) = (cube(p - within), cube(p + within));
            let mut same: Option<u32> = None;
            for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        let in_cube = last.get(&(group, [x, y, z])).copied();
                        let near = std::iter::successors(in_cube, |&v| Some(before[v as usize]).filter(|v| *v != NONE));
                        let here = near.filter(|&v| (self.positions[v as usize] - p).abs().max_element() <= within);
                        same = same.into_iter().chain(here).min();
                    }
                }
            }
            self.welded.push(same.unwrap_or_else(|| {
                let vertex = self.positions.len() as u32;
                self.positions.push(p);
                before.push(last.insert((group, cube(p)), vertex).unwrap_or(NONE));
                vertex
            }));
        }
    }

    fn take(&mut self, triangles: &[[u32; 3]]) {
        let mut seen: HashSet<[u32; 3], QuickHasher> =
            HashSet::with_capacity_and_hasher(triangles.len(), QuickHasher::default());
        for (index, triangle) in triangles.iter().enumerate() {
            let corners = triangle.map(|v| self.welded.get(v as usize).copied().unwrap_or(NONE));
            let [a, b, c] = corners;
            if corners.contains(&NONE) || a == b || b == c || c == a || !self.has_area(corners) {
                self.flaws.degenerate += 1;
                continue;
            }
            let mut sorted = corners;
            sorted.sort_unstable();
            if !seen.insert(sorted) {
                self.flaws.doubled += 1;
                continue;
            }
            self.triangles.push(corners);
            self.given.push(index as u32);
        }
    }

    fn has_area(&self, corners: [u32; 3]) -> bool {
        let [a, b, c] = corners.map(|v| self.positions[v as usize]);
        let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
        // Twice the area is height times base; the comparison also fails for lengths that overflow.
        let twice = (b - a).cross(c - a).length();
        twice.is_finite() && twice > MIN_HEIGHT * longest
    }

    fn join(&mut self) {
        let mut edges: Vec<(u32, u32, u32)> = (0..3 * self.triangles.len() as u32)
            .map(|edge| {
                let (from, to) = self.ends(edge);
                (from.min(to), from.max(to), edge)
            })
            .collect();
        edges.sort_unstable();
        self.across = vec![NONE; edges.len()];
        for same in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            match *same {
                [_] => self.flaws.boundary_edges += 1,
                [(.., one), (.., other)] if self.ends(one).0 == self.ends(other).1 => {
                    self.across[one as usize] = other;
                    self.across[other as usize] = one;
                }
                [_, _] => self.flaws.flipped_edges += 1,
                _ => self.flaws.branching_edges += 1,
            }
        }
    }

    fn divide(&mut self) {
        self.part = vec![NONE; self.triangles.len()];
        let mut parts = 0;
        for start in 0..self.triangles.len() as u32 {
            if self.part[start as usize] != NONE {
                continue;
            }
            let mut open = vec![start];
            self.part[start as usize] = parts;
            while let Some(triangle) = open.pop() {
                for edge in 3 * triangle..3 * triangle + 3 {
                    let beyond = self.across[edge as usize];
                    if beyond != NONE && self.part[beyond as usize / 3] == NONE {
                        self.part[beyond as usize / 3] = parts;
                        open.push(beyond / 3);
                    }
                }
            }
            parts += 1;
        }
    }

    /// The vertices that edge `edge` runs from and to.
    #[must_use]
    pub fn ends(&self, edge: u32) -> (u32, u32) {
        let triangle = self.triangles[edge as usize / 3];
        let corner = edge as usize % 3;
        (triangle[corner], triangle[(corner + 1) % 3])
    }

    /// The corners of `triangle`, m.
    #[must_use]
    pub fn corners(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|v| self.positions[v as usize])
    }

    /// How many connected parts there are.
    #[must_use]
    pub fn parts(&self) -> usize {
        self.part.iter().max().map_or(0, |&last| last as usize + 1)
    }

    /// The edges that start at the first vertex of edge `edge`, counter-clockwise seen from outside, and whether they close
    /// around it. At a boundary the first is the most clockwise one, and the last triangle's far side is not included.
    #[must_use]
    pub fn fan(&self, edge: u32) -> (Vec<u32>, bool) {
        let in_triangle = |edge: u32, step: u32| edge - edge % 3 + (edge % 3 + step) % 3;
        // The triangle clockwise of edge (v → x) has the edge (x → v); the next edge from v follows it.
        let mut first = edge;
        loop {
            let beyond = self.across[first as usize];
            if beyond == NONE {
                break;
            }
            first = in_triangle(beyond, 1);
            if first == edge {
                break;
            }
        }
        let mut fan = vec![first];
        loop {
            let beyond = self.across[in_triangle(fan[fan.len() - 1], 2) as usize];
            if beyond == NONE {
                return (fan, false);
            }
            if beyond == first {
                return (fan, true);
            }
            fan.push(beyond);
        }
    }
}

/// The next edge of the same triangle, counter-clockwise.
#[must_use]
pub fn next(edge: u32) -> u32 {
    edge - edge % 3 + (edge + 1) % 3
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of squares, each of two triangles, along +x in the plane z = 0.
    fn strip(squares: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let positions = (0..=squares).flat_map(|x| [DVec3::new(x.into(), 0.0, 0.0), DVec3::new(x.into(), 1.0, 0.0)]);
        let triangles = (0..squares).flat_map(|s| [[2 * s, 2 * s + 2, 2 * s + 3], [2 * s, 2 * s + 3, 2 * s + 1]]);
        (positions.collect(), triangles.collect())
    }

    #[test]
    fn a_seam_is_closed_and_a_gap_is_not() {
        let (positions, triangles) = strip(3);
        // Each triangle with corners of its own, the way that flat shading is exported.
        let soup: Vec<DVec3> = triangles.iter().flatten().map(|&v| positions[v as usize]).collect();
        let split: Vec<[u32; 3]> = (0..6).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let topology = Topology::new(&soup, &split);
        assert_eq!((topology.positions.len(), topology.parts()), (8, 1));
        assert_eq!(topology.flaws, Flaws { boundary_edges: 8, ..Flaws::default() });
        let rounded: Vec<DVec3> = soup.iter().enumerate().map(|(i, p)| *p + DVec3::X * 1e-7 * (i % 2) as f64).collect();
        assert_eq!(Topology::new(&rounded, &split).positions.len(), 8);
        let apart: Vec<DVec3> = soup.iter().enumerate().map(|(i, p)| *p + DVec3::Z * (i / 3) as f64 * 1e-4).collect();
        assert_eq!(Topology::new(&apart, &split).parts(), 6);
    }

    #[test]
    fn what_lies_across_an_edge_runs_the_other_way() {
        let (positions, triangles) = strip(4);
        let topology = Topology::new(&positions, &triangles);
        for edge in 0..24 {
            let beyond = topology.across[edge as usize];
            if beyond != NONE {
                let ((a, b), (c, d)) = (topology.ends(edge), topology.ends(beyond));
                assert_eq!((a, b), (d, c));
                assert_eq!(topology.across[beyond as usize], edge);
            }
        }
    }

    #[test]
    fn flawed_triangles_are_counted_and_survived() {
        let (mut positions, mut triangles) = strip(2);
        let sound = triangles.len();
        positions.extend([DVec3::new(0.5, 0.0, 0.0), DVec3::NAN, DVec3::new(0.5, 0.5, 1.0)]);
        // Flat, doubled, not a number, a vertex too many, one corner twice.
        triangles.extend([[0, 6, 2], [3, 0, 2], [0, 2, 7], [0, 2, 99], [0, 0, 2]]);
        // A third triangle on the edge 0–3, and one turned over beside the last square.
        triangles.extend([[0, 3, 8], [5, 4, 8]]);
        let topology = Topology::new(&positions, &triangles);
        assert_eq!((topology.flaws.degenerate, topology.flaws.doubled), (4, 1));
        assert_eq!(topology.triangles.len(), sound + 2);
        assert_eq!((topology.flaws.branching_edges, topology.flaws.flipped_edges), (1, 0));
        assert_eq!(topology.given[sound..], [9, 10]);
        triangles.push([4, 5, 6]);
        assert_eq!(Topology::new(&positions, &triangles).flaws.branching_edges, 2);
        let (positions, mut triangles) = strip(1);
        triangles[1].swap(0, 1);
        assert_eq!(Topology::new(&positions, &triangles).flaws.flipped_edges, 1);
    }

    #[test]
    fn a_fan_goes_round_its_vertex() {
        // A pyramid without its base, apex 4.
        let positions = [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y, DVec3::Z];
        let triangles = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
        let topology = Topology::new(&positions, &triangles);
        let (fan, closed) = topology.fan(3 * 2 + 2);
        assert!(closed);
        let to: Vec<u32> = fan.iter().map(|&edge| topology.ends(edge).1).collect();
        assert_eq!(to, [2, 3, 0, 1]);
        assert!(fan.iter().all(|&edge| topology.ends(edge).0 == 4));
        let (fan, closed) = topology.fan(3);
        assert_eq!((fan.len(), closed), (2, false));
        assert_eq!(fan.iter().map(|&edge| topology.ends(edge)).collect::<Vec<_>>(), [(1, 2), (1, 4)]);
    }

    #[test]
    fn nothing_is_a_topology_too() {
        let topology = Topology::new(&[], &[]);
        assert_eq!((topology.parts(), topology.triangles.len()), (0, 0));
    }
}
