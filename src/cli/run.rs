//! `somatic run`: from a source through an engine to sinks.

mod serve;

use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use clap::Args;
use somatic::signal::Quantity;
use somatic::sink::{FieldNames, Flow, InputFrames, News, Session, Sink, SinkSpec, SinkTarget, TableName};
use somatic::{Agreement, BackendKind, Engine, Error, Frame, Precision, Result};

use self::serve::{give, give_lines, opened, serve};
use super::attachments::attachments;
use super::describe::describe;
use super::doubts::Doubts;
#[cfg(feature = "page")]
use super::explanation::LiveExplainer;
use super::feed::{Arrival, Ending, Feed, ReadMode};
use super::files::FilesRead;
use super::input::{Input, RECORDED_BATCH};
use super::interrupt::{left_out, stop_on_signal};
#[cfg(unix)]
use super::keys::Keys;
use super::lines::LineReport;
use super::live::{RunInfo, View};
use super::scene::{LIVE, RunFlags, grouped};
use super::stdio::{DONE, FAILED, print, say, say_lines, tell_losses};
use super::tradeoff::{say_kept, settled};
use super::unfit::UnfitReport;
use super::verify::has_another_to_compare;
use super::words;

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
  somatic run --outputs filtered_direction --filter-window 0.5mm.. --filter-time 0.2
  somatic run robot.scene.toml                           all of it from a file
  robot-driver | somatic run --body robot.glb --source - | controller
  robot-driver | somatic run --body robot.glb --source - --sink mcap:touch.mcap
  zcat touch.csv.gz | somatic run --body robot.glb --source csv:-
  somatic run --source mcap:touch.mcap --from 60 --to 90   its second minute's first half
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
    /// A scene, a TOML file: its keys are the flags below, with _ for -; a flag overrides its key. `somatic plan --schema` has all keys.
    #[arg(value_name = "SCENE")]
    scene: Option<PathBuf>,

    #[command(flatten)]
    asked: RunFlags,

    /// In csv: one row per frame, with columns of their own for each field, instead of a row per field in contact.
    #[arg(long, help_heading = "Output")]
    wide: bool,

    /// The table that csv:- puts on standard output: fields, touches or self_contacts [default: fields; touches where nothing is asked of fields;
    /// fields].
    #[arg(long, value_name = "TABLE", help_heading = "Output")]
    table: Option<TableName>,

    /// Print the columns of csv: or parquet: with their units and types, and run nothing.
    #[arg(long, help_heading = "Output")]
    describe: bool,

    /// Stop after this time, such as 10s.
    #[arg(long = "for", value_name = "TIME", help_heading = LIVE)]
    lasts: Option<String>,

    /// At the end, write how many frames each board sent and lost, and how long percepts took, to this file, as JSON.
    #[arg(long, value_name = "FILE", help_heading = LIVE)]
    summary: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    let asked = arguments.asked.with(arguments.scene.as_deref())?;
    let sinks = &asked.sinks;
    let input = Input::named(&asked)?;
    let table = asked.tables(arguments.wide).on_stdout(arguments.table)?;
    if arguments.table.is_some() && !sinks.iter().any(SinkSpec::is_table_on_stdout) {
        return Err(Error::usage("--table is for a table on standard output; add --sink csv:-"));
    }
    if arguments.wide && !matches!(arguments.table, None | Some(TableName::Fields)) {
        return Err(Error::usage("--wide is for the table of fields; leave --table out"));
    }
    if arguments.wide && !sinks.iter().any(|sink| matches!(sink, SinkSpec::Csv(_))) && !arguments.describe {
        return Err(Error::usage("--wide is for a table in CSV; add --sink csv:FILE"));
    }
    let mut outputs = FilesRead::of(&asked, arguments.scene.as_deref()).outputs(asked.overwrite);
    // A description makes no file.
    let targets = sinks
        .iter()
        .filter(|_| !arguments.describe)
        .map(|sink| sink.target(&mut outputs, &asked.allow_hosts, table))
        .collect::<Result<Vec<SinkTarget>>>()?;
    let summary = arguments.summary.as_deref().map(|path| outputs.add(path)).transpose()?;
    if sinks.is_empty() {
        outputs.add_standard_output()?;
    }
    let body = input.body(&asked)?;
    // Why a body without a layout cannot be run is said once, by the error.
    let has_layout = !(body.taxels.is_empty() && body.fields.is_empty());
    for finding in body.findings.iter().filter(|_| !asked.quiet && has_layout) {
        say(&format!("{}: {finding}", body.name));
    }
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let recorded = if input.is_merged() { None } else { Some(input.open(&ids, &asked)?) };
    let lasts = arguments.lasts.as_deref().map(words::seconds).transpose()?;
    if summary.is_some() && recorded.is_some() {
        return Err(Error::usage("--summary is for boards on serial lines; add --source serial:PORT"));
    }

    let view = View::choose(asked.quiet, sinks.iter().any(SinkSpec::is_on_stdout), input.is_recording());
    let at_terminal = view.is_table();
    let has_page = sinks.iter().any(|sink| matches!(sink, SinkSpec::Page(_)));
    let is_watched =
        (input.is_bundled() && at_terminal) || (input.is_recording() && sinks.iter().any(SinkSpec::is_watched));
    let speed = asked.playback_speed.or(is_watched.then_some(1.0));
    let gather = input.is_recording() && speed.is_none();
    // What is played until somebody ends it is never a part.
    let ends = input.is_recording() && asked.repeat != Some(0);
    let batch = asked.batch.map_or(if gather { RECORDED_BATCH } else { 1 }, |batch| batch as usize);
    let settled = settled(&asked, Some(&input), &body, batch)?;
    let is_raw = settled.options.calibration.is_none() && !settled.options.tare;
    asked.line_keys().check_wipers(settled.options.calibration.as_ref(), &ids)?;
    #[cfg(feature = "page")]
    let options = settled.options.clone();
    let mut engine = Engine::new(&body, settled.options)?;
    engine.keep_touch_taxels(has_page);
    let verify = asked.verify && has_another_to_compare(&engine, settled.why.as_deref())?;
    // Boards speak as soon as their lines are open: not before somebody can listen.
    let mut wiring = None;
    let (source, live) = match recorded {
        Some(mut source) => {
            source.report_stale();
            (source, None)
        }
        None => {
            let opened = input.open_lines(&ids, &asked)?;
            engine.track_stale();
            opened.wiring.iter().for_each(|wiring| engine.wire(wiring));
            wiring = opened.wiring;
            (opened.source, Some(LineReport::new(opened.lines, summary, asked.quiet)))
        }
    };
    let source = asked.jointed(source, &body)?;
    engine.set_channels(source.taxels()).map_err(|e| e.at("header").at(&input.name))?;
    if asked.backend.unwrap_or_default() == BackendKind::Auto && !asked.quiet {
        let (name, what, why) = engine.backend();
        say(&format!("backend {name} ({what}): {}", settled.why.as_deref().unwrap_or(why)));
    }
    let mut doubts = None;
    if !asked.quiet {
        say_kept(&engine);
        let from = Doubts::new(&input.name, &body, source.taxels(), input.holds_any(), is_raw);
        from.of_taxels(engine.plan()).iter().for_each(|doubt| say(doubt));
        doubts = Some(from);
    }

    // From here on there is something to bring to a clean end.
    let stop = stop_on_signal()?;
    let targets = if sinks.is_empty() && !at_terminal { vec![SinkTarget::Stdout] } else { targets };
    let names = FieldNames::all_of(engine.plan());
    let records = targets.iter().any(SinkTarget::holds_attached);
    let (backend, device, why) = engine.backend();
    let session = Session {
        names,
        all_fields: asked.all_fields,
        outputs: engine.percepts().outputs(),
        is_double: engine.percepts().precision() == Precision::F64,
        p_unit: engine.plan().common_quantity().map_or("", Quantity::symbol),
        header: asked.header,
        taxels: source.taxels(),
        body: Some(&body),
        attached: if records { attachments(&asked, &body, arguments.scene.as_deref())? } else { Vec::new() },
        parts: asked.record.clone(),
        plan: Some(engine.plan()),
        source: &input.name,
        backend: [backend, &device, settled.why.as_deref().unwrap_or(why)],
        is_recorded: ends,
        wiring: wiring.as_ref(),
        zenoh_config: asked.zenoh_config.as_deref(),
        ros_time: asked.ros_time.unwrap_or_default(),
    };
    if arguments.describe {
        print(&describe(sinks, &session, arguments.wide)?)?;
        return Ok(DONE);
    }
    let sinks = opened(targets, &session, asked.quiet)?;
    #[cfg(feature = "page")]
    let taxels = source.taxels().to_vec();
    let about = RunInfo { engine: &engine, body: &body, source: &input.name, all_fields: asked.all_fields };
    let view = view.open(&about);
    // Where standard input is the source, what is typed there are frames.
    #[cfg(unix)]
    let keys = if at_terminal && !input.is_stdin() { Keys::listen() } else { None };
    let feed = match &live {
        None => Feed::start(source, ReadMode { most: batch, gather, speed }),
        Some(live) => Feed::start_woken(source, batch, live.lines()),
    };
    #[cfg(feature = "page")]
    let explainer = match has_page {
        true => Some(LiveExplainer::start(body.clone(), options.backend(engine.backend().0.parse()?), taxels)),
        false => None,
    };
    let agreement = verify.then(Agreement::default);
    let heeds_stale = live.is_some();
    let mut pump = Pump {
        engine,
        sinks,
        view,
        flush: !gather,
        agreement,
        unfit: UnfitReport::default(),
        failed: false,
        live,
        heeds_stale,
        doubts,
        recording: ends.then(|| input.name.clone()),
        progress: None,
        frames: 0,
        #[cfg(feature = "page")]
        explainer,
    };
    #[cfg(unix)]
    let is_ended = || stop.load(Ordering::Relaxed) || keys.as_ref().is_some_and(Keys::ends);
    #[cfg(not(unix))]
    let is_ended = || stop.load(Ordering::Relaxed);
    let until = lasts.map(|span| Instant::now() + span);
    match pump.run(feed, is_ended, until) {
        Ok(ending) => pump.finish(ending),
        Err(error) => {
            let Pump { view, live, .. } = pump;
            drop(view);
            // What was said of the lines tells why.
            live.into_iter().for_each(|mut live| live.tell(false));
            Err(error)
        }
    }
}

