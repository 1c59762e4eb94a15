//! `somatic tune`: boards' potentiometers set so that rest and a firm press use their converters' range.

mod report;
mod session;

use std::io::IsTerminal as _;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use somatic::internal::scene_file::seconds;
use somatic::internal::setup::FilesRead;
use somatic::internal::setup::bodies::load_body;
use somatic::internal::signal::{Axis, Channel};
use somatic::internal::survey::tuning::{MAX_ROUNDS, Tuned, Tuning};
use somatic::signal::{FsrCircuit, Wiring};
use somatic::source::SourceSpec;
use somatic::{Error, Result};

use self::session::{PhaseEnd, PhaseLimit, TuningSession};
use super::calibrate::name_of;
use super::interrupt::stop_on_signal;
use super::ports::LineFlags;
use super::scene::in_flags;
use super::stdio::{DONE, FAILED, print, say};

const EXAMPLES: &str = "\
Examples:
  somatic tune --body hand --source serial:/dev/ttyUSB0 --wiring hand.toml -o tuned.toml
  somatic tune --source serial:/dev/ttyUSB0 --source serial:/dev/ttyUSB1 --rest 5s --press 60s --json
  somatic calibrate --body hand --source serial:/dev/ttyUSB0 --wiring tuned.toml -o calibration.toml
  somatic run --source serial:/dev/ttyUSB0 --wiring tuned.toml --calibration calibration.toml

First nothing touches the robot for the time --rest. Then press every sensor as firmly as it ever
will be. The command sets the wiper position with which the sensor uses most of the range and
leaves a sixteenth. Press the sensors again, until all fit, in at most five rounds.
Every command with the file of -o as its --wiring sets these wipers again, whenever a board
starts. Ctrl-C puts all wipers back.";

/// Set boards' potentiometers so that sensors use the converters' range.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The robot: a .glb or .gltf file, or one of the bundled bodies hand, sensing-hand, mat and humanoid.
    #[arg(long, value_name = "BODY", default_value = "hand")]
    body: String,

    /// The boards' lines: serial:PORT[@BAUD], which may be several.
    #[arg(long = "source", value_name = "SOURCE", required = true)]
    sources: Vec<String>,

    #[command(flatten)]
    lines: LineFlags,

    /// The wiring with its wipers, to write as TOML: what --wiring has with `wipers`.
    #[arg(short, long, value_name = "FILE.toml")]
    output: Option<PathBuf>,

    /// A calibration for the paper's circuit at these wiper positions, to write as TOML.
    #[arg(long, value_name = "FILE.toml")]
    fsr_calibration: Option<PathBuf>,

    /// The wiper to begin with, if the wiring has none.
    ///
    /// The host cannot ask a board for it.
    #[arg(long, value_name = "WIPER", default_value_t = FsrCircuit::MIDDLE_WIPER)]
    wiper: u8,

    /// How long nothing touches the robot.
    ///
    /// A bare number is in seconds.
    #[arg(long, value_name = "TIME", default_value = "3s", value_parser = seconds)]
    rest: f64,

    /// How long sensors are pressed in each round, such as 60s [default: until Enter].
    ///
    /// A bare number is in seconds.
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    press: Option<f64>,

    /// Replace the files that are there.
    #[arg(long)]
    force: bool,

    /// Print what was found as JSON instead of a table.
    #[arg(long)]
    json: bool,
}

