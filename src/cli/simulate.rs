//! `somatic simulate`: a simulation written down as a recording, with the truth and a calibration beside it.

use std::path::PathBuf;

use clap::Args;
use somatic::source::{SimulatedSource, write_recording};
use somatic::{Error, Result};

use super::files::FilesRead;
use super::stdio::{DONE, say};

const EXAMPLES: &str = "\
Examples:
  somatic simulate examples/simulations/rod.toml -o rod.csv     and truth, and calibration
  somatic run --source rod.csv --calibration rod.calibration.toml --sink ndjson:percepts.ndjson
  somatic run --source sim:examples/simulations/rod.toml        without a file in between

docs/simulation.md describes the file, the model and the truth.";

/// Write a simulated touch down as a recording, with what is true in it and its sensors' calibration beside it.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The simulation, a TOML file.
    #[arg(value_name = "FILE.toml")]
    simulation: PathBuf,

    /// The recording to write, CSV.
    #[arg(short, long, value_name = "FILE.csv")]
    output: PathBuf,

    /// Where the truth goes, CSV [default: beside the recording, as NAME.truth.csv].
    #[arg(long, value_name = "FILE.csv")]
    truth: Option<PathBuf>,

    /// Replace the files if they are there.
    #[arg(long)]
    force: bool,
}

pub(super) fn simulate(arguments: &Arguments) -> Result<u8> {
    let read = FilesRead::default().files(SimulatedSource::files(&arguments.simulation));
    let mut outputs = read.outputs(arguments.force);
    let frames_to = outputs.add(&arguments.output)?;
    let output = arguments.output.display();
    let truth = match &arguments.truth {
        Some(truth) => truth.clone(),
        None if frames_to.is_file() => arguments.output.with_extension("truth.csv"),
        None => return Err(Error::usage("the output is a pipe or a device; give --truth a file").at(output)),
    };
    let calibration = frames_to.is_file().then(|| arguments.output.with_extension("calibration.toml"));
    let truth_to = outputs.add(&truth)?;
    let calibration_to = calibration.as_ref().map(|path| outputs.add(path)).transpose()?;
    let mut simulation = SimulatedSource::open(&arguments.simulation)?;
    let frames = write_recording(&mut simulation, frames_to, truth_to)?;
    let mut told = format!("{frames} frames in {output}, the truth in {}", truth.display());
    if let Some(to) = calibration_to {
        told += &format!(", the calibration in {}", to.name().display());
        to.write(simulation.calibration().as_bytes())?;
    }
    say(&told);
    Ok(DONE)
}
