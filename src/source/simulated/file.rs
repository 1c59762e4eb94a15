//! The simulation's file: its keys, and one line with the place for whatever is wrong in it.

use std::fmt::Display;
use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use crate::error::{Error, Result, nearest};

/// Numbers beyond this are beyond belief, whatever their unit.
const MOST: f64 = 1e9;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    pub(super) body: Option<Spanned<String>>,
    pub(super) rate_hz: Spanned<f64>,
    pub(super) duration_s: Spanned<f64>,
    #[serde(default)]
    pub(super) seed: u64,
    pub(super) skin: Option<SkinKeys>,
    #[serde(default)]
    pub(super) sensor: SensorKeys,
    #[serde(default)]
    pub(super) touch: Vec<Spanned<TouchKeys>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SkinKeys {
    pub(super) thickness_m: Spanned<f64>,
    pub(super) spread: Option<Spanned<f64>>,
    pub(super) stiffness_pa: Option<Spanned<f64>>,
}

#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
pub(super) enum SensorName {
    #[default]
    Ideal,
    Fsr,
    Linear,
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
pub(super) enum OutputName {
    Counts,
    Logarithmic,
    Linearised,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SensorKeys {
    #[serde(default)]
    pub(super) kind: SensorName,
    pub(super) tap: Option<Spanned<i64>>,
    pub(super) output: Option<Spanned<OutputName>>,
    pub(super) full_scale_newton: Option<Spanned<f64>>,
    pub(super) offset: Option<Spanned<f64>>,
    pub(super) gain: Option<Spanned<f64>>,
    pub(super) bits: Option<Spanned<i64>>,
    pub(super) invert: Option<Spanned<bool>>,
    pub(super) area_m2: Option<Spanned<f64>>,
    pub(super) noise_sigma: Option<Spanned<f64>>,
    pub(super) drift_per_minute: Option<Spanned<f64>>,
    #[serde(default)]
    pub(super) dead: Vec<Spanned<i64>>,
    #[serde(default)]
    pub(super) stuck: Vec<StuckKeys>,
    #[serde(default)]
    pub(super) noisy: Vec<NoisyKeys>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StuckKeys {
    pub(super) taxel: Spanned<i64>,
    pub(super) at: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct NoisyKeys {
    pub(super) taxel: Spanned<i64>,
    pub(super) sigma: Spanned<f64>,
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
pub(super) enum IndenterName {
    Rod,
    Ball,
    Fingertip,
    Flat,
    Edge,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TouchKeys {
    pub(super) name: Option<String>,
    pub(super) on: Spanned<String>,
    pub(super) indenter: Spanned<IndenterName>,
    pub(super) radius_m: Option<Spanned<f64>>,
    pub(super) length_m: Option<Spanned<f64>>,
    pub(super) angle_deg: Option<Spanned<AngleKeys>>,
    pub(super) path: Spanned<Vec<Spanned<Vec<f64>>>>,
    pub(super) times_s: Option<Spanned<Vec<f64>>>,
    pub(super) start_s: Option<Spanned<f64>>,
    pub(super) speed_m_s: Option<Spanned<f64>>,
    pub(super) force_newton: Option<Spanned<Vec<[f64; 2]>>>,
    pub(super) tap: Option<Spanned<TapKeys>>,
    pub(super) press: Option<Spanned<PressKeys>>,
    pub(super) hold: Option<Spanned<HoldKeys>>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "`angle_deg` is a number of degrees, or a list of [t, degrees]")]
pub(super) enum AngleKeys {
    Fixed(f64),
    Turning(Vec<[f64; 2]>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TapKeys {
    pub(super) at_s: Spanned<Vec<f64>>,
    pub(super) newton: Spanned<f64>,
    pub(super) lasts_s: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PressKeys {
    pub(super) from_s: Spanned<f64>,
    pub(super) to_s: Spanned<f64>,
    pub(super) newton: Spanned<f64>,
    pub(super) ramp_s: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HoldKeys {
    pub(super) newton: Spanned<f64>,
}

/// The file's text, which knows on which line something stands.
#[derive(Clone, Copy)]
pub(super) struct Text<'a>(pub(super) &'a str);

impl Text<'_> {
    pub(super) fn parse(self) -> Result<File> {
        toml::from_str(self.0).map_err(|e| {
            let span = e.span().unwrap_or(0..0);
            self.wrong(span, explain(e.message()))
        })
    }

    /// The error that `what` is wrong at `span`.
    pub(super) fn wrong(self, span: Range<usize>, what: impl Into<String>) -> Error {
        let before = &self.0.as_bytes()[..span.start.min(self.0.len())];
        let line = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
        Error::failed(what).at(format!("line {line}"))
    }

    /// The number under `key`, if `fits` and not beyond belief.
    fn number(self, key: &str, value: &Spanned<f64>, must: &str, fits: impl Fn(f64) -> bool) -> Result<f64> {
        let number = *value.get_ref();
        if fits(number) && number.abs() <= MOST {
            return Ok(number);
        }
        Err(self.wrong(value.span(), format!("`{key}` is {number}; it must be {must}, and no more than 1e9 in size")))
    }

    pub(super) fn positive(self, key: &str, value: &Spanned<f64>) -> Result<f64> {
        self.number(key, value, "over 0", |x| x > 0.0)
    }

    pub(super) fn not_negative(self, key: &str, value: &Spanned<f64>) -> Result<f64> {
        self.number(key, value, "0 or more", |x| x >= 0.0)
    }

    pub(super) fn finite(self, key: &str, value: &Spanned<f64>) -> Result<f64> {
        self.number(key, value, "a finite number", f64::is_finite)
    }

    /// The whole number under `key`, where it is given and in `range`.
    pub(super) fn whole(self, key: &str, value: Option<&Spanned<i64>>, range: Range<i64>) -> Result<Option<u32>> {
        let Some(value) = value else { return Ok(None) };
        let number = *value.get_ref();
        if range.contains(&number) {
            return Ok(Some(number as u32));
        }
        let last = range.end - 1;
        Err(self.wrong(value.span(), format!("`{key}` is {number}; it must be between {} and {last}", range.start)))
    }

    /// Refuses times under `key` that are negative or do not increase.
    pub(super) fn check_times(self, key: &str, span: Range<usize>, times: impl IntoIterator<Item = f64>) -> Result<()> {
        let mut before = None;
        for t_s in times {
            if !(0.0..=MOST).contains(&t_s) {
                return Err(self.wrong(span, format!("`{key}` has the time {t_s}; times are 0 or more, in seconds")));
            }
            if let Some(before) = before.replace(t_s).filter(|&before| t_s <= before) {
                return Err(self.wrong(span, format!("`{key}` has the time {t_s} after {before}; times must increase")));
            }
        }
        if before.is_none() {
            return Err(self.wrong(span, format!("`{key}` is empty; give at least one entry")));
        }
        Ok(())
    }

    /// Refuses `key`, which `why` has no use for.
    pub(super) fn refuse<T>(self, key: &str, value: Option<&Spanned<T>>, why: impl Display) -> Result<()> {
        match value {
            Some(value) => Err(self.wrong(value.span(), format!("`{key}` means nothing {why}; remove it"))),
            None => Ok(()),
        }
    }

    /// That nothing is called `asked`, with the name among `known` that may be meant.
    pub(super) fn unknown<'n>(
        self,
        asked: &Spanned<String>,
        what: &str,
        known: impl IntoIterator<Item = &'n str>,
    ) -> Error {
        let hint = nearest(asked.get_ref(), known).map(|near| format!("; did you mean `{near}`?")).unwrap_or_default();
        self.wrong(asked.span(), format!("{what} `{}`{hint}", asked.get_ref()))
    }
}

/// The parser's message, with the nearest word where it met one that it does not know.
fn explain(message: &str) -> String {
    if let Some(key) = message.strip_prefix("missing field ") {
        return format!("{key} is missing");
    }
    let mut quoted = message.split('`').skip(1).step_by(2);
    let kind = match message.split('`').next() {
        Some("unknown field ") => "key",
        Some("unknown variant ") => "choice",
        _ => return message.to_owned(),
    };
    let Some(word) = quoted.next() else { return message.to_owned() };
    let known: Vec<&str> = quoted.collect();
    // A unit forgotten is a slip as well.
    let with_unit =
        known.iter().copied().find(|name| name.strip_prefix(word).is_some_and(|unit| unit.starts_with('_')));
    match with_unit.or_else(|| nearest(word, known.iter().copied())) {
        Some(near) => format!("there is no {kind} `{word}`; did you mean `{near}`?"),
        None => format!("there is no {kind} `{word}`; it is one of {}", known.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parsers_words_become_ours() {
        assert_eq!(
            explain("unknown field `rate`, expected one of `rate_hz`, `body`"),
            "there is no key `rate`; did you mean `rate_hz`?"
        );
        assert_eq!(
            explain("unknown variant `x`, expected `rod` or `ball`"),
            "there is no choice `x`; it is one of rod, ball"
        );
        assert_eq!(explain("missing field `body`"), "`body` is missing");
    }
}
