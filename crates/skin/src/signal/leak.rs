//! What of the forces along the skin is in the normal values of taxels with three axes, by the first row of their calibration's
//! `cross_axis`.
//!
//! The row [a, b, c] says that P is a·N + b·u + c·v, with N, u and v what is measured along the three axes, in the unit of P. Raw values
//! are corrected for that before any backend reads them, so that all compute of the same bits: with g the gains,
//! raw′ = raw + (a − 1)(raw − rest) + (b·u + c·v)/gₙ. A term whose value is not known is left out, which is noted.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::calibration::{Calibration, TaxelCalibration};
use super::frame::RawValue;
use super::response::Response;
use super::sense::{HUGE, Reading};
use crate::body::{Body, Modality};
use crate::error::{Result, failed};

/// What is added to a taxel's raw normal value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Leak {
    /// Raw values at rest, along n, t and n × t.
    rest: [f64; 3],
    /// The range of raw normal values; others count, too, but are noted.
    range: [f64; 2],
    /// Of raw tangential values that are believed.
    side_range: [f64; 2],
    /// For a raw unit of each from rest, raw units of the normal value.
    shares: [f64; 3],
}

impl Leak {
    /// The raw normal value `raw` as it is without what `sides`, those along t and n × t, have put into it, as far as these are known.
    /// Reports what is wrong with values that count in it to `note`.
    pub(super) fn corrected(&self, raw: RawValue, sides: [RawValue; 2], mut note: impl FnMut(Reading)) -> RawValue {
        let Some(normal) = believed(raw) else { return raw };
        let is_within = |[low, high]: [f64; 2], number: f64| (low..=high).contains(&number);
        if !is_within(self.range, normal) {
            note(Reading::Value(normal, false));
        }
        let mut sum = normal + self.shares[0] * (normal - self.rest[0]);
        for (side, axis) in sides.into_iter().zip(1..).filter(|&(_, axis)| self.shares[axis] != 0.0) {
            match believed(side) {
                Some(number) if is_within(self.side_range, number) => {
                    sum += self.shares[axis] * (number - self.rest[axis]);
                }
                Some(number) => note(Reading::Value(number, false)),
                None if side.is_missing() => note(Reading::Missing),
                None => note(Reading::Faulty),
            }
        }
        RawValue::new(sum)
    }

    /// Whether the raw normal value `raw` is at an end of its range, or beyond it.
    pub(super) fn is_at_end(&self, raw: RawValue) -> bool {
        let [low, high] = self.range;
        believed(raw).is_some_and(|normal| normal <= low || normal >= high)
    }

    /// The standard deviation of a corrected value, where that of a normal one is `noise` and of a tangential one `of_sides`, raw units.
    fn noise(&self, noise: f64, of_sides: f64) -> f64 {
        let [of_normal, of_u, of_v] = self.shares;
        libm::hypot((1.0 + of_normal) * noise, libm::hypot(of_u, of_v) * of_sides)
    }
}

/// A taxel whose normal value is corrected.
#[derive(Clone, Debug)]
pub(super) struct Corrected {
    pub(super) leak: Leak,
    /// Its channels: its own, and those along t and n × t.
    pub(super) channels: [usize; 3],
    /// Where the last two are in a frame.
    pub(super) places: [Option<usize>; 2],
}

/// The number of `raw`, unless it is too large for one.
fn believed(raw: RawValue) -> Option<f64> {
    raw.number().filter(|number| number.abs() <= HUGE)
}

impl Calibration {
    /// What is added to the raw normal value of the taxel at `index`, if it has three axes.
    pub(super) fn leak_of(&self, index: usize) -> Option<Leak> {
        let own: &TaxelCalibration = &self.taxels[index];
        if !self.shear.leaks_into_normal() || own.mask || own.response != Response::Linear {
            return None;
        }
        let ([of_normal, of_u, of_v], rest) = (self.shear.into_normal, self.shear.rest_of(index));
        let [gain_u, gain_v] = self.shear.gains_of(index, own.gain, own.unit_factor);
        Some(Leak {
            rest: [own.baseline, rest[0], rest[1]],
            range: own.raw_range.map(f64::from),
            side_range: self.shear.range_of(index),
            shares: [of_normal - 1.0, of_u * gain_u / own.gain, of_v * gain_v / own.gain],
        })
    }

