//! How far percepts may be off, and how long a frame may take.

use serde::{Deserialize, Serialize};

use crate::error::{Error, Result};

/// A tolerance, a time budget, or both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Target {
    /// Tolerance of centroids, m.
    pub centroid_m: Option<f64>,
    /// Tolerance of orientations, rad.
    pub orientation_rad: Option<f64>,
    /// Time budget of a frame, s.
    pub budget_s: Option<f64>,
}

/// Units by name, with their factors.
type Units = [(&'static str, f64)];

const LENGTHS: &Units = &[("mm", 1e-3), ("um", 1e-6), ("µm", 1e-6), ("cm", 1e-2), ("m", 1.0)];
const TIMES: &Units = &[("us", 1e-6), ("µs", 1e-6), ("ms", 1e-3), ("ns", 1e-9), ("s", 1.0), ("min", 60.0)];
const RATES: &Units = &[("Hz", 1.0), ("kHz", 1e3)];

/// The names of `units`, as a message lists them.
fn names(units: &Units) -> String {
    units.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ")
}

/// The value of `text`, a finite number and one of `units`.
fn number(text: &str, units: &Units) -> Option<f64> {
    let text = text.trim();
    let end = text.find(|c: char| !(c.is_ascii_digit() || ".eE+-".contains(c))).unwrap_or(text.len());
    // No unit begins with an e.
    let value = text[..end].parse::<f64>().ok().filter(|value| value.is_finite())?;
    let (_, factor) = units.iter().find(|(name, _)| *name == text[end..].trim())?;
    Some(value * factor)
}

fn quantity(text: &str, what: &str, example: &str, units: &Units) -> Result<f64> {
    number(text, units).filter(|value| *value > 0.0).ok_or_else(|| {
        let units = names(units);
        Error::usage(format!("`{text}` is not a {what}; write a number over 0 and one of {units}, such as {example}"))
    })
}

/// The value of `text`, a number with one of `units`, or a bare one in `usual`. Its sign and range are checked later.
fn with_usual_unit(text: &str, what: &str, usual: &str, example: &str, units: &Units) -> Result<f64> {
    let bare = text.trim().parse::<f64>().ok();
    bare.or_else(|| number(text, units)).ok_or_else(|| {
        let units = names(units);
        Error::usage(format!(
            "`{text}` is not a {what}; write a number in {usual}, or a number with one of {units}, such as {example}"
        ))
    })
}

/// Parses a time, s: a bare number is in seconds.
///
/// # Errors
/// It is not a number, or it has another unit.
pub fn seconds(text: &str) -> Result<f64> {
    with_usual_unit(text, "time", "seconds", "250ms", TIMES)
}

/// Parses a length, m: a bare number is in metres.
///
/// # Errors
/// It is not a number, or it has another unit.
pub fn metres(text: &str) -> Result<f64> {
    with_usual_unit(text, "length", "metres", "5mm", LENGTHS)
}

/// Parses a rate, Hz: a bare number is in Hz.
///
/// # Errors
/// It is not a number, or it has another unit.
pub fn hertz(text: &str) -> Result<f64> {
    with_usual_unit(text, "rate", "Hz", "50Hz", RATES)
}

/// Parses a length, m.
///
/// # Errors
/// It says none over 0.
pub fn length(text: &str) -> Result<f64> {
    quantity(text, "length", "0.5 mm", LENGTHS)
}

/// Parses an angle, rad.
///
/// # Errors
/// It says none over 0.
pub fn angle(text: &str) -> Result<f64> {
    let degree = std::f64::consts::PI / 180.0;
    quantity(text, "angle", "2 deg", &[("deg", degree), ("°", degree), ("rad", 1.0)])
}

/// Parses a time, s.
///
/// # Errors
/// It says none over 0.
pub fn time(text: &str) -> Result<f64> {
    quantity(text, "time", "100 us", TIMES)
}

impl Target {
    /// Parses a tolerance: a length for centroids, an angle for orientations, or both separated by a comma.
    ///
    /// # Errors
    /// It is something else, or has one of them twice.
    pub fn within(text: &str) -> Result<Self> {
        let mut target = Self::default();
        for part in text.split(',') {
            let place = match (length(part), angle(part)) {
                (Ok(length), _) => target.centroid_m.replace(length),
                (_, Ok(angle)) => target.orientation_rad.replace(angle),
                _ => {
                    let what = "is neither a length nor an angle";
                    return Err(Error::usage(format!("`{}` {what}; write such as \"0.5 mm, 2 deg\"", part.trim())));
                }
            };
            if place.is_some() {
                return Err(Error::usage(format!(
                    "`{text}` gives one quantity twice; write such as \"0.5 mm, 2 deg\""
                )));
            }
        }
        Ok(target)
    }

    /// Whether nothing is requested.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// This, with missing values from `other`.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            centroid_m: self.centroid_m.or(other.centroid_m),
            orientation_rad: self.orientation_rad.or(other.orientation_rad),
            budget_s: self.budget_s.or(other.budget_s),
        }
    }

    /// It as text.
    #[must_use]
    pub fn words(&self) -> String {
        let number = |value: f64| format!("{}", (value * 1e6).round() / 1e6);
        let parts = [
            self.centroid_m.map(|m| format!("{} mm", number(m * 1e3))),
            self.orientation_rad.map(|rad| format!("{} deg", number(rad.to_degrees()))),
            self.budget_s.map(|s| format!("{} us", number(s * 1e6))),
        ];
        parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wishes_are_read_with_their_units() {
        let near = |got: Option<f64>, right: f64| (got.unwrap() - right).abs() <= 1e-12 * right;
        let target = Target::within("0.5 mm, 2 deg").unwrap();
        assert!(near(target.centroid_m, 5e-4) && near(target.orientation_rad, 2_f64.to_radians()));
        let target = Target::within("0.1rad,20um").unwrap();
        assert!(near(target.centroid_m, 2e-5) && near(target.orientation_rad, 0.1));
        assert_eq!(Target::within("1e-3 m").unwrap().orientation_rad, None);
        assert!(near(time("100us").ok(), 1e-4) && near(time("2 ms").ok(), 2e-3));
        assert_eq!(Target::within("0.5 mm, 2 deg").unwrap().words(), "0.5 mm, 2 deg");
        for wrong in ["", "0.5", "0 mm", "-1 mm", "2 degrees", "1 mm, 2 mm", "nan mm", "1mm,"] {
            assert!(Target::within(wrong).unwrap_err().is_usage(), "{wrong}");
        }
    }

    #[test]
    fn flags_have_a_unit_or_the_usual_one() {
        let near = |got: Result<f64>, right: f64| (got.unwrap() - right).abs() <= 1e-12 * right.abs();
        for (text, right) in
            [("10", 10.0), ("10s", 10.0), ("250 ms", 0.25), ("-0.5s", -0.5), ("2min", 120.0), ("0", 0.0)]
        {
            assert!(near(seconds(text), right), "{text}");
        }
        for (text, right) in [("0.005", 0.005), ("5mm", 0.005), ("2 cm", 0.02), ("1e-3 m", 1e-3), ("-20µm", -2e-5)] {
            assert!(near(metres(text), right), "{text}");
        }
        for (text, right) in [("50", 50.0), ("50Hz", 50.0), ("1kHz", 1e3), ("0.5 Hz", 0.5)] {
            assert!(near(hertz(text), right), "{text}");
        }
        // Checks of their range are made later.
        assert!(seconds("nan").unwrap().is_nan() && seconds("inf").unwrap().is_infinite());
        for (wrong, write) in [
            (
                seconds("soon"),
                "write a number in seconds, or a number with one of us, µs, ms, ns, s, min, such as 250ms",
            ),
            (seconds("5mm"), "in seconds"),
            (seconds("nan s"), "in seconds"),
            (metres("5s"), "`5s` is not a length; write a number in metres"),
            (metres("mm"), "in metres"),
            (hertz("50 hz"), "one of Hz, kHz, such as 50Hz"),
            (hertz(""), "in Hz"),
        ] {
            let error = wrong.unwrap_err();
            let text = error.to_string();
            assert!(error.is_usage() && text.contains(write) && text.lines().count() == 1, "{text}");
        }
    }
}
