//! Recordings in MCAP: what goes in comes out, whatever happens to the file meanwhile.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;
use somatic::recording::{Reader, Recorder};
use somatic::{Frame, OutputPath, RawValue};

use super::python::python_with;
use super::random::Random;
use super::{code_of, done, fails, files_in, frames, output, somatic, stderr, text_of};
use somatic_testing::skip;

const TOUCH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/bodies/touch.csv");
const CALIBRATION: &str = "[all]\nbaseline = 10.5\ngain = 0.25\ndead_band = 1\n";

/// A whole number from 0 up to `end`.
fn below(chance: &mut Random, end: usize) -> usize {
    (chance.unit() * end as f64) as usize
}

/// Taxels of the bundled hand, and the order that a driver may give them in.
fn ids() -> Vec<u32> {
    [32..=38, 0..=8].into_iter().flatten().collect()
}

/// Makes a recording of `count` frames at 50 Hz of 16 taxels at `path`, and gives its frames if asked to.
fn recorded(path: &Path, count: u64, keep: bool) -> Vec<Frame> {
    let ids = ids();
    let mut recorder = Recorder::create(OutputPath::new(path, false, &[]).unwrap(), &ids).unwrap();
    recorder.attach("hand", somatic::internal::recording::BODY, somatic::bundled::HAND).unwrap();
    let mut chance = Random::new(7);
    let mut kept = Vec::new();
    let mut frame = Frame::missing(0.0, ids.len());
    for index in 0..count {
        frame.t_s = index as f64 / 50.0;
        for value in &mut frame.values {
            *value = match chance.next() % 64 {
                0 => RawValue::MISSING,
                1 => RawValue::FAULTY,
                number => RawValue::new(number as f64 / 3.0),
            };
        }
        recorder.frame(&frame).unwrap();
        if keep {
            kept.push(frame.clone());
        }
    }
    recorder.finish().unwrap();
    kept
}

fn source(path: &Path) -> String {
    format!("mcap:{}", text_of(path))
}

fn json(path: &Path) -> (Option<i32>, Value) {
    let output = output(&["info", text_of(path), "--json"]);
    let said = serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {}", stderr(&output)));
    (output.status.code(), said)
}

