//! Attributes of glTF primitives.

use gltf::json;
use json::mesh::{Mode, Primitive, Semantic};
use json::validation::Checked;

use super::document::Document;
use super::layout::TAXEL_ID;
use crate::error::{Result, failed};

pub(super) fn attribute(primitive: &Primitive, semantic: &Semantic) -> Option<usize> {
    primitive
        .attributes
        .iter()
        .find(|(key, _)| matches!(key, Checked::Valid(s) if s == semantic))
        .map(|(_, accessor)| accessor.value())
}

pub(super) fn custom(primitive: &Primitive, name: &str) -> Option<usize> {
    attribute(primitive, &Semantic::Extras(name.to_owned()))
}

pub(super) fn has_mode(primitive: &Primitive, mode: Mode) -> bool {
    matches!(primitive.mode, Checked::Valid(own) if own == mode)
}

pub(super) fn is_taxels(primitive: &Primitive) -> bool {
    has_mode(primitive, Mode::Points) && custom(primitive, TAXEL_ID).is_some()
}

/// Positions of the vertices of `primitive` in its mesh, m, if it has any.
pub(super) fn finite_positions(document: &Document, primitive: &Primitive) -> Result<Option<Vec<[f32; 3]>>> {
    let Some(positions) = attribute(primitive, &Semantic::Positions) else { return Ok(None) };
    let positions = document.floats::<3>(positions)?;
    match positions.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        Some(bad) => {
            Err(failed!("vertex {bad} has a position that is not a finite number; repair the mesh and export it again"))
        }
        None => Ok(Some(positions)),
    }
}
