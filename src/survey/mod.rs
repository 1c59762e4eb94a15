//! Surveys: what a robot's sensors deliver untouched and pressed, and the calibration that follows from it.
//!
//! At rest a sensor has a **baseline**, the mean of its values without those that stray, and **noise**, the distance from it that one value
//! in a thousand exceeds. While it is pressed it has a **travel**, the farthest that it goes to its pressed side; a value counts as far as
//! it is the middle one of three in succession, so that a single wrong value is not a press. Most of the sensors show which side is the
//! pressed one.
//!
//! A sensor has **moved** during the rest where it strays far, again by the middle ones of three values, and farther than
//! chance explains: the steps from value to value tell how far chance goes, as what moves a sensor takes many values over
//! its way.

mod at_rest;
pub mod crosstalk;
mod figure;
mod file;
pub mod gains;
mod json;
pub mod known;
mod known_curve;
pub mod press_order;
mod presses;
mod remarks;
pub mod scale;
mod travel;
pub mod tuning;
mod unpressed;
mod which_way;

use std::collections::{BTreeMap, BTreeSet};

use crate::body::{Body, Modality, Taxel};
use crate::error::{Error, Result};
use crate::signal::{Channel, RawValue, UnitOfP};

use self::at_rest::{MIN_TRAVEL_BANDS, chance_of, median, movement_of, rest_of, sigma_of};
use self::crosstalk::{Crosstalk, Leaks};
use self::known_curve::KnownCurve;
pub use self::presses::Press;
use self::presses::Presses;
use self::travel::{Pressed, travels};

/// Maximum number of values kept per sensor; a longer rest is decimated by powers of two.
const MAX_REST_VALUES: usize = 4096;
/// Minimum number of values at rest that tell a standard deviation to a quarter of itself.
const MIN_SIGMA_VALUES: usize = 32;
/// Dead band over noise.
const DEAD_BAND_MARGIN: f64 = 1.5;
/// Maximum deviation by random noise, in standard deviations.
const MAX_NOISE_SIGMAS: f64 = 12.0;
/// A dead band is too wide above this share of the raw range where noise does not explain it,
const WIDE_NOISE_SHARE: f64 = 1.0 / 16.0;
/// and above this share where noise or a single wrong value does.
const WIDE_SHARE: f64 = 1.0 / 4.0;
/// Noise over this many times the median is reported.
const LOUD_RATIO: f64 = 5.0;

/// A sensor's baseline and noise; `None` where it delivered nothing.
type AtRest = Option<(f64, f64)>;

/// A survey that is being made. Values of a frame stand in the order of the ids it was begun with, and so do the sensors that feel what
/// presses on them.
#[derive(Clone, Debug)]
pub struct Survey {
    ids: Vec<u32>,
    rest: Vec<Vec<f32>>,
    rest_frames: usize,
    stride: usize,
    pressed: Vec<Pressed>,
    presses: Presses,
    leaks: Leaks,
    /// Baselines and dead bands, from the first press on.
    before_press: Vec<Option<(f64, f64)>>,
    whole_numbers: bool,
    apart: Option<Box<Apart>>,
    /// Taxels with three axes, where the body says so.
    with_axes: BTreeSet<u32>,
}

/// Where values are in a frame that no press shows, and what they deliver at rest.
#[derive(Clone, Debug)]
struct Apart {
    /// All channels of a frame.
    all: Vec<u32>,
    /// The places of those that feel what presses on them.
    own: Vec<usize>,
    /// The places of tangential ones of these taxels.
    tangential: Vec<usize>,
    survey: Survey,
}

/// What is wanted of a calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wishes {
    /// Bits of the converter: raw values are 0 to 2^bits − 1. Without, what many sensors stop at is taken for an end.
    pub bits: Option<u8>,
    /// Give every pressed sensor the gain that makes its travel the median one: for sensors that were all pressed alike.
    pub equalise: bool,
    /// Mask the sensors that moved at rest, where they are an error otherwise: for broken ones.
    pub mask_moved: bool,
}

