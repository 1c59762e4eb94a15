//! `somatic simulate`: a simulation written down as a recording, with the truth and a calibration beside it.

use std::path::PathBuf;

use clap::Args;
use somatic::internal::setup::FilesRead;
use somatic::internal::source::write_recording_with_progress;
use somatic::source::{SimulatedSource, Source as _};
use somatic::{Error, Result};

use super::bar::Bar;
use super::stdio::{DONE, say};

const EXAMPLES: &str = "\
Examples:
  somatic simulate examples/simulations/rod.toml -o rod.csv     and truth, and calibration
  somatic run --source rod.csv --calibration rod.calibration.toml --sink ndjson:percepts.ndjson
  somatic run --source sim:examples/simulations/rod.toml        without a file in between

A simulation is TOML: the body, the rate, and touches, which move along paths in a field's chart.

  body = \"hand\"
  rate_hz = 50
  duration_s = 4
  [layer]                       # the layer over the sensors; without it they feel contacts as they are
  thickness_m = 0.007
  stiffness_pa = 400e3
  [sensor]                      # ideal, linear or fsr; ideal ones give newton
  kind = \"fsr\"
  noise_sigma = 1.5
  [[touch]]
  on = \"hand/back\"
  indenter = \"rod\"              # or ball, fingertip, flat, edge
  radius_m = 0.0127
  length_m = 0.05
  path = [[0, 0.015], [0, -0.015]]
  times_s = [0.5, 3.5]
  force_newton = [[0.5, 0], [0.7, 32], [3.3, 34], [3.5, 0]]

  [[touch]]
  on = \"body\"                   # across links, on the surface as it is curved; ball, ellipsoid, rod, strap or pair
  indenter = \"strap\"
  width_m = 0.02
  length_m = 0.08
  path = [{ taxel = 12 }, { link = \"palm\", at = [0.01, 0.0, 0.02] }]
  speed_m_s = 0.02
  press = { from_s = 0.5, to_s = 3, newton = 8, ramp_s = 0.3 }

The truth has a row per frame and touch: its place, normal, angle, velocity, speed and force.";

/// Write a simulated touch as a recording, with its truth.
///
/// A table of the truth and the sensors' calibration are written next to the recording.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The simulation, a TOML file.
    #[arg(value_name = "FILE.toml")]
    simulation: PathBuf,

    /// The recording to write, CSV, or - for standard output.
    #[arg(short, long, value_name = "FILE.csv")]
    output: PathBuf,

    /// Where the truth goes, CSV [default: next to the recording, as NAME.truth.csv].
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
    simulation.notices().iter().for_each(|notice| say(notice));
    let place = frames_to.name().display().to_string();
    let mut bar = Bar::new("simulating");
    let frames = write_recording_with_progress(&mut simulation, frames_to, truth_to, &mut |share| {
        bar.show_with_time_left(share);
    })?;
    drop(bar);
    simulation.notices().iter().for_each(|notice| say(notice));
    let mut summary = format!("{frames} frames in {place}, the truth in {}", truth.display());
    if let Some(to) = calibration_to {
        summary += &format!(", the calibration in {}", to.name().display());
        to.write(simulation.calibration().as_bytes())?;
    }
    say(&summary);
    Ok(DONE)
}
