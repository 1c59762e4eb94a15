//! Checks of values in TOML files; each error has its line and column.

use std::fmt::Display;
use std::ops::Range;

use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize, Deserializer};
use toml::{Spanned, Value};

use crate::error::{Error, Result, parse_toml, place_in, unknown};

/// Larger numbers are not credible in any unit.
const MAX_CREDIBLE: f64 = 1e9;

/// A file's text.
#[derive(Clone, Copy)]
pub struct Text<'a>(pub &'a str);

impl Text<'_> {
    /// The file's content.
    pub fn parse<T: DeserializeOwned>(self) -> Result<T> {
        parse_toml(self.0)
    }

    /// The error that `what` is wrong at `span`.
    pub fn wrong(self, span: Range<usize>, what: impl Into<String>) -> Error {
        self.put(span, Error::failed(what))
    }

    /// `error`, at `span`.
    pub fn put(self, span: Range<usize>, error: Error) -> Error {
        error.at(self.place(span))
    }

    /// Line and column of the start of `span`.
    pub fn place(self, span: Range<usize>) -> String {
        place_in(self.0, span.start)
    }

    /// The number under `key`, if it is credible and `fits`.
    fn number(self, key: &str, value: &Spanned<f64>, must: &str, fits: impl Fn(f64) -> bool) -> Result<f64> {
        let number = *value.get_ref();
        if fits(number) && number.abs() <= MAX_CREDIBLE {
            return Ok(number);
        }
        let number = in_words(number);
        Err(self.wrong(value.span(), format!("`{key}` is {number}; it must be {must}, and no more than 1e9 in size")))
    }

    /// The number under `key`, which must be over 0.
    pub fn positive(self, key: &str, value: &Spanned<f64>) -> Result<f64> {
        self.number(key, value, "over 0", |x| x > 0.0)
    }

    /// The number under `key`, which must not be under 0.
    pub fn not_negative(self, key: &str, value: &Spanned<f64>) -> Result<f64> {
        self.number(key, value, "0 or more", |x| x >= 0.0)
    }

    /// The number under `key`, which must be finite.
    pub fn finite(self, key: &str, value: &Spanned<f64>) -> Result<f64> {
        self.number(key, value, "a finite number", f64::is_finite)
    }

    /// The whole number under `key`, where it is given and in `range`.
    pub fn int(self, key: &str, value: Option<&Spanned<i64>>, range: Range<i64>) -> Result<Option<u32>> {
        let Some(value) = value else { return Ok(None) };
        let number = *value.get_ref();
        if range.contains(&number) {
            return Ok(Some(number as u32));
        }
        let last = range.end - 1;
        Err(self.wrong(value.span(), format!("`{key}` is {number}; it must be between {} and {last}", range.start)))
    }

    /// Rejects times under `key` that are negative or do not increase.
    pub fn check_times(self, key: &str, span: Range<usize>, times: impl IntoIterator<Item = f64>) -> Result<()> {
        let mut before = None;
        for t_s in times {
            if !(0.0..=MAX_CREDIBLE).contains(&t_s) {
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

    /// Rejects `key` if it is given; `why` says where it has no meaning.
    pub fn refuse<T>(self, key: &str, value: Option<&Spanned<T>>, why: impl Display) -> Result<()> {
        match value {
            Some(value) => Err(self.wrong(value.span(), format!("`{key}` has no effect {why}; remove it"))),
            None => Ok(()),
        }
    }

    /// The error that nothing is called `asked`, with a suggestion from the `known` names.
    pub fn unknown<'n>(self, asked: &Spanned<String>, what: &str, known: impl IntoIterator<Item = &'n str>) -> Error {
        self.wrong(asked.span(), unknown(what, asked.get_ref(), known))
    }
}

/// What has lists of a fixed length: of a longer list, an array of serde leaves the rest unread.
pub trait Whole: Sized {
    /// The same with lists of any length.
    type Read: DeserializeOwned;

    /// What was read, if its lists are as long as they must be; else what is wrong.
    fn of_read(read: Self::Read) -> Result<Self, String>;

    /// How it is written.
    fn form() -> String;
}

impl Whole for f64 {
    type Read = Self;

    fn of_read(read: Self) -> Result<Self, String> {
        Ok(read)
    }

    fn form() -> String {
        "number".to_owned()
    }
}

impl<T: Whole> Whole for Vec<T> {
    type Read = Vec<T::Read>;

    fn of_read(read: Self::Read) -> Result<Self, String> {
        read.into_iter().map(T::of_read).collect()
    }

    fn form() -> String {
        format!("[{}, …]", T::form())
    }
}

impl<T: Whole, const N: usize> Whole for [T; N] {
    type Read = Vec<T::Read>;

    fn of_read(read: Self::Read) -> Result<Self, String> {
        let whole: Vec<T> = Whole::of_read(read)?;
        whole.try_into().map_err(|whole: Vec<T>| {
            let entries = if whole.len() == 1 { "entry" } else { "entries" };
            format!("a list has {} {entries} here; give it {N}", whole.len())
        })
    }

    fn form() -> String {
        format!("[{}]", vec![T::form(); N].join(", "))
    }
}

/// For `deserialize_with`: the value of a key whose lists must have their length, not more.
///
/// # Errors
/// A list is too short or too long, or of something else.
pub fn whole<'de, D: Deserializer<'de>, T: Whole>(from: D) -> Result<Option<Spanned<T>>, D::Error> {
    whole_as(from, T::form)
}

/// The same of a value that must be as `form` says.
///
/// # Errors
/// As of [`whole`].
pub fn whole_as<'de, D: Deserializer<'de>, T: Whole>(
    from: D,
    form: impl FnOnce() -> String,
) -> Result<Option<Spanned<T>>, D::Error> {
    let Some(value) = Option::<Spanned<Value>>::deserialize(from)? else { return Ok(None) };
    let span = value.span();
    let read = T::Read::deserialize(value.into_inner());
    let read = read.map_err(|_| D::Error::custom(format!("this must be {}", form())))?;
    T::of_read(read).map(|value| Some(Spanned::new(span, value))).map_err(D::Error::custom)
}

/// `number` as people read it: with a power of ten where it has many digits.
#[must_use]
pub fn in_words(number: f64) -> String {
    if number == 0.0 || (1e-6..1e12).contains(&number.abs()) { number.to_string() } else { format!("{number:e}") }
}

/// `message` without its column.
#[cfg(test)]
pub fn without_column(message: &str) -> String {
    let (before, after) = message.split_once(", column ").unwrap_or((message, ""));
    format!("{before}{}", after.trim_start_matches(|c: char| c.is_ascii_digit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Deserialize)]
    struct File {
        #[serde(default, deserialize_with = "whole")]
        pair: Option<Spanned<[f64; 2]>>,
        #[serde(default, deserialize_with = "whole")]
        pairs: Option<Spanned<Vec<[f64; 2]>>>,
    }

    #[test]
    fn lists_have_their_length_and_neither_less_nor_more() {
        let read = |text: &str| Text(text).parse::<File>().map_err(|e| without_column(&e.to_string()));
        let both = read("pair = [1, 2]\npairs = [[3, 4], [5, 6]]").unwrap();
        assert_eq!(*both.pair.unwrap().get_ref(), [1.0, 2.0]);
        assert_eq!(both.pairs.unwrap().get_ref()[..], [[3.0, 4.0], [5.0, 6.0]]);
        assert!(read("").unwrap().pair.is_none());
        assert_eq!(read("\npair = [1, 2, 3]").unwrap_err(), "line 2: a list has 3 entries here; give it 2");
        assert_eq!(read("pair = [1]").unwrap_err(), "line 1: a list has 1 entry here; give it 2");
        assert_eq!(read("pairs = [[1, 2], [3, 4, 5]]").unwrap_err(), "line 1: a list has 3 entries here; give it 2");
        assert_eq!(read("pair = 1").unwrap_err(), "line 1: this must be [number, number]");
        assert_eq!(read("\npair = [1, \"a\"]").unwrap_err(), "line 2: this must be [number, number]");
        assert_eq!(read("pairs = [1, 2]").unwrap_err(), "line 1: this must be [[number, number], …]");
    }

    #[test]
    fn numbers_of_many_digits_are_told_as_powers_of_ten() {
        assert_eq!(
            [0.0, -0.5, 1e9, 1e300, -1e-12, f64::NAN, f64::INFINITY].map(in_words),
            ["0", "-0.5", "1000000000", "1e300", "-1e-12", "NaN", "inf"]
        );
    }
}
