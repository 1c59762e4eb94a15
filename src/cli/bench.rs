//! `somatic bench`: how fast a backend is on a made-up skin of any size.

mod dump;
mod npy;

use std::hint::black_box;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use clap::Args;
use serde_json::json;
use somatic::internal::limits::{self, MAX_SYSTEM_BYTES};
use somatic::internal::output::OutputFolder;
use somatic::internal::setup::FilesRead;
use somatic::internal::shape::Shape;
use somatic::{BackendKind, Body, ChosenBackend, Engine, Error, Frame, Outputs, Receptor, Result};

use super::bar::Bar;
use super::interrupt::stop_soon_on_signal;
use super::scene::{letter, one_of, output, outputs_or_usual};
use super::stdio::{DONE, print, say};
use super::words::count;

const EXAMPLES: &str = "\
Examples:
  somatic bench                                               a whole robot, one frame a call
  somatic bench --sensors 7560 --fields 600 --members 24 --frames 9984 --backend cpu
  somatic bench --outputs centroid,orientation --json         these alone, as JSON
  somatic bench --letters sustained,shear                     what three axes cost beside one
  somatic bench --sensors 100000 --wide 100000 --dump arrays  a field over all; check it by a program

A rate counts each sensor of each field in each frame: memberships per second.";

/// Nothing is measured before this long, and one call at least: memory is at hand then, and the clock has settled.
const WARM_UP: Duration = Duration::from_millis(100);
/// Unless their number is asked for, calls end after this time or this number, but not before the least number.
const LONG_ENOUGH: Duration = Duration::from_secs(2);
const ENOUGH: usize = 20_000;
const FEWEST: usize = 3;

/// Measure how long a call takes, from frames in memory to percepts in memory.
///
/// Sensors lie at random on a flat sheet, and every one is pressed in every frame. Every field has random sensors of its
/// own, or neighbours with --local. The same arguments make the same skin and the same values. Rates count memberships: a
/// sensor in a field in a frame.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Sensors of the skin.
    #[arg(long, value_name = "N", default_value_t = 1000)]
    sensors: usize,

    /// Number of fields.
    #[arg(long, value_name = "F", default_value_t = 100)]
    fields: usize,

    /// Sensors of each field.
    #[arg(long, value_name = "M", default_value_t = 16)]
    members: usize,

    /// One more field, over K sensors.
    #[arg(long, value_name = "K", default_value_t = 0, hide_default_value = true)]
    wide: usize,

    /// Put sensors in rows, and give each field neighbours instead of random ones.
    #[arg(long)]
    local: bool,

    /// Frames a call: 1 as on a live robot, more as in a recording.
    #[arg(long, value_name = "T", default_value_t = 1)]
    frames: usize,

    /// What computes.
    #[arg(long, default_value = "auto", value_parser = one_of::<BackendKind>(BackendKind::WORDS))]
    backend: BackendKind,

    /// Only these quantities of fields, as `somatic outputs` lists them [default: as for `somatic run`].
    #[arg(long, value_name = "OUTPUT,...", value_delimiter = ',', value_parser = output)]
    outputs: Vec<Outputs>,

    /// Compute every field from each of these letters, and the same skin from pressures alone in turns with it.
    ///
    /// For shear the sensors have three axes. For temperature and proximity every sensor has a taxel more, in its fields.
    #[arg(long, value_name = "LETTER,...", value_delimiter = ',', value_parser = letter(),
        conflicts_with = "dump")]
    letters: Vec<Receptor>,

    /// Number of calls to measure [default: as many as fit into 2 s, at most 20000].
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..))]
    calls: Option<u32>,

    /// Random seed of places, members and values.
    #[arg(long, value_name = "S", default_value_t = 1)]
    seed: u64,

    /// Write what goes in and comes out into this folder, as .npy arrays that dump.json names.
    #[arg(long, value_name = "DIR")]
    dump: Option<PathBuf>,

    /// Replace the files of --dump if they are there.
    #[arg(long)]
    force: bool,

    /// Print JSON: times of a call in µs, rate in memberships/s.
    #[arg(long)]
    json: bool,
}

pub(super) fn bench(arguments: &Arguments) -> Result<u8> {
    let shape = arguments.shape();
    let outputs = outputs_or_usual(&arguments.outputs);
    shape.check()?;
    shape.check_letters(&arguments.letters)?;
    check_memory(&shape, outputs, arguments.letters.len())?;
    let files = match &arguments.dump {
        None => None,
        Some(folder) => {
            dump::check(outputs)?;
            let mut outputs_of = FilesRead::default().outputs(arguments.force);
            Some(outputs_of.add_folder(folder, dump::files(&shape, outputs))?)
        }
    };
    let stop = stop_soon_on_signal()?;
    let mut skins = vec![Skin::new(&shape, &arguments.letters, arguments.backend, outputs)?];
    if let Some(folder) = files {
        write_first_call(folder, &shape, &mut skins[0])?;
    }
    if !arguments.letters.is_empty() {
        skins.push(Skin::new(&shape, &[], arguments.backend, of_pressures(outputs))?);
    }
    let times = measure(&mut skins, &shape, arguments.calls, &stop)?;
    let ChosenBackend { name, device, .. } = skins[0].engine.backend();
    let report = Report { shape, letters: &arguments.letters, backend: name, device, times: &times };
    print(&if arguments.json { report.json() } else { report.text() })?;
    Ok(DONE)
}

