//! What is right, beside what a backend says.

use super::host::Side;
use crate::backend::reference::{CellBound, Reference};
use crate::percept::{Percepts, Precision};
use crate::scene::Plan;

/// The reference's side of a comparison.
pub(super) struct Check {
    pub(super) reference: Reference,
    pub(super) side: Side,
    pub(super) right: Percepts,
    pub(super) bounds: Vec<CellBound>,
    /// Those of the frame before, where percepts are kept.
    pub(super) last_bounds: Vec<CellBound>,
}

impl Check {
    pub(super) fn new(plan: &Plan) -> Self {
        Self {
            reference: Reference::new(plan),
            side: Side::new(plan.fields.len()),
            right: Percepts::new(plan.outputs, plan.fields.len(), Precision::F64)
                .with_columns(plan.columns, plan.kept_pressures())
                .with_letters(plan.letters().len()),
            bounds: Vec::new(),
            last_bounds: Vec::new(),
        }
    }
}
