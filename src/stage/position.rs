//! **position**: the centroid on the surface, with the outward normal there.
//!
//! A chart's (u, v) goes back to the skin through the field's [`Lift`]; a field without a chart gives the mean place
//! itself, and no normal. With a pose in the frame both go on into the world.
//!
//! This stage is the host's, in f64, on every backend: a body ten kilometres from its origin keeps its millimetres, which
//! single precision could not, and only percepts that are wanted and in contact pay for it.
//!
//! **Bound.** The lift is Lipschitz in (u, v): |δp| ≤ L·‖δc‖ with L the grid's steepest change.

use glam::{DVec2, DVec3};

use crate::field::{Chart, Lift};

/// The surface point at `place` (m, in the chart), and the normal there, both in the anchor's frame.
pub(crate) fn on_surface(chart: &Chart, lift: &Lift, origin_in_anchor: DVec3, place: DVec2) -> (DVec3, DVec3) {
    let (point, normal) = lift.at(place);
    (origin_in_anchor + chart.unproject(point), chart.unproject(normal))
}

/// How far position and normal may be off when (u, v) is off by `place` (m).
pub(crate) fn bound(lift: &Lift, place: f64) -> (f64, f64) {
    let (point, normal) = lift.lipschitz();
    // The last term is the f64 arithmetic of the lift itself.
    (place * point + 1e-12, place * normal + 1e-12)
}
