//! Applies a recipe to a file.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::cell_spread::cell_spread;
use super::fill::{Fill, Filled, without_area};
use super::group::{FilePaint, Grouper, Grouping};
use super::link_pairs::LinkPairs;
use super::lint::{DrawnPoses, Touchable};
use super::origin::Origin;
use super::place::nearest_on_its_side;
use super::placed::{Placed, Progress, SurfacePoint, report_progress};
use super::points::Snapped;
use super::recipe::{PlaceSpec, Recipe};
use super::refresh::refresh;
use super::region::Regions;
use super::rest_surface::{MeshTaxel, RestSurface};
use crate::body::{Body, Details, FieldSpec, Glb, MAX_TAXEL_ID, Modality, Original, Skinning, Taxel, listed};
use crate::error::{Error, Result, failed};
use crate::field::{Divided, TaxelGraph, unions};

/// Progress before and after placing taxels, and when they are in fields.
const PROGRESS_OPENED: f64 = 0.05;
const PROGRESS_PLACED: f64 = 0.5;
const PROGRESS_GROUPED: f64 = 0.95;

/// A file with taxels and fields, and a report.
#[derive(Debug)]
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

/// The result of a place of a recipe.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlaceReport {
    /// Its name.
    pub name: String,
    /// The taxels' ids, in the order in which they were placed.
    pub ids: Vec<u32>,
    /// Number of taxels by name of the link.
    pub links: BTreeMap<String, usize>,
    /// The smallest distance between two neighbours on the same side, m; `None` if there are no two.
    pub least_spacing_m: Option<f64>,
    /// The mean distance to the nearest neighbour, m.
    pub mean_spacing_m: Option<f64>,
    /// For given places: the id, and how far the taxel was moved to the surface, m.
    pub moved_m: Vec<(u32, f64)>,
    /// The 5th and the 95th percentile of the taxels' areas over their median; `None` if these are unknown.
    pub cell_spread: Option<[f64; 2]>,
    /// Surface of the place that nothing can touch, by name of the link, m².
    pub hidden_m2: BTreeMap<String, f64>,
}

/// Adds the taxels and fields of `recipe` to `file` and replaces its layout. Its taxels stay if the recipe has no place or
/// says so; its fields stay if the recipe has neither places nor fields. What stays is updated by [`refresh`]; duplicate
/// ids are written as they were read. `progress` gets the share that is done.
///
/// The same file and recipe give the same bytes. A place does not depend on other places.
///
/// # Errors
/// The file is no valid body, or the recipe requests something that it does not have or cannot hold; with the place.
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
        return Err(
            Error::usage("`mirror` is for taxels to be placed; give a number of them, or leave it out").at(file.name())
        );
    }
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
        store_edges(&mut file, &mut body, &mut notes, None);
        return Ok(Authored { file, body, places: Vec::new(), notes });
    }
    let rest_surface = RestSurface::new(&body, &details);
    let mut regions = Regions::new(&rest_surface, &recipe.regions);
    let mut bare = vec![false; rest_surface.triangles.len()];
    for (name, at) in &recipe.bare {
        let own = regions.union(std::slice::from_ref(name), at)?;
        bare.iter_mut().zip(own).for_each(|(bare, own)| *bare |= own);
    }
    let mut ids = UsedIds::default();
    ids.take(body.taxels.iter().map(|taxel| taxel.id), "the file", &Origin::default())?;
    let drawn = DrawnPoses::of(&body);
    let looks = !recipe.keeps_hidden && recipe.places.iter().any(|place| place.how.samples());
    let touchable = looks.then(|| Touchable::new(&body, &drawn));
    let (mut reports, mut seated) = (Vec::new(), Vec::new());
    let mut pairs = Vec::new();
    // What a place over all of the surface divides it into is what the edges of its taxels are made of.
    let is_alone = body.taxels.is_empty() && recipe.places.len() == 1;
    let mut divided = None;
    for (index, place) in recipe.places.iter().enumerate() {
        let mut region = match &place.regions[..] {
            [] => vec![true; rest_surface.triangles.len()],
            names => regions.union(names, &place.at)?,
        };
        if place.how.samples() {
            region.iter_mut().zip(&bare).for_each(|(own, bare)| *own &= !bare);
        }
        if !region.contains(&true) {
            let what = format!("place `{}` has no surface left: all of its regions are `bare`", place.name);
            return Err(place.at.wrong(what));
        }
        let share = (PROGRESS_PLACED - PROGRESS_OPENED) / recipe.places.len() as f64;
        let tick = &mut |done: f64| go_on(PROGRESS_OPENED + share * (index as f64 + done));
        let fill = Fill {
            rest_surface: &rest_surface,
            place,
            seed: recipe.seed_of(place),
            is_scattered: recipe.is_scattered,
            touchable: touchable.as_ref(),
            clear_m: recipe.clear_m,
            is_mirrored: recipe.is_mirrored,
        };
        let Filled { taxels: filled, cells, hidden_m2, notes: more, is_mirrored } =
            fill.place(&region, tick).map_err(|e| place.at.put(e))?;
        notes.extend(more);
        let last = u64::from(place.first_id) + filled.len() as u64;
        if last > u64::from(MAX_TAXEL_ID) + 1 {
            let what =
                format!("its ids would reach {last}, over the {MAX_TAXEL_ID} that a file can hold; lower `first_id`");
            return Err(place.at.wrong(what));
        }
        let own: Vec<u32> = filled.iter().zip(place.first_id..).map(|(one, next)| one.id.unwrap_or(next)).collect();
        ids.take(own.iter().copied(), &format!("place `{}`", place.name), &place.at)?;
        notes.extend(without_area(place, &filled, &own));
        let is_whole = is_alone && place.modality == Modality::Pressure && !region.contains(&false);
        divided = cells.filter(|_| is_whole).map(|cells| (own.clone(), cells));
        let first = seated.len();
        let links = rest_surface.link.iter().zip(&region).filter(|(_, is_in)| **is_in).map(|(&link, _)| link).collect();
        let seat = |(one, &id): (&Snapped, &u32)| rest_surface.mesh_taxel(&one.placed, id, place.modality, &links);
        seated.extend(filled.iter().zip(&own).map(seat));
        if is_mirrored {
            let images = filled.iter().map(|one| &one.placed).skip(1).step_by(2);
            seat_images(&rest_surface, images, &mut seated[first..]).map_err(|e| place.at.put(e))?;
            pairs.extend(own.chunks_exact(2).map(|ids| [ids[0], ids[1]]));
            notes.push(format!(
                "place `{}`: {} pairs; id {} and every second one from there is on the left, and its mirror image has the next id",
                place.name,
                filled.len() / 2,
                place.first_id
            ));
        }
        reports.push(report(&rest_surface, place, own, &filled, (&seated[first..], hidden_m2)));
    }
    report_progress(&mut go_on, PROGRESS_PLACED)?;
    let addition = taxel_nodes(&file, &rest_surface, seated);
    drop(regions);
    file.add(&addition);
    let (body, details) = file.read()?;
    let tick = &mut |done: f64| go_on(PROGRESS_PLACED + (PROGRESS_GROUPED - PROGRESS_PLACED) * done);
    let Grouping { fields, notes: more } = group(&body, &details, recipe, &pairs, tick)?;
    notes.extend(more);
    notes.extend(without_field(&body, &fields));
    add_fields(&mut file, &body, &details, &fields);
    report_progress(&mut go_on, PROGRESS_GROUPED)?;
    let (mut body, _) = file.read()?;
    store_edges(&mut file, &mut body, &mut notes, divided.as_ref());
    Ok(Authored { file, body, places: reports, notes })
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
    let (graph, note) = known.map_or_else(|| TaxelGraph::of(body), |graph| (graph, None));
    notes.extend(note);
    let edges = graph.to_stored(body);
    file.set_edges(&edges);
    body.edges = Some(edges);
}

