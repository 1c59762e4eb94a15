//! What flags have in common: headings, and parsers of words.

use std::str::FromStr;

use clap::Arg;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use somatic::{Error, Receptor};

/// Headings of flags that `-h` leaves out.
pub(super) const COMPUTED: &str = "What is computed";
pub(super) const RECORDINGS: &str = "Recordings";
pub(in crate::cli) const LIVE: &str = "Live";
pub(super) const ROBOT: &str = "Robot";
pub(super) const ACCURACY: &str = "Accuracy and speed";
pub(super) const OUTPUT: &str = "Output";

/// Leaves `arg` out of `-h` if it has a heading.
pub(in crate::cli) fn grouped(arg: Arg) -> Arg {
    let has_heading = arg.get_help_heading().is_some();
    arg.hide_short_help(has_heading)
}

/// `arg` among the flags that come first.
pub(in crate::cli) fn first(arg: Arg) -> Arg {
    arg.help_heading(None::<&str>).hide_short_help(false)
}

/// Reads a letter.
pub(in crate::cli) fn letter() -> impl TypedValueParser<Value = Receptor> {
    one_of::<Receptor>(Receptor::NAMES.map(|(name, _)| name))
}

/// Reads one of `words`.
pub(in crate::cli) fn one_of<T>(
    words: impl IntoIterator<Item = impl Into<PossibleValue>>,
) -> impl TypedValueParser<Value = T>
where
    T: FromStr<Err = Error> + Clone + Send + Sync + 'static,
{
    PossibleValuesParser::new(words).try_map(|word| word.parse::<T>())
}
