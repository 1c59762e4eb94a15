//! `somatic view`: a body, a recording or a scene in a browser.

mod checkpoints;
mod explain;
mod peaks;
mod player;
mod recorded;
mod recording;
mod shared;
mod subject;
mod timeline;

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use clap::Args;
use somatic::author::lint;
use somatic::field::FieldSet;
use somatic::internal::output::PrivateFile;
use somatic::internal::page::{EventKind, Mode, PageInfo, PageInput, PageScene, Publisher};
use somatic::internal::setup::Setup;
use somatic::page::{Listen, Server};
use somatic::source::SourceSpec;
use somatic::{BackendKind, Body, ChosenBackend, Engine, Error, Options, Result};

use self::checkpoints::Checkpoints;
use self::explain::Explainer;
use self::peaks::Peaks;
use self::player::Player;
use self::recorded::{Differences, Recorded};
use self::recording::Recording;
use self::shared::Shared;
use self::subject::{Subject, subject};
use super::browser;
use super::interrupt::stop_soon_on_signal;
use super::scene::{LIVE, RunFlags, grouped, in_flags, input};
use super::stdio::{DONE, LOST, say};
use super::tradeoff::settled;
use super::words;

const EXAMPLES: &str = "\
Examples:
  somatic view --open                             the bundled touch, in the browser
  somatic view robot.glb                          a body at rest
  somatic view touch.mcap                         a recording, with the body in it
  somatic view touch.csv --body robot.glb --calibration robot.toml
  somatic view robot.scene.toml --outputs touches,total
  somatic view touch.mcap --listen 127.0.0.1:8000
  ssh -L 7879:127.0.0.1:7879 robot                then open the address here, as a tunnel
  somatic run --source serial:/dev/ttyUSB0 --sink page      live boards

The page is served to this machine alone. Anyone with the printed address and its token may look and
play; nobody can change a file.";

/// Show a body, a recording or a scene in a browser.
#[derive(Args)]
#[command(after_help = EXAMPLES, mut_args(shown))]
pub(super) struct Arguments {
    /// What to show: a body, a recording, a scene or a simulation [default: the bundled touch].
    ///
    /// A body is a .glb or .gltf, or hand, mat or humanoid. A recording is a .mcap, a .csv, or a pressure system's
    /// .asf, .lst, .asc or .txt. A scene or a simulation is a .toml.
    #[arg(value_name = "WHAT")]
    what: Option<String>,

    #[command(flatten)]
    asked: RunFlags,

    /// Start the browser.
    #[arg(long)]
    open: bool,

    /// Stop after this time, such as 10s.
    #[arg(long = "for", value_name = "TIME", help_heading = LIVE)]
    lasts: Option<String>,

    /// Where to listen, HOST:PORT; port 0 is any free one [default: 127.0.0.1:7879, or the next free port].
    #[arg(long, value_name = "HOST:PORT")]
    listen: Option<String>,
}

/// `arg` in its group, unless the page has no use for it.
fn shown(arg: clap::Arg) -> clap::Arg {
    let arg = grouped(arg);
    let is_hidden = arg.get_long().is_some_and(|flag| HIDDEN.contains(&flag));
    arg.hide(is_hidden)
}

/// Flags of `run` that a page has no use for.
const HIDDEN: [&str; 12] = [
    "relative-to",
    "sink",
    "header",
    "verify",
    "force",
    "all-fields",
    "record",
    "loop",
    "batch",
    "strict",
    "live-rate",
    "board-rate",
];

/// How a page is served and opened.
struct Opening<'a> {
    arguments: &'a Arguments,
    listen: Listen,
    /// When to stop by itself.
    until: Option<Instant>,
}

/// A page that is served.
struct Opened {
    server: Server,
    publisher: Publisher,
    /// The file that a browser was given.
    _handed_over: Option<PrivateFile>,
}

pub(super) fn view(arguments: &Arguments) -> Result<u8> {
    let asked = &arguments.asked;
    if !asked.sinks.is_empty() || asked.verify {
        return Err(Error::usage(
            "a view has no use for --sink and --verify; give them to `somatic run`, with --sink page",
        ));
    }
    let listen = Listen::new(arguments.listen.as_deref(), &arguments.asked.allow_hosts)?;
    let lasts = arguments.lasts.as_deref().map(words::seconds).transpose()?;
    let opening = Opening { arguments, listen, until: lasts.map(|span| Instant::now() + span) };
    match subject(arguments.what.as_deref(), &arguments.asked)? {
        Subject::Body(body) => opening.body(&body),
        Subject::Recording(asked) => opening.recording(&asked).map_err(in_flags),
    }
}

/// What is odd about the layout of `body`, each in a sentence.
fn findings(body: &Body) -> Vec<String> {
    let fields = FieldSet::new(body).map(|set| set.fields);
    let odd = fields.map(|fields| lint(body, &fields)).unwrap_or_default();
    let found: Vec<String> = body.findings.iter().cloned().chain(odd.iter().map(ToString::to_string)).collect();
    if found.is_empty() { vec!["Nothing is odd about its layout.".to_owned()] } else { found }
}