/// One sensor, as it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    pub id: u32,
    /// Its raw value at rest; `None` where it delivered nothing.
    pub baseline: Option<f64>,
    /// How far it strays from that untouched, in raw units.
    pub noise: f64,
    /// Standard deviation of a raw value at rest, with that of rounding; `None` where it delivered too little to tell.
    pub sigma: Option<f64>,
    /// Pressures up to this one count as 0, in raw units.
    pub dead_band: f64,
    /// How far it went when it was pressed, in raw units; `None` where it was not.
    pub travel: Option<f64>,
    /// The pressure above which it is at the end of its range, in raw units.
    pub full: Option<f64>,
    /// P a raw unit.
    pub gain: f64,
    /// Whether it moved at rest, so that the above says nothing.
    pub moved: bool,
    /// Whether it went to the other side than the sensors' pressed one, so that its baseline is doubtful.
    pub went_other_way: bool,
}

/// What a survey has come to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Findings {
    /// The sensors, in the order of the survey.
    pub sensors: Vec<Found>,
    /// Whether raw values fall when sensors are pressed.
    pub invert: bool,
    /// The raw values that the converter can deliver, where known.
    pub raw_range: Option<[f64; 2]>,
    /// The raw values that were left out as no reading.
    pub missing: Vec<f64>,
    /// What the raw values are in.
    pub unit: UnitOfP,
    /// What presses show on the rows and columns of sensors, if anything.
    pub crosstalk: Option<Crosstalk>,
    /// Presses one after the other.
    pub presses: Vec<Press>,
    /// What every gain is multiplied by, where known forces gave one factor for all.
    pub scale: Option<f64>,
    /// Curves of sensors that several known forces pressed, the last one the middle of them.
    pub curves: Vec<KnownCurve>,
    /// How well known forces agree, in words.
    pub forces_agree: Option<String>,
    /// By tangential channel, its raw value at rest; `None` where it delivered nothing, or moved.
    pub tangential: BTreeMap<u32, Option<f64>>,
    /// By tangential channel, the standard deviation of its raw value at rest, where it delivered enough to tell.
    pub tangential_sigmas: BTreeMap<u32, f64>,
    /// The body's taxels with three axes, which feel shear, whether or not the survey had their tangential values.
    pub with_axes: BTreeSet<u32>,
}

impl Survey {
    #[must_use]
    pub fn new(ids: &[u32]) -> Self {
        Self::split(ids, |_| true)
    }

    /// Of the channels `ids`; `is_pressed` says of a taxel whether it feels what presses on it.
    fn split(ids: &[u32], is_pressed: impl Fn(u32) -> bool) -> Self {
        match Apart::of(ids, is_pressed) {
            Some((own, apart)) => Self { apart: Some(Box::new(apart)), ..Self::of_pressed(&own) },
            None => Self::of_pressed(ids),
        }
    }

    fn of_pressed(ids: &[u32]) -> Self {
        Self {
            ids: ids.to_vec(),
            rest: vec![Vec::new(); ids.len()],
            rest_frames: 0,
            stride: 1,
            pressed: vec![Pressed::default(); ids.len()],
            presses: Presses::default(),
            leaks: Leaks::default(),
            before_press: Vec::new(),
            whole_numbers: true,
            apart: None,
            with_axes: BTreeSet::new(),
        }
    }

    /// The same for sensors of `body`, before any frame: those that feel what presses on them; and looks for crosstalk along their rows and
    /// columns.
    ///
    /// # Errors
    /// As [`crate::field::FieldSet::new`]; a usage error if none of them measures pressure.
    pub fn on(self, body: &Body) -> Result<Self> {
        let all = self.apart.as_ref().map_or(&self.ids, |apart| &apart.all);
        let is_pressed = |id: u32| body.taxel_index(id).is_none_or(|index| body.taxels[index].modality.is_pressed());
        let new = Self::split(all, is_pressed);
        if new.ids.is_empty() && !all.is_empty() {
            let what = "no taxel measures pressure, which a survey is of; write [temperature] and [proximity] by hand";
            return Err(Error::usage(what).at(&body.name));
        }
        let has_axes = |taxel: &&Taxel| taxel.modality == Modality::Force3;
        let with_axes = body.taxels.iter().filter(has_axes).map(|taxel| taxel.id).collect();
        Ok(Self { leaks: Leaks::new(body, &new.ids)?, with_axes, ..new })
    }

