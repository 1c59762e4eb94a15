//! The shaders' text: one file a stage, each after what they share.

/// A stage's name and its whole WGSL.
pub(crate) struct StageShader {
    /// The stage, as everywhere.
    pub(crate) name: &'static str,
    /// WGSL, ready to compile.
    pub(crate) source: &'static str,
}

macro_rules! stage {
    ($name:literal $(, $shared:literal)*) => {
        StageShader {
            name: $name,
            source: concat!(
                include_str!("../../../shaders/shared/layout.wgsl"),
                $(include_str!(concat!("../../../shaders/shared/", $shared, ".wgsl")),)*
                include_str!(concat!("../../../shaders/", $name, ".wgsl")),
            ),
        }
    };
}

pub(crate) const CALIBRATE: StageShader = stage!("calibrate");
pub(crate) const CHANGE: StageShader = stage!("change");
pub(crate) const CONTACT: StageShader = stage!("contact", "over_fields");
pub(crate) const CENTROID: StageShader = stage!("centroid", "over_fields");
pub(crate) const ORIENTATION: StageShader = stage!("orientation", "angle", "line", "over_fields");
pub(crate) const AXIS: StageShader = stage!("axis", "angle", "line", "over_fields");
pub(crate) const HYSTERESIS: StageShader = stage!("hysteresis");
pub(crate) const MOTION: StageShader = stage!("motion", "angle");

/// All of them, in the order they run.
#[cfg(test)]
pub(crate) const ALL: [StageShader; 8] = [CALIBRATE, CHANGE, CONTACT, CENTROID, ORIENTATION, AXIS, HYSTERESIS, MOTION];
