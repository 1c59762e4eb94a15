//! `--sink page`: a server that shows its run to the page with the token, and to nobody else.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tungstenite::http::Request;
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::{Message, WebSocket};

use super::{code_of, fails, somatic};

/// The version of the protocol of the page.
const VERSION: u8 = 5;

/// A run with a page.
pub(super) struct Run {
    child: Child,
    port: u16,
    token: String,
}

impl Run {
    /// The bundled touch, over and over.
    fn start(arguments: &[&str]) -> Self {
        Self::spawn(&[&["run", "--quiet", "--loop", "--sink", "page:127.0.0.1:0"], arguments].concat())
    }

    /// A command that serves a page.
    pub(super) fn spawn(arguments: &[&str]) -> Self {
        let mut child = somatic(arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let address = lines.find_map(|line| line.unwrap().strip_prefix("page at http://127.0.0.1:").map(str::to_owned));
        let address = address.expect("it says where the page is");
        let (port, token) = address.split_once("/#token=").unwrap();
        // What it says later is read too, or it would wait to say it.
        let (port, token) = (port.parse().unwrap(), token.to_owned());
        std::thread::spawn(move || lines.for_each(drop));
        Self { child, port, token }
    }

    fn host(&self) -> String {
        format!("127.0.0.1:{}", self.port)
    }

    fn stream(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
        stream
    }

    /// The answer to a request of plain HTTP.
    fn answer(&self, request: &str) -> String {
        let mut stream = self.stream();
        stream.write_all(request.replace("HOST", &self.host()).as_bytes()).unwrap();
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        String::from_utf8_lossy(&answer).into_owned()
    }

    /// A WebSocket of the page, before it has said hello; or the status that refuses it.
    fn socket(&self, host: &str, origin: Option<&str>) -> Result<WebSocket<TcpStream>, u16> {
        let mut request = Request::builder()
            .uri(format!("ws://{}/socket", self.host()))
            .header("Host", host)
            .header("Connection", "Upgrade")
            .header("Upgrade", "websocket")
            .header("Sec-WebSocket-Version", "13")
            .header("Sec-WebSocket-Key", "dGhlIHNhbXBsZSBub25jZQ==");
        if let Some(origin) = origin {
            request = request.header("Origin", origin);
        }
        match tungstenite::client(request.body(()).unwrap(), self.stream()) {
            Ok((socket, _)) => Ok(socket),
            Err(tungstenite::HandshakeError::Failure(tungstenite::Error::Http(answer))) => {
                Err(answer.status().as_u16())
            }
            Err(e) => panic!("{e}"),
        }
    }

    fn own_socket(&self) -> WebSocket<TcpStream> {
        self.socket(&self.host(), Some(&format!("http://{}", self.host()))).unwrap()
    }

    pub(super) fn viewer(&self) -> Viewer {
        let mut socket = self.own_socket();
        say(&mut socket, &json!({"type": "hello", "version": VERSION, "token": self.token, "after_event": null}));
        Viewer { socket, texts: Vec::new() }
    }

    pub(super) fn interrupt(&mut self) -> Option<i32> {
        Command::new("kill").args(["-INT", &self.child.id().to_string()]).status().unwrap();
        code_of(&mut self.child)
    }

    /// Resident memory, kB.
    #[cfg(target_os = "linux")]
    fn resident_kb(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap();
        let line = status.lines().find(|line| line.starts_with("VmRSS:")).unwrap();
        line.split_whitespace().nth(1).unwrap().parse().unwrap()
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub(super) fn say(socket: &mut WebSocket<TcpStream>, message: &Value) {
    socket.send(Message::text(message.to_string())).unwrap();
}

/// Why a socket is closed, by the server.
fn closed(mut socket: WebSocket<TcpStream>) -> u16 {
    loop {
        match socket.read() {
            Ok(Message::Close(Some(frame))) => return frame.code.into(),
            Ok(Message::Text(_) | Message::Binary(_)) => {}
            other => panic!("{other:?}"),
        }
    }
}

/// A client that is let in.
pub(super) struct Viewer {
    pub(super) socket: WebSocket<TcpStream>,
    pub(super) texts: Vec<Value>,
}

impl Viewer {
    /// The next binary message; texts are kept.
    pub(super) fn binary(&mut self) -> Vec<u8> {
        loop {
            match self.socket.read().unwrap() {
                Message::Binary(bytes) => return bytes.to_vec(),
                Message::Text(text) => self.texts.push(serde_json::from_str(&text).unwrap()),
                other => panic!("{other:?}"),
            }
        }
    }

    /// The next frame, said to be drawn.
    pub(super) fn frame(&mut self) -> Vec<u8> {
        let frame = self.binary();
        assert_eq!((frame[0], frame[1]), (2, VERSION));
        say(&mut self.socket, &json!({"type": "drawn", "seq": u32_at(&frame, 4)}));
        frame
    }

    pub(super) fn text(&self, kind: &str) -> Option<&Value> {
        self.texts.iter().find(|text| text["type"] == kind)
    }
}

pub(super) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
}

pub(super) fn f32_at(bytes: &[u8], at: usize) -> f32 {
    f32::from_bits(u32_at(bytes, at))
}

#[test]
fn a_page_gets_the_scene_and_then_every_frame_that_it_draws() {
    let mut run = Run::start(&["--outputs", "total,centroid,position,touches"]);
    let mut viewer = run.viewer();
    let mesh = viewer.binary();
    assert_eq!((mesh[0], mesh[1]), (1, VERSION));
    let [vertices, triangles, taxels, links] = [4, 8, 12, 16].map(|at| u32_at(&mesh, at) as usize);
    assert_eq!(mesh.len(), 20 + 28 * vertices + 12 * triangles + 40 * taxels + 28 * links);
    let welcome = viewer.text("welcome").unwrap().clone();
    assert_eq!((taxels, links), (40, welcome["links"].as_array().unwrap().len()));
    assert_eq!((&welcome["mode"], &welcome["source"]), (&"live".into(), &"bundled touch".into()));
    assert_eq!(welcome["columns"].as_array().unwrap().len(), 3);
    assert!(welcome["touches"] == true && welcome["touch_flags"][0] == "one_taxel", "{welcome}");
    assert_eq!(welcome["colours"].as_array().unwrap().len(), 256);
    say(&mut viewer.socket, &json!({"type": "columns", "columns": ["total"]}));
    say(&mut viewer.socket, &json!({"type": "taxel", "taxel": 4}));
    let series = json!([{"field": 0, "column": "total", "component": 0}]);
    say(&mut viewer.socket, &json!({"type": "series", "series": series}));
    let (mut contacts, mut touches, mut samples, mut last) = (0, 0, 0, 0);
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(6) {
        let frame = viewer.frame();
        assert_eq!(u32_at(&frame, 4), last + 1);
        last += 1;
        contacts += u32_at(&frame, 36);
        touches += u32_at(&frame, 40);
        samples += u32_at(&frame, 44);
        // Six bytes a taxel, and what is in contact and plotted; of a touch its values, taxels, shares and trail.
        let of_touch = 132 + 4 * taxels + 8 * (links + 13) + 20 * 34;
        let most = 72 + 6 * taxels + 60 * u32_at(&frame, 36) as usize + of_touch * u32_at(&frame, 40) as usize;
        assert!(frame.len() <= most + 24 * u32_at(&frame, 44) as usize + 32, "{}", frame.len());
        if last > 20 && contacts > 0 && samples > 0 && viewer.text("events").is_some() {
            assert!(f32_at(&frame, 28) > 0.0 && f32_at(&frame, 32) >= f32_at(&frame, 28));
            break;
        }
    }
    assert!(
        contacts > 0 && touches > 0 && samples > 0,
        "{contacts} contacts, {touches} touches, {samples} samples in {last} frames"
    );
    let events = viewer.text("events").expect("a touch begins and ends")["events"].clone();
    assert!(["onset", "release"].iter().any(|kind| events[0]["kind"] == **kind) && events[0]["seq"] == 1, "{events}");
    assert!(events[0]["touch"].is_u64() && events[0]["link"].is_u64() && events[0]["field"].is_null(), "{events}");
    assert!(viewer.text("taxel").is_some_and(|taxel| taxel["health"] == "good" && taxel["taxel"] == 4));
    assert_eq!(run.interrupt(), Some(0));
    assert_eq!(closed(viewer.socket), u16::from(CloseCode::Away));
}

#[test]
fn a_percept_of_a_live_run_is_explained() {
    let mut run = Run::start(&["--backend", "cpu"]);
    let mut viewer = run.viewer();
    viewer.binary();
    let start = Instant::now();
    let why = loop {
        say(&mut viewer.socket, &json!({"type": "explain", "field": 0}));
        // Each question is of the next frame; while the hand is touched there is something to explain.
        viewer.frame();
        viewer.frame();
        let found = viewer.texts.iter().rev().find(|text| text["type"] == "explain");
        if let Some(why) = found.filter(|why| why["columns"].as_array().is_some_and(|columns| columns.len() > 3)) {
            break why.clone();
        }
        assert!(start.elapsed() < Duration::from_secs(20), "{:?}", viewer.texts);
    };
    assert_eq!((&why["field"], &why["backend"]), (&0.into(), &"cpu".into()));
    let columns = why["columns"].as_array().unwrap();
    assert!(
        columns.iter().all(|column| ["agrees", "too close"].contains(&column["verdict"].as_str().unwrap())),
        "{why}"
    );
    let total = columns.iter().find(|column| column["name"] == "total").unwrap();
    let sum: f64 = why["members"].as_array().unwrap().iter().filter_map(|member| member["pressure"].as_f64()).sum();
    assert_eq!(total["reference"][0].as_f64(), Some(sum), "weights of the hand are 1");
    assert_eq!(run.interrupt(), Some(0));
}

#[test]
fn what_is_not_the_page_is_refused() {
    let run = Run::start(&[]);
    let (host, origin) = (run.host(), format!("http://{}", run.host()));
    assert!(run.socket(&host, Some(&origin)).is_ok());
    let localhost = format!("localhost:{}", run.port);
    assert!(run.socket(&localhost, Some(&format!("http://{localhost}"))).is_ok());
    for (host, origin, status) in [
        ("evil.example", Some("http://evil.example"), 421),
        (&*host, Some("http://evil.example"), 403),
        (&host, Some("null"), 403),
        (&host, None, 403),
        (&host, Some(&*format!("http://{localhost}")), 403),
        (&host, Some(&origin.replace("http", "https")), 403),
    ] {
        assert_eq!(run.socket(host, origin).err(), Some(status), "{host} {origin:?}");
    }
    for (request, status) in [
        ("GET / HTTP/1.1\r\nHost: HOST\r\n\r\n", 200),
        ("HEAD /main.js HTTP/1.1\r\nHost: localhost\r\n\r\n", 200),
        ("GET / HTTP/1.1\r\nHost: evil.example\r\n\r\n", 421),
        ("GET / HTTP/1.1\r\n\r\n", 400),
        ("GET / HTTP/1.1\r\nHost: HOST\r\nHost: HOST\r\n\r\n", 400),
        ("GET /../Cargo.toml HTTP/1.1\r\nHost: HOST\r\n\r\n", 404),
        ("GET /index.html?a HTTP/1.1\r\nHost: HOST\r\n\r\n", 404),
        ("POST / HTTP/1.1\r\nHost: HOST\r\n\r\n", 405),
        ("GET / HTTP/1.1\r\nHost: HOST\r\nContent-Length: 1\r\n\r\nx", 400),
        ("\x16\x03\x01\r\n\r\n", 400),
    ] {
        let answer = run.answer(request);
        assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "{request}: {answer}");
        assert!(answer.contains("default-src 'none'") && answer.contains("nosniff"), "{answer}");
        assert!(!answer.to_lowercase().contains("access-control-allow"), "{answer}");
    }
    let endless = format!("GET / HTTP/1.1\r\nHost: HOST\r\nX: {}", "a".repeat(9000));
    assert!(run.answer(&endless).starts_with("HTTP/1.1 431 "));
    let index = run.answer("GET / HTTP/1.1\r\nHost: HOST\r\n\r\n");
    assert!(index.contains("text/html") && index.contains("<!doctype html>"), "{index}");
    assert!(run.answer("HEAD / HTTP/1.1\r\nHost: HOST\r\n\r\n").ends_with("\r\n\r\n"));
}

#[test]
fn messages_are_the_pages_or_the_connection_ends() {
    let run = Run::start(&[]);
    let hello =
        |token: &str, version: u8| json!({"type": "hello", "version": version, "token": token, "after_event": 0});
    let wrong = format!("{}0", &run.token[..31]);
    let wrong = if wrong == run.token { format!("{}1", &run.token[..31]) } else { wrong };
    for first in
        [hello(&wrong, VERSION), hello("", VERSION), hello(&run.token, VERSION - 1), json!({"type": "play"}), json!(7)]
    {
        let mut socket = run.own_socket();
        say(&mut socket, &first);
        assert_eq!(closed(socket), 1008, "{first}");
    }
    let begin = Instant::now();
    assert_eq!(closed(run.own_socket()), 1008, "no hello");
    let waited = begin.elapsed();
    assert!(waited > Duration::from_millis(1900) && waited < Duration::from_secs(5), "{waited:?}");
    for (message, code) in [
        (Message::text("{\"type\":\"quit\"}"), 1008),
        (Message::text("{\"type\":\"taxel\",\"taxel\":40}"), 1008),
        (Message::text(hello(&run.token, VERSION).to_string()), 1008),
        (Message::text(" ".repeat((64 << 10) + 1)), 1009),
        (Message::binary(vec![0; 4]), 1003),
    ] {
        let mut viewer = run.viewer();
        viewer.binary();
        viewer.socket.send(message.clone()).unwrap();
        assert_eq!(closed(viewer.socket), code, "{}", message.len());
    }
    // What nobody serves in a live run is answered.
    let mut viewer = run.viewer();
    let history = json!({"type": "history", "id": 9, "from_s": 0, "to_s": 1, "bins": 2, "series": []});
    say(&mut viewer.socket, &history);
    while viewer.binary()[0] != 3 {}
    assert_eq!(viewer.text("status").unwrap()["playing"], true);
}

#[test]
fn two_hundred_connections_do_not_stop_the_run() {
    let run = Run::start(&[]);
    let mut viewer = run.viewer();
    viewer.binary();
    viewer.frame();
    let mut idle: Vec<TcpStream> = (0..200).map(|_| run.stream()).collect();
    for _ in 0..20 {
        viewer.frame();
    }
    // Somebody who speaks is served among them.
    assert!(run.answer("GET / HTTP/1.1\r\nHost: HOST\r\n\r\n").starts_with("HTTP/1.1 200 "));
    let begin = Instant::now();
    let mut ended = 0;
    while begin.elapsed() < Duration::from_secs(8) && ended < 150 {
        viewer.frame();
        idle.retain_mut(|stream| {
            stream.set_nonblocking(true).unwrap();
            let still = matches!(stream.read(&mut [0; 8]), Err(e) if e.kind() == std::io::ErrorKind::WouldBlock);
            ended += u32::from(!still);
            still
        });
    }
    assert!(ended >= 150, "{ended} were closed");
    // As many viewers as there may be, and one more.
    drop(idle);
    let mut viewers = vec![viewer];
    while viewers.len() < 16 {
        let mut viewer = run.viewer();
        viewer.binary();
        viewers.push(viewer);
    }
    assert!(run.stream().read(&mut [0; 8]).map_or(true, |count| count == 0), "refused");
    assert!(viewers.iter_mut().all(|viewer| !viewer.frame().is_empty()));
}

#[test]
fn a_viewer_that_never_reads_holds_nobody_up() {
    let run = Run::start(&[]);
    let mut reader = run.viewer();
    reader.binary();
    reader.frame();
    let mut deaf = run.viewer();
    let pace = |reader: &mut Viewer| {
        let begin = Instant::now();
        let numbers: Vec<u32> = (0..100).map(|_| u32_at(&reader.frame(), 8)).collect();
        assert!(numbers.is_sorted());
        begin.elapsed()
    };
    let before = pace(&mut reader);
    #[cfg(target_os = "linux")]
    let memory = run.resident_kb();
    // It says that it has drawn everything, asks for more, and reads nothing.
    deaf.socket.get_mut().set_write_timeout(Some(Duration::from_millis(100))).unwrap();
    let ask = json!({"type": "history", "id": 9, "from_s": 0, "to_s": 1, "bins": 4096,
                     "series": vec![json!({"field": 0, "column": "total", "component": 0}); 16]});
    for seq in 0..2000 {
        let drawn = deaf.socket.send(Message::text(json!({"type": "drawn", "seq": seq}).to_string()));
        if drawn.and_then(|()| deaf.socket.send(Message::text(ask.to_string()))).is_err() {
            break;
        }
    }
    let after = pace(&mut reader);
    assert!(after < 2 * before + Duration::from_millis(500), "{before:?}, then {after:?}");
    #[cfg(target_os = "linux")]
    assert!(run.resident_kb() < memory + (24 << 10), "{memory} kB, then {} kB", run.resident_kb());
}

#[test]
fn a_taxel_that_is_left_out_is_an_event() {
    let rows: String = (0..400).map(|n| format!("{},{},\n", f64::from(n) * 0.01, n % 7)).collect();
    let (_folder, recording) = super::file("a.csv", &format!("t,4,5\n{rows}"));
    let calibration = recording.with_file_name("drift.toml");
    std::fs::write(&calibration, "[drift]\ncadence_s = 0.2\ndead_s = 0.5\n").unwrap();
    let mut run = Run::spawn(&[
        "run",
        "--quiet",
        "--loop",
        "--source",
        &format!("csv:{}", recording.display()),
        "--calibration",
        calibration.to_str().unwrap(),
        "--sink",
        "page:127.0.0.1:0",
    ]);
    let mut viewer = run.viewer();
    viewer.binary();
    let start = Instant::now();
    let is_notice = |text: &Value| {
        let events = text["events"].as_array().into_iter().flatten();
        events.into_iter().any(|event| {
            event["kind"] == "notice" && event["text"].as_str().unwrap().contains("taxel 5 is dead and left out")
        })
    };
    while !viewer.texts.iter().any(is_notice) {
        viewer.frame();
        assert!(start.elapsed() < Duration::from_secs(20), "{:?}", viewer.texts);
    }
    assert_eq!(run.interrupt(), Some(0));
}

#[test]
fn an_address_for_others_needs_a_name() {
    let why = fails(2, &["run", "--sink", "page:0.0.0.0:0"]);
    assert!(why.contains("--allow-host"), "{why}");
    assert!(fails(2, &["run", "--allow-host", "robot.lan"]).contains("--sink page"));
    assert!(fails(2, &["run", "--sink", "page:nowhere"]).contains("HOST:PORT"));
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let sink = format!("page:{}", taken.local_addr().unwrap());
    assert!(fails(1, &["run", "--sink", &sink]).contains("port 0"));
    let run = Run::start(&["--allow-host", "robot.lan"]);
    assert!(run.socket("robot.lan:1", Some("http://robot.lan:1")).is_ok());
    assert_eq!(run.socket("robot.lam:1", Some("http://robot.lam:1")).err(), Some(421));
}

/// A masked frame of a WebSocket, as clients send them; `mask` is zero.
fn client_frame(first: u8, bytes: &[u8]) -> Vec<u8> {
    assert!(bytes.len() < 126);
    [&[first, 0x80 | bytes.len() as u8, 0, 0, 0, 0], bytes].concat()
}

/// Connections that want to keep the server to themselves: with pings, with a message that never ends, with half requests, and by
/// never reading; until `stop`.
fn attack(run: &Run, stop: &Arc<AtomicBool>) -> Vec<JoinHandle<()>> {
    const PING: u8 = 0x89;
    const TEXT_BEGINS: u8 = 0x01;
    const GOES_ON: u8 = 0x00;
    let floods = [
        (Vec::new(), client_frame(PING, b"")),
        (Vec::new(), client_frame(PING, &[b'x'; 100])),
        (Vec::new(), client_frame(PING, b"")),
        (client_frame(TEXT_BEGINS, b"{"), client_frame(GOES_ON, b"")),
    ];
    let mut threads = Vec::new();
    let mut spawn = |attack: Box<dyn FnMut() + Send>| {
        let stop = Arc::clone(stop);
        let mut attack = attack;
        threads.push(std::thread::spawn(move || {
            while !stop.load(Ordering::Relaxed) {
                attack();
            }
        }));
    };
    for (begin, again) in floods {
        let (port, host) = (run.port, run.host());
        spawn(Box::new(move || {
            // As soon as it is shut out it comes again.
            let Ok(mut stream) = TcpStream::connect(("127.0.0.1", port)) else { return };
            stream.set_write_timeout(Some(Duration::from_millis(200))).unwrap();
            let upgrade = format!(
                "GET /socket HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
                 Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
            );
            let many = again.repeat(1000);
            if stream.write_all(upgrade.as_bytes()).and_then(|()| stream.write_all(&begin)).is_ok() {
                // It reads nothing of what answers it.
                while stream.write_all(&many).is_ok() {}
            }
        }));
    }
    let port = run.port;
    spawn(Box::new(move || {
        let Ok(mut stream) = TcpStream::connect(("127.0.0.1", port)) else { return };
        let _ = stream.write_all(b"GET / HTTP/1.1\r\nHo");
        std::thread::sleep(Duration::from_millis(20));
    }));
    threads
}

#[test]
fn a_run_and_a_view_end_on_request_whatever_viewers_do() {
    let view = ["view", "--listen", "127.0.0.1:0", "--backend", "cpu", "--quiet"];
    for (mut run, is_played) in [(Run::start(&[]), false), (Run::spawn(&view), true)] {
        let stop = Arc::new(AtomicBool::new(false));
        let attackers = attack(&run, &stop);
        let deaf = run.viewer();
        std::thread::sleep(Duration::from_millis(500));
        // Who has the token is served by a run meanwhile. A view may have cut it off: whoever floods it takes its connections.
        let begin = Instant::now();
        let viewer = (!is_played).then(|| {
            let mut viewer = run.viewer();
            viewer.binary();
            viewer.frame();
            viewer
        });
        let served = begin.elapsed();
        let begin = Instant::now();
        Command::new("kill").args(["-TERM", &run.child.id().to_string()]).status().unwrap();
        assert_eq!(code_of(&mut run.child), Some(0));
        let ended = begin.elapsed();
        eprintln!("served after {} ms, ended after {} ms", served.as_millis(), ended.as_millis());
        // Half of it on an idle machine.
        assert!(served < Duration::from_secs(5) && ended < Duration::from_secs(2), "{served:?}, {ended:?}");
        stop.store(true, Ordering::Relaxed);
        attackers.into_iter().for_each(|thread| thread.join().unwrap());
        drop((viewer, deaf));
    }
}

#[test]
fn pings_do_not_stand_in_for_a_hello() {
    let run = Run::start(&[]);
    let mut socket = run.own_socket();
    let begin = Instant::now();
    // It is shut out after two seconds, whatever it sends.
    while socket.get_mut().write_all(&client_frame(0x89, b"")).is_ok() {
        assert!(begin.elapsed() < Duration::from_secs(6), "it is still let in");
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(begin.elapsed() > Duration::from_millis(1500), "{:?}", begin.elapsed());
}
