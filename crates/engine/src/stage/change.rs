//! **change**: how fast single taxels' pressures change, the letter of what adapts rapidly.
//!
//! C = |P − P′| / Δt, in P per second, with P′ the pressure of the frame before; 0 unless over the dead band that the
//! calibration gives changes. P′ is the *raw value* of the frame before under the *present* calibration: when drift compensation moves
//! a baseline between two frames, or judges a taxel anew, nothing has touched the robot, and nothing changes.
//!
//! * No frame before: every taxel is left out, and its fields flagged `no_previous`. A Δt that cannot be used: the same,
//!   `bad_dt`.
//! * P or P′ is left out: so is C, and the fields bear the flags of both frames.
//! * C over 2⁶⁰ is left out, `faulty_input`, as a pressure is; under 2⁻⁶⁰ it counts as 0. Both by the bits.
//!
//! This stage stands between calibrate and contact: to what follows, a change is a pressure.
//!
//! **Bound.** Equal raw values give equal pressures on every backend, and then C is exactly 0. Else P and P′ are off by
//! their own bounds b and b′, which the difference keeps whole, however small it is; the difference and Δt round, u each,
//! and the quotient is good to 5u: |δC| ≤ (b + b′)/Δt + 7u·C. A pressure that is 0 with no doubt is off by nothing.

use super::calibrate::{HUGE, Pressure, TINY, UNUSABLE};
use super::{DIVISION, SLACK, U};
use crate::percept::Flags;
use crate::signal::RawValue;

/// A taxel in one frame: its raw value and its pressure.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Heard {
    pub(crate) raw: RawValue,
    pub(crate) pressure: Pressure,
}

