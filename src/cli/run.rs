//! `somatic run`: from a source through an engine to sinks.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use console::Term;
use somatic::error::nearest;
use somatic::scene::{FilterBy, MotionFilter};
use somatic::signal::{FsrSignal, Letter, Receptor, Unfit};
use somatic::sink::{FieldNames, Flow, Sink, SinkSpec};
use somatic::source::{CsvSource, SimulatedSource, Source, SourceSpec};
use somatic::{
    Agreement, BackendKind, Body, Calibration, Engine, Error, Options, Outputs, Plan, Result, Scene, bundled,
};

use super::feed::{Arrival, Feed, Manner};
use super::live::{About, View};
use super::{DONE, FAILED, LOST, load_body, say};

const EXAMPLES: &str = "\
Examples:
  somatic run                                            the bundled touch on the bundled hand
  somatic run --source touch.csv --sink percepts.ndjson  a recording, as fast as possible
  somatic run --source touch.csv --speed 0.25            a recording, watched in slow motion
  somatic run --source touch.csv --fields 'hand/palm*' --outputs total,centroid
  somatic run --source touch.csv --letters sustained,change --outputs total
  somatic run --outputs filtered_direction --filter-window 0.5mm.. --filter-time 0.2
  robot-driver | somatic run --body robot.glb --source - | controller
  somatic run --body mat --source night.csv --backend gpu --verify

A frame on standard input is a line such as {\"t\":0.5,\"values\":{\"7\":12.0}}.
At a terminal the touched fields are shown; into a pipe goes a line of JSON a frame.";

/// Frames a call for recordings, unless told otherwise.
const RECORDED_BATCH: usize = 256;

/// Turn touch frames into percepts, live or from a recording.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The robot: a .glb or .gltf file, or one of the bundled bodies hand, mat and humanoid [default: hand, or a
    /// simulation's own].
    #[arg(long, value_name = "BODY")]
    body: Option<String>,

    /// Where frames come from: csv:FILE, sim:FILE.toml, or - for NDJSON on standard input [default: the bundled touch].
    #[arg(long = "source", value_name = "SOURCE")]
    sources: Vec<String>,

    /// Where percepts go: ndjson:FILE, or - for NDJSON on standard output; may be given several times.
    #[arg(long = "sink", value_name = "SINK")]
    sinks: Vec<String>,

    /// What computes: double precision, single precision on the CPU, shaders, or the faster of the last two by a
    /// measurement.
    #[arg(long, default_value = "auto", value_parser = PossibleValuesParser::new(["auto", "reference", "cpu", "gpu"])
        .try_map(|name| name.parse::<BackendKind>()))]
    backend: BackendKind,

    #[arg(long, value_name = "OUTPUT,...", value_delimiter = ',', value_parser = output, help = outputs_help())]
    outputs: Vec<Outputs>,

    /// Only the fields whose names match, such as 'hand/palm*' or '**/thumb'; may be given several times.
    #[arg(long, value_name = "GLOB")]
    fields: Vec<String>,

    /// List fields without contact too.
    #[arg(long)]
    all_fields: bool,

    /// The robot's calibration, a TOML file; without one, pressures are the raw values.
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,

    /// What of the sensors' pressures is looked at: how hard they are pressed (sustained), or how fast that changes, per
    /// second (change). Every field is there once for each.
    #[arg(long, value_name = "LETTER,...", value_delimiter = ',', default_value = "sustained",
        value_parser = PossibleValuesParser::new(["sustained", "change"]).try_map(|name| name.parse::<Receptor>()))]
    letters: Vec<Receptor>,

    /// Which signal force-sensing resistors deliver, instead of what the calibration says; with both, every field is there
    /// once for each.
    #[arg(long, value_name = "SIGNAL,...", value_delimiter = ',',
        value_parser = PossibleValuesParser::new(["raw", "linear"]).try_map(|name| name.parse::<FsrSignal>()))]
    signal: Vec<FsrSignal>,

    /// Take the first frame's values as the baselines; only for a robot that nothing touches at the start.
    #[arg(long)]
    tare: bool,

    /// Frames per second of a CSV recording that has no column t, in Hz.
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,

    /// Frames a call, at most: more is faster, fewer is sooner [default: 256 for recordings, 1 live].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    batch: Option<u32>,

    /// Play a recording at this many times the speed it was made at [default: as fast as possible].
    #[arg(long, value_name = "X")]
    speed: Option<f64>,

    /// How long a value that frames leave out stays what it was, in seconds, before it counts as missing.
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    max_age: f64,

    /// The longest time between two frames over which motion is measured, in seconds.
    #[arg(long, value_name = "S", default_value_t = 10.0)]
    max_gap: f64,

    /// Which motion counts, for the filtered_* outputs: the centroid's way from where it last counted. What is shorter is
    /// held back until it has added up, so that slow motion passes and jitter does not; what is longer is another touch.
    /// Either end may be left out [default: from 1/16 of the spacing of a field's taxels to 3 times that].
    #[arg(long, value_name = "LOW..HIGH", allow_hyphen_values = true)]
    filter_window: Option<String>,

    /// What that window measures: the way, or the paper's change of the distance from the chart's origin, which is blind to
    /// motion around it [default: distance].
    #[arg(long, value_name = "MEASURE", value_parser = PossibleValuesParser::new(["distance", "radial"])
        .try_map(|name| name.parse::<FilterBy>()))]
    filter_by: Option<FilterBy>,

    /// How long filtered_direction takes to turn (its time constant), in seconds; 0 is at once [default: 0.1].
    #[arg(long, value_name = "S", allow_hyphen_values = true)]
    filter_time: Option<f64>,

    /// Compare every percept with the double-precision reference; exit with 1 where they disagree.
    #[arg(long)]
    verify: bool,

    /// Show no table, progress or remarks.
    #[arg(short, long)]
    quiet: bool,
}

