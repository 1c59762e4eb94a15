//! Scenes: what a user asks for; and the plan made of it.

mod asked;
mod choose_fields;
mod curves;
mod explain;
mod filter;
mod knobs;
mod layer;
mod left_out;
mod members;
mod onset;
mod plan;
mod sensed_taxels;
mod senses;
mod slots;
mod stages;

pub use asked::AskedOutputs;
pub use choose_fields::choose_fields;
pub use explain::PlannedStage;
pub use filter::MotionFilter;
pub use knobs::{Arithmetic, Cadence, Charts, Coordinates, Coverage, Knobs, OrientationBy};
pub(crate) use layer::{Around, REACH};
pub use plan::{Plan, PlanField, PlannedField};
pub use sensed_taxels::{SenseRanges, SensedTaxels, SensedValue};
pub use senses::receptor_of;
pub(crate) use senses::{SensedMember, outputs_of};
pub(crate) use stages::Stages;

use crate::body::Body;
use crate::error::{Error, Result, suggestion};
use crate::percept::{Outputs, TouchOutputs};
use crate::signal::Letter;
pub use crate::stage::filter::FilterBy;
use crate::touch;

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
    /// What taxels are read as; every field is computed once for each that its taxels have. None means the usual ones: the pressure
    /// itself, and shear, temperature and proximity where there are such taxels.
    pub letters: Vec<Letter>,
    /// Which motion counts, for [`Outputs::FILTERED`].
    pub filter: MotionFilter,
    /// What is traded for what.
    pub knobs: Knobs,
    /// In which frame positions and normals are given.
    pub coordinates: Coordinates,
    /// The link in whose frame everything is given instead of the world: poses are taken from there on.
    pub relative_to: Option<String>,
    /// What is asked of touches of the whole body ([`Percepts::touches`](crate::percept::Percepts::touches)): with it, every pressure taxel
    /// of the body is read, also where `fields` names few. `None` looks for no touches.
    pub touches: Option<touch::Options>,
    /// How far the places of two touches may be apart that are one contact, m; for [`Outputs::SELF_CONTACTS`]. `None` is that of
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
            letters: Vec::new(),
            coordinates: Coordinates::default(),
            relative_to: None,
            filter: MotionFilter::default(),
            knobs: Knobs::default(),
            touches: None,
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
    touches: impl Into<Option<touch::Options>>,
    contact_tolerance_m: Option<f64>,
});

impl Scene {
    /// What is asked of touches: self-contacts are made of them, and they have the fits that may stand for an orientation.
    pub(crate) fn asked_touches(&self) -> Option<touch::Options> {
        let fits = self.knobs.orientation_by.steps().is_some();
        let needed = fits || self.outputs.contains(Outputs::SELF_CONTACTS);
        let mut asked = self.touches.or_else(|| needed.then(touch::Options::default))?;
        if fits {
            asked.outputs |= TouchOutputs::FIT_PLACE | TouchOutputs::FIT_DIRECTION;
        }
        Some(asked)
    }

    /// The link that stands for the world, which `body` must have.
    fn checked_link(&self, body: &Body) -> Result<Option<String>> {
        let Some(link) = &self.relative_to else { return Ok(None) };
        if self.coordinates == Coordinates::Anchor {
            return Err(Error::usage(format!(
                "coordinates `anchor` leave every field in its own link, and `relative_to` puts all into `{link}`; leave one of them out"
            )));
        }
        if !body.links.iter().any(|of_body| of_body.name == *link) {
            let near = suggestion(link, body.links.iter().map(|of_body| of_body.name.as_str()));
            return Err(Error::usage(format!("the body has no link `{link}`; {near}")).at(&body.name));
        }
        Ok(Some(link.clone()))
    }

    /// Refuses outputs that are made of places in the world where none are given.
    fn check_world(&self) -> Result<()> {
        let of_world = self.outputs & (Outputs::SELF_CONTACTS | Outputs::SPEED_IN_WORLD);
        match of_world.names().next().filter(|_| self.coordinates == Coordinates::Anchor) {
            Some(name) => Err(Error::usage(format!(
                "`{name}` is made of places in the world; leave out coordinates `anchor`, or `{name}`"
            ))),
            None => Ok(()),
        }
    }

    /// The same with this [`Scene::relative_to`].
    #[must_use]
    pub fn relative_to(mut self, link: Option<impl Into<String>>) -> Self {
        self.relative_to = link.map(Into::into);
        self
    }

    /// The same with these [`Scene::fields`].
    #[must_use]
    pub fn fields(mut self, globs: impl IntoIterator<Item = impl Into<String>>) -> Self {
        self.fields = globs.into_iter().map(Into::into).collect();
        self
    }
}
