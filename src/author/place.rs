//! Taxels spread evenly over triangles: blue noise by weighted sample elimination.
//!
//! Yuksel, *Sample Elimination for Generating Poisson Disk Sample Sets* (2015): scatter several times as many samples
//! as wanted, then remove the one with the most crowded neighbourhood until the wanted number is left.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::DVec3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::SurfacePoint;
use super::random::Random;
use crate::body::Skinning;
use crate::error::{Error, Result};

/// Samples scattered for each one kept.
const OVERSAMPLING: usize = 5;

/// A point that [`place_evenly`] chose, and where on the mesh it lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// The point; its normal is that of the triangle.
    pub point: SurfacePoint,
    /// Index of the triangle.
    pub triangle: usize,
    /// Weights of the triangle's three corners, summing to 1.
    pub barycentric: [f64; 3],
}

/// The radius, in m, of `count` disks that cover a plane of `area` (m²) as densely as disks can without overlapping.
/// No placement of `count` points has a smallest spacing over twice this.
#[must_use]
pub fn widest_radius(area: f64, count: usize) -> f64 {
    (area / (2.0 * 3.0_f64.sqrt() * count as f64)).sqrt()
}

/// Places exactly `count` points on a mesh, as evenly as blue noise goes: irregular, but none close to another.
///
/// `positions` are in metres and `triangles` counter-clockwise seen from outside. Two places whose normals are 90° or
/// more apart are no neighbours however close they are, so that both sides of a thin part get their own. The points
/// come in the order of the triangles; `seed` picks one of many equally good placements.
///
/// # Errors
/// `count` is 0, a triangle names a vertex that is not there, or the triangles have no finite, positive area.
pub fn place_evenly(positions: &[DVec3], triangles: &[[u32; 3]], count: usize, seed: u64) -> Result<Vec<Placed>> {
    if count == 0 {
        return Err(Error::failed("no taxels were asked for; place at least one"));
    }
    let (mut samples, area) = scatter(positions, triangles, OVERSAMPLING * count, seed)?;
    let kept = eliminate(&samples, count, widest_radius(area, count));
    share_area(&mut samples, &kept, area);
    Ok(kept.into_iter().map(|sample| samples[sample]).collect())
}

/// Scatters `count` samples uniformly by area, and says what the area is in m².
fn scatter(positions: &[DVec3], triangles: &[[u32; 3]], count: usize, seed: u64) -> Result<(Vec<Placed>, f64)> {
    let mut corners = Vec::with_capacity(triangles.len());
    let mut area_up_to = Vec::with_capacity(triangles.len());
    let mut area = 0.0;
    for (index, triangle) in triangles.iter().enumerate() {
        let corner = |k: usize| positions.get(triangle[k] as usize).copied();
        let (Some(a), Some(b), Some(c)) = (corner(0), corner(1), corner(2)) else {
            return Err(Error::failed(format!("triangle {index} names a vertex that is not there")));
        };
        area += (b - a).cross(c - a).length() / 2.0;
        corners.push([a, b, c]);
        area_up_to.push(area);
    }
    if !(area.is_finite() && area > 0.0) {
        return Err(Error::failed("the surface has no area to place taxels on"));
    }
    let mut random = Random::new(seed);
    let samples = (0..count).map(|sample| {
        // One sample in each of `count` equal shares of the area: as uniform, and with fewer gaps, than anywhere.
        let at = area * (sample as f64 + random.unit()) / count as f64;
        let triangle = area_up_to.partition_point(|&up_to| up_to <= at).min(corners.len() - 1);
        let [a, b, c] = corners[triangle];
        let (root, along) = (random.unit().sqrt(), random.unit());
        let barycentric = [1.0 - root, root * (1.0 - along), root * along];
        let position = a * barycentric[0] + b * barycentric[1] + c * barycentric[2];
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Placed { point: SurfacePoint { position, normal, area: 0.0 }, triangle, barycentric }
    });
    Ok((samples.collect(), area))
}

type Spot = GeomWithData<[f64; 3], usize>;

fn tree(samples: &[Placed], which: impl Iterator<Item = usize>) -> RTree<Spot> {
    RTree::bulk_load(which.map(|i| Spot::new(samples[i].point.position.to_array(), i)).collect())
}