fn outputs_help() -> String {
    let names: Vec<String> = Outputs::all().names().collect();
    format!("Only these quantities: {} [default: all but touches and filtered_*]", names.join(", "))
}

pub(super) fn output(name: &str) -> Result<Outputs> {
    Outputs::named(name).ok_or_else(|| {
        let names: Vec<String> = Outputs::all().names().collect();
        let hint = match nearest(name, names.iter().map(String::as_str)) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("there are {}", names.join(", ")),
        };
        Error::usage(format!("there is no output `{name}`; {hint}"))
    })
}

/// What sinks call the fields.
fn field_names(plan: &Plan) -> Vec<FieldNames> {
    let name = |(index, (field, link)): (usize, (&str, &str))| {
        let mark = plan.mark(index);
        FieldNames {
            field: field.into(),
            link: link.into(),
            letter: mark.receptor.map(|receptor| receptor.to_string()),
            signal: mark.signal.map(|signal| signal.to_string()),
        }
    };
    plan.fields().enumerate().map(name).collect()
}

pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    arguments.check()?;
    let sinks = arguments.sinks.iter().map(|text| text.parse()).collect::<Result<Vec<SinkSpec>>>()?;
    let input = Input::named(arguments)?;
    let body = match (&arguments.body, &input.spec) {
        (Some(body), _) => load_body(body)?,
        // A simulation says what body it is on.
        (None, Some(SourceSpec::Sim(path))) => SimulatedSource::open(path)?.body().clone(),
        (None, _) => load_body("hand")?,
    };
    for finding in body.findings.iter().filter(|_| !arguments.quiet) {
        say(&format!("{}: {finding}", body.name));
    }
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let source = input.open(&ids, arguments.rate)?;

    let view = View::choose(arguments.quiet, sinks.contains(&SinkSpec::Stdout), input.is_recording());
    let at_terminal = view.is_table();
    let speed = arguments.speed.or((input.is_bundled() && at_terminal).then_some(1.0));
    let gather = input.is_recording() && speed.is_none();
    let batch = arguments.batch.map_or(if gather { RECORDED_BATCH } else { 1 }, |batch| batch as usize);
    let mut engine = Engine::new(&body, arguments.options(&body, &ids, batch)?)?;
    engine.listen(source.taxels()).map_err(|e| e.at("header").at(&input.name))?;
    if arguments.backend == BackendKind::Auto && !arguments.quiet {
        let (name, what, why) = engine.backend();
        say(&format!("backend {name} ({what}): {why}"));
    }

    // From here on there is something to bring to a clean end.
    let stop = stop_on_signal()?;
    let sinks = if sinks.is_empty() && !at_terminal { vec![SinkSpec::Stdout] } else { sinks };
    let names = field_names(engine.plan());
    let about = About { engine: &engine, body: &body.name, source: &input.name, all_fields: arguments.all_fields };
    let view = view.open(&about);
    let sinks = sinks.iter().map(|sink| sink.open(&names, arguments.all_fields)).collect::<Result<_>>()?;
    let feed = Feed::start(source, Manner { most: batch, gather, speed });
    let agreement = arguments.verify.then(Agreement::default);
    let mut pump = Pump { engine, sinks, view, flush: !gather, agreement, unfit: Vec::new() };
    let losses = pump.run(feed, &stop)?;
    pump.finish(&losses)
}

