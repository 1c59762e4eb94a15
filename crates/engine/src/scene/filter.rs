//! Which motion counts: the window of the filter of motion and its time constant.

use std::str::FromStr;

use crate::error::{Error, Result};
use crate::length::Length;
use crate::stage::filter::{FilterBy, Settings};
use crate::stage::layout::Still;

/// Which motion counts, for [`Outputs::FILTERED`](crate::percept::Outputs::FILTERED).
///
/// A centroid counts when it has come from the last one that counted as far as a window says: nearer it is held back
/// until motion has added up, farther it is taken for another touch. The direction of the steps that count is averaged
/// over time.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct MotionFilter {
    /// The window's low end, m, where motion is measured by the window; `None` is a sixteenth of the spacing of each field's taxels, about
    /// what noise feigns, and at most a third of the high end.
    pub low_m: Option<f64>,
    /// The window's high end, m; `None` is three times that spacing, as far as a touch may leap and stay the same one, and
    /// at least three times the low end.
    pub high_m: Option<f64>,
    /// What the window measures.
    pub by: FilterBy,
    /// The time constant τ of the filtered direction, s; with 0 each step that counts stands for itself.
    pub time_constant_s: f64,
    /// Measure motion over this time, s, from the centroid that long ago: steadier than frame by frame, half of that time late. The
    /// window's high end still tells another touch. `None` measures by the window instead. The default is 0.2 s.
    pub over_s: Option<f64>,
}

/// Shares of a field's spacing that are its window where none is given. On the bundled hand's back a sixteenth is 0.48 mm:
/// over 3 s, noise of 3 counts spreads a resting rod's linearised centroid over 0.40 mm, of 1.5 counts over 0.20 mm.
const LOW: f64 = 1.0 / 16.0;
const HIGH: f64 = 3.0;
/// How many times its low end the high end of a window is at least, unless both are given.
const APART: f64 = 3.0;
/// The time over which motion is measured, s: as the velocity of touches.
const OVER_S: f64 = 0.2;

impl Default for MotionFilter {
    fn default() -> Self {
        Self { low_m: None, high_m: None, by: FilterBy::Distance, time_constant_s: 0.1, over_s: Some(OVER_S) }
    }
}

setters!(MotionFilter {
    low_m: impl Into<Option<f64>>,
    high_m: impl Into<Option<f64>>,
    by: FilterBy,
    time_constant_s: f64,
    over_s: impl Into<Option<f64>>,
});

impl MotionFilter {
    /// The same with the window that `text` says: `0.5mm..20mm`, where either end may be left out. With a low end, motion is measured
    /// by the window, and no longer over a time.
    ///
    /// Lengths are in `um`, `mm`, `cm` or `m`; the low end may go without a unit where the high end has one, the high end
    /// may be `inf`.
    ///
    /// # Errors
    /// `text` is not such a window, or one that lets nothing pass.
    pub fn with_window(self, text: &str) -> Result<Self> {
        let wrong = |what: &str| {
            Error::usage(format!(
                "`{text}` is not a window of lengths: {what}; write one like 0.5mm..20mm, 0.5mm.. or ..20mm"
            ))
        };
        let (low, high) = text.split_once("..").ok_or_else(|| wrong("two dots are missing"))?;
        let high_end = Length::parse(high.trim()).map_err(|what| wrong(&what))?;
        let low_end = Length::parse(low.trim()).map_err(|what| wrong(&what))?;
        let unit = high_end.and_then(|end| end.unit_m);
        let metres = |end: Option<Length>, unit: Option<f64>| match end {
            Some(Length { number, unit_m }) => match unit_m.or(unit) {
                Some(unit_m) => Ok(Some(number * unit_m)),
                None if number == 0.0 || number == f64::INFINITY => Ok(Some(number)),
                None => Err(wrong(&format!("{number} has no unit"))),
            },
            None => Ok(None),
        };
        let (low_m, high_m) = (metres(low_end, unit)?, metres(high_end, None)?);
        let filter = Self { low_m, high_m, over_s: self.over_s.filter(|_| low_m.is_none()), ..self };
        filter.check()?;
        Ok(filter)
    }

    fn check(&self) -> Result<()> {
        let mm = |metres: f64| format!("{} mm", metres * 1e3);
        let nothing_passes = |ends: String, what: &str| -> Result<()> {
            Err(Error::usage(format!("a window of motion {ends} lets nothing pass; {what}")))
        };
        match (self.low_m, self.high_m) {
            (Some(low), _) if !(low.is_finite() && low >= 0.0) => {
                nothing_passes(format!("from {}", mm(low)), "give a length from 0")?;
            }
            (_, Some(high)) if high.is_nan() || high <= 0.0 => {
                nothing_passes(format!("to {}", mm(high)), "give a length over 0")?;
            }
            (Some(low), Some(high)) if low > high => {
                nothing_passes(format!("from {} to {}", mm(low), mm(high)), "give the smaller first")?;
            }
            _ => {}
        }
        if !(self.time_constant_s.is_finite() && self.time_constant_s >= 0.0) {
            return Err(Error::usage(format!(
                "a filter time of {} is not a time span; give seconds from 0",
                self.time_constant_s
            )));
        }
        match self.over_s {
            Some(over) if !(over.is_finite() && over > 0.0) => {
                Err(Error::usage(format!("motion over {over} s is undefined; give seconds over 0")))
            }
            _ => Ok(()),
        }
    }

