//! What the transports between computers cost: live topics of ROS 2, and a limb over Zenoh. Each is read by another process; each is
//! compared with a bare loop of `sendto` of the same bytes, in turns.
//!
//!     cargo bench --features ros2,zenoh --bench transports
//!
//! A skin of 1,000 taxels in 80 fields at 250 Hz, every taxel pressed and changing in every frame. Two costs of a frame: the time that
//! the engine's thread takes to hand it over, and the processor time that all other threads of the process take (on Linux): those that
//! send it, or that read the bare loop.

// The skins of `somatic bench`.

use std::net::UdpSocket;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use somatic::internal::robot::messages::{Header, Marker, MarkerArray, Message as _, PointCloud2, PointField};
use somatic::internal::sink::LimbSends;
use somatic::robot::Ros2Source;
use somatic::sink::{FieldNames, InputFrames, Ros2Sink, Session, Sink, ZenohSink};
use somatic::source::{LimbOptions, LimbSource, Source as _};
use somatic::{BackendKind, Body, Engine, Frame, Options, RawValue, Scene, touch};

use somatic::internal::shape::Shape;

const TAXELS: usize = 1000;
const FIELDS: usize = 80;
const PERIOD: Duration = Duration::from_millis(4);
/// Frames before the first that counts, in which both sides find each other; and those that count.
const WARM_FRAMES: usize = 750;
const FRAMES: usize = 1250;
const ROUNDS: usize = 3;
const NAMESPACE: &str = "/bench";
const KEY: &str = "bench/limb";
/// Says to a process of this program what it is to read.
const READER: &str = "SOMATIC_BENCH_READER";

/// What is measured.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Ros2,
    Zenoh,
    /// As many bytes as the messages of either have, one datagram each.
    Bare(&'static str),
}

fn main() {
    let body = body();
    if let Ok(what) = std::env::var(READER) {
        return read(&what, &body);
    }
    // `cargo bench -- NAME` is for other benches.
    if std::env::args().skip(1).any(|argument| argument != "--bench") {
        return;
    }
    println!(
        "{TAXELS} taxels, {FIELDS} fields, {} Hz; a frame, in µs: p50 and p99 of handing over, mean of all other threads",
        250
    );
    let mut ratios = [("ros2", Vec::new()), ("zenoh", Vec::new())];
    for _ in 0..ROUNDS {
        for (way, (name, ratios)) in [Way::Ros2, Way::Zenoh].into_iter().zip(&mut ratios) {
            let [sent, bare] = [way, Way::Bare(name)].map(|way| run(&body, way));
            println!("  {name:<6} {}\n  sendto {}", sent.shown(), bare.shown());
            ratios.push([
                at(&sent.handing_us, 50) / at(&bare.handing_us, 50),
                sent.sending_us / at(&bare.handing_us, 50),
            ]);
        }
    }
    for (name, ratios) in ratios {
        let median = |which: usize| at(&ratios.iter().map(|ratio| ratio[which]).collect::<Vec<_>>(), 50);
        println!(
            "  {name}: handing over takes {:.2} of a bare sendto of the same bytes, sending {:.2} times (medians of {ROUNDS})",
            median(0),
            median(1)
        );
    }
}

fn body() -> Body {
    Shape { sensors: TAXELS, fields: FIELDS, members: 16, wide: 0, local: true, frames: 1, seed: 1 }.body()
}

/// Reads what the other process sends, until it is killed.
fn read(what: &str, body: &Body) {
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let mut frame = Frame::missing(0.0, ids.len());
    if what == "ros2" {
        let topic = format!("{NAMESPACE}/somatic/taxels/{}", body.links[0].name);
        let mut source = Ros2Source::open(&topic, Some(PointCloud2::TYPE), body).expect("a network");
        while source.next_frame(&mut frame).expect("clouds of this body") {}
    } else {
        let mut source = LimbSource::open(&[KEY.to_owned()], &ids, &LimbOptions::default()).expect("a network");
        while source.next_frame(&mut frame).expect("frames of this body") {}
    }
}

/// A reader in another process.
struct Reader(Child);

