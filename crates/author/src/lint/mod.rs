//! Finds problems of a valid layout, each with its place and remedy.

mod checks;
mod drawn_poses;
mod finding;
mod hidden;
mod hidden_findings;
mod large;
mod posed_surface;
mod shells;
mod spacing;
mod taxels_at_rest;
mod touchable;

pub(super) use checks::{SurfaceFit, drift, may_be_stale};
pub use checks::{lint, lint_in_poses, lint_with_progress};
pub use drawn_poses::DrawnPoses;
#[cfg(feature = "meshes")]
pub use drawn_poses::drawn_position;
pub use finding::{Finding, FindingKind, LinkShare};
#[cfg(feature = "meshes")]
pub(crate) use large::MAX_LIKELY_LINK_M;
pub(super) use posed_surface::BodyPoint;
pub(super) use touchable::Touchable;
