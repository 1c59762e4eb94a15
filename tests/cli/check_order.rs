//! Which pad answers while somebody presses one after the other.

use std::fs::{self, File};
use std::io::{BufRead as _, BufReader, Write as _};
use std::process::Stdio;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use tempfile::TempDir;

use super::bags::refused;
use super::{code_of, done, fails, somatic, text_of};

const MAP: &str = "values = 'pressure'
pads = [
  { name = 'thumb_tip', grid = '2x2', pitch = '5mm' },
  { name = 'index_tip', grid = '2x2', pitch = '5mm', at_mm = [30, 0] },
  { name = 'palm', grid = '1x1', pitch = '5mm', at_mm = [60, 0] },
]
";

/// Frames at 100 Hz: a second and a half of rest at 1000, then index_tip, thumb_tip and index_tip again, for 0.4 s each.
fn line(frame: usize) -> String {
    let noise = [0, 1, -1][frame % 3];
    let value = |sensor: usize| {
        let press = match (sensor, frame) {
            (5, 150..190 | 250..290) => 300,
            (6, 150..190) => 100,
            (2, 200..240) => -400,
            _ => 0,
        };
        (1000 + noise + press).to_string()
    };
    let values: Vec<String> = (0..9).map(value).collect();
    format!("{{\"t\":{},\"pressure\":[{}]}}\n", frame as f64 / 100.0, values.join(","))
}

fn session() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("map.toml"), MAP).unwrap();
    fs::write(folder.path().join("s.ndjson"), (0..300).map(line).collect::<String>()).unwrap();
    folder
}

#[test]
fn each_change_of_the_pressed_pad_is_a_line_and_the_silent_ones_are_listed() {
    let folder = session();
    let [map, lines] = ["map.toml", "s.ndjson"].map(|name| folder.path().join(name));
    let run = ["run", "--map", text_of(&map), "--source", text_of(&lines), "--backend", "cpu"];
    let reported = done(&[&run[..], &["--check-order"]].concat());
    let begins: Vec<&str> = reported.lines().map(|line| line.split(" (").next().unwrap()).collect();
    assert_eq!(
        begins,
        [
            "pad \"index_tip\"",
            "pad \"thumb_tip\"",
            "pad \"index_tip\"",
            "never answered: 1 of 3 pads",
            "  pad \"palm\""
        ]
    );
    let all: Vec<&str> = reported.lines().collect();
    assert!(
        all[0].starts_with("pad \"index_tip\" (taxels 4-7): pressed, 40") && all[0].ends_with("most at taxel 5"),
        "{reported}"
    );
    assert!(
        all[1].starts_with("pad \"thumb_tip\" (taxels 0-3): pressed, 40")
            && all[1].ends_with("counts, most at taxel 2"),
        "{reported}"
    );
    assert_eq!(all[4], "  pad \"palm\" (taxel 8)");
    // By taxel.
    let reported = done(&[&run[..], &["--check-order=taxels"]].concat());
    let taxels: Vec<&str> = reported.lines().map(|line| line.split(':').next().unwrap()).collect();
    assert_eq!(taxels, ["taxel 5", "taxel 2", "taxel 5", "never answered"]);
    assert!(reported.ends_with("never answered: 7 of 9 taxels: 0-1, 3-4, 6-8\n"), "{reported}");
    // In newtons under a calibration, from the first frame on; the sensors that fall are not pressed by it.
    let calibration = folder.path().join("c.toml");
    fs::write(&calibration, "[all]\nbaseline = 1000\ngain = 0.01\ndead_band = 0.1\nunit = 'N'\n").unwrap();
    let reported = done(&[&run[..], &["--calibration", text_of(&calibration), "--check-order"]].concat());
    assert!(reported.starts_with("pad \"index_tip\" (taxels 4-7): pressed, 4"), "{reported}");
    assert!(
        reported.lines().next().unwrap().contains(" N, most at taxel 5") && reported.contains("2 of 3 pads"),
        "{reported}"
    );
    // Percepts go to files all the same, and not beside it.
    let percepts = folder.path().join("p.ndjson");
    done(&[&run[..], &["--check-order", "--sink", text_of(&percepts)]].concat());
    assert_eq!(fs::read_to_string(&percepts).unwrap().lines().count(), 300);
    assert!(refused(2, &[&run[..], &["--check-order", "--sink", "-"]].concat()).contains("--check-order prints on"));
    assert!(fails(2, &[&run[..], &["--check-order=pads"]].concat()).contains("fields, taxels"));
}

#[test]
fn a_press_is_reported_while_it_lasts_and_a_single_field_by_its_taxels() {
    let folder = session();
    let map = folder.path().join("row.toml");
    fs::write(&map, "values = 'pressure'\n").unwrap();
    let mut command = somatic(&["run", "--map", text_of(&map), "--source", "-", "--check-order", "--backend", "cpu"]);
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let output = BufReader::new(child.stdout.take().unwrap());
    let (to, from) = channel();
    std::thread::spawn(move || output.lines().for_each(|line| drop(to.send(line.unwrap()))));
    let mut input = child.stdin.take().unwrap();
    let mut send = |frames: std::ops::Range<usize>| {
        input.write_all(frames.map(line).collect::<String>().as_bytes()).unwrap();
        input.flush().unwrap();
    };
    let within = Duration::from_secs(20);
    send(0..160);
    assert_eq!(from.recv_timeout(Duration::from_millis(300)), Err(RecvTimeoutError::Timeout));
    // It lasts, and the input stays open.
    send(160..185);
    assert!(from.recv_timeout(within).unwrap().starts_with("taxel 5: pressed, 30"));
    send(185..235);
    assert!(from.recv_timeout(within).unwrap().starts_with("taxel 2: pressed, 40"));
    drop(input);
    assert_eq!(from.recv_timeout(within).unwrap(), "never answered: 7 of 9 taxels: 0-1, 3-4, 6-8");
    assert_eq!(code_of(&mut child), Some(0));
    let mut said = String::new();
    std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut said).unwrap();
    let places = ["leave the robot alone for 1 s", "now press one taxel after the other"].map(|what| said.find(what));
    assert!(places[0].is_some() && places[0] < places[1], "{said}");
}

#[test]
fn fields_of_any_body_are_reported_without_those_above_them() {
    let reported = done(&["run", "--check-order", "--backend", "cpu"]);
    assert!(reported.contains("field \"hand/palm") && !reported.contains("\"hand\""), "{reported}");
    let folder = session();
    let file = File::open(folder.path().join("s.ndjson")).unwrap();
    // Frames in NDJSON that the body has nothing of: nothing answers.
    let run = somatic(&["run", "--body", "hand", "--source", "-", "--check-order"]).stdin(file).output().unwrap();
    assert!(run.status.code() != Some(0), "{}", super::stderr(&run));
}
