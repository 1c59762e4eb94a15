//! Errors of scenes, which speak of keys, in the words of who has given flags.

use clap::{Args as _, Command};
use somatic::Error;

use super::run_flags::RunFlags;

/// `error` with flags in the place of keys, if it is of what was asked for: `--max-gap 0` for `` `max_gap_s = 0` ``.
pub(in crate::cli) fn in_flags(error: Error) -> Error {
    if !error.is_usage() {
        return error;
    }
    let text = error.to_string();
    match error.place() {
        Some(place) => {
            let what = text.strip_prefix(place).and_then(|rest| rest.strip_prefix(": ")).unwrap_or(&text);
            Error::usage(words_of_flags(what)).at(words_of_flags(place))
        }
        None => Error::usage(words_of_flags(&text)),
    }
}

/// `text` with flags in the place of keys.
pub(in crate::cli) fn words_of_flags(text: &str) -> String {
    let command = RunFlags::augment_args(Command::new("run"));
    let flag_of = |key: &str| command.get_arguments().find(|flag| flag.get_id() == key)?.get_long();
    let mut parts = text.split('`');
    let mut words = parts.next().unwrap_or_default().to_owned();
    while let Some(quoted) = parts.next() {
        let after = parts.next();
        let (key, value) = quoted.split_once(" = ").map_or((quoted, None), |(key, value)| (key, Some(value)));
        match (flag_of(key), after) {
            (Some(flag), Some(_)) => {
                words += &format!("--{flag}");
                words.extend(value.map(|value| format!(" {}", value.trim_matches('"'))));
            }
            (_, Some(_)) => words += &format!("`{quoted}`"),
            (_, None) => words += &format!("`{quoted}"),
        }
        words += after.unwrap_or_default();
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_become_flags_and_other_words_stay() {
        for (keys, flags) in [
            ("`max_gap_s = 0` is not a time span", "--max-gap 0 is not a time span"),
            ("`strict` is for `source = \"-\"`; no", "--strict is for --source -; no"),
            ("leave `loop` out", "leave --loop out"),
            ("`overwrite`, `touch` and `centroid`", "--force, `touch` and `centroid`"),
            ("a ` alone, and `b", "a ` alone, and `b"),
        ] {
            assert_eq!(in_flags(Error::usage(keys).at("`unit`")).to_string(), format!("--unit: {flags}"));
        }
    }
}
