//! `somatic completions`: what shells need to complete the command.

use clap::Args;
use clap_complete::Shell;
use somatic::Result;

use super::stdio::{DONE, print};

const EXAMPLES: &str = "\
Examples:
  somatic completions bash > ~/.local/share/bash-completion/completions/somatic
  somatic completions fish > ~/.config/fish/completions/somatic.fish";

/// Print a completion script for a shell.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The shell to print it for.
    shell: Shell,
}

/// Prints the script for `command`.
pub(super) fn completions(arguments: &Arguments, command: &mut clap::Command) -> Result<u8> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, command, "somatic", &mut script);
    print(&String::from_utf8_lossy(&script))?;
    Ok(DONE)
}
