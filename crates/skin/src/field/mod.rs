//! Receptive fields: taxels with weights and coordinates.
//!
//! [`FieldSet::new`] builds the fields that a body's file specifies: a parent gets the union of its descendants' taxels,
//! every field an anchor, and a chart if it has one.

mod by_normals;
mod cell_surface;
mod cells;
mod chart;
mod distortion;
pub mod geodesic;
mod geodesic_surface;
mod graph;
mod lattice;
mod leaders;
mod link_surface;
mod mean_normals;
mod neighbours;
mod rechart;
mod rest_overlaps;
mod seats;
mod set;
mod surface_grid;
mod surface_groups;
mod unroll;

pub use crate::body::default_u;
pub use by_normals::place_by_normals;
pub use cell_surface::CellSurface;
pub use cells::{COINCIDENT_M, CellPoint, Divided, Relaxation};
pub use chart::{Chart, NoChart};
pub use distortion::Distortion;
pub use graph::TaxelGraph;
pub use lattice::Lattice;
pub use link_surface::LinkSurface;
pub use mean_normals::mean_normals;
pub use mean_normals::mean_normals_of;
pub use neighbours::neighbours;
pub use rechart::Recharted;
pub use rest_overlaps::{ContactTolerance, RestOverlap, rest_overlaps};
pub use seats::Seated;
pub use set::{Field, FieldSet, Member, WORLD, unions};
pub use surface_grid::Lift;
pub use surface_groups::surface_groups;
pub use unroll::Unroller;
