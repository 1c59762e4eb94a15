//! Lines of text, live: real pseudo-terminals and sockets, and what `somatic run` makes of what comes over them.

use std::fs::File;
use std::io::{BufRead as _, BufReader, ErrorKind, Read as _, Write as _};
use std::net::{TcpListener, UdpSocket};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use serde_json::Value;

use super::{frames, somatic, stderr, text_of};

/// A pseudo-terminal: this end of it, and the name of the other one.
pub fn pty() -> (File, String) {
    let end = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    // No program that is started holds it open.
    rustix::io::fcntl_setfd(&end, rustix::io::FdFlags::CLOEXEC).unwrap();
    grantpt(&end).unwrap();
    unlockpt(&end).unwrap();
    let name = ptsname(&end, Vec::new()).unwrap().into_string().unwrap();
    // After one open and close it reports a hang-up while nobody has it open.
    drop(File::open(&name).unwrap());
    (File::from(end), name)
}

/// Whether somebody has the other end open.
fn is_open(end: &File) -> bool {
    let mut ask = [PollFd::new(end, PollFlags::IN)];
    poll(&mut ask, Some(&Timespec { tv_sec: 0, tv_nsec: 0 })).is_ok() && !ask[0].revents().contains(PollFlags::HUP)
}

/// Waits until somebody has opened the other end and set it up.
fn wait_until_open(end: &File) {
    while !is_open(end) {
        thread::sleep(Duration::from_millis(5));
    }
    thread::sleep(Duration::from_millis(100));
}

/// A board on a pseudo-terminal that sends `line(n)` again and again, once somebody listens, until it is dropped.
pub struct Board {
    pub name: String,
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<u64>>,
}

