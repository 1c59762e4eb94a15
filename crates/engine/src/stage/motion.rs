//! **motion**: how the centroid moved since the frame before, eq. 3–8.
//!
//! * Displacement Δ = c(t) − c(t − 1) (eq. 3–4), direction atan2(Δv, Δu) in (−π, π] (eq. 5), distance ‖Δ‖ and speed ‖Δ‖/Δt.
//! * The paper's own eq. 6–8: radial distance ‖c(t)‖ − ‖c(t − 1)‖ about the chart's origin, and it over Δt. It is blind
//!   to motion around the origin and signed; both are kept.
//! * Absent, `no_previous`: the field was not in contact in the frame before, or there was none.
//! * Absent, `bad_dt`: Δt ≤ 0, or longer than the scene allows.
//! * Direction absent, `still`: ‖Δ‖ is at most 10⁻⁶ of the field's radius, or at most what rounding may feign.
//!
//! **Still.** A centroid of n pressed taxels is off by (2r + 13)u of the field's unit at most ([`super::centroid`]), as its
//! taxels lie within a unit of the chart's origin. What two centroids may feign is the sum of both. In one pass r is n − 1,
//! and the sum (2(n + n′) + 22)u. A taxel that is not pressed does not count: it adds 0 to every sum, and that rounds nothing
//! in whatever order. With compensated sums r hardly depends on n, and r of all members stands for both.
//!
//! **Bound.** With b the sum of both centroids' bounds, Δ is off by δ = b + u‖Δ‖, the distance by δ + 9u‖Δ‖ (its root),
//! the direction by asin(δ/‖Δ‖), a radius by its centroid's bound and 9u of itself, a speed by its distance's bound over
//! Δt and 6u of itself (Δt rounded, the quotient). What rounding may feign is a whole number of u. Single precision computes
//! it exactly up to 2²⁴ u. Beyond, it is off by 3u of itself: 2u for the number of taxels, which a device need not round to
//! the nearest, and u for the sum.

use glam::DVec2;

use super::angle::ATAN2_ERROR;
use super::layout::Still;
use super::limit::Limit;
use super::{Given, GivenLimit, SLACK, Sums, U, scalar};
use crate::percept::Outputs;

/// Speeds over shorter steps could pass what single precision holds, s.
pub(crate) const SHORTEST_STEP_S: f64 = 1e-12;

/// Where a field is touched in a frame, in the unit of its motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Centroid {
    pub(crate) place: DVec2,
    /// How many taxels are pressed.
    pub(crate) pressed: u32,
}

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

impl Motion {
    /// The outputs, over a step of `dt_s`; lengths in units of `unit_m`.
    pub(crate) fn outputs(&self, unit_m: f64, dt_s: f64) -> [Given; 6] {
        let [distance, radial] = [self.distance, self.radial_distance].map(|length| length * unit_m);
        let given = |output, value| (output, Some(scalar(value)));
        [
            (Outputs::DISPLACEMENT, Some((self.displacement * unit_m).to_array())),
            (Outputs::DIRECTION, self.direction.map(scalar)),
            given(Outputs::DISTANCE, distance),
            given(Outputs::RADIAL_DISTANCE, radial),
            given(Outputs::SPEED, distance / dt_s),
            given(Outputs::RADIAL_SPEED, radial / dt_s),
        ]
    }
}

impl MotionBound {
    /// The outputs' limits where the reference has `right`, as [`Motion::outputs`] counts them.
    pub(crate) fn limits(&self, right: &Motion, unit_m: f64, dt_s: f64) -> [GivenLimit; 6] {
        let length = |output, bound: f64| (output, Limit::Within(bound * unit_m));
        let rate = |output, right, bound| (output, Limit::Within(rate_bound(right, bound, dt_s) * unit_m));
        [
            length(Outputs::DISPLACEMENT, self.displacement),
            (Outputs::DIRECTION, Limit::from_bound(self.direction, right.direction.is_some(), self.still_in_doubt)),
            length(Outputs::DISTANCE, self.distance),
            length(Outputs::RADIAL_DISTANCE, self.radial_distance),
            rate(Outputs::SPEED, right.distance, self.distance),
            rate(Outputs::RADIAL_SPEED, right.radial_distance, self.radial_distance),
        ]
    }
}

impl Still {
    /// Of a field of `members` that are added up as `sums` says; `radius` is the field's, in its unit.
    pub(crate) fn new(sums: Sums, members: usize, radius: f64) -> Self {
        let (roundings, per_taxel) = match sums {
            Sums::OnePass => (22.0, 2.0),
            Sums::Compensated { .. } => ((4.0 * sums.roundings(members) + 26.0).ceil(), 0.0),
        };
        Self { least: (1e-6 * radius) as f32, rounding: (roundings * U) as f32, per_taxel: (per_taxel * U) as f32 }
    }

