//! Authoring: placing taxels on a surface and grouping them into fields.
//!
//! [`author`] applies a [`Recipe`] to a file. The steps are available too: [`place_evenly`] and similar functions place
//! points on triangles, [`group::group`] groups a body's taxels into fields, [`lint()`] finds problems of a layout:
//!
//! ```
//! use glam::DVec3;
//! use somatic_author::place_evenly;
//!
//! // A sheet of 0.2 m × 0.1 m with 50 taxels on it.
//! let corners = [(0.0, 0.0), (0.2, 0.0), (0.2, 0.1), (0.0, 0.1)].map(|(x, y)| DVec3::new(x, y, 0.0));
//! let placed = place_evenly(&corners, &[[0, 1, 2], [0, 2, 3]], 50, 1, &mut |_| true)?;
//! let shared: f64 = placed.iter().map(|p| p.point.area).sum();
//! assert!(placed.len() == 50 && (shared - 0.02).abs() < 1e-9);
//! # Ok::<(), somatic_skin::Error>(())
//! ```
//!
//! Results are the same on every machine: arithmetic is `+ − × ÷ √`, randomness is seeded, and ties go to the lower index.
//!
//! It is a part of `somatic`, which has it as `somatic::author`; a program uses that.

#![deny(missing_docs)]
#![warn(unreachable_pub)]

mod borders;
mod cell_spread;
mod coverage;
mod fill;
mod fill_mirrored;
mod grid;
mod ground;
pub mod group;
mod half;
pub mod icub;
mod icub_body;
mod lattice;
mod link_pairs;
mod lint;
#[cfg(feature = "meshes")]
pub mod mesh;
mod mirror;
mod origin;
mod place;
mod placed;
mod points;
mod recipe;
pub mod recipe_values;
mod refresh;
mod region;
mod relax;
mod report;
mod rest_surface;
mod sample_neighbours;
mod scatter;
mod seat;
mod shares;
mod sheet;
mod skin;
mod surface_search;
mod table_body;
mod tear;
mod voronoi;
mod zones;

pub use cell_spread::cell_spread;
pub use coverage::{Coverage, Hole, LinkCoverage, coverage};
pub use icub_body::author_icub;
#[cfg(feature = "meshes")]
pub use lint::drawn_position;
pub use lint::{DrawnPoses, Finding, FindingKind, LinkShare, lint, lint_in_poses, lint_with_progress};
pub use place::{place_apart, place_by_density, place_evenly, widest_radius};
pub use placed::{Placed, Progress, SurfacePoint};
pub use recipe::Recipe;
pub use refresh::refresh;
pub use report::PlaceReport;
pub use sheet::{GridOrder, Sheet, SheetCell, SheetGrid, author_sheets, sheets};
pub use skin::{Authored, author, author_while};
pub use table_body::author_csv_skin;
pub use zones::{Zones, author_zones};

pub use crate::body::{blend_skinning, heaviest_four};

// The same paths as in the crate that has all of this under its own name.
#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_skin::{body, error, field, keys, length, limits, parallel, plain, random};