impl Board {
    pub fn start(every: Duration, line: impl Fn(u64) -> Vec<u8> + Send + 'static) -> Self {
        let (mut device, name) = pty();
        // Or it would wait for a reader that has ended, and whoever stops it with it.
        rustix::io::ioctl_fionbio(&device, true).unwrap();
        let (stop, stopped) = channel::<()>();
        let thread = thread::spawn(move || {
            let is_stopped = |wait: Duration| stopped.recv_timeout(wait) != Err(RecvTimeoutError::Timeout);
            while !is_open(&device) {
                if is_stopped(Duration::from_millis(5)) {
                    return 0;
                }
            }
            let start = Instant::now() + Duration::from_millis(100);
            let mut sent = 0;
            loop {
                let due = start + every * u32::try_from(sent).unwrap();
                if is_stopped(due.saturating_duration_since(Instant::now())) {
                    return sent;
                }
                let (bytes, mut written) = (line(sent), 0);
                while written < bytes.len() {
                    match device.write(&bytes[written..]) {
                        Ok(more) => written += more,
                        Err(e) if e.kind() == ErrorKind::WouldBlock && !is_stopped(Duration::from_millis(1)) => {}
                        Err(_) => return sent,
                    }
                }
                sent += 1;
            }
        });
        Self { name, stop: Some(stop), thread: Some(thread) }
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.stop.take();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// What `somatic run` makes of `input` on standard input as lines of text.
fn fed(input: &str, more: &[&str]) -> Output {
    let first = ["run", "--backend", "cpu", "--source", "text:-", "--sink", "-", "--outputs", "total", "--all-fields"];
    let mut child = somatic(&[&first[..], more].concat())
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // It may end before it has read all.
    let _ = child.stdin.take().unwrap().write_all(input.as_bytes());
    child.wait_with_output().unwrap()
}

/// Times and totals of all frames of `output`.
fn totals(output: &Output) -> Vec<(f64, f64)> {
    let total = |frame: &Value| frame["fields"][0]["total"].as_f64().unwrap_or(0.0);
    frames(&String::from_utf8_lossy(&output.stdout))
        .iter()
        .map(|frame| (frame["t"].as_f64().unwrap(), total(frame)))
        .collect()
}

#[test]
fn a_board_that_prints_numbers_is_read_with_one_line() {
    let board = Board::start(Duration::from_millis(10), |sent| match sent {
        0 => b"2,300,7\r\n".to_vec(),
        1 => b"Ready. Version 1.2\r\n".to_vec(),
        60 => b"512,30\r\n".to_vec(),
        sent => format!("300,{},7\r\n", sent % 500).into_bytes(),
    });
    let source = format!("text:{}@115200", board.name);
    let output =
        somatic(&["run", "--backend", "cpu", "--source", &source, "--sink", "-", "--for", "1s", "--outputs", "total"])
            .output()
            .unwrap();
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("columns 1–3 are a row of 3 sensors, time is the time of arrival"), "{said}");
    assert!(said.contains("1 line skipped, too few values: `512,30`"), "{said}");
    assert!(said.contains("a body is made: a row of 3 sensors, 10 mm apart"), "{said}");
    let totals = totals(&output);
    assert!(totals.len() > 100, "{} frames: {said}", totals.len());
    assert!(totals.windows(2).all(|pair| pair[1].0 > pair[0].0), "time goes on");
    // Every value was sent, one after the other but for the lines that were not numbers.
    let steps: Vec<f64> = totals.windows(2).map(|pair| pair[1].1 - pair[0].1).collect();
    assert!(steps.iter().all(|step| *step == 1.0 || *step == 2.0 || *step == -499.0), "{steps:?}");
}

#[test]
fn lines_are_read_however_they_are_written() {
    let rows = |line: &dyn Fn(usize) -> String| (0..20).map(|row| line(row) + "\n").collect::<String>();
    let cases: [(&str, String, &str, (f64, f64)); 11] = [
        (
            "commas",
            rows(&|row| format!("{row},1,{}", 100 - row % 3)),
            "columns 2 and 3 are a row of 2 sensors",
            (0.0, 101.0),
        ),
        ("semicolons", rows(&|row| format!("{},5;{};", row % 2, row % 3)), "columns 1 and 2 are", (0.0, 0.5)),
        ("tabs", rows(&|row| format!("{}\t2\t3", row % 3)), "columns 1–3 are", (0.0, 5.0)),
        ("spaces", rows(&|row| format!("{}   2  3", row % 3)), "columns 1–3 are", (0.0, 5.0)),
        ("a word first", rows(&|row| format!("DATA {} 2 3", row % 3)), "columns 2–4 are", (0.0, 5.0)),
        ("pairs", rows(&|row| format!("A0: {}\tA1: 7", row % 3)), "`A0`, `A1` are a row of 2 sensors", (0.0, 7.0)),
        ("a pair a line", rows(&|row| format!("s{}: {}", row % 4, row % 4)), "`s0`, `s1`, `s2`, `s3` are", (0.0, 6.0)),
        (
            "JSON",
            rows(&|row| format!(r#"{{"ms":{},"p":[1,{},null]}}"#, 20 * row, row % 3)),
            "`p[0]`, `p[1]`, `p[2]` are a row of 3 sensors, `ms` is time in ms",
            (0.0, 1.0),
        ),
        (
            "a header",
            format!("time_ms,a,b\n{}", rows(&|row| format!("{},{},3", 500 + 20 * row, row % 3))),
            "`a`, `b` are a row of 2 sensors, `time_ms` is time in ms",
            (0.5, 3.0),
        ),
        (
            "a grid on a line",
            rows(&|row| format!("{},{}", 20 * row, ["1"; 16].join(","))),
            "columns 2–17 are a 4 × 4 grid, column 1 is time in ms",
            (0.0, 16.0),
        ),
        (
            "rows",
            rows(&|row| format!("1,2,3\n4,5,{}\n", row % 3)),
            "columns 1–3 of 2 lines are a 2 × 3 grid, a blank line is between two frames",
            (0.0, 15.0),
        ),
    ];
    for (name, input, understood, (t_s, total)) in cases {
        let output = fed(&input, &[]);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(0), "{name}: {said}");
        assert!(said.contains(understood), "{name}: {said}");
        let found = totals(&output);
        let wanted = if name == "a pair a line" { 5 } else { 20 };
        assert_eq!(found.len(), wanted, "{name}: {said}");
        assert_eq!(found[0].1, total, "{name}: {found:?}");
        if said.contains("is time in") {
            assert_eq!(found[0].0, t_s, "{name}");
            assert!((found[1].0 - found[0].0 - 0.02).abs() < 1e-9, "{name}: {found:?}");
        }
    }
}

#[test]
fn flags_say_what_is_not_found_out() {
    let rows: String = (0..12).map(|row| format!("{},{},{},{}\n", 10 * row, row % 3, 7, 9)).collect();
    let output = fed(&rows, &["--columns", "2,4", "--time", "1:us", "--ids", "5,3", "--pitch", "5mm"]);
    let said = stderr(&output);
    assert!(said.contains("columns 2, 4 are a row of 2 sensors, column 1 is time in µs"), "{said}");
    assert!(said.contains("5 mm apart"), "{said}");
    assert_eq!(totals(&output)[1], (1e-5, 10.0));
    // Sixteen rows of a mat that prints a line of signs between frames.
    let frame = (0..4).map(|row| format!("{row} {row} 1 1\n")).collect::<String>() + "== end ==\n";
    let output = fed(&frame.repeat(6), &["--grid", "4x4", "--frame-end", "=="]);
    assert_eq!((totals(&output).len(), output.status.code()), (6, Some(0)), "{}", stderr(&output));
    let output = fed(&rows, &["--time", "arrival", "--columns", "1-4", "--grid", "2x2"]);
    assert!(
        stderr(&output).contains("columns 1–4 are a 2 × 2 grid, time is the time of arrival"),
        "{}",
        stderr(&output)
    );
    let output = fed(&rows, &["--time", "arrival", "--rate", "50"]);
    assert_eq!(totals(&output)[2].0, 0.04);
    for (flags, code, why) in [
        (&["--columns", "2-9"][..], 2, "there is no column `2-9`; lines have 4 columns"),
        (&["--columns", "no"], 2, "no column `no`"),
        (&["--grid", "5x5"], 1, "--grid 5x5 needs lines of 5 or 25 values, and most have 3"),
        (&["--ids", "1,2"], 2, "--ids names 2 taxels, and a frame has 3 sensors"),
        (&["--ids", "x"], 2, "is not a list of taxels"),
        (&["--time", "9"], 2, "there is no column `9`"),
        (&["--frame-end", "zzz"], 1, "no line ends a frame"),
        (&["--unit", "kPa"], 2, "--unit is for recordings"),
        (&["--rate", "50"], 2, "lines have their own times"),
        (&["--body", "hand"], 1, "a message has 3 values, and the body"),
    ] {
        let output = fed(&rows, flags);
        let said = stderr(&output);
        assert!(said.contains(why) && output.status.code() == Some(code), "{flags:?}: {said}");
        assert!(output.stdout.is_empty(), "{flags:?}");
    }
    let said = super::fails(2, &["run", "--source", "touch.csv", "--frame-end", "x"]);
    assert!(said.contains("--frame-end is for lines of text"), "{said}");
}

#[test]
fn lines_that_are_not_frames_are_counted_by_kind_and_what_holds_none_is_an_error() {
    let mut input: String = (0..30).map(|row| format!("{},2,3\n", row % 5)).collect();
    input += "1,2\n1,2\nhello world\n1,2,3,4\n1,x,3\n1,2,nan\n1,,3\n5,2,3\n";
    let output = fed(&input, &[]);
    let said = stderr(&output);
    assert_eq!((totals(&output).len(), output.status.code()), (33, Some(3)), "{said}");
    for what in [
        "2 lines skipped, too few values; the first one was `1,2`",
        "1 line skipped, too many values: `1,2,3,4`",
        "1 line skipped, a word in the place of a number: `1,x,3`",
        "1 line skipped, words where numbers belong, as boards send when they start: `hello world`",
    ] {
        assert!(said.contains(what), "{what}: {said}");
    }
    for (input, why) in [
        ("", "the input has ended without a line"),
        ("hello\nworld\n", "no line holds numbers, such as `512,300,7`; the first one is `hello`"),
        ("\u{1}\u{2}\u{3}\u{4}\n", "no line holds numbers"),
    ] {
        let output = fed(input, &[]);
        assert!(stderr(&output).contains(why) && output.status.code() == Some(1), "{}", stderr(&output));
        assert_eq!(stderr(&output).lines().count(), 1);
    }
}

/// A run over a network, which is waited for until its percepts come.
fn over_network(source: &str) -> Child {
    somatic(&["run", "--backend", "cpu", "--source", source, "--sink", "-", "--outputs", "total", "--for", "3s"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn said_by(mut child: Child) -> (String, String) {
    let (mut out, mut err) = (String::new(), String::new());
    child.stdout.take().unwrap().read_to_string(&mut out).unwrap();
    child.stderr.take().unwrap().read_to_string(&mut err).unwrap();
    assert!(matches!(child.wait().unwrap().code(), Some(0 | 3)), "{err}");
    (out, err)
}

#[test]
fn connections_and_datagrams_are_read_and_a_connection_is_made_again() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let server = thread::spawn(move || {
        for (connection, lines) in [(1, 180), (2, 1000)] {
            let (mut stream, _) = listener.accept().unwrap();
            for line in 0..lines {
                if stream.write_all(format!("{connection} {} 7\n", line % 10).as_bytes()).is_err() {
                    return;
                }
                thread::sleep(Duration::from_millis(10));
            }
        }
    });
    let (out, said) = said_by(over_network(&format!("text:tcp://{address}")));
    assert!(said.contains("columns 1–3 are a row of 3 sensors"), "{said}");
    assert!(said.contains("gone; waiting for it to come back") && said.contains("is back"), "{said}");
    assert!(out.contains("\"total\":9") && out.lines().count() > 100, "{said}");
    server.join().unwrap();

    let port = UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let run = over_network(&format!("text:udp://127.0.0.1:{port}"));
    let sender = UdpSocket::bind("127.0.0.1:0").unwrap();
    let (stop, stopped) = channel::<()>();
    let talker = thread::spawn(move || {
        // Two frames a datagram; the second one's line has no end, and is whole.
        while stopped.recv_timeout(Duration::from_millis(10)) == Err(RecvTimeoutError::Timeout) {
            let _ = sender.send_to(b"a=1 b=2\na=3 b=4", format!("127.0.0.1:{port}"));
        }
    });
    let (out, said) = said_by(run);
    drop(stop);
    talker.join().unwrap();
    assert!(said.contains("`a`, `b` are a row of 2 sensors") && !said.contains("skipped"), "{said}");
    assert!(out.contains("\"total\":3") && out.contains("\"total\":7"), "{out}");
    let taken = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let said = super::fails(1, &["run", "--source", &format!("text:tcp://{taken}")]);
    assert!(said.contains("nothing answers there"), "{said}");
}

/// A run that prints the totals of what `source` sends, with `more` flags.
fn totals_of(source: &str, more: &[&str]) -> Command {
    let mut run = somatic(&["run", "--backend", "cpu", "--source", source, "--sink", "-", "--outputs", "total"]);
    run.args(more).stdout(Stdio::piped());
    run
}

#[test]
fn a_board_that_is_unplugged_is_waited_for_and_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("board");
    let line = |_| b"1 2 4\n".to_vec();
    let first = Board::start(Duration::from_millis(10), line);
    std::os::unix::fs::symlink(&first.name, &link).unwrap();
    let source = format!("text:{}", text_of(&link));
    let mut child = totals_of(&source, &["--for", "5s", "--all-fields"]).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    for _ in 0..150 {
        lines.next().unwrap().unwrap();
    }
    std::fs::remove_file(&link).unwrap();
    drop(first);
    let stale = lines.by_ref().map(Result::unwrap).find(|line| line.contains("stale"));
    assert!(stale.is_some_and(|line| !line.contains("total")), "while it is gone nothing is known");
    let second = Board::start(Duration::from_millis(10), line);
    std::os::unix::fs::symlink(&second.name, &link).unwrap();
    let back = lines.by_ref().map(Result::unwrap).find(|line| line.contains("\"total\":7"));
    assert!(back.is_some(), "it goes on");
    drop(lines);
    let output = child.wait_with_output().unwrap();
    let said = stderr(&output);
    assert!(said.contains("gone; waiting for it to come back") && said.contains("is back"), "{said}");
    drop(second);
}

#[test]
fn text_where_packets_belong_is_named() {
    let board = Board::start(Duration::from_millis(10), |_| b"512,300,7\r\n".to_vec());
    let output = somatic(&["run", "--source", &format!("serial:{}", board.name), "--for", "20s"]).output().unwrap();
    let wanted = format!("this board sends text, such as `512,300,7`: use text:{}@57600", board.name);
    assert!(stderr(&output).contains(&wanted) && output.status.code() == Some(1), "{}", stderr(&output));
    let said = super::fails(1, &["run", "--source", "text:/dev/nowhere"]);
    assert!(said.contains("there is no such port"), "{said}");
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
    let said = super::fails(1, &["run", "--source", &format!("text:{}", file.display())]);
    assert!(said.contains("this is a file, not a port"), "{said}");
}

/// From the last byte of a line to the percept, of a board with 64 values at 1 kHz: figures of `docs/evidence/performance.md`. It needs a
/// machine that does nothing else: `tests/long/text`.
#[test]
#[ignore = "takes SOMATIC_SOAK_SECONDS, 600 unless set, on a machine at rest"]
fn latency_at_a_thousand_frames_a_second() {
    const MOST: [Duration; 2] = [Duration::from_micros(300), Duration::from_millis(3)];
    let seconds: u64 = std::env::var("SOMATIC_SOAK_SECONDS").map_or(600, |text| text.parse().unwrap());
    let (mut device, name) = pty();
    let source = format!("text:{name}");
    let mut child = totals_of(&source, &["--columns", "2-65"]).stderr(Stdio::piped()).spawn().unwrap();
    let out = BufReader::new(child.stdout.take().unwrap());
    let heard = thread::spawn(move || {
        out.lines().map_while(Result::ok).map(|line| (Instant::now(), line)).collect::<Vec<(Instant, String)>>()
    });
    wait_until_open(&device);
    let start = Instant::now();
    let mut sent = Vec::new();
    for index in 0..(seconds + 3) * 1000 {
        let due = Duration::from_millis(index);
        thread::sleep(due.saturating_sub(start.elapsed()));
        // The total says which line it was.
        let mut line = format!("x,{index}");
        (0..63).for_each(|value| line += &format!(",{}", 100 + value));
        device.write_all((line + "\n").as_bytes()).unwrap();
        sent.push(Instant::now());
    }
    thread::sleep(Duration::from_millis(500));
    // Not unplugged: interrupted, so that it says what it has skipped.
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let ended = child.wait_with_output().unwrap();
    drop(device);
    assert!(ended.status.success(), "{}", stderr(&ended));
    let heard = heard.join().unwrap();
    let rest: f64 = (0..63).map(|value| f64::from(100 + value)).sum();
    let index_of = |line: &str| -> usize {
        let frame: Value = serde_json::from_str(line).unwrap();
        (frame["fields"][0]["total"].as_f64().unwrap_or_else(|| panic!("{line}")) - rest).round() as usize
    };
    let indices: Vec<usize> = heard.iter().map(|(_, line)| index_of(line)).collect();
    // The first line may be the end of a longer one, and is left out.
    let all: Vec<usize> = (1..sent.len()).collect();
    let lost = all.len() - indices.len();
    // Lines of the first second wait until it is known how they are written.
    let timed = heard.iter().zip(&indices).filter(|(_, index)| **index > 3000);
    let mut took: Vec<Duration> = timed.map(|((at, _), &index)| at.saturating_duration_since(sent[index])).collect();
    took.sort_unstable();
    let quantile = |share: f64| took[((took.len() - 1) as f64 * share) as usize];
    let [p50, p99, worst] = [0.5, 0.99, 1.0].map(quantile);
    println!("{} frames, {lost} lost, p50 {p50:?}, p99 {p99:?}, worst {worst:?}", took.len());
    assert!(indices == all, "{lost} of {} lines are lost", all.len());
    assert!(p50 <= MOST[0] && p99 <= MOST[1], "p50 {p50:?} and p99 {p99:?} are not under {MOST:?}");
}
