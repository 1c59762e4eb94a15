//! Soft onsets: P − P₀ above a taxel's dead band P₀ instead of a jump to P, as constants that backends have anyway.
//!
//! On a straight line P − P₀ = gain · (raw − (baseline + P₀/gain)), and on a curve it is the curve lowered by P₀: in both it is 0
//! unless positive, which is a dead band of 0. So a soft onset costs nothing, and a hard one stays what it is to the bit.

use crate::signal::{Onset, Response, TaxelCalibration};

/// What a soft onset has made of a taxel's constants.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SoftOnset {
    /// P₀: what was taken off P. 0 for a taxel whose onset is hard.
    pub(crate) threshold: f64,
    /// By how much the baseline was moved for it, raw units; 0 on a curve.
    pub(crate) shift: f64,
}

/// The taxels as backends calibrate them, and what their soft onsets have moved; nothing where all are hard.
pub(super) fn softened(taxels: impl Iterator<Item = TaxelCalibration>) -> (Vec<TaxelCalibration>, Vec<SoftOnset>) {
    let (taxels, onsets): (Vec<_>, Vec<_>) = taxels.map(soften).unzip();
    let any_soft = onsets.iter().any(|onset| *onset != SoftOnset::default());
    (taxels, if any_soft { onsets } else { Vec::new() })
}

fn soften(taxel: TaxelCalibration) -> (TaxelCalibration, SoftOnset) {
    let threshold = taxel.dead_band;
    if taxel.onset == Onset::Hard || threshold == 0.0 {
        return (taxel, SoftOnset::default());
    }
    let shift = if taxel.response == Response::Linear { threshold / taxel.gain } else { 0.0 };
    let p_max = (taxel.p_max - threshold).max(0.0);
    let moved = TaxelCalibration { baseline: taxel.baseline + shift, dead_band: 0.0, p_max, ..taxel };
    (moved, SoftOnset { threshold, shift })
}
