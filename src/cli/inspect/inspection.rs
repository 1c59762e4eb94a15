//! What is reported about a body.

use somatic::author::{Coverage, Finding};
use somatic::body::Body;
use somatic::field::Field;
use somatic::internal::expected::LayoutErrors;
use somatic::internal::field::RestOverlap;

use super::graph::SkinGraph;

/// The areas of the taxels that feel forces, m², or of all if none does: each other kind divides the skin anew.
pub(super) fn cells_of(body: &Body) -> impl Iterator<Item = f64> + '_ {
    let any = body.taxels.iter().any(|taxel| taxel.modality.is_pressed());
    body.taxels.iter().filter(move |taxel| taxel.modality.is_pressed() || !any).map(|taxel| taxel.area)
}

/// What is reported about a body.
pub(super) struct Inspection {
    pub(super) body: Body,
    pub(super) fields: Vec<Field>,
    pub(super) graph: SkinGraph,
    pub(super) coverage: Coverage,
    /// Links with taxels that are within the tolerance of self-contacts at rest.
    pub(super) overlaps: Vec<RestOverlap>,
    /// Errors to be expected on it and on an ideal skin, if they are asked for.
    pub(super) errors: Option<[LayoutErrors; 2]>,
    /// A line each; those of reading first.
    pub(super) findings: Vec<String>,
    /// Findings of the lint.
    pub(super) odd: Vec<Finding>,
}
