//! Surveys: what a robot's sensors deliver untouched and pressed, and the calibration that follows from it.
//!
//! At rest a sensor has a **baseline**, the median of its values, and **noise**, the distance from it that one value in a
//! thousand exceeds. While it is pressed it has a **travel**, the farthest that it goes to its pressed side; a value counts
//! as far as it is the middle one of three in succession, so that a single wrong value is no press. Which side is the
//! pressed one is told by most of the sensors.

mod figure;
mod file;
pub mod tuning;

use crate::error::{Error, Result};
use crate::signal::RawValue;

/// Values of a sensor that are kept, at most; of a longer rest every second, fourth and so on.
const MOST: usize = 4096;
/// The share of values at rest that noise may exceed.
const EXCEEDED: f64 = 1e-3;
/// The dead band over the noise.
const MARGIN: f64 = 1.5;
/// A travel under this many dead bands is no press.
const CLEAR: f64 = 3.0;
/// Noise over this many times that of most sensors is worth a word.
const LOUD: f64 = 5.0;

/// A survey that is being made. Sensors stand in the order of the ids it was begun with, and so do the values of a frame.
#[derive(Clone, Debug)]
pub struct Survey {
    ids: Vec<u32>,
    rest: Vec<Vec<f32>>,
    rest_frames: usize,
    stride: usize,
    pressed: Vec<Pressed>,
    whole_numbers: bool,
}

/// What was seen of a sensor while it was pressed.
#[derive(Clone, Copy, Debug)]
struct Pressed {
    last: [f32; 2],
    seen: usize,
    low: f32,
    high: f32,
}

impl Default for Pressed {
    fn default() -> Self {
        Self { last: [0.0; 2], seen: 0, low: f32::INFINITY, high: f32::NEG_INFINITY }
    }
}

impl Pressed {
    fn see(&mut self, value: f32) {
        if self.seen >= 2 {
            let [a, b] = self.last;
            let middle = a.max(b).min(a.min(b).max(value));
            (self.low, self.high) = (self.low.min(middle), self.high.max(middle));
        }
        self.last = [self.last[1], value];
        self.seen += 1;
    }
}

/// What is wanted of a calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wishes {
    /// Bits of the converter: raw values are 0 to 2^bits − 1. Without, what many sensors stop at is taken for an end.
    pub bits: Option<u8>,
    /// Give every pressed sensor the gain that makes its travel the median one: for sensors that were all pressed alike.
    pub equalise: bool,
}

/// One sensor, as it was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// The taxel's id.
    pub id: u32,
    /// Its raw value at rest; `None` where it delivered nothing.
    pub baseline: Option<f64>,
    /// How far it strays from that untouched, in raw units.
    pub noise: f64,
    /// Pressures up to this one count as 0, in raw units.
    pub dead_band: f64,
    /// How far it went when it was pressed, in raw units; `None` where it was not.
    pub travel: Option<f64>,
    /// The pressure above which it is at the end of its range, in raw units.
    pub full: Option<f64>,
    /// P a raw unit.
    pub gain: f64,
}

/// What a survey has come to.
#[derive(Clone, Debug, PartialEq)]
pub struct Findings {
    /// The sensors, in the order of the survey.
    pub sensors: Vec<Found>,
    /// Whether raw values fall when sensors are pressed.
    pub invert: bool,
    /// The raw values that the converter can deliver, where known.
    pub raw_range: Option<[f64; 2]>,
}

impl Survey {
    /// A survey of the sensors `ids`.
    #[must_use]
    pub fn new(ids: &[u32]) -> Self {
        Self {
            ids: ids.to_vec(),
            rest: vec![Vec::new(); ids.len()],
            rest_frames: 0,
            stride: 1,
            pressed: vec![Pressed::default(); ids.len()],
            whole_numbers: true,
        }
    }

