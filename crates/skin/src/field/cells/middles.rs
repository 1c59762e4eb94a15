//! Points moved to the middles of their cells, again and again (Lloyd): cells become alike, and about hexagons.
//!
//! The surface is first made about as fine as that needs, whatever it was: long edges are cut, short ones taken out. Distances over it are
//! marched (`marched.rs`), so that a round takes milliseconds; borders between cells are straight in each triangle, so that middles
//! change evenly as points do, and rounds do not stall.

use std::cmp::Ordering;

use glam::{DVec2, DVec3};

use super::coarsen::coarsen;
use super::marched::{Ground, Marched};
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

/// A connected surface on which points move to the middles of their cells.
pub struct Relaxation {
    topology: Topology,
    ground: Ground,
    /// Per vertex how much surface there counts.
    weights: Option<Vec<f64>>,
    /// The points' numbers, ascending.
    numbers: Vec<usize>,
    /// Per point.
    places: Vec<SurfacePlace>,
}

/// What a cell adds up to.
#[derive(Clone, Copy, Default)]
struct Moment {
    weight: f64,
    sum: DVec3,
}

impl Relaxation {
    /// `points`, each with its triangle, on those parts of `topology` that have any; they will be about `spacing_m` apart.
    /// `weight` says how much the surface at a position with a normal counts. One for each set of parts that are connected, be it by a
    /// vertex: they know nothing of each other, and so may be moved at the same time.
    pub fn of_points(
        topology: &Topology,
        points: &[(u32, DVec3)],
        spacing_m: f64,
        weight: Option<&dyn Fn(DVec3, DVec3) -> f64>,
    ) -> Vec<Self> {
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
        let weights: Option<Vec<f64>> = weight.map(|weight| {
            let normals = vertex_normals(&fit);
            fit.positions.iter().zip(normals).map(|(&p, normal)| weight(p, normal)).collect()
        });
        Self::connected(&fit, weights.as_deref(), &places)
    }

