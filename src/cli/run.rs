//! `somatic run`: from a source through an engine to sinks.

mod console;
mod order;
mod prepared;

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use clap::Args;
use somatic::internal::run::Several;
use somatic::internal::setup::FilesRead;
use somatic::internal::setup::Setup;
use somatic::internal::sink::TableName;
use somatic::output::{OutputPath, OutputPaths};
use somatic::run::Run;
use somatic::sink::{SinkSpec, SinkTarget};
use somatic::{Error, Result};

use self::console::Console;
use self::order::OrderOf;
use self::prepared::Prepared;
use super::describe::describe;
use super::interrupt::stop_on_signal;
#[cfg(unix)]
use super::keys::Keys;
use super::live::View;
use super::scene::{LIVE, RunFlags, grouped, in_flags, input, one_of};
use super::stdio::{DONE, FAILED, print, say, say_lines, tell_losses};

const FIRST_EXAMPLES: &str = "\
Examples:
  somatic run                                             the bundled touch
  somatic run --source touch.csv --sink percepts.ndjson   a recording to a file
  robot-driver | somatic run --body robot.glb --source - | controller

All flags and more examples: somatic run --help";

const EXAMPLES: &str = "\
Examples:
  somatic run                                            the bundled touch on the bundled hand
  somatic run --source touch.csv --sink percepts.ndjson  a recording, as fast as possible
  somatic run --source touch.csv --sink percepts.csv     the same as a table; --wide for a row per frame
  somatic run --source touch.csv --sink csv:- | head     the table on standard output
  somatic run --source touch.csv --speed 0.25            a recording, watched in slow motion
  somatic run --source touch.csv --fields 'hand/palm*' --outputs total,centroid
  somatic run --source touch.csv --letters sustained,change --outputs total
  somatic run --outputs filtered_direction --filter-window 0.5mm.. --filter-time 200ms
  somatic run robot.scene.toml                           all of it from a file
  robot-driver | somatic run --body robot.glb --source - | controller
  robot-driver | somatic run --body robot.glb --source - --sink mcap:touch.mcap
  somatic run --body robot.glb --source touch.csv.gz
  somatic run --source a.csv --source b.csv --sink both.csv   one table with a column `recording`
  somatic run --source mcap:touch.mcap --from 60s --to 90s   its second minute's first half
  somatic run --source serial:/dev/ttyUSB0 --source serial:/dev/ttyUSB1 --wiring hand.toml
  somatic run --body mat --source night.csv --backend gpu --verify

A frame on standard input is a line such as
  {\"t\":0.5,\"values\":{\"4\":12.0},\"pose\":{\"hand\":[0.1,0,0.3,0,0,0,1]}}
t in seconds, raw values by taxel id, and, if links move, where each is in the world: x,y,z in
metres (x forward, y left, z up) and a quaternion qx,qy,qz,qw. With --source csv:- it is a row
under t,<taxel id>,...
At a terminal a table of the touched fields is shown until q or Ctrl-C; into a pipe goes a line
of JSON a frame.";

/// Turn frames into touches and percepts, live or from a recording.
#[derive(Args)]
#[command(after_help = FIRST_EXAMPLES, after_long_help = EXAMPLES, hide_possible_values = true, mut_args(grouped))]
pub(super) struct Arguments {
    /// A scene, a TOML file; a flag overrides its key.
    ///
    /// Its keys are the flags below, with _ for -. `somatic plan --schema` has all keys.
    #[arg(value_name = "SCENE")]
    scene: Option<PathBuf>,

    #[command(flatten)]
    asked: RunFlags,

    /// In csv: one row per frame, with columns of their own for each field.
    ///
    /// Without it, there is a row per field in contact.
    #[arg(long, help_heading = "Output")]
    wide: bool,

    /// The table that csv:- puts on standard output: fields, touches or self_contacts [default: fields; touches if no
    /// quantity of fields is asked for].
    #[arg(long, value_name = "TABLE", help_heading = "Output")]
    table: Option<TableName>,

    /// Print the columns of csv: or parquet: with their units and types, and run nothing.
    #[arg(long, help_heading = "Output")]
    describe: bool,

    /// Stop after this time, such as 10s.
    #[arg(long = "for", value_name = "TIME", help_heading = LIVE)]
    lasts: Option<String>,

    /// Print which field answers while you press one after the other, and at the end those that never did.
    ///
    /// With =taxels, or where there is one field, it is the taxel that answers. Without a calibration, nothing may be pressed
    /// in the first second.
    #[arg(long, value_name = "WHAT", help_heading = LIVE, num_args = 0..=1, require_equals = true,
        default_missing_value = "fields", value_parser = one_of::<OrderOf>(OrderOf::WORDS))]
    check_order: Option<OrderOf>,

    /// Write a summary at the end to this file, as JSON.
    ///
    /// It has how many frames each board sent and lost, and how long percepts took.
    #[arg(long, value_name = "FILE", help_heading = LIVE)]
    summary: Option<PathBuf>,
}

/// What a run writes: reserved, so that nothing that is read is replaced, and not opened yet.
struct Reserved {
    /// By sinks.
    targets: Vec<SinkTarget>,
    summary: Option<OutputPath>,
}

