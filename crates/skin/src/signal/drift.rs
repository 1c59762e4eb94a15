//! Drift compensation: baselines follow drift, and defective taxels are detected, both once per epoch, from raw values.
//!
//! Epochs of `cadence_s` are counted by the frames' times, so that they do not depend on batches. At an epoch's end each
//! taxel is updated, with m the mean of its raw values in the epoch:
//!
//! **At rest**, its fields out of contact. b ← b + r·T + (1 − exp(−T/τ))·(m − b), with T the epoch's length and r the mean
//! rate of the common drift ([`common_drift`]), so that b does not lag behind it.
//!
//! **Held**, a field of its own in contact, and a taxel of that field with evidence of a press ([`press_evidence`]). Its rest
//! value cannot be measured, so b follows the median drift of the untouched taxels of its board, else link, else body.
//! A taxel without evidence of its own may differ from that drift by a quarter. With fewer than three untouched taxels, b
//! stays, and after [`DRIFT_UNKNOWN_AFTER_S`] the drift counts as unknown. A lasting touch is therefore never learned as
//! rest, and a robot that stands when it is switched on keeps the baselines of its file.
//!
//! **Released**, in contact without evidence of a press: the rest of the signal is the error of b. In the first quiet epoch
//! b becomes m, if they differ by no more than the drift since the touch began, or if that is unknown. A larger, slow
//! rise is kept as a touch.
//!
//! The baseline stays within `max_drift` of the file's.
//!
//! **Health.** *Stuck*: off its rest by more than the dead band, and not one raw unit of change for `stuck_s`. *Noisy*: the
//! mean step between frames is over `noisy`, not held. *Saturated*: at or beyond an end of the raw range for `saturated_s`. *Dead*: no
//! value, or none that is a number, for `dead_s`. A taxel that is found unfit is left out of every sum, and its fields flagged
//! `faulty_input`, from the next epoch on and until the reason is gone.

mod common_drift;
mod press_evidence;

use std::fmt;

use serde::{Deserialize, Serialize};

pub use self::common_drift::MIN_UNTOUCHED;
use self::common_drift::{CommonDrift, Drift};
use self::press_evidence::{PressEvidence, TouchSense};
use super::RawValue;
use crate::error::{Result, failed};

/// The drift of a held taxel counts as unknown after this time without an estimate, s.
const DRIFT_UNKNOWN_AFTER_S: f64 = 60.0;
/// A taxel's drift may differ from its group's by this share of it.
const MAX_OWN_DRIFT_SHARE: f64 = 0.25;
/// Averaging time of the drift rate, share of the baseline's time constant.
const RATE_TIME_SHARE: f64 = 0.25;

/// The settings of drift compensation. All are off by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DriftKeys {
    /// Length of an epoch, s; 1 by default.
    pub cadence_s: Option<f64>,
    /// τ of the baseline, s.
    pub time_constant_s: Option<f64>,
    /// How far a baseline may move from the file's, raw units.
    pub max_drift: Option<f64>,
    /// A pressed taxel that does not change at all for this long is stuck, s.
    pub stuck_s: Option<f64>,
    /// A taxel out of contact whose raw value steps by more than this on average is noisy, raw units.
    pub noisy: Option<f64>,
    /// A taxel at an end of its raw range for this long is saturated, s.
    pub saturated_s: Option<f64>,
    /// A taxel without a number for this long is dead, s.
    pub dead_s: Option<f64>,
}

impl DriftKeys {
    #[doc(hidden)]
    pub fn check(&self) -> Result<()> {
        let keys = [
            ("cadence_s", self.cadence_s),
            ("time_constant_s", self.time_constant_s),
            ("max_drift", self.max_drift),
            ("stuck_s", self.stuck_s),
            ("noisy", self.noisy),
            ("saturated_s", self.saturated_s),
            ("dead_s", self.dead_s),
        ];
        match keys.into_iter().find(|(_, value)| value.is_some_and(|value| !(value.is_finite() && value > 0.0))) {
            Some((key, _)) => Err(failed!("[drift] `{key}` must be over 0, or left out")),
            None => Ok(()),
        }
    }

    fn is_off(&self) -> bool {
        let Self { time_constant_s, stuck_s, noisy, saturated_s, dead_s, .. } = self;
        [time_constant_s, stuck_s, noisy, saturated_s, dead_s].into_iter().all(Option::is_none)
    }
}

