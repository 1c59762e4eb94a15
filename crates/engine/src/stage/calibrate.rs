//! **calibrate**: raw values to pressures.
//!
//! P = gain · (raw − baseline), or P = c(raw − baseline) for a taxel with a curve; 0 unless over the dead band. A value that is not finite,
//! over 2⁶⁰ in size (raw or P), or masked is left out; one under 2⁻⁶⁰ and not zero counts as 0; each puts `faulty_input` on its fields. All
//! of these are decided by the bits, because shader compilers may assume that NaN and infinity never occur.
//!
//! **Constants.** The reference takes the calibration's as they are written, in f64; `cpu` and `gpu` have each rounded once
//! to single precision. The limits of the raw range are single precision's everywhere, as raw values are.
//!
//! **Curve.** Gain and sign are in the table. Between two knots
//! c(x) = p₀ + (x − x₀) · s with s = (p₁ − p₀)/(x₁ − x₀), kept within p₀ and p₁ so that it stays monotone; before the
//! first knot and after the last it is that knot's p. The knot is found by halving.
//!
//! **Bound.** What the constants' rounding makes of P is not an estimate: P̃, the exact result with the rounded constants, is
//! worked out beside P, and |P̃ − P| is what it is (and u² of P for f64's own rounding). To this comes what the arithmetic
//! loses of P̃. On a straight line two roundings: 2u·P̃; none where difference and product are single-precision
//! numbers themselves. On a curve x̂ = x(1 + δ), |δ| ≤ u, and as c is monotone it is at most
//! max |c(x ± u|x|) − c(x)| off for that. Then s, the difference and the product round, each by u of at most
//! |p₁ − p₀|, and the sum by u|c|: 3u|p₁ − p₀| + u|c|, over all the knots that x̂ may lie between. Nothing is lost at a
//! knot, beyond the ends, and where each of these is a single-precision number. Where P lies nearer to a threshold than the
//! bound and the threshold's own rounding together, the choice is in doubt.

use super::layout::Knot;
use super::{SLACK, U};
use crate::percept::Flags;
pub(crate) use crate::signal::HUGE;
use crate::signal::{RawValue, Response, TaxelCalibration};

/// Bit of a taxel's status that leaves it out of every sum; the other bits are [`Flags`].
pub const UNUSABLE: u32 = 1 << 31;

/// 2⁶⁰ and 2⁻⁶⁰ as single-precision bits: what is beyond is unbelievable, what is below is nothing.
pub(crate) const HUGE_BITS: u32 = 0x5D80_0000;
pub(crate) const TINY_BITS: u32 = 0x2180_0000;
/// All bits but the sign.
pub(crate) const SIZE_BITS: u32 = 0x7FFF_FFFF;

/// A taxel's pressure in one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pressure {
    /// P ≥ 0.
    pub value: f64,
    /// [`Flags`] for the fields that hold it, and [`UNUSABLE`].
    pub status: u32,
    /// How far a single-precision P may be off.
    pub(crate) bound: f64,
    /// It lies so near a threshold that single precision may count it where it counts as nothing, or the other way round.
    pub(crate) in_doubt: bool,
    /// Flags of `status` that may differ.
    pub(crate) flags_in_doubt: Flags,
}

/// A taxel's curve; no knots for a straight line.
#[derive(Clone, Copy, Debug, Default)]
pub struct Table<'a> {
    /// (raw − baseline, P) as the calibration has them.
    pub(crate) written: &'a [[f64; 2]],
    /// The same in single precision.
    pub(crate) rounded: &'a [Knot],
}

