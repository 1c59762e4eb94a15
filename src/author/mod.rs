//! Authoring: placing taxels on a surface and grouping them into fields.
//!
//! [`author`] does all of it to a file, as a [`Recipe`] says; the pieces are here too. [`place_evenly`] and its kin place
//! points on triangles, [`group::group`] makes fields of a body's taxels, [`lint()`] finds what is wrong with a layout:
//!
//! ```
//! use glam::DVec3;
//! use somatic::author::place_evenly;
//!
//! // A sheet of 0.2 m × 0.1 m with 50 taxels on it.
//! let corners = [(0.0, 0.0), (0.2, 0.0), (0.2, 0.1), (0.0, 0.1)].map(|(x, y)| DVec3::new(x, y, 0.0));
//! let placed = place_evenly(&corners, &[[0, 1, 2], [0, 2, 3]], 50, 1)?;
//! let shared: f64 = placed.iter().map(|p| p.point.area).sum();
//! assert!(placed.len() == 50 && (shared - 0.02).abs() < 1e-9);
//! # Ok::<(), somatic::Error>(())
//! ```
//!
//! Everything here gives the same answer on every machine: arithmetic is `+ − × ÷ √`, randomness is seeded, and ties
//! go to the lower index.

mod canvas;
mod carry;
mod cells;
mod coverage;
mod crowd;
mod glob;
mod grid;
mod ground;
pub mod group;
pub mod icub;
mod lattice;
mod lint;
mod place;
mod points;
pub(crate) mod random;
mod recipe;
mod refresh;
mod region;
mod scatter;
mod skin;
pub mod words;

use glam::DVec3;

pub use carry::{blend_skinning, heaviest_four};
pub use coverage::{Coverage, Hole, LinkCoverage, coverage};
pub use lint::{Finding, FindingKind, lint};
pub use place::{Placed, place_apart, place_by_density, place_evenly, widest_radius};
pub use recipe::Recipe;
pub use refresh::refresh;
pub use skin::{Authored, PlaceReport, author};

/// A point of a surface that a taxel sits on, or could. Coordinates are those of the mesh it was made from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Where it is, m.
    pub position: DVec3,
    /// Outward unit normal.
    pub normal: DVec3,
    /// Surface that is nearer to it than to any other, m².
    pub area: f64,
}