pub(super) fn tune(arguments: &Arguments) -> Result<u8> {
    let read = FilesRead::default().bodies([&arguments.body]).files(&arguments.lines.wiring);
    let mut outputs = read.outputs(arguments.force);
    let mut add = |path: &Option<PathBuf>| path.as_ref().map(|path| outputs.add(path)).transpose();
    let (output, fsr_calibration) = (add(&arguments.output)?, add(&arguments.fsr_calibration)?);
    // What was found is printed there.
    outputs.add_standard_output()?;
    let spans = [Some(arguments.rest), arguments.press];
    let [rest, press] = spans.map(|s| s.map(|s| Duration::try_from_secs_f64(s).ok().filter(|span| !span.is_zero())));
    let (Some(Some(rest)), None | Some(Some(_))) = (rest, press) else {
        return Err(Error::usage("--rest and --press must be over 0; give times such as 5s"));
    };
    let sources = arguments.sources.iter().map(|text| text.parse()).collect::<Result<Vec<SourceSpec>>>()?;
    let ports = arguments.lines.keys().lines(&sources).map_err(in_flags)?;
    if ports.is_empty() {
        return Err(Error::usage("only boards on serial lines have potentiometers; give --source serial:PORT"));
    }
    if press.is_none() && !std::io::stdin().is_terminal() {
        return Err(Error::usage("standard input is not a terminal; give --press SECONDS"));
    }
    let body = load_body(&arguments.body)?;
    let ids = Channel::all_of(&body);
    let wiring = match arguments.lines.keys().wiring()? {
        Some(wiring) => wiring,
        None => Wiring::in_order(&ids, 1, ports.len()).map_err(|e| e.at("no --wiring is given"))?,
    };
    let own = |board: u16, channel: u16| wiring.board(board)?.wipers.get(usize::from(channel)).copied()?;
    let start = wiring.with_wipers(|board, channel| {
        // A press turns what is along the normal; other axes keep the wipers that the wiring has.
        let is_pressed = wiring.taxel(board, channel).is_some_and(|id| Channel(id).axis() == Axis::Normal);
        own(board, channel).or(is_pressed.then_some(arguments.wiper))
    });
    let stop = stop_on_signal()?;
    let source = arguments.lines.keys().open_as(Some(start.clone()), &ports, &ids, None)?;
    let mut session = TuningSession::new(source, &start, stop);

    let press = press.flatten().map_or(PhaseLimit::Enter, PhaseLimit::After);
    let mut tuning = None;
    let tuned = rounds(&mut session, rest, press, &mut tuning);
    let tuning = match (tuned, tuning) {
        (Ok(PhaseEnd::Completed), Some(tuning)) => tuning,
        (Ok(_), _) => return Err(Error::failed(format!("ended before all was tuned; {}", session.restore_wipers()))),
        (Err(error), _) => {
            say(&session.restore_wipers());
            return Err(error);
        }
    };
    let now = session.places(&start);
    session.close();

    let wiper_of = |board: u16, channel: u16| {
        let sensor = now.iter().zip(tuning.sensors()).find(|(place, _)| (place.id, place.channel) == (board, channel));
        // A wiper that was not confirmed is unknown.
        sensor.filter(|(place, _)| place.is_set).map(|(_, sensor)| sensor.wiper).or_else(|| own(board, channel))
    };
    if let Some(output) = output {
        output.write(report::wiring(&wiring.with_wipers(wiper_of)).as_bytes())?;
    }
    print(&if arguments.json { report::json(&tuning, &now) } else { report::table(&tuning, &now) })?;
    if let Some(output) = fsr_calibration {
        output.write(report::fsr(&tuning, &name_of(&body))?.as_bytes())?;
    }
    [&arguments.output, &arguments.fsr_calibration]
        .into_iter()
        .flatten()
        .for_each(|path| say(&format!("wrote {}", path.display())));
    if arguments.output.is_none() {
        say("a board that starts again forgets its wipers; with -o FILE they can be set again");
    }
    Ok(if tuning.outcomes().any(|(_, tuned, _)| tuned == Tuned::NotSet) { FAILED } else { DONE })
}

/// Runs rounds of measuring and setting wipers until every sensor fits.
fn rounds(
    session: &mut TuningSession,
    rest: Duration,
    press: PhaseLimit,
    done: &mut Option<Tuning>,
) -> Result<PhaseEnd> {
    session.guide.say("setting the wipers to begin with");
    if session.settle()? == PhaseEnd::Stopped {
        return Ok(PhaseEnd::Stopped);
    }
    let mut tuning = session.tuning()?;
    session.guide.say(&format!("leave the robot alone for {} s", rest.as_secs_f64()));
    if session.observe(PhaseLimit::After(rest), &mut tuning, |tuning, frame| tuning.rest(&frame.values))?
        == PhaseEnd::Stopped
    {
        return Ok(PhaseEnd::Stopped);
    }
    loop {
        let again = if tuning.rounds() == 0 { "" } else { " once more" };
        let end = if press == PhaseLimit::Enter { "; Enter when all are done" } else { "" };
        session.guide.say(&format!("now press every sensor firmly{again}{end}"));
        if session.observe(press, &mut tuning, |tuning, frame| tuning.press(&frame.values))? == PhaseEnd::Stopped {
            return Ok(PhaseEnd::Stopped);
        }
        let wipers = tuning.next_round()?;
        if wipers.is_empty() {
            break;
        }
        session.guide.say(&format!(
            "round {} of at most {MAX_ROUNDS}: setting {} wipers",
            tuning.rounds(),
            wipers.len()
        ));
        session.set(&wipers);
        if session.settle()? == PhaseEnd::Stopped {
            return Ok(PhaseEnd::Stopped);
        }
        session.mark_failed_wipers(&mut tuning);
    }
    *done = Some(tuning);
    Ok(PhaseEnd::Completed)
}