    /// Takes the values of a frame in which nothing touches the robot. Missing and faulty ones are left out.
    pub fn rest(&mut self, values: &[RawValue]) {
        if let Some(mut apart) = self.apart.take() {
            let own = apart.rest(values);
            self.rest_of_pressed(&own);
            self.apart = Some(apart);
        } else {
            self.rest_of_pressed(values);
        }
    }

    fn rest_of_pressed(&mut self, values: &[RawValue]) {
        self.rest_frames += 1;
        if !(self.rest_frames - 1).is_multiple_of(self.stride) {
            return;
        }
        if self.rest_frames.div_ceil(self.stride) > MAX_REST_VALUES {
            self.stride *= 2;
            for kept in &mut self.rest {
                let mut index = 0;
                kept.retain(|_| {
                    index += 1;
                    index % 2 == 1
                });
            }
            if !(self.rest_frames - 1).is_multiple_of(self.stride) {
                return;
            }
        }
        for (kept, value) in self.rest.iter_mut().zip(values) {
            if let Some(value) = value.number() {
                kept.push(value as f32);
                self.whole_numbers &= value.fract() == 0.0;
            }
        }
    }

    /// Takes the values of a frame in which sensors are being pressed.
    pub fn press(&mut self, values: &[RawValue]) {
        if let Some(mut apart) = self.apart.take() {
            let own = apart.press(values);
            self.press_of_pressed(&own);
            self.apart = Some(apart);
        } else {
            self.press_of_pressed(values);
        }
    }

    fn press_of_pressed(&mut self, values: &[RawValue]) {
        if self.before_press.is_empty() {
            let rest = |kept: &Vec<f32>| rest_of(kept, self.step()).map(|(at, noise)| (at, self.dead_band(noise)));
            self.before_press = self.rest.iter().map(rest).collect();
        }
        self.leaks.see(values, &self.before_press);
        let step = self.step();
        self.presses.see(values.iter().map(|value| value.number()), &self.before_press, step);
        for (pressed, value) in self.pressed.iter_mut().zip(values) {
            if let Some(value) = value.number() {
                pressed.see(value as f32);
                self.whole_numbers &= value.fract() == 0.0;
            }
        }
    }