#[test]
fn a_recording_replays_alone_to_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    std::fs::write(place("hand.toml"), CALIBRATION).unwrap();
    let (mcap, calibration) = (source(&place("a.mcap")), place("hand.toml"));
    let direct = done(&[
        "run",
        "--body",
        "hand",
        "--source",
        TOUCH,
        "--calibration",
        text_of(&calibration),
        "--backend",
        "cpu",
        "--sink",
        &mcap,
        "--sink",
        "-",
    ]);
    std::fs::remove_file(&calibration).unwrap();
    let replayed = done(&["run", "--source", &mcap, "--backend", "cpu"]);
    assert!(direct == replayed, "with the body and the calibration that lie in it");
    let bare = done(&["run", "--source", &mcap, "--backend", "cpu", "--body", "hand"]);
    assert!(bare != replayed, "a body that is named brings nothing of the recording's");
    // A recording of a replay has all that the first one had.
    let again = source(&place("b.mcap"));
    done(&["run", "--source", &mcap, "--backend", "cpu", "--sink", &again]);
    assert!(done(&["run", "--source", &again, "--backend", "cpu"]) == direct);
    let (code, info) = json(&place("a.mcap"));
    assert_eq!((code, &info["ended"], &info["frames"]), (Some(0), &true.into(), &280.into()));
    let names: Vec<&str> = info["attached"].as_array().unwrap().iter().map(|a| a["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["hand", "calibration.toml"]);
    assert!(done(&["info", text_of(&place("a.mcap"))]).contains("280 at 50"));
}

#[test]
fn poses_and_gaps_in_live_frames_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("live.mcap");
    let lines = [
        r#"{"t":-0.5,"values":{"4":512,"5":300.25}}"#,
        r#"{"t":0.02,"values":{"4":500,"5":"nan","6":null,"7":1e-3},"pose":{"hand":[0.1,-2,0.3,0,0,0.6,0.8]}}"#,
        r#"{"t":0.01,"values":{}}"#,
        r#"{"t":1700000000.123456,"values":{"4":-0.0,"8":1e38}}"#,
    ];
    let run = |source: &str, sink: &str| {
        let mut child =
            somatic(&["run", "--body", "hand", "--source", source, "--sink", "-", "--sink", sink, "--all-fields"])
                .args(["--backend", "cpu"])
                .stdin(Stdio::piped())
                .stdout(Stdio::piped())
                .spawn()
                .unwrap();
        child.stdin.take().unwrap().write_all((lines.join("\n") + "\n").as_bytes()).unwrap();
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0));
        String::from_utf8(output.stdout).unwrap()
    };
    let direct = run("-", &source(&path));
    assert!(direct.contains(r#""link":"world""#));
    let again = folder.path().join("again.mcap");
    assert_eq!(run(&source(&path), &source(&again)), direct);
    let (_, info) = json(&path);
    assert_eq!((&info["posed_frames"], &info["backwards"], &info["frames"]), (&1.into(), &1.into(), &4.into()));
    // A CSV has no place for the pose, and says so; the rest of it is there.
    let csv = folder.path().join("live.csv");
    let said = stderr(&output(&["convert", text_of(&path), text_of(&csv)]));
    assert!(said.contains("no place for poses") && said.contains("no place for what is attached: hand"), "{said}");
    let text = std::fs::read_to_string(&csv).unwrap();
    assert!(text.contains("nan") && text.contains("\n-0.5,"), "{text}");
}

#[test]
fn conversion_comes_back_with_every_bit() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let (mcap, csv, twice) = (place("a.mcap"), place("b.csv"), place("c.mcap"));
    let kept = recorded(&mcap, 500, true);
    done(&["convert", text_of(&mcap), text_of(&csv)]);
    done(&["convert", text_of(&csv), text_of(&twice), "--body", "hand"]);
    let mut reader = Reader::open(&twice).unwrap();
    let mut frame = Frame::missing(0.0, 16);
    for (index, wanted) in kept.iter().enumerate() {
        assert!(reader.next_frame(&mut frame).unwrap());
        assert_eq!(&frame, wanted, "frame {index}");
    }
    assert!(!reader.next_frame(&mut frame).unwrap());
    assert_eq!(json(&csv).1["rate_hz"], json(&twice).1["rate_hz"]);
    let why = fails(1, &["convert", text_of(&csv), text_of(&mcap)]);
    assert!(why.contains("--force"), "{why}");
    done(&["convert", text_of(&csv), text_of(&mcap), "--force"]);
    assert!(fails(2, &["convert", text_of(&csv), text_of(&csv), "--force"]).contains("name another file"));
    assert!(fails(2, &["convert", "-", text_of(&csv)]).contains("is not a recording"));
    for text in ["-", "x.ndjson", "sim:a.toml", "serial:/dev/ttyUSB0"] {
        let why = fails(2, &["info", text]);
        assert!(why.contains("this should be csv:FILE, mcap:FILE, ros2-mcap:PATH") && why.contains(text), "{why}");
    }
    let why = fails(2, &["convert", text_of(&csv), "b.parquet"]);
    assert!(why.ends_with("output `b.parquet`: this should be csv:FILE or mcap:FILE\n"), "{why}");
    let why = fails(2, &["convert", "x.ndjson", text_of(&csv)]);
    assert!(
        why.contains("recording `x.ndjson`: this should be csv:FILE, mcap:FILE, a pressure system's .csv"),
        "{why}"
    );
    assert_eq!(files_in(folder.path()), ["a.mcap", "b.csv", "c.mcap"]);
}

#[test]
fn a_part_of_a_recording_is_played_as_often_as_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    recorded(&path, 60_000, false);
    let times = |arguments: &[&str]| -> Vec<f64> {
        let mcap = source(&path);
        let text = done(&[&["run", "--source", &mcap, "--outputs", "total", "--backend", "cpu"], arguments].concat());
        frames(&text).iter().map(|line| line["t"].as_f64().unwrap()).collect()
    };
    assert_eq!(times(&["--from", "1199.9"]), [1199.9, 1199.92, 1199.94, 1199.96, 1199.98]);
    assert_eq!(times(&["--from", "600", "--to", "600.03"]), [600.0, 600.02]);
    let looped = times(&["--from", "0.5", "--to", "0.53", "--loop=3"]);
    assert_eq!(looped.len(), 6);
    assert!(looped.windows(2).all(|pair| (pair[1] - pair[0] - 0.02).abs() < 1e-9), "{looped:?}");
    assert!(fails(2, &["run", "--source", &source(&path), "--from", "2", "--to", "1"]).contains("is not a part"));
    assert!(fails(2, &["run", "--source", "-", "--from", "2"]).contains("recordings"));
}

