//! Scenes: what a user asks for; and the plan made of it.

mod curves;
mod explain;
mod filter;
mod knobs;
mod plan;
mod slots;

pub use explain::PlannedStage;
pub use filter::MotionFilter;
pub use knobs::{Arithmetic, Cadence, Charts, Coverage, Knobs, OrientationBy};
pub use plan::{Plan, choose_fields};
pub(crate) use plan::{PlanField, Stages};

use crate::percept::Outputs;
use crate::signal::Letter;
pub use crate::stage::filter::FilterBy;

/// What a user asks of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The quantities wanted.
    pub outputs: Outputs,
    /// The fields wanted, as globs over their names (`hand/palm*`, `**/forearm/*`); none means all.
    pub fields: Vec<String>,
    /// How long a channel that is absent from a frame keeps its last value, s. Recordings say 0.
    pub max_age_s: f64,
    /// The longest step between frames over which motion is measured, s.
    pub max_gap_s: f64,
    /// What sensors are read as; every field is computed once for each. Usually one, the pressure itself.
    pub letters: Vec<Letter>,
    /// Which motion counts, for [`Outputs::FILTERED`].
    pub filter: MotionFilter,
    /// What is traded for what.
    pub knobs: Knobs,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            outputs: Outputs::USUAL,
            fields: Vec::new(),
            max_age_s: 0.0,
            max_gap_s: 10.0,
            letters: vec![Letter::default()],
            filter: MotionFilter::default(),
            knobs: Knobs::default(),
        }
    }
}
