//! What viewers of the page cost the engine that they watch: time of a call, memory, bytes on the line.
//!
//!     cargo bench --bench viewers                # calls with two viewers and without, in turns; what a frame takes
//!     cargo bench --bench viewers -- stopped     # a viewer that stops for a minute (Linux)
//!     cargo bench --bench viewers -- memory      # ten minutes (Linux)
//!
//! A skin of 7,560 taxels in 600 fields at 250 Hz, every taxel pressed and changing in every frame. The viewers are
//! processes of their own that read everything, plot two outputs, show all columns, and draw nothing.

// The skins of `somatic bench`.

use std::io::Write as _;
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use somatic::internal::page::{Mode, PageInfo, PageInput, PageScene, Publisher};
use somatic::page::{Listen, Server};
use somatic::{BackendKind, Body, Engine, Frame, Options, RawValue, Scene};
use tungstenite::http::Request;
use tungstenite::{Message, WebSocket};

use somatic::internal::shape::Shape;

const TAXELS: usize = 7560;
const FIELDS: usize = 600;
const MEMBERS: usize = 16;
const PERIOD: Duration = Duration::from_millis(4);
const PAIRS: usize = 5;
/// Frames before the first that counts.
const WARM_FRAMES: usize = 250;
const TURN: Duration = Duration::from_secs(12);

fn main() {
    // Cargo passes `--bench`.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["viewer", port, token] => view(port, token),
        [] => cost(),
        ["stopped"] => stopped(),
        ["memory"] => memory(),
        // `cargo bench -- NAME` is for other benches.
        _ => {}
    }
}

/// Calls with two viewers and with none, in turns.
fn cost() {
    let body = skin();
    let mut ratios = Vec::new();
    println!(
        "{TAXELS} taxels, {FIELDS} fields, 250 Hz; p50 and p99 of the engine's call and of handing a frame over, µs"
    );
    for pair in 0..PAIRS {
        let alone = Run::start(&body, 0).during(TURN, |_| ());
        let watched = Run::start(&body, 2).during(TURN, |_| ());
        println!(
            "  {}: alone {} and {}; watched by two {} and {}",
            pair + 1,
            percentiles(&alone.calls_us),
            percentiles(&alone.hand_over_us),
            percentiles(&watched.calls_us),
            percentiles(&watched.hand_over_us)
        );
        ratios.push((p99(&watched.calls_us) / p99(&alone.calls_us), p99(&watched.calls_us) - p99(&alone.calls_us)));
        if pair + 1 == PAIRS {
            watched.viewers.iter().for_each(|line| println!("  {line}"));
        }
    }
    ratios.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (ratio, more_us) = ratios[PAIRS / 2];
    println!("  median of {PAIRS} pairs: {ratio:.2} times, {more_us:+.1} µs");
}

/// One of two viewers stops for a minute, and goes on.
fn stopped() {
    let body = skin();
    let run = Run::start(&body, 2);
    let id = run.viewers[0].id();
    let signal = |name: &str| assert!(Command::new("kill").args([name, &id.to_string()]).status().unwrap().success());
    let (stop, go_on) = (Duration::from_secs(15), Duration::from_secs(75));
    let (mut state, mut marks, mut newest) = (0, Vec::new(), 0);
    let ended = run.during(Duration::from_secs(90), |at| {
        if state == 0 && at.elapsed > stop {
            signal("-STOP");
            (state, marks) = (1, vec![(at.frame, resident_kb())]);
        } else if state == 1 && at.elapsed > go_on {
            signal("-CONT");
            state = 2;
            newest = at.frame + WARM_FRAMES;
            marks.push((at.frame, resident_kb()));
        }
    });
    let [(from, kb), (to, kb_after)] = marks[..] else { panic!("it stopped and went on") };
    println!(
        "A viewer stops for 60 s. p99 of the engine's call, µs: before {:.1}, meanwhile {:.1}", //
        p99(&ended.calls_us[..from]),
        p99(&ended.calls_us[from..to])
    );
    println!("  resident memory: {:+} kB", kb_after as i64 - kb as i64);
    println!("  the newest frame as it went on was {newest}");
    ended.viewers.iter().for_each(|line| println!("  {line}"));
}