#[test]
fn what_is_in_the_way_of_a_recording_is_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    std::fs::write(&path, "mine").unwrap();
    let why = fails(1, &["run", "--sink", &source(&path)]);
    assert!(why.contains("it exists") && why.contains("--force"), "{why}");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "mine");
    done(&["run", "--sink", &source(&path), "--force", "--record", "percepts"]);
    let why = fails(1, &["run", "--source", &source(&folder.path().join("no/a.mcap"))]);
    assert!(why.contains("no such file"), "{why}");
    assert!(fails(1, &["run", "--sink", "mcap:/proc/a.mcap"]).contains("/proc/a.mcap"));
    let why = fails(2, &["run", "--source", &source(&path), "--sink", &source(&path), "--force"]);
    assert!(why.contains("name another file"), "{why}");
    std::fs::write(&path, "no MCAP at all").unwrap();
    assert!(fails(1, &["run", "--source", &source(&path)]).contains("not an MCAP file"));
    assert_eq!(files_in(folder.path()), ["a.mcap"]);
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_ends_a_recording_and_not_what_is_live() {
    let folder = tempfile::tempdir().unwrap();
    let why = fails(1, &["run", "--sink", "mcap:/dev/full", "--force"]);
    assert!(!std::fs::metadata("/dev/full").unwrap().is_file(), "what was there before stays");
    let last = why.lines().last().unwrap();
    assert!(last.contains("/dev/full: cannot write") && last.contains("space"), "{why}");
    // In the middle of it: the system lets no file grow beyond 400 or 800 KB, by the shell, which is more than the body.
    let sink = source(&folder.path().join("a.mcap"));
    let program = env!("CARGO_BIN_EXE_somatic");
    let script =
        format!("trap '' XFSZ; ulimit -f 800; exec {program} run --body hand --source - --sink {sink} --sink -");
    let mut child = Command::new("sh")
        .args(["-c", &script])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut to = child.stdin.take().unwrap();
    let reader = std::thread::spawn(move || child.wait_with_output().unwrap());
    for index in 0..600 {
        writeln!(to, r#"{{"t":{index},"values":{{"4":{index},"5":300,"35":9}}}}"#).unwrap();
        std::thread::sleep(Duration::from_millis(5));
    }
    drop(to);
    let output = reader.join().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let said = stderr(&output);
    assert_eq!(said.lines().filter(|line| line.contains("a.mcap")).count(), 1, "{said}");
    assert!(said.contains("cannot write") && said.contains("continuing without it"), "{said}");
    assert_eq!(frames(&String::from_utf8(output.stdout).unwrap()).len(), 600);
    // What fitted is there.
    let (code, info) = json(&folder.path().join("a.mcap"));
    assert_eq!((code, &info["ended"]), (Some(3), &false.into()));
}

#[test]
fn a_process_that_is_killed_loses_less_than_a_second() {
    let folder = tempfile::tempdir().unwrap();
    let mut chance = Random::new(u64::from(std::process::id()));
    for round in 0..4 {
        let path = folder.path().join(format!("{round}.mcap"));
        let mut child =
            somatic(&["run", "--body", "hand", "--source", TOUCH, "--speed", "1", "--loop", "--backend", "cpu"])
                .args(["--sink", &source(&path), "--sink", "-"])
                .stdout(Stdio::piped())
                .spawn()
                .unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        // Long enough for something to lose; when exactly is left to chance.
        let until = Duration::from_millis(1200 + below(&mut chance, 1500) as u64);
        let mut delivered = frames(&lines.next().unwrap().unwrap());
        let start = Instant::now();
        while start.elapsed() < until {
            delivered.extend(frames(&lines.next().unwrap().unwrap()));
        }
        child.kill().unwrap();
        assert_eq!(code_of(&mut child), None, "ended by a signal");
        let rest: Vec<String> = lines.map_while(Result::ok).collect();
        delivered.extend(rest.iter().filter_map(|line| serde_json::from_str::<Value>(line).ok()));
        let last_s = delivered.last().unwrap()["t"].as_f64().unwrap();
        let (code, info) = json(&path);
        assert_eq!((code, &info["ended"]), (Some(3), &false.into()));
        let kept_s = info["start"].as_f64().unwrap() + info["duration"].as_f64().unwrap();
        let [lost] = &info["losses"].as_array().unwrap()[..] else { panic!("{info}") };
        let told_s =
            lost.as_str().and_then(|lost| lost.split_once("what came after t = ")?.1.split_once(" s is missing"));
        assert!((told_s.unwrap().0.parse::<f64>().unwrap() - kept_s).abs() < 1e-6, "{info}");
        assert!(last_s - kept_s < 1.0, "delivered up to {last_s} s, kept up to {kept_s} s");
        // What is there replays, with its body, and what it gives is what was given.
        let replay = output(&["run", "--source", &source(&path), "--backend", "cpu"]);
        assert_eq!(replay.status.code(), Some(3));
        let said = stderr(&replay);
        assert_eq!(said.lines().filter(|line| line.contains("it is cut off")).count(), 1, "{said}");
        let replayed = frames(&String::from_utf8(replay.stdout).unwrap());
        assert!(!replayed.is_empty() && replayed[..] == delivered[..replayed.len()]);
        // And it can be given an end.
        let whole = folder.path().join(format!("{round}.whole.mcap"));
        fails(3, &["convert", text_of(&path), text_of(&whole)]);
        let (code, mended) = json(&whole);
        assert_eq!((code, &mended["ended"], &mended["frames"]), (Some(0), &true.into(), &info["frames"]));
    }
}

/// Does to `bytes` what disks, cables and programs do.
fn damage(bytes: &mut Vec<u8>, chance: &mut Random) {
    for _ in 0..=below(chance, 3) {
        if bytes.is_empty() {
            return;
        }
        let at = below(chance, bytes.len());
        let length = below(chance, 200).min(bytes.len() - at);
        match below(chance, 6) {
            0 => bytes[at] ^= 1 << below(chance, 8),
            1 => bytes[at..at + length].fill(0),
            2 => bytes[at..at + length].fill_with(|| chance.next() as u8),
            3 => drop(bytes.drain(at..at + length)),
            4 => bytes.truncate(at),
            _ => {
                let copy = bytes[at..at + length].to_vec();
                bytes.splice(at..at, copy);
            }
        }
    }
}

/// Damages a recording `rounds` times, or until `end`, and reads what is left of it.
fn survive(rounds: u64, end: Option<Instant>, seed: u64) -> u64 {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    // Three chunks and some.
    let kept = recorded(&path, 30_000, true);
    let whole = std::fs::read(&path).unwrap();
    let ids = ids();
    let mut read_in_part = 0;
    let mut round = 0;
    while round < rounds && end.is_none_or(|end| Instant::now() < end) {
        round += 1;
        let mut chance = Random::new(seed ^ round);
        let mut bytes = whole.clone();
        damage(&mut bytes, &mut chance);
        std::fs::write(&path, &bytes).unwrap();
        let Ok(mut reader) = Reader::open(&path) else { continue };
        let mut frame = Frame::missing(0.0, reader.taxels().len());
        let mut count = 0;
        let done = loop {
            match reader.next_frame(&mut frame) {
                Ok(true) => count += 1,
                end => break end,
            }
            // A frame is as it was, or it is not there.
            let index = (frame.t_s * 50.0).round() as usize;
            assert!(reader.taxels() != ids || kept.get(index) == Some(&frame), "round {round} of {seed}: {frame:?}");
        };
        if let Err(e) = &done {
            assert!(e.to_string().lines().count() == 1, "{e}");
        }
        let lossless = done.is_ok() && reader.losses().is_empty() && reader.taxels() == ids;
        assert!(!lossless || count >= kept.len(), "round {round} of {seed}: {count} frames, and no loss reported");
        assert!(reader.losses().iter().all(|loss| loss.lines().count() == 1));
        read_in_part += u64::from(count > 0 && count < kept.len());
        let attached = reader.attached().to_vec();
        for file in attached {
            if let Ok(bytes) = reader.bytes_of(&file) {
                assert!(file.media_type != somatic::internal::recording::BODY || bytes == somatic::bundled::HAND);
            }
        }
    }
    eprintln!("{round} damaged recordings, {read_in_part} of them read in part");
    read_in_part
}

#[test]
fn damage_costs_what_it_hit_and_never_more_than_a_line() {
    assert!(survive(120, None, 1) > 10, "damage must leave something to read");
}

/// Frames of the recording at `path`, and what is said of those that are lost.
fn count_of(path: &Path) -> (usize, Vec<String>) {
    let mut reader = Reader::open(path).unwrap();
    let mut frame = Frame::missing(0.0, reader.taxels().len());
    let mut count = 0;
    while reader.next_frame(&mut frame).unwrap() {
        count += 1;
    }
    (count, reader.losses())
}

/// Where the bodies of records of kind `kind` are.
fn records_of(bytes: &[u8], kind: u8) -> Vec<std::ops::Range<usize>> {
    let mut found = Vec::new();
    let mut at = 8;
    while at + 9 <= bytes.len() - 8 {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        if bytes[at] == kind {
            found.push(at + 9..at + 9 + length);
        }
        at += 9 + length;
    }
    found
}

#[test]
fn damage_to_the_first_chunk_costs_that_chunk_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let all = recorded(&path, 30_000, true).len();
    let whole = std::fs::read(&path).unwrap();
    let chunks = records_of(&whole, 0x06);
    assert!(chunks.len() > 2);
    for (name, end) in [("ended", whole.len()), ("cut", chunks[chunks.len() - 1].start - 9)] {
        let mut bytes = whole[..end].to_vec();
        bytes[chunks[0].start + 1000] ^= 1;
        std::fs::write(&path, &bytes).unwrap();
        let (count, losses) = count_of(&path);
        assert!(all / 3 < count && count < all, "{name}: {count} of {all}");
        assert!(losses.iter().any(|loss| loss.contains("damaged in one place")), "{name}: {losses:?}");
    }
}