    /// Takes the values of a frame in which nothing touches the robot. Missing and faulty ones are left out.
    pub fn rest(&mut self, values: &[RawValue]) {
        self.rest_frames += 1;
        if !(self.rest_frames - 1).is_multiple_of(self.stride) {
            return;
        }
        if self.rest_frames.div_ceil(self.stride) > MOST {
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
        for (pressed, value) in self.pressed.iter_mut().zip(values) {
            if let Some(value) = value.number() {
                pressed.see(value as f32);
                self.whole_numbers &= value.fract() == 0.0;
            }
        }
    }

    /// Frames at rest so far.
    #[must_use]
    pub fn rest_frames(&self) -> usize {
        self.rest_frames
    }

    /// What follows from what was seen.
    ///
    /// # Errors
    /// There was no rest, or nothing was pressed; a usage error for bits that no converter has.
    pub fn finish(&self, wishes: Wishes) -> Result<Findings> {
        if wishes.bits.is_some_and(|bits| !(1..=24).contains(&bits)) {
            return Err(Error::usage("a converter has 1 to 24 bits"));
        }
        let at_rest: Vec<Option<(f64, f64)>> = self.rest.iter().map(|kept| rest_of(kept)).collect();
        if at_rest.iter().all(Option::is_none) {
            return Err(Error::failed(
                "no sensor delivered anything at rest; is the source connected and the rest long enough?",
            ));
        }
        let step = if self.whole_numbers { 1.0 } else { 0.0 };
        let dead_band = |noise: f64| {
            let band = MARGIN * noise;
            if self.whole_numbers { band.ceil() } else { rounded(band) }
        };
        // The two travels of each sensor: downwards and upwards.
        let travels: Vec<[f64; 2]> =
            at_rest.iter().zip(&self.pressed).map(|(rest, pressed)| travels(rest, pressed)).collect();
        let clear = |sensor: usize, side: usize| {
            let band = at_rest[sensor].map_or(f64::INFINITY, |(_, noise)| dead_band(noise).max(step));
            travels[sensor][side] > CLEAR * band
        };
        let votes = |side: usize| {
            (0..self.ids.len()).filter(|&i| clear(i, side) && travels[i][side] > travels[i][1 - side]).count()
        };
        let (falling, rising) = (votes(0), votes(1));
        if falling + rising == 0 {
            return Err(Error::failed("no sensor left its rest; press every sensor firmly once the rest is over"));
        }
        let invert = falling > rising;
        let side = usize::from(!invert);
        let raw_range = wishes.bits.map(|bits| [0.0, (1_u32 << bits) as f64 - 1.0]);
        let end = match raw_range {
            Some([low, high]) => Some(if invert { low } else { high }),
            None => self.stop_of_many(invert, |sensor| clear(sensor, side)),
        };
        let pressed: Vec<Option<f64>> =
            (0..self.ids.len()).map(|sensor| clear(sensor, side).then(|| travels[sensor][side])).collect();
        let mut known: Vec<f64> = pressed.iter().copied().flatten().collect();
        let usual = median(&mut known);
        let sensors = (0..self.ids.len()).map(|sensor| {
            let rest = at_rest[sensor];
            let noise = rest.map_or(0.0, |(_, noise)| noise);
            let full = rest.zip(end).map(|((baseline, _), end)| (end - baseline).abs()).filter(|&full| full > 0.0);
            Found {
                id: self.ids[sensor],
                baseline: rest.map(|(baseline, _)| baseline),
                noise,
                dead_band: dead_band(noise),
                travel: pressed[sensor],
                // At the end itself it is already full.
                full: full.map(|full| rounded(full - if step > 0.0 { 0.5 * step } else { 1e-3 * full })),
                gain: match (pressed[sensor], usual) {
                    (Some(travel), Some(usual)) if wishes.equalise => rounded(usual / travel),
                    _ => 1.0,
                },
            }
        });
        Ok(Findings { sensors: sensors.collect(), invert, raw_range })
    }

    /// The raw value that at least three pressed sensors, and a tenth of them, went to and never beyond.
    fn stop_of_many(&self, invert: bool, is_pressed: impl Fn(usize) -> bool) -> Option<f64> {
        let ends = (0..self.ids.len()).filter(|&sensor| is_pressed(sensor));
        let mut ends: Vec<f32> =
            ends.map(|i| if invert { self.pressed[i].low } else { self.pressed[i].high }).collect();
        ends.sort_by(f32::total_cmp);
        let end = if invert { *ends.first()? } else { *ends.last()? };
        let there = ends.iter().filter(|&&other| other == end).count();
        (there >= 3 && 10 * there >= ends.len()).then(|| end.into())
    }
}

/// A sensor's baseline and noise from its values at rest.
fn rest_of(kept: &[f32]) -> Option<(f64, f64)> {
    let mut values: Vec<f64> = kept.iter().map(|&value| value.into()).collect();
    let baseline = median(&mut values)?;
    let mut strays: Vec<f64> = values.iter().map(|value| (value - baseline).abs()).collect();
    strays.sort_by(f64::total_cmp);
    let rank = ((1.0 - EXCEEDED) * strays.len() as f64).ceil() as usize;
    Some((baseline, strays[rank.clamp(1, strays.len()) - 1]))
}

/// How far a sensor went down and up from its baseline.
fn travels(rest: &Option<(f64, f64)>, pressed: &Pressed) -> [f64; 2] {
    match rest {
        Some((baseline, _)) if pressed.seen > 2 => {
            [(baseline - f64::from(pressed.low)).max(0.0), (f64::from(pressed.high) - baseline).max(0.0)]
        }
        _ => [0.0; 2],
    }
}

/// The middle value, the lower of two; sorts them.
fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len().checked_sub(1)? / 2).copied()
}

