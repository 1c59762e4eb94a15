//! The area of given taxels: their Voronoi cells, which end half a pitch outside the outermost taxels.
//!
//! Around each taxel the surface is unrolled: its neighbours become points of a plane around the taxel, at their distance
//! along the surface. Taxels on another part of the surface are not neighbours. The cell is bounded by the perpendicular
//! bisectors to the neighbours. Where the layout ends, mirror images replace the missing neighbours. The part of the cell
//! beyond the surface's edge is subtracted.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DVec2, DVec3};

use super::placed::{COINCIDENT_M, Placed, points_on_same_side};
use super::rest_surface::RestSurface;
use crate::body::{NONE, PointTree, SurfaceIndex, Topology, area_vector, point_tree};
use crate::field::geodesic::{LogMap, SurfacePlace, walk};

/// Distance limits along the surface over the straight distances to the sixth nearest and the second nearest taxel.
const REACH_OF_SIXTH: f64 = 2.0;
const REACH_OF_SECOND: f64 = 12.0;

/// How often the limit is doubled if too few taxels are reached.
const MAX_DOUBLINGS: u32 = 3;

/// A neighbour has an opposite one within 40° of the opposite direction (the diagonals of a square grid are at 45°), up to
/// this many times as far away.
const OPPOSITE_COSINE: f64 = 0.766_044_443_118_978;
const OPPOSITE_REACH: f64 = 1.9;

/// A side of the layout is open if a cell extends beyond this share of the distance to the neighbour on its other side.
const OPEN_SIDE_SHARE: f64 = 0.9;

/// Maximum angle between adjacent sides of a cell at the end of a layout, 115°; in a hexagonal grid it is 60°.
const MAX_SIDE_TURN: f64 = 115.0 / 360.0 * TAU;

/// Sides shorter than this share of the distance to their neighbour are rounding errors.
const MIN_SIDE: f64 = 1e-6;

/// Number of directions in which the surface's edge is searched, 2° apart.
const RAYS: u32 = 180;

/// The area of the cell of each of `placed`, m²; coincident taxels share theirs. 0, unknown, if no other taxel is reached.
pub(super) fn areas(rest_surface: &RestSurface<'_>, placed: &[Placed]) -> Vec<f64> {
    let sites = Sites::from_placed(rest_surface, placed);
    let cells: Vec<f64> = (0..sites.places.len()).map(|site| sites.area(site).unwrap_or(0.0)).collect();
    sites.of_taxel.iter().map(|&site| cells[site] / f64::from(sites.taxels[site])).collect()
}

struct Sites<'a> {
    topology: &'a Topology,
    places: Vec<SurfacePlace>,
    positions: Vec<DVec3>,
    tree: PointTree,
    of_taxel: Vec<usize>,
    /// Per site its number of taxels.
    taxels: Vec<u32>,
}

impl<'a> Sites<'a> {
    fn from_placed(rest_surface: &'a RestSurface<'_>, placed: &[Placed]) -> Self {
        let topology = rest_surface.topology();
        let mut sound = vec![NONE; rest_surface.triangles.len()];
        (0..).zip(&topology.given).for_each(|(index, &given)| sound[given as usize] = index);
        let mut index = None;
        let mut place_of = |one: &Placed| match sound[one.triangle] {
            // Its triangle is degenerate or duplicate.
            NONE => {
                let all = || (0..topology.triangles.len() as u32).map(|triangle| topology.corners(triangle));
                let index = index.get_or_insert_with(|| SurfaceIndex::of_triangles(all()));
                index.nearest(one.point.position).map_or(NONE, |hit| hit.triangle as u32)
            }
            triangle => triangle,
        };
        let tree = point_tree(placed.iter().map(|one| one.point.position));
        let mut sites = Self {
            topology,
            places: Vec::new(),
            positions: Vec::new(),
            tree: PointTree::new(),
            of_taxel: Vec::new(),
            taxels: Vec::new(),
        };
        for (taxel, one) in placed.iter().enumerate() {
            let at = one.point.position;
            let here = tree.locate_within_distance(at.to_array(), COINCIDENT_M * COINCIDENT_M).map(|spot| spot.data);
            let first = here.filter(|&other| points_on_same_side(&placed[other].point, &one.point)).min();
            let site = first.filter(|&first| first < taxel).map_or(sites.places.len(), |first| sites.of_taxel[first]);
            if site == sites.places.len() {
                let triangle = place_of(one);
                let barycentric = match triangle {
                    NONE => [1.0, 0.0, 0.0],
                    triangle => SurfacePlace::in_triangle(topology, triangle, at).barycentric,
                };
                sites.places.push(SurfacePlace { triangle, barycentric });
                sites.positions.push(at);
                sites.taxels.push(0);
            }
            sites.taxels[site] += 1;
            sites.of_taxel.push(site);
        }
        sites.tree = point_tree(sites.positions.iter().copied());
        sites
    }

