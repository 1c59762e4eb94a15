//! Boards made of software, heard through real serial ports.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::process::{Child, ChildStdout, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use somatic::internal::wire::{Bits, Command, Corruption, Decoder, Dialogue, Event, Outcome, RetryPolicy, Status};

use crate::{done, fails, somatic};

/// A running `somatic board --json`, and where its boards are.
struct Playing {
    child: Child,
    printed: BufReader<ChildStdout>,
    ports: Vec<(u16, String)>,
}

impl Playing {
    fn start(arguments: &[&str]) -> Self {
        let arguments = [&["board", "--json"], arguments].concat();
        let mut child = somatic(&arguments).stdout(Stdio::piped()).spawn().unwrap();
        let mut printed = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        printed.read_line(&mut line).unwrap();
        let where_: Value = serde_json::from_str(&line).unwrap();
        let boards = where_["playing"].as_array().unwrap().iter();
        let port = |board: &Value| {
            let name = board["link"].as_str().or(board["port"].as_str()).unwrap();
            (board["board"].as_u64().unwrap() as u16, name.to_owned())
        };
        let ports = boards.map(port).collect();
        Self { child, printed, ports }
    }

    /// What each board sent, reported at the end.
    fn end(mut self) -> Vec<Value> {
        let mut line = String::new();
        self.printed.read_line(&mut line).unwrap();
        assert!(self.child.wait().unwrap().success());
        serde_json::from_str::<Value>(&line).unwrap()["sent"].as_array().unwrap().clone()
    }
}