/// The defect for which a taxel is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Unfit {
    /// No numbers arrive.
    Dead,
    /// Pressed, and without any change.
    Stuck,
    /// Noisy while untouched.
    Noisy,
    /// At an end of its range.
    Saturated,
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// The calibration of a taxel, as far as drift compensation needs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kept {
    /// Raw value of the taxel at rest.
    pub baseline: f32,
    /// The least and the greatest raw value that it can give.
    pub raw_range: [f32; 2],
    /// Change of the raw value from the baseline that counts as a touch.
    pub felt: f64,
    /// Whether the raw value falls when the taxel is pressed.
    pub falls: bool,
    /// Whether the file masks it.
    pub mask: bool,
}

/// Sum and number of the values of an epoch, or of half of it.
#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    count: u32,
    sum: f64,
}

impl Sum {
    fn add(&mut self, value: f64) {
        self.count += 1;
        self.sum += value;
    }

    fn mean(self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / f64::from(self.count))
    }
}

#[derive(Clone, Copy, Debug)]
struct TaxelState {
    file: Kept,
    baseline: f64,
    unfit: Option<Unfit>,
    last: Option<f64>,
    /// In this epoch: the values, also by halves, how many were at an end of the range, and the sum of the absolute steps.
    all: Sum,
    halves: [Sum; 2],
    at_ends: u32,
    steps: f64,
    /// Whether the next value was at an end of its range before it was corrected.
    was_at_end: bool,
    /// Time without a change, at an end of its range, and without a number, s.
    unchanged_s: f64,
    at_end_s: f64,
    silent_s: f64,
    before: Option<f64>,
    evidence: PressEvidence,
    /// Error bound of its estimated baseline: the sum of the drift estimates it has followed, raw units.
    uncertainty: f64,
    /// Time without a drift estimate, s.
    unknown_s: f64,
}

impl TaxelState {
    fn new(file: Kept) -> Self {
        let baseline = file.baseline.into();
        Self {
            file,
            baseline,
            unfit: None,
            last: None,
            all: Sum::default(),
            halves: [Sum::default(); 2],
            at_ends: 0,
            steps: 0.0,
            was_at_end: false,
            unchanged_s: 0.0,
            at_end_s: 0.0,
            silent_s: 0.0,
            before: None,
            evidence: PressEvidence::none(baseline),
            uncertainty: 0.0,
            unknown_s: 0.0,
        }
    }

    fn sense(&self) -> TouchSense {
        TouchSense { felt: self.file.felt, direction: if self.file.falls { -1.0 } else { 1.0 } }
    }

    /// The mean of the epoch's later half, or of all of it.
    fn late(&self) -> Option<f64> {
        self.halves[1].mean().or(self.all.mean())
    }

    /// Whether it did not change in the epoch.
    fn is_quiet(&self) -> bool {
        let change = match self.halves.map(Sum::mean) {
            [Some(early), Some(late)] => Some(late - early),
            // At most one frame per epoch.
            _ => self.all.mean().zip(self.before).map(|(now, before)| now - before),
        };
        change.is_some_and(|change| self.sense().is_slow(change))
    }

    fn check_health(&self, keys: &DriftKeys, held: bool) -> Option<Unfit> {
        let over = |limit: Option<f64>, value: f64| limit.is_some_and(|limit| value >= limit);
        let is_off = |last: f64| (last - self.baseline).abs() > self.file.felt;
        let mean_step = if self.all.count > 1 { self.steps / f64::from(self.all.count - 1) } else { 0.0 };
        if over(keys.dead_s, self.silent_s) {
            Some(Unfit::Dead)
        } else if over(keys.saturated_s, self.at_end_s) && self.at_end_s > 0.0 {
            Some(Unfit::Saturated)
        } else if over(keys.stuck_s, self.unchanged_s) && self.last.is_some_and(is_off) {
            Some(Unfit::Stuck)
        } else if keys.noisy.is_some_and(|noisy| mean_step > noisy) && (!held || self.unfit == Some(Unfit::Noisy)) {
            Some(Unfit::Noisy)
        } else {
            None
        }
    }

    /// Moves the baseline by the group's drift, if known.
    fn follow_group(&mut self, drift: Option<Drift>, dt_s: f64) {
        match drift {
            Some(drift) => {
                self.baseline += drift.step;
                self.uncertainty += drift.step.abs();
                self.unknown_s = 0.0;
            }
            None => self.unknown_s += dt_s,
        }
    }

