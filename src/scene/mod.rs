//! Scenes: what a user asks for; and the plan made of it.

mod choose_fields;
mod curves;
mod explain;
mod filter;
mod knobs;
mod members;
mod plan;
mod slots;

pub use choose_fields::choose_fields;
pub use explain::PlannedStage;
pub use filter::MotionFilter;
pub use knobs::{Arithmetic, Cadence, Charts, Coordinates, Coverage, Knobs, OrientationBy};
pub use plan::Plan;
pub(crate) use plan::{PlanField, Stages};

use crate::error::{Error, Result};
use crate::percept::Outputs;
use crate::signal::Letter;
pub use crate::stage::filter::FilterBy;

/// What a user asks of a body.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
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
    /// By how much a pressure may change, in its unit, until the fields that hold it are computed again, behind the gate of
    /// [`Coverage::Touched`]; what goes to 0 or comes from it always counts. At 0 percepts are the same to the last bit.
    pub change_threshold: f64,
    /// In which frame positions and normals are given.
    pub coordinates: Coordinates,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            outputs: Outputs::USUAL,
            fields: Vec::new(),
            max_age_s: 0.0,
            max_gap_s: 10.0,
            letters: vec![Letter::default()],
            change_threshold: 0.0,
            coordinates: Coordinates::default(),
            filter: MotionFilter::default(),
            knobs: Knobs::default(),
        }
    }
}

setters!(Scene {
    outputs: Outputs,
    max_age_s: f64,
    max_gap_s: f64,
    letters: Vec<Letter>,
    filter: MotionFilter,
    knobs: Knobs,
    change_threshold: f64,
    coordinates: Coordinates,
});

impl Scene {
    /// The same with these [`Scene::fields`].
    #[must_use]
    pub fn fields(mut self, globs: impl IntoIterator<Item = impl Into<String>>) -> Self {
        self.fields = globs.into_iter().map(Into::into).collect();
        self
    }

    /// Refuses a threshold that is none, or that no gate heeds.
    fn check_threshold(&self) -> Result<()> {
        let threshold = self.change_threshold;
        if !(threshold.is_finite() && threshold >= 0.0) {
            return Err(Error::usage(format!(
                "the change threshold is {threshold}; it must be a pressure of 0 or more"
            )));
        }
        if threshold > 0.0 && self.knobs.coverage != Coverage::Touched {
            return Err(Error::usage("a change threshold needs coverage touched; ask for that too"));
        }
        Ok(())
    }
}
