//! Points moved to the middles of their cells, again and again (Lloyd): cells become alike, and about hexagons.
//!
//! The surface is first made about as fine as that needs, whatever it was: long edges are cut, short ones taken out. Distances over it are
//! marched (`marched.rs`), so that a round takes milliseconds; borders between cells are straight in each triangle, so that middles
//! change evenly as points do, and rounds do not stall.

use glam::{DVec2, DVec3};

use super::Marched;
use super::coarsen::coarsen;
use super::polygon::{Candidate, nearest_part};
use super::refine::refine;
use crate::body::{SurfaceIndex, Topology, area_vector};
use crate::field::geodesic::{Start, SurfacePlace, walk_to_edge};

/// Edges are at most this share of the distance that points will have, and short below the other.
const LONGEST: f64 = 0.65;
const SHORTEST: f64 = 0.35;

/// A surface with more triangles than this for each point is made coarser.
const FINE_PER_POINT: usize = 30;

/// The most triangles after cutting, per point and per triangle.
const CUTS_PER_POINT: usize = 60;
const CUTS_PER_TRIANGLE: usize = 4;

/// A surface on which points move to the middles of their cells.
pub struct Relaxation {
    topology: Topology,
    /// Per vertex how much surface there counts.
    weights: Option<Vec<f64>>,
    places: Vec<SurfacePlace>,
}

/// What a cell adds up to.
#[derive(Clone, Copy, Default)]
struct Moment {
    weight: f64,
    sum: DVec3,
}

impl Relaxation {
    /// `points`, each with its normal, on those parts of `topology` that have any; they will be about `spacing_m` apart.
    /// `weight` says how much the surface at a position with a normal counts.
    pub fn new(
        topology: &Topology,
        points: &[(u32, DVec3)],
        spacing_m: f64,
        weight: Option<&dyn Fn(DVec3, DVec3) -> f64>,
    ) -> Self {
        let mut has_points = vec![false; topology.parts()];
        points.iter().for_each(|(triangle, _)| has_points[topology.part[*triangle as usize] as usize] = true);
        let all = topology.triangles.iter().zip(&topology.part);
        let triangles: Vec<[u32; 3]> =
            all.filter(|(_, part)| has_points[**part as usize]).map(|(corners, _)| *corners).collect();
        let kept = as_they_are(&topology.positions, &triangles);
        let longest_m = LONGEST * spacing_m;
        let most = CUTS_PER_POINT * points.len() + CUTS_PER_TRIANGLE * kept.triangles.len();
        let cut = match refine(&kept, longest_m, |_| longest_m, most) {
            Some(refined) => as_they_are(&refined.positions, &refined.triangles),
            None => kept,
        };
        let fit = match cut.triangles.len() > FINE_PER_POINT * points.len() {
            true => {
                let coarse = coarsen(&cut.positions, cut.triangles, SHORTEST * spacing_m, longest_m);
                compact(&cut.positions, &coarse)
            }
            false => cut,
        };
        let index = SurfaceIndex::of_triangles((0..fit.triangles.len() as u32).map(|t| fit.corners(t)));
        let place = |&(triangle, position): &(u32, DVec3)| {
            let normal = area_vector(topology.corners(triangle)).normalize_or_zero();
            let hit = index.nearest_facing(position, normal);
            let (triangle, position) = hit.map_or((0, position), |hit| (hit.triangle as u32, hit.position));
            SurfacePlace::in_triangle(&fit, triangle, position).inward()
        };
        let places = if fit.triangles.is_empty() { Vec::new() } else { points.iter().map(place).collect() };
        let weights = weight.map(|weight| {
            let normals = vertex_normals(&fit);
            fit.positions.iter().zip(normals).map(|(&p, normal)| weight(p, normal)).collect()
        });
        Self { topology: fit, weights, places }
    }

