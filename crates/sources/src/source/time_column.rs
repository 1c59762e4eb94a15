//! The times in a table: what a column of them is called, which unit its name or its size says, and times of the calendar.

use toml::value::{Datetime, Offset};

use crate::error::{Error, Result, failed};
use crate::plain;

/// How times are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TimeUnit {
    Seconds,
    Milliseconds,
    Microseconds,
    Nanoseconds,
    /// Times of the calendar (ISO 8601), which become seconds since 1970.
    Calendar,
}

/// What columns of times are called.
const NAMES: [&str; 14] = [
    "t",
    "time",
    "times",
    "timestamp",
    "timestamps",
    "time stamp",
    "time_stamp",
    "datetime",
    "date_time",
    "date time",
    "elapsed",
    "epoch",
    "unix",
    "unixtime",
];

/// Names of units, and those that are names of columns by themselves.
const UNITS: [(&str, TimeUnit, bool); 22] = [
    ("s", TimeUnit::Seconds, false),
    ("sec", TimeUnit::Seconds, true),
    ("secs", TimeUnit::Seconds, true),
    ("second", TimeUnit::Seconds, false),
    ("seconds", TimeUnit::Seconds, true),
    ("ms", TimeUnit::Milliseconds, true),
    ("msec", TimeUnit::Milliseconds, true),
    ("millis", TimeUnit::Milliseconds, true),
    ("millis()", TimeUnit::Milliseconds, true),
    ("millisecond", TimeUnit::Milliseconds, false),
    ("milliseconds", TimeUnit::Milliseconds, true),
    ("us", TimeUnit::Microseconds, true),
    ("µs", TimeUnit::Microseconds, true),
    ("usec", TimeUnit::Microseconds, true),
    ("micros", TimeUnit::Microseconds, true),
    ("micros()", TimeUnit::Microseconds, true),
    ("microseconds", TimeUnit::Microseconds, true),
    ("ns", TimeUnit::Nanoseconds, true),
    ("nanos", TimeUnit::Nanoseconds, true),
    ("nanoseconds", TimeUnit::Nanoseconds, true),
    ("iso", TimeUnit::Calendar, false),
    ("utc", TimeUnit::Calendar, false),
];

/// What is between a name and its unit.
const BEFORE_UNITS: [char; 7] = ['_', ' ', '-', '.', '/', '[', '('];

/// From here to there a time is one since 1970, from the year 2000 to 2100, in whichever unit.
const SINCE_1970_S: std::ops::Range<f64> = 946_684_800.0..4_102_444_800.0;
/// Whole times that rise by so much from one frame to the next are hardly seconds.
const LONG_STEP: f64 = 5.0;

impl TimeUnit {
    /// The seconds in one; calendar times are in seconds.
    pub(super) fn seconds(self) -> f64 {
        match self {
            Self::Seconds | Self::Calendar => 1.0,
            Self::Milliseconds => 1e3,
            Self::Microseconds => 1e6,
            Self::Nanoseconds => 1e9,
        }
    }

    /// As people write it.
    pub(super) fn symbol(self) -> &'static str {
        match self {
            Self::Seconds => "s",
            Self::Milliseconds => "ms",
            Self::Microseconds => "µs",
            Self::Nanoseconds => "ns",
            Self::Calendar => "ISO 8601",
        }
    }
}

