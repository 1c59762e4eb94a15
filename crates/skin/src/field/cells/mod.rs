//! Cells: the part of a surface that is nearer to a point than to other points, by shortest paths along the surface.
//!
//! Windows run from all points at once, so that each ends soon beyond its own cell. In each triangle that several points
//! reach, their distances to its corners give the borders (`polygon.rs`). Long edges are cut beforehand (`refine.rs`).

mod coarsen;
mod divided;
mod locate;
mod marched;
mod middles;
mod parts;
mod polygon;
mod refine;
mod spacing;

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

pub use self::divided::{CellPoint, Divided};
use self::locate::Located;
use self::marched::{Ground, Marched};
pub use self::middles::Relaxation;
use self::parts::{Parts, corner_at};
use self::polygon::{Candidate, Side, nearest_part, share, squared_at};
use self::refine::refine;
pub use self::spacing::COINCIDENT_M;
use self::spacing::Spacing;
use super::geodesic::{Start, SurfacePlace, Waves};
use crate::body::{NONE, Topology, area_vector, point_tree};

/// The largest number of triangles after cutting: per triangle before, and per point.
const CUTS_PER_TRIANGLE: usize = 4;
const CUTS_PER_POINT: usize = 60;

/// Number of windows at which a surface counts as too rough, and is marched over: in all, per triangle, and where there are few of these.
const MAX_WINDOWS: usize = 40_000_000;
const WINDOWS_PER_TRIANGLE: usize = 10;
const WINDOWS_PER_POINT: usize = 1_000;
const MIN_WINDOWS: usize = 500_000;

/// The same per triangle and point where the surface of cells is asked for, which is so at each start: a second for thousands of points.
const AT_START: [usize; 2] = [10, 300];

/// Parts of a surface with more triangles than this for each point are marched over instead of covered by windows.
const MARCHED_PER_POINT: usize = 400;

/// How far cells of a surface reach that is asked for, in distances of a point to its nearest other where that is largest: over the
/// side of a thin part that has points on its faces alone.
const REACH: f64 = 2.0;

/// The same beside hidden surface, which has no points: over skin that has, and not far into what has none.
const REACH_HIDDEN: f64 = 3.0;

/// Polygons with less of a triangle than this are rounding errors.
const MIN_SHARE: f64 = 1e-12;

/// A triangle in nobody's cell.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    middle: DVec3,
    normal: DVec3,
    area: f64,
}

impl Piece {
    fn from_corners(corners: [DVec3; 3]) -> Self {
        let spanned = area_vector(corners);
        let [a, b, c] = corners;
        Self { middle: (a + b + c) / 3.0, normal: spanned.normalize_or_zero(), area: spanned.length() / 2.0 }
    }
}

/// What two cells share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Border {
    /// Its length, m.
    pub length_m: f64,
    /// The length of the shortest path from point to point over it, m.
    pub path_m: f64,
}

/// The cells of points.
pub struct Cells {
    /// Per point, m²; points at one place have the same cell.
    pub areas: Vec<f64>,
    /// Per point the first one at its place, which its borders are listed for.
    pub first: Vec<u32>,
    /// By the two points, the lower first.
    pub borders: BTreeMap<(u32, u32), Border>,
    /// The parts of the surface that no path leads to from any point.
    pub pieces: Vec<Piece>,
    /// The surface in triangles with the point whose cell they are in, the first at its place, if that was asked for.
    pub surface: Vec<(u32, [DVec3; 3])>,
}

/// Memory that is used again for each triangle.
#[derive(Default)]
struct Scratch {
    polygon: Vec<Side>,
    spare: Vec<Side>,
}

impl Cells {
    /// The cells of `places` on `topology`. Where a surface is too fine or too rough for windows,
    /// areas are within 2 % if its triangles are about as long as wide; on fans of long triangles single ones are off by 17 %.
    pub fn new(topology: &Topology, places: &[SurfacePlace]) -> Self {
        Self::made(topology, places, (MARCHED_PER_POINT, None), None)
    }

