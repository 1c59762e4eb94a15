//! Fills a place of a recipe with taxels.

use std::collections::BTreeMap;

use glam::DVec3;

use super::borders::Borders;
use super::ground::{Ground, Rules};
use super::lattice::{LaidGrid, Lattice};
use super::lint::Touchable;
use super::place::{apart, by_density, evenly, evenly_apart, nearest_on_its_side, set_cell_areas, skin_by_density};
use super::placed::{Placed, Progress, SurfacePoint};
use super::points::{Snapped, of_icub, of_marks, of_table, snap};
use super::recipe::{PlaceSpec, Placement, shown};
use super::relax::{MOST_POINTS, Weight, relax};
use super::rest_surface::RestSurface;
use super::scatter::most_apart;
use super::shares::{left_out, scatter, shares};
use super::tear::{Tear, worst_tear};
use crate::body::{Topology, listed};
use crate::error::{Error, Result, failed};
use crate::field::Divided;

/// Progress when it is known where taxels may be, when they are scattered, and when they have moved.
const PROGRESS_SEEN: f64 = 0.2;
const PROGRESS_SCATTERED: f64 = 0.4;
const PROGRESS_MOVED: f64 = 0.9;

/// A place of a recipe that is to be filled.
pub(super) struct Fill<'a> {
    pub(super) rest_surface: &'a RestSurface<'a>,
    pub(super) place: &'a PlaceSpec,
    pub(super) seed: u64,
    /// Whether sampled points stay where they are scattered.
    pub(super) is_scattered: bool,
    /// What stands before the surface; `None` where hidden surface gets taxels, too.
    pub(super) touchable: Option<&'a Touchable<'a>>,
    /// How far from borders of links and seams taxels are at least, m.
    pub(super) clear_m: Option<f64>,
    /// Whether the two sides of the body get the same taxels.
    pub(super) is_mirrored: bool,
}

/// What a place is filled with.
#[derive(Default)]
pub(super) struct Filled {
    pub(super) taxels: Vec<Snapped>,
    /// The cells of all of the place's triangles, if they are known.
    pub(super) cells: Option<Divided>,
    /// Hidden surface of the place by link, m².
    pub(super) hidden_m2: BTreeMap<usize, f64>,
    pub(super) notes: Vec<String>,
    /// Whether each second taxel is the mirror image of the one before it.
    pub(super) is_mirrored: bool,
}

/// The triangles of a place.
pub(super) struct Surface<'a> {
    pub(super) positions: &'a [DVec3],
    pub(super) triangles: Vec<[u32; 3]>,
    /// Per triangle its number among all.
    pub(super) chosen: &'a [usize],
    pub(super) topology: Topology,
}