/// Takes frames from a feed through the engine to whoever is to have the percepts.
struct Pump {
    engine: Engine,
    sinks: Vec<Box<dyn Sink + Send>>,
    view: View,
    /// Whether somebody waits for every frame.
    flush: bool,
    agreement: Option<Agreement>,
    unfit: UnfitReport,
    /// Whether a sink could not go on.
    failed: bool,
    /// The serial lines, if they are read.
    live: Option<LineReport>,
    heeds_stale: bool,
    /// What is looked for in the first frames.
    doubts: Option<Doubts>,
    /// The name of the source, if that is a recording and ends.
    recording: Option<String>,
    /// The share of it that has been read, if known.
    progress: Option<f64>,
    /// Frames that were processed.
    frames: u64,
    /// With a page.
    #[cfg(feature = "page")]
    explainer: Option<LiveExplainer>,
}

/// A call of the engine.
#[derive(Clone, Copy)]
struct Call {
    /// When its last frame arrived, if known.
    arrived: Option<Instant>,
    took: Duration,
}

impl Pump {
    /// Runs until the source ends, the last reader has gone, or `is_ended`; gives what the source says at its end.
    fn run(&mut self, mut feed: Feed, is_ended: impl Fn() -> bool, until: Option<Instant>) -> Result<Ending> {
        let watched = self.view.is_table() || self.sinks.is_empty();
        let (mut losses, mut closing) = (Vec::new(), Vec::new());
        while !is_ended() && until.is_none_or(|until| Instant::now() < until) {
            match feed.next(Duration::from_millis(40)) {
                Some(Arrival::Frames(frames, told)) => {
                    told.notices.iter().filter(|_| !self.view.is_table()).for_each(|notice| say(notice));
                    (losses, closing) = (told.losses, told.closing);
                    if told.has_stale && !std::mem::replace(&mut self.heeds_stale, true) {
                        self.engine.track_stale();
                    }
                    let begin = Instant::now();
                    #[cfg(feature = "page")]
                    self.explain(&frames)?;
                    if let Some(sum) = &mut self.agreement {
                        sum.merge(self.engine.process_and_compare(&frames)?.1);
                    } else {
                        self.engine.process(&frames)?;
                    }
                    if let Some(notice) = self.engine.notice() {
                        say(&notice);
                    }
                    let call = Call { arrived: told.read_at.last().copied(), took: begin.elapsed() };
                    let has_seen_enough = self.doubts.as_mut().is_some_and(|doubts| doubts.see(&frames));
                    if has_seen_enough && !self.view.is_table() {
                        tell_doubts(&self.engine, &mut self.doubts);
                    }
                    self.view.see(self.engine.percepts(), told.progress);
                    self.progress = told.progress;
                    self.frames += frames.len() as u64;
                    self.unfit.at_s = frames.last().map_or(self.unfit.at_s, |frame| frame.t_s);
                    self.pass_on(&frames, call)?;
                    if self.sinks.is_empty() && !watched {
                        break;
                    }
                    if let Some(live) = &mut self.live {
                        live.see(&told.read_at);
                    }
                    feed.give_back(frames);
                    self.report_unfit()?;
                }
                Some(Arrival::End(ending)) => return Ok(ending),
                Some(Arrival::Failed(error)) => return Err(error),
                // Nothing comes, but something may be held back.
                None if self.flush => self.each_sink(|sink| sink.flush())?,
                None | Some(Arrival::Woken) => {}
            }
            if let Some(live) = &mut self.live {
                if let Some((lines, read_at)) = live.percepts() {
                    serve(&mut self.sinks, true, &mut self.failed, |sink| give_lines(sink, &lines))?;
                    live.see(&read_at);
                }
                live.tell(self.view.is_table());
                self.view.set_footer(|| live.rows());
                if let Some(news) = live.news() {
                    self.each_sink(|sink| sink.write_news(&news))?;
                }
            }
            self.view.draw();
        }
        // Who has only looked at it has no part of anything.
        let is_early = self.recording.is_some() && !self.sinks.is_empty() && is_ended();
        Ok(Ending { losses, notices: closing, is_early })
    }

