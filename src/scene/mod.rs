//! Scenes: what a user asks for; and the plan made of it.

mod choose_fields;
mod curves;
mod explain;
mod filter;
mod knobs;
mod members;
mod onset;
mod plan;
mod skin;
mod slots;
mod stages;

pub use choose_fields::choose_fields;
pub use explain::PlannedStage;
pub use filter::MotionFilter;
pub use knobs::{Arithmetic, Cadence, Charts, Coordinates, Coverage, Knobs, OrientationBy};
pub use plan::Plan;
pub(crate) use plan::PlanField;
pub(crate) use stages::Stages;

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
    /// In which frame positions and normals are given.
    pub coordinates: Coordinates,
    /// How far the places of two touches may be apart that are one contact, m; for [`Outputs::CONTACTS`]. `None` is that of
    /// [`crate::field::ContactTolerance`].
    pub contact_tolerance_m: Option<f64>,
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            outputs: Outputs::USUAL,
            fields: Vec::new(),
            max_age_s: 0.0,
            max_gap_s: 10.0,
            letters: vec![Letter::default()],
            coordinates: Coordinates::default(),
            filter: MotionFilter::default(),
            knobs: Knobs::default(),
            contact_tolerance_m: None,
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
    coordinates: Coordinates,
    contact_tolerance_m: Option<f64>,
});

impl Scene {
    /// The same with these [`Scene::fields`].
    #[must_use]
    pub fn fields(mut self, globs: impl IntoIterator<Item = impl Into<String>>) -> Self {
        self.fields = globs.into_iter().map(Into::into).collect();
        self
    }
}
