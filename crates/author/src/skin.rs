//! Applies a recipe to a file.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::group::{FilePaint, Grouper, Grouping};
use super::origin::Origin;
use super::placed::{Progress, report_progress};
use super::recipe::Recipe;
use super::recipe_values::Globs;
use super::refresh::refresh;
use super::report::PlaceReport;
use super::rest_surface::{MeshTaxel, RestSurface};
use super::seat::{Seated, seat};
use crate::body::{Body, Details, FieldSpec, Glb, Original, Skinning, StoredEdges, Taxel, listed};
use crate::error::{Error, Result, failed};
use crate::field::{Divided, TaxelGraph, unions};

/// Progress before and after placing taxels, and when they are in fields.
const PROGRESS_OPENED: f64 = 0.05;
const PROGRESS_PLACED: f64 = 0.5;
const PROGRESS_GROUPED: f64 = 0.95;

/// A file with taxels and fields, and a report.
#[derive(Debug)]
#[non_exhaustive]
pub struct Authored {
    /// The file, not saved yet.
    pub file: Original,
    /// The body that it holds.
    pub body: Body,
    /// One per place of the recipe, in its order.
    pub places: Vec<PlaceReport>,
    /// Further notes for the user.
    pub notes: Vec<String>,
}

/// Adds the taxels and fields of `recipe` to `file` and replaces its layout. Its taxels stay if the recipe has no place or
/// says so; its fields stay if the recipe has neither places nor fields. What stays is updated by [`refresh`]; duplicate
/// ids are written as they were read. `progress` gets the share that is done.
///
/// The same file and recipe give the same bytes. A place does not depend on other places.
///
/// # Errors
/// The file is not a valid body, or the recipe requests something that it does not have or cannot hold; with the place.
pub fn author(file: Original, recipe: &Recipe, mut progress: impl FnMut(f64)) -> Result<Authored> {
    author_while(file, recipe, |share| {
        progress(share);
        true
    })
}

/// The same until `go_on`, which gets the share that is done, says to stop.
///
/// # Errors
/// As [`author`]; or `go_on` has ended it.
pub fn author_while(mut file: Original, recipe: &Recipe, mut go_on: impl FnMut(f64) -> bool) -> Result<Authored> {
    if let Some((unit, metres)) = &recipe.unit {
        file.set_unit(unit, *metres)?;
    }
    let keeps_taxels = recipe.places.is_empty() || recipe.keeps_existing;
    let asks_nothing = recipe.places.is_empty() && recipe.fields.is_empty();
    if !asks_nothing {
        file.clear_layout(keeps_taxels)?;
    }
    let (mut body, mut details) = file.read()?;
    check(&file, &body, recipe)?;
    let joined = joined_links(&body, recipe)?;
    report_progress(&mut go_on, PROGRESS_OPENED)?;
    let mut notes = std::mem::take(&mut file.notes);
    if !body.taxels.is_empty() {
        notes.append(&mut body.findings);
        let mut now = body.clone();
        notes.extend(refresh(&mut now));
        notes.extend(file.amend(&body, &now, &details)?);
        (body, details) = file.read()?;
    }
    let keeps_fields = asks_nothing && !body.fields.is_empty();
    if keeps_fields {
        join(&mut body, joined);
        store_edges(&mut file, &mut body, &mut notes, None);
        return Ok(Authored { file, body, places: Vec::new(), notes });
    }
    let rest_surface = RestSurface::new(&body, &details);
    let tick = &mut |done: f64| go_on(PROGRESS_OPENED + (PROGRESS_PLACED - PROGRESS_OPENED) * done);
    let Seated { taxels, reports, pairs, divided, notes: more } = seat(&rest_surface, recipe, tick)?;
    notes.extend(more);
    report_progress(&mut go_on, PROGRESS_PLACED)?;
    let addition = taxel_nodes(&file, &rest_surface, taxels);
    file.add(&addition);
    let (body, details) = file.read()?;
    let tick = &mut |done: f64| go_on(PROGRESS_PLACED + (PROGRESS_GROUPED - PROGRESS_PLACED) * done);
    let Grouping { fields, notes: more } = group(&body, &details, recipe, &pairs, tick)?;
    notes.extend(more);
    notes.extend(without_field(&body, &fields));
    add_fields(&mut file, &body, &details, &fields);
    report_progress(&mut go_on, PROGRESS_GROUPED)?;
    let (mut body, _) = file.read()?;
    join(&mut body, joined);
    store_edges(&mut file, &mut body, &mut notes, divided.as_ref());
    Ok(Authored { file, body, places: reports, notes })
}

/// Refuses a recipe that the body in `file` has nothing for.
fn check(file: &Original, body: &Body, recipe: &Recipe) -> Result<()> {
    if recipe.places.is_empty() && body.taxels.is_empty() {
        if let Some(finding) = body.findings.first() {
            return Err(Error::failed(finding).at(file.name()));
        }
        let what = "it has no taxels; give a number of taxels (`--taxels 500`), or a recipe with a [[place]]";
        return Err(Error::usage(what).at(file.name()));
    }
    if body.surfaces.is_empty() && !recipe.places.is_empty() {
        return Err(Error::failed("it has no triangles to place taxels on; export a mesh").at(file.name()));
    }
    if recipe.is_mirrored && recipe.places.is_empty() {
        let what = "`mirror` is for taxels to be placed; give a number of them, or leave it out";
        return Err(Error::usage(what).at(file.name()));
    }
    Ok(())
}

