//! `somatic calibrate`: from a rest and a press to a calibration file.

mod gains;
mod opened;
mod scale;

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::Duration;

use clap::Args;
use somatic::internal::scene_file::{hertz, length, seconds};
use somatic::internal::setup::FilesRead;
use somatic::internal::setup::bodies::in_body;
use somatic::internal::survey::known::{KnownForces, PressedOn};
use somatic::internal::survey::{Findings, Found, Survey, Wishes};
use somatic::scene::file::SceneFile;
use somatic::signal::RawValue;
use somatic::source::{Lines, Source};
use somatic::{Body, Calibration, Error, Result};

use self::opened::Opened;
use super::interrupt::stop_on_signal;
use super::plot_file::PlotFile;
use super::ports::LineFlags;
use super::scene::one_of;
use super::stdio::{print, say, tell_losses};
use super::table::{more, plain, shown};
use super::text_flags::TextFlags;
use super::words::{bullet, count};
use somatic::internal::run::{Arrival, Feed, ReadMode, left_out};

const EXAMPLES: &str = "\
Examples:
  somatic calibrate --body robot.glb --source session.csv --rest 5s -o robot.toml --plot robot.svg
  robot-driver | somatic calibrate --body robot.glb --source - --bits 10 -o robot.toml
  somatic calibrate --body robot.glb --source serial:/dev/ttyUSB0 --wiring hand.toml -o robot.toml
  somatic run --body robot.glb --source session.csv --calibration robot.toml
  somatic calibrate --body robot.glb --gains-from touches.csv --calibration robot.toml -o skin.toml
  somatic calibrate --map dex3 --source ros2-mcap:hand --missing 30000 -o dex3.toml
  somatic calibrate --body mat.glb --source presses.csv --known 500g --on field --calibration robot.toml -o newton.toml

First nothing touches the robot for the time --rest. Then press every sensor firmly, one after the
other or many at once, until the recording ends, the time --press is over, or Ctrl-C.
--gains-from needs no rest and no order: a finger that wanders over the skin for two minutes.

The file is TOML; its keys may be edited:

  [all]                         # what most sensors share; [taxel.ID] has what differs
  baseline = 244                # raw value at rest
  gain = 1                      # pressure per raw unit
  unit = \"kPa\"                  # of the pressure; without it P is a count
  invert = true                 # the raw value falls when the sensor is pressed
  dead_band = 4                 # pressures up to this are 0
  noise = 0.8                   # standard deviation of a raw value
  mask = false                  # true leaves the sensor out";