impl Fill<'_> {
    /// Its taxels on the triangles in `region`.
    pub(super) fn place(&self, region: &[bool], progress: Progress<'_>) -> Result<Filled> {
        let mut filled = Filled::default();
        let chosen: Vec<usize> = (0..region.len()).filter(|&triangle| region[triangle]).collect();
        if self.is_mirrored {
            return self.sample_mirrored(&chosen, progress);
        }
        let notes = &mut filled.notes;
        filled.taxels = match &self.place.how {
            Placement::Grid { hexagonal, pitch_m, origin, u } => {
                check_fits(self.rest_surface, &chosen, "pitch", *pitch_m)?;
                let lattice = Lattice { hexagonal: *hexagonal, pitch_m: *pitch_m, origin: *origin, u: *u };
                self.lay(&lattice, region, notes, progress)?
            }
            Placement::Marks { names, within_m } => {
                snap(self.rest_surface, region, &of_marks(self.rest_surface, names)?, *within_m)?
            }
            Placement::Icub { path, link, within_m } => {
                let (given, more) = of_icub(
                    self.rest_surface,
                    path,
                    link.as_deref(),
                    self.place.modality.unwrap_or_default(),
                    self.place.first_id,
                )?;
                notes.extend(more);
                snap(self.rest_surface, region, &given, *within_m)?
            }
            Placement::Table { path, within_m } => {
                let given = of_table(self.rest_surface, path, self.place.modality)?;
                snap(self.rest_surface, region, &given, *within_m).map_err(|e| e.at(path.display()))?
            }
            _ => return self.sample(&chosen, progress),
        };
        Ok(filled)
    }

    /// The points of `lattice` that may get taxels.
    fn lay(
        &self,
        lattice: &Lattice,
        region: &[bool],
        notes: &mut Vec<String>,
        progress: Progress<'_>,
    ) -> Result<Vec<Snapped>> {
        let laid = lattice.lay(self.rest_surface, region, progress)?;
        if laid.placed.is_empty() {
            return Err(Error::failed("no place of the grid is on the region; make `pitch` smaller or move `origin`"));
        }
        if let Some(tear) = worst_tear(lattice, &laid, self.rest_surface, region) {
            let chosen = (0..region.len()).filter(|&triangle| region[triangle]);
            let area_m2: f64 = chosen.map(|triangle| self.rest_surface.area(triangle)).sum();
            return Err(self.torn(lattice, &tear, (area_m2 / lattice.cell_m2()).round().max(1.0) as usize));
        }
        let LaidGrid { placed, reached_share, .. } = laid;
        let name = &self.place.name;
        if reached_share < 0.999 {
            notes.push(format!(
                "place `{name}`: the grid covers the part of its region that is connected to the origin, {:.0} % of it; write \
                 a [[place]] for each other part",
                100.0 * reached_share
            ));
        }
        let chosen: Vec<usize> = (0..region.len()).collect();
        let borders = self.clear_m.map(|clear_m| {
            let topology = self.rest_surface.topology();
            Borders::new(self.rest_surface, &chosen, topology, clear_m)
        });
        let rules = Rules {
            rest_surface: self.rest_surface,
            chosen: &chosen,
            touchable: self.touchable,
            borders,
            mirror: None,
        };
        let count = placed.len();
        let kept = rules.without_closed(placed.clone(), progress)?;
        let placed = match kept.len() {
            0 => placed,
            left if left < count => {
                let lost = count - left;
                notes.push(format!(
                    "place `{name}`: {lost} of {count} points of the grid get no taxel: nothing can touch them, or they are too \
                     near to a border"
                ));
                kept
            }
            _ => kept,
        };
        Ok(placed.into_iter().map(Snapped::on_surface).collect())
    }

    /// The triangles `chosen`.
    pub(super) fn surface<'s>(&'s self, chosen: &'s [usize]) -> Surface<'s> {
        let positions = &self.rest_surface.positions[..];
        let triangles: Vec<[u32; 3]> = chosen.iter().map(|&triangle| self.rest_surface.triangles[triangle]).collect();
        let topology = Topology::of_groups(positions, &triangles, &|vertex| self.rest_surface.group_of(vertex));
        Surface { positions, triangles, chosen, topology }
    }

    /// The error on a grid that does not keep its pitch. It proposes `count` taxels, which are as dense.
    fn torn(&self, lattice: &Lattice, tear: &Tear, count: usize) -> Error {
        let named: Vec<String> = self.place.regions.iter().map(|name| format!("`{name}`")).collect();
        let region = match named.len() {
            0 => "the whole surface".to_owned(),
            1 => format!("region {}", named[0]),
            _ => format!("regions {}", listed(&named)),
        };
        let [from, to] = tear.ends.map(|p| format!("({:.3}, {:.3}, {:.3})", p.x, p.y, p.z));
        failed!(
            "a {} grid with a pitch of {} tears on {region}, which does not unroll: its points at {from} and {to} m are neighbours \
             {:.1} mm apart; write `taxels = {count}` instead of `grid` and `pitch`, for taxels that are spread evenly",
            if lattice.hexagonal { "hexagonal" } else { "rectangular" },
            shown(lattice.pitch_m),
            tear.distance_m * 1e3
        )
    }

    /// Taxels sampled on the triangles `chosen`.
    fn sample(&self, chosen: &[usize], progress: Progress<'_>) -> Result<Filled> {
        let mut filled = Filled::default();
        let surface = self.surface(chosen);
        let positions = surface.positions;
        let area_m2: f64 = chosen.iter().map(|&triangle| self.rest_surface.area(triangle)).sum();
        let count = match &self.place.how {
            Placement::Apart { spacing_m } => {
                check_fits(self.rest_surface, chosen, "spacing", *spacing_m)?;
                most_apart(area_m2, *spacing_m)? as usize
            }
            Placement::Evenly { count, .. } | Placement::Density { count, .. } => *count,
            _ => 0,
        };
        let borders = self.clear_m.map(|clear_m| Borders::new(self.rest_surface, chosen, &surface.topology, clear_m));
        let rules = Rules { rest_surface: self.rest_surface, chosen, touchable: self.touchable, borders, mirror: None };
        let seen = &mut |share| progress(PROGRESS_SEEN * share);
        let ground = Ground::new(rules, positions, &surface.triangles, count, seen)?;
        let progress = &mut |share| progress(PROGRESS_SEEN + (1.0 - PROGRESS_SEEN) * share);
        let placed = match &self.place.how {
            Placement::Evenly { count, apart_m: None } => {
                self.evenly(&surface, &ground, *count, &mut filled.notes, progress)?
            }
            Placement::Evenly { count, apart_m: Some(apart_m) } => {
                self.evenly_apart(&surface, &ground, (*count, *apart_m), (area_m2, &mut filled.notes), progress)?
            }
            Placement::Apart { spacing_m } => {
                let placed = apart(positions, &surface.triangles, *spacing_m, self.seed, progress)?;
                ground.rules().without_closed(placed, &mut |_| true)?
            }
            Placement::Density { attribute, .. } => {
                let painted = self.rest_surface.painted(attribute)?;
                let density = |p: &Placed| {
                    let corners = surface.triangles[p.triangle].map(|v| painted[v as usize].unwrap_or(0.0));
                    corners.iter().zip(p.barycentric).map(|(value, weight)| value * weight).sum()
                };
                let placed = self.by_density(&surface, &ground, count, &density, progress)?;
                self.set_areas(&surface, &ground, Some(&density), placed, &mut filled);
                return Ok(filled);
            }
            _ => Vec::new(),
        };
        self.set_areas(&surface, &ground, None, placed, &mut filled);
        Ok(filled)
    }

    /// Puts `placed` into `filled`, each with the area of its cell on what is skin, and notes what is hidden.
    pub(super) fn set_areas(
        &self,
        surface: &Surface<'_>,
        ground: &Ground<'_>,
        density: Option<&dyn Fn(&Placed) -> f64>,
        mut placed: Vec<Placed>,
        filled: &mut Filled,
    ) {
        let Surface { positions, triangles, chosen, .. } = surface;
        let mut is_skin = ground.skin(positions, triangles);
        // Where a taxel is, something can touch the surface, if little of the triangle.
        placed.iter().for_each(|one| is_skin[one.triangle] = true);
        let is_surface = match density {
            Some(density) => skin_by_density(positions, triangles, density),
            None => vec![true; triangles.len()],
        };
        let group_of = |vertex| self.rest_surface.group_of(vertex);
        let skin = is_skin.contains(&false).then_some(&is_skin[..]);
        let cells = set_cell_areas(positions, triangles, &group_of, (&is_surface, skin), &mut placed);
        filled.cells = cells.filter(|_| !is_surface.contains(&false));
        let in_body = |one: Placed| Placed { triangle: chosen[one.triangle], ..one };
        let taxels = placed.into_iter().map(|one| Snapped::on_surface(in_body(one)));
        filled.taxels = taxels.collect();
        filled.hidden_m2 = ground.hidden_m2();
        let name = &self.place.name;
        if ground.is_inside_out() {
            filled.notes.push(format!(
                "place `{name}`: its faces look inward, so that it is not known what can be touched: taxels are all over it; \
                 turn them round"
            ));
        }
        if let Some(links) = self.listed_areas(&filled.hidden_m2) {
            let whole: f64 = chosen.iter().map(|&triangle| self.rest_surface.area(triangle)).sum();
            let hidden: f64 = filled.hidden_m2.values().sum();
            filled.notes.push(format!(
                "place `{name}`: nothing can touch {} of its surface, {:.0} %, which gets no taxel: {}",
                square(hidden),
                100.0 * hidden / whole,
                links
            ));
        }
    }

    /// Links with their areas, the largest first; `None` if there are none.
    pub(super) fn listed_areas(&self, area_m2: &BTreeMap<usize, f64>) -> Option<String> {
        let mut links: Vec<(usize, f64)> = area_m2.iter().map(|(&link, &area)| (link, area)).collect();
        links.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let named = |&(link, area): &(usize, f64)| format!("`{}` {}", self.link_name(link), square(area));
        (!links.is_empty()).then(|| listed(&links.iter().map(named).collect::<Vec<_>>()))
    }

    fn link_name(&self, link: usize) -> &str {
        &self.rest_surface.body.links[link].name
    }

    /// `count` taxels on what `ground` leaves, shared among links and their pieces, and moved until their cells are alike.
    pub(super) fn evenly(
        &self,
        surface: &Surface<'_>,
        ground: &Ground<'_>,
        count: usize,
        notes: &mut Vec<String>,
        progress: Progress<'_>,
    ) -> Result<Vec<Placed>> {
        let Surface { positions, triangles, chosen, topology } = surface;
        if self.is_scattered {
            let placed = match ground.is_all() {
                true => return evenly(positions, triangles, count, self.seed, progress),
                false => by_density(positions, triangles, count, self.seed, is_open(ground), progress)?,
            };
            return ground.settled(placed, &mut |_| true);
        }
        let link_of = |triangle: usize| self.rest_surface.link[chosen[triangle]] as usize;
        let pieces = shares(positions, triangles, topology, link_of, ground, count);
        notes.extend(self.too_small(&left_out(&pieces)));
        if count > MOST_POINTS {
            notes.push(format!(
                "place `{}`: over {MOST_POINTS} taxels stay where they are scattered; give several places, by regions, for even ones",
                self.place.name
            ));
        }
        let open_m2 = pieces.iter().map(|piece| piece.open_m2).sum();
        let scattered = scatter(positions, triangles, &pieces, ground, self.seed, &mut |share| {
            progress(PROGRESS_SCATTERED * share)
        })?;
        let is_open = |position, normal| ground.is_open(position, normal);
        let weight = if ground.is_all() { Weight::Same } else { Weight::Open(&is_open) };
        let moving = PROGRESS_MOVED - PROGRESS_SCATTERED;
        let tick = &mut |share| progress(PROGRESS_SCATTERED + moving * share);
        let moved = relax(positions, triangles, topology, &scattered, (open_m2, &weight), tick)?;
        ground.settled(moved, &mut |share| progress(PROGRESS_MOVED + (1.0 - PROGRESS_MOVED) * share))
    }

    /// The note on pieces without a taxel, by link how many and their open area, m².
    fn too_small(&self, left: &BTreeMap<usize, (usize, f64)>) -> Option<String> {
        let mut links: Vec<(usize, (usize, f64))> = left.iter().map(|(&link, &left)| (link, left)).collect();
        links.sort_by(|a, b| b.1.1.total_cmp(&a.1.1).then(a.0.cmp(&b.0)));
        let named: Vec<String> = links
            .iter()
            .map(|&(link, (pieces, area))| format!("{pieces} of `{}` ({})", self.link_name(link), square(area)))
            .collect();
        let pieces: usize = left.values().map(|(pieces, _)| pieces).sum();
        let what = match pieces {
            0 => return None,
            1 => "1 piece of the surface gets no taxel, as it is too small for one".to_owned(),
            _ => format!("{pieces} pieces of the surface get no taxel, as each is too small for one"),
        };
        Some(format!("place `{}`: {what}: {}", self.place.name, listed(&named)))
    }

    /// The same with none closer than `apart_m`.
    fn evenly_apart(
        &self,
        surface: &Surface<'_>,
        ground: &Ground<'_>,
        (count, apart_m): (usize, f64),
        (area_m2, notes): (f64, &mut Vec<String>),
        progress: Progress<'_>,
    ) -> Result<Vec<Placed>> {
        let wrong = |most: String| {
            failed!(
                "{count} taxels do not fit {} apart on {:.1} cm²; {most}, or ask for a smaller spacing",
                shown(apart_m),
                area_m2 * 1e4
            )
        };
        // The densest packing on both sides of thin parts.
        let most = area_m2 * 2.0 / (3.0_f64.sqrt() * apart_m * apart_m);
        if count as f64 > most + 1.0 {
            return Err(wrong(format!("not even the densest packing holds over {most:.0}")));
        }
        if !self.is_scattered {
            let placed = self.evenly(surface, ground, count, notes, progress)?;
            let points: Vec<SurfacePoint> = placed.iter().map(|placed| placed.point).collect();
            if nearest_on_its_side(&points).into_iter().flatten().all(|distance| distance >= apart_m) {
                return Ok(placed);
            }
            notes.clear();
        }
        let keep = |placed| ground.rules().without_closed(placed, &mut |_| true);
        let fit = evenly_apart(surface.positions, &surface.triangles, count, (apart_m, &keep), self.seed, progress)?;
        fit.map_err(|fit| wrong(format!("ask for at most {fit}")))
    }

    fn by_density(
        &self,
        surface: &Surface<'_>,
        ground: &Ground<'_>,
        count: usize,
        density: &dyn Fn(&Placed) -> f64,
        progress: Progress<'_>,
    ) -> Result<Vec<Placed>> {
        let Surface { positions, triangles, topology, .. } = surface;
        let is_open = is_open(ground);
        let dense = |p: &Placed| match density(p) {
            density if density > 0.0 => density * is_open(p),
            density => density,
        };
        let tick = &mut |share| progress(PROGRESS_SCATTERED * share);
        let mut placed = by_density(positions, triangles, count, self.seed, dense, tick)?;
        if !self.is_scattered {
            let moving = PROGRESS_MOVED - PROGRESS_SCATTERED;
            let tick = &mut |share| progress(PROGRESS_SCATTERED + moving * share);
            placed = relax(positions, triangles, topology, &placed, (0.0, &Weight::Density(&dense)), tick)?;
        }
        ground.settled(placed, &mut |share| progress(PROGRESS_MOVED + (1.0 - PROGRESS_MOVED) * share))
    }
}

/// 1 where `ground` may get taxels, else 0.
fn is_open(ground: &Ground<'_>) -> impl Fn(&Placed) -> f64 {
    |p| f64::from(u8::from(ground.is_all() || ground.is_open(p.point.position, p.point.normal)))
}

/// `area_m2` as text.
fn square(area_m2: f64) -> String {
    if area_m2 < 1e-4 { format!("{:.0} mm²", area_m2 * 1e6) } else { format!("{:.1} cm²", area_m2 * 1e4) }
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