/// What is right, in f64; `curve` is the taxel's.
pub fn reference(raw: RawValue, taxel: &TaxelCalibration, curve: Table<'_>) -> Pressure {
    let unusable = |flag: Flags| Pressure { status: flag.bits() | UNUSABLE, ..Pressure::default() };
    let value = match usable(raw, taxel) {
        Ok(value) => value,
        Err(flag) => return unusable(flag),
    };
    let mut flags = Flags::empty();
    if value < taxel.raw_range[0].into() || value > taxel.raw_range[1].into() {
        flags |= Flags::OUT_OF_RANGE;
    }
    let nothing = is_tiny(value);
    let value = if nothing { 0.0 } else { value };
    let pressure = response(value, taxel, curve);
    let bound = bound(value, taxel, curve.rounded, pressure);
    let near = |threshold: f64| {
        let apart = bound + (f64::from(threshold as f32) - threshold).abs();
        apart > 0.0 && (pressure - threshold).abs() <= apart
    };
    let near_in_size = |size: f64| near(size.copysign(pressure));
    let tiny = is_tiny(pressure);
    let mut flags_in_doubt = Flags::empty();
    if near_in_size(TINY) {
        flags_in_doubt |= Flags::FAULTY_INPUT;
    }
    if near_in_size(HUGE) {
        flags_in_doubt |= Flags::FAULTY_INPUT | Flags::OUT_OF_RANGE | Flags::SATURATED;
    }
    let in_doubt = near(taxel.dead_band) || near_in_size(TINY) || near_in_size(HUGE);
    if near(taxel.p_max) || (in_doubt && pressure + bound > taxel.p_max) {
        flags_in_doubt |= Flags::SATURATED;
    }
    if pressure.abs() > HUGE {
        return Pressure { in_doubt, flags_in_doubt, ..unusable(Flags::FAULTY_INPUT) };
    }
    if nothing || tiny {
        flags |= Flags::FAULTY_INPUT;
    }
    let over = !tiny && pressure > taxel.dead_band;
    if over && pressure > taxel.p_max {
        flags |= Flags::SATURATED;
    }
    Pressure { value: if over { pressure } else { 0.0 }, status: flags.bits(), bound, in_doubt, flags_in_doubt }
}

/// The number of a raw value, or why it cannot be used.
fn usable(raw: RawValue, taxel: &TaxelCalibration) -> Result<f64, Flags> {
    if raw.is_missing() {
        return Err(Flags::INCOMPLETE);
    }
    raw.number().filter(|value| !taxel.mask && value.abs() <= HUGE).ok_or(Flags::FAULTY_INPUT)
}

fn is_tiny(number: f64) -> bool {
    number != 0.0 && number.abs() < TINY
}

/// What a fit takes from a taxel: the P of [`reference`] without its bound, and σ of P.
pub(crate) struct Felt {
    pub(crate) pressure: f64,
    /// Where the noise of raw values is known.
    pub(crate) sigma: Option<f64>,
}

/// The P of [`reference`] without its bound; none where `raw` cannot be used.
pub(crate) fn pressure(raw: RawValue, taxel: &TaxelCalibration, curve: Table<'_>) -> Option<f64> {
    value_and_response(raw, taxel, curve).map(|(_, here)| over_dead_band(here, taxel))
}

/// The P and the flags of [`reference`] without a bound; P is 0 where `raw` cannot be used.
pub(crate) fn pressure_and_flags(raw: RawValue, taxel: &TaxelCalibration, curve: Table<'_>) -> (f64, Flags) {
    let value = match usable(raw, taxel) {
        Ok(value) => value,
        Err(flag) => return (0.0, flag),
    };
    let nothing = is_tiny(value);
    let here = response(if nothing { 0.0 } else { value }, taxel, curve);
    if here.abs() > HUGE {
        return (0.0, Flags::FAULTY_INPUT);
    }
    let [low, high] = taxel.raw_range.map(f64::from);
    let pressure = over_dead_band(here, taxel);
    let mut flags = Flags::empty();
    flags.set(Flags::OUT_OF_RANGE, value < low || value > high);
    flags.set(Flags::FAULTY_INPUT, nothing || is_tiny(here));
    flags.set(Flags::SATURATED, pressure > taxel.p_max);
    (pressure, flags)
}

/// The raw value that counts, and the P that it has whatever the dead band; none where `raw` cannot be used.
fn value_and_response(raw: RawValue, taxel: &TaxelCalibration, curve: Table<'_>) -> Option<(f64, f64)> {
    let value = usable(raw, taxel).ok()?;
    let value = if is_tiny(value) { 0.0 } else { value };
    let here = response(value, taxel, curve);
    (here.abs() <= HUGE).then_some((value, here))
}

