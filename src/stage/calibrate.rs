//! **calibrate**: raw values to pressures.
//!
//! P = gain · (raw − baseline), or P = c(raw − baseline) for a taxel with a curve; 0 unless over the dead band. A value that is not finite, over 2⁶⁰ in size (raw or P), or
//! masked is left out; one under 2⁻⁶⁰ and not zero counts as 0; each puts `faulty_input` on its fields. All of these are
//! decided by the bits, because shader compilers may assume that NaN and infinity never occur.
//!
//! **Curve.** Gain and sign are in the table, which is single precision's on every backend. Between two knots
//! c(x) = p₀ + (x − x₀) · s with s = (p₁ − p₀)/(x₁ − x₀), kept within p₀ and p₁ so that it stays monotone; before the
//! first knot and after the last it is that knot's p. The knot is found by halving.
//!
//! **Bound.** Two roundings on a straight line: |δP| ≤ 2u·P; none where difference and product are single-precision
//! numbers themselves. On a curve x̂ = x(1 + δ), |δ| ≤ u, and as c is monotone it is at most
//! max |c(x ± u|x|) − c(x)| off for that. Then s, the difference and the product round, each by u of at most
//! |p₁ − p₀|, and the sum by u|c|: 3u|p₁ − p₀| + u|c|, over all the knots that x̂ may lie between. Nothing is lost at a
//! knot, beyond the ends, and where each of these is a single-precision number.

use super::layout::Knot;
use super::{SLACK, U};
use crate::percept::Flags;
use crate::signal::{RawValue, TaxelCalibration};

/// Bit of a taxel's status that leaves it out of every sum; the other bits are [`Flags`].
pub(crate) const UNUSABLE: u32 = 1 << 31;

/// 2⁶⁰ and 2⁻⁶⁰ as single-precision bits: what is beyond is unbelievable, what is below is nothing.
pub(crate) const HUGE_BITS: u32 = 0x5D80_0000;
pub(crate) const TINY_BITS: u32 = 0x2180_0000;
/// All bits but the sign.
pub(crate) const SIZE_BITS: u32 = 0x7FFF_FFFF;

/// A taxel's pressure in one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pressure {
    /// P ≥ 0.
    pub(crate) value: f64,
    /// [`Flags`] for the fields that hold it, and [`UNUSABLE`].
    pub(crate) status: u32,
    /// How far a single-precision P may be off.
    pub(crate) bound: f64,
    /// The value lies so near a threshold that single precision may decide otherwise.
    pub(crate) in_doubt: bool,
}

/// What is right, in f64; `curve` is the taxel's, empty for a straight line.
pub(crate) fn reference(raw: RawValue, taxel: &TaxelCalibration, curve: &[Knot]) -> Pressure {
    let unusable = |flag: Flags| Pressure { status: flag.bits() | UNUSABLE, ..Pressure::default() };
    if raw.is_missing() {
        return unusable(Flags::INCOMPLETE);
    }
    let Some(value) = raw.number() else { return unusable(Flags::FAULTY_INPUT) };
    if taxel.mask || value.abs() > HUGE {
        return unusable(Flags::FAULTY_INPUT);
    }
    let mut flags = Flags::empty();
    if value < taxel.raw_range[0].into() || value > taxel.raw_range[1].into() {
        flags |= Flags::OUT_OF_RANGE;
    }
    let nothing = value != 0.0 && value.abs() < TINY;
    let value = if nothing { 0.0 } else { value };
    let above = value - f64::from(taxel.baseline);
    let (pressure, bound) = if curve.is_empty() {
        let pressure = above * f64::from(taxel.gain);
        (pressure, if is_single(&[above, pressure]) { 0.0 } else { 2.0 * U * pressure.abs() })
    } else {
        on_curve(curve, above)
    };
    if pressure.abs() > HUGE {
        return Pressure { in_doubt: pressure.abs() - HUGE <= bound, ..unusable(Flags::FAULTY_INPUT) };
    }
    let tiny = pressure != 0.0 && pressure.abs() < TINY;
    if nothing || tiny {
        flags |= Flags::FAULTY_INPUT;
    }
    let over = !tiny && pressure > taxel.dead_band.into();
    if over && pressure > taxel.p_max.into() {
        flags |= Flags::SATURATED;
    }
    let near = |threshold: f64| (pressure.abs() - threshold).abs() <= bound && bound > 0.0;
    Pressure {
        value: if over { pressure } else { 0.0 },
        status: flags.bits(),
        bound,
        in_doubt: [taxel.dead_band.into(), taxel.p_max.into(), HUGE, TINY].into_iter().any(near),
    }
}