/// `value` with four significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

impl Findings {
    /// What a person should know of it, a line each.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        let ids = |is: &dyn Fn(&Found) -> bool| -> Vec<u32> {
            self.sensors.iter().filter(|found| is(found)).map(|found| found.id).collect()
        };
        let mut noises: Vec<f64> = self.sensors.iter().filter(|f| f.baseline.is_some()).map(|f| f.noise).collect();
        let usual = median(&mut noises).unwrap_or(0.0);
        let at_its_end = |found: &Found| match (self.raw_range, found.baseline) {
            (Some([low, high]), Some(baseline)) => baseline == if self.invert { low } else { high },
            _ => false,
        };
        let kinds: [(&str, Vec<u32>); 4] = [
            ("delivered nothing at rest, and are masked", ids(&|found| found.baseline.is_none())),
            ("stand at the end of their range untouched, and are masked", ids(&at_its_end)),
            (
                "were not pressed, and so have no travel",
                ids(&|f| f.baseline.is_some() && f.travel.is_none() && !at_its_end(f)),
            ),
            ("are far noisier than the others at rest", ids(&|found| usual > 0.0 && found.noise > LOUD * usual)),
        ];
        let several = |ids: &[u32]| {
            const SHOWN: usize = 12;
            let names: Vec<String> = ids.iter().take(SHOWN).map(ToString::to_string).collect();
            let rest = if ids.len() > SHOWN { format!(" and {} more", ids.len() - SHOWN) } else { String::new() };
            format!("{}{rest}", names.join(", "))
        };
        kinds
            .into_iter()
            .filter(|(_, ids)| !ids.is_empty())
            .map(|(what, ids)| format!("{} of {} sensors {what}: {}", ids.len(), self.sensors.len(), several(&ids)))
            .collect()
    }

    /// Whether nothing can be felt through `found`.
    fn is_lost(&self, found: &Found) -> bool {
        let end = self.raw_range.map(|[low, high]| if self.invert { low } else { high });
        found.baseline.is_none() || found.baseline == end
    }
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
        let found = hand().finish(Wishes { bits: Some(8), equalise: false }).unwrap();
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
        let found = hand().finish(Wishes { bits: None, equalise: true }).unwrap();
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
        assert!(hand().finish(Wishes { bits: Some(60), equalise: false }).unwrap_err().is_usage());
    }

    #[test]
    fn a_long_rest_takes_no_more_memory() {
        let mut survey = Survey::new(&[1]);
        for n in 0..100_000 {
            survey.rest(&[RawValue::new(f64::from(n % 11))]);
        }
        assert!(survey.rest[0].len() <= MOST && survey.rest[0].len() > MOST / 4, "{}", survey.rest[0].len());
        assert_eq!(rest_of(&survey.rest[0]), Some((5.0, 5.0)));
    }
}
