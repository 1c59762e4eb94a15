//! From a file and a recipe to a file with a skin.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::SurfacePoint;
use super::canvas::{Canvas, Seated};
use super::group::painted::Paints;
use super::group::{Grouping, Grower, group as group_by};
use super::lattice::Lattice;
use super::lint::listed;
use super::place::{self, Placed, Progress, nearest_on_its_side};
use super::points::{Snapped, of_icub, of_marks, of_table, snap};
use super::recipe::{How, Origin, Place, Recipe, shown};
use super::refresh::refresh;
use super::region::{Regions, nothing_left};
use crate::body::{Body, Details, FieldSpec, Glb, MAX_TAXEL_ID, Original, Skinning, Taxel};
use crate::error::{Error, Result};
use crate::field::unions;

/// Shares of the work: before anything is placed, and when all is.
const OPENED: f64 = 0.05;
const PLACED: f64 = 0.85;

/// A file with a skin, and how that came out.
#[derive(Debug)]
pub struct Authored {
    /// The file, to be saved.
    pub file: Original,
    /// The body that it holds.
    pub body: Body,
    /// One a place of the recipe, in its order.
    pub places: Vec<PlaceReport>,
    /// What a person should know besides.
    pub notes: Vec<String>,
}

/// How a place of a recipe came out.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaceReport {
    /// Its name.
    pub name: String,
    /// The taxels' ids, in the order in which they were placed.
    pub ids: Vec<u32>,
    /// Names of the links they ride on, and how many on each.
    pub links: BTreeMap<String, usize>,
    /// The least distance between two neighbours, m; `None` where there are no two. What faces apart is no neighbour.
    pub least_spacing_m: Option<f64>,
    /// The mean distance to the nearest neighbour, m.
    pub mean_spacing_m: Option<f64>,
    /// For places that were given: the id, and how far it was moved to the surface, m.
    pub moved_m: Vec<(u32, f64)>,
}

/// Gives `file` the skin that `recipe` asks for. A layout that it has is replaced; without any place in the recipe, or where
/// the recipe says so, its taxels stay, and without any fields either its fields. What stays is brought up to date, as by
/// [`refresh`], and ids that were there twice are written as they were read. `progress` is told the share that is done.
///
/// The same file and recipe give the same bytes. What a place gets depends on no other place.
///
/// # Errors
/// The file is no sound body, or the recipe asks for what it has not or cannot hold. One line says where.
pub fn author(mut file: Original, recipe: &Recipe, mut progress: impl FnMut(f64)) -> Result<Authored> {
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
        let what = "it has no taxels, and none are asked for; say how many (`--taxels 500`), or write a recipe with a [[place]]";
        return Err(Error::usage(what).at(file.name()));
    }
    if body.surfaces.is_empty() && !recipe.places.is_empty() {
        return Err(Error::failed("it has no triangles to place taxels on; export a mesh").at(file.name()));
    }
    progress(OPENED);
    let mut notes = std::mem::take(&mut file.notes);
    if !body.taxels.is_empty() {
        notes.append(&mut body.findings);
        notes.extend(renew(&mut file, &body, &details)?);
        (body, details) = file.read()?;
    }
    let keeps_fields = asks_nothing && !body.fields.is_empty();
    if keeps_fields {
        return Ok(Authored { file, body, places: Vec::new(), notes });
    }
    let canvas = Canvas::new(&body, &details);
    let mut regions = Regions::new(&canvas, &recipe.regions);
    let mut bare = vec![false; canvas.triangles.len()];
    for (name, at) in &recipe.bare {
        let own = regions.union(std::slice::from_ref(name), at)?;
        bare.iter_mut().zip(own).for_each(|(bare, own)| *bare |= own);
    }
    let mut ids = Ids::default();
    ids.take(body.taxels.iter().map(|taxel| taxel.id), "the file", &Origin::default())?;
    let (mut reports, mut seated) = (Vec::new(), Vec::new());
    for (index, place) in recipe.places.iter().enumerate() {
        let mut region = match &place.regions[..] {
            [] => vec![true; canvas.triangles.len()],
            names => regions.union(names, &place.at)?,
        };
        if place.how.samples() {
            region.iter_mut().zip(&bare).for_each(|(own, bare)| *own &= !bare);
        }
        if !region.contains(&true) {
            return Err(place.at.put(nothing_left(&place.name)));
        }
        let share = (PLACED - OPENED) / recipe.places.len() as f64;
        let tick = &mut |done: f64| progress(OPENED + share * (index as f64 + done));
        let filled = fill(&canvas, &region, place, recipe.seed_of(place), &mut notes, tick);
        let filled = filled.map_err(|e| place.at.put(e))?;
        let last = u64::from(place.first_id) + filled.len() as u64;
        if last > u64::from(MAX_TAXEL_ID) + 1 {
            let what =
                format!("its ids would reach {last}, over the {MAX_TAXEL_ID} that a file can hold; lower `first_id`");
            return Err(place.at.wrong(what));
        }
        let own: Vec<u32> = filled.iter().zip(place.first_id..).map(|(one, next)| one.id.unwrap_or(next)).collect();
        ids.take(own.iter().copied(), &format!("place `{}`", place.name), &place.at)?;
        notes.extend(without_area(place, &filled, &own));
        let first = seated.len();
        seated.extend(filled.iter().zip(&own).map(|(one, &id)| canvas.seat(&one.placed, id, place.modality)));
        reports.push(report(&canvas, place, own, &filled, &seated[first..]));
    }
    progress(PLACED);
    let addition = written(&file, &canvas, seated);
    drop(regions);
    file.add(&addition);
    let (body, details) = file.read()?;
    let Grouping { fields, notes: more } = group(&body, &details, recipe)?;
    notes.extend(more);
    notes.extend(without_field(&body, &fields));
    add_fields(&mut file, &body, &details, &fields);
    progress(0.95);
    let (body, _) = file.read()?;
    Ok(Authored { file, body, places: reports, notes })
}

