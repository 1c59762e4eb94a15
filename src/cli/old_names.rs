//! Old names of flags, and of what is given to them.

use std::error::Error as _;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use somatic::internal::renamed::new_name;

/// In one line, what is given under an old name, if that is what `error` says of the arguments of `command`.
pub(super) fn renaming(error: &clap::Error, command: &clap::Command) -> Option<String> {
    let ContextValue::String(argument) = error.get(ContextKind::InvalidArg)? else { return None };
    let flag = argument.split_whitespace().next()?;
    match error.kind() {
        ErrorKind::UnknownArgument => {
            let asked = std::env::args_os().skip(1).find_map(|word| command.find_subcommand(word))?;
            let known: Vec<&str> = asked.get_arguments().filter_map(clap::Arg::get_long).collect();
            let new = new_name(flag.strip_prefix("--")?, known)?;
            Some(format!("`{flag}` is `--{new}` now"))
        }
        ErrorKind::InvalidValue => {
            let ContextValue::String(value) = error.get(ContextKind::InvalidValue)? else { return None };
            let ContextValue::Strings(known) = error.get(ContextKind::ValidValue)? else { return None };
            let new = new_name(value, known.iter().map(String::as_str))?;
            Some(format!("{flag}: `{value}` is `{new}` now"))
        }
        ErrorKind::ValueValidation => {
            let why = error.source()?.to_string();
            (why.starts_with('`') && why.ends_with("` now")).then(|| format!("{flag}: {why}"))
        }
        _ => None,
    }
}
