//! Places taxels on triangles: blue noise by weighted sample elimination.
//!
//! Yuksel, *Sample Elimination for Generating Poisson Disk Sample Sets* (2015): scatter several times as many samples
//! as wanted, then remove the one with the most crowded neighbourhood until the wanted number is left.

use glam::DVec3;

use super::placed::{Placed, Progress, SurfacePoint, points_on_same_side, report_progress};
use super::sample_neighbours::{SampleNeighbours, eliminate_crowded, pack};
use super::scatter::{MAX_POINTS, Pieces, most_apart};
use crate::body::point_tree;
use crate::error::{Error, Result, failed};
use crate::field::{CellPoint, Divided};

/// Samples per point.
const OVERSAMPLING: usize = 5;

/// Samples per disk of the densest packing, for a given spacing.
const PACKED_OVERSAMPLING: f64 = 9.0;

/// The radius, m, of `count` disks in the densest packing of a plane of `area` (m²). No placement of `count` points has a
/// smallest spacing over twice this.
#[must_use]
pub fn widest_radius(area: f64, count: usize) -> f64 {
    (area / (2.0 * 3.0_f64.sqrt() * count as f64)).sqrt()
}

/// Places exactly `count` points on a mesh as blue noise: irregular, but none close to another.
///
/// `positions` are in metres and `triangles` counter-clockwise seen from outside. Points with normals over 90° apart are
/// no neighbours, so that both sides of a thin part get points. The points are in the order of the triangles; `seed`
/// selects one of many equally good placements. `progress` gets the share that is done, and says whether to go on.
///
/// # Errors
/// `count` is 0 or over 4 million, a triangle has a vertex that does not exist, or the triangles have no finite, positive
/// area; or `progress` ended it.
pub fn place_evenly(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    count: usize,
    seed: u64,
    progress: Progress<'_>,
) -> Result<Vec<Placed>> {
    Ok(with_cells(positions, triangles, evenly(positions, triangles, count, seed, progress)?))
}

/// As [`place_evenly`], without areas.
pub(super) fn evenly(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    count: usize,
    seed: u64,
    progress: Progress<'_>,
) -> Result<Vec<Placed>> {
    check_count(count)?;
    let pieces = Pieces::whole(positions, triangles)?;
    let samples = pieces.scatter(OVERSAMPLING * count, seed);
    let reaches = vec![2.0 * widest_radius(pieces.weight(), count); samples.len()];
    eliminate(&samples, &reaches, count, progress)
}

/// Leaves those points that may get taxels.
pub(super) type Keep<'a> = dyn Fn(Vec<Placed>) -> Result<Vec<Placed>> + 'a;