    /// Moves each point by `step` times its way to the middle of its cell.
    pub fn round(&mut self, step: f64) {
        let moments = self.moments();
        for (place, moment) in self.places.iter_mut().zip(moments) {
            if !(moment.weight > 0.0 && moment.weight.is_finite()) {
                continue;
            }
            let from = place.position(&self.topology);
            let normal = area_vector(self.topology.corners(place.triangle)).normalize_or_zero();
            let way = (moment.sum / moment.weight - from).reject_from_normalized(normal) * step;
            let length = way.length();
            if !(length > 0.0 && length.is_finite()) {
                continue;
            }
            let (to, left) = walk_to_edge(&self.topology, place.triangle, from, way / length, length);
            // At a border the way ends halfway, so that no point lies on it.
            let to = match left > 0.0 {
                true => walk_to_edge(&self.topology, place.triangle, from, way / length, (length - left) / 2.0).0,
                false => to,
            };
            *place = to.inward();
        }
    }

    /// Where the points are, with the normals of the surface that they are on.
    pub fn points(&self) -> Vec<(DVec3, DVec3)> {
        let normal = |place: &SurfacePlace| area_vector(self.topology.corners(place.triangle)).normalize_or_zero();
        self.places.iter().map(|place| (place.position(&self.topology), normal(place))).collect()
    }

    fn moments(&self) -> Vec<Moment> {
        let topology = &self.topology;
        let mut marched = Marched::new(topology, |_| true, f64::INFINITY);
        let mut within: Vec<(u32, Candidate)> = Vec::with_capacity(self.places.len());
        for (site, place) in (0..).zip(&self.places) {
            let start = Start::new(topology, *place, DVec3::X);
            for wedge in &start.wedges {
                let squared = wedge.corners.map(DVec2::length_squared);
                within.push((wedge.triangle, Candidate { site, squared }));
            }
            marched.add(&start, site);
        }
        within.sort_by_key(|(triangle, candidate)| (*triangle, candidate.site));
        marched.run();
        let mut moments = vec![Moment::default(); self.places.len()];
        let (mut candidates, mut polygon, mut spare) = (Vec::new(), Vec::new(), Vec::new());
        let mut from = 0;
        for triangle in 0..topology.triangles.len() as u32 {
            from += within[from..].iter().take_while(|(other, _)| *other < triangle).count();
            let own = within[from..].iter().take_while(|(other, _)| *other == triangle);
            candidates.clear();
            candidates.extend(own.map(|(_, candidate)| *candidate));
            marched.reaching(triangle, &mut candidates);
            if let [candidate] = candidates[..] {
                self.add(&mut moments[candidate.site as usize], triangle, &DVec3::AXES);
                continue;
            }
            for own in &candidates {
                nearest_part(own, &candidates, &mut polygon, &mut spare);
                let corners = polygon.iter().map(|side| side.from);
                let first = corners.clone().next();
                let pairs = corners.clone().zip(corners.skip(1)).skip(1);
                for (a, b) in pairs {
                    self.add(&mut moments[own.site as usize], triangle, &[first.unwrap_or(a), a, b]);
                }
            }
        }
        moments
    }

    /// Adds the part of `triangle` between the places `within`, barycentric, to `moment`.
    fn add(&self, moment: &mut Moment, triangle: u32, within: &[DVec3; 3]) {
        let corners = self.topology.corners(triangle);
        let at = |weights: DVec3| corners[0] * weights.x + corners[1] * weights.y + corners[2] * weights.z;
        let [a, b, c] = within.map(at);
        let area = area_vector([a, b, c]).length() / 2.0;
        let weight = match &self.weights {
            None => area,
            Some(weights) => {
                let of_corners = self.topology.triangles[triangle as usize].map(|v| weights[v as usize]);
                let middle = (within[0] + within[1] + within[2]) / 3.0;
                area * DVec3::from_array(of_corners).dot(middle)
            }
        };
        moment.weight += weight;
        moment.sum += (a + b + c) * (weight / 3.0);
    }
}

/// The topology of triangles whose vertices are welded already: those of different parts at one place stay apart.
fn as_they_are(positions: &[DVec3], triangles: &[[u32; 3]]) -> Topology {
    Topology::of_groups(positions, triangles, &|vertex| vertex)
}