fn same_side(a: &Placed, b: &Placed) -> bool {
    a.point.normal.dot(b.point.normal) > 0.0
}

/// A sample and how crowded it was when it was put on the heap.
struct Crowded {
    weight: f64,
    sample: usize,
}

impl Ord for Crowded {
    fn cmp(&self, other: &Self) -> Ordering {
        self.weight.total_cmp(&other.weight).then(other.sample.cmp(&self.sample))
    }
}

impl PartialOrd for Crowded {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Crowded {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Crowded {}

/// The indices, ascending, of the `count` samples that are left when the most crowded have gone one by one.
fn eliminate(samples: &[Placed], count: usize, radius: f64) -> Vec<usize> {
    let reach = 2.0 * radius;
    let ratio = count as f64 / samples.len() as f64;
    // Samples much closer than the outcome's spacing all have to go: that one is closer still says nothing.
    let closest = 2.0 * radius * (1.0 - ratio * ratio.sqrt()) * 0.65;
    let near = tree(samples, 0..samples.len());
    let neighbours: Vec<Vec<(usize, f64)>> = samples
        .iter()
        .enumerate()
        .map(|(i, sample)| {
            let here = sample.point.position.to_array();
            let mut list: Vec<(usize, f64)> = near
                .locate_within_distance(here, reach * reach)
                .map(|spot| spot.data)
                .filter(|&j| j != i && same_side(sample, &samples[j]))
                .map(|j| {
                    let distance = sample.point.position.distance(samples[j].point.position);
                    let share = (1.0 - distance.max(closest) / reach).max(0.0);
                    let squared = share * share;
                    let fourth = squared * squared;
                    (j, fourth * fourth)
                })
                .collect();
            // The order in which a tree yields must not reach the sums.
            list.sort_by_key(|&(j, _)| j);
            list
        })
        .collect();
    let mut weights: Vec<f64> = neighbours.iter().map(|list| list.iter().map(|(_, w)| w).sum()).collect();
    let mut alive = vec![true; samples.len()];
    let mut heap: BinaryHeap<Crowded> =
        weights.iter().enumerate().map(|(sample, &weight)| Crowded { weight, sample }).collect();
    let mut left = samples.len();
    while left > count {
        let Some(top) = heap.pop() else { break };
        // Weights only fall, so an entry that is out of date stands too high and comes up in time to be put right.
        if top.weight > weights[top.sample] {
            heap.push(Crowded { weight: weights[top.sample], sample: top.sample });
            continue;
        }
        alive[top.sample] = false;
        left -= 1;
        for &(j, weight) in &neighbours[top.sample] {
            weights[j] -= weight;
        }
    }
    (0..samples.len()).filter(|&i| alive[i]).collect()
}

/// Gives each kept sample the part of `area` whose samples are nearest to it, on its own side.
fn share_area(samples: &mut [Placed], kept: &[usize], area: f64) {
    let near = tree(samples, kept.iter().copied());
    let mut counts = vec![0_usize; samples.len()];
    for sample in samples.iter() {
        let here = sample.point.position.to_array();
        let own = near.nearest_neighbor_iter(here).map(|spot| spot.data).find(|&k| same_side(sample, &samples[k]));
        // On a part so thin that no kept sample shares the side, the nearest one stands for it.
        if let Some(owner) = own.or_else(|| near.nearest_neighbor(here).map(|spot| spot.data)) {
            counts[owner] += 1;
        }
    }
    let share = area / samples.len() as f64;
    for (sample, count) in samples.iter_mut().zip(counts) {
        sample.point.area = share * count as f64;
    }
}

/// What carries the point at `barycentric` of the triangle `corners`: its corners' joints and weights, blended, as
/// [`heaviest_four`] gives them.
///
/// # Panics
/// A corner is no vertex of `skinning`.
#[must_use]
pub fn blend_skinning(skinning: &Skinning, corners: [u32; 3], barycentric: [f64; 3]) -> ([u16; 4], [f32; 4]) {
    let mut carriers: Vec<(u16, f64)> = Vec::new();
    for (corner, part) in corners.into_iter().zip(barycentric) {
        let vertex = corner as usize;
        for (&joint, &weight) in skinning.joints[vertex].iter().zip(&skinning.weights[vertex]) {
            let weight = part * f64::from(weight);
            match carriers.iter_mut().find(|(known, _)| *known == joint) {
                Some((_, sum)) => *sum += weight,
                None => carriers.push((joint, weight)),
            }
        }
    }
    heaviest_four(carriers)
}

/// The four heaviest of `carriers` (joint, weight), heaviest first and made to sum to 1, as a row of [`Skinning`].
/// Places left over hold joint 0 with weight 0.
#[must_use]
pub fn heaviest_four(mut carriers: Vec<(u16, f64)>) -> ([u16; 4], [f32; 4]) {
    carriers.retain(|(_, weight)| *weight > 0.0);
    carriers.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    carriers.truncate(4);
    let sum: f64 = carriers.iter().map(|(_, weight)| weight).sum();
    let (mut joints, mut weights) = ([0; 4], [0.0; 4]);
    for (slot, (joint, weight)) in carriers.into_iter().enumerate() {
        joints[slot] = joint;
        weights[slot] = (weight / sum) as f32;
    }
    (joints, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

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
            let placed = place_evenly(&positions, &triangles, count, seed).unwrap();
            assert_eq!(placed.len(), count);
            let spacing = least_spacing(&placed);
            assert!(spacing >= 0.65 * 2.0 * widest_radius(1.0, count), "{count} points, seed {seed}: {spacing} m");
        }
    }