    /// Reports taxels that are left out, or used again, to sinks and, unless a table fills the terminal, to people.
    fn report_unfit(&mut self) -> Result<()> {
        let messages = self.unfit.changes(&self.engine);
        if messages.is_empty() {
            return Ok(());
        }
        messages.iter().filter(|_| !self.view.is_table()).for_each(|message| say(message));
        let at_s = self.unfit.at_s;
        let taxels = messages.into_iter().map(|message| (at_s, message)).collect();
        let news = News { taxels, ..News::default() };
        self.each_sink(|sink| sink.write_news(&news))
    }

    /// Has percepts of `frames`, which come next, explained where viewers ask for that.
    #[cfg(feature = "page")]
    fn explain(&mut self, frames: &[Frame]) -> Result<()> {
        let Some(explainer) = &self.explainer else { return Ok(()) };
        let questions: Vec<_> = self.sinks.iter_mut().flat_map(|sink| sink.questions()).collect();
        if !questions.is_empty() {
            explainer.explain(questions, self.engine.state()?, frames);
        }
        Ok(())
    }

    /// Gives `frames`, and what the engine made of them, to every sink.
    fn pass_on(&mut self, frames: &[Frame], call: Call) -> Result<()> {
        let Self { engine, sinks, flush, failed, .. } = self;
        let input = InputFrames {
            frames,
            pressures: &|frame, to| engine.pressures(frame, to),
            plan: engine.plan(),
            values_read: engine.values_read(),
            arrived: call.arrived,
            call: call.took,
        };
        serve(sinks, *flush, failed, |sink| give(sink, &input, engine.percepts(), *flush))
    }