    /// The same, where only triangles for which `is_skin` is true count for areas, borders and pieces. Paths lead over the others too, as
    /// far as [`REACH_HIDDEN`].
    pub fn of_skin(topology: &Topology, places: &[SurfacePlace], is_skin: &dyn Fn(u32) -> bool) -> Self {
        Self::made(topology, places, (MARCHED_PER_POINT, Some(is_skin)), None)
    }

    /// The same with [`Self::surface`], of what is within [`REACH`] of a point: bare surface around a skin is in no cell.
    pub fn with_surface(topology: &Topology, places: &[SurfacePlace]) -> Self {
        Self::made(topology, places, (MARCHED_PER_POINT, None), Some(Parts::default()))
    }

    /// The same by windows alone, which are exact.
    #[cfg(test)]
    fn in_windows(topology: &Topology, places: &[SurfacePlace]) -> Self {
        Self::made(topology, places, (usize::MAX, None), None)
    }

    /// Parts with more than `marched_per_point` triangles for each point are marched over; areas are of triangles that are skin.
    fn made(
        topology: &Topology,
        places: &[SurfacePlace],
        (marched_per_point, skin): (usize, Option<&dyn Fn(u32) -> bool>),
        mut parts_of_cells: Option<Parts>,
    ) -> Self {
        let positions: Vec<DVec3> = places.iter().map(|place| place.position(topology)).collect();
        let first = first_of_place(topology, places, &positions);
        let is_first = |&point: &usize| first[point] as usize == point;
        let starts: Vec<usize> = (0..places.len()).filter(is_first).collect();
        let mut cells = Self::empty(first);
        let is_fine = fine_parts(topology, starts.iter().map(|&start| places[start].triangle), marched_per_point);
        let is_fine = |triangle: u32| is_fine[topology.part[triangle as usize] as usize];
        let spacing = Spacing::from_positions(&starts.iter().map(|&start| positions[start]).collect::<Vec<_>>());
        let reach_m = match (&parts_of_cells, skin) {
            (Some(_), _) => REACH * spacing.largest_m(),
            (None, Some(_)) => REACH_HIDDEN * spacing.largest_m(),
            (None, None) => f64::INFINITY,
        };
        let is_skin = |triangle: u32| skin.is_none_or(|is_skin| is_skin(triangle));
        let most = CUTS_PER_TRIANGLE * topology.triangles.len() + CUTS_PER_POINT * starts.len();
        let [per_triangle, per_point] =
            if parts_of_cells.is_some() { AT_START } else { [WINDOWS_PER_TRIANGLE, WINDOWS_PER_POINT] };
        let most_windows = |surface: &Topology| {
            (per_triangle * surface.triangles.len() + per_point * starts.len()).clamp(MIN_WINDOWS, MAX_WINDOWS)
        };
        let refined = refine(topology, spacing.shortest_edge(), |p| spacing.edge_at(p), most);
        match refined {
            None => {
                let starts = starts.iter().map(|&start| (start, places[start])).collect();
                cells.divide(
                    topology,
                    (starts, reach_m),
                    (is_fine, is_skin),
                    most_windows(topology),
                    parts_of_cells.as_mut(),
                );
                cells.surface =
                    parts_of_cells.map_or(Vec::new(), |parts| parts.triangles(topology, |triangle| triangle, topology));
            }
            Some(refined) => {
                let cut = Topology::new(&refined.positions, &refined.triangles);
                let mut parts: Vec<Vec<u32>> = vec![Vec::new(); topology.triangles.len()];
                for (part, &given) in (0..).zip(&cut.given) {
                    parts[refined.parent[given as usize] as usize].push(part);
                }
                let parent = |part: u32| refined.parent[cut.given[part as usize] as usize];
                let mut located: BTreeMap<u32, Located<'_>> = BTreeMap::new();
                let within = starts.iter().filter_map(|&start| {
                    let (triangle, at) = (places[start].triangle, positions[start]);
                    let of_triangle =
                        located.entry(triangle).or_insert_with(|| Located::new(&cut, &parts[triangle as usize]));
                    of_triangle.part_at(at).map(|part| (start, SurfacePlace::in_triangle(&cut, part, at)))
                });
                let starts = within.collect();
                let of_part = (|part| is_fine(parent(part)), |part| is_skin(parent(part)));
                cells.divide(&cut, (starts, reach_m), of_part, most_windows(&cut), parts_of_cells.as_mut());
                cells.surface = parts_of_cells.map_or(Vec::new(), |parts| parts.triangles(&cut, parent, topology));
            }
        }
        for point in 0..places.len() {
            cells.areas[point] = cells.areas[cells.first[point] as usize];
        }
        cells
    }

