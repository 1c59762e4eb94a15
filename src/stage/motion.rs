//! **motion**: how the centroid moved since the frame before, eq. 3–8.
//!
//! * Displacement Δ = c(t) − c(t − 1) (eq. 3–4), direction atan2(Δv, Δu) in (−π, π] (eq. 5), distance ‖Δ‖ and speed ‖Δ‖/Δt.
//! * The paper's own eq. 6–8: radial distance ‖c(t)‖ − ‖c(t − 1)‖ about the chart's origin, and it over Δt. It is blind
//!   to motion around the origin and signed; both are kept.
//! * Absent, `no_previous`: the field was not in contact in the frame before, or there was none.
//! * Absent, `bad_dt`: Δt ≤ 0, or longer than the scene allows.
//! * Direction absent, `still`: ‖Δ‖ ≤ max(10⁻⁶ of the field's radius, (4n + 22)u of its unit), what rounding of two
//!   centroids of n taxels may feign.
//!
//! **Bound.** With b the sum of both centroids' bounds, Δ is off by δ = b + u‖Δ‖, the distance by δ + 9u‖Δ‖ (its root),
//! the direction by asin(δ/‖Δ‖), a radius by its centroid's bound and 9u of itself, a speed by its distance's bound over
//! Δt and 6u of itself (Δt rounded, the quotient).

use glam::DVec2;

use super::angle::ATAN2_ERROR;
use super::{SLACK, U};

/// Speeds over shorter steps could pass what single precision holds, s.
pub(crate) const SHORTEST_STEP_S: f64 = 1e-12;

/// How a centroid moved; lengths in the unit of the centroids.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Motion {
    pub(crate) displacement: DVec2,
    /// rad in (−π, π]; `None` when still.
    pub(crate) direction: Option<f64>,
    pub(crate) distance: f64,
    pub(crate) radial_distance: f64,
}

/// What single precision may be off by, per coordinate where there are several. `None`: not compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MotionBound {
    pub(crate) displacement: f64,
    pub(crate) direction: Option<f64>,
    pub(crate) distance: f64,
    pub(crate) radial_distance: f64,
    /// Whether `still` may differ.
    pub(crate) still_in_doubt: bool,
}

/// The distance up to which a centroid of `members` taxels counts as still, in its unit; `radius` is the field's.
pub(crate) fn still_within(members: usize, radius: f64) -> f64 {
    (1e-6 * radius).max((4.0 * members as f64 + 22.0) * U)
}

/// What is right, in f64.
pub(crate) fn reference(now: DVec2, before: DVec2, still_within: f64) -> Motion {
    let displacement = now - before;
    let distance = displacement.length();
    // +0 + (−0) is +0, so that moving along −u is π and not −π.
    let direction = (displacement.y + 0.0).atan2(displacement.x + 0.0);
    Motion {
        displacement,
        direction: (distance > still_within).then_some(direction),
        distance,
        radial_distance: now.length() - before.length(),
    }
}

/// How far a single-precision answer may be off, given the bounds of the two centroids as distances.
pub(crate) fn bound(now: DVec2, before: DVec2, still_within: f64, now_bound: f64, before_bound: f64) -> MotionBound {
    let right = reference(now, before, still_within);
    let moved = SLACK * (now_bound + before_bound + U * right.distance);
    let distance = moved + 9.0 * U * right.distance;
    let still_in_doubt = (right.distance - still_within).abs() <= distance + U * still_within;
    let direction = (!still_in_doubt && right.direction.is_some() && moved < 0.5 * right.distance)
        .then(|| (moved / right.distance).asin() + ATAN2_ERROR);
    let radii = now.length() + before.length();
    MotionBound {
        displacement: moved,
        direction,
        distance,
        radial_distance: SLACK * (now_bound + before_bound + 10.0 * U * radii),
        still_in_doubt,
    }
}

/// How far `length / dt` may be off when `length` may be off by `bound`.
pub(crate) fn rate_bound(length: f64, bound: f64, dt_s: f64) -> f64 {
    (bound + 6.0 * U * length.abs()) / dt_s
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn eq_3_to_7_as_they_stand() {
        let moved = reference(DVec2::new(3.0, 4.0), DVec2::new(3.0, -4.0), 1e-6);
        assert_eq!(moved.displacement, DVec2::new(0.0, 8.0));
        assert_eq!((moved.direction, moved.distance), (Some(FRAC_PI_2), 8.0));
        // Around the origin: the paper's distance sees nothing.
        assert_eq!(moved.radial_distance, 0.0);
        let inward = reference(DVec2::new(1.0, 0.0), DVec2::new(3.0, 0.0), 1e-6);
        assert_eq!((inward.direction, inward.distance, inward.radial_distance), (Some(PI), 2.0, -2.0));
        let back = reference(DVec2::new(1.0, -0.0), DVec2::new(3.0, 0.0), 1e-6);
        assert_eq!(back.direction, Some(PI));
    }

    #[test]
    fn what_hardly_moves_is_still() {
        let within = still_within(9, 1.0);
        assert!(within > 1e-6 && within < 1e-5);
        assert_eq!(reference(DVec2::X, DVec2::X, within).direction, None);
        assert_eq!(reference(DVec2::X * (1.0 + 0.5 * within), DVec2::X, within).direction, None);
        assert!(reference(DVec2::X * (1.0 + 2.0 * within), DVec2::X, within).direction.is_some());
    }
}