/// What is right, in f64: the change from `before` to `now` over `dt_s`, with its bound. `unusable` is why that time
/// cannot be used, empty when it can.
pub(crate) fn reference(now: Heard, before: Heard, dt_s: f64, unusable: Flags, dead_band: f64) -> Pressure {
    let (now, before, same) = (now.pressure, before.pressure, now.raw == before.raw);
    if !unusable.is_empty() {
        let status = now.status | unusable.bits() | UNUSABLE;
        return Pressure { status, flags_in_doubt: now.flags_in_doubt, ..Pressure::default() };
    }
    let status = now.status | before.status;
    let in_doubt = now.in_doubt || before.in_doubt;
    let mut flags_in_doubt = now.flags_in_doubt | before.flags_in_doubt;
    if same || status & UNUSABLE != 0 {
        return Pressure { status, in_doubt, flags_in_doubt, ..Pressure::default() };
    }
    let change = (now.value - before.value).abs() / dt_s;
    let off = |pressure: Pressure| if pressure.value > 0.0 { pressure.bound } else { 0.0 };
    let inexact = off(now) + off(before);
    // A division of 0 is exact; all else rounds.
    let rounding = (2.0 * U + DIVISION) * change;
    let bound = SLACK * (inexact / dt_s + rounding);
    let near = |threshold: f64| {
        let apart = bound + (f64::from(threshold as f32) - threshold).abs();
        apart > 0.0 && (change - threshold).abs() <= apart
    };
    let in_doubt = in_doubt || [dead_band, HUGE, TINY].into_iter().any(near);
    if near(HUGE) {
        flags_in_doubt |= Flags::all();
    }
    if change > HUGE {
        return Pressure {
            status: Flags::FAULTY_INPUT.bits() | UNUSABLE,
            in_doubt,
            flags_in_doubt,
            ..Pressure::default()
        };
    }
    let over = change >= TINY && change > dead_band;
    Pressure { value: if over { change } else { 0.0 }, status, bound, in_doubt, flags_in_doubt }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::TaxelCalibration;
    use crate::stage::calibrate::{self, Table};

    fn heard(raw: RawValue, taxel: &TaxelCalibration) -> Heard {
        Heard { raw, pressure: calibrate::reference(raw, taxel, Table::default()) }
    }

    /// From raw value `before` to `now` in `dt_s`.
    fn change(before: f64, now: f64, dt_s: f64) -> Pressure {
        let [before, now] = [before, now].map(|raw| heard(RawValue::new(raw), &TaxelCalibration::default()));
        reference(now, before, dt_s, Flags::empty(), 0.0)
    }

    #[test]
    fn onset_and_release_are_alike_and_a_hold_is_nothing() {
        assert_eq!(change(0.0, 100.0, 0.5).value, 200.0);
        assert_eq!(change(100.0, 0.0, 0.5).value, 200.0);
        assert_eq!(change(100.0, 100.0, 0.5), Pressure::default());
        // Below nothing there is nothing: P is never negative.
        assert_eq!(change(-50.0, -20.0, 0.5), Pressure::default());
        assert_eq!(change(-50.0, 20.0, 0.5).value, 40.0);
    }

    #[test]
    fn what_is_unknown_is_left_out_with_its_reason() {
        let taxel = TaxelCalibration { raw_range: [0.0, 500.0], ..TaxelCalibration::default() };
        let [one, over] = [1.0, 600.0].map(|raw| heard(RawValue::new(raw), &taxel));
        let missing = heard(RawValue::MISSING, &taxel);
        let status = |now, before, unusable| reference(now, before, 0.5, unusable, 0.0).status;
        assert_eq!(status(one, missing, Flags::NO_PREVIOUS), Flags::NO_PREVIOUS.bits() | UNUSABLE);
        assert_eq!(status(over, one, Flags::BAD_DT), (Flags::BAD_DT | Flags::OUT_OF_RANGE).bits() | UNUSABLE);
        let none = Flags::empty();
        assert_eq!(status(one, missing, none), Flags::INCOMPLETE.bits() | UNUSABLE);
        assert_eq!(status(missing, one, none), Flags::INCOMPLETE.bits() | UNUSABLE);
        assert_eq!(status(one, over, none), Flags::OUT_OF_RANGE.bits());
        assert_eq!(change(0.0, 1e18, 1e-6).status, Flags::FAULTY_INPUT.bits() | UNUSABLE);
        assert_eq!((change(0.0, 1e-17, 1e3).value, change(0.0, 1e-17, 1e3).status), (0.0, 0));
    }

    #[test]
    fn small_changes_are_below_the_dead_band() {
        let [low, high] = [100.0, 110.0].map(|raw| heard(RawValue::new(raw), &TaxelCalibration::default()));
        let at = |dead_band| reference(high, low, 0.5, Flags::empty(), dead_band);
        assert_eq!([at(0.0).value, at(19.0).value, at(21.0).value], [20.0, 20.0, 0.0]);
        assert!(at(20.0).in_doubt && !at(19.0).in_doubt && !at(21.0).in_doubt);
    }

    #[test]
    fn what_cancels_is_in_the_bound() {
        let taxel = TaxelCalibration { gain: 0.1, ..TaxelCalibration::default() };
        let [low, high] = [1000.0, 1001.0].map(|raw| heard(RawValue::new(raw), &taxel));
        let right = reference(high, low, 0.01, Flags::empty(), 0.0);
        // 10 P per second; the pressures around 100 may each be off by 2u of that.
        assert!((right.value - 10.0).abs() < 1e-6 && right.bound > 2.0 * 2.0 * U * 100.0 / 0.01, "{right:?}");
        // Single precision does lose that much: a good part of what the quotient's rounding alone would allow is passed.
        let single = (1001.0_f32 * 0.1 - 1000.0_f32 * 0.1) / 0.01;
        let off = (f64::from(single) - right.value).abs();
        assert!(off <= right.bound && off > SLACK * 7.0 * U * right.value, "{off} {right:?}");
        // Less than the bound is as good as nothing, unless nothing came in.
        let [one, same] = [1.0e6, 1.0e6 + 0.0625].map(|raw| heard(RawValue::new(raw), &taxel));
        assert!(reference(same, one, 0.01, Flags::empty(), 0.0).in_doubt);
        assert!(!reference(one, one, 0.01, Flags::empty(), 0.0).in_doubt);
    }
}