impl Arguments {
    fn check(&self) -> Result<()> {
        if self.sources.len() > 1 {
            return Err(Error::usage("this version reads one --source at a time; merge them, or run once for each"));
        }
        if let Some(speed) = self.speed.filter(|speed| !(speed.is_finite() && *speed > 0.0)) {
            return Err(Error::usage(format!(
                "--speed {speed} is no speed; give a positive number, 1 for as recorded"
            )));
        }
        if !(self.max_age.is_finite() && self.max_age >= 0.0) {
            return Err(Error::usage(format!("--max-age {} is no time span; give seconds from 0", self.max_age)));
        }
        if self.max_gap.is_nan() || self.max_gap <= 0.0 {
            return Err(Error::usage(format!("--max-gap {} is no time span; give seconds over 0", self.max_gap)));
        }
        Ok(())
    }

    /// Which motion counts, if that is asked for.
    fn filter(&self, outputs: Outputs) -> Result<MotionFilter> {
        let usual = MotionFilter::default();
        let given = [
            ("--filter-window", self.filter_window.is_some()),
            ("--filter-by", self.filter_by.is_some()),
            ("--filter-time", self.filter_time.is_some()),
        ];
        if let Some((flag, _)) = given.iter().find(|(_, given)| *given && !outputs.intersects(Outputs::FILTERED)) {
            return Err(Error::usage(format!(
                "{flag} is for outputs that are not asked for; add --outputs filtered_direction, or others of filtered_*"
            )));
        }
        let filter = MotionFilter {
            by: self.filter_by.unwrap_or(usual.by),
            time_constant_s: self.filter_time.unwrap_or(usual.time_constant_s),
            ..usual
        };
        self.filter_window.as_ref().map_or(Ok(filter), |window| filter.with_window(window))
    }

    fn options(&self, body: &Body, ids: &[u32], batch: usize) -> Result<Options> {
        let outputs = self.outputs.iter().copied().reduce(|a, b| a | b).unwrap_or(Outputs::USUAL);
        let scene = Scene {
            outputs,
            fields: self.fields.clone(),
            max_age_s: self.max_age,
            max_gap_s: self.max_gap,
            letters: Letter::all_of(&self.letters, &self.signal),
            filter: self.filter(outputs)?,
        };
        let load = |path: &PathBuf| {
            let calibration = Calibration::load(path, ids)?;
            calibration.check_body(&body.name).map_err(|e| e.at(path.display()))?;
            Ok(calibration)
        };
        let calibration = self.calibration.as_ref().map(load).transpose()?;
        Ok(Options { scene, calibration, backend: self.backend, tare: self.tare, batch })
    }
}

/// What frames are read from.
struct Input {
    /// As messages call it.
    name: String,
    /// `None` is the bundled touch.
    spec: Option<SourceSpec>,
}

impl Input {
    fn named(arguments: &Arguments) -> Result<Self> {
        let Some(text) = arguments.sources.first() else {
            return match arguments.body.as_deref() {
                None | Some("hand") => Ok(Self { name: "bundled touch".to_owned(), spec: None }),
                Some(body) => Err(Error::usage(format!(
                    "body `{body}` needs a --source, such as csv:FILE or -; the bundled touch is for the bundled hand"
                ))),
            };
        };
        let spec: SourceSpec = text.parse()?;
        let name = match &spec {
            SourceSpec::Csv(path) | SourceSpec::Mcap(path) | SourceSpec::Sim(path) => path.display().to_string(),
            SourceSpec::Stdin => "stdin".to_owned(),
            _ => text.clone(),
        };
        let input = Self { name, spec: Some(spec) };
        if arguments.speed.is_some() && !input.is_recording() {
            return Err(Error::usage("--speed is for recordings; live frames come when they come"));
        }
        Ok(input)
    }

