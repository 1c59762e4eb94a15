//! What is reported of each place of a recipe.

use std::collections::BTreeMap;

use super::cell_spread::cell_spread;
use super::place::nearest_on_its_side;
use super::placed::SurfacePoint;
use super::points::Snapped;
use super::recipe::PlaceSpec;
use super::rest_surface::{MeshTaxel, RestSurface};

/// The result of a place of a recipe.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
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

/// The report of `place`, whose taxels `ids` are `filled` and, on their meshes, `seated`; `hidden_m2` is by link.
pub(super) fn report(
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