fn over_dead_band(pressure: f64, taxel: &TaxelCalibration) -> f64 {
    if !is_tiny(pressure) && pressure > taxel.dead_band { pressure } else { 0.0 }
}

/// What a fit takes from a taxel that reads `raw`; none where that cannot be used.
pub(crate) fn felt(raw: RawValue, taxel: &TaxelCalibration, curve: Table<'_>) -> Option<Felt> {
    let (value, here) = value_and_response(raw, taxel, curve)?;
    let pressure = over_dead_band(here, taxel);
    let sigma = taxel.noise.map(|noise| {
        let [less, more] = [-noise, noise].map(|off| response(value + off, taxel, curve));
        sigma_between(less, here, more)
    });
    Some(Felt { pressure, sigma })
}

/// P at a raw value, whatever the dead band.
pub(crate) fn response(value: f64, taxel: &TaxelCalibration, curve: Table<'_>) -> f64 {
    let above = value - taxel.baseline;
    if curve.written.is_empty() { above * taxel.gain } else { interpolate(curve.written, |&knot| knot, above).0 }
}

/// The standard deviation of P at a raw value for that of the raw value, `noise`: on the side that is pressed more, as a
/// sensor may begin to feel with a step, or else on the other, as it may feel no more than so much.
pub(crate) fn sigma(value: f64, noise: f64, taxel: &TaxelCalibration, curve: Table<'_>) -> f64 {
    let [less, here, more] = [-noise, 0.0, noise].map(|off| response(value + off, taxel, curve));
    sigma_between(less, here, more)
}

/// The same from the P of one σ less, of the raw value and of one σ more.
fn sigma_between(less: f64, here: f64, more: f64) -> f64 {
    let (up, down) = (less.max(more) - here, here - less.min(more));
    if up > 0.0 { up } else { down }
}

/// The P up to which the taxel reads 0: its dead band, or with a curve that begins with a step, that step.
pub(crate) fn threshold(taxel: &TaxelCalibration, curve: Table<'_>) -> f64 {
    let is_step = matches!(taxel.response, Response::Fsr(_));
    let steps = curve.written.iter().filter(|_| is_step).map(|knot| knot[1]).filter(|&p| p > 0.0);
    steps
        .fold(None, |least: Option<f64>, p| Some(least.map_or(p, |least| least.min(p))))
        .unwrap_or(0.0)
        .max(taxel.dead_band)
}

/// How far single precision's P, from constants that are rounded to it, may be off `pressure`.
fn bound(value: f64, taxel: &TaxelCalibration, knots: &[Knot], pressure: f64) -> f64 {
    let above = value - f64::from(taxel.baseline as f32);
    let (rounded, lost) = if knots.is_empty() {
        let rounded = above * f64::from(taxel.gain as f32);
        (rounded, if is_single(&[above, rounded]) { 0.0 } else { 2.0 * U * rounded.abs() })
    } else {
        on_curve(knots, above)
    };
    if rounded == pressure { lost } else { lost + (rounded - pressure).abs() + U * U * pressure.abs() }
}

fn is_single(numbers: &[f64]) -> bool {
    numbers.iter().all(|&x| f64::from(x as f32) == x)
}

/// (raw, P) of a knot.
fn of_knot(knot: &Knot) -> [f64; 2] {
    [knot.raw.into(), knot.p.into()]
}

/// c(x), and how far single precision may be off.
fn on_curve(knots: &[Knot], x: f64) -> (f64, f64) {
    let (p, steps) = interpolate(knots, of_knot, x);
    let rounding = if is_single(&[x]) { 0.0 } else { U * x.abs() };
    if rounding == 0.0 && is_single(&[steps[0], steps[1], steps[2], p]) {
        return (p, 0.0);
    }
    let ends = [x - rounding, x + rounding];
    let around = ends.map(|x| interpolate(knots, of_knot, x).0);
    let off = around.map(|c| (c - p).abs());
    let [low, high] = ends.map(|x| knots.partition_point(|knot| f64::from(knot.raw) <= x));
    if high == 0 || low == knots.len() {
        return (p, 0.0);
    }
    let [from, to] = [low.max(1) - 1, high.min(knots.len() - 1)].map(|knot| f64::from(knots[knot].p));
    let size = around[0].abs().max(around[1].abs());
    (p, SLACK * (off[0].max(off[1]) + 3.0 * U * (to - from).abs() + U * size))
}

