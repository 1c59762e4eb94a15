//! What live topics of ROS 2 cost the engine's thread: handing a frame over, against a bare loop of `sendto` of the same bytes; and
//! the engine's call with the sink and without.
//!
//!     cargo bench --features ros2 --bench ros2
//!
//! A skin of 1,000 taxels in 80 fields at 250 Hz, every taxel pressed and changing in every frame; all in turns, in one run.

// The skins of `somatic bench`.
#[allow(dead_code, unused_imports, reason = "not every test and bench needs all of it")]
#[path = "../src/experiments/shape.rs"]
mod shape;

use std::net::UdpSocket;
use std::time::{Duration, Instant};

use somatic::robot::messages::{Header, Marker, MarkerArray, Message as _, PointCloud2, PointField};
use somatic::sink::{FieldNames, InputFrames, Ros2Sink, Session, Sink as _};
use somatic::{BackendKind, Body, Engine, Frame, Options, RawValue, Scene};

use crate::shape::Shape;

const TAXELS: usize = 1000;
const FIELDS: usize = 80;
const PERIOD: Duration = Duration::from_millis(4);
const TURN: Duration = Duration::from_secs(5);
const PAIRS: usize = 5;
/// Frames before the first that counts.
const WARM_FRAMES: usize = 125;

fn main() {
    // `cargo bench -- NAME` is for other benches.
    if std::env::args().skip(1).any(|argument| argument != "--bench") {
        return;
    }
    let (wide, frames, seed) = (0, 1, 1);
    let body = Shape { sensors: TAXELS, fields: FIELDS, members: 16, wide, local: true, frames, seed }.body();
    println!("{TAXELS} taxels, {FIELDS} fields, 250 Hz; p50 and p99 in µs");
    let mut ratios = Vec::new();
    for pair in 1..=PAIRS {
        let alone = run(&body, false);
        let sent = run(&body, true);
        let socket = bare(&body, sent.touched);
        println!(
            "  {pair}: engine's call alone {}, with the sink {}; handing over {}; bare sendto of {} bytes {}",
            percentiles(&alone.calls_us),
            percentiles(&sent.calls_us),
            percentiles(&sent.hand_over_us),
            socket.bytes,
            percentiles(&socket.took_us)
        );
        ratios.push(at(&sent.hand_over_us, 50) / at(&socket.took_us, 50));
    }
    ratios.sort_by(f64::total_cmp);
    println!(
        "  handing over is {:.2} times a bare sendto of the same bytes: the median of {PAIRS} pairs",
        ratios[PAIRS / 2]
    );
}

struct Took {
    calls_us: Vec<f64>,
    hand_over_us: Vec<f64>,
    touched: usize,
}

fn run(body: &Body, is_sent: bool) -> Took {
    let options = Options::default().scene(Scene::default()).backend(BackendKind::Cpu);
    let mut engine = Engine::new(body, options).expect("the CPU is here");
    let taxels: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let name =
        |(field, link): (&str, &str)| FieldNames { field: field.into(), link: link.into(), ..FieldNames::default() };
    let session = Session {
        names: engine.plan().fields().map(name).collect(),
        taxels: &taxels,
        body: Some(body),
        plan: Some(engine.plan()),
        ..Session::default()
    };
    let mut sink = is_sent.then(|| Box::new(Ros2Sink::start("/bench", &session).expect("a network")));
    let mut frame = engine.frame(0.0);
    let mut took = Took { calls_us: Vec::new(), hand_over_us: Vec::new(), touched: 0 };
    let start = Instant::now();
    for number in 0.. {
        let due = PERIOD * number as u32;
        if due > TURN {
            break;
        }
        std::thread::sleep(due.saturating_sub(start.elapsed()));
        press(&mut frame, number);
        let begin = Instant::now();
        engine.process(std::slice::from_ref(&frame)).expect("a frame is a frame");
        let call = begin.elapsed();
        let begin = Instant::now();
        if let Some(sink) = &mut sink {
            let input = InputFrames {
                frames: std::slice::from_ref(&frame),
                pressures: &|frame, to| engine.pressures(frame, to),
                plan: engine.plan(),
                values_read: engine.values_read(),
                arrived: None,
                call,
            };
            let _ = sink.write_input(&input).expect("it goes on");
            let _ = sink.write(engine.percepts()).expect("it goes on");
        }
        if number >= WARM_FRAMES {
            took.calls_us.push(call.as_secs_f64() * 1e6);
            took.hand_over_us.push(begin.elapsed().as_secs_f64() * 1e6);
        }
        took.touched = engine.percepts().touched(0).count();
    }
    if let Some(sink) = sink {
        sink.finish().expect("it ends");
    }
    took
}

struct Bare {
    bytes: usize,
    took_us: Vec<f64>,
}

/// Sends as many bytes as a frame's messages have, one datagram each, to a socket of this computer.
fn bare(body: &Body, touched: usize) -> Bare {
    let header = |frame_id: &str| Header { frame_id: frame_id.to_owned(), ..Header::default() };
    let field = |name: &str| PointField { name: name.to_owned(), ..PointField::default() };
    let cloud = |link: usize| PointCloud2 {
        header: header(&body.links[link].name),
        fields: ["x", "y", "z", "pressure"].map(field).to_vec(),
        data: vec![1; 16 * body.taxels.iter().filter(|taxel| taxel.link == link).count()],
        ..PointCloud2::default()
    };
    let mut messages: Vec<Vec<u8>> = (0..body.links.len()).map(|link| cloud(link).to_cdr()).collect();
    let marker = Marker { header: header("link"), ns: "field/0000".to_owned(), ..Marker::default() };
    messages.push(MarkerArray { markers: vec![marker; 2 * touched] }.to_cdr());
    let to = UdpSocket::bind("127.0.0.1:0").expect("a free port");
    let from = UdpSocket::bind("127.0.0.1:0").expect("a free port");
    let address = to.local_addr().expect("it is bound");
    let mut took_us = Vec::new();
    let mut bytes = vec![0; 1 << 16];
    to.set_nonblocking(true).expect("a socket");
    let start = Instant::now();
    for number in 0..(TURN.as_millis() / PERIOD.as_millis()) as u32 {
        std::thread::sleep((PERIOD * number).saturating_sub(start.elapsed()));
        let begin = Instant::now();
        for message in &messages {
            for part in message.chunks(60_000) {
                from.send_to(part, address).expect("loopback takes it");
            }
        }
        if number as usize >= WARM_FRAMES {
            took_us.push(begin.elapsed().as_secs_f64() * 1e6);
        }
        while to.recv(&mut bytes).is_ok() {}
    }
    Bare { bytes: messages.iter().map(Vec::len).sum(), took_us }
}

fn press(frame: &mut Frame, number: usize) {
    frame.t_s = number as f64 * PERIOD.as_secs_f64();
    for (index, value) in frame.values.iter_mut().enumerate() {
        *value = RawValue::new(((index * 7 + number * 131) % 977 + 1) as f64);
    }
}

fn percentiles(times_us: &[f64]) -> String {
    format!("{:.1} {:.1}", at(times_us, 50), at(times_us, 99))
}

fn at(times_us: &[f64], percent: usize) -> f64 {
    let mut sorted = times_us.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() * percent / 100]
}
