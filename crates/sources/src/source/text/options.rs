//! Options of lines of text that are not found out: which columns are sensors, which is the time, what ends a frame.

use std::str::FromStr;

use super::super::map::path::ArrayPath;
use super::super::time_column::TimeUnit;
use crate::error::{Error, Result};
use crate::signal::Channel;

/// The most columns or ids that a range may name.
const MAX_RANGE: usize = 1 << 20;

/// Options of lines of text; what they leave open is found out from the first second of input.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TextOptions {
    /// The columns of sensors.
    pub columns: Option<TextColumns>,
    /// The taxels of these columns.
    pub ids: Option<TextIds>,
    /// What ends a frame of several lines.
    pub frame_end: Option<FrameEnd>,
    /// The column of the time.
    pub time: Option<TextTime>,
}

impl TextOptions {
    /// The flag of an option that is set, if there is one.
    pub(in crate::source) fn given(&self) -> Option<&'static str> {
        let given = [
            ("--columns", self.columns.is_some()),
            ("--ids", self.ids.is_some()),
            ("--frame-end", self.frame_end.is_some()),
            ("--time", self.time.is_some()),
        ];
        given.into_iter().find(|(_, given)| *given).map(|(flag, _)| flag)
    }
}

/// Columns by number, counted from 1, or by name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::source) enum Column {
    Numbers(usize, usize),
    /// All that begin with it, if it ends with `*`.
    Name(String),
    /// All values at this path of lines of JSON.
    Path(ArrayPath),
}

impl Column {
    fn parse(text: &str) -> Option<Self> {
        let text = text.trim();
        let number = |word: &str| word.trim().parse::<usize>().ok().filter(|number| (1..=MAX_RANGE).contains(number));
        if let Some(one) = number(text) {
            return Some(Self::Numbers(one, one));
        }
        let ends = text.split_once(['-', '–']).and_then(|(low, high)| Some((number(low)?, number(high)?)));
        match ends {
            Some((low, high)) => (low <= high).then_some(Self::Numbers(low, high)),
            None => {
                // Digits and dashes alone are a range that is wrong, not a name.
                let is_name = text.chars().any(|c| !(c.is_ascii_digit() || matches!(c, '-' | '–' | ' ')));
                (is_name && text.parse::<f64>().is_err()).then(|| Self::Name(text.to_owned()))
            }
        }
    }

    /// Whether it means the column at `index`, from 0, that is called `name`.
    pub(in crate::source) fn is(&self, index: usize, name: Option<&str>) -> bool {
        match self {
            Self::Numbers(low, high) => (*low..=*high).contains(&(index + 1)),
            Self::Name(wanted) => name.is_some_and(|name| match wanted.strip_suffix('*') {
                Some(start) => name.starts_with(start),
                None => name == wanted,
            }),
            Self::Path(path) => name.is_some_and(|name| path.leads_to(name)),
        }
    }

    /// As it was written.
    pub(in crate::source) fn word(&self) -> String {
        match self {
            Self::Numbers(low, high) if low == high => low.to_string(),
            Self::Numbers(low, high) => format!("{low}-{high}"),
            Self::Name(name) => name.clone(),
            Self::Path(path) => path.to_string(),
        }
    }
}

/// Columns of sensors, such as `2-17`, `1,3,8-10` or `A*`: numbers count from 1, and a name may end with `*`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TextColumns(pub(in crate::source) Vec<Column>);

impl FromStr for TextColumns {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let columns: Option<Vec<Column>> = text.split(',').map(Column::parse).collect();
        columns.map(Self).ok_or_else(|| {
            Error::usage(format!(
                "--columns {text} is not a list of columns; write them as 2-17, as 1,3,8-10 or by name as A0,A1 or A*"
            ))
        })
    }
}

/// The taxels of the columns of sensors, in their order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TextIds {
    /// These, such as `4-19` or `7,3,12-20`, or of taxels with three axes `4,4.u,4.v`, as [`Channel`] numbers.
    Listed(Vec<u32>),
    /// `names`: the columns are called by the ids of their taxels, or as `4.u`.
    Names,
}

