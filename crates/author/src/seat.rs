//! Puts the taxels of a recipe's places onto the surface.

use std::collections::{BTreeMap, BTreeSet};

use super::fill::{Fill, Filled, without_area};
use super::link_pairs::LinkPairs;
use super::lint::{DrawnPoses, Touchable};
use super::origin::Origin;
use super::placed::{Placed, Progress};
use super::points::Snapped;
use super::recipe::{PlaceSpec, Recipe};
use super::region::Regions;
use super::report::{PlaceReport, report};
use super::rest_surface::{MeshTaxel, RestSurface};
use crate::body::MAX_TAXEL_ID;
use crate::error::{Result, failed};
use crate::field::Divided;

/// The taxels of all places, on their meshes.
#[derive(Default)]
pub(super) struct Seated {
    pub(super) taxels: Vec<MeshTaxel>,
    /// Per place.
    pub(super) reports: Vec<PlaceReport>,
    /// Ids of taxels that are mirror images of each other.
    pub(super) pairs: Vec<[u32; 2]>,
    /// The cells of all of the surface and the ids of their taxels, if one place without other taxels divides it: the edges between
    /// these are made of it.
    pub(super) divided: Option<(Vec<u32>, Divided)>,
    pub(super) notes: Vec<String>,
}

/// Places the taxels of all places of `recipe`. `progress` gets the share that is done.
pub(super) fn seat(rest_surface: &RestSurface<'_>, recipe: &Recipe, progress: Progress<'_>) -> Result<Seated> {
    let body = rest_surface.body;
    let mut regions = Regions::new(rest_surface, &recipe.regions);
    let mut bare = vec![false; rest_surface.triangles.len()];
    for (name, at) in &recipe.bare {
        let own = regions.union(std::slice::from_ref(name), at)?;
        bare.iter_mut().zip(own).for_each(|(bare, own)| *bare |= own);
    }
    let mut ids = UsedIds::default();
    ids.take(body.taxels.iter().map(|taxel| taxel.id), "the file", &Origin::default())?;
    let drawn = DrawnPoses::from_body(body);
    let looks = !recipe.keeps_hidden && recipe.places.iter().any(|place| place.how.samples());
    let touchable = looks.then(|| Touchable::new(body, &drawn));
    let mut seated = Seated::default();
    let is_alone = body.taxels.is_empty() && recipe.places.len() == 1;
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
        let tick = &mut |done: f64| progress((index as f64 + done) / recipe.places.len() as f64);
        let fill = Fill {
            rest_surface,
            place,
            seed: recipe.seed_of(place),
            is_scattered: recipe.is_scattered,
            touchable: touchable.as_ref(),
            clear_m: recipe.clear_m,
            is_mirrored: recipe.is_mirrored,
        };
        let filled = fill.place(&region, tick).map_err(|e| place.at.put(e))?;
        seated.add(rest_surface, place, &region, filled, &mut ids, is_alone)?;
    }
    Ok(seated)
}

impl Seated {
    /// Adds the taxels that `place` has in `region`, a flag for each triangle; `is_alone` if the body has no others.
    fn add(
        &mut self,
        rest_surface: &RestSurface<'_>,
        place: &PlaceSpec,
        region: &[bool],
        filled: Filled,
        used: &mut UsedIds,
        is_alone: bool,
    ) -> Result<()> {
        let Filled { taxels: filled, cells, hidden_m2, notes, is_mirrored } = filled;
        self.notes.extend(notes);
        let last = u64::from(place.first_id) + filled.len() as u64;
        if last > u64::from(MAX_TAXEL_ID) + 1 {
            let what =
                format!("its ids would reach {last}, over the {MAX_TAXEL_ID} that a file can hold; lower `first_id`");
            return Err(place.at.wrong(what));
        }
        let ids: Vec<u32> = filled.iter().zip(place.first_id..).map(|(one, next)| one.id.unwrap_or(next)).collect();
        used.take(ids.iter().copied(), &format!("place `{}`", place.name), &place.at)?;
        self.notes.extend(without_area(place, &filled, &ids));
        let is_whole = is_alone && place.modality.unwrap_or_default().is_pressed() && !region.contains(&false);
        self.divided = cells.filter(|_| is_whole).map(|cells| (ids.clone(), cells));
        let first = self.taxels.len();
        let links = rest_surface.link.iter().zip(region).filter(|(_, is_in)| **is_in).map(|(&link, _)| link).collect();
        let seat = |(one, &id): (&Snapped, &u32)| {
            let modality = one.modality.or(place.modality).unwrap_or_default();
            rest_surface.mesh_taxel(&one.placed, id, (modality, one.tangent_in_body), &links)
        };
        self.taxels.extend(filled.iter().zip(&ids).map(seat));
        if is_mirrored {
            let images = filled.iter().map(|one| &one.placed).skip(1).step_by(2);
            seat_images(rest_surface, images, &mut self.taxels[first..]).map_err(|e| place.at.put(e))?;
            self.pairs.extend(ids.chunks_exact(2).map(|ids| [ids[0], ids[1]]));
            self.notes.push(format!(
                "place `{}`: {} pairs; id {} and every second one from there is on the left, and its mirror image has the next id",
                place.name,
                filled.len() / 2,
                place.first_id
            ));
        }
        self.reports.push(report(rest_surface, place, ids, &filled, (&self.taxels[first..], hidden_m2)));
        Ok(())
    }
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
        *other = rest_surface.mesh_taxel(
            image,
            other.taxel.id,
            (other.taxel.modality, None),
            &BTreeSet::from([link as u32]),
        );
        if other.taxel.link != link {
            let name = |link: usize| &rest_surface.body.links[link].name;
            return Err(failed!(
                "`mirror`: taxel {} is on link `{}`, but its mirror image is not on `{}`: the mesh is bound to the two unlike; leave `mirror` out",
                one.taxel.id,
                name(one.taxel.link),
                name(link)
            ));
        }
    }
    Ok(())
}
