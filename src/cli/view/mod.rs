//! `somatic view`: a body, a recording or a scene in a browser.

mod answers;
mod checkpoints;
mod clock;
mod peaks;
mod player;
mod ready;
mod recorded;
mod recording;
mod shared;
mod subject;
mod timeline;

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use clap::Args;
use somatic::author::lint;
use somatic::field::FieldSet;
use somatic::internal::output::PrivateFile;
use somatic::internal::page::{EventKind, Mode, PageInfo, PageInput, PageScene, Publisher};
use somatic::internal::setup::Setup;
use somatic::page::{Listen, Server};
use somatic::{BackendKind, Body, ChosenBackend, Engine, Error, Options, Result};

use self::clock::Clock;
use self::ready::{Extremes, Ready};
use self::subject::{Subject, subject};
use super::browser;
use super::interrupt::stop_soon_on_signal;
use super::scene::{LIVE, RunFlags, grouped, in_flags};
use super::stdio::{DONE, LOST, say};
use super::words;

const EXAMPLES: &str = "\
Examples:
  somatic view --open                             the bundled touch, in the browser
  somatic view robot.glb                          a body at rest
  somatic view touch.mcap                         a recording, with the body in it
  somatic view touch.csv --body robot.glb --calibration robot.toml
  somatic view before.mcap --beside after.mcap    two recordings, with one clock
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
    /// A body is a .glb or .gltf, or hand, sensing-hand, mat or humanoid. A recording is a .mcap, a .csv, or a pressure system's
    /// .asf, .lst, .asc or .txt. A scene or a simulation is a .toml.
    #[arg(value_name = "WHAT")]
    what: Option<String>,

    /// A second recording, shown next to the first with the same clock and flags; both begin together.
    #[arg(long, value_name = "WHAT")]
    beside: Option<String>,

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

impl Arguments {
    /// What is shown beside the first, with the same flags.
    fn second(&self) -> Result<Option<Subject>> {
        let Some(beside) = &self.beside else { return Ok(None) };
        let mut asked = self.asked.clone();
        // The first may be a body with the recording in --source; the second is then of the same body.
        if !asked.sources.is_empty() && !self.what.as_deref().is_some_and(|what| what.ends_with(".toml")) {
            asked.body = asked.body.or_else(|| self.what.clone());
        }
        asked.sources.clear();
        subject(Some(beside), &asked).map(Some)
    }
}

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
    match (subject(arguments.what.as_deref(), asked)?, arguments.second()?) {
        (Subject::Body(body), None) => opening.body(&body),
        (Subject::Recording(asked), None) => opening.recording(&asked).map_err(in_flags),
        (Subject::Recording(first), Some(Subject::Recording(second))) => {
            opening.pair([&first, &second]).map_err(in_flags)
        }
        (Subject::Body(_), Some(_)) | (_, Some(Subject::Body(_))) => {
            Err(Error::usage("two recordings are shown side by side, and a body at rest is none").at("--beside"))
        }
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
        let handed_over = self.announce(&server);
        Ok(Opened { server, publisher, _handed_over: handed_over })
    }

    /// Says where `server` is, and gives it to a browser: through this file, if asked for.
    fn announce(&self, server: &Server) -> Option<PrivateFile> {
        // A closed standard error is not a reason to stop.
        somatic::internal::plain::announce(&server.announcement());
        match self.arguments.open.then(|| browser::open(&server.url())).transpose() {
            Ok(file) => file,
            Err(error) => {
                say(&format!("{error}; open the address yourself"));
                None
            }
        }
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
                recorded_senses: Default::default(),
            },
        );
        let stop = stop_soon_on_signal()?;
        let mut opened = self.start(scene)?;
        let frame = engine.frame(0.0);
        engine.process_one(&frame)?;
        opened.publisher.read(&PageInput {
            frame: &frame,
            values_read: None,
            values_noted: &[],
            values_sensed: &[],
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
        while !self.is_over(&stop) {
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
        let stop = stop_soon_on_signal()?;
        let Some(ready) = Ready::read(asked, &stop)? else { return Ok(DONE) };
        let clock = Clock::new(1, asked.playback_speed.unwrap_or(1.0), ready.is_bundled()).remove(0);
        let Opened { server, publisher, _handed_over } = self.start(ready.scene(ready.extremes()))?;
        let is_lost = ready.play(server, publisher, clock, || self.is_over(&stop))?;
        Ok(if is_lost { LOST } else { DONE })
    }

    /// Two recordings side by side, by one clock.
    fn pair(&self, asked: [&Setup; 2]) -> Result<u8> {
        let stop = stop_soon_on_signal()?;
        let Some(first) = Ready::read(asked[0], &stop)? else { return Ok(DONE) };
        let Some(second) = Ready::read(asked[1], &stop)? else { return Ok(DONE) };
        // One colour is one reading in both.
        let is_same = first.quantity() == second.quantity();
        let extremes = Extremes::of_both([&first, &second].map(Ready::extremes), is_same);
        let scenes = [first.scene(extremes[0]), second.scene(extremes[1])];
        let [(server, publisher), (beside, published_beside)] = Server::start_pair(&self.listen, scenes)?;
        let _handed_over = self.announce(&server);
        let mut clocks = Clock::new(2, asked[0].playback_speed.unwrap_or(1.0), false).into_iter();
        let (Some(clock), Some(clock_beside)) = (clocks.next(), clocks.next()) else { return Ok(LOST) };
        // Where one fails, both end.
        let failed = AtomicBool::new(false);
        let play = |ready: Ready, server, publisher, clock| {
            let is_over = || failed.load(Ordering::Relaxed) || self.is_over(&stop);
            let played = ready.play(server, publisher, clock, is_over);
            failed.store(true, Ordering::Relaxed);
            played
        };
        let (first_lost, second_lost) = std::thread::scope(|threads| {
            let other = threads.spawn(|| play(second, beside, published_beside, clock_beside));
            let first_lost = play(first, server, publisher, clock);
            (first_lost, other.join())
        });
        let second_lost = second_lost.map_err(|_| Error::failed("the second recording's thread has failed"))?;
        Ok(if first_lost? | second_lost? { LOST } else { DONE })
    }

    fn is_over(&self, stop: &AtomicBool) -> bool {
        stop.load(Ordering::Relaxed) || self.until.is_some_and(|until| Instant::now() >= until)
    }
}
