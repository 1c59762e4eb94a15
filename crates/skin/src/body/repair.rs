//! Repairs and reports what editors do to a layout: duplicate ids of copied points, members of deleted taxels, attributes
//! that were not exported.

use std::collections::BTreeSet;

use gltf::json;
use json::mesh::Mode;
use json::validation::Checked;

use super::document::Document;
use super::layout::{FieldSpec, MAX_TAXEL_ID};
use super::model::Body;
use super::primitives::is_taxels;
use crate::error::{Result, failed};

/// Maximum number of ids and names listed in a message.
const MAX_LISTED: usize = 8;

/// Sorts taxels by id, and gives new ids to duplicates, except the first in the file.
///
/// New ids follow the highest in use, in the order of the old ones; if that would exceed [`MAX_TAXEL_ID`], the lowest free
/// ones are used. Renumbered taxels are in no field, as copied points are elsewhere.
///
/// Returns per taxel its previous index, if the order has changed.
pub(super) fn renumber(body: &mut Body) -> Result<Option<Vec<usize>>> {
    // Most files are sorted already.
    if body.taxels.is_sorted_by(|a, b| a.id < b.id) {
        return Ok(None);
    }
    let mut order: Vec<usize> = (0..body.taxels.len()).collect();
    // Stable sort: the first in the file keeps its id, as editors append copies.
    order.sort_by_key(|&index| body.taxels[index].id);
    body.taxels.sort_by_key(|taxel| taxel.id);
    let later: Vec<usize> =
        (1..body.taxels.len()).filter(|&index| body.taxels[index].id == body.taxels[index - 1].id).collect();
    let Some(highest) = body.taxels.last().filter(|_| !later.is_empty()).map(|taxel| taxel.id) else {
        return Ok(Some(order));
    };
    let used: BTreeSet<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let above = later.len() as u64 + u64::from(highest) <= u64::from(MAX_TAXEL_ID);
    let mut free = (if above { highest + 1 } else { 0 }..=MAX_TAXEL_ID).filter(|id| !used.contains(id));
    let mut renumbered = Vec::with_capacity(later.len());
    for index in later {
        let Some(id) = free.next() else {
            return Err(failed!("there are more taxels than the {MAX_TAXEL_ID} ids; remove some"));
        };
        let taxel = &mut body.taxels[index];
        renumbered.push(format!("{} on link `{}` is now {id}", taxel.id, body.links[taxel.link].name));
        taxel.id = id;
    }
    let mut by_id: Vec<usize> = (0..order.len()).collect();
    by_id.sort_by_key(|&index| body.taxels[index].id);
    body.taxels.sort_by_key(|taxel| taxel.id);
    let (are, later) = match renumbered.len() {
        1 => ("1 taxel has the id".to_owned(), "the later in the file"),
        several => (format!("{several} taxels have the ids"), "those later in the file"),
    };
    body.findings.push(format!("{are} of another; {later} renumbered, and in no field: {}", listed(&renumbered)));
    Ok(Some(by_id.into_iter().map(|index| order[index]).collect()))
}

/// Removes members that the body does not have from `fields`, as after taxels were deleted in an editor.
pub(super) fn remove_absent_members(body: &mut Body, fields: &mut [FieldSpec]) {
    if body.taxels.is_empty() {
        return;
    }
    for field in fields {
        let absent: Vec<u32> = field.members.keys().copied().filter(|&id| body.taxel_index(id).is_none()).collect();
        if absent.is_empty() {
            continue;
        }
        field.members.retain(|id, _| absent.binary_search(id).is_err());
        let taxels = if absent.len() == 1 { "taxel" } else { "taxels" };
        body.findings.push(format!(
            "field `{}` names {taxels} {}, which the body does not have; left out",
            field.name,
            listed(&absent)
        ));
    }
}

/// Suggests Blender's export options that seem to have been off.
pub(super) fn suggest_export_options(document: &Document, body: &mut Body) {
    let generator = document.root.asset.generator.as_deref().unwrap_or_default();
    let from_blender = generator.contains("Blender");
    let primitives = || document.root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    let bare_points = primitives().any(|p| matches!(p.mode, Checked::Valid(Mode::Points)) && !is_taxels(p));
    let attributes = "`Data ▸ Mesh ▸ Attributes` (export_attributes)";
    let points = "`Data ▸ Mesh ▸ Loose Points` (use_mesh_vertices)";
    let extras = "`Include ▸ Custom Properties` (export_extras)";
    let (taxels, fields) = (!body.taxels.is_empty(), !body.fields.is_empty());
    let finding = match (taxels, fields) {
        (true, true) => return,
        (false, true) if bare_points => {
            format!("it has fields and points, and no point is a taxel: export it again with {attributes} on")
        }
        (false, true) => format!(
            "it has fields and no taxels: if it comes from Blender, export it again with {attributes} and {points} on"
        ),
        (true, false) if from_blender => {
            format!("it has taxels and no fields; if it had some in Blender, export it again with {extras} on")
        }
        (false, false) if from_blender => format!(
            "it comes from Blender without taxels and fields; if it had some there, export it again with {attributes}, \
             {points} and {extras} on"
        ),
        _ => return,
    };
    // First, as it is the cause of most other findings.
    body.findings.insert(0, finding);
}

/// The first of `words`, and the number of the others.
pub fn listed<T: ToString>(words: &[T]) -> String {
    let first: Vec<String> = words.iter().take(MAX_LISTED).map(ToString::to_string).collect();
    match words.len().saturating_sub(MAX_LISTED) {
        0 => first.join(", "),
        more => format!("{} and {more} more", first.join(", ")),
    }
}
