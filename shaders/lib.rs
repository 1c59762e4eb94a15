//! The WGSL of somatic as text: a file a stage, what stages share, and what draws a body.
//!
//! `somatic-engine` puts them together and compiles them.

/// Of the stage `calibrate`.
pub const CALIBRATE: &str = include_str!("calibrate.wgsl");
/// Of the stage `centroid`.
pub const CENTROID: &str = include_str!("centroid.wgsl");
/// Of the stage `change`.
pub const CHANGE: &str = include_str!("change.wgsl");
/// Of the stage `contact`.
pub const CONTACT: &str = include_str!("contact.wgsl");
/// Of the stage `hysteresis`.
pub const HYSTERESIS: &str = include_str!("hysteresis.wgsl");
/// Of the stage `motion`.
pub const MOTION: &str = include_str!("motion.wgsl");
/// Of the stage `orientation`.
pub const ORIENTATION: &str = include_str!("orientation.wgsl");
/// Of the stage `principal_axis`.
pub const PRINCIPAL_AXIS: &str = include_str!("principal_axis.wgsl");

/// Files that programs of several stages begin with.
pub mod shared {
    /// `shared/angle.wgsl`.
    pub const ANGLE: &str = include_str!("shared/angle.wgsl");
    /// `shared/compensated.wgsl`.
    pub const COMPENSATED: &str = include_str!("shared/compensated.wgsl");
    /// `shared/few_members.wgsl`.
    pub const FEW_MEMBERS: &str = include_str!("shared/few_members.wgsl");
    /// `shared/four_cells.wgsl`.
    pub const FOUR_CELLS: &str = include_str!("shared/four_cells.wgsl");
    /// `shared/four_frames.wgsl`.
    pub const FOUR_FRAMES: &str = include_str!("shared/four_frames.wgsl");
    /// `shared/layout.wgsl`.
    pub const LAYOUT: &str = include_str!("shared/layout.wgsl");
    /// `shared/marks.wgsl`.
    pub const MARKS: &str = include_str!("shared/marks.wgsl");
    /// `shared/members.wgsl`.
    pub const MEMBERS: &str = include_str!("shared/members.wgsl");
    /// `shared/narrow_fields.wgsl`.
    pub const NARROW_FIELDS: &str = include_str!("shared/narrow_fields.wgsl");
    /// `shared/one_cell.wgsl`.
    pub const ONE_CELL: &str = include_str!("shared/one_cell.wgsl");
    /// `shared/one_frame.wgsl`.
    pub const ONE_FRAME: &str = include_str!("shared/one_frame.wgsl");
    /// `shared/over_fields.wgsl`.
    pub const OVER_FIELDS: &str = include_str!("shared/over_fields.wgsl");
    /// `shared/pressures.wgsl`.
    pub const PRESSURES: &str = include_str!("shared/pressures.wgsl");
    /// `shared/raw_pressures.wgsl`.
    pub const RAW_PRESSURES: &str = include_str!("shared/raw_pressures.wgsl");
    /// `shared/scale.wgsl`.
    pub const SCALE: &str = include_str!("shared/scale.wgsl");
    /// `shared/wide_fields.wgsl`.
    pub const WIDE_FIELDS: &str = include_str!("shared/wide_fields.wgsl");
}

/// What draws.
pub mod picture {
    /// A body and the marks on it.
    pub const BODY: &str = include_str!("picture/body.wgsl");
}

/// The stages that have a file.
pub const STAGES: [&str; 8] =
    ["calibrate", "centroid", "change", "contact", "hysteresis", "motion", "orientation", "principal_axis"];
