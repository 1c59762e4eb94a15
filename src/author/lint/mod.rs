//! Finds problems of a valid layout, each with its place and remedy.

mod checks;
mod finding;
mod large;

pub use checks::lint;
pub(super) use checks::{SurfaceFit, drift};
pub use finding::{Finding, FindingKind};
#[cfg(feature = "meshes")]
pub(crate) use large::MAX_LIKELY_LINK_M;
