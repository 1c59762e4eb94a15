//! The groups that help shows flags in.

use clap::Arg;

/// Headings and the flags below them, in the order that help has them. Those of the first come under `Options`, and `-h`
/// shows them alone.
const GROUPS: [(&str, &[&str]); 6] = [
    ("", &["body", "source", "sink", "fields", "outputs", "calibration", "backend", "speed", "verify", "force"]),
    (
        "What is computed",
        &["letters", "signal", "tare", "coordinates", "max-gap", "filter-window", "filter-by", "filter-time"],
    ),
    ("Recordings", &["from", "to", "loop", "rate", "record"]),
    ("Live", &["for", "max-age", "strict", "wiring", "live-rate", "board-rate", "summary"]),
    (
        "Accuracy and speed",
        &[
            "within",
            "budget",
            "arithmetic",
            "charts",
            "orientation-by",
            "coverage",
            "change-threshold",
            "cadence",
            "batch",
        ],
    ),
    ("Output", &["all-fields", "quiet"]),
];

/// `arg` below its heading, at its place. What is in no group stays as it is.
pub(in crate::cli) fn grouped(arg: Arg) -> Arg {
    let flags = GROUPS.iter().flat_map(|(heading, flags)| flags.iter().map(move |flag| (*heading, *flag)));
    let place = flags.enumerate().find(|(_, (_, flag))| arg.get_long() == Some(flag));
    match place {
        None => arg,
        Some((index, ("", _))) => arg.display_order(index),
        Some((index, (heading, _))) => arg.display_order(index).help_heading(heading).hide_short_help(true),
    }
}

/// `arg` among the flags that come first.
pub(in crate::cli) fn first(arg: Arg) -> Arg {
    arg.help_heading(None::<&str>).hide_short_help(false)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::CommandFactory as _;

    use super::*;
    use crate::cli::Arguments;

    #[test]
    fn every_flag_of_run_is_in_one_group() {
        let command = Arguments::command();
        let run = command.find_subcommand("run").unwrap();
        let flags: BTreeSet<&str> = run.get_arguments().filter_map(Arg::get_long).collect();
        let grouped: Vec<&str> = GROUPS.iter().flat_map(|(_, flags)| flags.iter().copied()).collect();
        assert_eq!(grouped.len(), flags.len());
        assert_eq!(grouped.into_iter().collect::<BTreeSet<_>>(), flags);
    }
}