    /// What follows from what was seen.
    ///
    /// # Errors
    /// There was no rest, or sensors moved during it, or nothing was pressed; a usage error for bits that no converter has.
    pub fn finish(&self, wishes: Wishes) -> Result<Findings> {
        if wishes.bits.is_some_and(|bits| !(1..=24).contains(&bits)) {
            return Err(Error::usage("a converter has 1 to 24 bits"));
        }
        let at_rest: Vec<AtRest> = self.rest.iter().map(|kept| rest_of(kept, self.step())).collect();
        if at_rest.iter().all(Option::is_none) {
            return Err(Error::failed(
                "no sensor delivered anything at rest; is the source connected and the rest long enough?",
            ));
        }
        let step = self.step();
        let dead_band = |noise: f64| self.dead_band(noise);
        // The two travels of each sensor: downwards and upwards.
        let travels: Vec<[f64; 2]> =
            at_rest.iter().zip(&self.pressed).map(|(rest, pressed)| travels(rest, pressed)).collect();
        let clear = |sensor: usize, side: usize| {
            let band = at_rest[sensor].map_or(f64::INFINITY, |(_, noise)| dead_band(noise).max(step));
            travels[sensor][side] > MIN_TRAVEL_BANDS * band
        };
        let goes =
            |sensor: usize, side: usize| clear(sensor, side) && travels[sensor][side] > travels[sensor][1 - side];
        let count = |side: usize| (0..self.ids.len()).filter(|&sensor| goes(sensor, side)).count();
        let (falling, rising) = (count(0), count(1));
        let raw_range = wishes.bits.map(|bits| [0.0, (1_u32 << bits) as f64 - 1.0]);
        // Where nothing was pressed, what was seen of the range is not a measure.
        let is_range_known = raw_range.is_some() || falling + rising > 0;
        let range = raw_range.map_or_else(|| self.seen_range(), |[low, high]| high - low);
        let moved = self.moved(&at_rest, range, is_range_known);
        if moved.contains(&true) && !wishes.mask_moved {
            return Err(self.not_at_rest(&at_rest, &moved, range));
        }
        let invert = self.falls(&at_rest, &travels, &moved, goes)?;
        let side = usize::from(!invert);
        let [lowest, highest] = self.reach(&at_rest);
        if let Some([low, high]) = raw_range.filter(|[low, high]| lowest < *low || highest > *high) {
            return Err(Error::usage(format!(
                "raw values go from {lowest} to {highest}, and a converter of {} bits gives {low} to {high}; correct --bits, \
                 or leave it out; --missing names raw values that are not readings",
                wishes.bits.unwrap_or_default()
            )));
        }
        let end = match raw_range {
            Some([low, high]) => Some(if invert { low } else { high }),
            None => self.stop_of_many(&at_rest, invert, |sensor| clear(sensor, side)),
        };
        // A sensor may rest far above the way that is left to its end: only with its range can it be calibrated.
        let raw_range = raw_range.or_else(|| end.filter(|_| !invert).map(|end| range_to(end, lowest)));
        let went = |sensor: usize, side: usize| clear(sensor, side).then(|| travels[sensor][side]);
        let mut sensors = self.found(&at_rest, end, |sensor| went(sensor, side));
        for (sensor, found) in sensors.iter_mut().enumerate() {
            (found.moved, found.went_other_way) = (moved[sensor], goes(sensor, 1 - side));
        }
        if wishes.equalise {
            equalise(&mut sensors);
        }
        let mut bands: Vec<f64> = sensors.iter().map(|found| found.dead_band).collect();
        let crosstalk = self.leaks.found(median(&mut bands).unwrap_or(0.0), |band| self.rounded_band(band));
        Ok(Findings {
            sensors,
            invert,
            raw_range,
            missing: Vec::new(),
            unit: UnitOfP::COUNT,
            crosstalk,
            presses: self.presses.all(),
            scale: None,
            curves: Vec::new(),
            forces_agree: None,
            tangential: self.apart.as_ref().map(|apart| apart.baselines(range, is_range_known)).unwrap_or_default(),
            tangential_sigmas: self.apart.as_ref().map(|apart| apart.sigmas()).unwrap_or_default(),
            with_axes: self.with_axes.clone(),
        })
    }

    /// What was found of each sensor by itself, where they go to `end`; `travel` says how far one went.
    fn found(&self, at_rest: &[AtRest], end: Option<f64>, travel: impl Fn(usize) -> Option<f64>) -> Vec<Found> {
        let step = self.step();
        let of = |sensor: usize| {
            let rest = at_rest[sensor];
            let noise = rest.map_or(0.0, |(_, noise)| noise);
            let full = rest.zip(end).map(|((baseline, _), end)| (end - baseline).abs()).filter(|&full| full > 0.0);
            Found {
                id: self.ids[sensor],
                baseline: rest.map(|(baseline, _)| baseline),
                noise,
                sigma: (self.rest[sensor].len() >= MIN_SIGMA_VALUES).then(|| sigma_of(&self.rest[sensor], step)),
                dead_band: self.dead_band(noise),
                travel: travel(sensor),
                // At the end itself it is already full.
                full: full.map(|full| rounded(full - if step > 0.0 { 0.5 * step } else { 1e-3 * full })),
                gain: 1.0,
                moved: false,
                went_other_way: false,
            }
        };
        (0..self.ids.len()).map(of).collect()
    }

    /// The step between raw values: 1 for whole numbers.
    fn step(&self) -> f64 {
        if self.whole_numbers { 1.0 } else { 0.0 }
    }

    /// The dead band for sensors that stray by `noise` at rest.
    fn dead_band(&self, noise: f64) -> f64 {
        self.rounded_band(DEAD_BAND_MARGIN * noise)
    }