impl Drop for Playing {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn open(port: &str, baud: u32) -> serialport::TTYPort {
    let end = Instant::now() + Duration::from_secs(10);
    loop {
        match serialport::new(port, baud).timeout(Duration::from_millis(20)).open_native() {
            Ok(port) => return port,
            Err(e) if Instant::now() > end => panic!("{port}: {e}"),
            Err(_) => std::thread::sleep(Duration::from_millis(5)),
        }
    }
}

/// Listens until the board says unasked that it has stopped; `false` where the line went before.
fn listen(port: &mut serialport::TTYPort, decoder: &mut Decoder, mut on: impl FnMut(&Event<'_>)) -> bool {
    let (mut buffer, mut over) = ([0; 4096], false);
    let end = Instant::now() + Duration::from_secs(60);
    while !over {
        assert!(Instant::now() < end, "the board does not stop");
        match port.read(&mut buffer) {
            Ok(0) => return false,
            Ok(count) => decoder.push(&buffer[..count], |event| {
                on(&event);
                over |= matches!(event, Event::Identity { identity, .. } if identity.request == 0 && !identity.running);
            }),
            Err(e) if e.kind() == std::io::ErrorKind::TimedOut => {}
            Err(_) => return false,
        }
    }
    true
}

/// Asks until it is answered.
fn ask(port: &mut serialport::TTYPort, decoder: &mut Decoder, command: Command) -> Outcome {
    let mut dialogue = Dialogue::new(somatic::internal::wire::ANY_BOARD, RetryPolicy::default(), 0);
    dialogue.ask(command).unwrap();
    let (start, mut buffer, mut ended) = (Instant::now(), [0; 4096], None);
    loop {
        let now = start.elapsed();
        if let Some(bytes) = dialogue.send(now) {
            port.write_all(bytes).unwrap();
        }
        let count = port.read(&mut buffer).unwrap_or(0);
        decoder.push(&buffer[..count], |event| ended = ended.or(dialogue.receive(&event)));
        if let Some(ended) = ended.or_else(|| dialogue.give_up(start.elapsed())) {
            return ended.outcome;
        }
    }
}

#[test]
fn a_board_says_who_it_is_obeys_and_sends_what_it_plays() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("hand");
    let playing = Playing::start(&["--wait", "--frames", "200", "--link", link.to_str().unwrap()]);
    let mut port = open(&playing.ports[0].1, 57_600);
    let mut decoder = Decoder::new();
    assert_eq!(ask(&mut port, &mut decoder, Command::Identify), Outcome::Done { value: 0 });
    assert_eq!(
        ask(&mut port, &mut decoder, Command::Wiper { channel: 40, wiper: 9 }),
        Outcome::Refused(Status::Bad),
        "there are channels 0 to 39"
    );
    assert_eq!(ask(&mut port, &mut decoder, Command::Wiper { channel: 3, wiper: 9 }), Outcome::Done { value: 9 });
    assert_eq!(ask(&mut port, &mut decoder, Command::Wiper { channel: 3, wiper: 38 }), Outcome::Done { value: 38 });
    assert_eq!(ask(&mut port, &mut decoder, Command::Start), Outcome::Done { value: 0 });
    let rows: Vec<Vec<u16>> = include_str!("../../bodies/touch.csv")
        .lines()
        .skip(1)
        .map(|row| row.split(',').skip(1).map(|value| value.parse().unwrap()).collect())
        .collect();
    let mut came = Vec::new();
    assert!(listen(&mut port, &mut decoder, |event| {
        if let Event::Frame { values, .. } = event {
            assert_eq!((values.bits(), values.len()), (Bits::Ten, 40));
            came.push(values.iter().map(|(_, value)| value).collect::<Vec<u16>>());
        }
    }));
    let sent = playing.end();
    assert_eq!((sent[0]["frames"].as_u64(), sent[0]["commands"].as_u64()), (Some(200), Some(5)));
    let account = decoder.frame_counts().board(1).unwrap();
    assert_eq!((account.intact, account.lost, account.restarts), (200, 0, 0));
    assert_eq!(decoder.counts().corrupt, 0);
    assert!(came.iter().all(|frame| rows.contains(frame)), "a frame is no row of the recording");
    assert!(came.iter().any(|frame| frame.iter().any(|&value| value > 0)));
    assert!(!link.exists() && std::fs::symlink_metadata(&link).is_err(), "the link goes with the board");
}

#[test]
fn a_line_is_as_fast_as_its_baud_and_no_faster() {
    // 40 channels of 10 bits are 13 + 1 + 50 + 4 + 3 bytes, and 1920 baud carry 2.7 of these in a second.
    let playing = Playing::start(&["--wait", "--frames", "6", "--baud", "1920", "--rate", "50"]);
    let mut port = open(&playing.ports[0].1, 1920);
    let mut decoder = Decoder::new();
    ask(&mut port, &mut decoder, Command::Start);
    let begin = Instant::now();
    let mut times_us = Vec::new();
    listen(&mut port, &mut decoder, |event| {
        if let Event::Frame { order, .. } = event {
            times_us.push(order.time_us);
        }
    });
    // Six frames and the identity behind them, less what one step sends at once.
    let bytes = 6.0 * 71.0 + 40.0;
    let least = bytes / 192.0 - 0.1;
    assert!(begin.elapsed().as_secs_f64() >= least, "{:?} for what takes {least} s", begin.elapsed());
    // From frame to frame at least the 0.37 s that the one before takes on the line, less one step of 50 ms.
    let steps = times_us.windows(2).map(|pair| pair[1] - pair[0]);
    assert!(times_us.len() == 6 && steps.min().unwrap() > 300_000, "{times_us:?}");
    playing.end();
}

#[test]
fn another_speed_makes_every_byte_unreadable() {
    let playing = Playing::start(&["--for", "1500ms", "--loop"]);
    let mut port = open(&playing.ports[0].1, 115_200);
    let mut decoder = Decoder::new();
    let mut events = 0;
    let end = Instant::now() + Duration::from_millis(800);
    let mut buffer = [0; 4096];
    while Instant::now() < end {
        let count = port.read(&mut buffer).unwrap_or(0);
        decoder.push(&buffer[..count], |event| {
            let Event::Corrupt { why, .. } = event else { panic!("{event:?}") };
            assert!(!matches!(why, Corruption::Version(_) | Corruption::Kind(_) | Corruption::Contents));
            events += 1;
        });
    }
    assert!(events > 0 && decoder.counts().packets == 0, "{:?}", decoder.counts());
    drop(port);
    assert!(playing.end()[0]["faults"]["garbled_bytes"].as_u64() > Some(0));
}

#[test]
fn the_books_of_sixteen_bad_lines_balance() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("skin");
    let faults = "noise=1e-3,drop=1e-3,flip=1e-4,unplug=0.3s/1.5s";
    let playing = Playing::start(&[
        "--boards",
        "16",
        "--wait",
        "--frames",
        "150",
        "--partial",
        "--link",
        link.to_str().unwrap(),
        "--faults",
        faults,
    ]);
    assert_eq!(playing.ports.len(), 16);
    let lines: Vec<_> = playing
        .ports
        .clone()
        .into_iter()
        .map(|(board, name)| {
            std::thread::spawn(move || {
                let mut decoder = Decoder::new();
                let mut port = open(&name, 57_600);
                // From here on each frame is either heard or counted.
                while decoder.frame_counts().board(board).is_none() {
                    ask(&mut port, &mut decoder, Command::Identify);
                }
                while ask(&mut port, &mut decoder, Command::Start) == Outcome::Unanswered {}
                while !listen(&mut port, &mut decoder, |_| ()) {
                    drop(port);
                    decoder.rejoin();
                    port = open(&name, 57_600);
                }
                let account = *decoder.frame_counts().board(board).unwrap();
                (board, account, decoder.counts().corrupt)
            })
        })
        .collect();
    let heard: Vec<_> = lines.into_iter().map(|line| line.join().unwrap()).collect();
    let sent = playing.end();
    let mut lost = 0;
    for ((board, account, _), sent) in heard.iter().zip(&sent) {
        assert_eq!(sent["board"].as_u64(), Some(u64::from(*board)));
        assert_eq!(sent["frames"].as_u64(), Some(account.intact + account.lost), "{account:?} {sent}");
        assert!(account.lost > 0 && account.restarts == 0, "a third of a second is missing: {account:?}");
        lost += account.lost;
    }
    assert!(heard.iter().any(|(_, _, corrupt)| *corrupt > 0) && lost > 16);
}

