//! **orientation**: the line through the two farthest points, eq. 9–19.
//!
//! Each pressed taxel puts a point e on the line from the centroid c to itself, as far out as it is pressed:
//! e = c + wP/P_max · (x − c), at the distance R_pt of eq. 11. P_max is one number a field and cancels in the angle, so
//! q = wP/S stands for it. The angle is that of e₁ − e₂ for the two largest R (eq. 12–19, by atan2 where eq. 16 divides
//! by zero), in [0, π). Equal distances go to the lower taxel id.
//!
//! * One pressed taxel: absent, `one_taxel`.
//! * ‖e₁ − e₂‖ ≤ 2⁻¹⁴ R₁: absent, `coincident`.
//! * A third point with R₂ − R₃ ≤ 2⁻¹⁴ R₁: given, with `tie`.
//!
//! If one taxel dominates a touch, single precision is not enough: the host computes it (`engine/dominated.rs`).
//!
//! **Bound.** A point's own error is ε = q(‖δc‖ + u‖x‖ + 9u‖x − c‖) plus 2⁻⁶², where its square underflows: the
//! centroid's error, the coordinate's rounding, then 3u in q, u each in the difference and the product, and the sum of
//! squares. Pressures that are off by ε more than 2u add q‖x − c‖(ε/P + ρ)/(1 − ρ) with ρ = Σ wε/S; from ρ = ½ on nothing
//! is compared. The pair is certain when R₂ − ε₂ exceeds R + ε of every other; else the choice is the reference's margin
//! below the bound, and nothing is compared. The difference then carries δ = ε₁ + ε₂ + u‖e₁ − e₂‖, the angle
//! asin(δ/‖e₁ − e₂‖) and the arctangent's own error.

use glam::DVec2;

use super::angle::{ATAN2_ERROR, of_line};
use super::limit::Limit;
use super::{Given, GivenLimit, Pressed, SLACK, U, scalar};
use crate::percept::{Flags, Outputs};

/// 2⁻¹⁴: points nearer than this part of R₁ fall together, distances nearer than this are a tie.
const NEAR: f64 = 1.0 / 16_384.0;

/// An angle that may be absent, and why or with what doubt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Line {
    /// rad in [0, π).
    pub(crate) angle: Option<f64>,
    pub(crate) flags: Flags,
}

/// What a single-precision answer may differ by: `None` where the reference's own margin is under the bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LineBound {
    pub(crate) angle: Option<f64>,
    /// Flags that may differ for the same reason.
    pub(crate) in_doubt: Flags,
}

impl Line {
    pub(crate) fn given(&self, output: Outputs) -> Given {
        (output, self.angle.map(scalar))
    }

    pub(crate) fn outputs(&self) -> [Given; 1] {
        [self.given(Outputs::ORIENTATION)]
    }
}

impl LineBound {
    /// The outputs' limits; `present` says which the reference has.
    pub(crate) fn limits(&self, present: Outputs) -> [GivenLimit; 1] {
        let in_doubt = self.in_doubt.contains(Flags::COINCIDENT);
        [(Outputs::ORIENTATION, Limit::from_bound(self.angle, present.contains(Outputs::ORIENTATION), in_doubt))]
    }
}

/// e − c of every pressed taxel.
fn each_point(pressed: &[Pressed], centroid: DVec2) -> impl Iterator<Item = DVec2> {
    let total: f64 = pressed.iter().map(Pressed::pull).sum();
    pressed.iter().map(move |taxel| taxel.pull() / total * (taxel.place.truncate() - centroid))
}

/// The first three of [`points`] with their lengths; −∞ where there are fewer.
fn three_farthest(pressed: &[Pressed], centroid: DVec2) -> [(DVec2, f64); 3] {
    let mut farthest = [(DVec2::ZERO, f64::NEG_INFINITY); 3];
    for point in each_point(pressed, centroid) {
        let length = point.length();
        // Of equal ones the earlier stays before.
        if let Some(rank) = farthest.iter().position(|(_, other)| length > *other) {
            farthest[rank..].rotate_right(1);
            farthest[rank] = (point, length);
        }
    }
    farthest
}

/// e − c of every pressed taxel, farthest first, equal ones in order of id; with the taxel's index.
fn points(pressed: &[Pressed], centroid: DVec2) -> Vec<(usize, DVec2)> {
    let mut points: Vec<(usize, DVec2)> = each_point(pressed, centroid).enumerate().collect();
    // A stable sort, so that equal distances keep the order of ids.
    points.sort_by(|(_, a), (_, b)| b.length().total_cmp(&a.length()));
    points
}

