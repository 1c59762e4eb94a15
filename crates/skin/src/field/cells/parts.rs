//! The surface as triangles that are each in one cell.

use glam::DVec3;

use super::polygon::Side;
use crate::body::{NONE, Topology};

/// A triangle that is in several cells.
const SEVERAL: u32 = NONE - 1;

/// What is in which cell.
#[derive(Default)]
pub(super) struct Parts {
    /// Triangles that are all in the cell of one point.
    wholes: Vec<(u32, u32)>,
    /// Polygons: their triangle, their point, and the number of corners.
    polygons: Vec<(u32, u32, u32)>,
    /// The corners of the polygons, one polygon after the other, in the triangle's barycentric coordinates.
    corners: Vec<DVec3>,
}

/// The point of a triangle with barycentric coordinates `at`.
pub(super) fn corner_at([a, b, c]: [DVec3; 3], at: DVec3) -> DVec3 {
    a * at.x + b * at.y + c * at.z
}

impl Parts {
    pub(super) fn add_whole(&mut self, triangle: u32, point: u32) {
        self.wholes.push((triangle, point));
    }

    pub(super) fn add_polygon(&mut self, triangle: u32, point: u32, polygon: &[Side]) {
        self.polygons.push((triangle, point, polygon.len() as u32));
        self.corners.extend(polygon.iter().map(|side| side.from));
    }

    /// The parts of `cut`, each with its point. A triangle of `given` all of whose parts (`parent` has the triangle of each) are
    /// in one cell is not cut.
    pub(super) fn triangles(
        &self,
        cut: &Topology,
        parent: impl Fn(u32) -> u32,
        given: &Topology,
    ) -> Vec<(u32, [DVec3; 3])> {
        let mut owner = vec![NONE; given.triangles.len()];
        for &(triangle, point) in &self.wholes {
            let known = &mut owner[parent(triangle) as usize];
            *known = if *known == NONE || *known == point { point } else { SEVERAL };
        }
        for &(triangle, ..) in &self.polygons {
            owner[parent(triangle) as usize] = SEVERAL;
        }
        let mut found = Vec::with_capacity(self.wholes.len().min(given.triangles.len()) + 2 * self.polygons.len());
        let whole = (0..).zip(&owner).filter(|(_, owner)| **owner < SEVERAL);
        found.extend(whole.map(|(triangle, &point)| (point, given.corners(triangle))));
        let part = self.wholes.iter().filter(|(triangle, _)| owner[parent(*triangle) as usize] == SEVERAL);
        found.extend(part.map(|&(triangle, point)| (point, cut.corners(triangle))));
        let mut first = 0;
        for &(triangle, point, count) in &self.polygons {
            let corners = cut.corners(triangle);
            let polygon = &self.corners[first..first + count as usize];
            first += count as usize;
            let fan = polygon.windows(2).skip(1).map(|pair| [polygon[0], pair[0], pair[1]]);
            found.extend(fan.map(|weights| (point, weights.map(|at| corner_at(corners, at)))));
        }
        found
    }
}
