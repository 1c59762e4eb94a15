//! Fields grown over taxels: a set split into compact patches that are flat enough to have a chart.

use glam::DVec3;

use super::SurfacePoint;
use crate::error::{Error, Result};

/// Rounds after which Lloyd's iteration ends even where it still moves.
const MOST_ROUNDS: usize = 50;

/// How much facing counts beside place, in the order in which they are tried.
const FACING: [f64; 4] = [1.0, 2.0, 4.0, 8.0];

/// What patches have to be like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchRules {
    /// How many to make. There will be more where so many cannot keep the other rules.
    pub patches: usize,
    /// The fewest points in a patch.
    pub least_members: usize,
    /// The largest angle between a member's normal and its patch's [`mean_normal`], rad.
    pub max_angle_rad: f64,
}

impl Default for PatchRules {
    /// One patch, of any size, bent by no more than 70°: a plane chart ends at 75°.
    fn default() -> Self {
        Self { patches: 1, least_members: 1, max_angle_rad: 70.0 / 180.0 * std::f64::consts::PI }
    }
}

/// The unit vector along the sum of the normals; `None` where they cancel out.
#[must_use]
pub fn mean_normal(points: impl IntoIterator<Item = SurfacePoint>) -> Option<DVec3> {
    points.into_iter().map(|point| point.normal).sum::<DVec3>().try_normalize()
}

/// Splits `points` (of one rigid part, in one frame) into patches that keep `rules`, and gives each as ascending
/// indices; every point is in exactly one.
///
/// Seeds are taken each as far as possible from those before it, then moved by Lloyd's iteration. Far is meant in
/// place and in facing at once: one patch's radius counts as much as a normal turned by 60°, and where that breaks a
/// rule as one turned by less.
///
/// # Errors
/// There are no points, or no number of patches keeps all the rules.
pub fn split_into_patches(points: &[SurfacePoint], rules: &PatchRules) -> Result<Vec<Vec<usize>>> {
    if points.is_empty() {
        return Err(Error::failed("there are no taxels to split into patches"));
    }
    let least_members = rules.least_members.max(1);
    let least_cosine = libm::cos(rules.max_angle_rad);
    let keeps_the_rules = |patch: &Vec<usize>| {
        patch.len() >= least_members
            && mean_normal(patch.iter().map(|&i| points[i]))
                .is_some_and(|mean| patch.iter().all(|&i| points[i].normal.dot(mean) >= least_cosine))
    };
    (rules.patches.max(1)..=points.len() / least_members)
        .flat_map(|count| FACING.map(|facing| (count, facing)))
        .map(|(count, facing)| split(points, count, facing, least_members))
        .find(|patches| patches.len() >= rules.patches && patches.iter().all(keeps_the_rules))
        .ok_or_else(|| {
            Error::failed(format!(
                "{} taxels cannot be split into {} or more patches of at least {least_members} whose normals stay \
                 within {:.0}° of their mean; ask for fewer patches or members, or place more taxels",
                points.len(),
                rules.patches,
                rules.max_angle_rad.to_degrees()
            ))
        })
}

/// A patch's middle: mean position and facing.
#[derive(Clone, Copy, PartialEq)]
struct Centre {
    position: DVec3,
    normal: DVec3,
}

/// `count` patches, or fewer where some come out with under `least_members`; at `facing` 1, a radius counts as much as a normal turned by 60°.
fn split(points: &[SurfacePoint], count: usize, facing: f64, least_members: usize) -> Vec<Vec<usize>> {
    let area: f64 = points.iter().map(|point| point.area).sum();
    // That of a round patch; unit normals 60° apart differ by 1.
    let radius_squared = facing * area / (count as f64 * std::f64::consts::PI);
    let distance = |point: &SurfacePoint, centre: &Centre| {
        point.position.distance_squared(centre.position) + radius_squared * point.normal.distance_squared(centre.normal)
    };
    let mut centres = seeds(points, count, distance);
    let mut patches = settle(points, &mut centres, distance);
    // The smallest goes and its neighbours take its points, until none is too small.
    while let Some(smallest) = (0..patches.len()).min_by_key(|&k| patches[k].len())
        && patches[smallest].len() < least_members
        && patches.len() > 1
    {
        centres.remove(smallest);
        patches = settle(points, &mut centres, distance);
    }
    patches
}

/// Lloyd's iteration: each point to its nearest centre, each centre to the middle of its points, until nothing moves.
fn settle(
    points: &[SurfacePoint],
    centres: &mut [Centre],
    distance: impl Fn(&SurfacePoint, &Centre) -> f64,
) -> Vec<Vec<usize>> {
    let mut patches = assign(points, centres, &distance);
    for _ in 0..MOST_ROUNDS {
        for (centre, patch) in centres.iter_mut().zip(&patches).filter(|(_, patch)| !patch.is_empty()) {
            let sum: DVec3 = patch.iter().map(|&i| points[i].position).sum();
            centre.position = sum / patch.len() as f64;
            centre.normal = mean_normal(patch.iter().map(|&i| points[i])).unwrap_or(centre.normal);
        }
        let moved = assign(points, centres, &distance);
        if moved == patches {
            break;
        }
        patches = moved;
    }
    patches
}