impl Arguments {
    /// Checks and reserves what `asked` has written, before anything is read.
    fn reserve(&self, asked: &Setup) -> Result<Reserved> {
        let sinks = &asked.sinks;
        let table = asked.table_wish(self.wide)?.on_stdout(self.table)?;
        if self.table.is_some() && !sinks.iter().any(SinkSpec::is_table_on_stdout) {
            return Err(Error::usage("--table is for a table on standard output; add --sink csv:-"));
        }
        if self.wide && !matches!(self.table, None | Some(TableName::Fields)) {
            return Err(Error::usage("--wide is for the table of fields; leave --table out"));
        }
        if sinks.is_empty() && !self.describe && asked.each().len() > 1 {
            return Err(Error::usage(
                "several recordings go into a table; add `sink = \"csv:FILE\"` or `sink = \"parquet:FILE\"`",
            ));
        }
        if self.wide && !sinks.iter().any(|sink| matches!(sink, SinkSpec::Csv(_))) && !self.describe {
            return Err(Error::usage("--wide is for a table in CSV; add --sink csv:FILE"));
        }
        if self.check_order.is_some() && sinks.iter().any(SinkSpec::is_on_stdout) {
            return Err(Error::usage(
                "--check-order prints on standard output; leave out the --sink that does so, too",
            ));
        }
        let mut outputs: OutputPaths = FilesRead::from_scene(asked, self.scene.as_deref()).outputs(asked.overwrite);
        // A description makes no file.
        let targets = sinks
            .iter()
            .filter(|_| !self.describe)
            .map(|sink| sink.target(&mut outputs, &asked.allow_hosts, table))
            .collect::<Result<Vec<SinkTarget>>>()?;
        let summary = self.summary.as_deref().map(|path| outputs.add(path)).transpose()?;
        if sinks.is_empty() {
            outputs.add_standard_output()?;
        }
        Ok(Reserved { targets, summary })
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    let asked = arguments.asked.with(arguments.scene.as_deref())?;
    run_asked(arguments, &asked).map_err(in_flags)
}

fn run_asked(arguments: &Arguments, asked: &Setup) -> Result<u8> {
    let several = Several::new(asked)?;
    let first = several.first().clone();
    let input = input(&first)?;
    let Reserved { targets, summary } = arguments.reserve(asked)?;
    let is_printed = asked.sinks.iter().any(SinkSpec::is_on_stdout) || arguments.check_order.is_some();
    let view = View::choose(asked.quiet, is_printed, input.is_recording());
    let prepared = Prepared::open(&first, &input, view.is_table(), summary, arguments.lasts.as_deref())?;
    several.check(&prepared.opened.body)?;

    // From here on there is something to bring to a clean end.
    let stop = stop_on_signal()?;
    let is_for_stdout = asked.sinks.is_empty() && !view.is_table() && arguments.check_order.is_none();
    let targets = if is_for_stdout { vec![SinkTarget::Stdout] } else { targets };
    let session = several.session(prepared.opened.session(&first, &input, &targets, arguments.scene.as_deref())?);
    if arguments.describe {
        print(&describe(&asked.sinks, &session, arguments.wide)?)?;
        return Ok(DONE);
    }
    let sinks = targets.into_iter().map(|target| target.open(&session)).collect::<Result<Vec<_>>>()?;
    if !asked.quiet {
        sinks.iter().flat_map(|sink| sink.remarks()).for_each(|remark| say(&remark));
    }
    let (run, console) = prepared.start(several, &input, view, sinks, arguments.check_order)?;
    // Where standard input is the source, what is typed there are frames.
    #[cfg(unix)]
    let keys = if view.is_table() && !input.is_stdin() { Keys::listen() } else { None };
    #[cfg(unix)]
    let is_ended = || stop.load(Ordering::Relaxed) || keys.as_ref().is_some_and(Keys::ends);
    #[cfg(not(unix))]
    let is_ended = || stop.load(Ordering::Relaxed);
    finish(run, console, is_ended)
}

/// Runs to the end, makes all outputs whole, says what is to be said, and gives the exit code.
fn finish(mut run: Run, mut console: Console, is_ended: impl Fn() -> bool) -> Result<u8> {
    let mut ending = match run.run(&mut console, is_ended) {
        Ok(ending) => ending,
        Err(error) => {
            console.leave();
            return Err(error);
        }
    };
    // Where nobody was heard, no file is left.
    let mut doubts = console.close(&mut ending)?;
    let outcome = run.finish(ending)?;
    outcome.remarks.iter().for_each(|remark| say(remark));
    doubts.iter_mut().flat_map(|doubts| doubts.told(outcome.engine.plan())).for_each(|doubt| say(&doubt));
    outcome.notices.iter().for_each(|notice| say(notice));
    let code = tell_losses(&outcome.losses);
    if let Some(agreement) = outcome.agreement {
        say_lines(&format!("backend {} {agreement}", outcome.engine.backend().name));
        if !agreement.holds() {
            return Ok(FAILED);
        }
    }
    Ok(if outcome.has_failed { FAILED } else { code })
}
