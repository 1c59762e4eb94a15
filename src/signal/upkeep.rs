//! Upkeep: baselines that follow drift, and taxels that are found unfit. Both on a slow cadence, from raw values.
//!
//! Time is divided into epochs of `cadence_s` by the frames' own stamps, so that a recording has the same epochs however
//! it is cut. At an epoch's end each taxel is judged by what it did in it, with m the mean of its raw values:
//!
//! **At rest**, its fields out of contact. b ← b + r·T + (1 − exp(−T/τ))·(m − b), with T the epoch's length and r the mean
//! rate of what drifts together ([`common`]), so that b does not lag behind a drift that all have.
//!
//! **Held**, a field of its own in contact, and a taxel of that field with evidence of a press ([`evidence`]). Nobody can
//! see its rest, and b follows the median drift of the untouched taxels of its board, else of its link, else of the body.
//! A taxel that shows no press itself may drift by a quarter more or less. Where fewer than three are untouched, b stays,
//! and after [`UNKNOWN_AFTER_S`] the drift is said to be unknown. A touch that lasts is therefore never learned away,
//! whether it lasts seconds or days, and a robot that is switched on while it stands keeps the baselines of its file.
//!
//! **Left**, in contact though nothing shows a press any more: what remains after a release is what b was estimated wrong.
//! In the first epoch that is quiet b becomes m, if they are no farther apart than the drift since the touch began, or if
//! that is unknown. What rose slowly and farther than that is kept.
//!
//! The baseline stays within `max_drift` of the file's: what drifts farther is no drift.
//!
//! **Health.** *Stuck*: off its rest by more than the dead band, and not one raw unit of change for `stuck_s`. *Noisy*: the
//! mean step between frames is over `noisy`, not held. *Saturated*: at or beyond an end of the raw range for `saturated_s`. *Dead*: no value, or
//! none that is a number, for `dead_s`. A taxel that is found unfit is left out of every sum, and its fields flagged
//! `faulty_input`, from the next epoch on and until the reason is gone.

mod common;
mod evidence;

use std::fmt;

use serde::Deserialize;

use self::common::{Common, Told};
use self::evidence::{Evidence, Sense};
use super::RawValue;
use crate::error::{Error, Result};

/// A held taxel whose drift nobody has told for so long is said to drift by nobody knows how much, s.
const UNKNOWN_AFTER_S: f64 = 60.0;
/// A taxel's own drift may differ from that of its group by this share of it.
const OWN_SHARE: f64 = 0.25;
/// The mean rate of drift is over this share of the baseline's time constant.
const RATE_SHARE: f64 = 0.25;

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
    /// How far the raw value must go from the baseline for the taxel to be felt.
    pub(crate) felt: f64,
    /// Whether the raw value falls when the taxel is pressed.
    pub(crate) falls: bool,
    /// Whether the file says never to believe it.
    pub(crate) mask: bool,
}

/// Values of an epoch, or of a part of it.
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