    /// Empty cells, for points that each share the cell of point `first[point]`.
    fn empty(first: Vec<u32>) -> Self {
        let areas = vec![0.0; first.len()];
        Self { areas, first, borders: BTreeMap::new(), pieces: Vec::new(), surface: Vec::new() }
    }

    /// Divides what of `topology` is within `reach_m` of `starts`: points, each with its place. Parts whose triangles are fine are marched
    /// over, and so is all where windows are more than `most_windows`. Areas are of triangles that are skin.
    fn divide(
        &mut self,
        topology: &Topology,
        (starts, reach_m): (Vec<(usize, SurfacePlace)>, f64),
        (is_fine, is_skin): (impl Fn(u32) -> bool, impl Fn(u32) -> bool),
        most_windows: usize,
        mut parts: Option<&mut Parts>,
    ) {
        let mut waves = Waves::extending(topology, reach_m, most_windows);
        let mut is_reached = vec![false; topology.parts()];
        let mut ground = Ground::new(topology, &is_fine);
        let mut marched = Marched::new(topology, &ground, reach_m);
        let mut is_marched = vec![false; topology.parts()];
        for (triangle, &part) in (0..).zip(&topology.part) {
            is_marched[part as usize] |= is_fine(triangle);
        }
        // By triangle: the points in it, with the distances to its corners.
        let mut within: Vec<(u32, Candidate)> = Vec::new();
        for &(point, place) in &starts {
            let start = Start::new(topology, place.inward(), DVec3::X);
            for wedge in &start.wedges {
                let squared = wedge.corners.map(DVec2::length_squared);
                within.push((wedge.triangle, Candidate { site: point as u32, squared }));
            }
            let part = topology.part[place.triangle as usize] as usize;
            is_reached[part] = true;
            if is_marched[part] {
                marched.add(&start, point as u32);
            } else {
                waves.add(&start, point as u32);
            }
        }
        within.sort_by_key(|(triangle, candidate)| (*triangle, candidate.site));
        marched.run();
        if !waves.run() {
            is_marched.fill(true);
            ground = Ground::new(topology, |_| true);
            marched = Marched::new(topology, &ground, reach_m);
            for (point, place) in starts {
                marched.add(&Start::new(topology, place.inward(), DVec3::X), point as u32);
            }
            marched.run();
        }
        // Per edge the point that all of it belongs to on this side, if it is not a border yet.
        let mut owner = vec![NONE; topology.across.len()];
        let (mut candidates, mut scratch) = (Vec::new(), Scratch::default());
        let mut from = 0;
        for triangle in 0..topology.triangles.len() as u32 {
            let part = topology.part[triangle as usize] as usize;
            if !is_reached[part] {
                if is_skin(triangle) {
                    self.pieces.push(Piece::from_corners(topology.corners(triangle)));
                }
                continue;
            }
            from += within[from..].iter().take_while(|(other, _)| *other < triangle).count();
            let own = within[from..].iter().take_while(|(other, _)| *other == triangle);
            candidates.clear();
            candidates.extend(own.map(|(_, candidate)| *candidate));
            if is_marched[part] {
                marched.reaching(triangle, &mut candidates);
            } else {
                reaching(&waves, triangle, &mut candidates);
            }
            let owner = &mut owner[3 * triangle as usize..][..3];
            if is_skin(triangle) {
                self.share_out(topology, triangle, &candidates, owner, parts.as_deref_mut(), &mut scratch);
            } else if let ([candidate], Some(parts)) = (&candidates[..], parts.as_deref_mut()) {
                parts.add_whole(triangle, candidate.site);
            }
        }
        let least_m = |edge: u32, vertex: u32| match is_marched[topology.part[edge as usize / 3] as usize] {
            true => marched.least_m(vertex),
            false => waves.arrivals[vertex as usize].distance_m,
        };
        self.take_borders_along_edges(topology, &owner, least_m);
    }

