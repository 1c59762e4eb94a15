//! **principal_axis**: the principal axis of the pressure-weighted second moments about the centroid.
//!
//! M = Σ wP (x − c)(x − c)ᵀ = (a b; b d). Its eigenvalues are (a + d)/2 ± h/2 with h = √((a − d)² + (2b)²), so that the
//! anisotropy (λ₁ − λ₂)/(λ₁ + λ₂) is h/(a + d), and the axis of the larger one lies at ½ atan2(2b, a − d), in [0, π).
//!
//! * One pressed taxel: both absent, `one_taxel`.
//! * a + d ≤ 2⁻³⁰ S·unit²: the pressed taxels fall together; both absent, `coincident`.
//! * Anisotropy under 10⁻³: the axis is absent, `isotropic`.
//!
//! **Bound.** About another centre the moments are M + S·δc δcᵀ, exactly: the centroid's own error counts only squared.
//! With δ = u‖x‖ + u‖x − c‖ for coordinate and difference, every entry of M is off by at most
//! E = Σ wP(2‖x − c‖δ + (δ + ‖δc‖)²) + (r + 9)u Σ wP‖x − c‖², with r of [`super::Sums`], and Σ wε‖x − c‖² where pressures are off by ε more
//! than 2u, with P + ε for P; then |δ(a + d)| ≤ 1.5E, |δh| ≤ 2E + 12u·h (a square root may lose 9u), the quotient's error is (|δh| + κ|δ(a
//! + d)|)/(a + d − |δ(a + d)|) + 8u, and the axis turns by at most ½ asin(δh/h).

use glam::DVec2;

use super::angle::{ATAN2_ERROR, of_line};
use super::limit::Limit;
use super::orientation::{Line, LineBound};
use super::{Given, GivenLimit, Pressed, SLACK, Sums, U, scalar};
use crate::percept::{Flags, Outputs};

/// 2⁻³⁰.
const TOGETHER: f64 = 1.0 / 1_073_741_824.0;
/// Anisotropy under which there is no axis.
const ISOTROPIC: f64 = 1e-3;

/// Axis and anisotropy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axis {
    pub(crate) line: Line,
    pub(crate) anisotropy: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AxisBound {
    pub(crate) line: LineBound,
    pub(crate) anisotropy: Option<f64>,
}

impl Axis {
    pub(crate) fn outputs(&self) -> [Given; 2] {
        [self.line.given(Outputs::PRINCIPAL_AXIS), (Outputs::ANISOTROPY, self.anisotropy.map(scalar))]
    }
}

impl AxisBound {
    /// The outputs' limits; `present` says which the reference has.
    pub(crate) fn limits(&self, present: Outputs) -> [GivenLimit; 2] {
        let together = self.line.in_doubt.contains(Flags::COINCIDENT);
        let in_doubt = together || self.line.in_doubt.contains(Flags::ISOTROPIC);
        let limit = |output, bound, in_doubt| (output, Limit::from_bound(bound, present.contains(output), in_doubt));
        [
            limit(Outputs::PRINCIPAL_AXIS, self.line.angle, in_doubt),
            limit(Outputs::ANISOTROPY, self.anisotropy, together),
        ]
    }
}

/// a, b, d of M.
fn moments(pressed: &[Pressed], centroid: DVec2) -> (f64, f64, f64) {
    pressed.iter().fold((0.0, 0.0, 0.0), |(a, b, d), taxel| {
        let offset = taxel.place.truncate() - centroid;
        let pull = taxel.pull();
        (a + pull * offset.x * offset.x, b + pull * offset.x * offset.y, d + pull * offset.y * offset.y)
    })
}