/// Find baselines, noise, range and gains of sensors, and write a calibration.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The robot: a .glb or .gltf file, or the bundled hand, sensing-hand, mat or humanoid [default: the source's own, if it has one].
    #[arg(long, value_name = "BODY")]
    body: Option<String>,

    /// Where frames come from: as for `somatic run`; serial lines may be several.
    #[arg(long = "source", value_name = "SOURCE", required_unless_present = "gains_from")]
    sources: Vec<String>,

    /// Find each sensor's gain, and the layer's width of a contact, from ordinary touches that move about.
    ///
    /// They are written into the calibration that --calibration names.
    #[arg(long, value_name = "RECORDING", requires = "calibration",
        conflicts_with_all = ["sources", "plot", "press", "bits", "missing", "equalise", "mask_moved"])]
    gains_from: Option<String>,

    /// For --gains-from and --known: the calibration that gains, or one scale for all of its gains, are added to.
    ///
    /// With --known there is no rest: presses begin with the first frame.
    #[arg(long, value_name = "FILE.toml")]
    calibration: Option<PathBuf>,

    /// For --gains-from: all touches are by the flat end of a stamp of this radius, such as 6mm.
    ///
    /// The layer's own σ can then be distinguished from the contact's size.
    #[arg(long, value_name = "RADIUS", requires = "gains_from", value_parser = length)]
    stamp: Option<f64>,

    #[command(flatten)]
    lines: LineFlags,

    #[command(flatten)]
    text: TextFlags,

    /// Which arrays of messages are sensors: a TOML file, or contactile, dex3, inspire, mujoco, paxini, tactile-state,
    /// xela or xela-ros2.
    ///
    /// For ROS 2 bags and topics with messages of any type, NDJSON, lines of JSON, Modbus and PaXini. All of them but tactile-state and
    /// mujoco are untested.
    #[arg(long, value_name = "FILE")]
    map: Option<String>,

    /// The calibration to write, TOML.
    #[arg(short, long, value_name = "FILE.toml")]
    output: PathBuf,

    /// Draw every sensor's rest and range too, as .svg or .png.
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,

    /// How long nothing touches the robot, from the first frame on.
    ///
    /// A bare number is in seconds.
    #[arg(long, value_name = "TIME", default_value = "3s", value_parser = seconds)]
    rest: f64,

    /// How long sensors are pressed after that, such as 60s [default: to the end of a recording; else until Ctrl-C].
    ///
    /// A bare number is in seconds.
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    press: Option<f64>,

    /// Bits of the sensors' converter, which give the end of their range [default: where many of them stop].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=24))]
    bits: Option<u8>,

    /// Raw values that are not readings, such as 0,65535.
    ///
    /// They are left out, and written down as the key `missing`.
    #[arg(long, value_name = "RAW,...", value_delimiter = ',', allow_negative_numbers = true)]
    missing: Vec<f64>,

    /// Give each sensor the gain that makes all presses equal, for sensors that were all pressed alike.
    #[arg(long)]
    equalise: bool,

    /// The force of every press, such as 4.9N, or as a weight 500g; or of presses that follow each other, such as 1N,2N,5N.
    ///
    /// P is in newtons then. Several make a curve for each sensor: press it once with each, in their order.
    #[arg(long, value_name = "FORCE,...", requires = "on", value_parser = str::parse::<KnownForces>,
        conflicts_with = "gains_from")]
    known: Option<KnownForces>,

    /// What --known pressed on: each sensor by itself (taxel), or all of them together (field), which gives one scale for all.
    #[arg(long, value_name = "WHAT", requires = "known", value_parser = one_of::<PressedOn>(&["taxel", "field"]))]
    on: Option<PressedOn>,

    /// Mask the sensors that moved during the rest, instead of writing nothing: for broken ones.
    #[arg(long)]
    mask_moved: bool,

    /// Frames per second of a CSV recording that has no column t, such as 50Hz.
    ///
    /// A bare number is in Hz.
    #[arg(long, value_name = "RATE", value_parser = hertz)]
    rate: Option<f64>,

    /// Replace the calibration and the plot if they are there.
    #[arg(long)]
    force: bool,

    /// Print what was found as JSON instead of a table.
    #[arg(long)]
    json: bool,
}

pub(super) fn calibrate(arguments: &Arguments) -> Result<u8> {
    let output = &arguments.output;
    let sources: Vec<String> = arguments.sources.iter().chain(&arguments.gains_from).cloned().collect();
    let read = FilesRead::default().bodies(&arguments.body).named(&sources).files(&arguments.lines.wiring);
    let read = read.files(&arguments.calibration).files(&arguments.map);
    let mut outputs = read.outputs(arguments.force);
    let to = outputs.add(output)?;
    check(arguments)?;
    // What was found is printed there.
    outputs.add_standard_output()?;
    let plot = arguments.plot.as_deref().map(|path| PlotFile::at(path, "--plot", &mut outputs)).transpose()?;
    let name = sources.first().map_or("", String::as_str);
    let Opened { body, source, lines, is_live, unit } = Opened::new(scene_of(arguments, &sources)?)?;
    let channels = in_body(&body, &*source)?;
    if arguments.gains_from.is_some() {
        let touches = gains::Touches { name, source, calibration: arguments.calibration.as_deref() };
        return gains::calibrate(touches, &body, &channels, arguments.stamp, to, arguments.json);
    }
    if let (Some(path), Some(forces)) = (&arguments.calibration, &arguments.known) {
        let presses = scale::Presses { name, source, lines: lines.as_ref(), is_live, for_s: arguments.press };
        let done = scale::calibrate(presses, &channels, (&body, path.as_path()), forces, to, arguments.json);
        lines.iter().for_each(Lines::close);
        return done;
    }
    let mut survey = Survey::new(&channels).on(&body)?;
    let gathered = gather(&mut survey, source, arguments, lines.as_ref(), is_live);
    if let Some(lines) = &lines {
        lines.close();
        tell(lines);
    }
    let Gathered { losses: lost, frames, last_s, is_whole } = gathered?;
    // Of what is live, Ctrl-C ends the presses; of a recording it leaves out the rest.
    if !is_live && !is_whole {
        let absent: Vec<String> = [Some(output), arguments.plot.as_ref()]
            .into_iter()
            .flatten()
            .map(|path| path.display().to_string())
            .collect();
        return Ok(tell_losses(&[lost, vec![left_out(name, frames, last_s, None, &absent)]].concat()));
    }
    let mut findings = survey.finish(Wishes {
        bits: arguments.bits,
        equalise: arguments.equalise,
        mask_moved: arguments.mask_moved,
    })?;

    findings.missing.clone_from(&arguments.missing);
    findings.unit = unit;
    if let (Some(forces), Some(on)) = (&arguments.known, arguments.on) {
        findings.know(forces, on)?;
    }
    let text = findings.calibration(&name_of(&body));
    // What is written must be what `run` takes; if it were not, nothing is written.
    let taxels: Vec<_> = body.taxels.iter().map(|taxel| (taxel.id, taxel.modality)).collect();
    Calibration::parse_for(&text, &taxels).map_err(|e| e.at("the calibration that follows from this survey"))?;
    to.write(text.as_bytes())?;
    if let Some(plot) = plot {
        plot.draw(|| findings.svg(), || findings.png())?;
    }
    print(&if arguments.json { format!("{:#}\n", findings.json()) } else { table_of(&findings) })?;
    let code = tell_losses(&lost);
    say(&format!("wrote {}", output.display()));
    Ok(code)
}