impl Reader {
    fn spawn(what: &str) -> Self {
        let program = std::env::current_exe().expect("this program");
        Self(Command::new(program).env(READER, what).spawn().expect("it starts again"))
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[derive(Default)]
struct Took {
    bytes: usize,
    handing_us: Vec<f64>,
    /// Processor time of all other threads, a frame.
    sending_us: f64,
}

impl Took {
    fn shown(&self) -> String {
        let bytes = if self.bytes > 0 { format!(" ({} bytes)", self.bytes) } else { String::new() };
        format!(
            "handing over {:7.1} {:7.1}, other threads {:7.1}{bytes}",
            at(&self.handing_us, 50),
            at(&self.handing_us, 99),
            self.sending_us
        )
    }
}

fn run(body: &Body, way: Way) -> Took {
    let scene = Scene::default().touches(touch::Options::default());
    let mut engine =
        Engine::new(body, Options::default().scene(scene).backend(BackendKind::Cpu)).expect("the CPU is here");
    let taxels: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let session = Session {
        names: FieldNames::all_of(engine.plan()),
        taxels: &taxels,
        body: Some(body),
        plan: Some(engine.plan()),
        ..Session::default()
    };
    let _reader = match way {
        Way::Ros2 => Some(Reader::spawn("ros2")),
        Way::Zenoh => Some(Reader::spawn("zenoh")),
        Way::Bare(_) => None,
    };
    let mut sink: Option<Box<dyn Sink + Send>> = match way {
        Way::Ros2 => Some(Box::new(Ros2Sink::start(NAMESPACE, &session).expect("a network"))),
        Way::Zenoh => Some(Box::new(ZenohSink::open(KEY, LimbSends::Frames, &session).expect("a network"))),
        Way::Bare(_) => None,
    };
    let mut frame = engine.frame(0.0);
    let mut socket = None;
    let mut took = Took::default();
    let (start, mut others) = (Instant::now(), Duration::ZERO);
    for number in 0..WARM_FRAMES + FRAMES {
        std::thread::sleep((PERIOD * number as u32).saturating_sub(start.elapsed()));
        press(&mut frame, number);
        engine.process(std::slice::from_ref(&frame)).expect("a frame is a frame");
        if number == WARM_FRAMES {
            others = time_of_other_threads();
        }
        let begin = Instant::now();
        if let Some(sink) = &mut sink {
            let input = InputFrames {
                frames: std::slice::from_ref(&frame),
                pressures: &|frame, to| engine.pressures(frame, to),
                sensed: &|frame, taxels, to| engine.sensed_alone(frame, taxels, to),
                plan: engine.plan(),
                values_read: engine.values_read(),
                values_noted: engine.values_noted(),
                values_sensed: engine.values_sensed(),
                arrived: None,
                call: Duration::ZERO,
            };
            let _ = sink.write_input(&input).expect("it goes on");
            let _ = sink.write(engine.percepts()).expect("it goes on");
        }
        if let Way::Bare(of) = way {
            let touches = engine.percepts().touches(0).map_or(0, |found| found.touches.len());
            socket.get_or_insert_with(|| Bare::new(body, of, touches)).send();
        }
        if number >= WARM_FRAMES {
            took.handing_us.push(begin.elapsed().as_secs_f64() * 1e6);
        }
    }
    took.bytes = socket.map_or(0, |socket| socket.messages.iter().map(Vec::len).sum());
    took.sending_us = (time_of_other_threads() - others).as_secs_f64() * 1e6 / FRAMES as f64;
    if let Some(sink) = sink {
        sink.finish().expect("it ends");
    }
    took
}

/// A bare loop of `sendto`, to a socket of this computer for which a thread waits: as a transport has to, it wakes somebody.
struct Bare {
    messages: Vec<Vec<u8>>,
    from: UdpSocket,
}

impl Bare {
    fn new(body: &Body, of: &str, touches: usize) -> Self {
        let bind = || UdpSocket::bind("127.0.0.1:0").expect("a free port");
        let (from, to) = (bind(), bind());
        from.connect(to.local_addr().expect("it is bound")).expect("loopback is there");
        std::thread::spawn(move || {
            let mut bytes = vec![0; 1 << 16];
            while to.recv(&mut bytes).is_ok() {}
        });
        let messages = if of == "zenoh" { vec![vec![1; 16 + 4 * TAXELS]] } else { ros2_messages(body, touches) };
        Self { messages, from }
    }

    fn send(&self) {
        for part in self.messages.iter().flat_map(|message| message.chunks(60_000)) {
            self.from.send(part).expect("loopback takes it");
        }
    }
}

fn ros2_messages(body: &Body, touches: usize) -> Vec<Vec<u8>> {
    let header = |frame_id: &str| Header { frame_id: frame_id.to_owned(), ..Header::default() };
    let field = |name: &str| PointField { name: name.to_owned(), ..PointField::default() };
    let cloud = |link: usize| PointCloud2 {
        header: header(&body.links[link].name),
        fields: ["x", "y", "z", "pressure"].map(field).to_vec(),
        data: vec![1; 16 * body.taxels.iter().filter(|taxel| taxel.link == link).count()],
        ..PointCloud2::default()
    };
    let marker = Marker { header: header("link"), ns: "touches".to_owned(), ..Marker::default() };
    let markers = MarkerArray { markers: vec![marker; touches] }.to_cdr();
    (0..body.links.len()).map(|link| cloud(link).to_cdr()).chain([markers]).collect()
}

/// The processor time of this process but for the calling thread, as far as the system tells it.
fn time_of_other_threads() -> Duration {
    let on_processor_ns =
        |path: &str| -> Option<u64> { std::fs::read_to_string(path).ok()?.split_whitespace().next()?.parse().ok() };
    let own = std::fs::read_link("/proc/thread-self").ok();
    let own = own.and_then(|own| own.file_name().map(|name| name.to_string_lossy().into_owned()));
    let threads = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let others = threads.map(|thread| thread.file_name().to_string_lossy().into_owned());
    let others = others.filter(|thread| Some(thread) != own.as_ref());
    Duration::from_nanos(
        others.filter_map(|thread| on_processor_ns(&format!("/proc/self/task/{thread}/schedstat"))).sum(),
    )
}

fn press(frame: &mut Frame, number: usize) {
    frame.t_s = number as f64 * PERIOD.as_secs_f64();
    for (index, value) in frame.values.iter_mut().enumerate() {
        // Some ten ridges that wander over the skin: a touch each.
        *value = RawValue::new(((index + number * 7) % 100 + 1) as f64);
    }
}

fn at(values: &[f64], percent: usize) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() * percent / 100]
}