    /// The distance, if the two frames together have this number of pressed taxels.
    pub(crate) fn within(&self, pressed: u32) -> f64 {
        let rounding = f64::from(self.rounding) + f64::from(self.per_taxel) * f64::from(pressed);
        rounding.max(f64::from(self.least))
    }

    /// The same in single precision, as lanes and shaders have it.
    #[cfg(test)]
    pub(crate) fn within_f32(&self, pressed: u32) -> f32 {
        (self.rounding + self.per_taxel * pressed as f32).max(self.least)
    }
}

/// What is right, in f64.
pub(crate) fn reference(now: Centroid, before: Centroid, still: &Still) -> Motion {
    let displacement = now.place - before.place;
    let distance = displacement.length();
    // +0 + (−0) is +0, so that moving along −u is π and not −π.
    let direction = (displacement.y + 0.0).atan2(displacement.x + 0.0);
    Motion {
        displacement,
        direction: (distance > still.within(now.pressed + before.pressed)).then_some(direction),
        distance,
        radial_distance: now.place.length() - before.place.length(),
    }
}

/// How far a single-precision answer may be off, given the bounds of the two centroids as distances.
pub(crate) fn bound(now: Centroid, before: Centroid, still: &Still, now_bound: f64, before_bound: f64) -> MotionBound {
    let right = reference(now, before, still);
    let still_within = still.within(now.pressed + before.pressed);
    let moved = SLACK * (now_bound + before_bound + U * right.distance);
    let distance = moved + 9.0 * U * right.distance;
    let still_in_doubt = (right.distance - still_within).abs() <= distance + 3.0 * U * still_within;
    let direction = (!still_in_doubt && right.direction.is_some() && moved < 0.5 * right.distance)
        .then(|| (moved / right.distance).asin() + ATAN2_ERROR);
    let radii = now.place.length() + before.place.length();
    MotionBound {
        displacement: moved,
        direction,
        distance,
        radial_distance: SLACK * (now_bound + before_bound + 10.0 * U * radii),
        still_in_doubt,
    }
}

/// How far `length / dt` may be off when `length` may be off by `bound`.
fn rate_bound(length: f64, bound: f64, dt_s: f64) -> f64 {
    (bound + 6.0 * U * length.abs()) / dt_s
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(u: f64, v: f64) -> Centroid {
        Centroid { place: DVec2::new(u, v), pressed: 1 }
    }

    #[test]
    fn what_hardly_moves_is_still_and_only_pressed_taxels_feign_motion() {
        for (members, pressed) in [(9, 9), (100_000, 9), (100_000, 1), (100_000, 3000)] {
            let still = Still::new(Sums::OnePass, members, 1.0);
            let within = still.within(pressed + 1);
            assert_eq!(within, (2.0 * f64::from(pressed + 1) + 22.0) * U);
            let before = at(1.0, 0.0);
            let direction =
                |by: f64| reference(Centroid { pressed, ..at(1.0 + by, 0.0) }, before, &still).direction.is_some();
            assert_eq!([0.0, 0.5, 2.0].map(|times| direction(times * within)), [false, false, true]);
        }
        // Of a field that is large in its unit, and hardly pressed, a millionth counts.
        assert_eq!(Still { least: 5e-6, ..Still::new(Sums::OnePass, 9, 1.0) }.within(2), f64::from(5e-6_f32));
    }

    #[test]
    fn the_distance_covers_the_bounds_of_two_centroids_and_is_the_same_in_single_precision() {
        for members in [1, 9, 5000, 1_000_000] {
            for sums in [Sums::OnePass, Sums::compensated(members)] {
                let still = Still::new(sums, members, 0.5);
                for pressed in [1, 2, 9, 506, 4999, 1_000_000].into_iter().filter(|&pressed| pressed <= members) {
                    for pressed_before in [1, pressed] {
                        let rounding = [pressed, pressed_before].map(|n| (2.0 * sums.roundings(n) + 13.0) * U);
                        let within = still.within((pressed + pressed_before) as u32);
                        let feigned = rounding.iter().sum::<f64>();
                        assert!(within >= feigned, "{members} {sums:?} {pressed}: {within} {feigned}");
                        assert!(within <= (feigned + 3.0 * U).max(0.5e-6 + U), "{members} {sums:?} {pressed}");
                        let single = still.within_f32((pressed + pressed_before) as u32);
                        assert_eq!(f64::from(single), within);
                    }
                }
            }
        }
        // More than single precision counts.
        let still = Still::new(Sums::OnePass, 1 << 30, 1.0);
        for pressed in [(1 << 23) - 11, (1 << 23) - 10, (1 << 24) + 1, (1 << 25) - 3, (1 << 30) + 77] {
            let (single, within) = (f64::from(still.within_f32(pressed)), still.within(pressed));
            assert!((single - within).abs() <= 2.0 * U * within, "{pressed}");
        }
    }
}
