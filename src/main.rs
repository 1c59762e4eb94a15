//! The command `somatic`: parse, call, exit code.

mod cli;

use std::process::ExitCode;

use clap::Parser as _;

fn main() -> ExitCode {
    match cli::run(&cli::Arguments::parse()) {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            cli::say(&format!("{}: {error}", console::style("error").red().bold().for_stderr()));
            ExitCode::from(error.exit_code())
        }
    }
}