impl Opening<'_> {
    /// Serves `scene` and says where.
    fn start(&self, scene: PageScene) -> Result<Opened> {
        let (server, publisher) = Server::start(&self.listen, scene)?;
        // A closed standard error is not a reason to stop.
        somatic::internal::plain::announce(&server.announcement());
        let handed_over = match self.arguments.open.then(|| browser::open(&server.url())).transpose() {
            Ok(file) => file,
            Err(error) => {
                say(&format!("{error}; open the address yourself"));
                None
            }
        };
        Ok(Opened { server, publisher, _handed_over: handed_over })
    }

    /// A body at rest.
    fn body(&self, body: &Body) -> Result<u8> {
        let mut engine = Engine::new(body, Options::default().backend(BackendKind::Cpu))?;
        let ChosenBackend { name, device, reason, .. } = engine.backend();
        let scene = PageScene::new(
            body,
            engine.plan(),
            &PageInfo {
                source: "at rest",
                mode: Mode::Live,
                backend: [name, &device, reason],
                // Nothing sends a value of any.
                taxels: &[],
                wiring: None,
                recorded_max: None,
            },
        );
        let stop = stop_soon_on_signal()?;
        let mut opened = self.start(scene)?;
        let frame = engine.frame(0.0);
        engine.process_one(&frame)?;
        opened.publisher.read(&PageInput {
            frame: &frame,
            values_read: None,
            plan: engine.plan(),
            arrived: None,
            call_us: f32::NAN,
            number: None,
        });
        opened.publisher.publish(engine.percepts());
        opened.publisher.ended("The body at rest, without frames.");
        let (sender, found) = channel();
        let looked_at = body.clone();
        // A large body takes a while, in which the page is there already. The thread ends with this one alone.
        std::thread::spawn(move || sender.send(findings(&looked_at)));
        while !stop.load(Ordering::Relaxed) && self.until.is_none_or(|until| Instant::now() < until) {
            for finding in found.try_recv().into_iter().flatten() {
                opened.publisher.event(EventKind::Notice, 0.0, None, finding);
            }
            opened.publisher.flush();
            std::thread::sleep(Duration::from_millis(50));
        }
        Ok(DONE)
    }

    /// A recording, from its first frame on.
    fn recording(&self, asked: &Setup) -> Result<u8> {
        let input = input(asked)?;
        if !input.is_recording() {
            return Err(Error::usage("a view shows recordings; show live frames with `somatic run --sink page`")
                .at(&input.name));
        }
        let body = Arc::new(input.body(asked)?);
        let stop = stop_soon_on_signal()?;
        let source = input.open_posed(&body, asked)?;
        let Some(recording) = Recording::read(source, &stop, asked.quiet)? else { return Ok(DONE) };
        let recording = Arc::new(recording);
        let settled = settled(asked, Some(&input), &body, recording::CHUNK)?;
        let mut engine = Engine::new(&body, settled.options.clone())?;
        engine.keep_touch_taxels(true);
        engine.set_channels(&recording.taxels).map_err(|e| e.at("header").at(&input.name))?;
        if !asked.quiet {
            engine.remarks().iter().for_each(|remark| say(remark));
        }
        let ChosenBackend { name, device, reason, .. } = engine.backend();
        let scene = PageScene::new(
            &body,
            engine.plan(),
            &PageInfo {
                source: &input.name,
                mode: recording.mode(),
                backend: [name, &device, settled.why.as_deref().unwrap_or(reason)],
                taxels: &recording.taxels,
                wiring: None,
                recorded_max: recording.largest_pressure(&engine),
            },
        );
        // The same backend for all engines, so that they have the same bits.
        let options = settled.options.backend(name.parse()?);
        let checkpoints = Arc::new(Checkpoints::new(&mut engine)?);
        let Opened { mut server, mut publisher, _handed_over } = self.start(scene)?;
        let recorded = match input.spec {
            Some(SourceSpec::Mcap(ref path)) => Recorded::open(path, engine.plan())?,
            _ => None,
        };
        let shared = Shared {
            peaks: Arc::new(Peaks::new(&body, &recording)),
            body,
            options,
            recording: Arc::clone(&recording),
            checkpoints,
            differences: Arc::new(Differences::default()),
            replies: server.replies(),
        };
        let timeline = timeline::start(shared.clone(), recorded, publisher.recording_events());
        let explainer = Explainer::start(shared.clone());
        let player = Player::new(engine, shared, publisher, explainer, timeline);
        let speed = asked.playback_speed.unwrap_or(1.0);
        let requests = server.requests().ok_or_else(|| Error::failed("the server has no requests"))?;
        let is_ended = || stop.load(Ordering::Relaxed) || self.until.is_some_and(|until| Instant::now() >= until);
        player.speed(speed).loops(input.is_bundled()).run(&requests, is_ended)?;
        for loss in &recording.losses {
            say(&format!("never processed: {loss}"));
        }
        Ok(if recording.losses.is_empty() { DONE } else { LOST })
    }
}
