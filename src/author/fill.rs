//! Fills a place of a recipe with taxels.

use glam::DVec3;

use super::lattice::Lattice;
use super::place::{apart, by_density, evenly, evenly_apart, nearest_on_its_side, set_cell_areas, skin_by_density};
use super::placed::{Placed, Progress, SurfacePoint};
use super::points::{Snapped, of_icub, of_marks, of_table, snap};
use super::recipe::{PlaceSpec, Placement, shown};
use super::relax::{Weight, relax};
use super::rest_surface::RestSurface;
use crate::body::{area_vector, listed};
use crate::error::{Error, Result, failed};
use crate::field::Divided;

/// Progress when points are scattered, before they move.
const SCATTERED: f64 = 0.3;

/// A place of a recipe that is to be filled.
pub(super) struct Fill<'a> {
    pub(super) rest_surface: &'a RestSurface<'a>,
    pub(super) place: &'a PlaceSpec,
    pub(super) seed: u64,
    /// Whether sampled points stay where they are.
    pub(super) is_scattered: bool,
}

impl Fill<'_> {
    /// Its taxels on the triangles in `region`, and the cells of all of these, if they are known.
    pub(super) fn place(
        &self,
        region: &[bool],
        notes: &mut Vec<String>,
        progress: Progress<'_>,
    ) -> Result<(Vec<Snapped>, Option<Divided>)> {
        let Self { rest_surface, place, seed, .. } = *self;
        let chosen: Vec<usize> = (0..region.len()).filter(|&triangle| region[triangle]).collect();
        let triangles: Vec<[u32; 3]> = chosen.iter().map(|&triangle| rest_surface.triangles[triangle]).collect();
        let positions = &rest_surface.positions;
        let mut divided = None;
        let mut on_skin = |mut placed: Vec<Placed>, is_skin: &[bool]| {
            let group_of = |vertex| rest_surface.group_of(vertex);
            let cells = set_cell_areas(positions, &triangles, &group_of, is_skin, &mut placed);
            divided = cells.filter(|_| !is_skin.contains(&false));
            let onto_canvas = |p: Placed| Placed { triangle: chosen[p.triangle], ..p };
            placed.into_iter().map(|p| Snapped { placed: onto_canvas(p), id: None, moved_m: 0.0 }).collect()
        };
        let mut sampled = |placed: Vec<Placed>| on_skin(placed, &vec![true; triangles.len()]);
        let filled = match &place.how {
            Placement::Evenly { count, apart_m: None } => {
                let scattered = evenly(positions, &triangles, *count, seed, &mut |share| progress(SCATTERED * share))?;
                let progress = &mut |share| progress(SCATTERED + (1.0 - SCATTERED) * share);
                sampled(self.relaxed(&triangles, scattered, &Weight::Same, progress)?)
            }
            Placement::Evenly { count, apart_m: Some(apart_m) } => {
                let area: f64 = chosen.iter().map(|&triangle| rest_surface.area(triangle)).sum();
                let wrong = |most: String| {
                    failed!(
                        "{count} taxels do not fit {} apart on {:.1} cm²; {most}, or ask for a smaller spacing",
                        shown(*apart_m),
                        area * 1e4
                    )
                };
                // The densest packing on both sides of thin parts.
                let most = area * 2.0 / (3.0_f64.sqrt() * apart_m * apart_m);
                if *count as f64 > most + 1.0 {
                    return Err(wrong(format!("not even the densest packing holds over {most:.0}")));
                }
                if !self.is_scattered {
                    let scattered =
                        evenly(positions, &triangles, *count, seed, &mut |share| progress(SCATTERED * share))?;
                    let progress = &mut |share| progress(SCATTERED + (1.0 - SCATTERED) * share);
                    let relaxed = self.relaxed(&triangles, scattered, &Weight::Same, progress)?;
                    let points: Vec<SurfacePoint> = relaxed.iter().map(|placed| placed.point).collect();
                    if nearest_on_its_side(&points).into_iter().flatten().all(|distance| distance >= *apart_m) {
                        return Ok((sampled(relaxed), divided));
                    }
                }
                match evenly_apart(positions, &triangles, *count, *apart_m, seed, progress)? {
                    Ok(placed) => sampled(placed),
                    Err(fit) => return Err(wrong(format!("ask for at most {fit}"))),
                }
            }
            Placement::Apart { spacing_m } => {
                check_fits(rest_surface, &chosen, "spacing", *spacing_m)?;
                sampled(apart(positions, &triangles, *spacing_m, seed, progress)?)
            }
            Placement::Density { count, attribute } => {
                let painted = rest_surface.painted(attribute)?;
                let density = |p: &Placed| {
                    let corners = triangles[p.triangle].map(|v| painted[v as usize].unwrap_or(0.0));
                    corners.iter().zip(p.barycentric).map(|(value, weight)| value * weight).sum()
                };
                let scattered =
                    by_density(positions, &triangles, *count, seed, density, &mut |share| progress(SCATTERED * share))?;
                let progress = &mut |share| progress(SCATTERED + (1.0 - SCATTERED) * share);
                let placed = self.relaxed(&triangles, scattered, &Weight::Density(&density), progress)?;
                on_skin(placed, &skin_by_density(positions, &triangles, density))
            }
            Placement::Grid { hexagonal, pitch_m, origin, u } => {
                check_fits(rest_surface, &chosen, "pitch", *pitch_m)?;
                let lattice = Lattice { hexagonal: *hexagonal, pitch_m: *pitch_m, origin: *origin, u: *u };
                let laid = lattice.lay(rest_surface, region, progress)?;
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
                let filled = laid.placed.into_iter().map(|placed| Snapped { placed, id: None, moved_m: 0.0 });
                filled.collect()
            }
            Placement::Marks { names, within_m } => {
                snap(rest_surface, region, &of_marks(rest_surface, names)?, *within_m)?
            }
            Placement::Icub { path, link, within_m } => {
                let (given, more) = of_icub(rest_surface, path, link.as_deref(), place.modality, place.first_id)?;
                notes.extend(more);
                snap(rest_surface, region, &given, *within_m)?
            }
            Placement::Table { path, within_m } => {
                let given = of_table(rest_surface, path)?;
                snap(rest_surface, region, &given, *within_m).map_err(|e| e.at(path.display()))?
            }
        };
        Ok((filled, divided))
    }

    /// `placed`, moved until their cells are alike, unless they are to stay.
    fn relaxed(
        &self,
        triangles: &[[u32; 3]],
        placed: Vec<Placed>,
        weight: &Weight<'_>,
        progress: Progress<'_>,
    ) -> Result<Vec<Placed>> {
        if self.is_scattered {
            return Ok(placed);
        }
        let positions = &self.rest_surface.positions;
        let at = |v: u32| positions[v as usize];
        let area_m2 = triangles.iter().map(|corners| area_vector(corners.map(at)).length() / 2.0).sum();
        let group_of = |vertex| self.rest_surface.group_of(vertex);
        relax(positions, triangles, &group_of, &placed, (area_m2, weight), progress)
    }
}

/// Rejects a length wider than the triangles `chosen`, which was not meant in metres.
fn check_fits(rest_surface: &RestSurface<'_>, chosen: &[usize], key: &str, length_m: f64) -> Result<()> {
    let corners = chosen.iter().flat_map(|&triangle| rest_surface.corners(triangle));
    let (low, high) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    let across_m = low.distance(high);
    if length_m <= across_m {
        return Ok(());
    }
    Err(failed!(
        "a {key} of {} is wider than what it is for, which is {} across; numbers are metres: for millimetres write \"{} mm\"",
        shown(length_m),
        shown(across_m),
        length_m
    ))
}

/// The note on taxels without an area.
pub(super) fn without_area(place: &PlaceSpec, filled: &[Snapped], ids: &[u32]) -> Option<String> {
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