/// What `word` says as the head of a column of times, such as `t`, `time_ms` or `Time [s]`: the unit, if it has one. `None` where
/// it heads no such column.
///
/// # Errors
/// It has a unit that times cannot have here.
pub(super) fn unit_in_head(word: &str) -> Result<Option<Option<TimeUnit>>> {
    let word = word.trim().to_lowercase();
    if NAMES.contains(&word.as_str()) {
        return Ok(Some(None));
    }
    if UNITS.iter().any(|(known, _, alone)| *alone && *known == word) {
        return Ok(Some(unit_named(&word)));
    }
    let is_name = |name: &str| NAMES.contains(&name.trim());
    for [open, close] in [['[', ']'], ['(', ')']] {
        if let Some((name, rest)) = word.split_once(open)
            && is_name(name)
            && let Some(inside) = rest.trim_end().strip_suffix(close)
        {
            let wrong = || failed!("`{word}` has no unit that times are read in: s, ms, us, ns or iso; convert them");
            return unit_named(inside).ok_or_else(wrong).map(|unit| Some(Some(unit)));
        }
    }
    let ends = word.rsplit_once(BEFORE_UNITS);
    Ok(ends.filter(|(name, _)| is_name(name)).and_then(|(_, name)| unit_named(name)).map(Some))
}

/// The unit that ends `word`, the name of a column of times whatever it is called, such as `stamp_ms`.
pub(super) fn unit_at_end(word: &str) -> Option<TimeUnit> {
    let (_, last) = word.trim_end_matches([']', ')']).rsplit_once(BEFORE_UNITS)?;
    unit_named(&last.to_lowercase())
}

fn unit_named(name: &str) -> Option<TimeUnit> {
    UNITS.iter().find(|(known, ..)| *known == name.trim()).map(|(_, unit, _)| *unit)
}

/// A column of times while it is read.
#[derive(Clone, Debug)]
pub(super) struct TimeColumn {
    /// Whether its head says the unit.
    is_said: bool,
    unit: Option<TimeUnit>,
    before: Option<f64>,
    /// The step from the first time to the second, if these are whole and far apart, in no unit that anybody said.
    long_step: Option<f64>,
    has_step: bool,
}

impl TimeColumn {
    /// A column whose head says `unit`, if it says one.
    pub(super) fn new(unit: Option<TimeUnit>) -> Self {
        Self { is_said: unit.is_some(), unit, before: None, long_step: None, has_step: false }
    }

    /// The time that `word` is, or `number`, if it is one, in seconds. The first one tells the unit where the head does not.
    pub(super) fn read(&mut self, word: &str, number: Option<f64>) -> Result<f64> {
        let unit = match self.unit {
            Some(unit) => unit,
            None => *self.unit.insert(match number {
                Some(number) => by_size(number),
                None if calendar(word).is_some() => TimeUnit::Calendar,
                None => TimeUnit::Seconds,
            }),
        };
        let t_s = match unit {
            TimeUnit::Calendar => calendar(word),
            unit => number.filter(|t| t.is_finite()).map(|t| t / unit.seconds()),
        };
        let Some(t_s) = t_s else { return Err(wrong(word, unit)) };
        if !self.has_step
            && let Some(before) = self.before.replace(t_s)
        {
            self.has_step = true;
            let is_whole = t_s.fract() == 0.0 && before.fract() == 0.0;
            let is_long = t_s - before >= LONG_STEP && is_whole && !self.is_said && unit == TimeUnit::Seconds;
            self.long_step = is_long.then_some(t_s - before);
        }
        Ok(t_s)
    }

    /// What is to be said of times whose unit nobody said, if they may be wrong by a thousand; once.
    pub(super) fn doubt(&mut self) -> Option<String> {
        let step = self.long_step.take()?;
        Some(format!(
            "the time rises by {} s a frame; if it is in milliseconds, head its column `t [ms]`, else `t [s]`",
            plain::seconds(step)
        ))
    }

    /// What was found out of the unit by the first time, once it is known and where nobody said it: `None` for seconds.
    pub(super) fn found_out(&self) -> Option<TimeUnit> {
        self.unit.filter(|unit| !self.is_said && *unit != TimeUnit::Seconds)
    }
}