#[test]
fn damage_is_placed_in_time_whoever_reads() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let all = recorded(&path, 30_000, true);
    let whole = std::fs::read(&path).unwrap();
    let chunks = records_of(&whole, 0x06);
    assert!(chunks.len() > 2);
    // The frames of a chunk begin where those before it end, at its start time in ns.
    let start_s = |chunk: usize| {
        let bytes = whole[chunks[chunk].start..chunks[chunk].start + 8].try_into().unwrap();
        u64::from_le_bytes(bytes) as f64 / 1e9
    };
    let first_of = |chunk: usize| all.iter().position(|frame| frame.t_s >= start_s(chunk) - 1e-9).unwrap();
    for chunk in [0, 1, chunks.len() - 1] {
        let mut bytes = whole.clone();
        bytes[chunks[chunk].start + 1000] ^= 1;
        std::fs::write(&path, &bytes).unwrap();
        let (first, end) = (first_of(chunk), if chunk + 1 < chunks.len() { first_of(chunk + 1) } else { all.len() });
        // As it is told: to a microsecond.
        let t_s = |index: usize| (all[index].t_s * 1e6).round() / 1e6;
        let when = match (first, end) {
            (0, end) => format!("before t = {} s", t_s(end)),
            (first, end) if end == all.len() => format!("after t = {} s", t_s(first - 1)),
            (first, end) => format!("between t = {} s and t = {} s", t_s(first - 1), t_s(end)),
        };
        let left = all.len() - (end - first);
        let said = fails(3, &["info", text_of(&path)]);
        assert!(said.contains(&format!("damaged in one place {when}: ")), "{when}: {said}");
        assert!(said.contains(&format!("{left} frames are intact")), "{left}: {said}");
        let (count, losses) = count_of(&path);
        assert!(count == left && said.contains(&losses[0]), "{losses:?}");
        let (_, reported) = json(&path);
        assert_eq!(reported["frames"].as_u64().unwrap() as usize, left);
    }
}