    fn area(&self, site: usize) -> Option<f64> {
        let here = self.positions[site];
        let others = self.tree.nearest_neighbor_iter_with_distance_2(here.to_array());
        let distances = others.map(|(_, squared)| squared.sqrt()).filter(|&distance| distance > COINCIDENT_M);
        let near: Vec<f64> = distances.take(6).collect();
        let (&second, &sixth) = (near.get(1).or(near.first())?, near.last()?);
        let mut limit_m = (REACH_OF_SIXTH * sixth).min(REACH_OF_SECOND * second);
        let start = Some(self.places[site]).filter(|place| place.triangle != NONE)?.inward();
        for doubling in 0..=MAX_DOUBLINGS {
            let normal = area_vector(self.topology.corners(start.triangle)).normalize_or_zero();
            let u = normal.any_orthonormal_vector();
            let map = LogMap::new(self.topology, start, u, limit_m).ok()?;
            let around = self.around(site, &map, limit_m);
            if around.len() >= 2.min(near.len()) || (doubling == MAX_DOUBLINGS && !around.is_empty()) {
                let cell = Cell::new(&around, limit_m);
                return Some(cell.area() - self.beyond_edge(&cell, &map, start.triangle));
            }
            limit_m *= 2.0;
        }
        None
    }

    /// The sites within `limit_m` of `site` on `map`, the nearest first.
    fn around(&self, site: usize, map: &LogMap<'_>, limit_m: f64) -> Vec<DVec2> {
        let near = self.tree.locate_within_distance(self.positions[site].to_array(), limit_m * limit_m);
        let mut others: Vec<usize> = near.map(|spot| spot.data).filter(|&other| other != site).collect();
        others.sort_unstable();
        let reached = others.into_iter().filter_map(|other| map.reach(&self.places[other]));
        let reached = reached.filter(|way| way.distance_m <= limit_m && way.distance_m > COINCIDENT_M);
        let mut around: Vec<DVec2> = reached.map(|way| way.uv).collect();
        around.sort_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
        around
    }

    /// The area of `cell` beyond the edge of the surface, seen from its taxel in `triangle`, m².
    fn beyond_edge(&self, cell: &Cell, map: &LogMap<'_>, triangle: u32) -> f64 {
        let [from, u, v, _] = map.frame();
        let between = TAU / f64::from(RAYS);
        let beyond = |ray: u32| {
            let (sin, cos) = libm::sincos((f64::from(ray) + 0.5) * between);
            let whole = cell.reach(DVec2::new(cos, sin));
            match walk(self.topology, triangle, from, u * cos + v * sin, whole) {
                Ok(_) => 0.0,
                Err(left) => (whole * whole - (whole - left) * (whole - left)) / 2.0 * between,
            }
        };
        (0..RAYS).map(beyond).sum()
    }
}

/// A neighbouring taxel, or the mirror image of one where the layout ends.
#[derive(Clone, Copy, PartialEq)]
struct Neighbour {
    point: DVec2,
    is_image: bool,
}

/// A side of a cell: its start, and the neighbour beyond it; `None` for a side of the initial square.
#[derive(Clone, Copy)]
struct Side {
    from: DVec2,
    beyond: Option<Neighbour>,
}

/// A convex polygon around the origin, counter-clockwise.
struct Cell(Vec<Side>);

impl Cell {
    /// The cell of a taxel with the neighbours `around`, the nearest first, up to `limit_m`.
    fn new(around: &[DVec2], limit_m: f64) -> Self {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let side = |(x, y)| Side { from: DVec2::new(x, y) * limit_m, beyond: None };
        let mut cell = Self(corners.map(side).to_vec());
        around.iter().for_each(|&neighbour| cell.cut(Neighbour { point: neighbour, is_image: false }));
        let images: Vec<DVec2> = cell.beside().map(|(_, neighbour)| -neighbour.point).collect();
        // The third nearest is typical: the nearest may be too near, others across a gap.
        let usual_m = around.get(2).or(around.last()).map_or(0.0, |neighbour| neighbour.length());
        let open: Vec<DVec2> = images.into_iter().filter(|&image| cell.is_open(image, usual_m, around)).collect();
        open.into_iter().for_each(|image| cell.cut(Neighbour { point: image, is_image: true }));
        let pitch_m = around.first().map_or(0.0, |nearest| nearest.length());
        cell.close(pitch_m);
        cell
    }

