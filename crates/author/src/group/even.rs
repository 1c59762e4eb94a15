//! Patches of equal numbers of taxels, by halving.

use glam::DVec3;

use super::axis::least_axis;
use super::distances::LinkDistances;

/// Cosine of the angle to their mean that the normals of a patch should keep within: beyond it a patch goes around its part.
const MIN_NORMAL_COSINE: f64 = -0.2;

/// Up to this number of patches a set is halved in both directions, to compare.
const MAX_COMPARED: usize = 4;

/// Divides the taxels of `distances` into patches of about `of`, equal in number to within one on each connected part of the
/// surface: lists of indices.
///
/// Distances are those along a net of the surface's edges, which tell well enough what is far. A set is cut across its
/// longest distance; where that leaves patches that go around a limb, along the limb.
pub(super) fn even_patches(distances: &mut LinkDistances, of: usize) -> Vec<Vec<usize>> {
    let mut patches = Vec::new();
    let mut rest: Vec<usize> = (0..distances.len()).collect();
    while let Some(&first) = rest.first() {
        let reached_m = distances.along_net_from(first, None);
        let (part, others) = rest.into_iter().partition(|&i| reached_m[i] < f64::INFINITY);
        rest = others;
        let part: Vec<usize> = part;
        let count = ((part.len() as f64 / of as f64).round() as usize).max(1);
        patches.extend(Halving { distances }.patches(part, count).patches);
    }
    patches
}

struct Halving<'a> {
    distances: &'a mut LinkDistances,
}

/// Patches, and how many of them go around their part.
#[derive(Default)]
struct Divided {
    patches: Vec<Vec<usize>>,
    around: usize,
}

impl Halving<'_> {
    /// `taxels` in `count` patches.
    fn patches(&mut self, taxels: Vec<usize>, count: usize) -> Divided {
        if count < 2 {
            let around = usize::from(self.goes_around(&taxels));
            return Divided { patches: vec![taxels], around };
        }
        let across = self.by_distance(&taxels);
        let divided = self.halves(across, count);
        if divided.around == 0 || count > MAX_COMPARED {
            return divided;
        }
        let along = self.by_direction(&taxels);
        let other = self.halves(along, count);
        if other.around < divided.around { other } else { divided }
    }

    /// The two halves of `sorted`, divided further into `count` patches in all.
    fn halves(&mut self, mut sorted: Vec<usize>, count: usize) -> Divided {
        let first = count / 2;
        let second = sorted.split_off((sorted.len() * first + count / 2) / count);
        let mut divided = Divided::default();
        for (half, count) in [(sorted, first), (second, count - first)] {
            let Divided { patches, around } = self.patches(half, count);
            divided.patches.extend(patches);
            divided.around += around;
        }
        divided
    }

    /// `taxels` sorted from one end of their longest distance to the other.
    fn by_distance(&mut self, taxels: &[usize]) -> Vec<usize> {
        let mut from = |taxel: usize| self.distances.along_net_from(taxel, Some(taxels));
        let from_any = from(taxels[0]);
        let from_one = from(farthest(taxels, &from_any));
        let from_other = from(farthest(taxels, &from_one));
        let key = |i: usize| from_one[i] - from_other[i];
        let mut sorted = taxels.to_vec();
        sorted.sort_by(|&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
        sorted
    }

    /// `taxels` sorted by the direction of their normals, from one side of their limb to the other.
    fn by_direction(&self, taxels: &[usize]) -> Vec<usize> {
        let normals: Vec<DVec3> = taxels.iter().map(|&i| self.distances.points[i].1).collect();
        let axis = least_axis(&normals);
        let mean = normals.iter().sum::<DVec3>();
        let front = (mean - axis * mean.dot(axis)).try_normalize().unwrap_or(axis.any_orthonormal_vector());
        let side = axis.cross(front);
        let key = |i: usize| self.distances.points[i].1.dot(side);
        let mut sorted = taxels.to_vec();
        sorted.sort_by(|&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
        sorted
    }

    fn goes_around(&self, taxels: &[usize]) -> bool {
        let normals = || taxels.iter().map(|&i| self.distances.points[i].1);
        let mean = normals().sum::<DVec3>().try_normalize();
        mean.is_none_or(|mean| normals().any(|normal| normal.dot(mean) < MIN_NORMAL_COSINE))
    }
}

/// The one of `taxels` with the largest distance, the first of equals.
fn farthest(taxels: &[usize], distances_m: &[f64]) -> usize {
    let far =
        taxels.iter().copied().reduce(|best, next| if distances_m[next] > distances_m[best] { next } else { best });
    far.unwrap_or(0)
}
