//! Files of keys, in TOML: one line with the place for whatever is wrong in one.

use std::fmt::Display;
use std::ops::Range;

use serde::de::DeserializeOwned;
use toml::Spanned;

use crate::error::{Error, Result, nearest};

/// Larger numbers are not credible in any unit.
const MAX_CREDIBLE: f64 = 1e9;

/// A file's text, which knows on which line something stands.
#[derive(Clone, Copy)]
pub struct Text<'a>(pub &'a str);

impl Text<'_> {
    /// What the text holds; an error has its line, and the nearest word to one that is not known.
    pub(crate) fn parse<T: DeserializeOwned>(self) -> Result<T> {
        toml::from_str(self.0).map_err(|e| {
            let span = e.span().unwrap_or(0..0);
            self.wrong(span, explain(e.message()))
        })
    }

    /// The same; an error has the column, too.
    ///
    /// # Errors
    /// The text is no TOML, or has other keys or values than a `T`.
    pub fn parse_to_the_column<T: DeserializeOwned>(self) -> Result<T> {
        toml::from_str(self.0).map_err(|e| {
            let (line, column) = self.place(e.span().map_or(0, |span| span.start));
            Error::failed(explain(e.message())).at(format!("line {line}, column {column}"))
        })
    }

    /// Line and column, from 1, of byte `offset`.
    fn place(self, offset: usize) -> (usize, usize) {
        let start = offset.min(self.0.len());
        let before = self.0.as_bytes()[..start].rsplit(|&byte| byte == b'\n').next().unwrap_or_default();
        (self.line(start), 1 + String::from_utf8_lossy(before).chars().count())
    }

    /// Line and column, from 1, of the key at the end of `path`, through tables from the top; `None` where it is not.
    #[must_use]
    pub fn place_of(self, path: &[&str]) -> Option<(usize, usize)> {
        let mut table = toml::de::DeTable::parse(self.0).ok()?.into_inner();
        let (last, tables) = path.split_last()?;
        for name in tables {
            let (_, value) = table.into_iter().find(|(key, _)| key.get_ref() == name)?;
            table = match value.into_inner() {
                toml::de::DeValue::Table(table) => table,
                _ => return None,
            };
        }
        let key = table.keys().find(|key| key.get_ref() == last)?;
        Some(self.place(key.span().start))
    }

    /// The error that `what` is wrong at `span`.
    pub(crate) fn wrong(self, span: Range<usize>, what: impl Into<String>) -> Error {
        Error::failed(what).at(format!("line {}", self.line(span.start)))
    }

    /// The line, from 1, that byte `offset` is on.
    pub(crate) fn line(self, offset: usize) -> usize {
        let before = &self.0.as_bytes()[..offset.min(self.0.len())];
        1 + before.iter().filter(|&&byte| byte == b'\n').count()
    }

    /// The number under `key`, if `fits` and not beyond belief.
    fn number(self, key: &str, value: &Spanned<f64>, must: &str, fits: impl Fn(f64) -> bool) -> Result<f64> {
        let number = *value.get_ref();
        if fits(number) && number.abs() <= MAX_CREDIBLE {
            return Ok(number);
        }
        Err(self.wrong(value.span(), format!("`{key}` is {number}; it must be {must}, and no more than 1e9 in size")))
    }

    /// The number under `key`, which must be over 0.
    pub(crate) fn positive(self, key: &str, value: &Spanned<f64>) -> Result<f64> {
        self.number(key, value, "over 0", |x| x > 0.0)
    }

    /// The number under `key`, which must not be under 0.
    pub(crate) fn not_negative(self, key: &str, value: &Spanned<f64>) -> Result<f64> {
        self.number(key, value, "0 or more", |x| x >= 0.0)
    }

    /// The number under `key`, which must be finite.
    pub(crate) fn finite(self, key: &str, value: &Spanned<f64>) -> Result<f64> {
        self.number(key, value, "a finite number", f64::is_finite)
    }

    /// The whole number under `key`, where it is given and in `range`.
    pub(crate) fn int(self, key: &str, value: Option<&Spanned<i64>>, range: Range<i64>) -> Result<Option<u32>> {
        let Some(value) = value else { return Ok(None) };
        let number = *value.get_ref();
        if range.contains(&number) {
            return Ok(Some(number as u32));
        }
        let last = range.end - 1;
        Err(self.wrong(value.span(), format!("`{key}` is {number}; it must be between {} and {last}", range.start)))
    }

    /// Refuses times under `key` that are negative or do not increase.
    pub(crate) fn check_times(self, key: &str, span: Range<usize>, times: impl IntoIterator<Item = f64>) -> Result<()> {
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

    /// Refuses `key`, which `why` has no use for.
    pub(crate) fn refuse<T>(self, key: &str, value: Option<&Spanned<T>>, why: impl Display) -> Result<()> {
        match value {
            Some(value) => Err(self.wrong(value.span(), format!("`{key}` has no effect {why}; remove it"))),
            None => Ok(()),
        }
    }

    /// That nothing is called `asked`, with the name among `known` that may be meant.
    pub(crate) fn unknown<'n>(
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
    fn a_key_is_found_where_it_stands() {
        let text = Text("a = 1\n[b]\n  c.d = 2\n");
        assert_eq!(text.place_of(&["a"]), Some((1, 1)));
        assert_eq!(text.place_of(&["b", "c", "d"]), Some((3, 5)));
        assert_eq!((text.place_of(&["b", "x"]), text.place_of(&["a", "c"]), text.place_of(&[])), (None, None, None));
    }

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
