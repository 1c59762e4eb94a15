//! What of the forces along the skin is in the normal values of taxels with three axes, by the first row of their calibration's `cross_axis`.
//!
//! The row [a, b, c] says that P is a·N + b·u + c·v, with N, u and v what is measured along the three axes, in the unit of P. Raw values
//! are corrected for that before any backend reads them, so that all compute of the same bits: with g the gains,
//! raw′ = raw + (a − 1)(raw − rest) + (b·u + c·v)/gₙ.

use std::borrow::Cow;

use super::calibration::{Calibration, TaxelCalibration};
use super::frame::RawValue;
use super::response::Response;
use super::sense::UNBELIEVABLE;
use crate::body::{Body, Modality};
use crate::error::{Result, failed};

/// What is added to a taxel's raw normal value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Leak {
    /// Raw values at rest, along n, t and n × t.
    rest: [f64; 3],
    /// Of raw tangential values that are believed.
    side_range: [f64; 2],
    /// For a raw unit of each from rest, raw units of the normal value.
    shares: [f64; 3],
}

impl Leak {
    /// The raw normal value `raw` as it is without what `sides`, those along t and n × t, have put into it; unchanged where one of the
    /// three is not known.
    pub(super) fn corrected(&self, raw: RawValue, sides: [RawValue; 2]) -> RawValue {
        let believed = |raw: RawValue| raw.number().filter(|number| number.abs() <= UNBELIEVABLE);
        let [low, high] = self.side_range;
        let of_side = |raw| believed(raw).filter(|number| (low..=high).contains(number));
        let (Some(normal), [Some(u), Some(v)]) = (believed(raw), sides.map(of_side)) else { return raw };
        let away = [normal - self.rest[0], u - self.rest[1], v - self.rest[2]];
        RawValue::new(normal + self.shares[0] * away[0] + self.shares[1] * away[1] + self.shares[2] * away[2])
    }

    /// The standard deviation of a corrected value, where that of a normal one is `noise` and of a tangential one `of_sides`, raw units.
    fn noise(&self, noise: f64, of_sides: f64) -> f64 {
        let [of_normal, of_u, of_v] = self.shares;
        libm::hypot((1.0 + of_normal) * noise, libm::hypot(of_u, of_v) * of_sides)
    }
}

impl Calibration {
    /// What is added to the raw normal value of the taxel at `index`, if it has three axes.
    pub(super) fn leak_of(&self, index: usize) -> Option<Leak> {
        let own: &TaxelCalibration = &self.taxels[index];
        if !self.shear.leaks_into_normal() || own.response != Response::Linear {
            return None;
        }
        let ([of_normal, of_u, of_v], rest) = (self.shear.into_normal, self.shear.rest_of(index));
        let [gain_u, gain_v] = self.shear.gains_of(index, own.gain, own.unit_factor);
        Some(Leak {
            rest: [own.baseline, rest[0], rest[1]],
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

    /// The same with the noise that raw normal values of taxels with three axes have once they are corrected.
    #[must_use]
    pub fn with_noise_of_leaks(&self, body: &Body) -> Cow<'_, Self> {
        if !self.shear.leaks_into_normal() {
            return Cow::Borrowed(self);
        }
        let mut all = self.clone();
        for index in (0..self.taxels.len()).filter(|&index| body.taxels[index].modality == Modality::Force3) {
            if let (Some(leak), Some(noise)) = (self.leak_of(index), self.taxels[index].noise) {
                let of_sides = self.shear.noise_of(index).unwrap_or(noise);
                all.taxels[index].noise = Some(leak.noise(noise, of_sides));
                all.shear.own_noises.insert(index, of_sides);
            }
        }
        Cow::Owned(all)
    }
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
                "[all]\ngain = 2\nnoise = 3\n[shear]\ngain = [4, 1]\ncross_axis = [{row}[0, 1, 0], [0, 0, 1]]\n"
            );
            Calibration::parse(&text, &[1, 2]).unwrap()
        };
        let leaking = read("[2, 1, -1], ");
        let with = leaking.with_noise_of_leaks(&body);
        // P = 2·2·raw + 4u − v: of a normal value (2·3)² + (2·3)² + (0.5·3)².
        assert!((with.taxels[0].noise.unwrap() - 74.25_f64.sqrt()).abs() < 1e-12, "{:?}", with.taxels[0].noise);
        assert_eq!((with.taxels[1].noise, with.shear.noise_of(0)), (Some(3.0), Some(3.0)));
        let alone = read("");
        assert!(matches!(alone.with_noise_of_leaks(&body), Cow::Borrowed(_)));
    }
}
