//! hysteresis in f32; see [`crate::stage::hysteresis`].

use crate::percept::{CellsMut, Component, Flags, Outputs};
use crate::scene::Plan;

/// What a field says of its input, and of itself, whether it is touched or not. The last two are a change's here: motion
/// comes later.
const KEPT: Flags = Flags::SATURATED
    .union(Flags::FAULTY_INPUT)
    .union(Flags::OUT_OF_RANGE)
    .union(Flags::INCOMPLETE)
    .union(Flags::NO_CHART)
    .union(Flags::NO_PREVIOUS)
    .union(Flags::BAD_DT);
/// Quantities that an untouched field keeps.
const SUMS: Outputs = Outputs::of_stage("contact");

/// Goes through all `frames` in order; `touched` is each field's contact in the frame before, and becomes the last's.
pub(super) fn scan(plan: &Plan, frames: usize, cells: &mut CellsMut<'_>, touched: &mut [bool]) {
    let fields = plan.fields.len();
    for frame in 0..frames {
        for (index, (field, touched)) in plan.fields.iter().zip(touched.iter_mut()).enumerate() {
            let cell = frame * fields + index;
            let total = cells[Component::Total][cell];
            let [on, off] = field.thresholds.rounded();
            *touched = total > on || (*touched && total > off);
            if !*touched {
                cells.flags[cell] = (cells.flags[cell] & KEPT) | Flags::NO_CONTACT;
                cells.present[cell] &= SUMS.low();
            }
        }
    }
}
