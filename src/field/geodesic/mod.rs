//! Geodesic coordinates: the shortest way over a surface from one point to others, its length and its departure.
//!
//! Exact on the triangles as they are, by windows (Chen and Han 1990; Xin and Wang 2009): the triangles that straight
//! ways cross are unfolded one after the other into the plane of the first, so that a way is a straight line from the
//! origin there, and the place where it ends is at once its length and its direction. A window is the part of an edge
//! that such lines reach through one row of triangles. Ways bend only at vertices with more than a full turn of surface
//! around them, and at the surface's edge; windows start anew from there.

mod log_map;
mod place;
mod source;

pub use log_map::{LogMap, Reached, Rival};
pub use place::Place;
pub(crate) use place::barycentric;

#[cfg(test)]
mod tests;
