//! `somatic simulate`: a simulation written down as a recording, with the truth beside it.

use std::path::PathBuf;

use clap::Args;
use somatic::Result;
use somatic::source::{SimulatedSource, write_recording};

use super::{DONE, say};

const EXAMPLES: &str = "\
Examples:
  somatic simulate examples/simulations/rod.toml -o rod.csv     rod.csv, and the truth in rod.truth.csv
  somatic run --source rod.csv --sink percepts.ndjson
  somatic run --source sim:examples/simulations/rod.toml        without a file in between

docs/simulation.md describes the file, the model and the truth.";

/// Write a simulated touch down as a recording, with what is true in it beside it.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The simulation, a TOML file.
    #[arg(value_name = "FILE.toml")]
    simulation: PathBuf,

    /// The recording to write, CSV; replaced if it is there.
    #[arg(short, long, value_name = "FILE.csv")]
    output: PathBuf,

    /// Where the truth goes, CSV [default: beside the recording, as NAME.truth.csv].
    #[arg(long, value_name = "FILE.csv")]
    truth: Option<PathBuf>,
}

pub(super) fn simulate(arguments: &Arguments) -> Result<u8> {
    let mut simulation = SimulatedSource::open(&arguments.simulation)?;
    let truth = arguments.truth.clone().unwrap_or_else(|| arguments.output.with_extension("truth.csv"));
    let frames = write_recording(&mut simulation, &arguments.output, &truth)?;
    let (output, truth) = (arguments.output.display(), truth.display());
    say(&format!("{frames} frames in {output}, the truth in {truth}"));
    Ok(DONE)
}