/// c(x), and on the way to it x − x₀, s and their product; `of` gives a knot's (raw, P).
fn interpolate<K>(knots: &[K], of: impl Fn(&K) -> [f64; 2], x: f64) -> (f64, [f64; 3]) {
    let after = knots_up_to(knots, |knot| of(knot)[0], x);
    let Some([start, low]) = after.checked_sub(1).map(|before| of(&knots[before])) else {
        return (of(&knots[0])[1], [0.0; 3]);
    };
    let Some([end, high]) = knots.get(after).map(of) else { return (low, [0.0; 3]) };
    let run = x - start;
    let slope = (high - low) / (end - start);
    let rise = run * slope;
    if run == 0.0 {
        return (low, [0.0; 3]);
    }
    ((low + rise).clamp(low.min(high), low.max(high)), [run, slope, rise])
}

/// How many of `knots` lie up to x; `raw` gives a knot's place. Most sensors' tables have evenly spaced
/// knots: the search for x begins where it would then be.
fn knots_up_to<K>(knots: &[K], raw: impl Fn(&K) -> f64, x: f64) -> usize {
    let last = knots.len() - 1;
    let (from, to) = (raw(&knots[0]), raw(&knots[last]));
    if x >= to {
        return knots.len();
    }
    // Below the first knot, and of what is not a number, 0.
    let guess = ((x - from) * (last as f64 / (to - from))) as usize;
    let is_there = guess < last && raw(&knots[guess]) <= x && x < raw(&knots[guess + 1]);
    if is_there { guess + 1 } else { knots.partition_point(|knot| raw(knot) <= x) }
}