/// Per vertex the mean normal of the surface around it.
fn vertex_normals(topology: &Topology) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; topology.positions.len()];
    for (triangle, corners) in (0..).zip(&topology.triangles) {
        let spanned = area_vector(topology.corners(triangle));
        corners.iter().for_each(|&corner| normals[corner as usize] += spanned);
    }
    normals.into_iter().map(DVec3::normalize_or_zero).collect()
}

/// The topology of such triangles, without vertices that none has.
fn compact(positions: &[DVec3], triangles: &[[u32; 3]]) -> Topology {
    let mut number = vec![u32::MAX; positions.len()];
    let mut kept = Vec::new();
    let mut renamed = Vec::with_capacity(triangles.len());
    for corners in triangles {
        renamed.push(corners.map(|corner| {
            if number[corner as usize] == u32::MAX {
                number[corner as usize] = kept.len() as u32;
                kept.push(positions[corner as usize]);
            }
            number[corner as usize]
        }));
    }
    as_they_are(&kept, &renamed)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{places, sphere};
    use super::*;
    use crate::field::cells::Cells;

    /// The 5th and 95th percentile of cell areas over their median, of `count` points that are moved in `rounds`.
    fn spread(topology: &Topology, count: u32, rounds: usize) -> [f64; 2] {
        let golden = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
        // As many everywhere, each moved by up to 0.4 of their distance along each axis, as scattered ones are.
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let apart = (4.0 * std::f64::consts::PI / f64::from(count)).sqrt();
        let seeds: Vec<DVec3> = (0..count)
            .map(|i| {
                let z = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(count);
                let (sin, cos) = libm::sincos(golden * f64::from(i));
                let even = DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z);
                (even + 0.8 * apart * DVec3::new(random(), random(), random())).normalize()
            })
            .collect();
        let seated = places(topology, &seeds);
        let points: Vec<(u32, DVec3)> = seated.iter().map(|place| (place.triangle, place.position(topology))).collect();
        let spacing_m = (4.0 * std::f64::consts::PI / f64::from(count) * 2.0 / 3.0_f64.sqrt()).sqrt();
        let mut relaxation = Relaxation::new(topology, &points, spacing_m, None);
        (0..rounds).for_each(|_| relaxation.round(1.0));
        let moved: Vec<DVec3> = relaxation.points().into_iter().map(|(position, _)| position).collect();
        let mut areas = Cells::new(topology, &places(topology, &moved)).areas;
        assert_eq!(areas.len(), count as usize);
        areas.sort_by(f64::total_cmp);
        let at = |share: f64| areas[(share * f64::from(count - 1)).round() as usize];
        [at(0.05) / at(0.5), at(0.95) / at(0.5)]
    }

    #[test]
    fn cells_become_alike_on_surfaces_that_are_coarse_and_fine() {
        // 512, and 32,768 triangles, which are too many for 150 points.
        for cuts in [3, 6] {
            let topology = sphere(cuts);
            let [low, high] = spread(&topology, 150, 0);
            assert!(low < 0.85 && high > 1.15, "{low} {high}");
            let [low, high] = spread(&topology, 150, 30);
            assert!(low > 0.88 && high < 1.12, "{cuts} cuts: {low} {high}");
        }
    }

    #[test]
    fn weights_draw_points_together() {
        let topology = sphere(4);
        let seeds: Vec<DVec3> = (0..200_u32)
            .map(|i| {
                let z = 1.0 - (f64::from(i) + 0.5) / 100.0;
                let (sin, cos) = libm::sincos(2.4 * f64::from(i));
                DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
            })
            .collect();
        let seated = places(&topology, &seeds);
        let points: Vec<(u32, DVec3)> =
            seated.iter().map(|place| (place.triangle, place.position(&topology))).collect();
        let weight = |p: DVec3, _: DVec3| if p.z > 0.0 { 16.0 } else { 1.0 };
        let mut relaxation = Relaxation::new(&topology, &points, 0.25, Some(&weight));
        (0..200).for_each(|_| relaxation.round(1.0));
        let above = relaxation.points().iter().filter(|(p, _)| p.z > 0.0).count();
        // The density of points is the square root of the weight: four times as many above, if rounds went on for ever.
        assert!((135..=165).contains(&above), "{above} of 200 above");
    }
}