#[test]
fn every_command_tells_what_a_damaged_recording_lacks() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let path = place("a.mcap");
    let all = recorded(&path, 30_000, true).len();
    let whole = std::fs::read(&path).unwrap();
    let chunk = records_of(&whole, 0x06)[1].clone();
    let mut flipped = whole.clone();
    flipped[chunk.start - 9] ^= 0x80;
    let cut_out = [&whole[..chunk.start - 9], &whole[chunk.end..]].concat();
    let left = {
        std::fs::write(&path, &cut_out).unwrap();
        count_of(&path).0
    };
    assert!(all / 3 < left && left < all, "{left} of {all}");
    let lacks = format!("{} of its {all} frames are missing", all - left);
    for (bytes, kept, why) in [(flipped, all, format!("none of its {all} frames is missing")), (cut_out, left, lacks)] {
        std::fs::write(&path, &bytes).unwrap();
        let (copy, source) = (place("copy.mcap"), source(&path));
        for arguments in [
            &["info", text_of(&path)][..],
            &["convert", text_of(&path), text_of(&copy), "--force"],
            &[
                "run",
                "--source",
                &source,
                "--outputs",
                "total",
                "--backend",
                "cpu",
                "--sink",
                "ndjson:/dev/null",
                "--force",
            ],
        ] {
            let said = fails(3, arguments);
            assert!(said.contains(&why), "{arguments:?}: {said}");
        }
        assert_eq!(count_of(&copy), (kept, Vec::new()));
        // A part of it that ends before the end tells what it came by.
        let part = output(&["run", "--source", &source, "--to", "580", "--outputs", "total", "--backend", "cpu"]);
        assert_eq!(part.status.code(), Some(3), "{}", stderr(&part));
    }
}

#[test]
fn messages_without_chunks_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let all = recorded(&path, 3_000, true).len();
    let whole = std::fs::read(&path).unwrap();
    let chunks = records_of(&whole, 0x06);
    let mut bytes = whole[..chunks[0].start - 9].to_vec();
    // Two times, a length, a checksum, no compression and another length stand before a chunk's records.
    chunks.iter().for_each(|chunk| bytes.extend(&whole[chunk.start + 40..chunk.end]));
    let ends = [records_of(&whole, 0x0F), records_of(&whole, 0x02)].concat();
    bytes.extend(&whole[ends[0].start - 9..ends[0].end]);
    bytes.extend(&whole[ends[1].start - 9..ends[1].start]);
    // Neither a summary nor a checksum of it.
    bytes.extend([0; 20]);
    bytes.extend(&whole[..8]);
    std::fs::write(&path, &bytes).unwrap();
    assert_eq!(count_of(&path), (all, Vec::new()));
}

/// `SOMATIC_FUZZ_SECONDS=300 cargo test --test cli recording -- --ignored`
#[test]
#[ignore = "runs for SOMATIC_FUZZ_SECONDS"]
fn damage_for_as_long_as_one_likes() {
    let seconds = std::env::var("SOMATIC_FUZZ_SECONDS").ok().and_then(|s| s.parse().ok()).unwrap_or(60);
    let seed = std::process::id().into();
    survive(u64::MAX, Some(Instant::now() + Duration::from_secs(seconds)), seed);
}