    /// Shares a triangle of skin out among the points that reach it; each edge that is a point's alone gets it as `owner`.
    fn share_out(
        &mut self,
        topology: &Topology,
        triangle: u32,
        candidates: &[Candidate],
        owner: &mut [u32],
        mut parts: Option<&mut Parts>,
        scratch: &mut Scratch,
    ) {
        let corners = topology.corners(triangle);
        let area = area_vector(corners).length() / 2.0;
        match candidates {
            // Rounding hides it, as between needles.
            [] => self.pieces.push(Piece::from_corners(corners)),
            [candidate] => {
                self.areas[candidate.site as usize] += area;
                if let Some(parts) = parts {
                    parts.add_whole(triangle, candidate.site);
                }
                owner.fill(candidate.site);
            }
            _ => {
                for own in candidates {
                    let Scratch { polygon, spare } = scratch;
                    nearest_part(own, candidates, polygon, spare);
                    let share = share(polygon);
                    if share <= MIN_SHARE {
                        continue;
                    }
                    self.areas[own.site as usize] += share * area;
                    if let Some(parts) = parts.as_deref_mut() {
                        parts.add_polygon(triangle, own.site, polygon);
                    }
                    self.take_borders(own, corners, polygon);
                    for (index, side) in polygon.iter().enumerate().filter(|(_, side)| side.beyond.is_none()) {
                        if let Some(edge) = whole_side(side.from, polygon[(index + 1) % polygon.len()].from) {
                            owner[edge] = own.site;
                        }
                    }
                }
            }
        }
    }

    /// Takes the borders that are edges of the surface.
    fn take_borders_along_edges(&mut self, topology: &Topology, owner: &[u32], least_m: impl Fn(u32, u32) -> f64) {
        for (edge, &beyond) in (0..).zip(&topology.across) {
            if beyond == NONE || edge > beyond {
                continue;
            }
            let [a, b] = [edge, beyond].map(|edge| owner[edge as usize]);
            if a == b || a == NONE || b == NONE {
                continue;
            }
            let (from, to) = topology.ends(edge);
            let [p, q] = [from, to].map(|vertex| topology.positions[vertex as usize]);
            let nearest_m = [from, to].map(|vertex| least_m(edge, vertex));
            self.add_border((a.min(b), a.max(b)), p.distance(q), 2.0 * nearest_m[0].min(nearest_m[1]));
        }
    }

    fn add_border(&mut self, pair: (u32, u32), length_m: f64, path_m: f64) {
        let border = self.borders.entry(pair).or_insert(Border { length_m: 0.0, path_m: f64::INFINITY });
        border.length_m += length_m;
        border.path_m = border.path_m.min(path_m);
    }

