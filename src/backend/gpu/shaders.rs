//! The shaders' text: one file a stage, after what they share. The stages from contact to axis are one program.

/// A program's name, the stages that it computes, and its whole WGSL.
pub(crate) struct Shader {
    /// For people who look at the device's own log.
    pub(crate) name: &'static str,
    /// The stages, as everywhere.
    #[cfg_attr(not(test), expect(dead_code, reason = "tests hold the files of the stages to it"))]
    pub(crate) stages: &'static [&'static str],
    /// WGSL, ready to compile.
    pub(crate) source: &'static str,
}

macro_rules! shader {
    ($name:literal: $($stage:literal),+; $($shared:literal),*) => {
        Shader {
            name: $name,
            stages: &[$($stage),+],
            source: concat!(
                include_str!("../../../shaders/shared/layout.wgsl"),
                $(include_str!(concat!("../../../shaders/shared/", $shared, ".wgsl")),)*
                $(include_str!(concat!("../../../shaders/", $stage, ".wgsl")),)+
            ),
        }
    };
}

pub(crate) const CALIBRATE: Shader = shader!("calibrate": "calibrate";);
pub(crate) const CHANGE: Shader = shader!("change": "change";);
pub(crate) const FIELDS: Shader = shader!(
    "fields": "contact", "centroid", "orientation", "axis"; "pressures", "members", "angle", "line", "over_fields",
    "compensated");
/// The same for plans of at most [`crate::stage::layout::FEW`] memberships.
pub(crate) const FEW_FIELDS: Shader = shader!(
    "few fields": "contact", "centroid", "orientation", "axis"; "pressures", "few_members", "angle", "line", "over_fields", "compensated");
/// Both where raw values are pressures, which are then read as they came.
pub(crate) const RAW_FIELDS: Shader = shader!(
    "raw fields": "contact", "centroid", "orientation", "axis"; "raw_buffer", "raw_pressures", "members", "angle", "line",
    "over_fields", "compensated");
pub(crate) const FEW_RAW_FIELDS: Shader = shader!(
    "few raw fields": "contact", "centroid", "orientation", "axis"; "raw_buffer", "raw_pressures", "few_members", "angle", "line",
    "over_fields", "compensated");
/// Those on processors that stand in for a GPU.
pub(crate) const TEXTURE_FIELDS: Shader = shader!(
    "texture fields": "contact", "centroid", "orientation", "axis"; "raw_texture", "raw_pressures", "members", "angle", "line",
    "over_fields", "compensated");
pub(crate) const FEW_TEXTURE_FIELDS: Shader = shader!(
    "few texture fields": "contact", "centroid", "orientation", "axis"; "raw_texture", "raw_pressures", "few_members", "angle", "line",
    "over_fields", "compensated");
pub(crate) const HYSTERESIS: Shader = shader!("hysteresis": "hysteresis";);
pub(crate) const MOTION: Shader = shader!("motion": "motion"; "angle");

/// All of them, in the order they run.
#[cfg(test)]
pub(crate) const ALL: [Shader; 10] = [
    CALIBRATE,
    CHANGE,
    FIELDS,
    FEW_FIELDS,
    RAW_FIELDS,
    FEW_RAW_FIELDS,
    TEXTURE_FIELDS,
    FEW_TEXTURE_FIELDS,
    HYSTERESIS,
    MOTION,
];