    fn is_bundled(&self) -> bool {
        self.spec.is_none()
    }

    fn is_recording(&self) -> bool {
        !matches!(self.spec, Some(SourceSpec::Stdin | SourceSpec::Serial { .. }))
    }

    fn open(&self, ids: &[u32], rate_hz: Option<f64>) -> Result<Box<dyn Source + Send>> {
        match &self.spec {
            Some(spec) => spec.open(ids, rate_hz),
            None => {
                let length = Some(bundled::TOUCH.len() as u64);
                Ok(Box::new(CsvSource::from_reader(&self.name, bundled::TOUCH, length, rate_hz)?))
            }
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
    /// Taxels that have been told to be left out.
    unfit: Vec<(u32, Unfit)>,
}

impl Pump {
    /// Runs until the source ends, the last reader has gone, or `stop` is set; gives what the source lost.
    fn run(&mut self, mut feed: Feed, stop: &AtomicBool) -> Result<Vec<String>> {
        let watched = self.view.is_table() || self.sinks.is_empty();
        while !stop.load(Ordering::Relaxed) {
            match feed.next(Duration::from_millis(40)) {
                Some(Arrival::Frames(frames, progress)) => {
                    let percepts = match &mut self.agreement {
                        None => self.engine.process(&frames)?,
                        Some(sum) => {
                            let (percepts, agreement) = self.engine.process_and_compare(&frames)?;
                            sum.merge(agreement);
                            percepts
                        }
                    };
                    self.view.see(percepts, progress);
                    let mut open = Vec::with_capacity(self.sinks.len());
                    for mut sink in self.sinks.drain(..) {
                        let flow = sink.write(percepts)?;
                        let flow = if flow == Flow::Open && self.flush { sink.flush()? } else { flow };
                        match flow {
                            Flow::Open => open.push(sink),
                            Flow::Closed => sink.finish()?,
                        }
                    }
                    self.sinks = open;
                    if self.sinks.is_empty() && !watched {
                        break;
                    }
                    feed.give_back(frames);
                    if !self.view.is_table() {
                        tell_unfit(&self.engine, &mut self.unfit);
                    }
                }
                Some(Arrival::End(losses)) => return Ok(losses),
                Some(Arrival::Failed(error)) => return Err(error),
                None => {}
            }
            self.view.draw();
        }
        Ok(Vec::new())
    }

    /// Makes all outputs whole, says what is to be said, and gives the exit code.
    fn finish(mut self, losses: &[String]) -> Result<u8> {
        for sink in self.sinks {
            sink.finish()?;
        }
        self.view.finish();
        tell_unfit(&self.engine, &mut self.unfit);
        for loss in losses {
            say(&format!("never processed: {loss}"));
        }
        if let Some(agreement) = self.agreement {
            say(&format!("backend {} {agreement}", self.engine.backend().0));
            if !agreement.holds() {
                return Ok(FAILED);
            }
        }
        Ok(if losses.is_empty() { DONE } else { LOST })
    }
}

/// Says which taxels are left out from now on and which are used again, where that differs from what was `told`.
fn tell_unfit(engine: &Engine, told: &mut Vec<(u32, Unfit)>) {
    let now: Vec<(u32, Unfit)> = engine.unfit().collect();
    for (id, why) in now.iter().filter(|taxel| !told.contains(taxel)) {
        say(&format!("taxel {id} is {why} and left out"));
    }
    for (id, _) in told.iter().filter(|(id, _)| !now.iter().any(|(other, _)| other == id)) {
        say(&format!("taxel {id} is used again"));
    }
    *told = now;
}

/// A flag that the first Ctrl-C or termination signal sets; the second ends the process at once.
pub(super) fn stop_on_signal() -> Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            for term in [Term::stdout(), Term::stderr()].into_iter().filter(Term::is_term) {
                let _ = term.show_cursor();
            }
            std::process::exit(130);
        }
    })
    .map_err(|e| Error::failed(format!("cannot listen for Ctrl-C: {e}")))?;
    Ok(stop)
}