/// The state of one taxel.
#[derive(Clone, Copy, Debug)]
struct TaxelState {
    file: Kept,
    baseline: f64,
    unfit: Option<Unfit>,
    last: Option<f64>,
    /// In this epoch: values, in its two halves too, how many were at an end of the range, and the sum of the sizes of the
    /// steps between them.
    all: Sum,
    halves: [Sum; 2],
    at_ends: u32,
    steps: f64,
    /// For how long it has been without change, at an end of its range, without a number, s.
    unchanged_s: f64,
    at_end_s: f64,
    silent_s: f64,
    /// The mean of the epoch before.
    before: Option<f64>,
    evidence: Evidence,
    /// How far its baseline may be wrong, as it was only estimated: by what all have drifted since, raw units.
    doubt: f64,
    /// For how long nobody has told its drift, s; 0 once somebody has.
    untold_s: f64,
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
            unchanged_s: 0.0,
            at_end_s: 0.0,
            silent_s: 0.0,
            before: None,
            evidence: Evidence::none(baseline),
            doubt: 0.0,
            untold_s: 0.0,
        }
    }

    fn sense(&self) -> Sense {
        Sense { felt: self.file.felt, direction: if self.file.falls { -1.0 } else { 1.0 } }
    }

    /// The mean of the epoch's later half, or of all of it.
    fn late(&self) -> Option<f64> {
        self.halves[1].mean().or(self.all.mean())
    }

    /// Whether it stood still in the epoch.
    fn is_quiet(&self) -> bool {
        let change = match self.halves.map(Sum::mean) {
            [Some(early), Some(late)] => Some(late - early),
            // Frames as rare as epochs.
            _ => self.all.mean().zip(self.before).map(|(now, before)| now - before),
        };
        change.is_some_and(|change| self.sense().is_slow(change))
    }

    /// What is wrong with it, by what it did until now.
    fn judge(&self, keys: &UpkeepKeys, held: bool) -> Option<Unfit> {
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

    /// Moves the baseline as `told`, if anybody has told how far.
    fn follow_others(&mut self, told: Option<Told>, dt_s: f64) {
        match told {
            Some(told) => {
                self.baseline += told.step;
                self.doubt += told.step.abs();
                self.untold_s = 0.0;
            }
            None => self.untold_s += dt_s,
        }
    }

    /// Moves the baseline towards `mean` by as much as its drift may differ from what was told: it is not pressed itself.
    fn lean(&mut self, mean: f64, told: Option<Told>) {
        let most = told.map_or(0.0, |told| OWN_SHARE * told.step.abs());
        self.baseline += (mean - self.baseline).clamp(-most, most);
    }

    /// How far the baseline may be wrong by now.
    fn doubt(&self) -> f64 {
        if self.untold_s > 0.0 { f64::INFINITY } else { self.doubt }
    }

    /// Moves the baseline at the end of an epoch in which nothing held the taxel, and its mean was `mean`: a share of
    /// `learned` of the way, beside what all drift in it.
    fn settle(&mut self, mean: f64, contact: bool, told: Option<Told>, epoch: Epoch, learned: f64) {
        let off = mean - self.baseline;
        let is_felt = self.sense().direction * off > self.file.felt;
        if self.doubt() > 0.0 && self.is_quiet() && off.abs() <= self.file.felt + self.doubt() {
            self.baseline = mean;
        } else if contact && is_felt {
            // It rose slowly, farther than all have drifted: a touch, for all that is known.
            return self.follow_others(told, epoch.dt_s);
        } else {
            self.baseline += told.map_or(0.0, |told| told.rate * epoch.followed_s) + learned * off;
            if self.doubt() > 0.0 && !self.is_quiet() {
                return;
            }
        }
        (self.doubt, self.untold_s) = (0.0, 0.0);
    }
}

/// When an epoch was.
#[derive(Clone, Copy)]
struct Epoch {
    length_s: f64,
    middle_s: f64,
    /// From the middle of the one before to its own.
    dt_s: f64,
    /// The same, but not over a pause: a rate is no more than a guess then.
    followed_s: f64,
}

/// Baselines and health of a plan's taxels.
#[derive(Clone, Debug)]
pub(crate) struct Upkeep {
    keys: UpkeepKeys,
    taxels: Vec<TaxelState>,
    common: Common,
    epoch_start_s: Option<f64>,
    last_t_s: f64,
    middle_s: Option<f64>,
}

impl Upkeep {
    /// `None` when there is nothing to keep up. Taxels that are warmed together are in one group; of `groups`, the nearest
    /// come first, and each has one group a taxel, or `None`.
    pub(crate) fn new(
        keys: UpkeepKeys,
        taxels: impl IntoIterator<Item = Kept>,
        groups: Vec<Vec<Option<usize>>>,
    ) -> Option<Self> {
        let taxels = taxels.into_iter().map(TaxelState::new).collect();
        let common = Common::new(groups);
        (!keys.is_off()).then_some(Self { keys, taxels, common, epoch_start_s: None, last_t_s: 0.0, middle_s: None })
    }

    /// What is kept up.
    pub(crate) fn keys(&self) -> UpkeepKeys {
        self.keys
    }

    fn cadence_s(&self) -> f64 {
        self.keys.cadence_s.unwrap_or(1.0)
    }

    /// Whether a frame at `t_s` belongs to a new epoch, so that the one before is to be closed first.
    pub(crate) fn is_due(&self, t_s: f64) -> bool {
        // A clock that jumps back ends an epoch too, or the next would never come.
        self.epoch_start_s.is_some_and(|start| t_s - start >= self.cadence_s() || t_s < start)
    }

