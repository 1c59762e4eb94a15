//! The one error of this crate.
//!
//! An [`Error`] is one line a person can act on: which file, where in it, what is wrong, what to do. Programs match its
//! [`Error::kind`].

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::{fmt, io};

use serde::de::DeserializeOwned;

use crate::plain;
use crate::renamed::new_name;

/// `Result` with this crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What went wrong, in one line.
#[derive(Clone)]
pub struct Error {
    kind: ErrorKind,
    place: Option<String>,
    what: String,
    cause: Option<Arc<io::Error>>,
}

/// Equal where they say the same.
impl PartialEq for Error {
    fn eq(&self, other: &Self) -> bool {
        (self.kind, &self.place, &self.what) == (other.kind, &other.place, &other.what)
    }
}

impl Eq for Error {}

/// What a program can do about an [`Error`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// What was read cannot be used: a damaged file, a value that makes no sense.
    Input,
    /// What was asked for makes no sense, or not together.
    Usage,
    /// A file that was named is not there.
    NotFound,
    /// The operating system refused: no permission, a full disk, a line that was unplugged. [`std::error::Error::source`] has its error.
    Io,
    /// The machine has no adapter that the GPU backend can run on.
    NoAdapter,
    /// The GPU that computed stopped answering: its driver was reset or replaced, or it was taken away. Another engine may be made,
    /// and go on from the last `EngineState`.
    DeviceLost,
}

impl Error {
    /// Something that was read cannot be used, or something that was tried did not succeed.
    #[must_use]
    pub fn failed(what: impl Into<String>) -> Self {
        Self::new(ErrorKind::Input, what.into())
    }

    /// The caller asked for something that makes no sense, or not together.
    #[must_use]
    pub fn usage(what: impl Into<String>) -> Self {
        Self::new(ErrorKind::Usage, what.into())
    }

    /// The machine has no adapter that the GPU backend can run on.
    #[must_use]
    pub fn no_adapter(what: impl Into<String>) -> Self {
        Self::new(ErrorKind::NoAdapter, what.into())
    }

    /// The same as a usage error: where a file says what is asked for, its mistakes are those of who asks.
    #[must_use]
    pub fn into_usage(self) -> Self {
        Self { kind: ErrorKind::Usage, ..self }
    }

    /// The GPU that computed stopped answering.
    #[must_use]
    pub fn gpu_lost(what: impl Into<String>) -> Self {
        Self::new(ErrorKind::DeviceLost, what.into())
    }

    /// An operation on the file at `path` failed in the operating system.
    #[must_use]
    pub fn io(path: impl AsRef<Path>, error: &io::Error) -> Self {
        let (kind, what) = match error.kind() {
            io::ErrorKind::NotFound => (ErrorKind::NotFound, "no such file or directory".to_owned()),
            io::ErrorKind::IsADirectory => (ErrorKind::Input, "this is a folder; name a file".to_owned()),
            _ => (ErrorKind::Io, error.to_string()),
        };
        // It cannot be copied, but what it says can.
        let cause = error
            .raw_os_error()
            .map_or_else(|| io::Error::new(error.kind(), error.to_string()), io::Error::from_raw_os_error);
        Self { cause: Some(Arc::new(cause)), ..Self::new(kind, what) }.at(path.as_ref().display().to_string())
    }

    fn new(kind: ErrorKind, what: String) -> Self {
        Self { kind, place: None, what, cause: None }
    }

    /// The same error at `place` (a file, a row, a key). Called again, the outer place comes first.
    #[must_use]
    pub fn at(mut self, place: impl fmt::Display) -> Self {
        self.place = Some(match self.place.take() {
            Some(inner) => format!("{place}: {inner}"),
            None => place.to_string(),
        });
        self
    }

    /// Where it is: a file, then what in it, `: ` between them.
    #[must_use]
    pub fn place(&self) -> Option<&str> {
        self.place.as_deref()
    }

    /// What a program can do about it.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// True when the request itself was wrong: arguments that do not exist or do not go together.
    #[must_use]
    pub fn is_usage(&self) -> bool {
        self.kind == ErrorKind::Usage
    }

    /// The exit code that a command ends with on this error: 2 for usage, else 1.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        if self.is_usage() { 2 } else { 1 }
    }
}

/// [`Error::failed`] with a formatted message.
#[macro_export]
#[doc(hidden)]
macro_rules! failed {
    ($($what:tt)+) => {
        $crate::error::Error::failed(format!($($what)+))
    };
}
pub use failed;

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = match &self.place {
            Some(place) => format!("{place}: {}", self.what),
            None => self.what.clone(),
        };
        // Whatever a library or a file name put in, an error stays one line.
        let words: Vec<&str> = line.split(['\n', '\r']).map(str::trim).filter(|s| !s.is_empty()).collect();
        f.write_str(&plain::line(&words.join(" ")))
    }
}

