//! Which stages a plan runs.

use crate::percept::Outputs;

/// Which stages run beside calibrate and contact, which every percept needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stages {
    pub(crate) centroid: bool,
    pub(crate) orientation: bool,
    pub(crate) axis: bool,
    pub(crate) hysteresis: bool,
    pub(crate) motion: bool,
    pub(crate) position: bool,
    pub(crate) world_motion: bool,
    pub(crate) touches: bool,
    pub(crate) contacts: bool,
    pub(crate) force: bool,
    /// Whether percepts keep the taxels' pressures, for stages on the host.
    pub(crate) pressures: bool,
    pub(crate) filter: bool,
    pub(crate) sigma: bool,
    pub(crate) footprint: bool,
}

impl Stages {
    /// The stages that `outputs` need. Whether there is hysteresis is the calibration's to say.
    pub(super) fn of(outputs: Outputs) -> Self {
        let wants = |stage| outputs.intersects(Outputs::of_stage(stage));
        let footprint = wants("footprint");
        let touches = outputs.contains(Outputs::TOUCHES) || footprint;
        let world_motion = wants("world_motion");
        let position = wants("position") || touches || world_motion;
        let [orientation, axis, motion, filter, force, sigma] =
            ["orientation", "axis", "motion", "filter", "force", "sigma"].map(wants);
        let centroid = wants("centroid") || position || orientation || axis || motion || filter;
        let pressures = touches || force;
        Self {
            centroid,
            orientation,
            axis,
            hysteresis: false,
            motion,
            position,
            world_motion,
            touches,
            contacts: outputs.contains(Outputs::CONTACTS),
            force,
            pressures,
            filter,
            sigma,
            footprint,
        }
    }
}
