//! Geodesic coordinates: length and initial direction of shortest paths over a surface from one point.
//!
//! Exact on the triangles, by windows (Chen and Han 1990; Xin and Wang 2009): the triangles along a path are unfolded into
//! the plane of the first, where the path is a straight line from the origin. A window is the part of an edge that such
//! lines reach through one sequence of triangles. Paths bend only at vertices with more than a full turn of surface around
//! them, and at the surface's edge; new windows start there.

mod along_edges;
mod log_map;
mod place;
mod queue;
mod source;
mod walk;
mod waves;

pub use log_map::{FIRST_LIMIT, MAX_WINDOWS};
pub use log_map::{LogMap, Reached, Rival};
pub use place::SurfacePlace;
pub use place::barycentric;
pub(in crate::field) use source::Start;
pub use walk::{walk, walk_to_edge};
pub(in crate::field) use waves::Waves;

#[cfg(test)]
mod tests;
