//! The nodes of the graph.

use crate::body::Body;

/// Indices of the pressure taxels of `body`.
pub(super) fn nodes(body: &Body) -> impl Iterator<Item = usize> + '_ {
    (0..body.taxels.len()).filter(|&taxel| body.taxels[taxel].modality.is_pressed())
}