/// Whether all are single-precision numbers.
fn is_single(numbers: &[f64]) -> bool {
    numbers.iter().all(|&x| f64::from(x as f32) == x)
}

/// c(x), and how far single precision may be off.
fn on_curve(knots: &[Knot], x: f64) -> (f64, f64) {
    let (p, steps) = interpolate(knots, x);
    let rounding = if is_single(&[x]) { 0.0 } else { U * x.abs() };
    if rounding == 0.0 && is_single(&[steps[0], steps[1], steps[2], p]) {
        return (p, 0.0);
    }
    let ends = [x - rounding, x + rounding];
    let around = ends.map(|x| interpolate(knots, x).0);
    let off = around.map(|c| (c - p).abs());
    let [low, high] = ends.map(|x| knots.partition_point(|knot| f64::from(knot.raw) <= x));
    if high == 0 || low == knots.len() {
        return (p, 0.0);
    }
    let [from, to] = [low.max(1) - 1, high.min(knots.len() - 1)].map(|knot| f64::from(knots[knot].p));
    let size = around[0].abs().max(around[1].abs());
    (p, SLACK * (off[0].max(off[1]) + 3.0 * U * (to - from).abs() + U * size))
}

/// c(x), and on the way to it x − x₀, s and their product.
fn interpolate(knots: &[Knot], x: f64) -> (f64, [f64; 3]) {
    let after = knots.partition_point(|knot| f64::from(knot.raw) <= x);
    let Some(from) = after.checked_sub(1).map(|before| knots[before]) else { return (knots[0].p.into(), [0.0; 3]) };
    let Some(to) = knots.get(after) else { return (from.p.into(), [0.0; 3]) };
    let [low, high] = [from.p, to.p].map(f64::from);
    let run = x - f64::from(from.raw);
    let slope = (high - low) / (f64::from(to.raw) - f64::from(from.raw));
    let rise = run * slope;
    if run == 0.0 {
        return (low, [0.0; 3]);
    }
    ((low + rise).clamp(low.min(high), low.max(high)), [run, slope, rise])
}

/// 2⁶⁰.
pub(crate) const HUGE: f64 = 1_152_921_504_606_846_976.0;
/// 2⁻⁶⁰.
pub(crate) const TINY: f64 = 1.0 / HUGE;

#[cfg(test)]
mod tests {
    use super::*;

    fn of(raw: f64) -> Pressure {
        reference(RawValue::new(raw), &TaxelCalibration::default(), &[])
    }

    #[test]
    fn the_thresholds_bits_are_their_values() {
        assert_eq!(f64::from(f32::from_bits(HUGE_BITS)), HUGE);
        assert_eq!(f64::from(f32::from_bits(TINY_BITS)), TINY);
    }

    #[test]
    fn without_calibration_p_is_the_raw_value() {
        assert_eq!(of(512.0), Pressure { value: 512.0, ..Pressure::default() });
        assert_eq!(of(-3.0).value, 0.0);
        assert_eq!(of(0.0).status, 0);
    }