fn wrong(word: &str, unit: TimeUnit) -> Error {
    let word: String = word.trim().chars().take(40).flat_map(char::escape_debug).collect();
    let must = match unit {
        TimeUnit::Seconds => {
            "a finite number of seconds, or a time such as 2031-05-06T07:08:09.5Z in every row".to_owned()
        }
        TimeUnit::Calendar => "a time such as 2031-05-06T07:08:09.5Z, as in the rows before".to_owned(),
        unit => format!("a finite number of {}", unit.symbol()),
    };
    match word.is_empty() {
        true => Error::failed("t is blank; every row needs its time"),
        false => failed!("t is `{word}`; it should be {must}"),
    }
}

/// The unit of a time without a stated one: seconds, unless it is a date of our days in another unit.
pub(super) fn by_size(number: f64) -> TimeUnit {
    let of_our_days = |unit: &TimeUnit| SINCE_1970_S.contains(&(number / unit.seconds()));
    let units = [TimeUnit::Milliseconds, TimeUnit::Microseconds, TimeUnit::Nanoseconds];
    units.into_iter().find(of_our_days).unwrap_or(TimeUnit::Seconds)
}

/// Whether times that rise by `step` a frame, all of them whole, are hardly seconds.
pub(super) fn is_long_step(step: f64) -> bool {
    step >= LONG_STEP
}

/// Seconds since 1970 of a time of the calendar as ISO 8601 writes it; without a zone it is one of UTC.
pub(super) fn calendar(word: &str) -> Option<f64> {
    let word = word.trim();
    // What most words are not.
    if word.as_bytes().get(4) != Some(&b'-') {
        return None;
    }
    let mut text = word.replace(',', ".");
    // `+0200` for `+02:00`.
    if let Some(at) = text.rfind(['+', '-']).filter(|&at| at > 10 && text.len() == at + 5) {
        text.insert(at + 3, ':');
    }
    let Datetime { date: Some(date), time: Some(time), offset } = text.parse::<Datetime>().ok()? else { return None };
    let days = days_since_1970(i64::from(date.year), i64::from(date.month), i64::from(date.day));
    let minutes = match offset {
        Some(Offset::Custom { minutes }) => i64::from(minutes),
        Some(Offset::Z) | None => 0,
    };
    let seconds = i64::from(time.second.unwrap_or(0));
    let whole = ((days * 24 + i64::from(time.hour)) * 60 + i64::from(time.minute) - minutes) * 60 + seconds;
    Some(whole as f64 + f64::from(time.nanosecond.unwrap_or(0)) / 1e9)
}

