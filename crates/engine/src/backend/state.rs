//! What a backend's next frame depends on beside its values, the same for all backends.

use glam::DVec2;

use crate::percept::{Outputs, Percepts, Values};
use crate::scene::Plan;
use crate::signal::RawValue;
use crate::stage::motion::Centroid;

/// What the frames so far leave for the next one.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BackendState {
    /// The last frame's raw values by channel, for letters of change.
    pub(crate) raw: Vec<RawValue>,
    pub(crate) fields: Vec<FieldState>,
}

/// The same of one field.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct FieldState {
    /// Whether the last frame was in contact, for hysteresis.
    pub(crate) contact: bool,
    /// The last frame's centroid, m, for motion; `None` out of contact, without a chart, or if unknown.
    pub(crate) centroid: Option<Centroid>,
}

impl BackendState {
    /// The state before the first frame of `plan`.
    pub(crate) fn initial(plan: &Plan) -> Self {
        Self { raw: vec![RawValue::MISSING; plan.channels()], fields: vec![FieldState::default(); plan.fields.len()] }
    }
}

impl FieldState {
    /// By field, the state after frame `frame` of `percepts`, as far as these hold it.
    pub(crate) fn after(plan: &Plan, percepts: &Percepts, frame: usize) -> Vec<Self> {
        let needs_centroid = Outputs::CENTROID | Outputs::POSITION | Outputs::NORMAL | Outputs::FILTERED;
        let has_centroids =
            plan.outputs.intersects(needs_centroid) && plan.outputs.intersects(Outputs::ACTIVE | Outputs::FILTERED);
        let centroid = |cell: usize| {
            let [u, v, _] = match &percepts.values {
                Values::F32(columns) => columns.centroid(cell),
                Values::F64(columns) => columns.centroid(cell),
            };
            Centroid { place: DVec2::new(u, v), pressed: percepts.active[cell] }
        };
        let state = |field: usize| {
            let contact = percepts.in_contact(frame, field);
            let is_known = contact && plan.fields[field].charted && has_centroids;
            Self { contact, centroid: is_known.then(|| centroid(frame * plan.fields.len() + field)) }
        };
        (0..plan.fields.len()).map(state).collect()
    }
}