    /// Takes the borders of the cell of `own` in a triangle; `polygon` is its part of that.
    fn take_borders(&mut self, own: &Candidate, corners: [DVec3; 3], polygon: &[Side]) {
        let [a, b, c] = corners;
        let sides = DVec3::new(b.distance_squared(c), c.distance_squared(a), a.distance_squared(b));
        let at = |weights: DVec3| corner_at(corners, weights);
        for (index, side) in polygon.iter().enumerate() {
            let Some(beyond) = side.beyond.filter(|&beyond| beyond > own.site) else { continue };
            let end = polygon[(index + 1) % polygon.len()].from;
            let length_m = at(side.from).distance(at(end));
            let ends = [0.0, 0.5, 1.0].map(|t| squared_at(own, sides, side.from.lerp(end, t)));
            let path_m = 2.0 * least_of_parabola(ends).max(0.0).sqrt();
            self.add_border((own.site, beyond), length_m, path_m);
        }
    }
}

/// The side of the triangle that runs from corner to corner between these places, if it is one.
fn whole_side(from: DVec3, to: DVec3) -> Option<usize> {
    (0..3).find(|&side| from == DVec3::AXES[side] && to == DVec3::AXES[(side + 1) % 3])
}

/// The least value between the ends of a parabola that is `start` at 0, `middle` at 0.5 and `end` at 1.
fn least_of_parabola([start, middle, end]: [f64; 3]) -> f64 {
    let square = 2.0 * (start + end) - 4.0 * middle;
    let slope = end - start - square;
    let lowest = -slope / (2.0 * square);
    let inside = if square > 0.0 && lowest > 0.0 && lowest < 1.0 { start + slope * lowest / 2.0 } else { start };
    inside.min(start).min(end)
}

/// Adds to `candidates` the points that paths into `triangle` come from; each point once, with its least distances.
fn reaching(waves: &Waves<'_>, triangle: u32, candidates: &mut Vec<Candidate>) {
    let mut add = |site: u32, squared: [f64; 3]| match candidates.iter_mut().find(|known| known.site == site) {
        Some(known) => (0..3).for_each(|corner| known.squared[corner] = known.squared[corner].min(squared[corner])),
        None => candidates.push(Candidate { site, squared }),
    };
    for window in waves.entering(triangle) {
        let first = window.edge as usize % 3;
        let unfolded = waves.unfolded(window);
        let length = |corner: usize| waves.extended_length(window, unfolded[(corner + 3 - first) % 3]);
        add(waves.start_of(window), [0, 1, 2].map(|corner| length(corner).powi(2)));
    }
    let topology = waves.topology;
    let corners = topology.corners(triangle);
    for (vertex, here) in topology.triangles[triangle as usize].into_iter().zip(corners) {
        let arrival = &waves.arrivals[vertex as usize];
        if arrival.start != NONE {
            add(arrival.start, corners.map(|corner| (arrival.distance_m + corner.distance(here)).powi(2)));
        }
    }
}

/// Per part of `topology`, whether it has more than `most` triangles for each of the points, which are in the triangles `points`.
fn fine_parts(topology: &Topology, points: impl Iterator<Item = u32>, most: usize) -> Vec<bool> {
    let mut counts = vec![(0_usize, 0_usize); topology.parts()];
    topology.part.iter().for_each(|&part| counts[part as usize].0 += 1);
    points.for_each(|triangle| counts[topology.part[triangle as usize] as usize].1 += 1);
    counts.into_iter().map(|(triangles, points)| points > 0 && triangles / points.max(1) > most).collect()
}

/// Per place the first one at the same point of the same part of the surface.
fn first_of_place(topology: &Topology, places: &[SurfacePlace], positions: &[DVec3]) -> Vec<u32> {
    let tree = point_tree(positions.iter().copied());
    let part = |place: usize| topology.part[places[place].triangle as usize];
    let mut first: Vec<u32> = Vec::with_capacity(places.len());
    for (index, at) in positions.iter().enumerate() {
        let here = tree.locate_within_distance(at.to_array(), COINCIDENT_M * COINCIDENT_M).map(|spot| spot.data);
        let other = here.filter(|&other| other < index && part(other) == part(index)).min();
        first.push(other.map_or(index as u32, |other| first[other]));
    }
    first
}

#[cfg(test)]
mod tests;
