//! What a taxel with three axes feels along the skin: s along t and n × t, of its P and two raw values.
//!
//! With C the `cross_axis` of the calibration, g the gains and r the raw values at rest, s = C (P, gᵤ(u − rᵤ), gᵥ(v − rᵥ))ᵀ. P is what was
//! measured along the normal: what a soft onset takes off is added again. s is known where the taxel is pressed and both raw
//! values are numbers in their range.

use crate::percept::{Flags, TouchFlags};
use crate::signal::{RawValue, ShearCalibration, TaxelCalibration};
use crate::stage::calibrate::HUGE;

/// What a taxel feels along the skin.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Tangential {
    /// s along t and n × t, in the unit of P.
    pub(crate) forces: [f64; 2],
    /// What they are made of, sizes added up: their rounding is a share of that.
    pub(crate) size: f64,
}

/// Why s is not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unknown {
    Missing,
    Faulty,
    OutOfRange,
}

impl From<Unknown> for Flags {
    fn from(why: Unknown) -> Self {
        match why {
            Unknown::Missing => Self::INCOMPLETE,
            Unknown::Faulty => Self::FAULTY_INPUT,
            Unknown::OutOfRange => Self::OUT_OF_RANGE,
        }
    }
}

impl From<Unknown> for TouchFlags {
    fn from(why: Unknown) -> Self {
        match why {
            Unknown::Missing => Self::INCOMPLETE,
            Unknown::Faulty => Self::FAULTY_INPUT,
            Unknown::OutOfRange => Self::OUT_OF_RANGE,
        }
    }
}

/// How a taxel's two tangential raw values are read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sides {
    /// P for a raw unit of each.
    gains: [f64; 2],
    /// At rest.
    rest: [f64; 2],
    /// Of those that are believed.
    range: [f64; 2],
    /// What a soft onset has taken off P, which the sensor has measured all the same.
    taken_off: f64,
    /// How much of both forces P makes, and a raw unit of each: sizes added up.
    sizes: [f64; 3],
    /// Standard deviation of each raw value, where it is given.
    noise: Option<f64>,
}

impl Sides {
    /// Those of the body's taxel `taxel`, from whose P `taken_off` is taken.
    pub(crate) fn of(by: &ShearCalibration, taxel: usize, (calibration, taken_off): (&TaxelCalibration, f64)) -> Self {
        let gains = by.gains_of(taxel, calibration.gain, calibration.unit_factor);
        let [along, across] = by.cross_axis;
        let shares = [0, 1, 2].map(|of| along[of].abs() + across[of].abs());
        let sizes = [shares[0], shares[1] * gains[0].abs(), shares[2] * gains[1].abs()];
        let noise = by.noise_of(taxel).or(calibration.noise);
        Self { gains, rest: by.rest_of(taxel), range: by.range_of(taxel), taken_off, sizes, noise }
    }

    /// What the taxel feels, pressed by P > 0 and with these `raw` values. What is beyond 2⁶⁰ is not believed, as of P.
    pub(crate) fn read(&self, by: &ShearCalibration, pressure: f64, raw: [RawValue; 2]) -> Result<Tangential, Unknown> {
        let ([u, v], [low, high]) = (numbers_of(raw)?, self.range);
        if [u, v].iter().any(|number| !(low..=high).contains(number)) {
            return Err(Unknown::OutOfRange);
        }
        let measured = pressure + self.taken_off;
        let forces = by.forces(self.rest, self.gains, measured, [u, v]);
        let [of_p, of_u, of_v] = self.sizes;
        let size = of_p * measured + of_u * (u.abs() + self.rest[0].abs()) + of_v * (v.abs() + self.rest[1].abs());
        let is_believed = forces.iter().all(|force| force.abs() <= HUGE);
        if is_believed { Ok(Tangential { forces, size }) } else { Err(Unknown::Faulty) }
    }

    /// The standard deviations of gᵤu and gᵥv, in the unit of P, where that of the raw values is known.
    pub(crate) fn noise(&self) -> Option<[f64; 2]> {
        self.noise.map(|noise| self.gains.map(|gain| gain.abs() * noise))
    }
}

/// The numbers of two tangential raw values.
fn numbers_of(raw: [RawValue; 2]) -> Result<[f64; 2], Unknown> {
    match raw.map(|raw| raw.number().filter(|number| number.abs() <= HUGE)) {
        [Some(u), Some(v)] => Ok([u, v]),
        _ if raw.iter().any(|raw| raw.is_missing()) => Err(Unknown::Missing),
        _ => Err(Unknown::Faulty),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn raw_values_are_read_about_their_rest_and_mixed() {
        let by = ShearCalibration {
            baselines: [100.0, -50.0],
            gain: Some([0.5, 2.0]),
            cross_axis: [[0.1, 1.0, 0.0], [0.0, 0.25, 1.0]],
            raw_range: [-200.0, 200.0],
            ..ShearCalibration::default()
        };
        let sides = Sides::of(&by, 0, (&TaxelCalibration::default(), 0.5));
        let read = |u: f64, v: f64| sides.read(&by, 3.5, [RawValue::new(u), RawValue::new(v)]);
        let felt = read(108.0, -52.0).unwrap();
        // P is 4 with what the onset took, gᵤ(u − rᵤ) is 4 and gᵥ(v − rᵥ) is −4.
        assert!((felt.forces[0] - 4.4).abs() < 1e-15 && (felt.forces[1] + 3.0).abs() < 1e-15, "{felt:?}");
        let size = 0.1 * 4.0 + 1.25 * 0.5 * (108.0 + 100.0) + 2.0 * (52.0 + 50.0);
        assert!((felt.size - size).abs() < 1e-12, "{felt:?}");
        assert_eq!(read(201.0, 0.0), Err(Unknown::OutOfRange));
        assert_eq!(read(f64::NAN, 0.0), Err(Unknown::Faulty));
        assert_eq!(read(f64::NAN, 201.0), Err(Unknown::Faulty));
        let missing = [RawValue::MISSING, RawValue::new(f64::NAN)];
        assert_eq!(sides.read(&by, 3.5, missing), Err(Unknown::Missing));
    }

    #[test]
    fn noise_is_the_sides_own_or_that_of_the_normal_value() {
        let noisy = TaxelCalibration { noise: Some(2.0), ..TaxelCalibration::default() };
        let of = |by: &ShearCalibration, calibration: &TaxelCalibration| Sides::of(by, 0, (calibration, 0.0)).noise();
        let plain = ShearCalibration { gain: Some([-0.5, 3.0]), ..ShearCalibration::default() };
        assert_eq!(of(&plain, &TaxelCalibration::default()), None);
        assert_eq!(of(&plain, &noisy), Some([1.0, 6.0]));
        assert_eq!(of(&ShearCalibration { noise: Some(0.1), ..plain }, &noisy), Some([0.05, 0.30000000000000004]));
    }
}