    /// Refuses a taxel with three axes at `index`, whose id is `id`, where its normal value cannot be corrected: with a curve a share of
    /// its P is no fixed number of raw units.
    ///
    /// # Errors
    /// It has a curve or is an FSR, and the first row of `cross_axis` has something to correct.
    pub fn check_leak(&self, index: usize, id: u32) -> Result<()> {
        let own = &self.taxels[index];
        if !self.shear.leaks_into_normal() || own.mask || own.response == Response::Linear {
            return Ok(());
        }
        Err(failed!(
            "`cross_axis` in [shear] corrects normal forces, which taxel {id} has by a curve or as an FSR; give two rows"
        ))
    }

    /// The same for raw normal values of taxels with three axes once they are corrected: with the noise that they then have, and without
    /// their `raw_range`, which is of what is measured: [`Intake`](super::Intake) compares values with it.
    #[must_use]
    pub fn of_corrected(&self, body: &Body) -> Cow<'_, Self> {
        if !self.shear.leaks_into_normal() {
            return Cow::Borrowed(self);
        }
        let mut all = self.clone();
        for index in (0..self.taxels.len()).filter(|&index| body.taxels[index].modality == Modality::Force3) {
            let Some(leak) = self.leak_of(index) else { continue };
            all.taxels[index].raw_range = TaxelCalibration::default().raw_range;
            if let Some(noise) = self.taxels[index].noise {
                let of_sides = self.shear.noise_of(index).unwrap_or(noise);
                all.taxels[index].noise = Some(leak.noise(noise, of_sides));
                all.shear.own_noises.insert(index, of_sides);
            }
        }
        Cow::Owned(all)
    }
}

/// The taxels whose channels are of all three axes and whose normal values have something of the others in them.
pub(super) fn corrected(calibration: &Calibration, taxel_of_channel: &[usize]) -> Vec<Corrected> {
    if !calibration.shear.leaks_into_normal() {
        return Vec::new();
    }
    let mut sides_of: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (channel, &taxel) in taxel_of_channel.iter().enumerate().skip(calibration.taxels.len()) {
        sides_of.entry(taxel).or_default().push(channel);
    }
    let made = sides_of.into_iter().filter_map(|(taxel, sides)| match sides[..] {
        [u, v] => Some(Corrected { leak: calibration.leak_of(taxel)?, channels: [taxel, u, v], places: [None; 2] }),
        _ => None,
    });
    made.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Sheet, SheetCell, sheets};

    #[test]
    fn a_corrected_value_has_the_noise_of_all_three() {
        let cells =
            [1, 2].map(|id: u32| SheetCell::rectangle(id, [0.01 * f64::from(id), 0.0], 0.01, 0.01).with_axes(id == 1));
        let bytes = sheets(&[Sheet::new("pad", cells.to_vec())]).unwrap().to_bytes().unwrap();
        let body = Body::from_bytes("pad", &bytes).unwrap();
        let read = |row: &str| {
            let text = format!(
                "[all]\ngain = 2\nnoise = 3\nraw_range = [0, 9]\n[shear]\ngain = [4, 1]\ncross_axis = [{row}[0, 1, 0], [0, 0, 1]]\n"
            );
            Calibration::parse(&text, &[1, 2]).unwrap()
        };
        let leaking = read("[2, 1, -1], ");
        let with = leaking.of_corrected(&body);
        // P = 2·2·raw + 4u − v: of a normal value (2·3)² + (2·3)² + (0.5·3)².
        assert!((with.taxels[0].noise.unwrap() - 74.25_f64.sqrt()).abs() < 1e-12, "{:?}", with.taxels[0].noise);
        assert_eq!((with.taxels[1].noise, with.shear.noise_of(0)), (Some(3.0), Some(3.0)));
        let all = TaxelCalibration::default().raw_range;
        assert_eq!([0, 1].map(|taxel| with.taxels[taxel].raw_range), [all, [0.0, 9.0]]);
        let alone = read("");
        assert!(matches!(alone.of_corrected(&body), Cow::Borrowed(_)));
    }
}
