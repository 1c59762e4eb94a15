//! The command line: one file per subcommand, and what they share.

mod attached;
mod attachments;
mod author;
mod bar;
mod bench;
#[cfg(unix)]
mod board;
mod bodies;
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
mod feed;
mod files;
mod first_source;
mod info;
mod input;
mod inspect;
mod interrupt;
#[cfg(unix)]
mod keys;
mod latency;
mod lines;
mod live;
mod old_names;
mod overlaid;
mod paper;
mod plan;
mod plot;
mod plot_file;
mod ports;
#[cfg(feature = "gpu")]
mod render;
mod repeats;
mod run;
mod scene;
mod screen;
mod simulate;
mod states_from;
mod stdio;
mod table;
mod text_flags;
mod tradeoff;
mod tune;
mod unfit;
mod verify;
#[cfg(feature = "page")]
mod view;
mod words;

use std::process::ExitCode;

use clap::{CommandFactory as _, Parser, Subcommand};
use somatic::{Error, Result};

pub(crate) use self::stdio::say;
use self::stdio::{DONE, print};

/// What `somatic` alone prints.
const GREETING: &str = concat!(
    "somatic ",
    env!("CARGO_PKG_VERSION"),
    ", a sense of touch for whole robots: touch frames in, percepts out

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
  somatic run                                   watch a recorded touch on the bundled hand
  somatic run | jq -c '.fields[] | [.field, .total]'
  somatic run --body robot.glb --source touch.csv --sink percepts.ndjson   or percepts.csv, a table
  robot-driver | somatic run --body robot.glb --source - | controller
  somatic run --source serial:/dev/ttyUSB0 --wiring hand.toml     live, from a board on a serial line
  somatic view touch.mcap --open                see a recording on the body, in a browser
  somatic inspect robot.glb                     what taxels and fields a body has
  somatic author mesh.glb --taxels 500 -o robot.glb   a skin for a mesh
  somatic author --grid 64x32 --pitch 25.4mm -o mat.glb   a flat sheet of sensors
  somatic render robot.glb -o robot.png         a picture of them
  somatic plan --outputs centroid               what is computed, what is not, and the cost
  somatic tradeoff --within '0.5 mm, 2 deg'     the fastest knobs within a tolerance, here
  somatic simulate touch.toml -o touch.csv      a simulated touch, with the truth
  somatic tune --source serial:/dev/ttyUSB0 -o hand.toml   set the sensors' potentiometers
  somatic board --link /tmp/hand                a simulated hand on a serial line
  somatic plot touch.mcap -o touch.svg          load over time, highest pressures, their centre's path
  somatic info touch.mcap                       how long a recording is, and what is in it
  somatic bench --sensors 1000 --fields 100     the speed of this machine
  somatic devices                               which GPUs and serial ports it has

Exit codes: 0 done, 1 failed, 2 wrong usage, 3 done but some input was never processed.";

/// A sense of touch for whole robots: touch frames in, percepts out.
///
/// It reads where the sensors sit from a glTF body, groups them into receptive fields, and says for every field and
/// frame where the touch is, how strong, and how it is oriented.
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
    Paper(paper::Arguments),
    #[cfg(unix)]
    Board(Box<board::Arguments>),
    Bench(bench::Arguments),
    Calibrate(calibrate::Arguments),
    Tune(tune::Arguments),
    Devices(devices::Arguments),
    Completions(completions::Arguments),
}

/// Prints what the arguments are answered with, help or what is wrong with them, and gives the exit code.
pub(crate) fn answer(answer: &clap::Error) -> ExitCode {
    match old_names::told(answer, &Arguments::command()) {
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
    let Some(command) = &arguments.command else {
        print(GREETING)?;
        return Ok(DONE);
    };
    match command {
        Command::Run(arguments) => run::run(arguments),
        #[cfg(feature = "page")]
        Command::View(arguments) => view::view(arguments),
        Command::Inspect(arguments) => inspect::inspect(arguments),
        Command::Author(arguments) => author::run(arguments),
        #[cfg(feature = "gpu")]
        Command::Render(arguments) => render::render(arguments),
        Command::Plan(arguments) => plan::plan(arguments),
        Command::Tradeoff(arguments) => tradeoff::tradeoff(arguments),
        Command::Simulate(arguments) => simulate::simulate(arguments),
        Command::Info(arguments) => info::info(arguments),
        Command::Convert(arguments) => convert::convert(arguments),
        Command::Plot(arguments) => plot::plot(arguments),
        Command::Paper(arguments) => paper::paper(arguments),
        #[cfg(unix)]
        Command::Board(arguments) => board::run(arguments),
        Command::Bench(arguments) => bench::bench(arguments),
        Command::Calibrate(arguments) => calibrate::calibrate(arguments),
        Command::Tune(arguments) => tune::tune(arguments),
        Command::Devices(arguments) => devices::devices(arguments),
        Command::Completions(arguments) => completions::completions(arguments, &mut Arguments::command()),
    }
}