/// What is right, in f64; `pressed` is not empty.
pub(crate) fn reference(pressed: &[Pressed], centroid: DVec2) -> Line {
    if pressed.len() == 1 {
        return Line { angle: None, flags: Flags::ONE_TAXEL };
    }
    let [(first, r1), (second, r2), (_, r3)] = three_farthest(pressed, centroid);
    let along = first - second;
    if along.length() <= NEAR * r1 {
        return Line { angle: None, flags: Flags::COINCIDENT };
    }
    // The third of two is −∞ away.
    let tie = r2 - r3 <= NEAR * r1;
    Line { angle: Some(of_line(along.x, along.y)), flags: if tie { Flags::TIE } else { Flags::empty() } }
}

/// How far a single-precision answer may be off, given the centroid's own bound.
pub(crate) fn bound(pressed: &[Pressed], centroid: DVec2, centroid_bound: DVec2) -> LineBound {
    if pressed.len() == 1 {
        return LineBound { angle: None, in_doubt: Flags::empty() };
    }
    let total: f64 = pressed.iter().map(Pressed::pull).sum();
    let lost = pressed.iter().map(Pressed::pull_excess).sum::<f64>() / total;
    if lost >= 0.5 {
        return LineBound { angle: None, in_doubt: Flags::COINCIDENT | Flags::TIE };
    }
    let points = points(pressed, centroid);
    let error = |(index, _): &(usize, DVec2)| {
        let taxel = &pressed[*index];
        let x = taxel.place.truncate();
        let q = taxel.pull() / total;
        let share = 9.0 * U + (taxel.pull_excess() / taxel.pull() + lost) / (1.0 - lost);
        SLACK * (q * (centroid_bound.length() + U * x.length() + share * x.distance(centroid)) + 2.2e-19)
    };
    let far = |point: &(usize, DVec2)| point.1.length();
    let errors: Vec<f64> = points.iter().map(error).collect();
    let (r1, r2) = (far(&points[0]), far(&points[1]));
    let along = (points[0].1 - points[1].1).length();
    let certain =
        points.iter().zip(&errors).skip(2).all(|(p, e)| r2 - errors[1] > far(p) + e && r1 - errors[0] > far(p) + e);
    let mut in_doubt = Flags::empty();
    let delta = errors[0] + errors[1] + U * along;
    if !certain || (along - NEAR * r1).abs() <= delta + NEAR * errors[0] {
        in_doubt |= Flags::COINCIDENT;
    }
    // R₁, R₂, R₃ as sorted magnitudes: each is off by no more than the largest error among all, and its root by 9u.
    let worst = errors.iter().copied().fold(0.0, f64::max);
    let margin = points.get(2).map_or(f64::INFINITY, |third| (r2 - far(third) - NEAR * r1).abs());
    if margin <= 3.0 * worst + 24.0 * U * r1 {
        in_doubt |= Flags::TIE;
    }
    // An orientation that may be absent may lose its tie with it.
    if in_doubt.contains(Flags::COINCIDENT) {
        in_doubt |= Flags::TIE;
    }
    let angle = (certain && !in_doubt.contains(Flags::COINCIDENT) && delta < 0.5 * along)
        .then(|| (delta / along).asin() + ATAN2_ERROR);
    LineBound { angle, in_doubt }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stage::{centroid, pressed_at};

    fn line(taxels: &[(f64, f64, f64)]) -> Line {
        let pressed = pressed_at(taxels);
        reference(&pressed, centroid::reference(&pressed).truncate())
    }

    #[test]
    fn a_rod_has_its_angle() {
        for degrees in 0..180 {
            let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
            let rod: Vec<_> = [-1.0, -0.3, 0.2, 0.9].iter().map(|&s| (s * cos, s * sin, 5.0)).collect();
            let angle = line(&rod).angle.unwrap();
            assert!(super::super::angle::between_lines(angle, f64::from(degrees).to_radians()) < 1e-12);
        }
    }

    #[test]
    fn two_points_on_one_side_have_a_line_that_misses_the_centroid() {
        let one_side = line(&[(2.0, 1.0, 3.0), (2.0, -1.0, 3.0), (0.0, 0.1, 1.0), (0.0, -0.1, 1.0)]);
        assert!((one_side.angle.unwrap() - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    }

    #[test]
    fn a_choice_with_no_margin_is_not_compared() {
        let tie = pressed_at(&[(1.0, 0.0, 1.0), (-1.0, 0.0, 1.0), (0.0, 1.0, 1.0), (0.0, -1.0, 1.0)]);
        let loose = DVec2::splat(1e-7);
        assert_eq!(bound(&tie, DVec2::ZERO, loose).angle, None);
        let clear = pressed_at(&[(1.0, 0.0, 1.0), (-1.0, 0.0, 1.0), (0.0, 0.3, 1.0), (0.0, -0.3, 1.0)]);
        let clear = bound(&clear, DVec2::ZERO, loose);
        assert!(clear.angle.unwrap() < 2e-6 && clear.in_doubt.is_empty());
    }
}