    /// Moves the baseline towards `mean`, by no more than its drift may differ from its group's.
    fn follow_own(&mut self, mean: f64, drift: Option<Drift>) {
        let limit = drift.map_or(0.0, |drift| MAX_OWN_DRIFT_SHARE * drift.step.abs());
        self.baseline += (mean - self.baseline).clamp(-limit, limit);
    }

    fn uncertainty(&self) -> f64 {
        if self.unknown_s > 0.0 { f64::INFINITY } else { self.uncertainty }
    }

    /// Moves the baseline at the end of an epoch in which the taxel was not held: by the share `learned` towards `mean`,
    /// beside the common drift.
    fn relearn(&mut self, mean: f64, contact: bool, drift: Option<Drift>, epoch: Epoch, learned: f64) {
        let off = mean - self.baseline;
        let is_felt = self.sense().direction * off > self.file.felt;
        if self.uncertainty() > 0.0 && self.is_quiet() && off.abs() <= self.file.felt + self.uncertainty() {
            self.baseline = mean;
        } else if contact && is_felt {
            // A slow rise beyond the common drift may be a touch.
            return self.follow_group(drift, epoch.dt_s);
        } else {
            self.baseline += drift.map_or(0.0, |drift| drift.rate * epoch.followed_s) + learned * off;
            if self.uncertainty() > 0.0 && !self.is_quiet() {
                return;
            }
        }
        (self.uncertainty, self.unknown_s) = (0.0, 0.0);
    }
}

#[derive(Clone, Copy)]
struct Epoch {
    length_s: f64,
    middle_s: f64,
    /// From the middle of the previous epoch to its own.
    dt_s: f64,
    /// The same, limited, as rates are not extrapolated over a pause.
    followed_s: f64,
}

/// Follows the baselines of taxels that nothing touches.
#[derive(Clone, Debug)]
pub struct DriftCompensation {
    keys: DriftKeys,
    taxels: Vec<TaxelState>,
    common: CommonDrift,
    epoch_start_s: Option<f64>,
    last_t_s: f64,
    middle_s: Option<f64>,
}

impl DriftCompensation {
    /// `None` if all settings are off. Each of `groups`, the most specific first, has the group of every taxel, or `None`.
    /// Taxels of a group share their temperature.
    pub fn new(
        keys: DriftKeys,
        taxels: impl IntoIterator<Item = Kept>,
        groups: Vec<Vec<Option<usize>>>,
    ) -> Option<Self> {
        let taxels = taxels.into_iter().map(TaxelState::new).collect();
        let common = CommonDrift::new(groups);
        (!keys.is_off()).then_some(Self { keys, taxels, common, epoch_start_s: None, last_t_s: 0.0, middle_s: None })
    }

    /// Its settings.
    pub fn keys(&self) -> DriftKeys {
        self.keys
    }

    fn cadence_s(&self) -> f64 {
        self.keys.cadence_s.unwrap_or(1.0)
    }

    /// Whether a frame at `t_s` belongs to a new epoch, so that the current one must be closed first.
    pub fn is_due(&self, t_s: f64) -> bool {
        // A time that goes back ends an epoch too.
        self.epoch_start_s.is_some_and(|start| t_s - start >= self.cadence_s() || t_s < start)
    }

    /// Notes that the value of the taxel at `index` in the next frame was at an end of its range before it was corrected, which does not
    /// show in what [`DriftCompensation::observe`] takes.
    pub fn note_at_end(&mut self, index: usize) {
        self.taxels[index].was_at_end = true;
    }

    /// Takes the raw values of the frame at `t_s` into the current epoch.
    pub fn observe(&mut self, t_s: f64, values: &[RawValue]) {
        let dt_s = if self.epoch_start_s.is_some() { (t_s - self.last_t_s).max(0.0) } else { 0.0 };
        let start_s = *self.epoch_start_s.get_or_insert(t_s);
        let half = usize::from(t_s - start_s >= 0.5 * self.cadence_s());
        self.last_t_s = t_s;
        for (taxel, value) in self.taxels.iter_mut().zip(values) {
            let was_at_end = std::mem::take(&mut taxel.was_at_end);
            let Some(value) = value.number() else {
                taxel.silent_s += dt_s;
                continue;
            };
            taxel.silent_s = 0.0;
            let step = taxel.last.map_or(0.0, |last| (value - last).abs());
            taxel.unchanged_s = if taxel.last.is_some() && step == 0.0 { taxel.unchanged_s + dt_s } else { 0.0 };
            let [low, high] = taxel.file.raw_range.map(f64::from);
            let at_end = was_at_end || value <= low || value >= high;
            taxel.at_end_s = if at_end { taxel.at_end_s + dt_s } else { 0.0 };
            taxel.at_ends += u32::from(at_end);
            taxel.last = Some(value);
            taxel.all.add(value);
            taxel.halves[half].add(value);
            taxel.steps += step;
        }
    }

