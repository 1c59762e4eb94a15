//! Contacts of a field from how hard it is pressed over time: a threshold with hysteresis and a shortest time.

use std::str::FromStr;

use crate::error::{Error, Result};
use crate::signal::{Quantity, UnitOfP};

/// A contact ends at this share of where it begins.
const OFF_SHARE: f64 = 0.5;
/// Above that a foot stands, where newtons are known and any field is pressed as much.
const STANCE_NEWTON: f64 = 20.0;
/// Above that share of its peak a field is in contact otherwise.
const SHARE_OF_PEAK: f64 = 0.05;
/// Gaps in time that are longer are not part of integrals, s.
const LONGEST_STEP_S: f64 = 1.0;

/// Where contacts begin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Threshold {
    Newton(f64),
    /// Share of a field's peak.
    Share(f64),
}

impl FromStr for Threshold {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let bad = || Error::usage(format!("{text} is not a threshold; write a force, 20N, or a share of the peak, 5%"));
        let text = text.trim();
        if let Some(share) = text.strip_suffix('%') {
            let share: f64 = share.trim().parse().map_err(|_| bad())?;
            return if (0.0..100.0).contains(&share) { Ok(Self::Share(share / 100.0)) } else { Err(bad()) };
        }
        let end = text.find(|c: char| c.is_alphabetic()).unwrap_or(text.len());
        let number: f64 = text[..end].trim().parse().map_err(|_| bad())?;
        let unit: UnitOfP = text[end..].parse().map_err(|_| bad())?;
        let newtons = number * unit.factor;
        let is_force = unit.quantity == Quantity::Newton && newtons.is_finite() && newtons >= 0.0;
        if is_force { Ok(Self::Newton(newtons)) } else { Err(bad()) }
    }
}

/// What is asked of contacts.
#[derive(Clone, Copy, Debug)]
pub struct Rule {
    /// `None`: 20 N where newtons are known, else 5 % of the peak.
    pub threshold: Option<Threshold>,
    /// Shorter contacts do not count, s.
    pub shortest_s: f64,
}

impl Default for Rule {
    fn default() -> Self {
        Self { threshold: None, shortest_s: 0.05 }
    }
}

impl Rule {
    /// The load above which a contact of a field begins whose peak is `peak`, in newtons if `is_force`; `newtons` is the largest force of
    /// all fields.
    pub fn over(&self, peak: f64, is_force: bool, newtons: f64) -> Result<f64> {
        match self.threshold {
            Some(Threshold::Newton(_)) if !is_force => Err(Error::usage(
                "--threshold is a force, and there are no newtons here; give a share of the peak, such as 5%",
            )),
            Some(Threshold::Newton(newtons)) => Ok(newtons),
            Some(Threshold::Share(share)) => Ok(share * peak),
            None if is_force && newtons >= STANCE_NEWTON => Ok(STANCE_NEWTON),
            None => Ok(SHARE_OF_PEAK * peak),
        }
    }
}

/// A field in a frame in which it is pressed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Which of the recording's frames it is.
    pub frame: u32,
    /// ΣP.
    pub total: f32,
    /// N; NaN where it is not known, as the next three.
    pub force: f32,
    /// The largest P.
    pub peak: f32,
    /// m².
    pub area: f32,
    /// The centre of pressure in the field's chart, m.
    pub centroid: [f32; 2],
}

impl Sample {
    /// Force where it is known, else the total.
    pub(super) fn load(&self) -> f64 {
        if self.force.is_nan() { self.total.into() } else { self.force.into() }
    }
}

/// A contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Episode {
    pub onset_s: f64,
    /// The time of the first frame after it, or of the recording's last one.
    pub offset_s: f64,
    /// Whether it begins and ends within the recording.
    pub is_whole: bool,
    /// Which of the samples.
    pub from: usize,
    pub to: usize,
}

impl Episode {
    pub fn lasts_s(&self) -> f64 {
        // Where recorded time goes back, nothing is known of how long it lasted.
        (self.offset_s - self.onset_s).max(0.0)
    }
}

/// The contacts in `samples`, whose frames are at `times_s`, that begin above `over` and last for `shortest_s`.
pub(super) fn episodes(samples: &[Sample], times_s: &[f64], over: f64, shortest_s: f64) -> Vec<Episode> {
    let mut found: Vec<Episode> = Vec::new();
    let mut begun: Option<usize> = None;
    let time = |frame: u32| times_s[(frame as usize).min(times_s.len() - 1)];
    let mut end = |from: usize, to: usize, after: u32| {
        let is_whole = samples[from].frame > 0 && (after as usize) < times_s.len();
        let episode = Episode { onset_s: time(samples[from].frame), offset_s: time(after), is_whole, from, to };
        // One that is cut may have been longer, and so may one in which time goes back.
        if episode.lasts_s() >= shortest_s || !is_whole || episode.offset_s < episode.onset_s {
            found.push(episode);
        }
    };
    for (index, sample) in samples.iter().enumerate() {
        if let Some(from) = begun {
            let before = samples[index - 1].frame;
            let goes_on = sample.frame == before + 1 && sample.load() > OFF_SHARE * over;
            if !goes_on {
                end(from, index, before + 1);
                begun = None;
            }
        }
        if begun.is_none() && sample.load() > over {
            begun = Some(index);
        }
    }
    if let Some(from) = begun {
        end(from, samples.len(), samples[samples.len() - 1].frame + 1);
    }
    found
}