/// The most memory that the command had while it replayed the recording at `path`, bytes.
fn peak_of_replay(path: &Path) -> u64 {
    let mut child =
        somatic(&["run", "--source", &source(path), "--backend", "cpu", "--sink", "ndjson:/dev/null"]).spawn().unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    loop {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let kilobytes = line.and_then(|line| line.trim().strip_suffix(" kB")?.parse::<u64>().ok());
        peak = peak.max(kilobytes.unwrap_or(0) * 1024);
        if let Some(status) = child.try_wait().unwrap() {
            assert!(status.success());
            return peak;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_long_recording_needs_no_more_memory_than_a_short_one() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    recorded(&place("short.mcap"), 10_000, false);
    recorded(&place("long.mcap"), 100_000, false);
    let [short, long] = ["short.mcap", "long.mcap"].map(|name| peak_of_replay(&place(name)));
    assert!(short > 0 && long < short + (16 << 20), "{short} bytes, then {long}");
    assert!(std::fs::metadata(place("long.mcap")).unwrap().len() > 12 << 20, "or it would fit in there");
}

/// `SOMATIC_LONG_HOURS=10 cargo test --release --test cli recording -- --ignored`
#[test]
#[cfg(target_os = "linux")]
#[ignore = "writes hundreds of megabytes: SOMATIC_LONG_HOURS of 16 taxels at 50 Hz"]
fn ten_hours_replay_in_two_hundred_megabytes() {
    let hours = std::env::var("SOMATIC_LONG_HOURS").ok().and_then(|s| s.parse().ok()).unwrap_or(10);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("long.mcap");
    recorded(&path, hours * 3600 * 50, false);
    let peak = peak_of_replay(&path);
    eprintln!("{hours} h, {} bytes: at most {peak} bytes of memory", std::fs::metadata(&path).unwrap().len());
    assert!(peak > 0 && peak < 200 << 20, "{peak} bytes");
}

/// The recording at `from` with its chunks compressed, without an index, as `to`.
fn compressed(from: &Path, to: &Path, compression: &str, pack: impl Fn(&[u8]) -> Vec<u8>) {
    let bytes = std::fs::read(from).unwrap();
    let mut out = bytes[..8].to_vec();
    let mut at = 8;
    loop {
        let (kind, length) = (bytes[at], u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize);
        let body = &bytes[at + 9..at + 9 + length];
        let body = if kind == 0x06 {
            // Two times, the length and its checksum stay; then how it is compressed, and the records.
            let records = pack(&body[40..]);
            let name = [&(compression.len() as u32).to_le_bytes(), compression.as_bytes()].concat();
            [&body[..28], &name, &(records.len() as u64).to_le_bytes(), &records].concat()
        } else {
            body.to_vec()
        };
        out.push(kind);
        out.extend((body.len() as u64).to_le_bytes());
        out.extend(body);
        at += 9 + length;
        if kind == 0x0F {
            break;
        }
    }
    // A footer that knows of no summary.
    out.extend([&[0x02][..], &20_u64.to_le_bytes(), &[0; 20], &bytes[..8]].concat());
    std::fs::write(to, out).unwrap();
}

#[test]
fn what_other_programs_have_compressed_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let (plain, packed) = (folder.path().join("a.mcap"), folder.path().join("b.mcap"));
    let kept = recorded(&plain, 3000, true);
    let lz4 = |bytes: &[u8]| {
        let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    };
    let zstd = |bytes: &[u8]| ruzstd::encoding::compress_to_vec(bytes, ruzstd::encoding::CompressionLevel::Fastest);
    for name in ["lz4", "zstd"] {
        compressed(&plain, &packed, name, |bytes| if name == "lz4" { lz4(bytes) } else { zstd(bytes) });
        let length = |path: &Path| std::fs::metadata(path).unwrap().len();
        assert!(length(&packed) < length(&plain), "{name}: {} B", length(&packed));
        let mut reader = Reader::open(&packed).unwrap();
        let mut frame = Frame::missing(0.0, 16);
        for (index, wanted) in kept.iter().enumerate() {
            assert!(reader.next_frame(&mut frame).unwrap(), "{name}: frame {index}");
            assert_eq!(&frame, wanted, "{name}: frame {index}");
        }
        assert!(!reader.next_frame(&mut frame).unwrap() && reader.losses().is_empty());
        // Damage is found all the same, and the chunk left out.
        let mut bytes = std::fs::read(&packed).unwrap();
        // Beyond the body, among the frames.
        let at = bytes.len() * 9 / 10;
        bytes[at] ^= 0xFF;
        std::fs::write(&packed, bytes).unwrap();
        let (code, info) = json(&packed);
        assert!(code == Some(3) && info["frames"].as_u64().unwrap() < 3000, "{name}: {info}");
    }
    compressed(&plain, &packed, "brotli", <[u8]>::to_vec);
    let why = fails(1, &["info", text_of(&packed)]);
    assert!(why.contains("compressed by `brotli`") && why.contains("mcap compress"), "{why}");
}

#[test]
fn what_is_stale_is_stale_in_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let body = somatic::Body::from_bytes("hand", somatic::bundled::HAND).unwrap();
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let mut recorder = Recorder::create(OutputPath::new(place("a.mcap"), false, &[]).unwrap(), &ids).unwrap();
    recorder.attach("hand", somatic::internal::recording::BODY, somatic::bundled::HAND).unwrap();
    // The first frames are all there, then a third of them is stale, then most are; one is only missing.
    let stale_in = |index: usize, value: usize| value < [0, ids.len() / 3, ids.len() - 5][index / 100];
    let frames_of = |index: usize| {
        let value = |value: usize| match value {
            _ if stale_in(index, value) => RawValue::STALE,
            39 => RawValue::MISSING,
            _ => RawValue::new((index * 7 + value) as f64),
        };
        Frame { t_s: index as f64 / 50.0, values: (0..ids.len()).map(value).collect(), ..Frame::default() }
    };
    let kept: Vec<Frame> = (0..300).map(frames_of).collect();
    kept.iter().for_each(|frame| recorder.frame(frame).unwrap());
    recorder.finish().unwrap();

    // As an engine says that got the frames themselves.
    let scene = somatic::Scene::default().touches(somatic::touch::Options::default());
    let options = somatic::Options::default().scene(scene).backend(somatic::BackendKind::Cpu);
    let mut engine = somatic::Engine::new(&body, options).unwrap();
    engine.track_stale();
    let percepts = engine.process(&kept).unwrap();
    let replayed = frames(&done(&["run", "--source", &source(&place("a.mcap")), "--backend", "cpu", "--all-fields"]));
    assert_eq!(replayed.len(), kept.len());
    let mut flagged = [0; 3];
    for (index, line) in replayed.iter().enumerate() {
        for (field, said) in line["fields"].as_array().unwrap().iter().enumerate() {
            let percept = percepts.get(index, field);
            let names: Vec<String> = percept.flags.names().collect();
            assert_eq!(said["flags"], serde_json::json!(names), "frame {index}, field {field}");
            assert_eq!(said["total"].as_f64(), percept.total, "frame {index}, field {field}");
            flagged[index / 100] += u32::from(percept.flags.contains(somatic::Flags::STALE));
        }
    }
    assert!(flagged[0] == 0 && 0 < flagged[1] && flagged[1] < flagged[2], "{flagged:?}");

    // Copies keep it; whoever does not heed it finds it missing; a CSV has no word for it.
    done(&["convert", text_of(&place("a.mcap")), text_of(&place("b.mcap"))]);
    let mut reader = Reader::open(place("b.mcap")).unwrap();
    let mut frame = Frame::missing(0.0, ids.len());
    assert!((0..150).all(|_| reader.next_frame(&mut frame).unwrap()));
    assert!(frame.values[0] == RawValue::MISSING && reader.has_stale());
    reader.report_stale();
    assert!(reader.next_frame(&mut frame).unwrap());
    assert_eq!(frame.values, kept[150].values);
    let said = stderr(&output(&["convert", text_of(&place("a.mcap")), text_of(&place("c.csv"))]));
    assert!(said.contains("cannot mark stale values"), "{said}");
}

