//! Attributes of glTF primitives.

use gltf::json;
use json::mesh::{Mode, Primitive, Semantic};
use json::validation::Checked;

use super::layout::TAXEL_ID;

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