/// As [`evenly`], but no two neighbours closer than `spacing_m`, and only points that `keep` leaves; else the number that fit.
pub(super) fn evenly_apart(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    count: usize,
    (spacing_m, keep): (f64, &Keep<'_>),
    seed: u64,
    progress: Progress<'_>,
) -> Result<std::result::Result<Vec<Placed>, usize>> {
    let placed = keep(evenly(positions, triangles, count, seed, progress)?)?;
    let points: Vec<SurfacePoint> = placed.iter().map(|placed| placed.point).collect();
    let are_apart = nearest_on_its_side(&points).into_iter().flatten().all(|distance| distance >= spacing_m);
    if placed.len() == count && are_apart {
        return Ok(Ok(placed));
    }
    let packed = keep(apart(positions, triangles, spacing_m, seed, progress)?)?;
    if packed.len() < count {
        return Ok(Err(packed.len()));
    }
    let area = Pieces::whole(positions, triangles)?.weight();
    let reaches = vec![(2.0 * widest_radius(area, count)).max(2.0 * spacing_m); packed.len()];
    eliminate(&packed, &reaches, count, progress).map(Ok)
}

/// Places exactly `count` points, as [`place_evenly`] does, in proportion to `density`, which may be 0 and need not be
/// normalised.
///
/// Where points are `density` times as dense, they keep 1/√density of the spacing.
///
/// # Errors
/// As [`place_evenly`]; or `density` is negative or not finite somewhere, or 0 everywhere.
pub fn place_by_density(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    count: usize,
    seed: u64,
    density: impl Fn(&Placed) -> f64,
    progress: Progress<'_>,
) -> Result<Vec<Placed>> {
    let mut placed = by_density(positions, triangles, count, seed, &density, progress)?;
    let is_skin = skin_by_density(positions, triangles, &density);
    set_cell_areas(positions, triangles, &|_| 0, (&is_skin, None), &mut placed);
    Ok(placed)
}

/// As [`place_by_density`], without areas.
pub(super) fn by_density(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    count: usize,
    seed: u64,
    density: impl Fn(&Placed) -> f64,
    progress: Progress<'_>,
) -> Result<Vec<Placed>> {
    check_count(count)?;
    let area = Pieces::whole(positions, triangles)?.weight();
    let pieces = Pieces::by_density(positions, triangles, OVERSAMPLING * count, &density)?;
    let samples = pieces.scatter(OVERSAMPLING * count, seed);
    // No reach exceeds that of a single point on the whole surface.
    let widest = 2.0 * widest_radius(area, 1);
    let reach_at = |sample: &Placed| {
        let density = density(sample);
        if density > 0.0 { (2.0 * widest_radius(pieces.weight() / density, count)).min(widest) } else { widest }
    };
    let reaches: Vec<f64> = samples.iter().map(reach_at).collect();
    eliminate(&samples, &reaches, count, progress)
}

/// Places as many points as it can with neighbours at least `spacing_m` apart: about two thirds of the densest packing of
/// disks of that diameter.
///
/// Order, sides and `seed` are as in [`place_evenly`].
///
/// # Errors
/// `spacing_m` is not positive and finite, or so small that over 4 million points could fit; a triangle names a vertex
/// that is not there, or the triangles have no finite, positive area.
pub fn place_apart(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    spacing_m: f64,
    seed: u64,
    progress: Progress<'_>,
) -> Result<Vec<Placed>> {
    Ok(with_cells(positions, triangles, apart(positions, triangles, spacing_m, seed, progress)?))
}

/// As [`place_apart`], without areas.
pub(super) fn apart(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    spacing_m: f64,
    seed: u64,
    progress: Progress<'_>,
) -> Result<Vec<Placed>> {
    let pieces = Pieces::whole(positions, triangles)?;
    let most = most_apart(pieces.weight(), spacing_m)?;
    let samples = pieces.scatter((most * PACKED_OVERSAMPLING).ceil() as usize + 1, seed);
    let reaches = vec![spacing_m; samples.len()];
    let crowd = SampleNeighbours::new(&samples, &reaches, |_, _| ());
    report_progress(progress, 0.5)?;
    let kept = pack(&crowd, samples.len(), &mut |share| progress(0.5 + 0.5 * share))?;
    Ok(those(&samples, &kept))
}

fn check_count(count: usize) -> Result<()> {
    if count == 0 {
        return Err(Error::failed("no taxels were asked for; place at least one"));
    }
    if count as f64 > MAX_POINTS {
        return Err(failed!("{count} taxels are over the {MAX_POINTS:.0e} that can be placed at a time"));
    }
    Ok(())
}

/// Eliminates all but `count` samples.
pub(super) fn eliminate(
    samples: &[Placed],
    reaches_m: &[f64],
    count: usize,
    progress: Progress<'_>,
) -> Result<Vec<Placed>> {
    let ratio = count as f64 / samples.len() as f64;
    // Distances far below the final spacing all get the same weight.
    let closest = 1.0 - ratio * ratio.sqrt();
    let crowd = SampleNeighbours::new(samples, reaches_m, |distance, reach| {
        let share = (1.0 - distance.max(reach * closest * 0.65) / reach).max(0.0);
        let squared = share * share;
        let fourth = squared * squared;
        fourth * fourth
    });
    report_progress(progress, 0.5)?;
    let kept = eliminate_crowded(&crowd, samples.len(), count, &mut |share| progress(0.5 + 0.5 * share))?;
    Ok(those(samples, &kept))
}

/// The samples `kept`, without areas.
fn those(samples: &[Placed], kept: &[usize]) -> Vec<Placed> {
    let bare =
        |&sample: &usize| Placed { point: SurfacePoint { area: 0.0, ..samples[sample].point }, ..samples[sample] };
    kept.iter().map(bare).collect()
}

/// `placed`, each with the area of its cell, if it is one surface.
fn with_cells(positions: &[DVec3], triangles: &[[u32; 3]], mut placed: Vec<Placed>) -> Vec<Placed> {
    let all = vec![true; triangles.len()];
    set_cell_areas(positions, triangles, &|_| 0, (&all, None), &mut placed);
    placed
}

/// Gives each of `placed` the area of its cell. Cells divide the triangles that are surface or hold a point; only those of them that
/// are skin have an area, or all if that is not given. `group_of` a vertex is the surface that it belongs to. The cells, if there
/// are any.
pub(super) fn set_cell_areas(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    group_of: &dyn Fn(u32) -> u32,
    (is_surface, is_skin): (&[bool], Option<&[bool]>),
    placed: &mut [Placed],
) -> Option<Divided> {
    let mut counts = is_surface.to_vec();
    placed.iter().for_each(|placed| counts[placed.triangle] = true);
    let mut number = vec![0; triangles.len()];
    let (mut skin, mut given) = (Vec::with_capacity(triangles.len()), Vec::with_capacity(triangles.len()));
    for (triangle, _) in counts.iter().enumerate().filter(|(_, counts)| **counts) {
        number[triangle] = skin.len();
        skin.push(triangles[triangle]);
        given.push(triangle);
    }
    let point = |placed: &Placed| CellPoint { triangle: number[placed.triangle], ..placed.cell_point() };
    let points: Vec<CellPoint> = placed.iter().map(point).collect();
    let is_skin = is_skin.map(|is_skin| |triangle: usize| is_skin[given[triangle]]);
    let is_skin = is_skin.as_ref().map(|is_skin| is_skin as &dyn Fn(usize) -> bool);
    let (areas, divided) = Divided::with_areas(positions, &skin, group_of, is_skin, &points);
    placed.iter_mut().zip(areas).for_each(|(placed, area)| placed.point.area = area);
    divided
}

/// Per triangle whether a density over 0 in its middle makes it skin.
pub(super) fn skin_by_density(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    density: impl Fn(&Placed) -> f64,
) -> Vec<bool> {
    let middle = |(triangle, corners): (usize, &[u32; 3])| {
        let [a, b, c] = corners.map(|corner| positions[corner as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let point = SurfacePoint { position: (a + b + c) / 3.0, normal, area: 0.0 };
        density(&Placed { point, triangle, barycentric: [1.0 / 3.0; 3] }) > 0.0
    };
    triangles.iter().enumerate().map(middle).collect()
}

/// Per point the distance to its nearest neighbour on its side, m; `None` if there is none.
pub(super) fn nearest_on_its_side(points: &[SurfacePoint]) -> Vec<Option<f64>> {
    let tree = point_tree(points.iter().map(|point| point.position));
    let nearest = |(index, point): (usize, &SurfacePoint)| {
        let mut others = tree.nearest_neighbor_iter(point.position.to_array()).map(|spot| spot.data);
        let other = others.find(|&other| other != index && points_on_same_side(&points[other], point))?;
        Some(points[other].position.distance(point.position))
    };
    points.iter().enumerate().map(nearest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::placed::same_side;

    /// A sheet of 1 m × 1 m in the xy plane, of 2·n² triangles; with `back`, a second sheet 1 mm behind, facing away.
    fn sheet(n: u32, back: bool) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for side in 0..=u32::from(back) {
            let first = positions.len() as u32;
            for y in 0..=n {
                for x in 0..=n {
                    positions
                        .push(DVec3::new(x.into(), y.into(), 0.0) / f64::from(n) - DVec3::Z * 0.001 * f64::from(side));
                }
            }
            for y in 0..n {
                for x in 0..n {
                    let a = first + y * (n + 1) + x;
                    let (b, c, d) = (a + 1, a + n + 2, a + n + 1);
                    triangles.extend(if side == 0 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
                }
            }
        }
        (positions, triangles)
    }

    fn least_spacing(placed: &[Placed]) -> f64 {
        let mut least = f64::INFINITY;
        for (i, a) in placed.iter().enumerate() {
            for b in placed[..i].iter().filter(|b| same_side(a, b)) {
                least = least.min(a.point.position.distance(b.point.position));
            }
        }
        least
    }

    #[test]
    fn points_are_as_many_as_asked_and_keep_their_distance() {
        let (positions, triangles) = sheet(7, false);
        for (count, seed) in [(1, 1), (2, 1), (100, 1), (100, 2), (600, 3)] {
            let placed = place_evenly(&positions, &triangles, count, seed, &mut |_| true).unwrap();
            assert_eq!(placed.len(), count);
            let spacing = least_spacing(&placed);
            assert!(spacing >= 0.65 * 2.0 * widest_radius(1.0, count), "{count} points, seed {seed}: {spacing} m");
        }
    }

    #[test]
    fn the_distance_comes_from_elimination() {
        let (positions, triangles) = sheet(7, false);
        let pieces = Pieces::whole(&positions, &triangles).unwrap();
        assert!((pieces.weight() - 1.0).abs() < 1e-12);
        let samples = pieces.scatter(600, 3);
        assert!(least_spacing(&samples) < 0.65 * 2.0 * widest_radius(1.0, 600));
    }

    #[test]
    fn a_placement_repeats_and_the_seed_changes_it() {
        let (positions, triangles) = sheet(3, false);
        let place = |seed| place_evenly(&positions, &triangles, 80, seed, &mut |_| true).unwrap();
        assert_eq!(place(5), place(5));
        assert_ne!(place(5), place(6));
    }

    #[test]
    fn both_sides_of_a_thin_sheet_get_their_own() {
        let (positions, triangles) = sheet(5, true);
        let placed = place_evenly(&positions, &triangles, 400, 9, &mut |_| true).unwrap();
        let front: Vec<&Placed> = placed.iter().filter(|p| p.point.normal.z > 0.0).collect();
        assert!((190..=210).contains(&front.len()), "{} of 400 in front", front.len());
        assert!(least_spacing(&placed) >= 0.65 * 2.0 * widest_radius(2.0, 400));
        let area_in_front: f64 = front.iter().map(|p| p.point.area).sum();
        assert!((area_in_front - 1.0).abs() < 1e-3, "{area_in_front} m²");
    }

    #[test]
    fn areas_share_the_surface_and_points_lie_on_their_triangles() {
        let (positions, triangles) = sheet(4, false);
        let placed = place_evenly(&positions, &triangles, 120, 4, &mut |_| true).unwrap();
        let sum: f64 = placed.iter().map(|p| p.point.area).sum();
        assert!((sum - 1.0).abs() < 1e-12, "{sum} m²");
        assert!(placed.iter().all(|p| (0.2 / 120.0..3.0 / 120.0).contains(&p.point.area)));
        for p in &placed {
            let [a, b, c] = triangles[p.triangle].map(|v| positions[v as usize]);
            let [wa, wb, wc] = p.barycentric;
            assert!(p.barycentric.iter().all(|w| (0.0..=1.0).contains(w)) && (wa + wb + wc - 1.0).abs() < 1e-15);
            assert!((a * wa + b * wb + c * wc).distance(p.point.position) < 1e-15);
            assert_eq!(p.point.normal, DVec3::Z);
        }
    }

    #[test]
    fn a_box_gets_its_edges_kept_clear_too() {
        // Two sheets that meet at a right angle are one surface.
        let (mut positions, mut triangles) = sheet(6, false);
        let first = positions.len() as u32;
        let (upright, others) = sheet(6, false);
        positions.extend(upright.into_iter().map(|p| DVec3::new(0.0, p.y, -p.x)));
        triangles.extend(others.into_iter().map(|[a, b, c]| [first + a, first + c, first + b]));
        let placed = place_evenly(&positions, &triangles, 300, 2, &mut |_| true).unwrap();
        let mut least = f64::INFINITY;
        for (i, a) in placed.iter().enumerate() {
            least = placed[..i].iter().map(|b| a.point.position.distance(b.point.position)).fold(least, f64::min);
        }
        assert!(least >= 0.65 * 2.0 * widest_radius(2.0, 300), "{least} m");
    }

    #[test]
    fn a_density_sets_how_many_there_are_and_how_far_apart() {
        // Nine times as dense on the right half, on triangles that are larger than the spacing there; none at the top.
        let (positions, triangles) = sheet(4, false);
        let density = |p: &Placed| match p.point.position {
            p if p.y > 0.75 => 0.0,
            p if p.x > 0.5 => 9.0,
            _ => 1.0,
        };
        let placed = place_by_density(&positions, &triangles, 1000, 3, density, &mut |_| true).unwrap();
        assert_eq!(placed.len(), 1000);
        let (right, left): (Vec<Placed>, Vec<Placed>) = placed.iter().partition(|p| p.point.position.x > 0.5);
        assert!(placed.iter().all(|p| p.point.position.y <= 0.75));
        // As many to each side as there is density on it, but for what the edge between them takes.
        assert!((860..=920).contains(&right.len()), "{}", right.len());
        let spacing = |count: f64| 2.0 * widest_radius(0.375, 1) / count.sqrt();
        assert!(least_spacing(&right) >= 0.65 * spacing(900.0), "{}", least_spacing(&right));
        assert!(least_spacing(&left) >= 0.65 * spacing(100.0), "{}", least_spacing(&left));
        let area: f64 = left.iter().map(|p| p.point.area).sum();
        assert!((area - 0.375).abs() < 0.02, "{area} m²");

        let why = |density: f64| {
            place_by_density(&positions, &triangles, 9, 3, |_| density, &mut |_| true).unwrap_err().to_string()
        };
        assert!(why(-1.0).contains("density") && why(f64::NAN).contains("NaN") && why(0.0).contains("everywhere"));
    }

    #[test]
    fn a_density_that_is_the_same_everywhere_is_no_density() {
        let (positions, triangles) = sheet(4, false);
        let placed = place_by_density(&positions, &triangles, 300, 3, |_| 7.5, &mut |_| true).unwrap();
        assert!(least_spacing(&placed) >= 0.65 * 2.0 * widest_radius(1.0, 300));
        let area: f64 = placed.iter().map(|p| p.point.area).sum();
        assert!((area - 1.0).abs() < 1e-9, "{area} m²");
    }

    #[test]
    fn with_a_spacing_as_many_as_fit_keep_it() {
        let (positions, triangles) = sheet(5, true);
        for (spacing, seed) in [(0.05, 1), (0.05, 2), (0.3, 1), (3.0, 1)] {
            let placed = place_apart(&positions, &triangles, spacing, seed, &mut |_| true).unwrap();
            assert!(least_spacing(&placed) >= spacing, "{} m", least_spacing(&placed));
            // No further taxel fits: every place on the sheet has one within the spacing, up to the distance between samples.
            // There are nine samples for each disk of the densest packing.
            let gap = spacing * (1.0 + 1.0 / 3.0);
            for p in Pieces::whole(&positions, &triangles).unwrap().scatter(2000, 77) {
                assert!(placed.iter().any(|q| same_side(&p, q) && p.point.position.distance(q.point.position) < gap));
            }
            // Random darts would take 0.547 of the plane, the densest packing 0.907.
            let covered = placed.len() as f64 * std::f64::consts::PI * spacing * spacing / 4.0 / 2.0;
            assert!(spacing > 0.1 || covered > 0.547, "{covered}");
        }
        let why =
            |spacing: f64| place_apart(&positions, &triangles, spacing, 1, &mut |_| true).unwrap_err().to_string();
        assert!(why(0.0).contains("spacing") && why(f64::NAN).contains("spacing") && why(1e-6).contains("metres"));
    }

    #[test]
    fn what_has_no_surface_gets_no_taxels() {
        let (positions, triangles) = sheet(1, false);
        assert!(place_evenly(&positions, &triangles, 0, 1, &mut |_| true).is_err());
        assert!(place_evenly(&positions, &[], 5, 1, &mut |_| true).is_err());
        assert!(place_evenly(&positions, &[[0, 0, 1]], 5, 1, &mut |_| true).is_err());
        assert!(place_evenly(&positions, &[[0, 1, 9]], 5, 1, &mut |_| true).is_err());
    }
}
