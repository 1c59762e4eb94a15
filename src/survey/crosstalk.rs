//! Crosstalk of sensors that are wired in rows and columns: what a press shows on sensors that nothing touches.
//!
//! A sensor far from a press, in a row or column of it, reads c · x where x is what the sensors of that line feel. What sensors
//! off the press's rows and columns read meanwhile is the layer's tail or a drift, and is subtracted: c = Σ x (P − B) / Σ x².

use std::collections::BTreeMap;
use std::fmt;

use crate::field::{FieldSet, Lattice};
use crate::signal::RawValue;
use crate::{Body, Result};

/// Presses of this many dead bands tell of leaks.
const MIN_PRESS_BANDS: f64 = 10.0;
/// The pressed sensors are those over this share of the highest.
const PRESSED: f64 = 0.1;
/// Lines around these sensors that a contact still reaches.
const MARGIN: usize = 2;
/// Sensors that tell what is read off the rows and columns of a press.
const MIN_OFF_LINES: usize = 4;
/// A sensor off these lines that reads over this share of the press is pressed by something else.
const OTHER_PRESS: f64 = 0.1;
/// A smaller leak cannot be distinguished from the tail of a soft layer,
const MIN_SHARE: f64 = 0.003;
/// nor one that is not this many of its standard deviations.
const MIN_SIGMAS: f64 = 5.0;
const MIN_FRAMES: usize = 10;

/// What presses tell of leaks along rows and columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crosstalk {
    /// The share of a press that the other sensors of its rows and columns read.
    pub share: f64,
    /// Frames with a press that could tell.
    pub frames: usize,
    /// Frames that show untouched sensors beyond their dead bands.
    pub split: usize,
    /// The dead band over which no leak goes, in raw units.
    pub dead_band: f64,
}

impl fmt::Display for Crosstalk {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { share, frames, split, dead_band } = self;
        let percent = 100.0 * share;
        write!(f, "crosstalk: a press shows {percent:.1} % on the other sensors of its rows and columns; ")?;
        if *split == 0 {
            return write!(f, "the dead bands hide it");
        }
        write!(f, "{split} of {frames} frames with a press have touches by it; dead_band = {dead_band} hides them")
    }
}

/// Sums over frames with a press.
#[derive(Clone, Debug, Default)]
pub(super) struct Leaks {
    /// Sensors by their places in a frame.
    lattices: Vec<Lattice>,
    frames: usize,
    split: usize,
    highest_line: f64,
    /// Σ x², Σ x e, Σ x² e², Σ x³ e, Σ x⁴ with e = P − B.
    sums: [f64; 5],
}

impl Leaks {
    /// For frames of the sensors `ids` of `body`.
    pub(super) fn new(body: &Body, ids: &[u32]) -> Result<Self> {
        let index_of: BTreeMap<u32, usize> =
            body.taxels.iter().enumerate().map(|(index, taxel)| (taxel.id, index)).collect();
        // Ids that are not the body's keep their place, and are on no line.
        let taxels: Vec<usize> = ids.iter().map(|id| index_of.get(id).copied().unwrap_or(usize::MAX)).collect();
        let lattices = Lattice::all(&FieldSet::new(body)?).iter().map(|lattice| lattice.among(&taxels)).collect();
        Ok(Self { lattices, ..Self::default() })
    }

