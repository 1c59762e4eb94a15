//! The help of the command: subcommands in groups, by what they are for.

use clap::Command;

/// Subcommands by group, in the order of the help.
pub(super) const GROUPS: [(&str, &[&str]); 4] = [
    ("Use", &["run", "view", "info", "convert", "plot"]),
    ("Set up", &["author", "inspect", "render", "calibrate", "tune"]),
    ("Check", &["plan", "tradeoff", "simulate", "bench"]),
    ("More", &["outputs", "devices", "board", "paper", "completions", "help"]),
];

/// Columns that names take, with what is around them.
const NAME_WIDTH: usize = 13;

/// `command` with its help in groups.
pub(super) fn in_groups(command: Command) -> Command {
    let groups = groups(&command);
    command.help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{groups}Options:\n{{options}}{{after-help}}"
    ))
}

/// A line for each subcommand, under the headings of their groups.
pub(super) fn groups(command: &Command) -> String {
    let line = |name: &str| {
        let about = match command.find_subcommand(name) {
            Some(found) => found.get_about().map(ToString::to_string),
            None => (name == "help").then(|| "Print the help of a command".to_owned()),
        };
        about.map_or(String::new(), |about| format!("  {name:<NAME_WIDTH$}{about}\n"))
    };
    let group = |(heading, names): &(&str, &[&str])| {
        format!("{heading}:\n{}\n", names.iter().map(|name| line(name)).collect::<String>())
    };
    GROUPS.iter().map(group).collect()
}