/// The names of the links of `body` in each `[[join]]` of `recipe`.
fn joined_links(body: &Body, recipe: &Recipe) -> Result<Vec<Vec<String>>> {
    let names = |(globs, at): &(Globs, Origin)| {
        let names = body.links.iter().map(|link| &link.name).filter(|name| globs.matches(name));
        let names: Vec<String> = names.cloned().collect();
        let what = match &names[..] {
            [] => failed!("the body has no link `{}`; `somatic inspect` lists its links", globs.listed()),
            [one] => failed!("`{}` is one link, `{one}`; name those that it is joined with, too", globs.listed()),
            _ => return Ok(names),
        };
        Err(at.put(what))
    };
    recipe.joins.iter().map(names).collect()
}

/// Joins further links of `body`. Its edges are out of date then.
fn join(body: &mut Body, further: Vec<Vec<String>>) {
    if further.is_empty() {
        return;
    }
    let mut joined = body.edges.take().map_or_else(Vec::new, |edges| edges.joined);
    for names in further {
        if !joined.contains(&names) {
            joined.push(names);
        }
    }
    body.edges = Some(StoredEdges { joined, ..StoredEdges::default() });
}

/// Writes the edges between the taxels of `body`, which is in `file`, unless the file has current ones. `divided` has all of the
/// surface's cells, of the taxels with these ids, if they are known.
pub(super) fn store_edges(
    file: &mut Original,
    body: &mut Body,
    notes: &mut Vec<String>,
    divided: Option<&(Vec<u32>, Divided)>,
) {
    if body.taxels.is_empty() {
        return;
    }
    let known = divided.and_then(|(ids, divided)| {
        let taxels: Option<Vec<usize>> = ids.iter().map(|&id| body.taxel_index(id)).collect();
        Some(TaxelGraph::of_cells(body, &taxels?, divided))
    });
    let (graph, note) = known.map_or_else(|| TaxelGraph::from_body(body), |graph| (graph, None));
    notes.extend(note);
    let edges = graph.to_stored(body);
    file.set_edges(&edges);
    body.edges = Some(edges);
}

/// The taxels as nodes: one per mesh, below the node of that mesh; for a skinned mesh at the root, where no transform applies.
fn taxel_nodes(file: &Original, rest_surface: &RestSurface<'_>, seated: Vec<MeshTaxel>) -> Glb {
    let mut by_node: BTreeMap<usize, Vec<MeshTaxel>> = BTreeMap::new();
    for one in seated {
        by_node.entry(rest_surface.details.parts[one.part].node).or_default().push(one);
    }
    let mut addition = file.addition();
    for (node, mut seated) in by_node {
        seated.sort_by_key(|one| one.taxel.id);
        let part = seated[0].part;
        let name = format!("{} taxels", rest_surface.body.surfaces[part].name);
        let taxels: Vec<Taxel> = seated.iter().map(|one| one.taxel.clone()).collect();
        let carriers: Option<Vec<_>> = seated.iter().map(|one| one.carriers).collect();
        match (rest_surface.details.parts[part].skin, carriers) {
            (Some(skin), Some(carriers)) => {
                let (joints, weights) = carriers.into_iter().unzip();
                let skinning = Skinning { joints, weights };
                addition.taxels(&name, None, &taxels, Some((skin, &skinning)));
            }
            _ => {
                addition.taxels(&name, Some(node), &taxels, None);
            }
        }
    }
    addition
}

/// The note on taxels in none of `fields`.
fn without_field(body: &Body, fields: &[FieldSpec]) -> Option<String> {
    let held: BTreeSet<u32> = unions(fields).into_iter().flatten().collect();
    let loose: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).filter(|id| !held.contains(id)).collect();
    let are = if loose.len() == 1 { "taxel is" } else { "taxels are" };
    (!loose.is_empty()).then(|| {
        format!(
            "{} {are} in no field, so touches there are not reported; add them to a [[fields]]: {}",
            loose.len(),
            listed(&loose)
        )
    })
}

/// The fields of `recipe` over the taxels of `body`, with notes; `pairs` has the ids of taxels that are mirror images.
fn group(
    body: &Body,
    details: &Details,
    recipe: &Recipe,
    pairs: &[[u32; 2]],
    progress: Progress<'_>,
) -> Result<Grouping> {
    let painted = FilePaint { body, details };
    let mut grower = Grouper::new(body, &painted).with_pairs(pairs);
    if recipe.fields.is_empty() {
        grower.apply_usual()?;
        return grower.finish_while(progress).map_err(|(_, e)| e);
    }
    for (rule, at) in &recipe.fields {
        grower.apply(rule).map_err(|e| at.put(e))?;
    }
    grower.finish_while(progress).map_err(|(rule, e)| recipe.fields[rule].1.put(e))
}

/// Adds `fields` as empty nodes, each below its anchor and in the middle of its taxels.
pub(super) fn add_fields(file: &mut Original, body: &Body, details: &Details, fields: &[FieldSpec]) {
    let mut addition = file.addition();
    for (field, ids) in fields.iter().zip(unions(fields)) {
        let taxels: Vec<&Taxel> =
            ids.into_iter().filter_map(|id| body.taxel_index(id)).map(|index| &body.taxels[index]).collect();
        let anchor = body.common_ancestor(taxels.iter().map(|taxel| taxel.link));
        let in_body = |taxel: &Taxel| body.links[taxel.link].body_from_link.transform_point3(taxel.position_in_link);
        let mean = taxels.iter().map(|taxel| in_body(taxel)).sum::<DVec3>() / taxels.len().max(1) as f64;
        let body_from_node = anchor.map(|anchor| body.links[anchor].body_from_link * body.links[anchor].link_from_node);
        let origin = body_from_node.map_or(mean, |body_from_node| body_from_node.inverse().transform_point3(mean));
        // A node with a singular transform has no inverse.
        let origin = if origin.is_finite() { origin } else { DVec3::ZERO };
        addition.field(field, anchor.map(|anchor| details.node_of_link[anchor]), origin);
    }
    file.add(&addition);
}