/// Brings up to date what the file that holds `body` has of taxels and fields that stay; a line each of what that was.
fn renew(file: &mut Original, body: &Body, details: &Details) -> Result<Vec<String>> {
    let mut now = body.clone();
    let mut notes = refresh(&mut now);
    notes.extend(file.amend(body, &now, details)?);
    Ok(notes)
}

/// A taxel's place, and what else there is to it.
type Filled = Snapped;

fn fill(
    canvas: &Canvas<'_>,
    region: &[bool],
    place: &Place,
    seed: u64,
    notes: &mut Vec<String>,
    progress: Progress<'_>,
) -> Result<Vec<Filled>> {
    let chosen: Vec<usize> = (0..region.len()).filter(|&triangle| region[triangle]).collect();
    let triangles: Vec<[u32; 3]> = chosen.iter().map(|&triangle| canvas.triangles[triangle]).collect();
    let positions = &canvas.positions;
    let sampled = |placed: Vec<Placed>| {
        let onto_canvas = |p: Placed| Placed { triangle: chosen[p.triangle], ..p };
        placed.into_iter().map(|p| Filled { placed: onto_canvas(p), id: None, moved_m: 0.0 }).collect()
    };
    Ok(match &place.how {
        How::Evenly { count, apart_m: None } => sampled(place::evenly(positions, &triangles, *count, seed, progress)?),
        How::Evenly { count, apart_m: Some(apart_m) } => {
            let area: f64 = chosen.iter().map(|&triangle| canvas.area(triangle)).sum();
            let wrong = |most: String| {
                Error::failed(format!(
                    "{count} taxels do not fit {} apart on {:.1} cm²; {most}, or ask for a smaller spacing",
                    shown(*apart_m),
                    area * 1e4
                ))
            };
            // The densest packing of all, on both sides of whatever is thin.
            let most = area * 2.0 / (3.0_f64.sqrt() * apart_m * apart_m);
            if *count as f64 > most + 1.0 {
                return Err(wrong(format!("not even the densest packing holds over {most:.0}")));
            }
            match place::evenly_apart(positions, &triangles, *count, *apart_m, seed, progress)? {
                Ok(placed) => sampled(placed),
                Err(fit) => return Err(wrong(format!("ask for at most {fit}"))),
            }
        }
        How::Apart { spacing_m } => {
            check_fits(canvas, &chosen, "spacing", *spacing_m)?;
            sampled(place::apart(positions, &triangles, *spacing_m, seed, progress)?)
        }
        How::Density { count, attribute } => {
            let painted = canvas.painted(attribute)?;
            let density = |p: &Placed| {
                let corners = triangles[p.triangle].map(|v| painted[v as usize].unwrap_or(0.0));
                corners.iter().zip(p.barycentric).map(|(value, weight)| value * weight).sum()
            };
            sampled(place::by_density(positions, &triangles, *count, seed, density, progress)?)
        }
        How::Grid { hexagonal, pitch_m, origin, u } => {
            check_fits(canvas, &chosen, "pitch", *pitch_m)?;
            let lattice = Lattice { hexagonal: *hexagonal, pitch_m: *pitch_m, origin: *origin, u: *u };
            let laid = lattice.lay(canvas, region, progress)?;
            if laid.placed.is_empty() {
                return Err(Error::failed(
                    "no place of the grid is on the region; make `pitch` smaller or move `origin`",
                ));
            }
            if laid.reached_share < 0.999 {
                notes.push(format!(
                    "place `{}`: the grid covers the part of its region that is connected to the origin, {:.0} % of it; write \
                     a [[place]] for each other part",
                    place.name,
                    100.0 * laid.reached_share
                ));
            }
            let filled = laid.placed.into_iter().map(|placed| Filled { placed, id: None, moved_m: 0.0 });
            filled.collect()
        }
        How::Marks { names, within_m } => snap(canvas, region, &of_marks(canvas, names)?, *within_m)?,
        How::Icub { path, link, within_m } => {
            let (given, more) = of_icub(canvas, path, link.as_deref(), place.modality, place.first_id)?;
            notes.extend(more);
            snap(canvas, region, &given, *within_m)?
        }
        How::Table { path, within_m } => {
            let given = of_table(canvas, path)?;
            snap(canvas, region, &given, *within_m).map_err(|e| e.at(path.display()))?
        }
    })
}

