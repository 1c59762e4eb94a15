//! What is asked of touches.

use crate::percept::TouchOutputs;

/// When touches begin and end, when they are two, and over which time they move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// A touch begins when its total is over this, in the unit of P.
    pub on: f64,
    /// A touch ends when its total is this or less, in the unit of P.
    pub off: f64,
    /// When two peaks are two touches.
    pub splits: Splits,
    /// The time over which velocity is measured, s.
    pub velocity_over_s: f64,
    /// Which quantities are wanted.
    pub outputs: TouchOutputs,
}

impl Default for Options {
    fn default() -> Self {
        Self { on: 0.0, off: 0.0, splits: Splits::default(), velocity_over_s: 0.2, outputs: TouchOutputs::USUAL }
    }
}

/// When two peaks that meet are two touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splits {
    /// The saddle is under this share of the lower peak, and 3σ lower: only then are they compared further.
    pub candidate: f64,
    /// The mean between the peaks is under this share of its lower end.
    pub split: f64,
    /// Two that were two stay so up to this share.
    pub join: f64,
}

/// How many σ the saddle is lower at least.
pub(super) const CANDIDATE_SIGMAS: f64 = 3.0;

impl Default for Splits {
    fn default() -> Self {
        Self { candidate: 0.85, split: 0.75, join: 0.80 }
    }
}

impl Splits {
    /// Whether two regions that meet at the height `saddle` may be two; `peak` is the lower one, with the noise `sigma`.
    pub(super) fn is_candidate(&self, saddle: f64, peak: f64, sigma: f64) -> bool {
        saddle < self.candidate * peak - CANDIDATE_SIGMAS * sigma
    }

    /// Whether they are two, by the least mean between the peaks and the lower one at its ends.
    pub(super) fn are_two(&self, least: f64, lower_end: f64, were_two: bool) -> bool {
        if were_two { least <= self.join * lower_end } else { least < self.split * lower_end }
    }
}