    /// Takes note of a frame.
    pub(crate) fn observe(&mut self, t_s: f64, values: &[RawValue]) {
        let dt_s = if self.epoch_start_s.is_some() { (t_s - self.last_t_s).max(0.0) } else { 0.0 };
        let start_s = *self.epoch_start_s.get_or_insert(t_s);
        let half = usize::from(t_s - start_s >= 0.5 * self.cadence_s());
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
            let at_end = value <= low || value >= high;
            taxel.at_end_s = if at_end { taxel.at_end_s + dt_s } else { 0.0 };
            taxel.at_ends += u32::from(at_end);
            taxel.last = Some(value);
            taxel.all.add(value);
            taxel.halves[half].add(value);
            taxel.steps += step;
        }
    }

    /// Ends the epoch. `contact` says of each taxel whether a field of its was in contact meanwhile; `beside`, given which
    /// taxels are pressed, which have one in a field of theirs. Returns whether any baseline or judgement changed.
    pub(crate) fn close(&mut self, contact: &[bool], beside: impl Fn(&[bool]) -> Vec<bool>) -> bool {
        let epoch = self.end();
        let told = self.tell(contact, epoch);
        let pressed: Vec<bool> = (0..self.taxels.len()).map(|index| self.is_pressed(index, contact, &told)).collect();
        let held = beside(&pressed);
        let keys = self.keys;
        let learned = keys.time_constant_s.map(|tau| 1.0 - libm::exp(-epoch.length_s / tau));
        let mut changed = false;
        for (index, taxel) in self.taxels.iter_mut().enumerate() {
            let was_unfit = taxel.unfit.is_some();
            let unfit = taxel.judge(&keys, held[index]);
            changed |= unfit != taxel.unfit;
            taxel.unfit = unfit;
            if let Some(learned) = learned {
                let before = taxel.baseline;
                match taxel.all.mean().filter(|_| unfit.is_none() && !was_unfit) {
                    Some(mean) if !held[index] => taxel.settle(mean, contact[index], told[index], epoch, learned),
                    Some(mean) => {
                        taxel.follow_others(told[index], epoch.dt_s);
                        if !pressed[index] {
                            taxel.lean(mean, told[index]);
                        }
                    }
                    // It was left out of every sum: whether it is touched was not seen, and nobody need be told.
                    None => taxel.follow_others(told[index], 0.0),
                }
                let (file, most) = (f64::from(taxel.file.baseline), keys.max_drift.unwrap_or(f64::INFINITY));
                taxel.baseline = taxel.baseline.clamp(file - most, file + most);
                changed |= taxel.baseline as f32 != before as f32;
            }
            if !contact[index] || was_unfit {
                taxel.evidence = Evidence::none(taxel.baseline);
            }
            taxel.before = taxel.all.mean();
            (taxel.all, taxel.halves, taxel.at_ends, taxel.steps) = Default::default();
        }
        changed
    }

    /// When the epoch was that ends.
    fn end(&mut self) -> Epoch {
        let start_s = self.epoch_start_s.take().unwrap_or(self.last_t_s);
        let length_s = (self.last_t_s - start_s).max(0.0);
        let middle_s = start_s + 0.5 * length_s;
        let before_s = self.middle_s.replace(middle_s).unwrap_or(middle_s);
        let dt_s = (middle_s - before_s).max(0.0);
        Epoch { length_s, middle_s, dt_s, followed_s: dt_s.min(2.0 * self.cadence_s()) }
    }

    /// The drift that each taxel is told by those that are fit, believed, within their range and untouched.
    fn tell(&mut self, contact: &[bool], epoch: Epoch) -> Vec<Option<Told>> {
        let Some(tau) = self.keys.time_constant_s else { return vec![None; self.taxels.len()] };
        let level = |(taxel, &contact): (&TaxelState, &bool)| {
            let tells = !contact && taxel.unfit.is_none() && !taxel.file.mask && taxel.at_ends == 0;
            taxel.all.mean().filter(|_| tells).map(|mean| mean - f64::from(taxel.file.baseline))
        };
        let levels: Vec<Option<f64>> = self.taxels.iter().zip(contact).map(level).collect();
        self.common.tell(&levels, epoch.middle_s, RATE_SHARE * tau)
    }

    /// Whether taxel `index` shows that it is pressed.
    fn is_pressed(&mut self, index: usize, contact: &[bool], told: &[Option<Told>]) -> bool {
        let taxel = &mut self.taxels[index];
        let (Some(late), true) = (taxel.late(), contact[index]) else { return false };
        let sense = taxel.sense();
        taxel.evidence.follow(late, told[index].map_or(0.0, |told| told.step), taxel.baseline, sense);
        taxel.unfit.is_none() && taxel.evidence.shows(sense)
    }

    /// Of each taxel, whether its baseline may be wrong by nobody knows how much.
    pub(crate) fn unknown(&self) -> impl Iterator<Item = bool> + '_ {
        self.taxels.iter().map(|taxel| taxel.untold_s >= UNKNOWN_AFTER_S)
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
        let taxel = Kept { baseline: 100.0, raw_range: [0.0, 1023.0], felt: 12.0, falls: false, mask: false };
        Upkeep::new(keys, [taxel], vec![vec![Some(0)]]).unwrap()
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
                upkeep.close(&[touched], <[bool]>::to_vec);
            }
            upkeep.observe(t_s, &[value(tick)]);
        }
        upkeep.close(&[touched], <[bool]>::to_vec);
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