#[test]
fn another_library_reads_the_same() {
    let python = match python_with("mcap", "import mcap, mcap_protobuf") {
        Ok(python) => python,
        Err(why) => return skip("MCAP", format!("no other reader of MCAP: {why}")),
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let outputs = ["--outputs", "touches,touches.taxels,total,area"];
    let percepts =
        done(&[&["run", "--sink", &source(&path), "--sink", "-", "--backend", "cpu"], &outputs[..]].concat());
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/mcap/read.py");
    let output = Command::new(python).arg(script).arg(&path).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let said: Value = serde_json::from_slice(&output.stdout).unwrap();
    // Percepts are the lines of the other sink; frames the rows of the recording.
    assert!(said["percepts"].as_array().unwrap()[..] == frames(&percepts)[..]);
    let text = std::fs::read_to_string(TOUCH).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split(',').collect()).collect();
    let read = said["frames"].as_array().unwrap();
    assert_eq!(read.len(), rows.len());
    for (frame, row) in read.iter().zip(&rows) {
        assert_eq!(frame["t"].as_f64().unwrap(), row[0].parse::<f64>().unwrap());
        for (index, cell) in row[1..].iter().enumerate().filter(|(_, cell)| !cell.is_empty()) {
            let value = frame["values"][index.to_string()].as_f64().unwrap();
            assert_eq!(value as f32, cell.parse::<f32>().unwrap());
        }
    }
    // Viewers know their schemas by these names.
    let schemas = &said["schemas"];
    assert_eq!(schemas["/somatic/taxels"], serde_json::json!(["foxglove.PointCloud", "protobuf"]));
    assert_eq!(schemas["/somatic/touches"], serde_json::json!(["foxglove.SceneUpdate", "protobuf"]));
    assert_eq!(schemas["/somatic/links"], serde_json::json!(["foxglove.FrameTransforms", "protobuf"]));
    // All taxels ten times a second over 5.58 s; their pressures are the raw values, where the body's taxels are.
    let clouds = said["taxels"].as_array().unwrap();
    assert!((54..=57).contains(&clouds.len()), "{}", clouds.len());
    let body = somatic::Body::from_bytes("hand", somatic::bundled::HAND).unwrap();
    let first = &read[0]["values"];
    for (index, point) in clouds[0]["points"].as_array().unwrap().iter().enumerate() {
        let taxel = &body.taxels[index];
        let place = body.links[taxel.link].world_from_link().transform_point3(taxel.position_in_link);
        for (name, wanted) in [("x", place.x), ("y", place.y), ("z", place.z)] {
            assert_eq!(point[name].as_f64().unwrap() as f32, wanted as f32);
        }
        assert_eq!(point["pressure"], first[index.to_string()]);
    }
    // Viewers colour points by these names: the harder pressed, the redder, and the hardest like what touches it.
    let points = || clouds.iter().flat_map(|cloud| cloud["points"].as_array().unwrap());
    let number = |point: &Value, name: &str| point[name].as_f64().unwrap();
    let hardest = points().max_by(|a, b| number(a, "pressure").total_cmp(&number(b, "pressure"))).unwrap();
    assert_eq!(["red", "green", "blue", "alpha"].map(|name| number(hardest, name)), [242.0, 89.0, 25.0, 255.0]);
    for point in points() {
        let untouched = number(point, "pressure") <= 0.0;
        assert_eq!(number(point, "red") <= 89.0, untouched, "{point}");
    }
    // What is touched is where the percepts say, in the frame that they say.
    let shown: Vec<&Value> =
        said["touches"].as_array().unwrap().iter().flat_map(|scene| scene.as_array().unwrap()).collect();
    let lines = frames(&percepts);
    let felt: Vec<&Value> = lines.iter().flat_map(|line| line["touches"].as_array().unwrap()).collect();
    assert!(shown.len() > 20 && shown.len() <= felt.len());
    for entity in shown {
        let known = felt.iter().any(|touch| {
            let id = touch["id"].to_string();
            entity["id"] == id
                && entity["frame_id"] == touch["in"]
                && entity["sphere"] == touch["position"]
                && entity["arrows"] == 1
        });
        assert!(known, "{entity}");
    }
    let links = said["links"][0].as_array().unwrap();
    assert_eq!(links.len(), body.links.len());
    assert!(links.iter().all(|link| link["parent"] == "world"));
    // The surface, each link's in its frame, once; and the totals of the field without a parent, every frame.
    let [surface] = &said["body"].as_array().unwrap()[..] else { panic!("{}", said["body"]) };
    let triangles = body.triangles_at_rest();
    let (link, corners) = &triangles[0];
    let first = &surface[&body.links[*link].name][0];
    let corner = body.links[*link].body_from_link.inverse().transform_point3(corners[0]);
    assert_eq!(first, &serde_json::json!(corner.to_array()));
    let points = surface.as_object().unwrap().values().map(|points| points.as_array().unwrap().len());
    assert_eq!(points.sum::<usize>(), 3 * triangles.len());
    let totals = said["fields"].as_array().unwrap();
    assert!(totals.len() == rows.len() && totals.iter().all(|total| total["field"] == "hand"));
    let of_hand = |line: &Value| line["fields"].as_array().unwrap().iter().find(|f| f["field"] == "hand").cloned();
    for (total, line) in totals.iter().zip(&lines) {
        let (wanted, area) =
            of_hand(line).map_or((0.0, 0.0), |of| (of["total"].as_f64().unwrap(), of["area"].as_f64().unwrap()));
        assert!(total["total"].as_f64().unwrap() as f32 == wanted as f32, "{total} {line}");
        assert!(total["area"].as_f64().unwrap() as f32 == area as f32, "{total} {line}");
    }
    assert!(said["attached"]["hand"][1].as_u64().unwrap() > 1000);
    let (_, info) = json(&path);
    let counted: u64 = info["topics"].as_array().unwrap().iter().map(|t| t["messages"].as_u64().unwrap()).sum();
    assert_eq!(said["statistics"].as_u64(), Some(counted));
}
