//! Live boards: `somatic run` and the library's source on real pseudo-terminals, which `somatic board` plays.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdout, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use somatic::internal::source::BoardAccount;
use somatic::source::{Lines, SerialOptions, SerialSource, Source as _};
use somatic::{Frame, RawValue};

use super::{somatic, stderr, text_of};

/// Channels of each board of [`recording`].
const CHANNELS: usize = 16;

/// A running `somatic board --json`, each board with a link in a folder of its own.
pub struct Boards {
    child: Child,
    reported: BufReader<ChildStdout>,
    pub ports: Vec<String>,
    folder: tempfile::TempDir,
}

impl Boards {
    pub fn start(arguments: &[&str]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        Self::start_in(folder, arguments)
    }

    fn start_in(folder: tempfile::TempDir, arguments: &[&str]) -> Self {
        let link = folder.path().join("line");
        let mut all = vec!["board", "--json", "--link", text_of(&link)];
        all.extend(arguments);
        let mut child = somatic(&all).stdout(Stdio::piped()).spawn().unwrap();
        let mut reported = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        reported.read_line(&mut line).unwrap();
        let playing: Value = serde_json::from_str(&line).unwrap();
        let port = |board: &Value| board["link"].as_str().unwrap().to_owned();
        let ports = playing["playing"].as_array().unwrap().iter().map(port).collect();
        Self { child, reported, ports, folder }
    }

    /// Frames that each board sent, when it has ended.
    pub fn end(mut self) -> Vec<u64> {
        let mut line = String::new();
        self.reported.read_line(&mut line).unwrap();
        assert!(self.child.wait().unwrap().success());
        let sent: Value = serde_json::from_str(&line).unwrap();
        sent["sent"].as_array().unwrap().iter().map(|board| board["frames"].as_u64().unwrap()).collect()
    }

    fn has_ended(&mut self) -> bool {
        self.child.try_wait().unwrap().is_some()
    }
}

