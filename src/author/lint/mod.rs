//! Finds problems of a valid layout, each with its place and remedy.

mod checks;
mod finding;

pub use checks::lint;
pub(super) use checks::{SurfaceFit, drift};
pub use finding::{Finding, FindingKind};