/// 2⁻⁶⁰.
pub(crate) const TINY: f64 = 1.0 / HUGE;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pressures_and_flags_are_the_references_without_bounds() {
        let plain = TaxelCalibration {
            baseline: 10.0,
            gain: 0.5,
            dead_band: 2.0,
            raw_range: [0.0, 100.0],
            p_max: 30.0,
            ..Default::default()
        };
        let masked = TaxelCalibration { mask: true, ..plain };
        let numbers = (-400..400).map(|i| RawValue::new(f64::from(i) * 0.3));
        let odd = [RawValue::MISSING, RawValue::FAULTY, RawValue::new(1e-30), RawValue::new(1e30), RawValue::new(10.0)];
        let mut seen = [0; 2];
        for raw in numbers.chain(odd) {
            for taxel in [plain, masked, TaxelCalibration { gain: -0.5, ..plain }] {
                let (pressure, flags) = pressure_and_flags(raw, &taxel, Table::default());
                let right = reference(raw, &taxel, Table::default());
                assert_eq!((pressure, flags.bits()), (right.value, right.status & !UNUSABLE), "{raw:?} {right:?}");
                seen[usize::from(right.value == 0.0 && right.status == 0)] += 1;
            }
        }
        assert!(seen.iter().all(|&count| count > 50), "{seen:?}");
    }

    #[test]
    fn the_thresholds_bits_are_their_values() {
        assert_eq!(f64::from(f32::from_bits(HUGE_BITS)), HUGE);
        assert_eq!(f64::from(f32::from_bits(TINY_BITS)), TINY);
    }

    /// What a plan makes of a curve.
    struct Knots {
        written: Vec<[f64; 2]>,
        rounded: Vec<Knot>,
    }

    impl Knots {
        fn table(&self) -> Table<'_> {
            Table { written: &self.written, rounded: &self.rounded }
        }
    }

    fn knots_of(written: &[[f64; 2]]) -> Knots {
        let curve: Vec<[f32; 2]> = written.iter().map(|knot| knot.map(|x| x as f32)).collect();
        let slope = |i: usize| curve.get(i + 1).map_or(0.0, |&to| crate::signal::slope(curve[i], to) as f32);
        let rounded = curve.iter().enumerate().map(|(i, &[raw, p])| Knot { raw, p, slope: slope(i) }).collect();
        Knots { written: written.to_vec(), rounded }
    }

    /// What the backends compute, a rounding at a time, without a curve.
    fn single(raw: f32, taxel: &TaxelCalibration) -> f32 {
        let pressure = (raw - taxel.baseline as f32) * taxel.gain as f32;
        if pressure > taxel.dead_band as f32 { pressure } else { 0.0 }
    }

    #[test]
    fn a_gain_counts_as_it_is_written_and_its_rounding_is_in_the_bound() {
        let taxel = TaxelCalibration { gain: 0.1, dead_band: 1.0, ..Default::default() };
        let at = |raw: f64| reference(RawValue::new(raw), &taxel, Table::default());
        // 0.1 · 10 is 1, which is not over 1; 0.1 in single precision is more than a tenth.
        assert_eq!((at(10.0).value, single(10.0, &taxel)), (0.0, 0.0));
        assert!(at(10.0).in_doubt && !at(9.0).in_doubt && !at(11.0).in_doubt);
        for raw in 11..5000_u16 {
            let right = at(raw.into());
            assert_eq!(right.value, f64::from(raw) * 0.1);
            let off = (f64::from(single(raw.into(), &taxel)) - right.value).abs();
            // The gain's rounding by a quarter of u and two more; not a wide net either.
            assert!(off <= right.bound && right.bound <= 3.0 * U * right.value, "{raw}: {off} {right:?}");
        }
        // A baseline of a tenth, and a value near it: without the constants' part the bound would not hold.
        let taxel = TaxelCalibration { baseline: 0.1, gain: 0.7, ..Default::default() };
        let right = reference(RawValue::new(0.1001), &taxel, Table::default());
        let off = (f64::from(single(0.1001, &taxel)) - right.value).abs();
        assert!(off > 2.0 * U * right.value && off <= right.bound, "{off} {right:?}");
    }

    #[test]
    fn a_threshold_counts_as_it_is_written() {
        let third = 1.0 / 3.0;
        for (taxel, flags) in [
            (TaxelCalibration { dead_band: third, ..Default::default() }, Flags::empty()),
            (TaxelCalibration { baseline: third, ..Default::default() }, Flags::FAULTY_INPUT),
            (TaxelCalibration { p_max: third, ..Default::default() }, Flags::SATURATED),
        ] {
            // The single-precision number next to a third is over it.
            let right = reference(RawValue::new(third), &taxel, Table::default());
            assert!(right.value > 0.0 && (right.in_doubt || taxel.p_max == third), "{taxel:?}: {right:?}");
            assert_eq!(right.flags_in_doubt, flags, "{taxel:?}");
            let clear = reference(RawValue::new(0.334), &taxel, Table::default());
            assert!(!clear.in_doubt && clear.flags_in_doubt.is_empty(), "{taxel:?}: {clear:?}");
        }
    }

    #[test]
    fn a_curve_counts_as_it_is_written() {
        let knots = knots_of(&[[0.1, 0.3], [0.7, 1.1], [2.3, 7.7]]);
        let taxel = TaxelCalibration::default();
        for raw in (1..2300_u16).map(|raw| f64::from(raw) / 1000.0) {
            let right = reference(RawValue::new(raw), &taxel, knots.table());
            let raw = f64::from(raw as f32);
            let written = interpolate(&knots.written, |&knot| knot, raw).0;
            assert_eq!(right.value, written);
            let of_rounded = on_curve(&knots.rounded, raw);
            let most = of_rounded.1 + (of_rounded.0 - written).abs() + U * U * written;
            assert!(right.bound >= (of_rounded.0 - written).abs() && right.bound <= most, "{raw}: {right:?}");
        }
    }

    #[test]
    fn a_knot_is_found_wherever_knots_lie() {
        let even: Vec<f64> = (0..=8).map(|i| 0.1 * f64::from(i)).collect();
        for knots in [&even[..], &[-7.0, 0.0, 0.5, 90.0], &[2.0, 2.0, 3.0, 3.0, 4.0], &[1.0, 1.0], &[5.0]] {
            let beside = knots.iter().flat_map(|x| [x.next_down(), *x, x.next_up(), x + 0.05]);
            for x in beside.chain([f64::NEG_INFINITY, f64::INFINITY, f64::NAN]) {
                assert_eq!(knots_up_to(knots, |&knot| knot, x), knots.partition_point(|&knot| knot <= x), "{x}");
            }
        }
    }

    #[test]
    fn beyond_a_curve_nothing_is_lost_and_between_its_knots_little() {
        let knots = knots_of(&[[0.0, 100.0], [16.0, 90.0], [20.0, 10.0], [255.0, 0.0]]);
        let taxel = TaxelCalibration { dead_band: 2.0, ..Default::default() };
        let at = |raw: f64| reference(RawValue::new(raw), &taxel, knots.table());
        for (raw, p) in [(-3.0, 100.0), (16.0, 90.0), (18.0, 50.0), (20.0, 10.0), (17.0, 70.0), (8.0, 95.0)] {
            assert_eq!(at(raw), Pressure { value: p, ..Pressure::default() }, "{raw}");
        }
        let between = at(100.0);
        assert!(between.bound > 0.0 && between.bound < 3.0 * 4.0 * U * 10.0, "{between:?}");
        // 10 − (raw − 20)/23.5 is at the dead band where raw is 208.
        assert!(at(208.0).in_doubt && !at(207.0).in_doubt);
    }

    #[test]
    fn what_a_difference_loses_is_in_the_bound() {
        let knots = knots_of(&[[-1.0, 0.0], [0.0, 10.0], [1.0, 1000.0]]);
        let taxel = TaxelCalibration { baseline: 0.1, ..Default::default() };
        let p = reference(RawValue::new(1e-9), &taxel, knots.table());
        // x = −0.1 to u of itself; 10 a unit below 0.
        assert!(p.bound >= 10.0 * 0.1 * U && p.bound < 10.0 * 5.0 * U, "{p:?}");
        // Across the knot the steeper side counts.
        let taxel = TaxelCalibration { baseline: 16_777_216.0, ..Default::default() };
        let far = knots_of(&[[-16_777_216.0, 0.0], [-16_777_215.0, 1.0], [0.0, 2.0]]);
        let p = reference(RawValue::new(0.75), &taxel, far.table());
        assert!((p.value - 0.75).abs() < 1e-6 && p.bound > 0.25, "{p:?}");
    }

    #[test]
    fn a_fit_takes_the_pressures_of_the_reference() {
        let knots = knots_of(&[[0.0, 100.0], [16.0, 90.0], [20.0, 10.0], [255.0, 0.0]]);
        let plain =
            TaxelCalibration { baseline: 3.0, gain: 0.5, dead_band: 2.0, noise: Some(1.5), ..Default::default() };
        let masked = TaxelCalibration { mask: true, ..plain };
        let curve = TaxelCalibration { dead_band: 2.0, noise: Some(1.0), ..Default::default() };
        let raws = [-2.0, 0.0, 1e-30, 3.0, 7.0, 7.1, 16.0, 19.5, 208.0, 1e17, 1e30, f64::NAN, f64::INFINITY];
        let mut compared = 0;
        for (taxel, table) in [(&plain, Table::default()), (&masked, Table::default()), (&curve, knots.table())] {
            for raw in raws.map(RawValue::new).into_iter().chain([RawValue::MISSING]) {
                let right = reference(raw, taxel, table);
                let felt = felt(raw, taxel, table);
                assert_eq!(felt.is_some(), right.status & UNUSABLE == 0, "{raw:?}");
                if let (Some(felt), Some(number), Some(noise)) = (felt, raw.number(), taxel.noise) {
                    let number = if is_tiny(number) { 0.0 } else { number };
                    let sigma = Some(sigma(number, noise, taxel, table));
                    assert_eq!((felt.pressure, felt.sigma), (right.value, sigma), "{raw:?}");
                    compared += 1;
                }
            }
        }
        assert_eq!(compared, 20);
    }
}