    /// The connected parts of `topology` that have any of `places`.
    fn connected(topology: &Topology, weights: Option<&[f64]>, places: &[SurfacePlace]) -> Vec<Self> {
        let island = islands(topology);
        let of_triangle = |triangle: u32| island[topology.triangles[triangle as usize][0] as usize];
        // By island, in their order there, which decides between equals.
        let (mut vertices, mut triangles): (Vec<u32>, Vec<u32>) =
            ((0..island.len() as u32).collect(), (0..topology.triangles.len() as u32).collect());
        vertices.sort_by_key(|&vertex| island[vertex as usize]);
        triangles.sort_by_key(|&triangle| of_triangle(triangle));
        let mut relaxations = Vec::new();
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by_key(|&point| of_triangle(places[point].triangle));
        for numbers in order.chunk_by(|&a, &b| of_triangle(places[a].triangle) == of_triangle(places[b].triangle)) {
            let own = of_triangle(places[numbers[0]].triangle);
            let vertices = those(&vertices, |&vertex| island[vertex as usize].cmp(&own));
            let triangles = those(&triangles, |&triangle| of_triangle(triangle).cmp(&own));
            let at = |known: &[u32], one: u32| known.partition_point(|&other| other < one) as u32;
            let corners = |&t: &u32| topology.triangles[t as usize].map(|vertex| at(vertices, vertex));
            let positions: Vec<DVec3> = vertices.iter().map(|&vertex| topology.positions[vertex as usize]).collect();
            let own = as_they_are(&positions, &triangles.iter().map(corners).collect::<Vec<_>>());
            let place =
                |&point: &usize| SurfacePlace { triangle: at(triangles, places[point].triangle), ..places[point] };
            relaxations.push(Self {
                ground: Ground::new(&own, |_| true),
                topology: own,
                weights: weights.map(|weights| vertices.iter().map(|&vertex| weights[vertex as usize]).collect()),
                numbers: numbers.to_vec(),
                places: numbers.iter().map(place).collect(),
            });
        }
        // Those that take longest first.
        relaxations.sort_by_key(|one| std::cmp::Reverse(one.topology.triangles.len()));
        relaxations
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

    /// The numbers of the points, where they are, and the normals of the surface that they are on.
    pub fn points(&self) -> impl Iterator<Item = (usize, (DVec3, DVec3))> {
        let normal = |place: &SurfacePlace| area_vector(self.topology.corners(place.triangle)).normalize_or_zero();
        let at = move |place: &SurfacePlace| (place.position(&self.topology), normal(place));
        self.numbers.iter().copied().zip(self.places.iter().map(at))
    }

    fn moments(&self) -> Vec<Moment> {
        let topology = &self.topology;
        let mut marched = Marched::new(topology, &self.ground, f64::INFINITY);
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

/// Those of `sorted` that `order` says to be equal.
fn those(sorted: &[u32], order: impl Fn(&u32) -> Ordering) -> &[u32] {
    let first = sorted.partition_point(|one| order(one).is_lt());
    &sorted[first..sorted.partition_point(|one| order(one).is_le())]
}

/// Per vertex of `topology` the lowest one that triangles connect it with.
fn islands(topology: &Topology) -> Vec<u32> {
    let mut lower: Vec<u32> = (0..topology.positions.len() as u32).collect();
    let lowest = |lower: &mut Vec<u32>, mut vertex: u32| {
        while lower[vertex as usize] != vertex {
            lower[vertex as usize] = lower[lower[vertex as usize] as usize];
            vertex = lower[vertex as usize];
        }
        vertex
    };
    for &[a, b, c] in &topology.triangles {
        for other in [b, c] {
            let ends = [a, other].map(|vertex| lowest(&mut lower, vertex));
            lower[ends[0].max(ends[1]) as usize] = ends[0].min(ends[1]);
        }
    }
    (0..lower.len() as u32).map(|vertex| lowest(&mut lower, vertex)).collect()
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
        let mut relaxation = Relaxation::of_points(topology, &points, spacing_m, None);
        assert_eq!(relaxation.len(), 1);
        (0..rounds).for_each(|_| relaxation[0].round(1.0));
        let moved: Vec<DVec3> = relaxation[0].points().map(|(_, (position, _))| position).collect();
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
        let mut relaxation = Relaxation::of_points(&topology, &points, 0.25, Some(&weight));
        (0..200).for_each(|_| relaxation[0].round(1.0));
        let above = relaxation[0].points().filter(|(_, (p, _))| p.z > 0.0).count();
        // The density of points is the square root of the weight: four times as many above, if rounds went on for ever.
        assert!((135..=165).contains(&above), "{above} of 200 above");
    }

    #[test]
    fn points_on_surfaces_apart_are_moved_as_if_each_were_alone() {
        let ball = sphere(3);
        let far = DVec3::X * 5.0;
        let vertices = ball.positions.len() as u32;
        let positions: Vec<DVec3> =
            ball.positions.iter().copied().chain(ball.positions.iter().map(|&p| p + far)).collect();
        let others = ball.triangles.iter().map(|corners| corners.map(|corner| corner + vertices));
        let both = Topology::new(&positions, &ball.triangles.iter().copied().chain(others).collect::<Vec<_>>());
        let seeds: Vec<DVec3> = (0..40_u32)
            .map(|i| DVec3::new((f64::from(i) * 1.7).sin(), 0.3, (f64::from(i) * 2.9).cos()).normalize())
            .collect();
        let on = |surface: &Topology, seeds: &[DVec3]| -> Vec<(u32, DVec3)> {
            places(surface, seeds).iter().map(|place| (place.triangle, place.position(surface))).collect()
        };
        // Each second point is on the second ball.
        let mixed: Vec<DVec3> = seeds.iter().flat_map(|&seed| [seed, seed + far]).collect();
        let mut relaxations = Relaxation::of_points(&both, &on(&both, &mixed), 0.4, None);
        assert_eq!(relaxations.len(), 2);
        for relaxation in &mut relaxations {
            (0..5).for_each(|_| relaxation.round(1.0));
            let moved: Vec<(usize, (DVec3, DVec3))> = relaxation.points().collect();
            let second = moved[0].0 % 2;
            assert!(moved.iter().map(|(number, _)| *number).eq((0..seeds.len()).map(|i| 2 * i + second)));
            let away = far * second as f64;
            let positions: Vec<DVec3> = ball.positions.iter().map(|&p| p + away).collect();
            let ball = Topology::new(&positions, &ball.triangles);
            let own: Vec<DVec3> = seeds.iter().map(|&seed| seed + away).collect();
            let mut alone = Relaxation::of_points(&ball, &on(&ball, &own), 0.4, None);
            (0..5).for_each(|_| alone[0].round(1.0));
            assert!(alone.len() == 1 && moved.iter().map(|(_, at)| *at).eq(alone[0].points().map(|(_, at)| at)));
            assert!(moved.iter().zip(&own).any(|((_, (moved, _)), seed)| moved.distance(*seed) > 0.05));
        }
    }
}