    #[test]
    fn the_distance_comes_from_elimination() {
        let (positions, triangles) = sheet(7, false);
        let (samples, area) = scatter(&positions, &triangles, 600, 3).unwrap();
        assert!((area - 1.0).abs() < 1e-12);
        assert!(least_spacing(&samples) < 0.65 * 2.0 * widest_radius(1.0, 600));
    }

    #[test]
    fn a_placement_repeats_and_the_seed_changes_it() {
        let (positions, triangles) = sheet(3, false);
        let place = |seed| place_evenly(&positions, &triangles, 80, seed).unwrap();
        assert_eq!(place(5), place(5));
        assert_ne!(place(5), place(6));
    }

    #[test]
    fn both_sides_of_a_thin_sheet_get_their_own() {
        let (positions, triangles) = sheet(5, true);
        let placed = place_evenly(&positions, &triangles, 400, 9).unwrap();
        let front: Vec<&Placed> = placed.iter().filter(|p| p.point.normal.z > 0.0).collect();
        assert!((190..=210).contains(&front.len()), "{} of 400 in front", front.len());
        assert!(least_spacing(&placed) >= 0.65 * 2.0 * widest_radius(2.0, 400));
        let area_in_front: f64 = front.iter().map(|p| p.point.area).sum();
        assert!((area_in_front - 1.0).abs() < 1e-3, "{area_in_front} m²");
    }

    #[test]
    fn areas_share_the_surface_and_points_lie_on_their_triangles() {
        let (positions, triangles) = sheet(4, false);
        let placed = place_evenly(&positions, &triangles, 120, 4).unwrap();
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
    fn what_has_no_surface_gets_no_taxels() {
        let (positions, triangles) = sheet(1, false);
        assert!(place_evenly(&positions, &triangles, 0, 1).is_err());
        assert!(place_evenly(&positions, &[], 5, 1).is_err());
        assert!(place_evenly(&positions, &[[0, 0, 1]], 5, 1).is_err());
        assert!(place_evenly(&positions, &[[0, 1, 9]], 5, 1).is_err());
    }

    #[test]
    fn blended_weights_keep_the_heaviest_four_and_sum_to_one() {
        let skinning = Skinning {
            joints: vec![[0, 1, 2, 3], [1, 4, 0, 0], [5, 0, 0, 0]],
            weights: vec![[0.4, 0.3, 0.2, 0.1], [0.5, 0.5, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]],
        };
        let (joints, weights) = blend_skinning(&skinning, [0, 1, 2], [0.5, 0.3, 0.2]);
        assert_eq!(joints, [1, 0, 5, 4]);
        assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        assert!((f64::from(weights[0]) - 0.3 / 0.85).abs() < 1e-6);
    }
}
