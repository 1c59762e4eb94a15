//! `somatic completions`: what shells need to complete the command.

use clap::{Args, CommandFactory as _};
use clap_complete::Shell;
use somatic::Result;

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

pub(super) fn completions(arguments: &Arguments) -> Result<u8> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut super::Arguments::command(), "somatic", &mut script);
    super::print(&String::from_utf8_lossy(&script))?;
    Ok(super::DONE)
}
