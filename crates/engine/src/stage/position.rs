//! **position**: the centroid on the surface, with the outward normal there.
//!
//! A chart's (u, v) goes back to the skin through a [`Surface`]; a field without a chart gives the mean place itself, and
//! no normal. With a pose in the frame both go on into the world.
//!
//! This stage is the host's, in f64, on every backend: a body ten kilometres from its origin keeps its millimetres, which
//! single precision could not.
//!
//! **Bound.** The surface is Lipschitz in (u, v): |δp| ≤ L·‖δc‖ with L the grid's steepest change.

use glam::{DVec2, DVec3};

use crate::field::{Chart, Lift};

/// The surface over a field's chart, in the anchor's frame: [`Lift`] with its nodes turned beforehand.
#[derive(Clone, Debug)]
pub struct Surface {
    corner: DVec2,
    cells_per_m: DVec2,
    /// Cells a row, and rows of them.
    cells: [usize; 2],
    axes: [DVec3; 2],
    /// The chart's own normal, for where those of the nodes cancel out.
    normal: DVec3,
    /// Row by row.
    nodes: Vec<Node>,
    lipschitz: (f64, f64),
}

/// A point less its part along the chart's axes, m, and the normal there, with zeros between them: a whole number of vectors.
type Node = [f64; 8];

impl Surface {
    /// What `lift` has over `chart`, whose origin is at `origin_in_anchor` (m).
    pub(crate) fn new(chart: &Chart, lift: &Lift, origin_in_anchor: DVec3) -> Self {
        let grid = lift.grid();
        let node = |&(beyond, normal): &(DVec3, DVec3)| {
            let (point, normal) = (origin_in_anchor + chart.unproject(beyond), chart.unproject(normal));
            [point.x, point.y, point.z, 0.0, normal.x, normal.y, normal.z, 0.0]
        };
        Self {
            corner: grid.corner,
            cells_per_m: grid.cell_m.recip(),
            cells: [grid.columns - 1, grid.rows - 1],
            axes: [chart.unproject(DVec3::X), chart.unproject(DVec3::Y)],
            normal: chart.unproject(DVec3::Z),
            nodes: grid.nodes.iter().map(node).collect(),
            lipschitz: lift.lipschitz(),
        }
    }

    /// The point at `place` (m, in the chart) and the outward unit normal there; beyond the grid, those of its rim.
    pub fn at(&self, place: DVec2) -> (DVec3, DVec3) {
        let (point, normal) = self.read(place);
        (point, unit(normal, inverse_length(normal), Some(self)))
    }

    /// The same with a normal that is still to be brought to unit length, by [`unit`].
    #[inline(always)]
    pub(crate) fn read(&self, place: DVec2) -> (DVec3, DVec3) {
        // The cell, and how far into it.
        let along = |place: f64, corner: f64, per_m: f64, cells: usize| {
            let at = ((place - corner) * per_m).max(0.0).min(cells as f64);
            let cell = (at as usize).min(cells - 1);
            (cell, at - cell as f64)
        };
        let (column, x) = along(place.x, self.corner.x, self.cells_per_m.x, self.cells[0]);
        let (row, y) = along(place.y, self.corner.y, self.cells_per_m.y, self.cells[1]);
        let first = row * (self.cells[0] + 1) + column;
        let ([a, b], [c, d]) = (self.pair(first), self.pair(first + self.cells[0] + 1));
        let mut mixed = [0.0; 8];
        for i in 0..8 {
            let (below, above) = (a[i] + (b[i] - a[i]) * x, c[i] + (d[i] - c[i]) * x);
            mixed[i] = below + (above - below) * y;
        }
        let [along_u, along_v] = self.axes;
        let point = DVec3::new(mixed[0], mixed[1], mixed[2]) + along_u * place.x + along_v * place.y;
        (point, DVec3::new(mixed[4], mixed[5], mixed[6]))
    }

    /// Two nodes side by side.
    #[inline(always)]
    fn pair(&self, first: usize) -> &[Node; 2] {
        self.nodes[first..].first_chunk().expect("a cell has a node on either side")
    }

    /// How far position and normal may be off when (u, v) is off by `place` (m).
    pub(crate) fn bound(&self, place: f64) -> (f64, f64) {
        let (point, normal) = self.lipschitz;
        // The last term is the f64 arithmetic of the grid itself.
        (place * point + 1e-12, place * normal + 1e-12)
    }
}

/// 1/‖normal‖; infinite where that has no length.
#[inline(always)]
pub(crate) fn inverse_length(normal: DVec3) -> f64 {
    1.0 / normal.length_squared().sqrt()
}

/// `normal` as a unit vector: the chart's own where those of `surface` cancel out, and none where there is no surface.
#[inline(always)]
pub(crate) fn unit(normal: DVec3, inverse_length: f64, surface: Option<&Surface>) -> DVec3 {
    if inverse_length < f64::INFINITY {
        normal * inverse_length
    } else {
        surface.map_or(DVec3::ZERO, |surface| surface.normal)
    }
}
