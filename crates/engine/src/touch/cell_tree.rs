//! The surface by cell, for the point of some cells that is nearest to a place.
//!
//! Each cell has its triangles in chunks with boxes around them, in single precision about the cell's taxel: a corner is off by
//! a part in 2²⁴ of its distance from there, some nanometres. A taxel is on its own cell, so that the nearest taxel of a touch bounds
//! the search: few cells are looked into, and few of their chunks.

use std::collections::HashMap;

use glam::DVec3;

use crate::body::nearest_on_triangle;

/// Maximum number of triangles in a chunk.
const CHUNK: usize = 8;

/// Boxes are widened by this share of their cell's reach, for rounding.
const WIDER: f64 = 1e-6;

/// The surface in the cells of taxels.
#[derive(Clone, Debug, Default)]
pub(super) struct CellTree {
    cells: Vec<Cell>,
    chunks: Vec<Chunk>,
    corners: Vec<[f32; 3]>,
    /// Indices of corners, from the first one of the cell.
    triangles: Vec<[u32; 3]>,
}

/// The part of the surface that belongs to a taxel.
#[derive(Clone, Copy, Debug)]
struct Cell {
    /// The taxel's place, from which corners are counted.
    origin: DVec3,
    /// Distance of the farthest corner from there, m.
    reach_m: f64,
    chunks: [u32; 2],
    first_corner: u32,
}

/// A box with some triangles in it, counted from the cell's origin.
#[derive(Clone, Copy, Debug)]
struct Chunk {
    low: [f32; 3],
    high: [f32; 3],
    triangles: [u32; 2],
}

/// A point of the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Nearest {
    pub(super) position: DVec3,
    pub(super) squared_m2: f64,
    /// The taxel whose cell it is in.
    pub(super) node: u32,
}

impl CellTree {
    /// The cells of taxels at `origins`; `triangles` are the surface, each with its taxel, of `origins.len()` ones.
    pub(super) fn new(origins: &[DVec3], triangles: &[(u32, [DVec3; 3])]) -> Self {
        let mut of_cell: Vec<Vec<u32>> = vec![Vec::new(); origins.len()];
        (0..).zip(triangles).for_each(|(index, (node, _))| of_cell[*node as usize].push(index));
        let mut tree = Self::default();
        let mut known: HashMap<[u32; 3], u32> = HashMap::new();
        for (&origin, own) in origins.iter().zip(&of_cell) {
            let mut own: Vec<[[f32; 3]; 3]> = own
                .iter()
                .map(|&index| triangles[index as usize].1.map(|corner| (corner - origin).as_vec3().to_array()))
                .filter(|corners| corners.iter().flatten().all(|x| x.is_finite()))
                .collect();
            let corners = own.iter().flatten().map(|&corner| from_f32(corner).length());
            let reach_m = corners.fold(0.0, f64::max) * (1.0 + WIDER);
            known.clear();
            let (first_chunk, first_corner) = (tree.chunks.len() as u32, tree.corners.len() as u32);
            tree.divide(&mut own, &mut known, first_corner, reach_m);
            let chunks = [first_chunk, tree.chunks.len() as u32];
            tree.cells.push(Cell { origin, reach_m, chunks, first_corner });
        }
        tree.chunks.shrink_to_fit();
        tree.corners.shrink_to_fit();
        tree.triangles.shrink_to_fit();
        tree
    }

    /// Puts `own` into chunks, those that are near each other into the same.
    fn divide(&mut self, own: &mut [[[f32; 3]; 3]], known: &mut HashMap<[u32; 3], u32>, first: u32, reach_m: f64) {
        if own.len() > CHUNK {
            let (low, high) = bounds(own);
            let size: [f32; 3] = std::array::from_fn(|axis| high[axis] - low[axis]);
            let axis = (1..3).fold(0, |most, axis| if size[axis] > size[most] { axis } else { most });
            // Whole chunks on the left, so that few are nearly empty.
            let half = (own.len() / 2).next_multiple_of(CHUNK).min(own.len() - 1);
            let middle = |corners: &[[f32; 3]; 3]| corners[0][axis] + corners[1][axis] + corners[2][axis];
            own.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
            let (left, right) = own.split_at_mut(half);
            self.divide(left, known, first, reach_m);
            self.divide(right, known, first, reach_m);
            return;
        }
        if own.is_empty() {
            return;
        }
        let (low, high) = bounds(own);
        let wider = (WIDER * reach_m) as f32;
        let from = self.triangles.len() as u32;
        for triangle in own.iter() {
            let indices = triangle.map(|corner| {
                *known.entry(corner.map(f32::to_bits)).or_insert_with(|| {
                    self.corners.push(corner);
                    self.corners.len() as u32 - 1 - first
                })
            });
            self.triangles.push(indices);
        }
        let triangles = [from, self.triangles.len() as u32];
        self.chunks.push(Chunk { low: low.map(|x| x - wider), high: high.map(|x| x + wider), triangles });
    }

