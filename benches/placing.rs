//! How fast taxels are placed, and how evenly.
//!
//!     cargo bench --bench placing

use std::time::Instant;

use glam::DVec3;
use rstar::RTree;
use somatic::author::{Placed, place_apart, place_by_density, place_evenly, widest_radius};

/// A unit sphere of 20·4ⁿ triangles, pushed in and out by up to a tenth.
fn bumpy(cuts: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    let octant = [DVec3::X, DVec3::Y, DVec3::Z];
    let steps = 1 << cuts;
    for signs in 0..8 {
        let sign = |bit: u32| if signs >> bit & 1 == 1 { -1.0 } else { 1.0 };
        let corner = octant.map(|axis| axis * DVec3::new(sign(0), sign(1), sign(2)));
        let first = positions.len() as u32;
        let mut row_of = Vec::new();
        for row in 0..=steps {
            row_of.push(positions.len() as u32 - first);
            for column in 0..=(steps - row) {
                let (b, c) = (f64::from(row) / f64::from(steps), f64::from(column) / f64::from(steps));
                let p = (corner[0] * (1.0 - b - c) + corner[1] * b + corner[2] * c).normalize();
                let bump = 1.0 + 0.1 * (5.0 * p.x).sin() * (6.0 * p.y).sin() * (7.0 * p.z).cos();
                positions.push(p * bump);
            }
        }
        let outward = sign(0) * sign(1) * sign(2) > 0.0;
        for row in 0..steps {
            for column in 0..(steps - row) {
                let vertex = |r: i32, c: i32| first + row_of[r as usize] + c as u32;
                let mut add = |[a, b, c]: [u32; 3]| triangles.push(if outward { [a, b, c] } else { [a, c, b] });
                add([vertex(row, column), vertex(row + 1, column), vertex(row, column + 1)]);
                if column + 1 < steps - row {
                    add([vertex(row + 1, column), vertex(row + 1, column + 1), vertex(row, column + 1)]);
                }
            }
        }
    }
    (positions, triangles)
}

fn main() {
    let (positions, triangles) = bumpy(6);
    let area: f64 = triangles
        .iter()
        .map(|t| t.map(|v| positions[v as usize]))
        .map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0)
        .sum();
    println!("{} triangles, {area:.3} m²", triangles.len());
    let report = |what: &str, began: Instant, placed: &[Placed], per: f64| {
        let seconds = began.elapsed().as_secs_f64();
        let tree = RTree::bulk_load(placed.iter().map(|p| p.point.position.to_array()).collect());
        let nearest = |p: &Placed| {
            let here = p.point.position.to_array();
            tree.nearest_neighbor_iter_with_distance_2(here).nth(1).map_or(f64::INFINITY, |(_, d2)| d2.sqrt())
        };
        let spacings: Vec<f64> = placed.iter().map(nearest).collect();
        let least = spacings.iter().copied().fold(f64::INFINITY, f64::min);
        let mean = spacings.iter().sum::<f64>() / spacings.len() as f64;
        println!("{what}: {} taxels, {seconds:.3} s, least {:.3}, mean {:.3}", placed.len(), least / per, mean / per);
    };
    for count in [1_000, 10_000, 100_000] {
        let widest = 2.0 * widest_radius(area, count);
        let began = Instant::now();
        let placed = place_evenly(&positions, &triangles, count, 1).unwrap();
        report("evenly, in widest spacings", began, &placed, widest);
        let began = Instant::now();
        let placed = place_apart(&positions, &triangles, 0.75 * widest, 1).unwrap();
        report("apart, in given spacings", began, &placed, 0.75 * widest);
        let packed = widest_radius(area, placed.len()) * 2.0;
        println!("  that many could be {:.3} of the spacing apart", packed / (0.75 * widest));
        let began = Instant::now();
        let by_density = |p: &somatic::author::SurfacePoint| (4.0 * p.position.z).exp();
        let placed = place_by_density(&positions, &triangles, count, 1, by_density).unwrap();
        report("by a density of e⁸:1, in widest even spacings", began, &placed, widest);
    }
}
