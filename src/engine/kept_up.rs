//! What an engine keeps for the upkeep of its calibration.

use crate::scene::Plan;
use crate::signal::{Kept, Upkeep, UpkeepKeys};
use crate::stage::layout;

/// Upkeep, and what it needs of the engine.
pub(super) struct KeptUp {
    pub(super) upkeep: Upkeep,
    /// The taxels as the calibration has them, slot by slot.
    pub(super) made: Vec<layout::Taxel>,
    /// Per field, whether it was in contact in this epoch.
    pub(super) touched: Vec<bool>,
}

impl KeptUp {
    pub(super) fn new(plan: &Plan, keys: UpkeepKeys) -> Option<Self> {
        let taxels = plan.calibrations.iter().map(|c| Kept { baseline: c.baseline, raw_range: c.raw_range });
        Some(Self {
            upkeep: Upkeep::new(keys, taxels)?,
            made: plan.taxels.clone(),
            touched: vec![false; plan.fields.len()],
        })
    }
}