/// Days from 1970-01-01 to a day of the Gregorian calendar, in years that begin in March.
fn days_since_1970(year: i64, month: i64, day: i64) -> i64 {
    let year = if month <= 2 { year - 1 } else { year };
    let (era, of_era) = (year.div_euclid(400), year.rem_euclid(400));
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_that_is_hardly_one_is_told_shortly() {
        let mut column = TimeColumn::new(None);
        for t in [0.0, 1e300] {
            column.read("", Some(t)).unwrap();
        }
        assert!(column.doubt().unwrap().starts_with("the time rises by 1e300 s a frame; "));
    }

    #[test]
    fn a_head_says_that_a_column_is_time_and_its_unit() {
        let unit = |word: &str| unit_in_head(word).unwrap();
        for plain in ["t", "T", "time", " Timestamp ", "elapsed"] {
            assert_eq!(unit(plain), Some(None), "{plain}");
        }
        for ms in ["t [ms]", "time_ms", "millis", "Time (ms)", "timestamp ms", "ms", "elapsed_millis"] {
            assert_eq!(unit(ms), Some(Some(TimeUnit::Milliseconds)), "{ms}");
        }
        assert_eq!(unit("Time[secs]"), Some(Some(TimeUnit::Seconds)));
        assert_eq!(unit("t_us"), Some(Some(TimeUnit::Microseconds)));
        assert_eq!(unit("t [iso]"), Some(Some(TimeUnit::Calendar)));
        for (word, unit) in [
            ("stamp_ms", Some(TimeUnit::Milliseconds)),
            ("tick (us)", Some(TimeUnit::Microseconds)),
            ("ms", None),
            ("x_y", None),
        ] {
            assert_eq!(unit_at_end(word), unit, "{word}");
        }
        for other in ["4", "s", "temp_ms", "time_x", "a", "", "palm"] {
            assert_eq!(unit(other), None, "{other}");
        }
        assert!(unit_in_head("t [min]").unwrap_err().to_string().contains("s, ms, us, ns or iso"));
    }

    #[test]
    fn times_are_seconds_whatever_they_are_written_in() {
        let read = |unit: Option<TimeUnit>, words: &[&str]| -> Vec<f64> {
            let mut column = TimeColumn::new(unit);
            words.iter().map(|word| column.read(word, word.parse().ok()).unwrap()).collect()
        };
        assert_eq!(read(None, &["0", "0.5", "-3"]), [0.0, 0.5, -3.0]);
        assert_eq!(read(Some(TimeUnit::Milliseconds), &["1000", "1050.5"]), [1.0, 1.0505]);
        assert_eq!(read(None, &["1768494979568", "1768494979584"]), [1_768_494_979.568, 1_768_494_979.584]);
        assert_eq!(read(None, &["1768494979568000"]), [1_768_494_979.568]);
        // Seconds since 1970 are seconds, and so is what is larger than any time of our days.
        assert_eq!(read(None, &["1768494979.5", "9e20"]), [1_768_494_979.5, 9e20]);
        assert_eq!(read(Some(TimeUnit::Seconds), &["1768494979568"]), [1_768_494_979_568.0]);
        assert_eq!(read(None, &["1970-01-01T00:00:00Z", "1970-01-02T00:00:00.25Z"]), [0.0, 86_400.25]);
    }

    #[test]
    fn a_time_of_the_calendar_is_read_as_people_write_it() {
        for same in [
            "2024-02-29T12:30:15.5Z",
            "2024-02-29 12:30:15.5",
            "2024-02-29t12:30:15,5z",
            "2024-02-29T14:30:15.5+02:00",
            "2024-02-29T07:00:15.500-0530",
        ] {
            assert_eq!(calendar(same), Some(1_709_209_815.5), "{same}");
        }
        assert_eq!(calendar("1969-12-31T23:59:59Z"), Some(-1.0));
        for other in ["2024-02-29", "12:30:15", "2024-02-30T00:00:00Z", "2024-13-01T00:00:00Z", "now", "", "1234-"] {
            assert_eq!(calendar(other), None, "{other}");
        }
    }

    #[test]
    fn what_is_no_time_says_what_is_one_and_long_steps_are_doubted() {
        let mut column = TimeColumn::new(None);
        assert!(column.read("now", None).unwrap_err().to_string().contains("such as 2031-05-06T07:08:09.5Z"));
        let mut calendar = TimeColumn::new(None);
        calendar.read("2024-02-29T12:30:15Z", None).unwrap();
        assert!(calendar.read("3", Some(3.0)).unwrap_err().to_string().contains("as in the rows before"));
        assert_eq!(calendar.found_out(), Some(TimeUnit::Calendar));
        let doubt = |unit: Option<TimeUnit>, times: [f64; 2]| {
            let mut column = TimeColumn::new(unit);
            times.into_iter().for_each(|t| assert!(column.read("", Some(t)).is_ok()));
            column.doubt()
        };
        assert!(doubt(None, [1000.0, 1050.0]).unwrap().contains("rises by 50 s a frame"));
        for (unit, times) in [
            (None, [0.0, 1.0]),
            (None, [0.0, 7.5]),
            (None, [9.0, 0.0]),
            (Some(TimeUnit::Seconds), [0.0, 50.0]),
            (Some(TimeUnit::Milliseconds), [0.0, 5e4]),
        ] {
            assert_eq!(doubt(unit, times), None, "{times:?}");
        }
    }
}
