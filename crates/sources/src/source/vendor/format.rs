//! The formats, and how one is recognised.

use std::fmt;
use std::str::FromStr;

use super::text::decoded;
use crate::error::{Error, Result, suggestion};

/// A format of recordings that pressure systems export.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum VendorFormat {
    /// XSENSOR's `.csv`.
    Xsensor,
    /// footscan's text.
    Footscan,
    /// novel's loadsol, `.txt`.
    Loadsol,
    /// StappOne's `.csv`.
    Stappone,
    /// Tekscan's ASCII, `.asf` or `.csv`.
    Tekscan,
    /// novel's emed, `.lst`.
    Emed,
    /// novel's pliance, `.asc`.
    Pliance,
    /// novel's pedar, `.asc`.
    Pedar,
    /// Plain matrices, a line or a block of rows for each frame.
    Matrix,
}

impl VendorFormat {
    const NAMES: [(&str, Self); 9] = [
        ("xsensor", Self::Xsensor),
        ("tekscan", Self::Tekscan),
        ("emed", Self::Emed),
        ("pliance", Self::Pliance),
        ("pedar", Self::Pedar),
        ("loadsol", Self::Loadsol),
        ("footscan", Self::Footscan),
        ("stappone", Self::Stappone),
        ("matrix", Self::Matrix),
    ];

    /// The names of all formats.
    pub const WORDS: &[&str] =
        &["xsensor", "tekscan", "emed", "pliance", "pedar", "loadsol", "footscan", "stappone", "matrix"];

    /// What people call it.
    #[must_use]
    pub fn title(self) -> &'static str {
        match self {
            Self::Xsensor => "XSENSOR",
            Self::Footscan => "footscan",
            Self::Loadsol => "loadsol",
            Self::Stappone => "StappOne",
            Self::Tekscan => "Tekscan",
            Self::Emed => "emed",
            Self::Pliance => "pliance",
            Self::Pedar => "pedar",
            Self::Matrix => "matrix",
        }
    }

    /// The format of a text that begins with `head`; plain matrices look like nothing in particular.
    pub(super) fn detect(head: &[u8]) -> Option<Self> {
        let text = decoded(head);
        let begins = |start: &str| text.lines().any(|line| line.trim_start().starts_with(start));
        let has = |words: &[&str]| words.iter().all(|word| text.contains(word));
        // A line of keys and values, as `"Frame:","1464"`.
        let keys: Vec<String> = text.lines().filter_map(key).collect();
        let has_key = |name: &str| keys.iter().any(|key| key == name);
        let is_xsensor = begins("FRAME") && begins("SENSELS");
        if is_xsensor || has_key("frame") && (has_key("sensels") || (has_key("rows") && has_key("columns"))) {
            Some(Self::Xsensor)
        } else if begins("ASCII_DATA") || (begins("Frame ") && (begins("ROWS") || begins("DATA_TYPE"))) {
            Some(Self::Tekscan)
        } else if has(&["Pict-No"]) || has(&["Sensor size:", "Matrix:"]) {
            Some(Self::Emed)
        } else if has(&["foot data", "Rectangle", "Frame ", " ms)"]) {
            Some(Self::Footscan)
        } else if text.lines().any(|line| line.starts_with("Time[") && line.contains("Force[")) {
            Some(Self::Loadsol)
        } else if text.lines().next().is_some_and(|line| line.contains("sole_id") && line.contains("pressure_")) {
            Some(Self::Stappone)
        } else if begins("time[") {
            let is_pedar = has(&["insole"]) || has(&["sensor type:"]);
            Some(if is_pedar { Self::Pedar } else { Self::Pliance })
        } else {
            None
        }
    }
}

/// The first cell of `line`, in small letters, without quotation marks and a colon at its end.
fn key(line: &str) -> Option<String> {
    let first = line.trim_start().split([',', ';', '\t']).next()?;
    let word = first.trim_matches(['"', ' ']).trim_end_matches(':');
    (!word.is_empty() && !word.starts_with(|c: char| c.is_ascii_digit())).then(|| word.to_ascii_lowercase())
}

impl fmt::Display for VendorFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let found = Self::NAMES.iter().find(|(_, format)| format == self);
        f.write_str(found.map_or("", |(name, _)| name))
    }
}

impl FromStr for VendorFormat {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let found = Self::NAMES.into_iter().find(|(known, _)| *known == name);
        let names = || suggestion(name, Self::WORDS.iter().copied());
        found.map(|(_, format)| format).ok_or_else(|| Error::usage(format!("there is no format `{name}`; {}", names())))
    }
}