    /// Whether the taxel has any surface.
    pub(super) fn has_surface(&self, node: u32) -> bool {
        self.cells.get(node as usize).is_some_and(|cell| cell.chunks[0] < cell.chunks[1])
    }

    /// The point of the cells of `nodes` that is nearest to `p`; of equally near ones the first. It is quick where the first of
    /// `nodes` is the taxel nearest to `p`.
    pub(super) fn nearest(&self, nodes: impl Iterator<Item = u32>, p: DVec3) -> Option<Nearest> {
        let mut best: Option<Nearest> = None;
        let mut least_m = f64::INFINITY;
        for node in nodes {
            let Some(cell) = self.cells.get(node as usize).filter(|_| self.has_surface(node)) else { continue };
            let local = p - cell.origin;
            // The distance of the cell is at least this.
            if local.length() - cell.reach_m > least_m {
                continue;
            }
            for chunk in &self.chunks[cell.chunks[0] as usize..cell.chunks[1] as usize] {
                let squared_m2 = best.map_or(f64::INFINITY, |best| best.squared_m2);
                if box_squared(chunk, local) > squared_m2 {
                    continue;
                }
                self.search(cell, chunk, local, node, &mut best);
            }
            least_m = best.map_or(f64::INFINITY, |best| best.squared_m2.sqrt());
        }
        best
    }

    fn search(&self, cell: &Cell, chunk: &Chunk, local: DVec3, node: u32, best: &mut Option<Nearest>) {
        for &triangle in &self.triangles[chunk.triangles[0] as usize..chunk.triangles[1] as usize] {
            let point = nearest_on_triangle(self.corners_of(cell, triangle), local);
            let squared_m2 = point.distance_squared(local);
            // One that single precision makes a point or a line of may have no nearest point.
            if squared_m2 < best.map_or(f64::INFINITY, |best| best.squared_m2) {
                *best = Some(Nearest { position: cell.origin + point, squared_m2, node });
            }
        }
    }

    fn corners_of(&self, cell: &Cell, triangle: [u32; 3]) -> [DVec3; 3] {
        triangle.map(|corner| from_f32(self.corners[(cell.first_corner + corner) as usize]))
    }

    /// The triangles in the cell of `node`, about its taxel.
    pub(super) fn triangles_about(&self, node: u32) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        let cell = &self.cells[node as usize];
        let chunks = &self.chunks[cell.chunks[0] as usize..cell.chunks[1] as usize];
        let of_chunk = |chunk: &Chunk| &self.triangles[chunk.triangles[0] as usize..chunk.triangles[1] as usize];
        chunks.iter().flat_map(of_chunk).map(|&triangle| self.corners_of(cell, triangle))
    }

    /// Memory that it takes, bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.cells[..])
            + size_of_val(&self.chunks[..])
            + size_of_val(&self.corners[..])
            + size_of_val(&self.triangles[..])
    }
}

fn from_f32(corner: [f32; 3]) -> DVec3 {
    DVec3::from_array(corner.map(f64::from))
}

fn bounds(triangles: &[[[f32; 3]; 3]]) -> ([f32; 3], [f32; 3]) {
    let mut ends = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for corner in triangles.iter().flatten() {
        for axis in 0..3 {
            ends.0[axis] = ends.0[axis].min(corner[axis]);
            ends.1[axis] = ends.1[axis].max(corner[axis]);
        }
    }
    ends
}