/// Those of `outputs` that pressures give, for the skin that has nothing else; the usual ones where there are none.
fn of_pressures(outputs: Outputs) -> Outputs {
    let asked = outputs - Outputs::OF_OTHER_LETTERS;
    if asked.is_empty() { Outputs::USUAL } else { asked }
}

/// A skin that is measured.
struct Skin {
    body: Body,
    frames: Vec<Frame>,
    engine: Engine,
}

impl Skin {
    fn new(shape: &Shape, letters: &[Receptor], backend: BackendKind, outputs: Outputs) -> Result<Self> {
        let body = shape.body_for(letters);
        let engine = shape.engine_for(&body, letters, backend, outputs)?;
        Ok(Self { frames: shape.frames_for(&body), body, engine })
    }

    /// How long the next call takes, s.
    fn call(&mut self, shape: &Shape) -> Result<f64> {
        shape.advance(&mut self.frames);
        let start = Instant::now();
        black_box(self.engine.process(black_box(&self.frames))?);
        Ok(start.elapsed().as_secs_f64())
    }
}

/// What is printed.
struct Report<'a> {
    shape: Shape,
    letters: &'a [Receptor],
    backend: &'a str,
    device: String,
    /// Of the skin with its letters, and of that with pressures alone if letters are given.
    times: &'a [Times],
}

impl Report<'_> {
    /// Memberships per second.
    fn rate(&self) -> f64 {
        (self.shape.memberships() * self.letters.len().max(1) as u128) as f64 / self.times[0].median_s
    }

    /// How many times as long a call takes as one with pressures alone, and that one's time, s.
    fn over_pressures_alone(&self) -> Option<(f64, f64)> {
        let [with_letters, alone] = self.times else { return None };
        Some((with_letters.median_s / alone.median_s, alone.median_s))
    }

    fn json(&self) -> String {
        let us = |seconds: f64| (seconds * 1e9).round() / 1e3;
        let mut line = json!({
            "backend": self.backend, "adapter": self.device, "us_median": us(self.times[0].median_s),
            "us_p99": us(self.times[0].p99_s), "rate": self.rate().round(),
        });
        if let Some((_, alone_s)) = self.over_pressures_alone() {
            line["letters"] = self.letters.iter().map(ToString::to_string).collect();
            line["us_median_pressure"] = us(alone_s).into();
        }
        format!("{line}\n")
    }

    fn text(&self) -> String {
        let [calls, median, p99] = {
            let of = &self.times[0];
            [count(of.calls as u64, "call"), time(of.median_s), time(of.p99_s)]
        };
        let (skin, rate) = (words(&self.shape, self.letters), self.rate());
        let (backend, device, each_ns) = (self.backend, &self.device, 1e9 / rate);
        let beside = self
            .over_pressures_alone()
            .map(|(ratio, alone_s)| format!("{ratio:.2} times as long as pressures alone, median {}\n", time(alone_s)));
        format!(
            "{skin}\n{backend}: {device}\nmedian {median}, 99 % within {p99}, of {calls}\n{}{} memberships/s, {each_ns:.3} ns each\n",
            beside.unwrap_or_default(),
            short(rate),
        )
    }
}

impl Arguments {
    fn shape(&self) -> Shape {
        let Self { sensors, fields, members, wide, local, frames, seed, .. } = *self;
        Shape { sensors, fields, members, wide, local, frames, seed }
    }
}

/// Refuses what memory has no room for, before it is asked for.
fn check_memory(shape: &Shape, outputs: Outputs, letters: usize) -> Result<()> {
    // Each letter takes about what the skin does, and the same with pressures alone stands beside them.
    let needed = shape.bytes(outputs) * if letters > 0 { letters as u128 + 1 } else { 1 };
    let gib = |bytes: u128| bytes as f64 / (1_u64 << 30) as f64;
    match available_bytes() {
        Some(free) if needed > free => Err(Error::usage(format!(
            "this takes about {:.1} GiB of memory, and {:.1} GiB are free; ask for fewer --frames or --sensors",
            gib(needed),
            gib(free)
        ))),
        // Where the system does not say, what no machine could address is still refused.
        None if needed > isize::MAX as u128 => {
            Err(Error::usage(format!("this takes about {:.1} GiB of memory; ask for less", gib(needed))))
        }
        _ => Ok(()),
    }
}

/// Memory that is free or can be freed, where the system says so in Linux's way.
fn available_bytes() -> Option<u128> {
    let text = limits::read_to_string("/proc/meminfo", MAX_SYSTEM_BYTES).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kib: u128 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}

