//! Moves scattered points until their cells are alike: centroidal Voronoi cells along the surface.

use glam::DVec3;

use super::place::widest_radius;
use super::placed::{Placed, Progress, SurfacePoint, report_progress};
use crate::body::{NONE, SurfaceIndex, Topology, area_vector, point_tree};
use crate::error::Result;
use crate::field::Relaxation;
use crate::field::geodesic::barycentric;
use crate::parallel;

/// Rounds that give about all that there is to gain; fewer where surface counts unequally, as points keep their numbers better then.
const ROUNDS: usize = 30;
const WEIGHTED_ROUNDS: usize = 10;

/// More points at once stay where they are: rounds would take minutes, and gigabytes.
pub(super) const MOST_POINTS: usize = 100_000;

/// Where points are unequally dense, a surface is as fine as it takes for those that are nearer to each other than all but this share.
const DENSE_SHARE: f64 = 0.2;

/// Scattered points are nearer to each other than hexagons would be, by about this factor.
const SCATTERED_SHARE: f64 = 0.8;

/// Points are on the surface that they were given up to this share of their distance.
const DEVIATION: f64 = 0.5;

/// How much surface counts.
pub(super) enum Weight<'a> {
    /// All of it the same.
    Same,
    /// What is not to get points does not count (at a position with a normal).
    Open(&'a dyn Fn(DVec3, DVec3) -> bool),
    /// Points are this dense, per area.
    Density(&'a dyn Fn(&Placed) -> f64),
}

/// `placed` on `triangles` with `topology`, moved, unless they are over [`MOST_POINTS`]; in the order of the triangles. `area_m2` is
/// what they share.
pub(super) fn relax(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    topology: &Topology,
    placed: &[Placed],
    (area_m2, weight): (f64, &Weight<'_>),
    progress: Progress<'_>,
) -> Result<Vec<Placed>> {
    if topology.triangles.is_empty() || !(2..=MOST_POINTS).contains(&placed.len()) {
        return Ok(placed.to_vec());
    }
    let mut sound = vec![NONE; triangles.len()];
    (0..).zip(&topology.given).for_each(|(index, &given)| sound[given as usize] = index);
    let points: Vec<(u32, DVec3)> = (placed.iter())
        .filter(|one| sound[one.triangle] != NONE)
        .map(|one| (sound[one.triangle], one.point.position))
        .collect();
    // Those on triangles that are flat or doubled stay where they are.
    let stay = placed.iter().filter(|one| sound[one.triangle] == NONE);
    let spacing_m = match weight {
        Weight::Density(_) => dense_spacing(placed),
        _ => 2.0 * widest_radius(area_m2, placed.len()),
    };
    let corners = |triangle: usize| triangles[triangle].map(|v| positions[v as usize]);
    let rounds = if matches!(weight, Weight::Density(_)) { WEIGHTED_ROUNDS } else { ROUNDS };
    let mut relaxations = match weight {
        Weight::Same => Relaxation::of_points(topology, &points, spacing_m, None),
        Weight::Open(is_open) => {
            let weight = |p: DVec3, normal: DVec3| if is_open(p, normal) { 1.0 } else { 0.0 };
            Relaxation::of_points(topology, &points, spacing_m, Some(&weight))
        }
        Weight::Density(density) => {
            let index = SurfaceIndex::of_triangles((0..triangles.len()).map(corners));
            // The points of a relaxed layout are as dense as the square root of what counts.
            let weight = |p: DVec3, normal: DVec3| {
                on_surface(&index, corners, p, normal).map_or(0.0, |at| density(&at).max(0.0).powi(2))
            };
            Relaxation::of_points(topology, &points, spacing_m, Some(&weight))
        }
    };
    for round in 0..rounds {
        report_progress(progress, round as f64 / rounds as f64)?;
        parallel::for_each(parallel::threads(), &mut relaxations, |one: &mut Relaxation| one.round(1.0));
    }
    let mut moved: Vec<(usize, (DVec3, DVec3))> = relaxations.iter().flat_map(Relaxation::points).collect();
    moved.sort_by_key(|(number, _)| *number);
    let moved: Vec<(DVec3, DVec3)> = moved.into_iter().map(|(_, point)| point).collect();
    let tree = point_tree(moved.iter().map(|(position, _)| *position));
    let is_near = |triangle: &usize| {
        let [a, b, c] = corners(*triangle);
        let reach_m = DEVIATION * spacing_m + a.distance(b).max(a.distance(c));
        tree.locate_within_distance(a.to_array(), reach_m * reach_m).next().is_some()
    };
    let near: Vec<usize> = (0..triangles.len()).filter(is_near).collect();
    let index = SurfaceIndex::of_triangles(near.iter().map(|&triangle| corners(triangle)));
    let mut relaxed: Vec<Placed> = Vec::with_capacity(placed.len());
    for ((position, normal), (triangle, from)) in moved.into_iter().zip(points) {
        let landed = on_surface(&index, |triangle| corners(near[triangle]), position, normal);
        relaxed.push(match landed {
            Some(landed) => Placed { triangle: near[landed.triangle], ..landed },
            None => placed_at(topology.given[triangle as usize] as usize, corners, from),
        });
    }
    relaxed.extend(stay);
    relaxed.sort_by_key(|one| one.triangle);
    Ok(relaxed)
}

/// The place on the surface of `index` that is nearest to `position`, where it faces about as `normal` does if it does so anywhere.
fn on_surface(
    index: &SurfaceIndex,
    corners: impl Fn(usize) -> [DVec3; 3],
    position: DVec3,
    normal: DVec3,
) -> Option<Placed> {
    let hit = index.nearest_facing(position, normal)?;
    Some(placed_at(hit.triangle, corners, hit.position))
}

fn placed_at(triangle: usize, corners: impl Fn(usize) -> [DVec3; 3], position: DVec3) -> Placed {
    let corners = corners(triangle);
    let barycentric = barycentric(corners, position);
    let position = corners[0] * barycentric[0] + corners[1] * barycentric[1] + corners[2] * barycentric[2];
    let normal = area_vector(corners).normalize_or_zero();
    Placed { point: SurfacePoint { position, normal, area: 0.0 }, triangle, barycentric }
}

/// The distance of hexagons as dense as `placed` are where they are dense, m.
fn dense_spacing(placed: &[Placed]) -> f64 {
    let tree = point_tree(placed.iter().map(|one| one.point.position));
    let mut nearest_m: Vec<f64> = placed
        .iter()
        .filter_map(|one| tree.nearest_neighbor_iter_with_distance_2(one.point.position.to_array()).nth(1))
        .map(|(_, squared)| squared.sqrt())
        .collect();
    nearest_m.sort_by(f64::total_cmp);
    let dense_m = nearest_m.get((DENSE_SHARE * nearest_m.len() as f64) as usize).copied().unwrap_or(0.0);
    dense_m.max(f64::MIN_POSITIVE) / SCATTERED_SHARE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::{by_density, evenly, set_cell_areas};

    /// A sheet of 1 m × 1 m of 2·n² triangles.
    fn sheet(n: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let corner = |i: u32| DVec3::new((i % (n + 1)).into(), (i / (n + 1)).into(), 0.0) / f64::from(n);
        let positions = (0..(n + 1) * (n + 1)).map(corner).collect();
        let squares = (0..n).flat_map(|y| (0..n).map(move |x| y * (n + 1) + x));
        let triangles = squares.flat_map(|a| [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]]).collect();
        (positions, triangles)
    }

    fn relaxed(n: u32, count: usize, weight: &Weight<'_>) -> (Vec<Placed>, Vec<Placed>) {
        let (positions, triangles) = sheet(n);
        let placed = match weight {
            Weight::Density(density) => by_density(&positions, &triangles, count, 1, density, &mut |_| true),
            Weight::Open(is_open) => {
                let density = |p: &Placed| f64::from(u8::from(is_open(p.point.position, p.point.normal)));
                by_density(&positions, &triangles, count, 1, density, &mut |_| true)
            }
            Weight::Same => evenly(&positions, &triangles, count, 1, &mut |_| true),
        };
        let mut placed = placed.unwrap();
        let mut moved =
            relax(&positions, &triangles, &Topology::new(&positions, &triangles), &placed, (1.0, weight), &mut |_| {
                true
            })
            .unwrap();
        for those in [&mut placed, &mut moved] {
            let all = vec![true; triangles.len()];
            set_cell_areas(&positions, &triangles, &|_| 0, (&all, None), those);
        }
        (placed, moved)
    }

    /// The 5th and 95th percentile of areas over their median, of cells off the border.
    fn spread(placed: &[Placed]) -> [f64; 2] {
        let is_inner = |one: &&Placed| (one.point.position.truncate() - 0.5).abs().max_element() < 0.4;
        let mut areas: Vec<f64> = placed.iter().filter(is_inner).map(|one| one.point.area).collect();
        areas.sort_by(f64::total_cmp);
        let at = |share: f64| areas[(share * (areas.len() - 1) as f64).round() as usize];
        [at(0.05) / at(0.5), at(0.95) / at(0.5)]
    }

    #[test]
    fn cells_are_alike_after_it_however_fine_the_mesh_is() {
        for n in [1, 12, 150] {
            let (before, after) = relaxed(n, 400, &Weight::Same);
            assert_eq!((before.len(), after.len()), (400, 400));
            let [[low, high], [lower, higher]] = [&after, &before].map(|placed| spread(placed));
            assert!(low > 0.88 && high < 1.12, "{n}: {low} {high}");
            assert!(lower < 0.85 && higher > 1.15, "{n}: {lower} {higher}");
            let (positions, triangles) = sheet(n);
            for one in &after {
                let [a, b, c] = triangles[one.triangle].map(|v| positions[v as usize]);
                let [p, q, r] = one.barycentric;
                assert!((a * p + b * q + c * r).distance(one.point.position) < 1e-12);
                assert!(one.point.normal.distance(DVec3::Z) < 1e-12, "{}", one.point.normal);
                assert!(one.barycentric.iter().all(|w| (0.0..=1.0).contains(w)), "{:?}", one.barycentric);
            }
            assert!(after.windows(2).all(|pair| pair[0].triangle <= pair[1].triangle));
        }
    }

    #[test]
    fn a_density_stays_and_what_is_closed_gets_nothing() {
        let density = |p: &Placed| if p.point.position.x > 0.5 { 9.0 } else { 1.0 };
        let (_, after) = relaxed(10, 500, &Weight::Density(&density));
        let dense = after.iter().filter(|one| one.point.position.x > 0.5).count();
        assert!((430..=470).contains(&dense), "{dense} of 500");
        let is_open = |p: DVec3, _: DVec3| p.x < 0.7;
        let (_, after) = relaxed(10, 300, &Weight::Open(&is_open));
        let farthest = after.iter().map(|one| one.point.position.x).fold(0.0, f64::max);
        // The border is as coarse as the surface that was made for it.
        assert!((0.65..0.72).contains(&farthest), "{farthest}");
    }

    #[test]
    fn nothing_moves_where_there_is_nothing_to_share() {
        let (positions, triangles) = sheet(2);
        let one = evenly(&positions, &triangles, 1, 3, &mut |_| true).unwrap();
        let same = relax(
            &positions,
            &triangles,
            &Topology::new(&positions, &triangles),
            &one,
            (1.0, &Weight::Same),
            &mut |_| true,
        )
        .unwrap();
        assert_eq!(one, same);
        let two = evenly(&positions, &triangles, 2, 3, &mut |_| true).unwrap();
        let stopped = relax(
            &positions,
            &triangles,
            &Topology::new(&positions, &triangles),
            &two,
            (1.0, &Weight::Same),
            &mut |_| false,
        );
        assert!(stopped.unwrap_err().to_string().contains("stopped"));
    }
}