    /// `band` as a calibration gives it: whole if raw values are.
    fn rounded_band(&self, band: f64) -> f64 {
        if self.whole_numbers { band.ceil() } else { rounded(band) }
    }

    /// Which sensors moved during the rest, of a raw `range`.
    fn moved(&self, at_rest: &[AtRest], range: f64, is_range_known: bool) -> Vec<bool> {
        let moved = |(at_rest, rest): (&AtRest, &Vec<f32>)| {
            let Some((baseline, noise)) = *at_rest else { return false };
            let movement = movement_of(rest, baseline);
            let by_chance = MAX_NOISE_SIGMAS * chance_of(rest, self.step());
            (self.dead_band(movement) > WIDE_NOISE_SHARE * range && movement > by_chance)
                || (is_range_known && self.dead_band(noise) > WIDE_SHARE * range)
        };
        at_rest.iter().zip(&self.rest).map(moved).collect()
    }

    /// How far apart the raw values of all sensors were, at rest and pressed.
    fn seen_range(&self) -> f64 {
        let at_rest = self.rest.iter().flatten().copied();
        let pressed = self.pressed.iter().filter(|pressed| pressed.seen > 2);
        let all = at_rest.chain(pressed.flat_map(|pressed| [pressed.low, pressed.high]));
        let (low, high) = all.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        (f64::from(high) - f64::from(low)).max(0.0)
    }
}

/// Gives each of `sensors` that was pressed the gain with which it went as far as the middle one.
fn equalise(sensors: &mut [Found]) {
    let mut travels: Vec<f64> = sensors.iter().filter_map(|found| found.travel).collect();
    let Some(usual) = median(&mut travels) else { return };
    for found in sensors {
        found.gain = found.travel.map_or(1.0, |travel| rounded(usual / travel));
    }
}

/// The first few of `ids`, and how many more there are.
fn several(ids: &[u32]) -> String {
    const SHOWN: usize = 12;
    let names: Vec<String> = ids.iter().take(SHOWN).map(|&id| Channel(id).to_string()).collect();
    let rest = if ids.len() > SHOWN { format!(" and {} more", ids.len() - SHOWN) } else { String::new() };
    format!("{}{rest}", names.join(", "))
}