impl FromStr for TextIds {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        if text == "names" {
            return Ok(Self::Names);
        }
        let bad = || {
            Error::usage(format!(
                "--ids {text} is not a list of taxels; write them as 4-19, as 7,3,12-20, as 4,4.u,4.v, or names"
            ))
        };
        let mut ids = Vec::new();
        for part in text.split(',') {
            let (low, high) = part.split_once(['-', '–']).unwrap_or((part, part));
            let run = Channel::run(low.trim(), high.trim()).ok_or_else(bad)?;
            if (run.end() - run.start()) as usize >= MAX_RANGE - ids.len() {
                return Err(bad());
            }
            ids.extend(run);
        }
        let mut sorted = ids.clone();
        sorted.sort_unstable();
        match sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(twice) => Err(Error::usage(format!("--ids {text} names taxel {} twice", Channel(twice[0])))),
            None => Ok(Self::Listed(ids)),
        }
    }
}

/// What ends a frame of several lines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FrameEnd {
    /// `blank`: a blank line.
    Blank,
    /// A line that begins with this.
    Begins(String),
}

impl FromStr for FrameEnd {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text.trim() {
            "" | "blank" => Ok(Self::Blank),
            start => Ok(Self::Begins(start.to_owned())),
        }
    }
}

/// Which column is the time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TextTime {
    /// `arrival`: none is; frames are stamped when they arrive.
    Arrival,
    /// `COLUMN[:ms|us|iso]`.
    Column(TimeColumnName),
}

/// A column of times, by number or name, and its unit where one is given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TimeColumnName {
    pub(in crate::source) column: Column,
    pub(in crate::source) unit: Option<TimeUnit>,
}

impl FromStr for TextTime {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let bad = || {
            Error::usage(format!(
                "--time {text} is not a column; write its number or name, with s, ms, us or iso where that is known: 1:ms; or arrival"
            ))
        };
        if text == "arrival" {
            return Ok(Self::Arrival);
        }
        let unit = |word: &str| match word {
            "s" => Some(TimeUnit::Seconds),
            "ms" => Some(TimeUnit::Milliseconds),
            "us" | "µs" => Some(TimeUnit::Microseconds),
            "ns" => Some(TimeUnit::Nanoseconds),
            "iso" => Some(TimeUnit::Calendar),
            _ => None,
        };
        let (name, unit) = match text.rsplit_once(':') {
            Some((name, word)) => (name, Some(unit(word).ok_or_else(bad)?)),
            None => (text, None),
        };
        match Column::parse(name) {
            Some(Column::Numbers(low, high)) if low != high => Err(bad()),
            Some(column) => Ok(Self::Column(TimeColumnName { column, unit })),
            None => Err(bad()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_ids_and_times_are_as_people_write_them() {
        let columns: TextColumns = "2-4,7,A*".parse().unwrap();
        let is = |index, name| columns.0.iter().any(|column| column.is(index, name));
        let found: Vec<usize> = (0..8).filter(|&index| is(index, None)).collect();
        assert_eq!(found, [1, 2, 3, 6]);
        assert!(is(0, Some("A0")) && !is(0, Some("B0")));
        assert_eq!("4-6,2".parse::<TextIds>().unwrap(), TextIds::Listed(vec![4, 5, 6, 2]));
        assert_eq!("names".parse::<TextIds>().unwrap(), TextIds::Names);
        let TextIds::Listed(ids) = "4,4.u,4.v,8.u-9.u".parse().unwrap() else { panic!() };
        let names: Vec<String> = ids.iter().map(|&id| Channel(id).to_string()).collect();
        assert_eq!(names, ["4", "4.u", "4.v", "8.u", "9.u"]);
        let time = |column, unit| TextTime::Column(TimeColumnName { column, unit });
        assert_eq!("1:ms".parse::<TextTime>().unwrap(), time(Column::Numbers(1, 1), Some(TimeUnit::Milliseconds)));
        assert_eq!("stamp".parse::<TextTime>().unwrap(), time(Column::Name("stamp".to_owned()), None));
        assert_eq!("blank".parse::<FrameEnd>().unwrap(), FrameEnd::Blank);
        for wrong in ["", "0", "4-2", "2-", "1,,2", "-3", "1-99999999"] {
            assert!(wrong.parse::<TextColumns>().is_err(), "{wrong}");
        }
        for wrong in ["", "a", "3-1", "1,1", "0-4294967295", "4.w", "4-5.u", "4.u,4.u"] {
            assert!(wrong.parse::<TextIds>().unwrap_err().is_usage(), "{wrong}");
        }
        for wrong in ["", "1:h", "1-2", "1:"] {
            assert!(wrong.parse::<TextTime>().unwrap_err().is_usage(), "{wrong}");
        }
    }
}
