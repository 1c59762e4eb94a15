//! Taxels with three axes, live: boards that print, boards that send packets and PaXini's, each on a real pseudo-terminal.

use std::collections::BTreeSet;
use std::fs;
use std::io::{Read as _, Write as _};
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use serde_json::Value;

use super::serial::Boards;
use super::text::{Board, pty};
use super::{done, frames, output, stderr, text_of};

const ASKED: [&str; 8] =
    ["--backend", "reference", "--all-fields", "--sink", "-", "--outputs", "total,shear_vector,friction", "--quiet"];

/// A body of two taxels with three axes, 0 and 1.
fn pad(folder: &tempfile::TempDir) -> PathBuf {
    let [lines, map, body] = ["a.ndjson", "map.toml", "pad.glb"].map(|name| folder.path().join(name));
    fs::write(&lines, "{\"t\":0,\"a\":[1,2,3,4,5,6]}\n").unwrap();
    fs::write(&map, "values = \"a\"\naxes = \"nuv\"\ngrid = \"1x2\"\npitch = \"5mm\"\n").unwrap();
    done(&["convert", text_of(&lines), text_of(&body), "--map", text_of(&map)]);
    body
}

/// The percept of `letter` in a frame.
fn of<'a>(frame: &'a Value, letter: &str) -> &'a Value {
    frame["fields"].as_array().unwrap().iter().find(|percept| percept["letter"] == letter).unwrap()
}

fn has_flag(percept: &Value, flag: &str) -> bool {
    percept["flags"].as_array().is_some_and(|flags| flags.iter().any(|own| own == flag))
}

/// Whether nothing was heard of the board for long, as now and then on a busy machine: then every letter says so.
fn is_stale(frame: &Value) -> bool {
    let percepts = frame["fields"].as_array().unwrap();
    let stale = percepts.iter().filter(|percept| has_flag(percept, "stale")).count();
    assert!(stale == 0 || stale == percepts.len(), "{frame}");
    stale > 0
}

#[test]
fn a_board_that_falls_silent_is_stale_in_every_letter() {
    let folder = tempfile::tempdir().unwrap();
    let body = pad(&folder);
    let board =
        Board::start(Duration::from_millis(10), |n| if n < 50 { b"5,1,-2,4,2,3\n".to_vec() } else { Vec::new() });
    let source = format!("text:{}", board.name);
    let own = ["run", "--source", &source, "--ids", "0,0.u,0.v,1,1.u,1.v", "--for", "3s", "--body", text_of(&body)];
    let run = output(&[&own[..], &ASKED].concat());
    let all = frames(&String::from_utf8(run.stdout).unwrap());
    assert!(all.iter().any(|frame| !is_stale(frame)) && is_stale(all.last().unwrap()), "{}", all.last().unwrap());
    assert!(has_flag(of(all.last().unwrap(), "shear"), "incomplete"));
}

#[test]
fn a_board_that_prints_three_axes_is_felt_along_the_skin_and_counts_without_one_of_them() {
    let folder = tempfile::tempdir().unwrap();
    let body = pad(&folder);
    // Every third line lacks one value.
    let board = Board::start(Duration::from_millis(10), |n| {
        if n % 3 == 2 { b"5,1,,4,2,3\n".to_vec() } else { b"5,1,-2,4,2,3\n".to_vec() }
    });
    let source = format!("text:{}", board.name);
    let own = ["run", "--source", &source, "--ids", "0,0.u,0.v,1,1.u,1.v", "--for", "2s", "--body", text_of(&body)];
    let run = output(&[&own[..], &ASKED].concat());
    assert!(run.status.success(), "{}", stderr(&run));
    let all = frames(&String::from_utf8(run.stdout).unwrap());
    let (mut whole, mut without) = (0, 0);
    for frame in all.iter().filter(|frame| !is_stale(frame)) {
        let (normal, shear) = (of(frame, "sustained"), of(frame, "shear"));
        assert!(normal["total"] == 9.0 && !has_flag(normal, "incomplete"), "{frame}");
        let vector: Vec<f64> = shear["shear_vector"].as_array().unwrap().iter().filter_map(Value::as_f64).collect();
        let size = vector.iter().map(|along| along * along).sum::<f64>().sqrt();
        // Both taxels' 3 and 1 along the two tangents, or those of the second alone.
        let expected = if has_flag(shear, "incomplete") { 13.0_f64 } else { 10.0 }.sqrt();
        assert!((size - expected).abs() < 1e-6, "{size}: {frame}");
        *(if has_flag(shear, "incomplete") { &mut without } else { &mut whole }) += 1;
    }
    assert!(without > 20 && whole > without, "{whole} whole, {without} without");
}