/// Refuses a `length` that is wider than the triangles `chosen`: a number that was not meant in metres.
fn check_fits(canvas: &Canvas<'_>, chosen: &[usize], key: &str, length_m: f64) -> Result<()> {
    let corners = chosen.iter().flat_map(|&triangle| canvas.corners(triangle));
    let (low, high) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    let across_m = low.distance(high);
    if length_m <= across_m {
        return Ok(());
    }
    Err(Error::failed(format!(
        "a {key} of {} is wider than what it is for, which is {} across; numbers are metres: for millimetres write \"{} mm\"",
        shown(length_m),
        shown(across_m),
        length_m
    )))
}

/// What is said of taxels whose area is not known.
fn without_area(place: &Place, filled: &[Filled], ids: &[u32]) -> Option<String> {
    let lone = filled.iter().zip(ids).filter(|(one, _)| one.placed.point.area == 0.0);
    let lone: Vec<u32> = lone.map(|(_, &id)| id).collect();
    (!lone.is_empty()).then(|| {
        format!(
            "place `{}`: no area for {}, as no other taxel of the place is near on the same part of the surface; give it in \
             the column `area` of a csv: {}",
            place.name,
            if lone.len() == 1 { "1 taxel".to_owned() } else { format!("{} taxels", lone.len()) },
            listed(&lone)
        )
    })
}

/// Ids that are taken, each with who has it.
#[derive(Default)]
struct Ids(BTreeMap<u32, String>);