/// Ten minutes with two viewers.
fn memory() {
    let (mut minute, mut first_kb) = (0, 0);
    let ended = Run::start(&skin(), 2).during(Duration::from_secs(602), |at| {
        if at.elapsed.as_secs() / 60 > minute {
            minute = at.elapsed.as_secs() / 60;
            let kb = resident_kb();
            first_kb = if minute == 1 { kb } else { first_kb };
            println!("  minute {minute}: {kb} kB resident, {:+} kB", kb as i64 - first_kb as i64);
        }
    });
    println!("  p99 of the engine's call: {:.1} µs", p99(&ended.calls_us));
    ended.viewers.iter().for_each(|line| println!("  {line}"));
}

fn skin() -> Body {
    let (wide, frames, seed) = (0, 1, 1);
    Shape { sensors: TAXELS, fields: FIELDS, members: MEMBERS, wide, local: true, frames, seed }.body()
}

/// An engine with a page, and the processes that watch it.
struct Run {
    engine: Engine,
    publisher: Publisher,
    server: Server,
    viewers: Vec<Child>,
}

/// Where a run is.
struct At {
    /// Of the frames that count.
    frame: usize,
    elapsed: Duration,
}

/// What a run took, by frame; and what each viewer says at the end.
struct Ended {
    calls_us: Vec<f64>,
    hand_over_us: Vec<f64>,
    viewers: Vec<String>,
}

impl Run {
    fn start(body: &Body, viewers: usize) -> Self {
        let options = Options::default().scene(Scene::default()).backend(BackendKind::Cpu);
        let engine = Engine::new(body, options).expect("the CPU is here");
        let taxels: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let info = PageInfo {
            source: "bench",
            mode: Mode::Live,
            backend: ["cpu", "", ""],
            taxels: &taxels,
            wiring: None,
            recorded_max: None,
            recorded_senses: Default::default(),
        };
        let listen = Listen::new(Some("127.0.0.1:0"), &[]).expect("an address");
        let scene = PageScene::new(body, engine.plan(), &info);
        let (server, publisher) = Server::start(&listen, scene).expect("a free port");
        let url = server.url();
        let token = url.split_once("#token=").expect("the address has the token").1;
        let own = std::env::current_exe().expect("this program");
        let viewer = |_| {
            let port = server.address().port().to_string();
            Command::new(&own).args(["viewer", &port, token]).stdout(Stdio::piped()).spawn().expect("this program runs")
        };
        let viewers = (0..viewers).map(viewer).collect();
        Self { engine, publisher, server, viewers }
    }

    /// Frames at their pace; `step` sees where the run is.
    fn during(mut self, time: Duration, mut step: impl FnMut(&At)) -> Ended {
        while self.server.viewers() < self.viewers.len() {
            std::thread::sleep(PERIOD);
        }
        let mut frame = self.engine.frame(0.0);
        let (mut calls_us, mut hand_over_us) = (Vec::new(), Vec::new());
        let start = Instant::now();
        for number in 0.. {
            let due = PERIOD * number as u32;
            if due > time {
                break;
            }
            std::thread::sleep(due.saturating_sub(start.elapsed()));
            press(&mut frame, number);
            let begin = Instant::now();
            let percepts = self.engine.process(std::slice::from_ref(&frame)).expect("a frame is a frame");
            let call = begin.elapsed();
            // `Publisher::read` wants the plan, which the percepts borrow from the engine.
            let percepts = percepts.clone();
            let begin = Instant::now();
            self.publisher.read(&PageInput {
                frame: &frame,
                values_read: self.engine.values_read(),
                values_noted: self.engine.values_noted(),
                values_sensed: self.engine.values_sensed(),
                plan: self.engine.plan(),
                arrived: None,
                call_us: call.as_secs_f32() * 1e6,
                number: None,
            });
            self.publisher.publish(&percepts);
            if number >= WARM_FRAMES {
                calls_us.push(call.as_secs_f64() * 1e6);
                hand_over_us.push(begin.elapsed().as_secs_f64() * 1e6);
                step(&At { frame: number - WARM_FRAMES, elapsed: start.elapsed() });
            }
        }
        drop((self.publisher, self.server));
        let said = |viewer: Child| {
            let output = viewer.wait_with_output().expect("a viewer ends with the server");
            String::from_utf8_lossy(&output.stdout).trim().to_owned()
        };
        Ended { calls_us, hand_over_us, viewers: self.viewers.into_iter().map(said).collect() }
    }
}