    /// What that is for a field whose taxels lie about `spacing_m` apart, and which counts as `still` in units of `unit_m`.
    pub(crate) fn settings(&self, spacing_m: f64, still: Still, unit_m: f64) -> Result<Settings> {
        self.check()?;
        let high = self.high_m.unwrap_or_else(|| (HIGH * spacing_m).max(APART * self.low_m.unwrap_or(0.0)));
        let low = self.low_m.unwrap_or_else(|| (LOW * spacing_m).min(high / APART));
        Ok(Settings {
            window_m: [low, high],
            by: self.by,
            time_constant_s: self.time_constant_s,
            over_s: self.over_s,
            still,
            unit_m,
        })
    }
}

impl FromStr for FilterBy {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        match name {
            "distance" => Ok(Self::Distance),
            "radial" => Ok(Self::Radial),
            _ => Err(Error::usage(format!("motion is not filtered by `{name}`; choose distance or radial"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_is_read_with_its_units_and_completed_from_the_spacing() {
        for (text, [low, high]) in [
            ("0.5mm..20mm", [0.5e-3, 20e-3]),
            ("0.5..20mm", [0.5e-3, 20e-3]),
            ("500um .. 2 cm", [0.5e-3, 20e-3]),
            ("500µm..0.02m", [0.5e-3, 20e-3]),
            ("..20mm", [1e-3, 20e-3]),
            ("2mm..", [2e-3, 48e-3]),
            ("..", [1e-3, 48e-3]),
            ("0..inf", [0.0, f64::INFINITY]),
        ] {
            let filter = MotionFilter::default().with_window(text).unwrap_or_else(|e| panic!("{text}: {e}"));
            let window_m = filter.settings(16e-3, Still::default(), 1.0).unwrap().window_m;
            let near = |a: f64, b: f64| a == b || (a - b).abs() < 1e-15;
            assert!(near(window_m[0], low) && near(window_m[1], high), "{text}: {window_m:?}");
        }
    }

    #[test]
    fn what_is_no_window_is_refused_in_one_line() {
        for (text, why) in [
            ("5mm", "two dots"),
            ("1..2", "has no unit"),
            ("1mm..2", "has no unit"),
            ("1..", "has no unit"),
            ("one..2mm", "`one` is not a length"),
            ("1mm...2mm", "the smaller first"),
            ("1mm..2km", "`2km` is not a length"),
            ("3mm..1mm", "give the smaller first"),
            ("-1mm..2mm", "from -1 mm"),
            ("nan..2mm", "from NaN mm"),
            ("inf..inf", "from inf mm"),
            ("1mm..nanmm", "to NaN mm"),
            ("..0mm", "to 0 mm"),
            ("..-2mm", "to -2 mm"),
        ] {
            let error = MotionFilter::default().with_window(text).expect_err(text);
            let words = error.to_string();
            assert!(error.is_usage() && words.lines().count() == 1 && words.contains(why), "{text}: {words}");
        }
    }

    #[test]
    fn an_end_that_is_not_given_makes_room_for_the_one_that_is() {
        let window = |text: &str, spacing_m: f64| {
            MotionFilter::default()
                .with_window(text)
                .unwrap()
                .settings(spacing_m, Still::default(), 1.0)
                .unwrap()
                .window_m
        };
        assert_eq!(window("1m..", 0.01), [1.0, 3.0]);
        assert_eq!(window("..3m", 1000.0), [1.0, 3.0]);
        // One taxel has no spacing, and nothing to filter.
        assert_eq!(window("..", 0.0), [0.0, 0.0]);
        assert_eq!(window("1m..", 0.0), [1.0, 3.0]);
    }

    #[test]
    fn a_time_that_is_none_is_refused() {
        for over_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let filter = MotionFilter::default().over_s(over_s);
            assert!(filter.settings(1.0, Still::default(), 1.0).unwrap_err().to_string().contains("motion over"));
        }
        for time_constant_s in [-1.0, f64::NAN, f64::INFINITY] {
            let filter = MotionFilter { time_constant_s, ..MotionFilter::default() };
            assert!(filter.settings(1.0, Still::default(), 1.0).unwrap_err().to_string().contains("filter time"));
        }
    }
}
