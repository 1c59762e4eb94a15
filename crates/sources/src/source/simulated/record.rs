//! Writes a simulation's frames as a recording, and its truth to a second file.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::{SimulatedSource, Truth};
use crate::error::{Error, Result};
use crate::output::{OutputFile, OutputPath};
use crate::signal::{Channel, Frame};
use crate::source::{Source as _, csv_file::put_value};

const COLUMNS: [&str; 29] = [
    "t",
    "frame",
    "touch",
    "name",
    "link",
    "field",
    "x",
    "y",
    "z",
    "nx",
    "ny",
    "nz",
    "u",
    "v",
    "angle",
    "vx",
    "vy",
    "vz",
    "vu",
    "vv",
    "speed",
    "force",
    "direction_x",
    "direction_y",
    "direction_z",
    "principal_axis_x",
    "principal_axis_y",
    "principal_axis_z",
    "depth",
];
/// Further columns if the body has taxels with three axes, that sense distances, or temperatures.
const OF_PULLS: [&str; 7] = ["shear_x", "shear_y", "shear_z", "shear_u", "shear_v", "torsion", "slips"];
const OF_GAPS: &str = "gap";
const OF_WARMTH: &str = "celsius";

/// Writes all frames of `simulation` as CSV to `frames` and their truth to `truth`: both files or neither. Returns the
/// number of frames.
///
/// The truth has a row for each frame and touch that presses; `docs/reference/simulation.md` lists its columns.
///
/// # Errors
/// A path leaves the surface, or a file cannot be written; the files are then not there.
pub fn write_recording(simulation: &mut SimulatedSource, frames: OutputPath, truth: OutputPath) -> Result<u64> {
    write_recording_with_progress(simulation, frames, truth, &mut |_| {})
}

/// The same, reporting after each frame the share that is done to `progress`.
///
/// # Errors
/// As [`write_recording`].
pub fn write_recording_with_progress(
    simulation: &mut SimulatedSource,
    frames: OutputPath,
    truth: OutputPath,
    progress: &mut dyn FnMut(f64),
) -> Result<u64> {
    let (mut frames, mut truth) = (frames.begin()?, truth.begin()?);
    simulation.seek(0);
    write(simulation, &mut frames, &mut truth, progress)?;

    frames.finish_with(vec![truth])?;
    Ok(simulation.frames())
}

fn write(
    simulation: &mut SimulatedSource,
    frames_file: &mut OutputFile,
    truth_file: &mut OutputFile,
    progress: &mut dyn FnMut(f64),
) -> Result<()> {
    let paths = [frames_file.name().to_owned(), truth_file.name().to_owned()];
    let [frames_path, truth_path] = paths.each_ref().map(PathBuf::as_path);
    let writer = |file| csv::Writer::from_writer(std::io::BufWriter::with_capacity(1 << 16, file));
    let (mut frames, mut truth) = (writer(frames_file), writer(truth_file));
    let failed = |path: &Path, e: csv::Error| Error::failed(e.to_string()).at(path.display());
    let mut row: Vec<String> = std::iter::once("t".to_owned()).collect();
    row.extend(simulation.taxels().iter().map(|&channel| Channel(channel).to_string()));
    frames.write_record(&row).map_err(|e| failed(frames_path, e))?;
    let further = Further::of(simulation);
    truth.write_record(COLUMNS.into_iter().chain(further.columns())).map_err(|e| failed(truth_path, e))?;
    let mut frame = Frame::missing(0.0, simulation.taxels().len());
    let mut number = 0_u64;
    while simulation.next_frame(&mut frame)? {
        row.clear();
        row.push(frame.t_s.to_string());
        row.extend(frame.values.iter().map(|&value| {
            let mut word = String::new();
            put_value(value, &mut word);
            word
        }));
        frames.write_record(&row).map_err(|e| failed(frames_path, e))?;
        for touch in simulation.truth() {
            let cells = truth_row(frame.t_s, number, touch).into_iter().chain(further.cells(touch));
            truth.write_record(cells).map_err(|e| failed(truth_path, e))?;
        }
        number += 1;
        progress(number as f64 / simulation.frames() as f64);
    }
    frames.flush().map_err(|e| Error::io(frames_path, &e))?;
    truth.flush().map_err(|e| Error::io(truth_path, &e))
}

/// Which further columns there are.
struct Further {
    pulls: bool,
    gaps: bool,
    warmth: bool,
}

impl Further {
    fn of(simulation: &SimulatedSource) -> Self {
        let senses = &simulation.senses;
        let pulls = !simulation.pulls_newton.is_empty();
        Self { pulls, gaps: !senses.near.is_empty(), warmth: !senses.warm.is_empty() }
    }

    fn columns(&self) -> impl Iterator<Item = &'static str> {
        let of_pulls = OF_PULLS.into_iter().filter(|_| self.pulls);
        of_pulls.chain(self.gaps.then_some(OF_GAPS)).chain(self.warmth.then_some(OF_WARMTH))
    }

    /// The cells under them.
    fn cells(&self, truth: &Truth) -> impl Iterator<Item = String> {
        let cell = |number: Option<f64>| number.map(|x| x.to_string()).unwrap_or_default();
        let shear = truth.shear_in_link.map_or([None; 3], |shear| shear.to_array().map(Some));
        let uv = truth.shear_uv.map_or([None; 2], |uv| uv.map(Some));
        let slips = truth.slips.map(|slips| f64::from(u8::from(slips)));
        let of_pulls = shear.into_iter().chain(uv).chain([truth.torsion, slips]).filter(|_| self.pulls);
        let others = [self.gaps.then_some(truth.gap_m), self.warmth.then_some(truth.celsius)];
        of_pulls.chain(others.into_iter().flatten()).map(cell).collect::<Vec<_>>().into_iter()
    }
}

/// The cells under [`COLUMNS`]; what is absent is blank.
fn truth_row(t_s: f64, frame: u64, truth: &Truth) -> [String; COLUMNS.len()] {
    let cell = |number: Option<f64>| number.map(|x| x.to_string()).unwrap_or_default();
    let cells_of = |vector: Option<DVec3>| vector.map_or([None; 3], |v| v.to_array().map(Some)).map(cell);
    let two = |pair: Option<[f64; 2]>| pair.map_or([None; 2], |p| p.map(Some)).map(cell);
    let [x, y, z] = cells_of(Some(truth.position_in_link));
    let [nx, ny, nz] = cells_of(Some(truth.normal_in_link));
    let [u, v] = two(truth.uv);
    let [vx, vy, vz] = cells_of(truth.velocity_in_link);
    let [vu, vv] = two(truth.velocity_uv);
    let field = truth.field.clone().unwrap_or_default();
    let (speed, force) = (cell(truth.speed), cell(Some(truth.force_newton)));
    let (t, frame, touch) = (t_s.to_string(), frame.to_string(), truth.touch.to_string());
    let (name, link, angle) = (truth.name.clone(), truth.link.clone(), cell(truth.angle));
    let [dx, dy, dz] = cells_of(truth.direction_in_link);
    let [ax, ay, az] = cells_of(truth.principal_axis_in_link);
    let depth = cell(truth.depth_m);
    [
        t, frame, touch, name, link, field, x, y, z, nx, ny, nz, u, v, angle, vx, vy, vz, vu, vv, speed, force, dx, dy,
        dz, ax, ay, az, depth,
    ]
}