/// What a scene would say of the `sources` that `arguments` name.
fn scene_of(arguments: &Arguments, sources: &[String]) -> Result<SceneFile> {
    let mut scene = SceneFile::default();
    scene.sources = sources.iter().map(|text| text.parse()).collect::<Result<_>>()?;
    scene.body.clone_from(&arguments.body);
    scene.map.clone_from(&arguments.map);
    scene.text = arguments.text.keys();
    scene.rate_hz = arguments.rate;
    let lines = arguments.lines.keys();
    (scene.wiring, scene.live_rate_hz, scene.board_rate_hz) = (lines.wiring, lines.live_rate_hz, lines.board_rate_hz);
    Ok(scene)
}

/// Refuses flags that do not go together.
fn check(arguments: &Arguments) -> Result<()> {
    if !(arguments.rest > 0.0 && arguments.press.is_none_or(|press| press > 0.0)) {
        return Err(Error::usage("--rest and --press must be over 0; give times such as 5s"));
    }
    if arguments.equalise && arguments.on == Some(PressedOn::Taxel) {
        return Err(Error::usage("--known gives each sensor its gain with --on taxel; leave out --equalise"));
    }
    if arguments.calibration.is_none() || arguments.gains_from.is_some() {
        return Ok(());
    }
    if arguments.known.is_none() {
        return Err(Error::usage("--calibration is for --gains-from and --known; leave it out"));
    }
    let found_at_rest = [
        ("--plot", arguments.plot.is_some()),
        ("--bits", arguments.bits.is_some()),
        ("--missing", !arguments.missing.is_empty()),
        ("--equalise", arguments.equalise),
        ("--mask-moved", arguments.mask_moved),
    ];
    match found_at_rest.into_iter().find(|(_, is_given)| *is_given) {
        Some((flag, _)) => {
            Err(Error::usage(format!("{flag} is for what is found at rest; leave it out with --calibration")))
        }
        None => Ok(()),
    }
}

/// Makes those of `values` missing that are one of `codes`, as a calibration with these does.
fn without(codes: &[f64], values: &mut [RawValue]) {
    for value in values.iter_mut().filter(|value| codes.iter().any(|&code| **value == RawValue::new(code))) {
        *value = RawValue::MISSING;
    }
}

/// Says what is to be said of serial lines.
fn tell(lines: &Lines) {
    lines.notices().iter().for_each(|notice| say(&notice.to_string()));
}

/// What a calibration calls `body`: its file's name without folder and ending.
pub(super) fn name_of(body: &Body) -> String {
    Path::new(&body.name).file_stem().map_or_else(|| body.name.clone(), |stem| stem.to_string_lossy().into_owned())
}

