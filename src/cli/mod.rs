//! The command line: one file per subcommand, and what they share.

mod author;
mod bar;
mod bench;
#[cfg(all(feature = "board", unix))]
mod board;
#[cfg(feature = "page")]
mod browser;
mod calibrate;
mod completions;
mod convert;
mod describe;
mod devices;
mod doubts;
mod expected;
#[cfg(feature = "page")]
mod explanation;
mod exports;
mod help;
mod info;
mod inspect;
mod interrupt;
#[cfg(unix)]
mod keys;
mod latency;
mod lines;
mod live;
mod old_names;
mod outputs;
#[cfg(feature = "paper")]
mod paper;
mod plan;
mod plot;
mod plot_file;
mod ports;
#[cfg(feature = "gpu")]
mod render;
mod run;
mod scene;
mod screen;
mod simulate;
mod stdio;
mod table;
mod text_flags;
mod tradeoff;
#[cfg(feature = "tune")]
mod tune;
mod verify;
#[cfg(feature = "page")]
mod view;
mod words;

use std::process::ExitCode;

use clap::{CommandFactory as _, FromArgMatches as _, Parser, Subcommand};
use somatic::{Error, Result};

use self::scene::in_flags;
pub(crate) use self::stdio::say;
use self::stdio::{DONE, print};

/// What `somatic` alone prints.
const GREETING: &str = concat!(
    "somatic ",
    env!("CARGO_PKG_VERSION"),
    ", a sense of touch for whole robots: touch frames in, touches out

  somatic run         turn touch frames into percepts; alone, on a bundled touch
  somatic view        show it in a browser: a body, a recording or a scene
  somatic inspect     show the taxels and fields of a body
  somatic author      put taxels and fields on a mesh
  somatic calibrate   calibrate the sensors from a rest and a press

All commands: somatic --help. First flags of one: somatic run -h
"
);

const EXAMPLES: &str = "\
Examples:
  somatic run                                             watch a touch on the bundled hand
  somatic view touch.mcap --open                          see a recording on the body, in a browser
  somatic author robot.urdf --taxels 500 -o robot.glb     a skin for a robot, or for a mesh
  somatic run --body robot.glb --source touch.csv --sink percepts.csv
  somatic run --source serial:/dev/ttyUSB0 --wiring hand.toml
  robot-driver | somatic run --body robot.glb --source - | controller

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 done but some input was never processed.";

/// A sense of touch for whole robots: raw values of sensors in, touches out.
///
/// A glTF body has the places of the sensors. For every touch on it, somatic gives its place, how hard it presses, how it
/// lies and how it moves. For every receptive field it gives the same.
#[derive(Parser)]
#[command(name = "somatic", version, after_help = EXAMPLES, max_term_width = 100)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    Run(Box<run::Arguments>),
    #[cfg(feature = "page")]
    View(Box<view::Arguments>),
    Inspect(inspect::Arguments),
    Author(Box<author::Arguments>),
    #[cfg(feature = "gpu")]
    Render(render::Arguments),
    Plan(Box<plan::Arguments>),
    Tradeoff(Box<tradeoff::Arguments>),
    Simulate(simulate::Arguments),
    Info(info::Arguments),
    Convert(convert::Arguments),
    Plot(Box<plot::Arguments>),
    #[cfg(feature = "paper")]
    Paper(paper::Arguments),
    #[cfg(all(feature = "board", unix))]
    Board(Box<board::Arguments>),
    Bench(bench::Arguments),
    Calibrate(calibrate::Arguments),
    #[cfg(feature = "tune")]
    Tune(tune::Arguments),
    Devices(devices::Arguments),
    Outputs(outputs::Arguments),
    Completions(completions::Arguments),
}

/// The command as clap has it.
fn command() -> clap::Command {
    help::in_groups(Arguments::command())
}

/// The arguments of this process, or what to answer instead: help, or what is wrong.
pub(crate) fn arguments() -> Result<Arguments, clap::Error> {
    let mut command = command();
    let matches = command.try_get_matches_from_mut(std::env::args_os())?;
    Arguments::from_arg_matches(&matches).map_err(|error| error.format(&mut command))
}

/// Prints what the arguments are answered with, help or what is wrong with them, and gives the exit code.
pub(crate) fn answer(answer: &clap::Error) -> ExitCode {
    match old_names::renaming(answer, &command()) {
        Some(what) => {
            let error = Error::usage(what);
            say(&format!("{}: {error}", console::style("error").red().bold().for_stderr()));
            ExitCode::from(error.exit_code())
        }
        None => stdio::answer(answer),
    }
}

/// Does what was asked for and gives the exit code.
pub(crate) fn run(arguments: &Arguments) -> Result<u8> {
    stdio::refuse_closed_output();
    interrupt::heed_signals()?;
    let Some(subcommand) = &arguments.command else {
        print(GREETING)?;
        return Ok(DONE);
    };
    match subcommand {
        Command::Run(arguments) => run::run(arguments),
        #[cfg(feature = "page")]
        Command::View(arguments) => view::view(arguments),
        Command::Inspect(arguments) => inspect::inspect(arguments),
        Command::Author(arguments) => author::run(arguments),
        #[cfg(feature = "gpu")]
        Command::Render(arguments) => render::render(arguments).map_err(in_flags),
        Command::Plan(arguments) => plan::plan(arguments),
        Command::Tradeoff(arguments) => tradeoff::tradeoff(arguments),
        Command::Simulate(arguments) => simulate::simulate(arguments),
        Command::Info(arguments) => info::info(arguments),
        Command::Convert(arguments) => convert::convert(arguments),
        Command::Plot(arguments) => plot::plot(arguments).map_err(in_flags),
        #[cfg(feature = "paper")]
        Command::Paper(arguments) => paper::paper(arguments),
        #[cfg(all(feature = "board", unix))]
        Command::Board(arguments) => board::run(arguments),
        Command::Bench(arguments) => bench::bench(arguments),
        Command::Calibrate(arguments) => calibrate::calibrate(arguments),
        #[cfg(feature = "tune")]
        Command::Tune(arguments) => tune::tune(arguments),
        Command::Devices(arguments) => devices::devices(arguments),
        Command::Completions(arguments) => completions::completions(arguments, &mut command()),
        Command::Outputs(arguments) => outputs::outputs(arguments),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_is_in_one_group_of_the_help_and_its_line_fits_a_terminal() {
        let command = command();
        for subcommand in command.get_subcommands() {
            let groups = help::GROUPS.iter().filter(|(_, names)| names.contains(&subcommand.get_name()));
            assert_eq!(groups.count(), 1, "{}", subcommand.get_name());
        }
        let text = help::groups(&command);
        assert!(text.lines().all(|line| line.chars().count() <= 90), "{text}");
    }
}
