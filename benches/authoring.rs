//! How fast taxels are placed and how evenly, and how fast a surface is unrolled and how truly.
//!
//!     cargo bench --bench authoring

use std::time::Instant;

use glam::DVec3;
use rstar::RTree;
use somatic::internal::author::{Placed, place_apart, place_by_density, place_evenly, widest_radius};
use somatic::internal::body::Topology;
use somatic::internal::field::geodesic::{LogMap, SurfacePlace};

/// A unit sphere of 20·4ⁿ triangles.
fn icosphere(cuts: u32) -> Topology {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let corner = |k: usize| {
        let sign = |bit: usize| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
        let p = match k / 4 {
            0 => DVec3::new(sign(0), sign(1) * g, 0.0),
            1 => DVec3::new(0.0, sign(0), sign(1) * g),
            _ => DVec3::new(sign(1) * g, 0.0, sign(0)),
        };
        p.normalize()
    };
    let corners: Vec<DVec3> = (0..12).map(corner).collect();
    let edge = (0..12).filter(|&k| k > 0).map(|k| corners[0].distance(corners[k])).fold(f64::INFINITY, f64::min);
    let near = |a: usize, b: usize| corners[a].distance(corners[b]) < 1.01 * edge;
    let mut soup = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in (b + 1..12).filter(|&c| near(a, b) && near(b, c) && near(c, a)) {
                let [p, q, r] = [a, b, c].map(|k| corners[k]);
                soup.push(if (q - p).cross(r - p).dot(p) > 0.0 { [p, q, r] } else { [p, r, q] });
            }
        }
    }
    for _ in 0..cuts {
        let cut = |[a, b, c]: [DVec3; 3]| {
            let [ab, bc, ca] = [(a + b).normalize(), (b + c).normalize(), (c + a).normalize()];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        soup = soup.into_iter().flat_map(cut).collect();
    }
    let triangles: Vec<[u32; 3]> = (0..soup.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Topology::new(&soup.concat(), &triangles)
}

/// The log map of an icosphere from a vertex, as peers lay it: the time with all (u, v), the worst radial error.
fn against_peers() {
    let topology = icosphere(5);
    let pole = topology.corners(0)[0];
    let place = SurfacePlace::in_triangle(&topology, 0, pole);
    let mut corner_of = vec![None; topology.positions.len()];
    for (t, triangle) in topology.triangles.iter().enumerate() {
        for (corner, &v) in triangle.iter().enumerate() {
            let mut barycentric = [0.0; 3];
            barycentric[corner] = 1.0;
            corner_of[v as usize] = Some(SurfacePlace { triangle: t as u32, barycentric });
        }
    }
    let near = |p: DVec3| (0.01..=1.0).contains(&p.dot(pole).acos());
    let places: Vec<(DVec3, SurfacePlace)> = topology
        .positions
        .iter()
        .zip(corner_of)
        .filter_map(|(&p, place)| Some((p, place?)))
        .filter(|(p, _)| near(*p))
        .collect();
    let (seconds, lengths) = timed(|| {
        let map = LogMap::new(&topology, place, DVec3::Z, 1.01).unwrap();
        places.iter().map(|(_, place)| map.reach(place).expect("it is within the limit").distance_m).collect::<Vec<_>>()
    });
    let off = places.iter().zip(&lengths).map(|((p, _), length)| (length / p.dot(pole).acos() - 1.0).abs());
    let worst = off.fold(0.0, f64::max);
    println!("log map of {} triangles: {seconds:.5} s, radial error {worst:.2e}", topology.triangles.len());
}

/// A unit sphere of 8·4ⁿ triangles, with each point pushed in or out by `bump`.
fn sphere(cuts: u32, bump: impl Fn(DVec3) -> f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut soup = Vec::new();
    for [x, y, z] in
        [[1, 1, 1], [-1, 1, 1], [1, -1, 1], [1, 1, -1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, -1]]
    {
        let [a, b, c] = [DVec3::X * f64::from(x), DVec3::Y * f64::from(y), DVec3::Z * f64::from(z)];
        soup.push(if x * y * z > 0 { [a, b, c] } else { [a, c, b] });
    }
    for _ in 0..cuts {
        let cut = |[a, b, c]: [DVec3; 3]| {
            let [ab, bc, ca] = [(a + b).normalize(), (b + c).normalize(), (c + a).normalize()];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        soup = soup.into_iter().flat_map(cut).collect();
    }
    let positions: Vec<DVec3> = soup.concat().into_iter().map(|p| p * (1.0 + bump(p))).collect();
    let triangles: Vec<[u32; 3]> = (0..soup.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let topology = Topology::new(&positions, &triangles);
    (topology.positions, topology.triangles)
}

/// The best of three times, s, and what came out.
fn timed<T>(work: impl Fn() -> T) -> (f64, T) {
    let once = || {
        let began = Instant::now();
        let out = work();
        (began.elapsed().as_secs_f64(), out)
    };
    let tries = [once(), once(), once()];
    tries.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).expect("three were tried")
}

fn unrolling() {
    let (positions, triangles) = sphere(6, |_| 0.0);
    let (seconds, topology) = timed(|| Topology::new(&positions, &triangles));
    println!("{} triangles: topology in {seconds:.4} s", topology.triangles.len());
    let place = SurfacePlace::in_triangle(&topology, 0, topology.corners(0)[0]);
    let (seconds, map) = timed(|| LogMap::new(&topology, place, DVec3::Z, 1.05).unwrap());
    let pole = topology.corners(0)[0];
    let places = (0..topology.triangles.len() as u32).flat_map(|t| topology.corners(t).map(|p| (t, p)));
    let near: Vec<(u32, DVec3)> = places.filter(|(_, p)| (0.01..1.0).contains(&p.dot(pole).acos())).collect();
    let began = Instant::now();
    let off = |&(t, p): &(u32, DVec3)| {
        let reached = map.reach(&SurfacePlace::in_triangle(&topology, t, p)).expect("it is within the limit");
        (reached.distance_m / p.dot(pole).acos() - 1.0).abs()
    };
    let worst = near.iter().map(off).fold(0.0, f64::max);
    let each = began.elapsed().as_secs_f64() / near.len() as f64;
    let windows = map.windows();
    println!("log map to 1.05 rad: {seconds:.4} s, {windows} windows; a place {each:.1e} s; radial error {worst:.1e}");
}

fn main() {
    unrolling();
    against_peers();
    let bump = |p: DVec3| 0.1 * (5.0 * p.x).sin() * (6.0 * p.y).sin() * (7.0 * p.z).cos();
    let (positions, triangles) = sphere(6, bump);
    let area: f64 = triangles
        .iter()
        .map(|t| t.map(|v| positions[v as usize]))
        .map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0)
        .sum();
    println!("{} triangles, {area:.3} m²", triangles.len());
    let report = |what: &str, (seconds, placed): (f64, Vec<Placed>), per: f64| {
        let tree = RTree::bulk_load(placed.iter().map(|p| p.point.position.to_array()).collect());
        let nearest = |p: &Placed| {
            let here = p.point.position.to_array();
            tree.nearest_neighbor_iter_with_distance_2(here).nth(1).map_or(f64::INFINITY, |(_, d2)| d2.sqrt())
        };
        let spacings: Vec<f64> = placed.iter().map(nearest).collect();
        let least = spacings.iter().copied().fold(f64::INFINITY, f64::min);
        let mean = spacings.iter().sum::<f64>() / spacings.len() as f64;
        println!("{what}: {} taxels, {seconds:.3} s, least {:.3}, mean {:.3}", placed.len(), least / per, mean / per);
        placed.len()
    };
    for count in [1_000, 10_000, 100_000] {
        let widest = 2.0 * widest_radius(area, count);
        let placed = timed(|| place_evenly(&positions, &triangles, count, 1, &mut |_| true).unwrap());
        report("evenly, in widest spacings", placed, widest);
        let spacing = 0.75 * widest;
        let fitted = report(
            "apart, in given spacings",
            timed(|| place_apart(&positions, &triangles, spacing, 1, &mut |_| true).unwrap()),
            spacing,
        );
        println!("  {:.3} of what would fit at most", (spacing / (2.0 * widest_radius(area, fitted))).powi(2));
        let density = |p: &Placed| (4.0 * p.point.position.z).exp();
        let placed = timed(|| place_by_density(&positions, &triangles, count, 1, density, &mut |_| true).unwrap());
        report("by a density of e⁸:1, in widest even spacings", placed, widest);
    }
}