impl fmt::Debug for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Error({self})")
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.cause.as_deref().map(|cause| cause as _)
    }
}

/// The name among `known` that is nearest to `asked`, if one is near enough to be a slip of the hand.
///
/// Near is an edit distance, swaps of neighbours counting once, of at most a third of the longer word.
#[must_use]
pub fn nearest<'a>(asked: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|name| {
            // Of those equally far, the one that begins alike: slips of the hand are rare in first letters.
            let alike = asked.chars().zip(name.chars()).take_while(|(a, b)| a == b).count();
            (strsim::osa_distance(asked, name), std::cmp::Reverse(alike), name)
        })
        .filter(|&(distance, _, name)| 3 * distance <= asked.chars().count().max(name.chars().count()))
        .min()
        .map(|(_, _, name)| name)
}

/// The shortest name among `known` that `asked` is the first word of.
fn begun<'a>(asked: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let goes_on = |name: &&str| name.strip_prefix(asked).is_some_and(|rest| rest.starts_with(['_', '-', '/', '.']));
    known.filter(|_| !asked.is_empty()).filter(goes_on).min_by_key(|name| name.len())
}

/// What to try instead of the unknown name `asked`: the nearest of the `known` names, or a list of them.
#[must_use]
pub fn suggestion<'a>(asked: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: BTreeSet<&str> = known.into_iter().collect();
    let near = nearest(asked, known.iter().copied()).or_else(|| begun(asked, known.iter().copied()));
    if let Some(near) = near {
        return format!("did you mean `{near}`?");
    }
    let first: Vec<&str> = known.iter().copied().take(MAX_SUGGESTIONS).collect();
    match known.len() {
        0 => "there is none".to_owned(),
        count if count > first.len() => format!("it is one of {}, …", first.join(", ")),
        _ => format!("it is one of {}", first.join(", ")),
    }
}

/// The message about `asked`, which is not a `what` among the `known` names: its new name, or what to try instead.
#[must_use]
pub fn unknown<'a>(what: &str, asked: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    match new_name(asked, known.iter().copied()) {
        Some(new) => format!("`{asked}` is `{new}` now"),
        None => format!("there is no {what} `{asked}`; {}", suggestion(asked, known)),
    }
}

/// Maximum number of names in a [`suggestion`].
const MAX_SUGGESTIONS: usize = 30;

/// The content of the TOML file `text`.
///
/// # Errors
/// It is not TOML, or has other keys or values than a `T`. The error has the line and the column, and a suggestion for an
/// unknown key.
pub fn parse_toml<T: DeserializeOwned>(text: &str) -> Result<T> {
    toml::from_str(text).map_err(|e| {
        let start = e.span().map_or(0, |span| span.start);
        Error::failed(explain(e.message())).at(place_in(text, start))
    })
}

/// The line and the column of byte `offset` of `text`, from 1, for [`Error::at`].
#[must_use]
pub fn place_in(text: &str, offset: usize) -> String {
    let before = String::from_utf8_lossy(&text.as_bytes()[..offset.min(text.len())]);
    let line = 1 + before.matches('\n').count();
    let column = 1 + before.rsplit('\n').next().map_or(0, |last| last.chars().count());
    format!("line {line}, column {column}")
}

/// The message of the TOML parser in the words of this crate, with a suggestion for an unknown word.
fn explain(message: &str) -> String {
    if let Some(key) = message.strip_prefix("missing field ") {
        return format!("{key} is missing");
    }
    let mut quoted = message.split('`').skip(1).step_by(2);
    let kind = match message.split('`').next() {
        Some("unknown field ") => "key",
        Some("unknown variant ") => "choice",
        _ => return wrong_type(message).unwrap_or_else(|| message.to_owned()),
    };
    let Some(word) = quoted.next() else { return message.to_owned() };
    let known: Vec<&str> = quoted.collect();
    // The unit at the end of a key is often forgotten.
    match known.iter().find(|name| name.strip_prefix(word).is_some_and(|unit| unit.starts_with('_'))) {
        Some(near) => format!("there is no {kind} `{word}`; did you mean `{near}`?"),
        None => unknown(kind, word, known),
    }
}