    /// Its sides with a neighbour beyond them, without rounding errors.
    fn beside(&self) -> impl Iterator<Item = (usize, Neighbour)> {
        let sides = self.0.iter().enumerate().filter_map(|(index, side)| Some((index, side.beyond?)));
        sides.filter(|&(index, neighbour)| {
            self.0[index].from.distance(self.end(index)) > MIN_SIDE * neighbour.point.length()
        })
    }

    fn end(&self, side: usize) -> DVec2 {
        self.0[(side + 1) % self.0.len()].from
    }

    /// Cuts off the part nearer to `neighbour` than to the origin.
    fn cut(&mut self, neighbour: Neighbour) {
        let point = neighbour.point;
        let distance_beyond = |p: DVec2| p.dot(point) - point.length_squared() / 2.0;
        if self.0.iter().all(|side| distance_beyond(side.from) <= 0.0) {
            return;
        }
        let mut kept = Vec::with_capacity(self.0.len() + 1);
        for (index, side) in self.0.iter().enumerate() {
            let end = self.end(index);
            let (before, after) = (distance_beyond(side.from), distance_beyond(end));
            let crossing = || side.from.lerp(end, before / (before - after));
            if before <= 0.0 {
                kept.push(*side);
            }
            if before <= 0.0 && after > 0.0 {
                kept.push(Side { from: crossing(), beyond: Some(neighbour) });
            }
            if before > 0.0 && after <= 0.0 {
                kept.push(Side { from: crossing(), ..*side });
            }
        }
        self.0 = kept;
    }

    /// Whether the layout ends on the side of `image`, the mirror image of a neighbour; neighbours are typically `usual_m` away.
    fn is_open(&self, image: DVec2, usual_m: f64, around: &[DVec2]) -> bool {
        let (towards, length) = (image.normalize(), image.length().max(usual_m));
        let opposite = |other: &DVec2| {
            other.dot(towards) >= OPPOSITE_COSINE * other.length() && other.length() <= OPPOSITE_REACH * length
        };
        let farthest = self.0.iter().map(|side| side.from.dot(towards)).fold(0.0, f64::max);
        farthest > OPEN_SIDE_SHARE * length && !around.iter().any(opposite)
    }

    /// Closes the cell at half of `pitch_m` where it is still open: at the end of a row, or at a sharp corner.
    fn close(&mut self, pitch_m: f64) {
        let sides: Vec<(usize, Neighbour)> = self.beside().collect();
        let mut images = Vec::new();
        for (number, &(side, own)) in sides.iter().enumerate() {
            let (next_side, next) = sides[(number + 1) % sides.len()];
            let (a, b) = (own.point, next.point);
            let meet = || self.end(side).distance(self.0[next_side].from) <= MIN_SIDE * pitch_m;
            let turn = libm::atan2(a.perp_dot(b), a.dot(b)).rem_euclid(TAU);
            let turn = if sides.len() == 1 { TAU } else { turn };
            // The gap between two adjacent taxels is not open.
            if turn < MAX_SIDE_TURN || (!own.is_image && !next.is_image && sides.len() > 1 && meet()) {
                continue;
            }
            let missing = (turn / FRAC_PI_2 - 1e-6).ceil() - 1.0;
            for step in 1..=missing as u32 {
                let (sin, cos) = libm::sincos(turn * f64::from(step) / (missing + 1.0));
                images.push(DVec2::new(cos, sin).rotate(a).normalize() * pitch_m);
            }
        }
        images.into_iter().for_each(|image| self.cut(Neighbour { point: image, is_image: true }));
    }

    /// Its extent in the unit direction `direction`.
    fn reach(&self, direction: DVec2) -> f64 {
        let sides = self.0.iter().filter_map(|side| Some(side.beyond?.point));
        let across = sides.filter(|point| point.dot(direction) > 0.0);
        across.map(|point| point.length_squared() / 2.0 / point.dot(direction)).fold(f64::INFINITY, f64::min)
    }

