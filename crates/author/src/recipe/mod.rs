//! Recipes: a requested layout, read and checked before the mesh.

mod file;
mod spec;

pub use spec::Recipe;
pub(super) use spec::{PlaceSpec, Placement, shown};