    /// Ends the epoch. `contact` has per taxel whether one of its fields was in contact; `beside` maps which taxels are
    /// pressed to which have a pressed one in a common field. Returns whether any baseline or defect changed.
    pub fn close(&mut self, contact: &[bool], beside: impl Fn(&[bool]) -> Vec<bool>) -> bool {
        let epoch = self.end();
        let drift = self.estimate(contact, epoch);
        let pressed: Vec<bool> = (0..self.taxels.len()).map(|index| self.is_pressed(index, contact, &drift)).collect();
        let held = beside(&pressed);
        let keys = self.keys;
        let learned = keys.time_constant_s.map(|tau| 1.0 - libm::exp(-epoch.length_s / tau));
        let mut changed = false;
        for (index, taxel) in self.taxels.iter_mut().enumerate() {
            let was_unfit = taxel.unfit.is_some();
            let unfit = taxel.check_health(&keys, held[index]);
            changed |= unfit != taxel.unfit;
            taxel.unfit = unfit;
            if let Some(learned) = learned {
                let before = taxel.baseline;
                match taxel.all.mean().filter(|_| unfit.is_none() && !was_unfit) {
                    Some(mean) if !held[index] => taxel.relearn(mean, contact[index], drift[index], epoch, learned),
                    Some(mean) => {
                        taxel.follow_group(drift[index], epoch.dt_s);
                        if !pressed[index] {
                            taxel.follow_own(mean, drift[index]);
                        }
                    }
                    // It was left out of all sums, so whether it is touched is unknown.
                    None => taxel.follow_group(drift[index], 0.0),
                }
                let (file, max_drift) = (f64::from(taxel.file.baseline), keys.max_drift.unwrap_or(f64::INFINITY));
                taxel.baseline = taxel.baseline.clamp(file - max_drift, file + max_drift);
                changed |= taxel.baseline as f32 != before as f32;
            }
            if !contact[index] || was_unfit {
                taxel.evidence = PressEvidence::none(taxel.baseline);
            }
            taxel.before = taxel.all.mean();
            (taxel.all, taxel.halves, taxel.at_ends, taxel.steps) = Default::default();
        }
        changed
    }

    fn end(&mut self) -> Epoch {
        let start_s = self.epoch_start_s.take().unwrap_or(self.last_t_s);
        let length_s = (self.last_t_s - start_s).max(0.0);
        let middle_s = start_s + 0.5 * length_s;
        let before_s = self.middle_s.replace(middle_s).unwrap_or(middle_s);
        let dt_s = (middle_s - before_s).max(0.0);
        Epoch { length_s, middle_s, dt_s, followed_s: dt_s.min(2.0 * self.cadence_s()) }
    }

    /// The drift of each taxel, estimated from those that are fit, not masked, within their range and untouched.
    fn estimate(&mut self, contact: &[bool], epoch: Epoch) -> Vec<Option<Drift>> {
        let Some(tau) = self.keys.time_constant_s else { return vec![None; self.taxels.len()] };
        let level = |(taxel, &contact): (&TaxelState, &bool)| {
            let counts = !contact && taxel.unfit.is_none() && !taxel.file.mask && taxel.at_ends == 0;
            taxel.all.mean().filter(|_| counts).map(|mean| mean - f64::from(taxel.file.baseline))
        };
        let levels: Vec<Option<f64>> = self.taxels.iter().zip(contact).map(level).collect();
        self.common.estimate(&levels, epoch.middle_s, RATE_TIME_SHARE * tau)
    }

    /// Whether there is evidence that taxel `index` is pressed.
    fn is_pressed(&mut self, index: usize, contact: &[bool], drift: &[Option<Drift>]) -> bool {
        let taxel = &mut self.taxels[index];
        let (Some(late), true) = (taxel.late(), contact[index]) else { return false };
        let sense = taxel.sense();
        taxel.evidence.follow(late, drift[index].map_or(0.0, |drift| drift.step), taxel.baseline, sense);
        taxel.unfit.is_none() && taxel.evidence.is_press(sense)
    }

