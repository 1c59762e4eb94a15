//! Groups taxels into fields by rules.
//!
//! Rules are applied in order, each to the taxels of a body and the fields of earlier rules; see [`FieldRule`]. The result
//! can be written into the body's file.

mod axis;
mod chart_notes;
mod charts;
mod choose;
mod distances;
mod divide;
mod even;
mod grouper;
mod halves;
mod link_names;
mod net;
mod painted;
mod patches;
mod rule;
mod side_names;
mod usual;

pub use charts::MAX_PLANE_DISTORTION;
pub use grouper::{Grouper, Grouping, group};
pub(super) use painted::FilePaint;
pub use painted::Painted;
pub use rule::{ChartWish, Each, FieldRule, Patches, Rows, Seeds, Wrap};