fn box_squared(chunk: &Chunk, p: DVec3) -> f64 {
    p.distance_squared(p.clamp(from_f32(chunk.low), from_f32(chunk.high)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number in [0, 1), the same every time.
    fn random(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1_u64 << 53) as f64
    }

    #[test]
    fn triangles_that_are_points_or_lines_are_no_place() {
        let (origin, thin) = (DVec3::ZERO, DVec3::X * 1e-12);
        let flat = [[origin; 3], [origin, DVec3::X, DVec3::X + thin], [DVec3::Y, DVec3::Y + thin, DVec3::Y]];
        let whole = [DVec3::Z, DVec3::Z + DVec3::X, DVec3::Z + DVec3::Y];
        let triangles: Vec<(u32, [DVec3; 3])> = flat.into_iter().chain([whole]).map(|corners| (0, corners)).collect();
        for p in [DVec3::new(0.2, 0.2, 0.9), DVec3::new(0.5, -0.1, 0.1), DVec3::Y, origin] {
            let nearest = CellTree::new(&[origin], &triangles).nearest([0].into_iter(), p).unwrap();
            assert!(nearest.position.is_finite() && nearest.squared_m2 <= p.distance_squared(DVec3::Z) + 1e-9, "{p}");
            let flat = CellTree::new(&[origin], &triangles[..3]).nearest([0].into_iter(), p);
            assert!(flat.is_none_or(|nearest| nearest.position.is_finite()));
        }
    }

    #[test]
    fn the_nearest_point_is_that_of_all_triangles_of_the_cells() {
        let mut state = 3;
        let mut anywhere = |size: f64| DVec3::from_array(std::array::from_fn(|_| size * (random(&mut state) - 0.5)));
        let origins: Vec<DVec3> = (0..40).map(|_| anywhere(1.0) + DVec3::splat(20.0)).collect();
        let triangles: Vec<(u32, [DVec3; 3])> = (0..3000_u32)
            .map(|index| {
                let node = index * index % 39;
                let middle = origins[node as usize] + anywhere(0.2);
                (node, [middle + anywhere(0.05), middle + anywhere(0.05), middle + anywhere(0.05)])
            })
            .collect();
        let tree = CellTree::new(&origins, &triangles);
        assert!(!tree.has_surface(39) && !tree.has_surface(40) && tree.has_surface(4));
        for case in 0..200 {
            let p = anywhere(1.2) + DVec3::splat(20.0);
            let nodes: Vec<u32> = (case % 7..40).step_by(1 + case as usize % 5).collect();
            let found = tree.nearest(nodes.iter().copied(), p);
            let own = triangles.iter().filter(|(node, _)| nodes.contains(node));
            let squared = own.map(|(_, corners)| nearest_on_triangle(*corners, p).distance_squared(p));
            let least = squared.fold(f64::INFINITY, f64::min);
            match found {
                Some(found) => {
                    assert!((found.squared_m2.sqrt() - least.sqrt()).abs() < 1e-7, "{case}");
                    assert!((found.position.distance_squared(p) - found.squared_m2).abs() < 1e-12);
                    assert!(nodes.contains(&found.node));
                }
                None => assert_eq!(least, f64::INFINITY),
            }
        }
        assert!(tree.nearest([39].into_iter(), DVec3::ZERO).is_none());
        assert_eq!((0..39).map(|node| tree.triangles_about(node).count()).sum::<usize>(), 3000);
    }

    #[test]
    fn a_million_triangles_fit_into_forty_megabytes() {
        // A sheet whose cells have 13 × 13 squares each, as those of 7,560 taxels on a million triangles have about.
        let side = 13_u32;
        let corner = |c: u32, r: u32| DVec3::new(f64::from(c), f64::from(r), 0.0) * 1e-3;
        let squares = (0..side).flat_map(|c| (0..side).map(move |r| (c, r)));
        let triangles: Vec<(u32, [DVec3; 3])> = squares
            .flat_map(|(c, r)| {
                let [a, b, d, e] = [corner(c, r), corner(c + 1, r), corner(c + 1, r + 1), corner(c, r + 1)];
                [(0, [a, b, d]), (0, [a, d, e])]
            })
            .collect();
        let tree = CellTree::new(&[DVec3::ZERO], &triangles);
        let per_triangle = tree.bytes() as f64 / triangles.len() as f64;
        assert!(per_triangle < 27.0, "{per_triangle} bytes");
    }
}