    /// Per taxel whether its baseline has not been seen for long.
    pub fn unknown(&self) -> impl Iterator<Item = bool> + '_ {
        self.taxels.iter().map(|taxel| taxel.unknown_s >= DRIFT_UNKNOWN_AFTER_S)
    }

    /// Each taxel's present baseline, and its defect if any.
    pub fn taxels(&self) -> impl Iterator<Item = (f32, Option<Unfit>)> + '_ {
        self.taxels.iter().map(|taxel| (taxel.baseline as f32, taxel.unfit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drift(keys: DriftKeys) -> DriftCompensation {
        let taxel = Kept { baseline: 100.0, raw_range: [0.0, 1023.0], felt: 12.0, falls: false, mask: false };
        DriftCompensation::new(keys, [taxel], vec![vec![Some(0)]]).unwrap()
    }

    /// Runs `seconds` at 10 Hz and gives the taxel's state.
    fn run(
        drift: &mut DriftCompensation,
        from_s: u32,
        seconds: u32,
        touched: bool,
        value: impl Fn(u32) -> RawValue,
    ) -> (f32, Option<Unfit>) {
        for tick in from_s * 10..(from_s + seconds) * 10 {
            let t_s = f64::from(tick) / 10.0;
            if drift.is_due(t_s) {
                drift.close(&[touched], <[bool]>::to_vec);
            }
            drift.observe(t_s, &[value(tick)]);
        }
        drift.close(&[touched], <[bool]>::to_vec);
        drift.taxels().next().unwrap()
    }

    #[test]
    fn a_baseline_follows_drift_and_never_a_touch() {
        let keys = DriftKeys { time_constant_s: Some(10.0), max_drift: Some(20.0), ..DriftKeys::default() };
        let drifted = |_| RawValue::new(110.0);
        let (after_10_s, _) = run(&mut drift(keys), 0, 10, false, drifted);
        // 1 − 1/e of the way, less what the last frame's tenth of a second takes off each epoch.
        assert!((after_10_s - 106.0).abs() < 0.3, "{after_10_s}");
        let (touched, _) = run(&mut drift(keys), 0, 600, true, |_| RawValue::new(700.0));
        assert_eq!(touched, 100.0);
        let (far, _) = run(&mut drift(keys), 0, 600, false, |_| RawValue::new(700.0));
        assert_eq!(far, 120.0);
    }

    #[test]
    fn taxels_are_found_unfit_and_fit_again() {
        let only = |set: fn(&mut DriftKeys)| {
            let mut keys = DriftKeys::default();
            set(&mut keys);
            drift(keys)
        };
        let mut stuck = only(|k| k.stuck_s = Some(5.0));
        assert_eq!(run(&mut stuck, 0, 4, true, |_| RawValue::new(300.0)).1, None);
        assert_eq!(run(&mut stuck, 4, 3, true, |_| RawValue::new(300.0)).1, Some(Unfit::Stuck));
        assert_eq!(run(&mut stuck, 7, 2, true, |t| RawValue::new(f64::from(300 + t % 3))).1, None);
        // At rest a converter may well not move for hours.
        assert_eq!(run(&mut only(|k| k.stuck_s = Some(5.0)), 0, 60, false, |_| RawValue::new(100.0)).1, None);

        let jumpy = |t: u32| RawValue::new(f64::from(100 + 40 * (t % 2)));
        assert_eq!(run(&mut only(|k| k.noisy = Some(10.0)), 0, 3, false, jumpy).1, Some(Unfit::Noisy));
        assert_eq!(run(&mut only(|k| k.noisy = Some(10.0)), 0, 3, true, jumpy).1, None);

        let ceiling = |_| RawValue::new(1023.0);
        assert_eq!(run(&mut only(|k| k.saturated_s = Some(2.0)), 0, 5, true, ceiling).1, Some(Unfit::Saturated));

        let mut dead = only(|k| k.dead_s = Some(2.0));
        assert_eq!(run(&mut dead, 0, 4, false, |_| RawValue::MISSING).1, Some(Unfit::Dead));
        assert_eq!(run(&mut dead, 4, 2, false, |_| RawValue::new(100.0)).1, None);
    }
}
