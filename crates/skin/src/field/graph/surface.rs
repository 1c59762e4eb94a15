//! Edges between taxels whose cells on the surface share a border.

use std::collections::BTreeMap;

use glam::DVec3;

use super::joined::skin_of_links;
use super::nodes::nodes;
use super::points::{self, LENGTH_PER_ROOT, LinkPoint};
use crate::body::{Body, Topology, point_tree};
use crate::field::cells::{COINCIDENT_M, Cells, Divided};
use crate::field::geodesic::{LogMap, SurfacePlace};
use crate::field::seats::{Group, Seat, seat};

/// Cells share a border that is longer than this share of the root of the smaller one; others meet in a point.
const MIN_BORDER: f64 = 1e-3;

/// The edges of the pressure taxels of `body`, the lower index first; some may appear twice.
pub(super) fn edges(body: &Body) -> Vec<(u32, u32)> {
    let groups = Group::all(body, nodes(body).map(|taxel| body.taxels[taxel].link));
    let mut seats: BTreeMap<usize, Seat> = BTreeMap::new();
    for taxel in nodes(body) {
        seats.extend(seat(body, &groups, &body.taxels[taxel]).map(|seat| (taxel, seat)));
    }
    let mut edges = Edges::default();
    for (index, group) in (0..).zip(&groups) {
        let here = seats.iter().filter(|(_, seat)| seat.group == index as usize);
        let (taxels, places): (Vec<usize>, Vec<SurfacePlace>) = here.map(|(&taxel, seat)| (taxel, seat.place)).unzip();
        let topology = &group.surface.topology;
        edges.add((index, topology), (&taxels, &places), &Cells::new(topology, &places));
    }
    edges.finish(body)
}

/// The same, of a surface that is all divided among its pressure `taxels`.
pub(super) fn edges_of_cells(body: &Body, taxels: &[usize], divided: &Divided) -> Vec<(u32, u32)> {
    let mut edges = Edges::default();
    edges.add((0, &divided.topology), (taxels, &divided.places), &divided.cells);
    edges.finish(body)
}

/// Edges that are found, surface by surface.
#[derive(Default)]
struct Edges {
    found: Vec<(u32, u32)>,
    /// Per taxel its cell and its part of the surface.
    cells: BTreeMap<usize, (f64, (u32, u32))>,
    /// Per taxel the one that stands for all at its place.
    leader: BTreeMap<usize, usize>,
}

impl Edges {
    /// Adds those between `taxels` at `places` of surface `index`, which is divided into their `cells`.
    fn add(
        &mut self,
        (index, topology): (u32, &Topology),
        (taxels, places): (&[usize], &[SurfacePlace]),
        cells: &Cells,
    ) {
        for (point, &taxel) in taxels.iter().enumerate() {
            // Where the surface is too rough there are no cells.
            if cells.areas[point] > 0.0 {
                let part = topology.part[places[point].triangle as usize];
                self.cells.insert(taxel, (cells.areas[point], (index, part)));
                self.leader.insert(taxel, taxels[cells.first[point] as usize]);
            }
        }
        let mut ways = Ways { topology, places, map: None };
        for (&(a, b), border) in &cells.borders {
            let (a, b) = (a as usize, b as usize);
            let [of_a, of_b] = [a, b].map(|point| cells.areas[point]);
            let limit_m = LENGTH_PER_ROOT * of_a.max(of_b).sqrt() * (1.0 + 1e-6);
            let is_border = border.length_m > MIN_BORDER * of_a.min(of_b).sqrt();
            if is_border && (border.path_m <= limit_m || ways.is_within(a, b, limit_m)) {
                self.found.push((taxels[a] as u32, taxels[b] as u32));
            }
        }
    }

    /// All, with those between parts of surfaces.
    fn finish(self, body: &Body) -> Vec<(u32, u32)> {
        let Self { mut found, cells, mut leader } = self;
        let skins = skin_of_links(body);
        let mut by_skin: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        nodes(body).for_each(|taxel| by_skin.entry(skins[body.taxels[taxel].link]).or_default().push(taxel));
        for taxels in by_skin.values() {
            found.extend(between_parts(body, taxels, &cells, &mut leader));
        }
        let shared = leader.iter().filter(|(taxel, leader)| taxel != leader);
        found.extend(shared.map(|(&taxel, &leader)| (leader as u32, taxel as u32)));
        found
    }
}

/// Lengths of shortest paths between places of a surface.
struct Ways<'a> {
    topology: &'a Topology,
    places: &'a [SurfacePlace],
    /// The last start and limit, and its paths.
    map: Option<(usize, f64, LogMap<'a>)>,
}

impl Ways<'_> {
    /// Whether the shortest path from place `a` to `b` is at most `limit_m` long.
    fn is_within(&mut self, a: usize, b: usize, limit_m: f64) -> bool {
        let topology = self.topology;
        let [from, to] = [a, b].map(|point| self.places[point]);
        if from.position(topology).distance(to.position(topology)) > limit_m {
            return false;
        }
        if self.map.as_ref().is_none_or(|(start, limit, _)| *start != a || *limit < limit_m) {
            let map = LogMap::new(topology, from.inward(), DVec3::X, limit_m).ok();
            self.map = map.map(|map| (a, limit_m, map));
        }
        let way = self.map.as_ref().and_then(|(.., map)| map.reach(&to));
        way.is_some_and(|way| way.distance_m <= limit_m)
    }
}

/// The edges between `taxels`, of one link or of links that carry one skin, that are on different parts of their surface, or on none.
/// Those at the place of another get that one as their leader.
fn between_parts(
    body: &Body,
    taxels: &[usize],
    cells: &BTreeMap<usize, (f64, (u32, u32))>,
    leader: &mut BTreeMap<usize, usize>,
) -> Vec<(u32, u32)> {
    let loose: Vec<usize> = taxels.iter().copied().filter(|taxel| !cells.contains_key(taxel)).collect();
    // All in the frame of the first one's link.
    let frame = taxels.first().map_or(0, |&taxel| body.taxels[taxel].link);
    let way = |taxel: usize| body.rest_transform(frame, body.taxels[taxel].link);
    let position = |taxel: usize| way(taxel).transform_point3(body.taxels[taxel].position_in_link);
    let normal = |taxel: usize| way(taxel).transform_vector3(body.taxels[taxel].normal_in_link);
    let tree = point_tree(loose.iter().map(|&taxel| position(taxel)));
    for &taxel in &loose {
        let here = tree.locate_within_distance(position(taxel).to_array(), COINCIDENT_M * COINCIDENT_M);
        let here = here.map(|spot| loose[spot.data]).filter(|&other| normal(other).dot(normal(taxel)) > 0.0);
        let first = here.min().map_or(taxel, |first| leader.get(&first).copied().unwrap_or(first));
        leader.insert(taxel, first);
    }
    let point = |&taxel: &usize| {
        let on_surface = cells.get(&taxel);
        let area = body.taxels[taxel].area;
        LinkPoint {
            taxel: taxel as u32,
            position: position(taxel),
            normal: normal(taxel),
            cell_m2: on_surface.map(|(area, _)| *area).or((area > 0.0).then_some(area)),
            part: on_surface.map(|(_, part)| *part),
        }
    };
    let leaders = taxels.iter().filter(|taxel| leader.get(taxel) == Some(taxel));
    points::edges(&leaders.map(point).collect::<Vec<_>>())
}