/// The first call of all: its percepts have no frame before, as those of whoever computes the same.
fn write_first_call(folder: OutputFolder, shape: &Shape, skin: &mut Skin) -> Result<()> {
    let backend = skin.engine.backend().name;
    let percepts = skin.engine.process(&skin.frames)?;
    dump::write(folder, shape, &skin.body, &skin.frames, percepts, backend)
}

/// How long calls took, s.
struct Times {
    calls: usize,
    median_s: f64,
    p99_s: f64,
}

impl Times {
    /// By rank: the least time that this share of the calls kept within.
    fn from_seconds(mut seconds: Vec<f64>) -> Self {
        seconds.sort_by(f64::total_cmp);
        let within = |share: f64| seconds[((share * seconds.len() as f64).ceil() as usize).max(1) - 1];
        Self { calls: seconds.len(), median_s: within(0.5), p99_s: within(0.99) }
    }
}

/// How long calls take on each of `skins`, in turns.
fn measure(skins: &mut [Skin], shape: &Shape, calls: Option<u32>, stop: &AtomicBool) -> Result<Vec<Times>> {
    let mut bar = Bar::new("measuring");
    let start = Instant::now();
    loop {
        skins.iter_mut().try_for_each(|skin| skin.call(shape).map(drop))?;
        if start.elapsed() >= WARM_UP || stop.load(Ordering::Relaxed) {
            break;
        }
    }
    let most = calls.map_or(ENOUGH, |calls| calls as usize);
    let start = Instant::now();
    let mut seconds = vec![Vec::with_capacity(most.min(ENOUGH)); skins.len()];
    loop {
        let (done, so_far) = (seconds[0].len(), start.elapsed());
        let is_enough = done >= most || (calls.is_none() && done >= FEWEST && so_far >= LONG_ENOUGH);
        if is_enough || stop.load(Ordering::Relaxed) {
            break;
        }
        let by_count = done as f64 / most as f64;
        let by_time = so_far.as_secs_f64() / LONG_ENOUGH.as_secs_f64();
        bar.show(if calls.is_some() { by_count } else { by_count.max(by_time) });
        for (skin, seconds) in skins.iter_mut().zip(&mut seconds) {
            seconds.push(skin.call(shape)?);
        }
    }
    drop(bar);
    if seconds[0].is_empty() {
        return Err(Error::failed("stopped before a call was measured"));
    }
    if stop.load(Ordering::Relaxed) {
        say(&format!("stopped after {}", count(seconds[0].len() as u64, "call")));
    }
    Ok(seconds.into_iter().map(Times::from_seconds).collect())
}

fn words(shape: &Shape, letters: &[Receptor]) -> String {
    let wide = match shape.wide {
        0 => String::new(),
        wide => format!(" and one of {wide}"),
    };
    let (fields, members) = (count(shape.fields as u64, "field"), count(shape.members as u64, "sensor"));
    let frames = count(shape.frames as u64, "frame");
    let letters: String = letters.iter().map(|letter| format!("{letter}, ")).collect();
    format!("{fields} of {members}{wide}, out of {}; {letters}{frames} a call", shape.sensors)
}

fn time(seconds: f64) -> String {
    match seconds {
        s if s < 1e-3 => format!("{:.2} µs", s * 1e6),
        s if s < 1.0 => format!("{:.2} ms", s * 1e3),
        s => format!("{s:.2} s"),
    }
}

/// A rate with three digits and a letter.
fn short(rate: f64) -> String {
    match rate {
        r if r < 1e6 => format!("{:.3} k", r / 1e3),
        r if r < 1e9 => format!("{:.1} M", r / 1e6),
        r => format!("{:.2} G", r / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_median_and_a_percentile_are_times_that_were_measured() {
        let times = Times::from_seconds((1..=200).rev().map(f64::from).collect());
        assert_eq!((times.calls, times.median_s, times.p99_s), (200, 100.0, 198.0));
        let one = Times::from_seconds(vec![7.0]);
        assert_eq!((one.median_s, one.p99_s), (7.0, 7.0));
    }

    #[test]
    fn figures_read_well() {
        assert_eq!([2.5e-6, 0.0125, 3.0].map(time), ["2.50 µs", "12.50 ms", "3.00 s"]);
        assert_eq!([12_345.0, 4.2e7, 2.345e9].map(short), ["12.345 k", "42.0 M", "2.35 G"]);
        let shape = Shape { sensors: 40, fields: 9, members: 1, wide: 40, local: false, frames: 1, seed: 1 };
        assert_eq!(words(&shape, &[]), "9 fields of 1 sensor and one of 40, out of 40; 1 frame a call");
        let told = words(&shape, &[Receptor::Sustained, Receptor::Shear]);
        assert_eq!(told, "9 fields of 1 sensor and one of 40, out of 40; sustained, shear, 1 frame a call");
    }
}