impl Drop for Boards {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// What a channel of a board reads in a row: from channel 0's value follows the row, and from that all others'.
fn value(row: usize, taxel: usize) -> u16 {
    ((row * 13 + taxel * 101) % 1024) as u16
}

/// A recording at 50 Hz of `boards` times 16 taxels, 1024 rows long: no more rows could be distinguished.
fn recording(folder: &Path, boards: usize) -> String {
    let taxels = boards * CHANNELS;
    let mut text = String::from("t");
    (0..taxels).for_each(|taxel| text += &format!(",{taxel}"));
    for row in 0..1024 {
        text += &format!("\n{}", row as f64 / 50.0);
        (0..taxels).for_each(|taxel| text += &format!(",{}", value(row, taxel)));
    }
    let path = folder.join("rows.csv");
    std::fs::write(&path, text + "\n").unwrap();
    format!("csv:{}", path.display())
}

/// What was seen of the boards.
#[derive(Default)]
struct Seen {
    /// Boards' parts of frames that held all their values, and that had none because the board was silent.
    whole: u64,
    stale: u64,
    frames: u64,
    latest_s: f64,
}

impl Seen {
    /// Every value in `frame` must be what its board sent in one row, or absent with all others of its board.
    fn check(&mut self, frame: &Frame) {
        self.frames += 1;
        assert!(frame.t_s > self.latest_s, "time goes on");
        self.latest_s = frame.t_s;
        for (board, values) in frame.values.chunks(CHANNELS).enumerate() {
            let Some(first) = values[0].number() else {
                assert!(values.iter().all(|value| *value == values[0]), "{values:?}");
                self.stale += u64::from(values[0] == RawValue::STALE);
                continue;
            };
            // 13 · 709 = 1 modulo 1024.
            let from_start = (first as usize + 1024 * 101 - (board * CHANNELS * 101) % 1024) % 1024;
            let row = from_start * 709 % 1024;
            for (channel, read) in values.iter().enumerate() {
                let sent = f64::from(value(row, board * CHANNELS + channel));
                assert_eq!(read.number(), Some(sent), "board {} channel {channel} in row {row}", board + 1);
            }
            self.whole += 1;
        }
    }
}

fn open(boards: &Boards) -> (SerialSource, Lines) {
    let ports: Vec<(String, Option<u32>)> = boards.ports.iter().map(|port| (port.clone(), Some(57_600))).collect();
    let ids: Vec<u32> = (0..(ports.len() * CHANNELS) as u32).collect();
    let source = SerialSource::open(&ports, &ids, &SerialOptions::default()).unwrap();
    let lines = source.lines();
    (source, lines)
}

/// Takes frames until the boards have ended and nothing is on its way; `at_each` may hold that up.
fn listen(source: &mut SerialSource, boards: &mut Boards, mut at_each: impl FnMut(u64)) -> Seen {
    let (mut seen, mut ended) = (Seen::default(), None);
    let mut frame = Frame::missing(0.0, source.taxels().len());
    while ended.is_none_or(|at: Instant| at.elapsed() < Duration::from_millis(500)) {
        assert!(source.next_frame(&mut frame).unwrap());
        seen.check(&frame);
        at_each(seen.frames);
        if ended.is_none() && boards.has_ended() {
            ended = Some(Instant::now());
        }
    }
    seen
}

/// Sent is delivered and lost, board by board, by the boards' own count.
fn balances(accounts: &[BoardAccount], sent: &[u64]) {
    assert_eq!(accounts.len(), sent.len());
    for (account, sent) in accounts.iter().zip(sent) {
        assert_eq!(account.delivered + account.lost, *sent, "{account:?}");
    }
}

#[test]
fn sixteen_boards_on_bad_lines_balance_and_nothing_is_another_than_was_sent() {
    let folder = tempfile::tempdir().unwrap();
    let rows = recording(folder.path(), 16);
    let faults = "noise=1e-4,drop=1e-4,flip=1e-5,drift=80ppm,silence=1.3s@2s,unplug=0.5s@5s";
    let arguments = ["--boards", "16", "--source", &rows, "--wait", "--frames", "300", "--faults", faults];
    let mut boards = Boards::start(&arguments);
    let (mut source, lines) = open(&boards);
    let seen = listen(&mut source, &mut boards, |_| ());
    let accounts = lines.accounts();
    let notices: Vec<String> = lines.notices().into_iter().map(|notice| notice.text).collect();
    balances(&accounts, &boards.end());
    assert!(seen.whole > 16 * 150 && seen.stale > 16, "{} {}", seen.whole, seen.stale);
    // Half a second of 50 frames a second is gone with the plug, and more with the noise.
    assert!(accounts.iter().all(|account| account.lost >= 10 && account.dropped == 0 && account.unplugs >= 1));
    assert!(accounts.iter().map(|account| account.corrupt).sum::<u64>() > 0);
    assert_eq!(lines.losses().len(), 16);
    for (board, port) in (1..=16).zip(accounts.iter().map(|account| account.port.as_deref().unwrap())) {
        for what in ["sends no frames", "sends frames again", "is back"] {
            assert!(notices.contains(&format!("{port}: board {board} {what}")), "{board} {what}: {notices:#?}");
        }
    }
}

#[test]
fn a_taker_that_is_slow_loses_the_oldest_and_learns_how_many() {
    let folder = tempfile::tempdir().unwrap();
    let rows = recording(folder.path(), 1);
    let mut boards = Boards::start(&["--source", &rows, "--wait", "--frames", "250"]);
    let (mut source, lines) = open(&boards);
    let seen = listen(&mut source, &mut boards, |frames| {
        if frames == 20 {
            std::thread::sleep(Duration::from_secs(3));
        }
    });
    let account = &lines.accounts()[0];
    balances(&lines.accounts(), &boards.end());
    // In 3 s come 150 frames; 64 of them wait.
    assert!((50..150).contains(&account.dropped) && account.lost == 0, "{account:?}");
    assert!(seen.whole + account.dropped >= account.delivered && seen.frames > 100);
    assert!(lines.losses()[0].contains("came faster than they were read"), "{:?}", lines.losses());
}

#[test]
fn a_run_says_what_became_of_a_board_that_starts_again() {
    let boards = Boards::start(&["--wait", "--for", "5s", "--faults", "reset@1.5s,drop=3e-4"]);
    let folder = tempfile::tempdir().unwrap();
    let (sink, summary) = (folder.path().join("p.ndjson"), folder.path().join("s.json"));
    let source = format!("serial:{}", boards.ports[0]);
    let sink_of = format!("ndjson:{}", sink.display());
    let arguments = ["run", "--backend", "cpu", "--source", &source, "--sink", &sink_of, "--all-fields"];
    let output =
        somatic(&[&arguments[..], &["--for", "4s", "--summary", text_of(&summary)]].concat()).output().unwrap();
    let said = stderr(&output);
    assert!(said.contains("board 1 has started again"), "{said}");
    assert!(said.contains("sent,") && said.contains("from the last byte read to the percept written: p50"), "{said}");
    let summary: Value = serde_json::from_str(&std::fs::read_to_string(summary).unwrap()).unwrap();
    let (board, latency) = (&summary["boards"][0], &summary["latency"]);
    let number = |of: &Value, key: &str| of[key].as_u64().unwrap_or_else(|| panic!("{key}: {summary}"));
    assert_eq!(number(board, "sent"), number(board, "delivered") + number(board, "lost"));
    assert_eq!(number(board, "restarts"), 1);
    assert_eq!(output.status.code(), Some(if number(board, "lost") > 0 { 3 } else { 0 }), "{said}");
    assert!(number(latency, "frames") > 100 && number(latency, "p50_us") <= number(latency, "worst_us"));
    let lines = std::fs::read_to_string(sink).unwrap();
    assert!(lines.lines().count() as u64 >= number(latency, "frames"));
}

#[test]
fn what_happens_again_and_again_is_reported_once_and_counted() {
    let boards = Boards::start(&["--wait", "--for", "6s", "--faults", "reset/0.1s,unplug=0.3s@2s"]);
    let folder = tempfile::tempdir().unwrap();
    let summary = folder.path().join("s.json");
    let source = format!("serial:{}", boards.ports[0]);
    let arguments = ["run", "--backend", "cpu", "--sink", "-", "--for", "4s", "--summary", text_of(&summary)];
    let output = somatic(&[&arguments[..], &["--source", &source]].concat()).output().unwrap();
    let reported = stderr(&output);
    let again: Vec<&str> = reported.lines().filter(|line| line.contains("board 1 has started again")).collect();
    let [first, last] = again[..] else { panic!("{reported}") };
    let times: u64 = last.split(": ").last().unwrap().trim_end_matches(" times in all").parse().unwrap();
    let at_s: f64 = first.split_whitespace().nth(1).unwrap().parse().unwrap();
    assert!(times > 10 && (0.0..4.5).contains(&at_s), "{reported}");
    // It was unplugged, and is not any more.
    let summary: Value = serde_json::from_str(&std::fs::read_to_string(summary).unwrap()).unwrap();
    let (state, unplugs) = (&summary["boards"][0]["state"], &summary["boards"][0]["unplugs"]);
    assert!(unplugs.as_u64() >= Some(1) && state != "unplugged", "{summary}");
}

/// Times of the frames that `somatic run` makes of two boards that play at 50 Hz and send as `board` says, in two seconds.
fn times(board: &[&str], run: &[&str]) -> Vec<f64> {
    let folder = tempfile::tempdir().unwrap();
    let rows = recording(folder.path(), 2);
    let boards = Boards::start(&[&["--boards", "2", "--source", &rows, "--wait", "--for", "20s"], board].concat());
    let sources: Vec<String> = boards.ports.iter().map(|port| format!("serial:{port}")).collect();
    let body = concat!(env!("CARGO_MANIFEST_DIR"), "/bodies/mat.glb");
    let ids: Vec<String> = (1..=2)
        .map(|id| {
            format!("[[board]]\nid = {id}\ntaxels = [{{ channel = 0, first = {}, count = 16 }}]\n", (id - 1) * 16)
        })
        .collect();
    let wiring = boards.folder.path().join("wiring.toml");
    std::fs::write(&wiring, ids.concat()).unwrap();
    let first = ["run", "--body", body, "--backend", "cpu", "--outputs", "total", "--sink", "-", "--for", "3s"];
    let lines = ["--wiring", text_of(&wiring), "--source", &sources[0], "--source", &sources[1]];
    let output = somatic(&[&first[..], &lines, run].concat()).output().unwrap();
    assert!(matches!(output.status.code(), Some(0 | 3)), "{}", stderr(&output));
    let time = |line: &str| serde_json::from_str::<Value>(line).unwrap()["t"].as_f64().unwrap();
    String::from_utf8(output.stdout).unwrap().lines().map(time).collect()
}

/// The median time from a frame to the next, s.
fn usual_step_s(times: &[f64]) -> f64 {
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    steps[steps.len() / 2]
}

#[test]
fn frames_come_as_often_as_is_asked_of_boards_and_of_their_merger() {
    // Boards that get the command to send ten frames a second do; frames are put together twenty times a second where asked for.
    for (board, run, period_s) in [
        (&[][..], &["--board-rate", "10"][..], 0.1),
        (&["--partial"], &["--board-rate", "10"], 0.1),
        (&[], &["--live-rate", "20"], 0.05),
        (&["--partial"], &["--board-rate", "25", "--live-rate", "5"], 0.2),
    ] {
        let times = times(board, run);
        let step = usual_step_s(&times);
        assert!(times.len() > 4 && (step / period_s - 1.0).abs() < 0.2, "{board:?} {run:?}: {step} s: {times:?}");
    }
}

#[test]
fn fields_of_a_silent_board_are_stale() {
    let boards = Boards::start(&["--wait", "--for", "4s", "--faults", "silence=9s@1.5s"]);
    let source = format!("serial:{}", boards.ports[0]);
    let folder = tempfile::tempdir().unwrap();
    let recording = format!("mcap:{}", folder.path().join("live.mcap").display());
    let arguments = ["run", "--backend", "cpu", "--source", &source, "--sink", "-", "--all-fields", "--for", "3s"];
    let output = somatic(&[&arguments[..], &["--sink", &recording]].concat()).output().unwrap();
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    // What was recorded of it says the same, flags and all.
    let replayed =
        somatic(&["run", "--backend", "cpu", "--source", &recording, "--sink", "-", "--all-fields"]).output();
    assert!(replayed.unwrap().stdout == output.stdout);
    let last: Value = serde_json::from_str(text.lines().last().unwrap()).unwrap();
    for field in last["fields"].as_array().unwrap() {
        let flags: Vec<&str> = field["flags"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
        assert!(["no_contact", "incomplete", "stale"].iter().all(|flag| flags.contains(flag)), "{field}");
    }
    let first: Value = serde_json::from_str(text.lines().nth(20).unwrap()).unwrap();
    assert!(!first["fields"].to_string().contains("stale"), "{first}");
}

/// What `somatic run` says, and its exit code, of lines that must be named within two seconds.
fn named(sources: &[&str], more: &[&str]) -> (String, Option<i32>) {
    let mut arguments = vec!["run", "--backend", "cpu", "--sink", "-", "--for", "3s"];
    sources.iter().for_each(|source| arguments.extend(["--source", source]));
    arguments.extend(more);
    let mut child = somatic(&arguments).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let start = Instant::now();
    let mut line = String::new();
    let mut reported = BufReader::new(child.stderr.take().unwrap());
    reported.read_line(&mut line).unwrap();
    // Less than two seconds from when the line is open, which a unit test adds up; a busy machine may take longer than that
    // to start a program.
    assert!(start.elapsed() < Duration::from_secs(8), "{line}");
    (line, child.wait().unwrap().code())
}

#[test]
fn what_is_wrong_with_a_line_is_named() {
    let fast = Boards::start(&["--baud", "115200", "--wait", "--for", "30s"]);
    let port = &fast.ports[0];
    let (line, code) = named(&[&format!("serial:{port}@57600")], &[]);
    assert!(line.contains("sends at 115200 baud, not 57600; write serial:") && code == Some(1), "{line}");
    let (line, code) = named(&[&format!("serial:{port}")], &[]);
    assert!(line.contains("sends at 115200 baud; used instead of 57600") && code == Some(0), "{line}");

    let other = Boards::start(&["--board", "7", "--for", "30s"]);
    let (line, code) = named(&[&format!("serial:{}", other.ports[0])], &[]);
    assert!(line.contains("board 7 is on this line, and the wiring has board 1") && code == Some(1), "{line}");

    // The wiring of the paper's hand has the same taxels on other channels.
    let plain = Boards::start(&["--for", "30s"]);
    let port = &plain.ports[0];
    let wiring = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/wirings/hand.toml");
    let (line, code) = named(&[&format!("serial:{port}")], &["--wiring", wiring]);
    assert!(line.contains("it has 40 channels, and the wiring 64") && code == Some(1), "{line}");
    let swapped = plain.folder.path().join("swapped.toml");
    let ids: Vec<String> = (0..64)
        .rev()
        .filter(|c| !(9..16).contains(c) && !(27..32).contains(c) && *c < 52)
        .map(|c| c.to_string())
        .collect();
    std::fs::write(&swapped, format!("[[board]]\nid = 1\ntaxels = [{{ channel = 0, ids = [{}] }}]\n", ids.join(",")))
        .unwrap();
    let (line, code) = named(&[&format!("serial:{port}")], &["--wiring", text_of(&swapped)]);
    assert!(line.contains("another layout") && code == Some(1), "{line}");

    let (line, code) = named(&["serial:/no/such/port"], &[]);
    assert!(line.contains("no such port") && code == Some(1), "{line}");
    // Where another line is fine, it goes on.
    let (line, code) =
        named(&[&format!("serial:{port}"), "serial:/no/such/port"], &["--wiring", text_of(&both(&plain))]);
    assert!(line.contains("no such port") && code == Some(0), "{line}");
}

/// A wiring in which the plain board is one of two.
fn both(boards: &Boards) -> std::path::PathBuf {
    let path = boards.folder.path().join("both.toml");
    let runs = "{ channel = 0, first = 0, count = 9 }, { channel = 9, first = 16, count = 11 }, { channel = 20, first = 32, count = 20 }";
    std::fs::write(&path, format!("[[board]]\nid = 1\ntaxels = [{runs}]\n")).unwrap();
    path
}

#[test]
fn another_device_and_nobody_are_distinguished() {
    let (mut device, end) = serialport::TTYPort::pair().unwrap();
    let name = serialport::SerialPort::name(&end).unwrap();
    drop(end);
    let (stop, stopped) = std::sync::mpsc::channel::<()>();
    let talker = std::thread::spawn(move || {
        while stopped.recv_timeout(Duration::from_millis(20)).is_err() {
            let _ = device.write_all(b"$GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47\r\n\0");
        }
    });
    let (line, code) = named(&[&format!("serial:{name}")], &[]);
    stop.send(()).unwrap();
    talker.join().unwrap();
    assert!(line.contains("another device?") && code == Some(1), "{line}");

    let (_silent, end) = serialport::TTYPort::pair().unwrap();
    let name = serialport::SerialPort::name(&end).unwrap();
    drop(end);
    let (line, code) = named(&[&format!("serial:{name}")], &[]);
    // A run in which no board has ever answered has failed.
    assert!(line.contains("nothing answers") && line.contains("powered") && code == Some(1), "{line}");
    let folder = tempfile::tempdir().unwrap();
    let percepts = folder.path().join("percepts.ndjson");
    let sink = format!("ndjson:{}", percepts.display());
    let run = ["run", "--source", &format!("serial:{name}"), "--for", "1s", "--sink", &sink];
    let reported = stderr(&somatic(&run).output().unwrap());
    assert!(!percepts.exists(), "an empty file would be in the way of the next run");
    let last = reported.lines().last().unwrap_or_default();
    assert!(last.contains("no board has answered") && !reported.contains("no packets from"), "{reported}");
}

/// Resident memory of this process, kB.
fn resident_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap_or("0");
    line.trim().trim_end_matches(" kB").trim().parse().unwrap_or(0)
}

#[test]
#[ignore = "takes SOMATIC_SOAK_SECONDS, 600 unless set"]
fn soak() {
    let seconds: u64 = std::env::var("SOMATIC_SOAK_SECONDS").map_or(600, |text| text.parse().unwrap());
    let folder = tempfile::tempdir().unwrap();
    let rows = recording(folder.path(), 16);
    let frames = (seconds * 50).to_string();
    let faults = "noise=1e-4,drop=1e-4,flip=1e-5,drift=-100ppm,silence=2s/47s,unplug=1.5s/61s";
    let arguments = ["--boards", "16", "--source", &rows, "--wait", "--frames", &frames, "--faults", faults];
    let mut boards = Boards::start(&arguments);
    let (mut source, lines) = open(&boards);
    let (start, mut next, mut resident) = (Instant::now(), 10, Vec::new());
    let seen = listen(&mut source, &mut boards, |_| {
        if start.elapsed().as_secs() >= next {
            next += 10;
            resident.push(resident_kb());
            let _ = lines.notices();
        }
    });
    let accounts = lines.accounts();
    balances(&accounts, &boards.end());
    let sum = |of: fn(&BoardAccount) -> u64| accounts.iter().map(of).sum::<u64>();
    let drifts: Vec<f64> = accounts.iter().filter_map(|account| account.drift).map(|drift| drift * 1e6).collect();
    eprintln!(
        "{seconds} s: {} delivered + {} lost, {} corrupt, {} dropped, {} replaced; {} frames, {} parts whole, {} stale; \
         drift {drifts:.1?} ppm; resident {resident:?} kB",
        sum(|account| account.delivered),
        sum(|account| account.lost),
        sum(|account| account.corrupt),
        sum(|account| account.dropped),
        sum(|account| account.replaced),
        seen.frames,
        seen.whole,
        seen.stale,
    );
    // After the first minute memory does not grow; the allocator may keep 2 MB more or less.
    if let (Some(early), Some(late)) = (resident.get(6), resident.last()) {
        assert!(*late <= early + 2048, "{resident:?}");
    }
}