fn seeds(points: &[SurfacePoint], count: usize, distance: impl Fn(&SurfacePoint, &Centre) -> f64) -> Vec<Centre> {
    let centre_at = |i: usize| Centre { position: points[i].position, normal: points[i].normal };
    let mean = points.iter().map(|p| p.position).sum::<DVec3>() / points.len() as f64;
    let all = Centre { position: mean, normal: mean_normal(points.iter().copied()).unwrap_or(DVec3::ZERO) };
    let mut seeds = vec![centre_at(farthest(points.iter().map(|point| distance(point, &all))))];
    let mut nearest: Vec<f64> = points.iter().map(|point| distance(point, &seeds[0])).collect();
    while seeds.len() < count {
        let seed = centre_at(farthest(nearest.iter().copied()));
        for (nearest, point) in nearest.iter_mut().zip(points) {
            *nearest = nearest.min(distance(point, &seed));
        }
        seeds.push(seed);
    }
    seeds
}

/// Index of the largest distance, the first of equals.
fn farthest(distances: impl Iterator<Item = f64>) -> usize {
    let mut best = (0, f64::NEG_INFINITY);
    for (i, distance) in distances.enumerate() {
        if distance > best.1 {
            best = (i, distance);
        }
    }
    best.0
}

fn assign(
    points: &[SurfacePoint],
    centres: &[Centre],
    distance: impl Fn(&SurfacePoint, &Centre) -> f64,
) -> Vec<Vec<usize>> {
    let mut patches = vec![Vec::new(); centres.len()];
    for (i, point) in points.iter().enumerate() {
        let nearest = farthest(centres.iter().map(|centre| -distance(point, centre)));
        patches[nearest].push(i);
    }
    patches
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points all round an upright tube of radius 25 mm and height 100 mm.
    fn tube(around: usize, up: usize) -> Vec<SurfacePoint> {
        let mut points = Vec::new();
        for level in 0..up {
            for step in 0..around {
                let angle = step as f64 / around as f64 * 2.0 * std::f64::consts::PI;
                let normal = DVec3::new(libm::cos(angle), 0.0, libm::sin(angle));
                let position = normal * 0.025 + DVec3::Y * (0.1 * level as f64 / up as f64);
                points.push(SurfacePoint { position, normal, area: 1.57e-2 / (around * up) as f64 });
            }
        }
        points
    }

    fn worst_angle(points: &[SurfacePoint], patch: &[usize]) -> f64 {
        let mean = mean_normal(patch.iter().map(|&i| points[i])).unwrap();
        patch.iter().map(|&i| points[i].normal.dot(mean).acos()).fold(0.0, f64::max)
    }

    #[test]
    fn a_tube_is_split_until_every_patch_is_flat_enough() {
        let points = tube(12, 8);
        let rules = PatchRules { patches: 1, least_members: 4, ..PatchRules::default() };
        let patches = split_into_patches(&points, &rules).unwrap();
        assert!(patches.len() >= 3, "two patches round a tube would be bent by 90°");
        assert!(patches.iter().all(|patch| patch.len() >= 4 && worst_angle(&points, patch) <= rules.max_angle_rad));
        let mut all: Vec<usize> = patches.concat();
        all.sort_unstable();
        assert_eq!(all, (0..points.len()).collect::<Vec<_>>());
    }

    #[test]
    fn a_wider_angle_lets_patches_be_fewer() {
        let points = tube(12, 8);
        let rules = PatchRules { max_angle_rad: 3.2, ..PatchRules::default() };
        assert_eq!(split_into_patches(&points, &rules).unwrap().len(), 1);
    }

    #[test]
    fn a_flat_sheet_keeps_the_number_asked_and_compact_patches() {
        let points: Vec<SurfacePoint> = (0..400)
            .map(|i| SurfacePoint {
                position: DVec3::new(f64::from(i % 20), 0.0, f64::from(i / 20)) * 0.01,
                normal: DVec3::Y,
                area: 1e-4,
            })
            .collect();
        let patches = split_into_patches(&points, &PatchRules { patches: 4, ..PatchRules::default() }).unwrap();
        assert_eq!(patches.len(), 4);
        assert!(patches.iter().all(|patch| (80..=120).contains(&patch.len())));
    }

    #[test]
    fn rules_that_cannot_be_kept_are_an_error() {
        let points = tube(6, 1);
        let rules = PatchRules { patches: 1, least_members: 4, ..PatchRules::default() };
        assert!(split_into_patches(&points, &rules).unwrap_err().to_string().contains("6 taxels"));
        assert!(split_into_patches(&[], &PatchRules::default()).is_err());
    }
}