/// `value` with four significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// The range of raw values of sensors that rise to `end` and no further. `lowest` is the lowest value seen. The range begins at
/// 0, or as far down as up.
fn range_to(end: f64, lowest: f64) -> [f64; 2] {
    [if lowest >= 0.0 { 0.0 } else { lowest.min(-end - 1.0) }, end]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(raw: &[f64]) -> Vec<RawValue> {
        raw.iter().map(|&v| RawValue::new(v)).collect()
    }

    /// Four sensors about 250, falling when they are pressed: two to the end, one half-way, one not at all.
    fn hand() -> Survey {
        let mut survey = Survey::new(&[3, 5, 8, 9]);
        for n in 0..1000 {
            let noise = [0.0, 1.0, 0.0, -1.0][n % 4];
            survey.rest(&values(&[250.0 + noise, 240.0 - noise, 245.0, 251.0 + 2.0 * noise]));
        }
        for n in 0..100 {
            let depth = f64::from(n.min(99 - n)) / 49.0;
            // A single wrong value, far beyond.
            let wrong = if n == 3 { 900.0 } else { 245.0 - 120.0 * depth };
            let pressed = [250.0 * (1.0 - depth), 240.0 * (1.0 - depth), wrong, 251.0];
            survey.press(&values(&pressed.map(f64::round)));
        }
        survey
    }

    #[test]
    fn sensors_that_fall_are_found_to_do_so() {
        let found = hand().finish(Wishes { bits: Some(8), ..Wishes::default() }).unwrap();
        assert!(found.invert);
        assert_eq!(found.raw_range, Some([0.0, 255.0]));
        let [a, b, c, d] = found.sensors[..] else { panic!("four went in") };
        assert_eq!((a.baseline, a.noise, a.dead_band, a.travel), (Some(250.0), 1.0, 2.0, Some(250.0)));
        assert_eq!((b.baseline, b.full), (Some(240.0), Some(239.5)));
        assert_eq!((c.noise, c.dead_band, c.travel), (0.0, 0.0, Some(120.0)));
        assert_eq!((d.noise, d.travel), (2.0, None));
        assert_eq!(found.remarks(), ["1 of 4 sensors were not pressed, and so have no travel: 9"]);
    }

    #[test]
    fn equal_presses_get_equal_pressures() {
        let found = hand().finish(Wishes { equalise: true, ..Wishes::default() }).unwrap();
        let gains: Vec<f64> = found.sensors.iter().map(|found| found.gain).collect();
        assert_eq!(gains, [0.96, 1.0, 2.0, 1.0]);
        // Two at one end are not enough to tell it.
        assert!(found.sensors.iter().all(|found| found.full.is_none()));
    }

    #[test]
    fn what_says_nothing_is_refused() {
        let nothing = Survey::new(&[1]).finish(Wishes::default()).unwrap_err().to_string();
        assert!(nothing.contains("no sensor delivered anything"), "{nothing}");
        let mut still = Survey::new(&[1, 2]);
        for _ in 0..50 {
            still.rest(&[RawValue::new(3.0), RawValue::MISSING]);
            still.press(&[RawValue::new(3.0), RawValue::FAULTY]);
        }
        let still = still.finish(Wishes::default()).unwrap_err().to_string();
        assert!(still.contains("no sensor left its rest"), "{still}");
        assert!(hand().finish(Wishes { bits: Some(60), ..Wishes::default() }).unwrap_err().is_usage());
    }

    /// Sensors 3 and 5 of ten bits in a rest of 150 frames: `value` gives the first's, noise the second's; then both are
    /// pressed.
    fn rested(value: impl Fn(usize) -> f64) -> Survey {
        let mut survey = Survey::new(&[3, 5]);
        for n in 0..150 {
            survey.rest(&values(&[value(n).round(), 700.0 + [0.0, 2.0, -1.0][n % 3]]));
        }
        (0..30).for_each(|_| survey.press(&values(&[40.0, 30.0])));
        survey
    }

    #[test]
    fn a_rest_in_which_something_moved_is_refused_by_its_sensors() {
        let press_of = |depth: f64, from: usize| {
            move |n: usize| 900.0 - depth * if n < from { 0.0 } else { ((n - from) as f64 / 10.0).min(1.0) }
        };
        // Whether it is pressed for a while at the end, nearly all the time, or wiggled at.
        let wiggled = |n: usize| 500.0 + 400.0 * (n as f64 * 0.9).sin();
        let glitch = |n: usize| if n == 70 { 20.0 } else { 900.0 };
        let kinds: [&dyn Fn(usize) -> f64; 5] =
            [&press_of(880.0, 120), &press_of(880.0, 5), &press_of(80.0, 100), &wiggled, &glitch];
        for (kind, value) in kinds.into_iter().enumerate() {
            for bits in [Some(10), None] {
                let error = rested(value).finish(Wishes { bits, ..Wishes::default() }).unwrap_err().to_string();
                assert!(error.starts_with("1 of 2 sensors moved during the rest: 3; their dead"), "{kind}: {error}");
            }
        }
        let refused = rested(press_of(880.0, 120)).finish(Wishes { bits: Some(10), ..Wishes::default() });
        assert!(refused.unwrap_err().to_string().contains("up to 1320 of a raw range of 1023. Keep everything off"));
        // A rest that was pressed all over, with nothing pressed afterwards, is reported with its reason, too.
        let mut all = Survey::new(&[3]);
        (0..150).for_each(|n| all.rest(&values(&[press_of(600.0, 90)(n).round()])));
        (0..30).for_each(|_| all.press(&values(&[900.0])));
        assert!(all.finish(Wishes::default()).unwrap_err().to_string().contains("moved during the rest"));
    }

    /// Twelve sensors that rest at 600 and rise to at most 1023; the first is at 900 during all of the rest. `pressed` of them are
    /// pressed, one after the other, the first last.
    fn twelve(pressed: usize) -> Survey {
        let mut survey = Survey::new(&(0..12).collect::<Vec<u32>>());
        (0..100).for_each(|n| {
            let noise = [0.0, 1.0, -1.0][n % 3];
            survey.rest(&values(&[&[900.0 + noise][..], &[600.0 + noise; 11]].concat()));
        });
        for sensor in (0..pressed).rev() {
            (0..9).for_each(|n| {
                let mut row = [600.0; 12];
                row[sensor] = if (2..7).contains(&n) { 1023.0 } else { 600.0 };
                survey.press(&values(&row));
            });
        }
        (0..9).for_each(|_| survey.press(&values(&[600.0; 12])));
        survey
    }

    #[test]
    fn one_sensor_that_was_pressed_during_the_rest_does_not_turn_the_others() {
        let found = twelve(12).finish(Wishes::default()).unwrap();
        assert!(!found.invert && found.sensors[0].went_other_way);
        let masked = "1 of 12 sensors move the other way than the rest of them, and are masked (were they pressed during the rest?): 0";
        assert_eq!(found.remarks(), [masked]);
        assert!(found.calibration("a").contains("[taxel.0]\nmask = true"));
        // Nothing else was pressed: it says nothing of the others.
        let why = twelve(0).finish(Wishes::default()).unwrap_err().to_string();
        assert!(
            why.starts_with("1 of 12 sensors left their rest, and fell without coming back: 0; they may have"),
            "{why}"
        );
        // Nor does one that moved during the rest, and is masked.
        let mut moved = twelve(0);
        moved.rest[0] = (0..100).map(|n| if n < 60 { 900.0 } else { 600.0 }).collect();
        let why = moved.finish(Wishes { mask_moved: true, ..Wishes::default() }).unwrap_err().to_string();
        assert!(why.starts_with("no sensor left its rest"), "{why}");
    }

    #[test]
    fn a_rest_above_the_way_that_is_left_has_a_calibration_without_bits() {
        let found = twelve(12).finish(Wishes::default()).unwrap();
        assert_eq!(found.raw_range, Some([0.0, 1023.0]));
        let ids: Vec<u32> = (0..12).collect();
        let read = crate::Calibration::parse(&found.calibration("a"), &ids).unwrap();
        assert_eq!((read.taxels[5].baseline, read.taxels[5].p_max, read.taxels[5].gain), (600.0, 422.5, 1.0));
        let why = twelve(12).finish(Wishes { bits: Some(8), ..Wishes::default() }).unwrap_err();
        assert!(
            why.is_usage() && why.to_string().starts_with("raw values go from 600 to 1023, and a converter of 8 bits"),
            "{why}"
        );
    }

    #[test]
    fn what_noise_and_slow_drift_explain_is_no_movement() {
        let pseudo =
            |n: usize| ((n * 7919 + 13) % 1009) as f64 / 1009.0 + ((n * 104_729 + 7) % 997) as f64 / 997.0 - 1.0;
        let noisy = move |n: usize| 800.0 + 60.0 * pseudo(n);
        let drifting = move |n: usize| 800.0 + 3.0 * pseudo(n) + 0.2 * n as f64;
        let flickering = |n: usize| 800.0 + if n.is_multiple_of(9) { 1.0 } else { 0.0 };
        let glitch = |n: usize| if n == 70 { 690.0 } else { 800.0 };
        let kinds: [&dyn Fn(usize) -> f64; 4] = [&noisy, &drifting, &flickering, &glitch];
        for (kind, value) in kinds.into_iter().enumerate() {
            for bits in [Some(10), None] {
                let found = rested(value).finish(Wishes { bits, ..Wishes::default() });
                assert!(found.is_ok_and(|found| !found.sensors[0].moved), "{kind}");
            }
        }
    }

    #[test]
    fn sigma_is_that_of_the_noise_and_its_rounding() {
        // Of twelve uniform numbers each: normal enough.
        let noise = |n: usize| -> f64 {
            let mixed = |k: usize| {
                let x = ((n * 12 + k) as u64).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
                let x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
                let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
                x ^ (x >> 31)
            };
            let unit = |k: usize| (mixed(k) >> 11) as f64 / 9_007_199_254_740_992.0;
            (0..12).map(unit).sum::<f64>() - 6.0
        };
        let measured_noise = |value: &dyn Fn(usize) -> f64, unit: f64| {
            let kept: Vec<f32> = (0..4000).map(|n| value(n) as f32).collect();
            sigma_of(&kept, unit)
        };
        // Its own standard deviation is about σ/√(4000/1.5).
        let near = |found: f64, right: f64| (found / right - 1.0).abs() < 0.08;
        assert!(near(measured_noise(&|n| 3.0 * noise(n), 0.0), 3.0));
        assert!(near(measured_noise(&|n| (0.7 * noise(n)).round(), 1.0), (0.49_f64 + 1.0 / 12.0).sqrt()));
        assert!(near(measured_noise(&|n| 3.0 * noise(n) + 0.01 * n as f64, 0.0), 3.0), "drift adds nothing");
        assert!(
            near(measured_noise(&|n| if n % 500 == 9 { 900.0 } else { 3.0 * noise(n) }, 0.0), 3.0),
            "nor do wrong values"
        );
        assert_eq!(measured_noise(&|_| 700.0, 1.0), 1.0 / 12.0_f64.sqrt());
        assert_eq!(hand().finish(Wishes::default()).unwrap().sensors[0].sigma.is_some(), hand().rest[0].len() >= 32);
    }

    #[test]
    fn a_baseline_of_whole_counts_is_known_to_a_tenth_of_one() {
        // Triangular noise about 512.37, in whole counts, with one wrong value.
        let noise = |n: usize| ((n * 7_919 % 1009) as f64 + (n * 104_729 % 1013) as f64) / 1011.0 - 1.0;
        let kept: Vec<f32> =
            (0..1000).map(|n| if n == 505 { 900.0 } else { (512.37 + 1.7 * noise(n)).round() as f32 }).collect();
        let (baseline, strays) = rest_of(&kept, 1.0).unwrap();
        assert!((baseline - 512.37).abs() < 0.1, "{baseline}");
        assert!(strays > 1.0 && strays < 3.0, "{strays}");
        assert_eq!(rest_of(&[700.0; 40], 1.0), Some((700.0, 0.0)));
        assert_eq!(rest_of(&[], 1.0), None);
        // At the end of the range noise goes one way only.
        let cut: Vec<f32> = (0..1000).map(|n| (1023.0 + 4.0 * noise(n)).round().min(1023.0) as f32).collect();
        assert_eq!(rest_of(&cut, 1.0).unwrap().0, 1023.0);
    }

    #[test]
    fn sensors_that_moved_are_masked_if_that_is_wished() {
        let survey = rested(|n| if n.is_multiple_of(50) { 20.0 } else { 900.0 });
        let found = survey.finish(Wishes { bits: Some(10), mask_moved: true, ..Wishes::default() }).unwrap();
        assert_eq!(found.sensors.iter().map(|found| found.moved).collect::<Vec<_>>(), [true, false]);
        assert_eq!(found.remarks(), ["1 of 2 sensors moved at rest, and are masked: 3"]);
        let text = found.calibration("hand");
        assert!(text.contains("[taxel.3]\nmask = true") && text.contains("dead_band = 3\n"), "{text}");
    }

    #[test]
    fn a_long_rest_takes_no_more_memory() {
        let mut survey = Survey::new(&[1]);
        for n in 0..100_000 {
            survey.rest(&[RawValue::new(f64::from(n % 11))]);
        }
        assert!(
            survey.rest[0].len() <= MAX_REST_VALUES && survey.rest[0].len() > MAX_REST_VALUES / 4,
            "{}",
            survey.rest[0].len()
        );
        let (baseline, noise) = rest_of(&survey.rest[0], 1.0).unwrap();
        assert!((baseline - 5.0).abs() < 0.02 && (noise - 5.0).abs() < 0.02, "{baseline} {noise}");
    }
}
