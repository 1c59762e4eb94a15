//! Upkeep: baselines that follow drift, and taxels that are found unfit. Both on a slow cadence, from raw values.
//!
//! Time is divided into epochs of `cadence_s` by the frames' own stamps, so that a recording has the same epochs however
//! it is cut. At an epoch's end each taxel is judged by what it did in it:
//!
//! **Baseline.** b ← b + (1 − exp(−T/τ))·(m − b), with T the epoch's length and m the mean raw value in it, but only where
//! the taxel's fields were out of contact throughout. A touch that lasts is therefore never learned away, whether it lasts
//! seconds or days, and a robot that is switched on while it stands keeps the baselines of its file. The baseline stays
//! within `max_drift` of the file's: what drifts farther is no drift.
//!
//! **Health.** *Stuck*: pressed, and not one raw unit of change for `stuck_s`. *Noisy*: the mean step between frames is
//! over `noisy`, out of contact. *Saturated*: at or beyond an end of the raw range for `saturated_s`. *Dead*: no value, or
//! none that is a number, for `dead_s`. A taxel that is found unfit is left out of every sum, and its fields flagged
//! `faulty_input`, from the next epoch on and until the reason is gone.

use std::fmt;

use serde::Deserialize;

use super::RawValue;
use crate::error::{Error, Result};

/// What is kept up, and how fast. All off by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct UpkeepKeys {
    /// Length of an epoch, s; 1 where it is not given.
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

impl UpkeepKeys {
    /// Refuses what is no time and no distance.
    pub(crate) fn check(&self) -> Result<()> {
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
            Some((key, _)) => Err(Error::failed(format!("[upkeep] `{key}` must be over 0, or left out"))),
            None => Ok(()),
        }
    }

    fn is_off(&self) -> bool {
        let Self { time_constant_s, stuck_s, noisy, saturated_s, dead_s, .. } = self;
        [time_constant_s, stuck_s, noisy, saturated_s, dead_s].into_iter().all(Option::is_none)
    }
}

/// Why a taxel is not used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unfit {
    /// No numbers arrive.
    Dead,
    /// Pressed, and without any change.
    Stuck,
    /// It jumps without being touched.
    Noisy,
    /// At an end of its range.
    Saturated,
}

impl fmt::Display for Unfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Dead => "dead",
            Self::Stuck => "stuck",
            Self::Noisy => "noisy",
            Self::Saturated => "saturated",
        })
    }
}

/// What upkeep needs to know of a taxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Kept {
    pub(crate) baseline: f32,
    pub(crate) raw_range: [f32; 2],
}

/// The state of one taxel.
#[derive(Clone, Copy, Debug)]
struct TaxelState {
    file: Kept,
    baseline: f64,
    unfit: Option<Unfit>,
    last: Option<f64>,
    /// In this epoch: values, their sum, and the sum of the sizes of the steps between them.
    count: u32,
    sum: f64,
    steps: f64,
    /// For how long it has been without change, at an end of its range, without a number, s.
    unchanged_s: f64,
    at_end_s: f64,
    silent_s: f64,
}

/// Baselines and health of a plan's taxels.
#[derive(Clone, Debug)]
pub(crate) struct Upkeep {
    keys: UpkeepKeys,
    taxels: Vec<TaxelState>,
    epoch_start_s: Option<f64>,
    last_t_s: f64,
}

impl Upkeep {
    /// `None` when there is nothing to keep up.
    pub(crate) fn new(keys: UpkeepKeys, taxels: impl IntoIterator<Item = Kept>) -> Option<Self> {
        let state = |file: Kept| TaxelState {
            file,
            baseline: file.baseline.into(),
            unfit: None,
            last: None,
            count: 0,
            sum: 0.0,
            steps: 0.0,
            unchanged_s: 0.0,
            at_end_s: 0.0,
            silent_s: 0.0,
        };
        let taxels = taxels.into_iter().map(state).collect();
        (!keys.is_off()).then_some(Self { keys, taxels, epoch_start_s: None, last_t_s: 0.0 })
    }

    /// What is kept up.
    pub(crate) fn keys(&self) -> UpkeepKeys {
        self.keys
    }

    /// Whether a frame at `t_s` belongs to a new epoch, so that the one before is to be closed first.
    pub(crate) fn is_due(&self, t_s: f64) -> bool {
        let cadence_s = self.keys.cadence_s.unwrap_or(1.0);
        // A clock that jumps back ends an epoch too, or the next would never come.
        self.epoch_start_s.is_some_and(|start| t_s - start >= cadence_s || t_s < start)
    }