/// What was taken of a source.
struct Gathered {
    losses: Vec<String>,
    frames: u64,
    /// The time of the last frame.
    last_s: f64,
    /// Whether all was taken that was asked for.
    is_whole: bool,
}

/// Takes rest and press from `source`.
fn gather(
    survey: &mut Survey,
    source: Box<dyn Source + Send>,
    arguments: &Arguments,
    lines: Option<&Lines>,
    is_live: bool,
) -> Result<Gathered> {
    let stop = stop_on_signal()?;
    let mut feed = match lines {
        Some(_) => Feed::start_live(source, 64),
        None => Feed::start(source, ReadMode { most: 64, gather: !is_live, speed: None }),
    };
    let guide = |what: &str| {
        if is_live {
            say(what);
        }
    };
    guide(&format!("leave the robot alone for {} s", arguments.rest));
    let mut begin = None;
    let mut taken = Gathered { losses: Vec::new(), frames: 0, last_s: 0.0, is_whole: false };
    let mut is_pressing = false;
    while !stop.load(Ordering::Relaxed) {
        lines.into_iter().for_each(tell);
        match feed.next(Duration::from_millis(40)) {
            Some(Arrival::Frames(mut frames, info)) => {
                info.notices.iter().for_each(|notice| say(notice));
                taken.losses = info.losses;
                for frame in &mut frames {
                    (taken.frames, taken.last_s) = (taken.frames + 1, frame.t_s);
                    without(&arguments.missing, &mut frame.values);
                    let since_s = frame.t_s - *begin.get_or_insert(frame.t_s);
                    if since_s < arguments.rest {
                        survey.rest(&frame.values);
                        continue;
                    }
                    if !is_pressing {
                        is_pressing = true;
                        guide(match arguments.press {
                            Some(_) => "now press every sensor firmly",
                            None => "now press every sensor firmly; Ctrl-C when all are done",
                        });
                    }
                    if arguments.press.is_some_and(|press| since_s >= arguments.rest + press) {
                        return Ok(Gathered { is_whole: true, ..taken });
                    }
                    survey.press(&frame.values);
                }
                feed.give_back(frames);
            }
            Some(Arrival::End(ending)) => return Ok(Gathered { losses: ending.losses, is_whole: true, ..taken }),
            Some(Arrival::Failed(error)) => return Err(error),
            None | Some(Arrival::Woken) => {}
        }
    }
    Ok(taken)
}

fn table_of(findings: &Findings) -> String {
    /// More sensors than this are summed up.
    const LISTED: usize = 48;
    let mut text = format!(
        "{}; raw values {} when pressed\n",
        count(findings.sensors.len() as u64, "sensor"),
        if findings.invert { "fall" } else { "rise" }
    );
    let mut head = vec!["taxel", "at rest", "strays by", "noise", "dead band", "travel", "full at", "gain"];
    let has_axes = !findings.tangential.is_empty();
    if has_axes {
        head.extend(["u at rest", "v at rest", "noise of u, v"]);
    }
    let mut table = plain(head.iter().copied(), 0..head.len());
    // Four digits, and no zeros after the point: most sensors count in whole numbers.
    let number =
        |value: f64| format!("{value:.3e}").parse().map_or_else(|_| value.to_string(), |short: f64| short.to_string());
    let or_dash = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), number);
    let row = |found: &Found| {
        let Found { id, baseline, noise: strays, sigma, dead_band, travel, full, gain, .. } = *found;
        let mut cells = vec![id.to_string(), or_dash(baseline), number(strays), or_dash(sigma), number(dead_band)];
        cells.extend([or_dash(travel), or_dash(full), number(gain)]);
        if has_axes {
            let [u, v] = findings.tangential_baselines(id);
            cells.extend([or_dash(u), or_dash(v), or_dash(findings.shear_noise(id))]);
        }
        cells
    };
    for found in findings.sensors.iter().take(LISTED) {
        table.add_row(row(found));
    }
    text += &shown(&table);
    text += &more(findings.sensors.len(), LISTED);
    findings.remarks().iter().for_each(|remark| text += &format!("{}\n", bullet(remark)));
    text
}