/// What is right, in f64; `pressed` is not empty.
pub(crate) fn reference(pressed: &[Pressed], centroid: DVec2) -> Axis {
    let absent = |flags| Axis { line: Line { angle: None, flags }, anisotropy: None };
    if pressed.len() == 1 {
        return absent(Flags::ONE_TAXEL);
    }
    let total: f64 = pressed.iter().map(Pressed::pull).sum();
    let (a, b, d) = moments(pressed, centroid);
    if a + d <= TOGETHER * total {
        return absent(Flags::COINCIDENT);
    }
    let anisotropy = ((a - d).hypot(2.0 * b) / (a + d)).min(1.0);
    if anisotropy < ISOTROPIC {
        let line = Line { angle: None, flags: Flags::ISOTROPIC };
        return Axis { line, anisotropy: Some(anisotropy) };
    }
    Axis { line: Line { angle: Some(half_of(a - d, 2.0 * b)), flags: Flags::empty() }, anisotropy: Some(anisotropy) }
}

/// Half the angle of (x, y), as a line's angle: the line along the bisector of (x, y) and +x, without trigonometry's
/// seam at (−1, ±0).
fn half_of(x: f64, y: f64) -> f64 {
    let r = x.hypot(y);
    // Of the two equal forms (r + x, y) and (y, r − x), the one that adds numbers of one sign loses nothing.
    if x >= 0.0 { of_line(r + x, y) } else { of_line(y, r - x) }
}

/// How far a single-precision answer may be off, given the centroid's own bound.
pub(crate) fn bound(pressed: &[Pressed], sums: Sums, centroid: DVec2, centroid_bound: DVec2) -> AxisBound {
    let undecided = |in_doubt| AxisBound { line: LineBound { angle: None, in_doubt }, anisotropy: None };
    if pressed.len() == 1 {
        return undecided(Flags::empty());
    }
    let r_sum = sums.roundings(pressed.len());
    let total: f64 = pressed.iter().map(Pressed::pull).sum();
    let (a, b, d) = moments(pressed, centroid);
    let entry: f64 = pressed
        .iter()
        .map(|taxel| {
            let x = taxel.place.truncate();
            let r = x.distance(centroid);
            let delta = U * x.length() + U * r;
            let (excess, around) = (taxel.pull_excess(), (delta + centroid_bound.length()).powi(2));
            (taxel.pull() + excess) * (2.0 * r * delta + around + (r_sum + 9.0) * U * r * r) + excess * r * r
        })
        .sum::<f64>()
        * SLACK;
    let (trace, h) = (a + d, (a - d).hypot(2.0 * b));
    let trace_error = 1.5 * entry;
    let total_error = (r_sum + 5.0) * U * total + pressed.iter().map(Pressed::pull_excess).sum::<f64>();
    if (trace - TOGETHER * total).abs() <= trace_error + TOGETHER * total_error || trace_error > 0.5 * trace {
        return undecided(Flags::COINCIDENT | Flags::ISOTROPIC);
    }
    let h_error = 2.0 * entry + 12.0 * U * h;
    let anisotropy = h / trace;
    let anisotropy_error = (h_error + anisotropy * trace_error) / (trace - trace_error) + 8.0 * U * anisotropy;
    let in_doubt = if (anisotropy - ISOTROPIC).abs() <= anisotropy_error { Flags::ISOTROPIC } else { Flags::empty() };
    let angle = (in_doubt.is_empty() && h_error < 0.5 * h).then(|| 0.5 * (h_error / h).asin() + ATAN2_ERROR);
    AxisBound { line: LineBound { angle, in_doubt }, anisotropy: Some(anisotropy_error) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stage::angle::between_lines;
    use crate::stage::pressed_at;

    fn axis(taxels: &[(f64, f64, f64)]) -> Axis {
        let pressed = pressed_at(taxels);
        reference(&pressed, crate::stage::centroid::reference(&pressed).truncate())
    }

    #[test]
    fn a_bar_has_its_axis_at_every_angle() {
        for tenths in 0..1800 {
            let right = (f64::from(tenths) / 10.0).to_radians();
            let (sin, cos) = right.sin_cos();
            let at = |along: f64, across: f64| (along * cos - across * sin, along * sin + across * cos, 2.0);
            let got = axis(&[at(1.0, 0.2), at(1.0, -0.2), at(-1.0, 0.2), at(-1.0, -0.2)]);
            assert!(between_lines(got.line.angle.unwrap(), right) < 1e-12, "{tenths}");
            assert!((got.anisotropy.unwrap() - (1.0 - 0.04) / 1.04).abs() < 1e-12);
        }
    }
}