    /// Takes note of a frame.
    pub(crate) fn observe(&mut self, t_s: f64, values: &[RawValue]) {
        let dt_s = if self.epoch_start_s.is_some() { (t_s - self.last_t_s).max(0.0) } else { 0.0 };
        self.epoch_start_s.get_or_insert(t_s);
        self.last_t_s = t_s;
        for (taxel, value) in self.taxels.iter_mut().zip(values) {
            let Some(value) = value.number() else {
                taxel.silent_s += dt_s;
                continue;
            };
            taxel.silent_s = 0.0;
            let step = taxel.last.map_or(0.0, |last| (value - last).abs());
            taxel.unchanged_s = if taxel.last.is_some() && step == 0.0 { taxel.unchanged_s + dt_s } else { 0.0 };
            let [low, high] = taxel.file.raw_range.map(f64::from);
            taxel.at_end_s = if value <= low || value >= high { taxel.at_end_s + dt_s } else { 0.0 };
            taxel.last = Some(value);
            taxel.count += 1;
            taxel.sum += value;
            taxel.steps += step;
        }
    }

    /// Ends the epoch. `touched` says of each taxel whether a field of its was in contact meanwhile. Returns whether any
    /// baseline or judgement changed.
    pub(crate) fn close(&mut self, touched: &[bool]) -> bool {
        let length_s = self.epoch_start_s.map_or(0.0, |start| (self.last_t_s - start).max(0.0));
        let keys = self.keys;
        let over = |limit: Option<f64>, value: f64| limit.is_some_and(|limit| value >= limit);
        let mut changed = false;
        for (taxel, &touched) in self.taxels.iter_mut().zip(touched) {
            let mean = (taxel.count > 0).then(|| taxel.sum / f64::from(taxel.count));
            let mean_step = if taxel.count > 1 { taxel.steps / f64::from(taxel.count - 1) } else { 0.0 };
            let unfit = if over(keys.dead_s, taxel.silent_s) {
                Some(Unfit::Dead)
            } else if over(keys.saturated_s, taxel.at_end_s) && taxel.at_end_s > 0.0 {
                Some(Unfit::Saturated)
            } else if over(keys.stuck_s, taxel.unchanged_s) && taxel.last.is_some_and(|last| last != taxel.baseline) {
                Some(Unfit::Stuck)
            } else if keys.noisy.is_some_and(|noisy| mean_step > noisy)
                && (!touched || taxel.unfit == Some(Unfit::Noisy))
            {
                Some(Unfit::Noisy)
            } else {
                None
            };
            changed |= unfit != taxel.unfit;
            taxel.unfit = unfit;
            if let (Some(tau), Some(mean), false, None) = (keys.time_constant_s, mean, touched, unfit) {
                let file = f64::from(taxel.file.baseline);
                let most = keys.max_drift.unwrap_or(f64::INFINITY);
                let learned = 1.0 - libm::exp(-length_s / tau);
                let baseline = (taxel.baseline + learned * (mean - taxel.baseline)).clamp(file - most, file + most);
                changed |= baseline as f32 != taxel.baseline as f32;
                taxel.baseline = baseline;
            }
            (taxel.count, taxel.sum, taxel.steps) = (0, 0.0, 0.0);
        }
        self.epoch_start_s = None;
        changed
    }

    /// Each taxel's baseline now, and why it is not used, if it is not.
    pub(crate) fn taxels(&self) -> impl Iterator<Item = (f32, Option<Unfit>)> + '_ {
        self.taxels.iter().map(|taxel| (taxel.baseline as f32, taxel.unfit))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn upkeep(keys: UpkeepKeys) -> Upkeep {
        Upkeep::new(keys, [Kept { baseline: 100.0, raw_range: [0.0, 1023.0] }]).unwrap()
    }

    /// Runs `seconds` at 10 Hz and gives the taxel's state.
    fn run(
        upkeep: &mut Upkeep,
        from_s: u32,
        seconds: u32,
        touched: bool,
        value: impl Fn(u32) -> RawValue,
    ) -> (f32, Option<Unfit>) {
        for tick in from_s * 10..(from_s + seconds) * 10 {
            let t_s = f64::from(tick) / 10.0;
            if upkeep.is_due(t_s) {
                upkeep.close(&[touched]);
            }
            upkeep.observe(t_s, &[value(tick)]);
        }
        upkeep.close(&[touched]);
        upkeep.taxels().next().unwrap()
    }

    #[test]
    fn a_baseline_follows_drift_and_never_a_touch() {
        let keys = UpkeepKeys { time_constant_s: Some(10.0), max_drift: Some(20.0), ..UpkeepKeys::default() };
        let drifted = |_| RawValue::new(110.0);
        let (after_10_s, _) = run(&mut upkeep(keys), 0, 10, false, drifted);
        // 1 − 1/e of the way, less what the last frame's tenth of a second takes off each epoch.
        assert!((after_10_s - 106.0).abs() < 0.3, "{after_10_s}");
        let (touched, _) = run(&mut upkeep(keys), 0, 600, true, |_| RawValue::new(700.0));
        assert_eq!(touched, 100.0);
        let (far, _) = run(&mut upkeep(keys), 0, 600, false, |_| RawValue::new(700.0));
        assert_eq!(far, 120.0);
    }

    #[test]
    fn taxels_are_found_unfit_and_fit_again() {
        let only = |set: fn(&mut UpkeepKeys)| {
            let mut keys = UpkeepKeys::default();
            set(&mut keys);
            upkeep(keys)
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