    fn area(&self) -> f64 {
        (0..self.0.len()).map(|side| self.0[side].from.perp_dot(self.end(side)) / 2.0).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The areas of the cells of `points`, each in units of `pitch`².
    fn areas(points: &[DVec2], pitch: f64) -> Vec<f64> {
        let area = |&own: &DVec2| {
            let mut around: Vec<DVec2> = points.iter().filter(|&&p| p != own).map(|&p| p - own).collect();
            around.sort_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
            Cell::new(&around, 40.0 * pitch).area() / (pitch * pitch)
        };
        points.iter().map(area).collect()
    }

    fn grid(rows: u32, columns: u32, across: DVec2, up: DVec2) -> Vec<DVec2> {
        (0..rows).flat_map(|y| (0..columns).map(move |x| across * f64::from(x) + up * f64::from(y))).collect()
    }

    /// That each of `areas` is `wanted`, but for the rounding of some ten operations on numbers that are 40 times as large.
    fn all_are(areas: &[f64], wanted: f64) {
        for area in areas {
            assert!((area / wanted - 1.0).abs() < 1e-12, "{area} instead of {wanted}");
        }
    }

    #[test]
    fn every_cell_of_a_grid_is_that_of_the_grid_borders_included() {
        let h = 3.0_f64.sqrt() / 2.0;
        all_are(&areas(&grid(5, 6, DVec2::X, DVec2::Y), 1.0), 1.0);
        all_are(&areas(&grid(2, 2, DVec2::X, DVec2::Y), 1.0), 1.0);
        // Turned, and three times as long as wide.
        let turned = DVec2::new(0.8, 0.6);
        all_are(&areas(&grid(4, 5, turned, turned.perp() * 3.0), 1.0), 3.0);
        // A rhombus has corners of 60° and of 120°; rows that are shifted back have ends that stand out and stand back.
        all_are(&areas(&grid(5, 5, DVec2::X, DVec2::new(0.5, h)), 1.0), h);
        let shifted: Vec<DVec2> = (0..6)
            .flat_map(|y| (0..5).map(move |x| DVec2::new(f64::from(x) + 0.5 * f64::from(y % 2), h * f64::from(y))))
            .collect();
        all_are(&areas(&shifted, 1.0), h);
        // A row, and two.
        all_are(&areas(&grid(1, 7, turned, DVec2::Y), 1.0), 1.0);
        all_are(&areas(&grid(1, 2, turned, DVec2::Y), 1.0), 1.0);
    }

    #[test]
    fn what_lies_beyond_a_gap_takes_and_gives_nothing() {
        // Two pads, three pitches apart, and a hole of one taxel in the first.
        let mut points = grid(5, 5, DVec2::X, DVec2::Y);
        points.extend(grid(4, 4, DVec2::X, DVec2::Y).into_iter().map(|p| p + DVec2::X * 7.0));
        all_are(&areas(&points, 1.0), 1.0);
        points.remove(12);
        all_are(&areas(&points, 1.0), 1.0);
    }

    #[test]
    fn cells_within_an_irregular_layout_tile_it() {
        // A grid that is shaken by up to a fifth of its pitch each way.
        let mut random = crate::random::Random::new(3);
        let mut shaken = || (random.unit() - 0.5) * 0.4;
        let points: Vec<DVec2> =
            grid(20, 20, DVec2::X, DVec2::Y).into_iter().map(|p| p + DVec2::new(shaken(), shaken())).collect();
        let cells = areas(&points, 1.0);
        // What each point of a fine raster is nearest to, for points away from the border.
        let inner: Vec<usize> =
            (0..points.len()).filter(|&i| (points[i] - DVec2::splat(9.5)).abs().max_element() < 7.0).collect();
        for &i in &inner {
            let mut near: Vec<usize> = (0..points.len()).collect();
            near.sort_by(|&a, &b| points[a].distance(points[i]).total_cmp(&points[b].distance(points[i])));
            near.truncate(30);
            let fine = 200;
            let raster = grid(fine, fine, DVec2::X * 0.015, DVec2::Y * 0.015);
            let own = raster.iter().map(|&p| points[i] + p - DVec2::splat(1.4925)).filter(|p| {
                near.iter().all(|&other| p.distance_squared(points[i]) <= p.distance_squared(points[other]))
            });
            let counted = own.count() as f64 * 0.015 * 0.015;
            // The raster's own error: its squares along a border about 4 long, half of them wrong by half at most.
            assert!((counted - cells[i]).abs() < 0.02, "{i}: {counted} {}", cells[i]);
        }
    }
}
