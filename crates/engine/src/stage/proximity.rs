//! Proximity: what is near a field before it touches.
//!
//! Over the taxels with a distance d in range, at x with outward normal n: the least d, of equal ones that of the lowest id; its
//! taxel and where that is; the speed of approach, the fall of the least d per second ([`super::window`]), positive for what comes;
//! the number of these taxels; and their mean place Σ x/d² / Σ 1/d². A distance under [`LEAST_M`] counts as that.
//!
//! This stage is the host's, in f64 of raw values, so that it gives the same bits on every backend.

use glam::DVec2;

/// Distances under this one, m, are this one.
pub(crate) const LEAST_M: f64 = 1e-4;

/// A taxel with something in range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Near {
    /// At least [`LEAST_M`].
    pub(crate) distance_m: f64,
    /// In the field's chart, m.
    pub(crate) place_m: DVec2,
}

/// The taxel with the least distance; the first of equal ones.
pub(crate) fn nearest(taxels: &[Near]) -> Option<usize> {
    (0..taxels.len()).reduce(|best, next| if taxels[next].distance_m < taxels[best].distance_m { next } else { best })
}

/// Σ x/d² / Σ 1/d², m; `taxels` is not empty.
pub(crate) fn centroid(taxels: &[Near]) -> DVec2 {
    // By the least distance, so that no square leaves the range of f64.
    let least = taxels.iter().map(|taxel| taxel.distance_m).fold(f64::INFINITY, f64::min);
    let weight = |taxel: &Near| (least / taxel.distance_m).powi(2);
    let weights: f64 = taxels.iter().map(weight).sum();
    taxels.iter().map(|taxel| weight(taxel) * taxel.place_m).sum::<DVec2>() / weights
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(u: f64, distance_m: f64) -> Near {
        Near { distance_m, place_m: DVec2::new(u, 0.0) }
    }

    #[test]
    fn the_nearest_is_the_first_of_equal_ones_and_near_ones_weigh_by_the_square() {
        let taxels = [at(0.0, 0.04), at(0.01, 0.02), at(0.02, 0.02)];
        assert_eq!(nearest(&taxels), Some(1));
        assert_eq!(nearest(&[]), None);
        // Weights 1/4, 1, 1.
        assert!((centroid(&taxels).x - 0.03 / 2.25).abs() < 1e-15);
        let extreme = [at(0.0, LEAST_M), at(1.0, 1e18)];
        assert!(centroid(&extreme).is_finite() && centroid(&extreme).x < 1e-30);
    }
}