/// The message of the TOML parser that a value is of another type, in the words of this crate.
fn wrong_type(message: &str) -> Option<String> {
    let (found, wanted) = message.strip_prefix("invalid type: ")?.split_once(", expected ")?;
    let found = match found.split_once(' ') {
        Some(("integer", number)) => format!("the number {number}"),
        Some(("floating", point)) => format!("the number {}", point.trim_start_matches("point ")),
        Some(("string", text)) => format!("the text {text}"),
        Some(("boolean", choice)) => choice.to_owned(),
        None if found == "map" => "a table".to_owned(),
        None if found == "sequence" => "a list".to_owned(),
        _ => found.to_owned(),
    };
    let wanted = match wanted {
        "f32" | "f64" => "a number",
        "a sequence" => "a list",
        "a string" => "a text",
        "a boolean" => "true or false",
        "a map" => "a table of keys",
        wanted if wanted.starts_with("struct ") => "a table of keys",
        "i8" | "i16" | "i32" | "i64" | "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number",
        wanted => wanted,
    };
    Some(format!("this is {found}; it must be {wanted}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_of_another_type_is_told_without_the_parsers_words() {
        for (message, right) in [
            ("invalid type: integer `0`, expected a sequence", "this is the number `0`; it must be a list"),
            (
                "invalid type: floating point `0.05`, expected u32",
                "this is the number `0.05`; it must be a whole number",
            ),
            ("invalid type: string \"a\", expected f64", "this is the text \"a\"; it must be a number"),
            ("invalid type: boolean `true`, expected a string", "this is `true`; it must be a text"),
            ("invalid type: map, expected a boolean", "this is a table; it must be true or false"),
            ("invalid type: sequence, expected struct ShearKeys", "this is a list; it must be a table of keys"),
            ("invalid type: integer `5`, expected { b_k = K }", "this is the number `5`; it must be { b_k = K }"),
        ] {
            assert_eq!(explain(message), right);
        }
        #[derive(Debug, serde::Deserialize)]
        struct Inner {
            _number: f64,
        }
        #[derive(Debug, serde::Deserialize)]
        struct File {
            _inner: Option<Inner>,
            _list: Option<Vec<f64>>,
        }
        let why = |text: &str| parse_toml::<File>(text).unwrap_err().to_string();
        assert_eq!(why("_inner = 3"), "line 1, column 10: this is the number `3`; it must be a table of keys");
        assert_eq!(why("_list = [1,\n\"a\"]"), "line 2, column 1: this is the text \"a\"; it must be a number");
        assert_eq!(why("[_inner]\n_number = \"1\""), "line 2, column 11: this is the text \"1\"; it must be a number");
    }

    #[test]
    fn an_error_is_one_line_with_its_place() {
        let error = Error::failed("bad\n  value").at("row 3").at("a.csv");
        assert_eq!(error.to_string(), "a.csv: row 3: bad value");
        assert_eq!(error.place(), Some("a.csv: row 3"));
        assert_eq!(error.exit_code(), 1);
        assert_eq!(Error::usage("x").exit_code(), 2);
        assert_eq!(Error::failed("`\x1b]0;P\x07`\t").at("a\0.csv").to_string(), "a\\u0000.csv: `\\u001b]0;P\\u0007`");
    }

    #[test]
    fn an_error_keeps_its_cause() {
        let error = Error::io("a.csv", &io::Error::from_raw_os_error(2)).at("run");
        let cause = std::error::Error::source(&error).and_then(|cause| cause.downcast_ref::<io::Error>());
        assert_eq!(cause.map(io::Error::kind), Some(io::ErrorKind::NotFound));
        assert!(std::error::Error::source(&Error::usage("x")).is_none());
    }

    #[test]
    fn a_slip_of_the_hand_finds_its_word() {
        assert_eq!(nearest("sorce", ["force", "source"]), Some("source"));
        assert_eq!(nearest("centriod", ["total", "centroid", "axis"]), Some("centroid"));
        assert_eq!(nearest("banana", ["total", "centroid", "axis"]), None);
    }

    #[test]
    fn the_parsers_words_become_ours() {
        assert_eq!(
            explain("unknown field `rate`, expected one of `rate_hz`, `body`"),
            "there is no key `rate`; did you mean `rate_hz`?"
        );
        assert_eq!(
            explain("unknown variant `x`, expected `rod` or `ball`"),
            "there is no choice `x`; it is one of ball, rod"
        );
        assert_eq!(explain("missing field `body`"), "`body` is missing");
        assert_eq!(explain("unknown field `upkeep`, expected one of `all`, `drift`"), "`upkeep` is `drift` now");
        assert_eq!(
            explain("unknown field `upkeep`, expected `taxels`"),
            "there is no key `upkeep`; it is one of taxels"
        );
    }
}
