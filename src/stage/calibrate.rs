//! **calibrate**: raw values to pressures.
//!
//! P = gain · (raw − baseline), 0 unless over the dead band. A value that is not finite, over 2⁶⁰ in size (raw or P), or
//! masked is left out; one under 2⁻⁶⁰ and not zero counts as 0; each puts `faulty_input` on its fields. All of these are
//! decided by the bits, because shader compilers may assume that NaN and infinity never occur.
//!
//! **Bound.** Two roundings: |δP| ≤ 2u·P; none where difference and product are single-precision numbers themselves.

use super::U;
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

/// What is right, in f64.
pub(crate) fn reference(raw: RawValue, taxel: &TaxelCalibration) -> Pressure {
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
    let pressure = above * f64::from(taxel.gain);
    let exact = [above, pressure].iter().all(|&x| f64::from(x as f32) == x);
    let bound = if exact { 0.0 } else { 2.0 * U * pressure.abs() };
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

/// 2⁶⁰.
const HUGE: f64 = 1_152_921_504_606_846_976.0;
/// 2⁻⁶⁰.
const TINY: f64 = 1.0 / HUGE;

#[cfg(test)]
mod tests {
    use super::*;

    fn of(raw: f64) -> Pressure {
        reference(RawValue::new(raw), &TaxelCalibration::default())
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
        let missing = reference(RawValue::MISSING, &TaxelCalibration::default());
        assert_eq!(missing.status, Flags::INCOMPLETE.bits() | UNUSABLE);
    }

    #[test]
    fn an_inverted_sensor_rises_when_its_value_falls() {
        let taxel =
            TaxelCalibration { baseline: 250.0, gain: -1.0, dead_band: 5.0, p_max: 200.0, ..Default::default() };
        let at = |raw: f64| reference(RawValue::new(raw), &taxel);
        assert_eq!(at(240.0).value, 10.0);
        assert_eq!(at(246.0).value, 0.0);
        assert_eq!(at(252.0).value, 0.0);
        assert_eq!(at(30.0).status, Flags::SATURATED.bits());
    }
}