    fn each_sink(&mut self, act: impl FnMut(&mut dyn Sink) -> Result<Flow>) -> Result<()> {
        serve(&mut self.sinks, self.flush, &mut self.failed, act)
    }

    /// Makes all outputs whole, says what is to be said, and gives the exit code.
    fn finish(mut self, Ending { mut losses, notices, is_early }: Ending) -> Result<u8> {
        self.view.finish();
        // Where nobody was heard, no file is left.
        if let Some(live) = self.live {
            losses = live.finish()?;
        }
        let mut absent = Vec::new();
        for sink in self.sinks {
            match is_early {
                true => absent.extend(sink.finish_early()?),
                false => sink.finish()?,
            }
        }
        if is_early {
            let recording = self.recording.as_deref().unwrap_or_default();
            losses.push(left_out(recording, self.frames, self.unfit.at_s, self.progress, &absent));
        }
        self.unfit.changes(&self.engine).iter().for_each(|message| say(message));
        self.unfit.print_repeats();
        tell_doubts(&self.engine, &mut self.doubts);
        notices.iter().for_each(|notice| say(notice));
        let code = tell_losses(&losses);
        if let Some(agreement) = self.agreement {
            say_lines(&format!("backend {} {agreement}", self.engine.backend().0));
            if !agreement.holds() {
                return Ok(FAILED);
            }
        }
        Ok(if self.failed { FAILED } else { code })
    }
}

/// Says, the first time, what is doubtful in the frames so far.
fn tell_doubts(engine: &Engine, doubts: &mut Option<Doubts>) {
    let doubts = doubts.take();
    doubts.iter().flat_map(|doubts| doubts.of_frames(engine.plan())).for_each(|doubt| say(&doubt));
}