#[derive(Default)]
struct UsedIds(BTreeMap<u32, String>);

impl UsedIds {
    fn take(&mut self, ids: impl IntoIterator<Item = u32>, who: &str, at: &Origin) -> Result<()> {
        for id in ids {
            if let Some(other) = self.0.insert(id, who.to_owned()) {
                let free = self.0.keys().last().map_or(0, |last| u64::from(*last) + 1).next_multiple_of(100);
                return Err(at.wrong(format!(
                    "id {id} is used twice, by {other} and by {who}; give ids of their own, as from {free} up"
                )));
            }
        }
        Ok(())
    }
}

fn report(
    rest_surface: &RestSurface<'_>,
    place: &PlaceSpec,
    ids: Vec<u32>,
    filled: &[Snapped],
    (seated, hidden_m2): (&[MeshTaxel], BTreeMap<usize, f64>),
) -> PlaceReport {
    let points: Vec<SurfacePoint> = filled.iter().map(|one| one.placed.point).collect();
    let near: Vec<f64> = nearest_on_its_side(&points).into_iter().flatten().collect();
    let mut links = BTreeMap::new();
    for one in seated {
        *links.entry(rest_surface.body.links[one.taxel.link].name.clone()).or_insert(0) += 1;
    }
    let moved = |(one, &id): (&Snapped, &u32)| (id, one.moved_m);
    let moved_m = if place.how.samples() { Vec::new() } else { filled.iter().zip(&ids).map(moved).collect() };
    let hidden = |(link, area): (usize, f64)| (rest_surface.body.links[link].name.clone(), area);
    PlaceReport {
        name: place.name.clone(),
        links,
        cell_spread: cell_spread(filled.iter().map(|one| one.placed.point.area)),
        hidden_m2: hidden_m2.into_iter().map(hidden).collect(),
        least_spacing_m: near.iter().copied().reduce(f64::min),
        mean_spacing_m: (!near.is_empty()).then(|| near.iter().sum::<f64>() / near.len() as f64),
        moved_m,
        ids,
    }
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

/// Puts each second one of `seated`, which are at `images`, on the link that mirrors that of the one before it.
fn seat_images<'p>(
    rest_surface: &RestSurface<'_>,
    images: impl Iterator<Item = &'p Placed>,
    seated: &mut [MeshTaxel],
) -> Result<()> {
    let pairs = LinkPairs::new(rest_surface.body);
    for (pair, image) in seated.chunks_exact_mut(2).zip(images) {
        let [one, other] = pair else { continue };
        let link = pairs.image(one.taxel.link);
        *other = rest_surface.mesh_taxel(image, other.taxel.id, other.taxel.modality, &BTreeSet::from([link as u32]));
        if other.taxel.link != link {
            let name = |link: usize| &rest_surface.body.links[link].name;
            return Err(failed!(
                "`mirror`: taxel {} is on link `{}`, but its mirror image is not on `{}`: the mesh is bound to the two unlike; leave                  `mirror` out",
                one.taxel.id,
                name(one.taxel.link),
                name(link)
            ));
        }
    }
    Ok(())
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
fn add_fields(file: &mut Original, body: &Body, details: &Details, fields: &[FieldSpec]) {
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
