//! motion in f32; see [`crate::stage::motion`].

use super::super::Step;
use crate::percept::{CellsMut, Flags, Outputs};
use crate::scene::{Plan, PlanField};
use crate::stage::angle::full_f32;

/// What the next frame asks of a field's centroid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Centroid {
    /// In the field's unit.
    place: [f32; 2],
    /// How many taxels are pressed.
    pressed: u32,
}

/// Goes through all frames in order; `last` is each field's centroid in the frame before, if it was in contact then, and
/// becomes the last frame's.
pub(super) fn scan(plan: &Plan, steps: &[Step], cells: &mut CellsMut<'_>, last: &mut [Option<Centroid>]) {
    let fields = plan.fields.len();
    for (frame, step) in steps.iter().enumerate() {
        for (index, (field, last)) in plan.fields.iter().zip(last.iter_mut()).enumerate() {
            let cell = frame * fields + index;
            if cells.flags[cell].intersects(Flags::NO_CONTACT | Flags::NO_CHART) {
                *last = None;
                continue;
            }
            let place = [cells.centroid_u[cell], cells.centroid_v[cell]].map(|metres| metres / field.unit_m);
            let now = Centroid { place, pressed: cells.active[cell] };
            match last.replace(now) {
                None => cells.flags[cell] |= Flags::NO_PREVIOUS,
                Some(_) if !step.flags.is_empty() => cells.flags[cell] |= step.flags,
                Some(before) => one(plan.outputs, field, cells, cell, now, before, step),
            }
        }
    }
}

/// A cell's motion from `before` to `now`.
fn one(
    outputs: Outputs,
    field: &PlanField,
    cells: &mut CellsMut<'_>,
    cell: usize,
    now: Centroid,
    before: Centroid,
    step: &Step,
) {
    let ([u, v], [u0, v0], unit_m) = (now.place, before.place, field.unit_m);
    let dt_s = step.dt_s as f32;
    let (du, dv) = (u - u0, v - v0);
    let distance = (du * du + dv * dv).sqrt();
    let radial = (u * u + v * v).sqrt() - (u0 * u0 + v0 * v0).sqrt();
    let mut found = Outputs::MOTION;
    if distance <= field.still.within_f32(now.pressed + before.pressed) {
        cells.flags[cell] |= Flags::STILL;
        found -= Outputs::DIRECTION;
    } else if let Some(direction) = cells.direction.get_mut(cell) {
        *direction = full_f32(du, dv);
    }
    let write = |column: &mut [f32], value: f32| {
        if let Some(place) = column.get_mut(cell) {
            *place = value;
        }
    };
    write(cells.distance, distance * unit_m);
    write(cells.radial_distance, radial * unit_m);
    write(cells.speed, distance / dt_s * unit_m);
    write(cells.radial_speed, radial / dt_s * unit_m);
    if let Some(displacement) = cells.displacement.get_mut(cell) {
        *displacement = [du * unit_m, dv * unit_m];
    }
    cells.present[cell] |= found & outputs;
}