impl Ids {
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

fn report(canvas: &Canvas<'_>, place: &Place, ids: Vec<u32>, filled: &[Filled], seated: &[Seated]) -> PlaceReport {
    let points: Vec<SurfacePoint> = filled.iter().map(|one| one.placed.point).collect();
    let near: Vec<f64> = nearest_on_its_side(&points).into_iter().flatten().collect();
    let mut links = BTreeMap::new();
    for one in seated {
        *links.entry(canvas.body.links[one.taxel.link].name.clone()).or_insert(0) += 1;
    }
    let moved = |(one, &id): (&Filled, &u32)| (id, one.moved_m);
    let moved_m = if place.how.samples() { Vec::new() } else { filled.iter().zip(&ids).map(moved).collect() };
    PlaceReport {
        name: place.name.clone(),
        links,
        least_spacing_m: near.iter().copied().reduce(f64::min),
        mean_spacing_m: (!near.is_empty()).then(|| near.iter().sum::<f64>() / near.len() as f64),
        moved_m,
        ids,
    }
}

/// The taxels as nodes: one for all that share a mesh's coordinates, below the node of that mesh; on a skin at the root, as
/// no transform above counts there.
fn written(file: &Original, canvas: &Canvas<'_>, seated: Vec<Seated>) -> Glb {
    let mut by_node: BTreeMap<usize, Vec<Seated>> = BTreeMap::new();
    for one in seated {
        by_node.entry(canvas.details.parts[one.part].node).or_default().push(one);
    }
    let mut addition = file.addition();
    for (node, mut seated) in by_node {
        seated.sort_by_key(|one| one.taxel.id);
        let part = seated[0].part;
        let name = format!("{} taxels", canvas.body.surfaces[part].name);
        let taxels: Vec<Taxel> = seated.iter().map(|one| one.taxel.clone()).collect();
        let carriers: Option<Vec<_>> = seated.iter().map(|one| one.carriers).collect();
        match (canvas.details.parts[part].skin, carriers) {
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

/// What is said of taxels that none of `fields` holds.
fn without_field(body: &Body, fields: &[FieldSpec]) -> Option<String> {
    let held: BTreeSet<u32> = unions(fields).into_iter().flatten().collect();
    let loose: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).filter(|id| !held.contains(id)).collect();
    let are = if loose.len() == 1 { "taxel is" } else { "taxels are" };
    (!loose.is_empty()).then(|| {
        format!(
            "{} {are} in no field, so that nothing is felt there; put them into a [[fields]]: {}",
            loose.len(),
            listed(&loose)
        )
    })
}

/// The fields that `recipe` asks for over the taxels of `body`, and what there is to say of them.
fn group(body: &Body, details: &Details, recipe: &Recipe) -> Result<Grouping> {
    let painted = Paints { body, details };
    if recipe.fields.is_empty() {
        return group_by(body, &painted, &[]);
    }
    let mut grower = Grower::new(body, &painted);
    for (rule, at) in &recipe.fields {
        grower.apply(rule).map_err(|e| at.put(e))?;
    }
    grower.finish().map_err(|(rule, e)| recipe.fields[rule].1.put(e))
}

/// Adds `fields` as empty nodes, each below its anchor and in the middle of its taxels.
fn add_fields(file: &mut Original, body: &Body, details: &Details, fields: &[FieldSpec]) {
    let mut addition = file.addition();
    for (field, ids) in fields.iter().zip(unions(fields)) {
        let taxels: Vec<&Taxel> =
            ids.into_iter().filter_map(|id| body.taxel_index(id)).map(|index| &body.taxels[index]).collect();
        let anchor = body.common_ancestor(taxels.iter().map(|taxel| taxel.link));
        let in_world = |taxel: &Taxel| body.links[taxel.link].world_from_link.transform_point3(taxel.position_in_link);
        let mean = taxels.iter().map(|taxel| in_world(taxel)).sum::<DVec3>() / taxels.len().max(1) as f64;
        let world_from_node =
            anchor.map(|anchor| body.links[anchor].world_from_link * body.links[anchor].link_from_node);
        let origin = world_from_node.map_or(mean, |world_from_node| world_from_node.inverse().transform_point3(mean));
        // A node that flattens what is below it has no place to give.
        let origin = if origin.is_finite() { origin } else { DVec3::ZERO };
        addition.field(field, anchor.map(|anchor| details.node_of_link[anchor]), origin);
    }
    file.add(&addition);
}