#[test]
fn what_makes_no_sense_is_reported_in_a_line() {
    assert!(fails(2, &["board", "--faults", "nois=1"]).contains("did you mean `noise`"));
    assert!(fails(2, &["board", "--bits", "9"]).contains("8, 10, 12 or 16"));
    assert!(fails(2, &["board", "--for", "2 parsecs"]).contains("is not a time"));
    assert!(fails(2, &["board", "--boards", "41"]).contains("40 taxels"));
    assert!(fails(1, &["board", "--wiring", "none.toml"]).contains("none.toml: no such file"));
    let (_folder, path) = crate::file("there", "a file");
    assert!(fails(1, &["board", "--link", path.to_str().unwrap()]).contains("--link another"));
    assert_eq!(std::fs::read_to_string(path).unwrap(), "a file");
    let text = done(&["board", "--frames", "3", "--boards", "2"]);
    assert_eq!(text.lines().count(), 4, "{text}");
    assert!(text.contains("board 2 at /dev/") && text.contains("board 2: 3 frames, "), "{text}");
}

#[test]
fn boards_have_the_taxels_of_the_body_that_is_named() {
    let error = fails(2, &["board", "--body", "mat", "--source", "-"]);
    assert!(error.contains("2048 taxels need at least 8 boards of 256 channels; add --boards 8"), "{error}");
    let error = fails(2, &["board", "--body", "mat"]);
    assert!(error.contains("somatic board --body mat --boards 8 --source sim:FILE.toml"), "{error}");
    // As it says, and each board with its share.
    let mat = concat!("sim:", env!("CARGO_MANIFEST_DIR"), "/examples/simulations/mat.toml");
    let text = done(&["board", "--body", "mat", "--boards", "8", "--source", mat, "--for", "0.2s"]);
    assert_eq!(text.matches(": 256 channels").count(), 8, "{text}");
    // A recording of some of the taxels is played by boards that have all.
    let (_folder, path) = crate::file("few.csv", "t,4,7\n0,1,2\n0.1,2,3\n");
    let channels = |more: &[&str]| {
        done(&[&["board", "--frames", "3", "--source", path.to_str().unwrap()][..], more].concat())
            .lines()
            .next()
            .unwrap()
            .to_owned()
    };
    assert!(channels(&[]).contains(": 2 channels"));
    assert!(channels(&["--body", "hand"]).contains(": 40 channels"));
    let (_folder, path) = crate::file("other.csv", "t,4,777\n0,1,2\n");
    assert!(
        fails(1, &["board", "--body", "hand", "--source", path.to_str().unwrap()])
            .contains("hand: the source has taxel 777")
    );
    assert!(fails(2, &["board", "--source", "csv:-"]).contains("CSV from files"));
}
