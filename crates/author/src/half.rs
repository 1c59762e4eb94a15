//! The left half of a surface, cut at the plane y = 0 of the world.

use std::collections::BTreeMap;

use glam::DVec3;

use super::rest_surface::RestSurface;

/// Corners nearer to the plane than this, over the largest coordinate, are on it: coordinates are single precision.
const ON_PLANE: f64 = 1e-6;

/// What is left of the plane, of some triangles.
pub(super) struct Half {
    /// The positions of the whole surface, and then the points where edges are cut.
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Per triangle the one of the whole surface that it is of.
    pub(super) chosen: Vec<usize>,
    /// Per vertex the group of surfaces that it is in.
    groups: Vec<u32>,
}

impl Half {
    /// Of the triangles `chosen` of `rest_surface`.
    pub(super) fn new(rest_surface: &RestSurface<'_>, chosen: &[usize]) -> Self {
        let positions = rest_surface.positions.clone();
        let groups = (0..).take(positions.len()).map(|vertex| rest_surface.group_of(vertex)).collect();
        let mut half = Self { positions, triangles: Vec::new(), chosen: Vec::new(), groups };
        let finite = half.positions.iter().filter(|p| p.is_finite());
        let on_plane_m = ON_PLANE * finite.map(|p| p.abs().max_element()).fold(0.0, f64::max);
        let mut cuts = BTreeMap::new();
        for &triangle in chosen {
            half.take(triangle, rest_surface.triangles[triangle], on_plane_m, &mut cuts);
        }
        half
    }

    pub(super) fn group_of(&self, vertex: u32) -> u32 {
        self.groups[vertex as usize]
    }

    /// Adds what is left of the plane of `triangle`, which has these `corners`; `cuts` has the points where edges are cut.
    fn take(&mut self, triangle: usize, corners: [u32; 3], on_plane_m: f64, cuts: &mut BTreeMap<(u32, u32), u32>) {
        let side = |corner: u32| match self.positions[corner as usize].x {
            x if x > on_plane_m => 1,
            x if x < -on_plane_m => -1,
            _ => 0,
        };
        let sides = corners.map(side);
        if !sides.contains(&1) {
            return;
        }
        let mut outline = Vec::with_capacity(4);
        for (corner, next) in [(0, 1), (1, 2), (2, 0)] {
            if sides[corner] >= 0 {
                outline.push(corners[corner]);
            }
            if sides[corner] * sides[next] < 0 {
                let [a, b] = [corners[corner], corners[next]];
                let (right, left) = if sides[corner] < 0 { (a, b) } else { (b, a) };
                outline.push(*cuts.entry((right, left)).or_insert_with(|| self.cut(right, left)));
            }
        }
        for pair in outline[1..].windows(2) {
            self.triangles.push([outline[0], pair[0], pair[1]]);
            self.chosen.push(triangle);
        }
    }

    /// Adds the point where the edge from the vertex `right` to the vertex `left` meets the plane.
    fn cut(&mut self, right: u32, left: u32) -> u32 {
        let [from, to] = [right, left].map(|vertex| self.positions[vertex as usize]);
        let point = from.lerp(to, from.x / (from.x - to.x));
        self.positions.push(DVec3 { x: 0.0, ..point });
        self.groups.push(self.groups[right as usize]);
        self.positions.len() as u32 - 1
    }
}