#[test]
fn packets_with_three_axes_give_what_the_same_rows_of_a_table_give() {
    let folder = tempfile::tempdir().unwrap();
    let body = pad(&folder);
    let [rows, calibration] = ["rows.csv", "rest.toml"].map(|name| folder.path().join(name));
    // Counts have no sign: 512 is rest along the skin. Packets have no blanks: 1023 is no reading, of taxel 0 along v.
    let row = |(n, v): (usize, &str)| format!("{},300,600,{v},200,512,700\n", n as f64 * 0.02);
    let text = |values: &[&str]| {
        let values = values.iter().flat_map(|value| std::iter::repeat_n(*value, 40));
        format!("t,0,0.u,0.v,1,1.u,1.v\n{}", values.enumerate().map(row).collect::<String>())
    };
    let calibrated = |missing: &str| {
        let text = format!("[all]\nunit = \"N\"\ngain = 0.01\n{missing}[shear]\nbaseline = [512, 512]\n");
        fs::write(&calibration, text).unwrap();
    };
    let felt = |text: &str| {
        let known = frames(text).into_iter().filter(|frame| !is_stale(frame));
        known.map(|frame| frame["fields"].to_string()).collect::<Vec<_>>()
    };
    let own = ["run", "--body", text_of(&body), "--calibration", text_of(&calibration)];
    let of_table = || felt(&done(&[&own[..], &["--source", text_of(&rows)], &ASKED].concat()));
    fs::write(&rows, text(&["400", "1023", ""])).unwrap();
    calibrated("");
    assert_ne!(of_table()[40], of_table()[80], "without `missing` it is a reading");
    calibrated("missing = [1023]\n");
    let table = of_table();
    let expected: BTreeSet<&String> = table.iter().collect();
    assert_eq!(expected.len(), 2, "{expected:?}");
    assert!(table[0].contains("shear_vector") && !table[0].contains("incomplete") && table[40].contains("incomplete"));
    fs::write(&rows, text(&["400", "1023"])).unwrap();
    let source = format!("csv:{}", rows.display());
    let boards = Boards::start(&["--source", &source, "--body", text_of(&body), "--loop", "--wait", "--for", "20s"]);
    let line = format!("serial:{}", boards.ports[0]);
    let run = output(&[&own[..], &["--source", &line, "--for", "6s"], &ASKED].concat());
    assert!(matches!(run.status.code(), Some(0 | 3)), "{}", stderr(&run));
    let live = felt(&String::from_utf8(run.stdout).unwrap());
    let seen: BTreeSet<&String> = live.iter().collect();
    assert!(live.len() > 60 && seen == expected, "{} frames: {seen:?}", live.len());
}

/// The bytes and what makes their sum 0.
fn summed(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes.push(bytes.iter().fold(0_u8, |sum, byte| sum.wrapping_sub(*byte)));
    bytes
}

/// A board of PaXini with the tip of an index finger of two taxels. Of every tenth frame a byte is damaged.
fn paxini() -> String {
    let (mut end, name) = pty();
    rustix::io::ioctl_fionbio(&end, true).unwrap();
    thread::spawn(move || {
        let (mut sent, mut sends, mut request) = (0_u32, false, Vec::new());
        loop {
            let mut byte = [0];
            while matches!(end.read(&mut byte), Ok(1)) {
                request.push(byte[0]);
                let is_write = request.get(3) == Some(&0x10);
                if request.len() < 9 + usize::from(is_write) {
                    continue;
                }
                let bytes = std::mem::take(&mut request);
                sends = is_write && bytes[4] == 0x17 && bytes[8] == 1;
                let mut data = vec![0; if is_write { 1 } else { usize::from(bytes[6]) }];
                match bytes[4] {
                    0x10 => data[0] = 0b100_0000,
                    0x30 => data[12] = 2,
                    _ => {}
                }
                let head = [0xAA, 0x55, 0, bytes[3], bytes[4], 0, data.len() as u8, 0];
                if end.write_all(&summed([&head[..], &data].concat())).is_err() {
                    return;
                }
            }
            if sends {
                let total = [0; 6];
                let mut frame = summed([&[0xAA, 0x56, 0, 13, 0, 0][..], &total, &[10, 246, 50, 20, 0, 30]].concat());
                frame[13] ^= u8::from(sent % 10 == 9);
                let _ = end.write_all(&frame);
                sent += 1;
            }
            thread::sleep(Duration::from_millis(5));
        }
    });
    name
}

#[test]
fn a_board_of_paxini_is_read_with_one_line() {
    let asked = &ASKED[..ASKED.len() - 1];
    let run_for = |time: &str| {
        let source = format!("paxini:{}", paxini());
        let run = output(&[&["run", "--source", &source, "--for", time][..], asked].concat());
        let mut all = frames(&String::from_utf8_lossy(&run.stdout));
        all.retain(|frame| !is_stale(frame));
        (run, all)
    };
    let (run, all) =
        ["2s", "8s"].into_iter().map(run_for).find(|(_, all)| all.len() > 100).unwrap_or_else(|| run_for("40s"));
    let said = stderr(&run);
    // Frames were damaged, which is told and counted.
    assert_eq!(run.status.code(), Some(3), "{said}");
    for says in ["6 values a message of the sensor index_tip", "untested", "each has three axes", "are not packets"] {
        assert!(said.contains(says), "{says}: {said}");
    }
    assert!(all.len() > 100, "{} frames", all.len());
    for frame in &all {
        let (normal, shear) = (of(frame, "sustained"), of(frame, "shear"));
        assert!(normal["field"] == "index_tip" && (normal["total"].as_f64().unwrap() - 8.0).abs() < 1e-5, "{frame}");
        let vector: Vec<f64> = shear["shear_vector"].as_array().unwrap().iter().filter_map(Value::as_f64).collect();
        // 1 + 2 along x, -1 along y.
        let size = vector.iter().map(|along| along * along).sum::<f64>().sqrt();
        assert!((size - 10_f64.sqrt()).abs() < 1e-5, "{size}");
    }
}
