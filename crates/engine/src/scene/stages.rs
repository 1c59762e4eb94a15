//! Which stages a plan runs.

use crate::percept::Outputs;

/// Which stages run beside calibrate and contact, which every percept needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stages {
    pub(crate) centroid: bool,
    pub(crate) orientation: bool,
    pub(crate) principal_axis: bool,
    pub(crate) hysteresis: bool,
    pub(crate) motion: bool,
    pub(crate) position: bool,
    pub(crate) world_motion: bool,
    pub(crate) self_contacts: bool,
    pub(crate) force: bool,
    /// Whether percepts keep the taxels' pressures, for stages on the host.
    pub(crate) pressures: bool,
    pub(crate) filter: bool,
    pub(crate) sigma: bool,
    /// Letters that are not made of pressures.
    pub(crate) senses: bool,
}

impl Stages {
    /// The stages that `outputs` need. Whether there is hysteresis is the calibration's to say, and what other letters there are the
    /// taxels'.
    pub(super) fn for_outputs(outputs: Outputs) -> Self {
        let wants = |stage| outputs.intersects(Outputs::of_stage(stage));
        let world_motion = wants("world_motion");
        let position = wants("position") || world_motion;
        let [orientation, principal_axis, motion, filter, force, sigma] =
            ["orientation", "principal_axis", "motion", "filter", "force", "sigma"].map(wants);
        let centroid = wants("centroid") || position || orientation || principal_axis || motion || filter;
        Self {
            centroid,
            orientation,
            principal_axis,
            hysteresis: false,
            motion,
            position,
            world_motion,
            self_contacts: outputs.contains(Outputs::SELF_CONTACTS),
            force,
            // Touches of the whole body keep them too.
            pressures: force,
            filter,
            sigma,
            senses: false,
        }
    }
}