    #[test]
    fn what_cannot_be_believed_is_left_out_or_flagged() {
        let faulty = Flags::FAULTY_INPUT.bits();
        for raw in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e39, 1e19, -1e19] {
            assert_eq!(of(raw).status, faulty | UNUSABLE, "{raw}");
        }
        for raw in [1e-19, -1e-19, 1e-45, 1e-300] {
            assert_eq!((of(raw).value, of(raw).status), (0.0, faulty), "{raw}");
        }
        let missing = reference(RawValue::MISSING, &TaxelCalibration::default(), &[]);
        assert_eq!(missing.status, Flags::INCOMPLETE.bits() | UNUSABLE);
    }

    #[test]
    fn an_inverted_sensor_rises_when_its_value_falls() {
        let taxel =
            TaxelCalibration { baseline: 250.0, gain: -1.0, dead_band: 5.0, p_max: 200.0, ..Default::default() };
        let at = |raw: f64| reference(RawValue::new(raw), &taxel, &[]);
        assert_eq!(at(240.0).value, 10.0);
        assert_eq!(at(246.0).value, 0.0);
        assert_eq!(at(252.0).value, 0.0);
        assert_eq!(at(30.0).status, Flags::SATURATED.bits());
    }

    /// What a plan makes of `curve`.
    fn table(curve: &[[f32; 2]]) -> Vec<Knot> {
        let slope = |i: usize| curve.get(i + 1).map_or(0.0, |&to| crate::signal::slope(curve[i], to) as f32);
        curve.iter().enumerate().map(|(i, &[raw, p])| Knot { raw, p, slope: slope(i) }).collect()
    }

    #[test]
    fn a_curve_is_straight_between_knots_and_held_beyond_them() {
        let knots = table(&[[0.0, 100.0], [16.0, 90.0], [20.0, 10.0], [255.0, 0.0]]);
        let taxel = TaxelCalibration { dead_band: 2.0, p_max: 95.0, raw_range: [0.0, 255.0], ..Default::default() };
        let at = |raw: f64| reference(RawValue::new(raw), &taxel, &knots);
        for (raw, p) in [(16.0, 90.0), (18.0, 50.0), (20.0, 10.0), (17.0, 70.0), (8.0, 95.0)] {
            assert_eq!(at(raw), Pressure { value: p, ..Pressure::default() }, "{raw}");
        }
        assert_eq!((at(-3.0).value, at(-3.0).bound), (100.0, 0.0));
        assert_eq!(at(-3.0).status, (Flags::SATURATED | Flags::OUT_OF_RANGE).bits());
        assert_eq!((at(300.0).value, at(300.0).status), (0.0, Flags::OUT_OF_RANGE.bits()));
        assert_eq!((at(0.0).status, at(250.0).value), (Flags::SATURATED.bits(), 0.0));
        assert_eq!(at(f64::NAN).status, Flags::FAULTY_INPUT.bits() | UNUSABLE);
        assert_eq!(at(1e19).status, Flags::FAULTY_INPUT.bits() | UNUSABLE);
        assert_eq!((at(1e-30).value, at(1e-30).status), (100.0, (Flags::FAULTY_INPUT | Flags::SATURATED).bits()));
        let between = at(100.0);
        assert!(between.bound > 0.0 && between.bound < 3.0 * 4.0 * U * 10.0, "{between:?}");
        // 10 − (raw − 20)/23.5 is at the dead band where raw is 208.
        assert!(at(208.0).in_doubt && !at(207.0).in_doubt);
    }

    #[test]
    fn what_a_difference_loses_is_in_the_bound() {
        let knots = table(&[[-1.0, 0.0], [0.0, 10.0], [1.0, 1000.0]]);
        let taxel = TaxelCalibration { baseline: 0.1, ..Default::default() };
        let p = reference(RawValue::new(1e-9), &taxel, &knots);
        // x = −0.1 to u of itself; 10 a unit below 0.
        assert!(p.bound >= 10.0 * 0.1 * U && p.bound < 10.0 * 5.0 * U, "{p:?}");
        // Across the knot the steeper side counts.
        let taxel = TaxelCalibration { baseline: 16_777_216.0, ..Default::default() };
        let far = table(&[[-16_777_216.0, 0.0], [-16_777_215.0, 1.0], [0.0, 2.0]]);
        let p = reference(RawValue::new(0.75), &taxel, &far);
        assert!((p.value - 0.75).abs() < 1e-6 && p.bound > 0.25, "{p:?}");
    }
}
