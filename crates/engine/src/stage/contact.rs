//! **contact**: S = Σ wᵢPᵢ, max Pᵢ, the number of taxels with P > 0 and their area; contact is S > 0.
//!
//! Weights are at least 2⁻²⁰ and pressures 0 or at least 2⁻⁶⁰, so that S > 0 exactly when a taxel is pressed: contact is
//! the same on every backend.
//!
//! **Bound.** Each wP carries the pressure's 2u and one rounding, their sum r ([`super::Sums`]; n − 1 in one pass):
//! |δS| ≤ (r + 3)u·S.
//! To this comes what the pressures are off by more than 2u, ε each: Σ wε for S, the largest ε for the peak.
//! The peak carries its pressure's error alone; n areas, rounded to f32 and summed in one pass: |δA| ≤ n·u·A.

use super::limit::Limit;
use super::{Given, GivenLimit, Pressed, SLACK, Sums, U, scalar};
use crate::percept::Outputs;

/// A field's sums in one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Contact {
    pub(crate) total: f64,
    pub(crate) peak: f64,
    pub(crate) active: u32,
    pub(crate) area: f64,
}

impl Contact {
    /// The outputs; without the area where a taxel's is unknown.
    pub(crate) fn outputs(&self, area_known: bool) -> [Given; 4] {
        [
            (Outputs::TOTAL, Some(scalar(self.total))),
            (Outputs::PEAK, Some(scalar(self.peak))),
            (Outputs::ACTIVE, Some(scalar(self.active.into()))),
            (Outputs::AREA, area_known.then_some(scalar(self.area))),
        ]
    }

    /// The same of bounds.
    pub(crate) fn limits(&self) -> [GivenLimit; 3] {
        [
            (Outputs::TOTAL, Limit::Within(self.total)),
            (Outputs::PEAK, Limit::Within(self.peak)),
            (Outputs::AREA, Limit::Within(self.area)),
        ]
    }
}

/// What is right, in f64.
pub(crate) fn reference(pressed: &[Pressed]) -> Contact {
    Contact {
        // An empty sum is −0.
        total: pressed.iter().map(Pressed::pull).sum::<f64>() + 0.0,
        peak: pressed.iter().map(|taxel| taxel.pressure).fold(0.0, f64::max),
        active: pressed.len() as u32,
        area: pressed.iter().map(|taxel| taxel.area).sum::<f64>() + 0.0,
    }
}

/// How far single precision may be off; `active` is exact.
pub(crate) fn bound(pressed: &[Pressed], sums: Sums) -> Contact {
    let right = reference(pressed);
    let (n, r) = (pressed.len() as f64, sums.roundings(pressed.len()));
    Contact {
        total: SLACK * ((r + 3.0) * U * right.total + pressed.iter().map(Pressed::pull_excess).sum::<f64>()),
        peak: SLACK * (2.0 * U * right.peak + pressed.iter().map(|taxel| taxel.excess).fold(0.0, f64::max)),
        active: 0,
        area: SLACK * (n + 1.0) * U * right.area,
    }
}