fn press(frame: &mut Frame, number: usize) {
    frame.t_s = number as f64 * PERIOD.as_secs_f64();
    for (index, value) in frame.values.iter_mut().enumerate() {
        *value = RawValue::new(((index * 7 + number * 131) % 977 + 1) as f64);
    }
}

fn percentiles(times_us: &[f64]) -> String {
    let mut sorted = times_us.to_vec();
    sorted.sort_by(f64::total_cmp);
    format!("{:6.1} {:6.1}", sorted[sorted.len() / 2], p99(&sorted))
}

fn p99(times_us: &[f64]) -> f64 {
    let mut sorted = times_us.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() * 99 / 100]
}

/// Resident memory of this process, kB.
fn resident_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
    let line = status.lines().find(|line| line.starts_with("VmRSS:")).expect("Linux");
    line.split_whitespace().nth(1).and_then(|kb| kb.parse().ok()).expect("a number")
}

/// A viewer: reads until the server ends, and says what came.
fn view(port: &str, token: &str) {
    let host = format!("127.0.0.1:{port}");
    let request = Request::builder()
        .uri(format!("ws://{host}/socket"))
        .header("Host", &host)
        .header("Origin", format!("http://{host}"))
        .header("Connection", "Upgrade")
        .header("Upgrade", "websocket")
        .header("Sec-WebSocket-Version", "13")
        .header("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ==");
    let stream = TcpStream::connect(&host).expect("the server listens");
    let (mut socket, _) = tungstenite::client(request.body(()).expect("a request"), stream).expect("it lets us in");
    let say = |socket: &mut WebSocket<TcpStream>, message: Value| socket.send(Message::text(message.to_string()));
    let hello = json!({"type": "hello", "version": 5, "token": token, "after_event": null});
    say(&mut socket, hello).expect("the server reads");
    let (mut frames, mut bytes, mut last_read, mut after_pause) = (0_u64, 0, Instant::now(), Vec::new());
    while let Ok(message) = socket.read() {
        let paused = last_read.elapsed() > Duration::from_secs(30);
        last_read = Instant::now();
        let frame = match message {
            Message::Binary(frame) if frame[0] == 2 => frame,
            Message::Text(text) if text.contains("\"type\":\"welcome\"") => {
                let welcome: Value = serde_json::from_str(&text).expect("JSON");
                let columns: Vec<&Value> =
                    welcome["columns"].as_array().expect("columns").iter().map(|column| &column["name"]).collect();
                let series = json!([{"field": 0, "column": "total", "component": 0},
                                    {"field": 300, "column": "centroid", "component": 1}]);
                let asked = say(&mut socket, json!({"type": "columns", "columns": columns}))
                    .and_then(|()| say(&mut socket, json!({"type": "series", "series": series})));
                if asked.is_err() {
                    break;
                }
                continue;
            }
            _ => continue,
        };
        frames += 1;
        bytes += frame.len() as u64;
        if paused || (!after_pause.is_empty() && after_pause.len() < 5) {
            after_pause.push(u64::from_le_bytes(frame[8..16].try_into().expect("eight bytes")));
        }
        let seq = u32::from_le_bytes(frame[4..8].try_into().expect("four bytes"));
        if say(&mut socket, json!({"type": "drawn", "seq": seq})).is_err() {
            break;
        }
    }
    let mut line = format!("a viewer got {frames} frames of {} bytes", bytes / frames.max(1));
    if !after_pause.is_empty() {
        line += &format!("; after its pause those of number {after_pause:?}");
    }
    // The reader has gone only if it has failed, which it says itself.
    let _ = writeln!(std::io::stdout(), "{line}");
}