/// What a contact comes to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Summary {
    /// The largest force, N, and force over time, N s.
    pub force: Option<[f64; 2]>,
    /// The largest ΣP, and ΣP over time.
    pub total: [f64; 2],
    /// The largest P, and the largest P of every frame over time.
    pub peak: Option<[f64; 2]>,
    /// The largest area, m².
    pub area_m2: Option<f64>,
    /// How far the centre of pressure went, m.
    pub path_m: Option<f64>,
}

/// What the `samples` of one contact come to, whose frames are at `times_s`.
pub(super) fn summary(samples: &[Sample], times_s: &[f64]) -> Summary {
    let steps = || {
        samples.windows(2).filter_map(|pair| {
            let step_s = times_s[pair[1].frame as usize] - times_s[pair[0].frame as usize];
            (step_s > 0.0 && step_s <= LONGEST_STEP_S).then_some((pair, step_s))
        })
    };
    let both = |of: &dyn Fn(&Sample) -> f32| {
        let most = samples
            .iter()
            .map(of)
            .filter(|value| !value.is_nan())
            .fold(None, |most: Option<f32>, value| Some(most.map_or(value, |most| most.max(value))))?;
        let over_time =
            steps().map(|(pair, step_s)| 0.5 * step_s * (f64::from(of(&pair[0])) + f64::from(of(&pair[1]))));
        Some([f64::from(most), over_time.filter(|part| !part.is_nan()).sum::<f64>()])
    };
    let ways = samples.windows(2).filter_map(|pair| {
        let [dx, dy] = [0, 1].map(|axis| f64::from(pair[1].centroid[axis]) - f64::from(pair[0].centroid[axis]));
        let way = dx.hypot(dy);
        (!way.is_nan()).then_some(way)
    });
    let is_placed = samples.iter().any(|sample| !sample.centroid[0].is_nan());
    Summary {
        force: both(&|sample| sample.force),
        total: both(&|sample| sample.total).unwrap_or_default(),
        peak: both(&|sample| sample.peak),
        area_m2: both(&|sample| sample.area).map(|[most, _]| most),
        path_m: is_placed.then(|| ways.sum()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples at 10 ms with these forces, without those that are 0.
    fn pressed(forces: &[f32]) -> (Vec<Sample>, Vec<f64>) {
        let sample = |(frame, &force): (usize, &f32)| Sample {
            frame: frame as u32,
            total: 10.0 * force,
            force,
            peak: 2.0 * force,
            area: f32::NAN,
            centroid: [0.001 * frame as f32, 0.0],
        };
        let samples = forces.iter().enumerate().map(sample).filter(|sample| sample.force > 0.0).collect();
        (samples, (0..forces.len()).map(|frame| 0.01 * frame as f64).collect())
    }

    #[test]
    fn a_flicker_is_no_stance_and_a_dip_is_no_end() {
        let mut forces = vec![0.0; 10];
        forces.extend([3.0; 4]);
        forces.extend([0.0; 4]);
        // A stance with a dip under 20 N, and one frame over it.
        forces.extend([300.0, 500.0, 15.0, 600.0, 400.0, 200.0, 8.0, 0.0, 90.0, 0.0, 0.0]);
        let (samples, times) = pressed(&forces);
        let found = episodes(&samples, &times, 20.0, 0.05);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!((found[0].onset_s - 0.18).abs() < 1e-9 && (found[0].offset_s - 0.24).abs() < 1e-9, "{found:?}");
        assert!(found[0].is_whole);
        // One frame of 90 N counts where it may be short; and the flicker where any load is a contact.
        assert_eq!(episodes(&samples, &times, 20.0, 0.0).len(), 2);
        assert_eq!(episodes(&samples, &times, 0.0, 0.0).len(), 3);
    }

    #[test]
    fn contacts_that_are_cut_by_the_recording_are_not_whole() {
        let (samples, times) = pressed(&[50.0, 0.0, 0.0, 60.0]);
        let found = episodes(&samples, &times, 20.0, 0.05);
        assert_eq!(found.iter().map(|episode| episode.is_whole).collect::<Vec<_>>(), [false, false]);
    }

    #[test]
    fn integrals_are_over_time_and_leave_gaps_out() {
        let (samples, mut times) = pressed(&[100.0, 200.0, 200.0, 100.0]);
        times[3] = 9.0;
        let Summary { force, total, peak, area_m2, path_m } = summary(&samples, &times);
        let near = |pair: [f64; 2], right: [f64; 2]| pair.iter().zip(right).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(near(force.unwrap(), [200.0, 3.5]) && near(total, [2000.0, 35.0]) && near(peak.unwrap(), [400.0, 7.0]));
        assert!(area_m2.is_none() && (path_m.unwrap() - 0.003).abs() < 1e-6);
    }

    #[test]
    fn a_threshold_is_a_force_or_a_share() {
        let read = |text: &str| text.parse::<Threshold>();
        assert_eq!(read("20N").unwrap(), Threshold::Newton(20.0));
        assert_eq!(read("5 %").unwrap(), Threshold::Share(0.05));
        for wrong in ["20", "5kPa", "-1N", "100%", "x%"] {
            assert!(read(wrong).unwrap_err().is_usage(), "{wrong}");
        }
        let rule = Rule { threshold: None, shortest_s: 0.05 };
        assert_eq!(rule.over(3.0, true, 800.0).unwrap(), 20.0, "a foot that is off the ground");
        assert_eq!(rule.over(3.0, true, 3.0).unwrap(), 0.05 * 3.0, "a fingertip");
        assert_eq!(rule.over(100.0, false, 0.0).unwrap(), 5.0);
        let force = Rule { threshold: Some(Threshold::Newton(5.0)), ..rule };
        assert!(force.over(100.0, false, 0.0).unwrap_err().is_usage());
    }
}