    /// Takes a frame. `rest` is each sensor's baseline and dead band, where it has them.
    pub(super) fn see(&mut self, values: &[RawValue], rest: &[Option<(f64, f64)>]) {
        let away = |sensor: usize| Some(values[sensor].number()? - rest[sensor]?.0);
        for at in 0..self.lattices.len() {
            let lattice = &self.lattices[at];
            let away: Vec<Option<f64>> = lattice.taxels.iter().map(|&sensor| away(sensor)).collect();
            let highest = away.iter().enumerate().filter_map(|(k, away)| Some((k, (*away)?)));
            let Some((peak, highest)) = highest.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())) else { continue };
            let bands: Vec<f64> =
                lattice.taxels.iter().map(|&sensor| rest[sensor].map_or(f64::INFINITY, |rest| rest.1)).collect();
            if highest.abs() > MIN_PRESS_BANDS * bands[peak] {
                let pressed: Vec<f64> =
                    away.iter().map(|away| away.map_or(f64::NAN, |away| away * highest.signum())).collect();
                self.add(at, &pressed, &bands, highest.abs());
            }
        }
    }

    /// Adds the frame's pressures of one lattice, NaN where a sensor has none, the highest `highest`.
    fn add(&mut self, at: usize, pressed: &[f64], bands: &[f64], highest: f64) {
        let Lattice { rows, columns, .. } = &self.lattices[at];
        let reach = |lines: &[usize]| {
            let pressed = || lines.iter().zip(pressed).filter(|(_, p)| **p > PRESSED * highest).map(|(line, _)| *line);
            let (first, last) = (pressed().min().unwrap_or(0), pressed().max().unwrap_or(0));
            first.saturating_sub(MARGIN)..=last + MARGIN
        };
        let (near_rows, near_columns) = (reach(rows), reach(columns));
        let given = || (0..pressed.len()).filter(|&k| !pressed[k].is_nan());
        let is_near = |k: usize| (near_rows.contains(&rows[k]), near_columns.contains(&columns[k]));
        let off: Vec<f64> = given().filter(|&k| is_near(k) == (false, false)).map(|k| pressed[k]).collect();
        if off.len() < MIN_OFF_LINES || off.iter().any(|p| *p > OTHER_PRESS * highest) {
            return;
        }
        let beside = off.iter().sum::<f64>() / off.len() as f64;
        let mut felt = self.lattices[at].size().map(|lines| vec![0.0; lines]);
        for k in given().filter(|&k| is_near(k) == (true, true)) {
            felt[0][rows[k]] += pressed[k];
            felt[1][columns[k]] += pressed[k];
        }
        let mut is_split = false;
        for k in given() {
            let x = match is_near(k) {
                (true, false) => felt[0][rows[k]],
                (false, true) => felt[1][columns[k]],
                _ => continue,
            };
            let e = pressed[k] - beside;
            for (sum, term) in self.sums.iter_mut().zip([x * x, x * e, x * x * e * e, x * x * x * e, x * x * x * x]) {
                *sum += term;
            }
            is_split |= pressed[k] > bands[k];
            self.highest_line = self.highest_line.max(x);
        }
        self.frames += 1;
        self.split += usize::from(is_split);
    }

    /// What the frames tell; `None` where no leak is seen. `band` is the sensors' usual dead band, `round` makes one of a number.
    pub(super) fn found(&self, band: f64, round: impl Fn(f64) -> f64) -> Option<Crosstalk> {
        let [xx, xe, xxee, xxxe, xxxx] = self.sums;
        let share = xe / xx;
        let sigma = (xxee - 2.0 * share * xxxe + share * share * xxxx).max(0.0).sqrt() / xx;
        let is_seen = self.frames >= MIN_FRAMES && share >= MIN_SHARE && share >= MIN_SIGMAS * sigma;
        let dead_band = round(share * self.highest_line + band);
        is_seen.then_some(Crosstalk { share, frames: self.frames, split: self.split, dead_band })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensors_off_the_lines_tell_a_leak_from_a_tail() {
        // A press on one sensor of 8 x 8 leaks 2 %; all read a tail of 3 beside it.
        let lines = |line: fn(usize) -> usize| (0..64).map(line).collect::<Vec<usize>>();
        let lattice = Lattice { taxels: (0..64).collect(), rows: lines(|k| k / 8), columns: lines(|k| k % 8) };
        let frame = |leak: f64| -> Vec<RawValue> {
            let value = |k: usize| match (k / 8 == 3, k % 8 == 4) {
                (true, true) => 900.0,
                (true, false) | (false, true) => 3.0 + leak * 900.0,
                _ => 3.0,
            };
            (0..64).map(|k| RawValue::new(100.0 + value(k))).collect()
        };
        let found = |leak: f64, frames: usize| {
            let mut leaks = Leaks { lattices: vec![lattice.clone()], ..Leaks::default() };
            (0..frames).for_each(|_| leaks.see(&frame(leak), &[Some((100.0, 5.0)); 64]));
            leaks.found(5.0, f64::ceil)
        };
        let Crosstalk { share, frames, split, dead_band } = found(0.02, 12).unwrap();
        // The press's own line holds what leaked to the sensors beside it, too.
        assert!((share / 0.02 - 1.0).abs() < 0.12, "{share}");
        assert_eq!((frames, split), (12, 12));
        assert!(dead_band > 0.02 * 900.0 + 3.0 && dead_band < 40.0, "{dead_band}");
        assert_eq!((found(0.0, 12), found(0.02, 9)), (None, None));
    }
}
