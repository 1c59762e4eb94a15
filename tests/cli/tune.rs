//! `somatic tune`, and `somatic calibrate` live: through real pseudo-terminals, with a person who presses when asked to.

use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use somatic::signal::{FsrCircuit, Wiring};

use super::{code_of, somatic, text_of};

const HAND: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/wirings/hand.toml");
/// One of the hand's, which the person never presses.
const FORGOTTEN: u32 = 7;

/// A running `somatic board` whose sensors a person touches: the paper's, recorded at wiper 38.
struct Touched {
    child: Child,
    reported: BufReader<ChildStdout>,
    skin: ChildStdin,
    port: String,
    time_s: f64,
}

impl Touched {
    fn start(folder: &std::path::Path, name: &str, wiring: &str, more: &[&str]) -> Self {
        let link = folder.join(name);
        let first = ["board", "--json", "--source", "-", "--rest", "high", "--rate", "50", "--wait"];
        let arguments = [&first[..], &["--wiring", wiring, "--link", text_of(&link)], more].concat();
        let mut child = somatic(&arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let skin = child.stdin.take().unwrap();
        let mut reported = BufReader::new(child.stdout.take().unwrap());
        reported.read_line(&mut String::new()).unwrap();
        let mut touched = Self { child, reported, skin, port: format!("serial:{}", link.display()), time_s: 0.0 };
        touched.touch(|_| None);
        touched
    }

    /// From now on each taxel is pressed with this force, N.
    fn touch(&mut self, newton: impl Fn(u32) -> Option<f64>) {
        let taxels = (0..9).chain(16..27).chain(32..52);
        let read = |id: u32| (id.to_string(), json!(FsrCircuit::default().counts(newton(id).unwrap_or(0.0))));
        let values: serde_json::Map<String, Value> = taxels.map(read).collect();
        self.time_s += 0.02;
        // A board that has ended is not touched any more.
        let _ = writeln!(self.skin, "{}", json!({"t": self.time_s, "values": values}));
    }

    /// Ends it, and gives the wipers that it had.
    fn wipers(mut self) -> Vec<u64> {
        interrupt(&self.child);
        let mut line = String::new();
        self.reported.read_line(&mut line).unwrap();
        let account: Value = serde_json::from_str(&line).unwrap();
        account["sent"][0]["wipers"].as_array().unwrap().iter().map(|wiper| wiper.as_u64().unwrap()).collect()
    }
}

impl Drop for Touched {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn interrupt(child: &Child) {
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
}

/// How firmly a taxel is pressed: each otherwise.
fn firm(id: u32) -> Option<f64> {
    (id != FORGOTTEN).then(|| 2.0 + 0.15 * f64::from(id))
}

/// Runs `arguments` while `boards` are pressed when it says so, and interrupts it when it says `until`; standard output,
/// standard error, exit code.
fn guided(arguments: &[&str], boards: &mut [Touched], until: Option<&str>) -> (String, String, Option<i32>) {
    let mut child = somatic(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let (mut reported, mut said) = (BufReader::new(child.stderr.take().unwrap()), String::new());
    let mut line = String::new();
    while reported.read_line(&mut line).unwrap() > 0 {
        if until.is_some_and(|until| line.contains(until)) {
            interrupt(&child);
        } else if line.contains("now press every sensor") {
            for (newton, after_ms) in [(firm as fn(u32) -> Option<f64>, 300), (|_| None, 1000)] {
                std::thread::sleep(Duration::from_millis(after_ms));
                boards.iter_mut().for_each(|board| board.touch(newton));
            }
        }
        said += &std::mem::take(&mut line);
    }
    let mut text = String::new();
    std::io::Read::read_to_string(&mut child.stdout.take().unwrap(), &mut text).unwrap();
    (text, said, code_of(&mut child))
}

/// The sensors of `somatic tune --json`, by taxel.
fn sensors(text: &str) -> BTreeMap<u64, Value> {
    let found: Value = serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"));
    let sensors = found["sensors"].as_array().unwrap().iter();
    sensors.map(|sensor| (sensor["taxel"].as_u64().unwrap(), sensor.clone())).collect()
}

const TUNE: [&str; 10] = ["tune", "--body", "hand", "--rest", "0.5", "--press", "2.5", "--json", "--wiper", "3"];

#[test]
fn sensors_that_are_badly_tuned_use_their_range_in_the_end_and_again_after_a_reset() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let (tuned, fsr) = (at("tuned.toml"), at("fsr.toml"));
    let mut boards = [Touched::start(folder.path(), "hand", HAND, &[])];
    let source = boards[0].port.clone();
    let arguments =
        [&TUNE[..], &["--source", &source, "--wiring", HAND, "-o", &tuned, "--fsr-calibration", &fsr]].concat();
    let (text, said, code) = guided(&arguments, &mut boards, None);
    assert_eq!(code, Some(0), "{said}");
    let [board] = boards;
    let wipers = board.wipers();
    let sensors = sensors(&text);
    assert_eq!(sensors.len(), 40);
    for (id, sensor) in &sensors {
        let number = |key: &str| sensor[key].as_f64().unwrap_or_else(|| panic!("{key}: {sensor}"));
        assert_eq!(
            (&sensor["acknowledged"], &sensor["wiper"]),
            (&true.into(), &wipers[*id as usize].into()),
            "{sensor}"
        );
        if *id == u64::from(FORGOTTEN) {
            assert!(sensor["why"].as_str().unwrap().contains("never pressed") && sensor["wiper"] == 3, "{sensor}");
            continue;
        }
        // By the circuit: at wiper 3 a press of 10 N uses 39 % of the range, and the best wiper position leaves a sixteenth.
        assert!(number("share_before") < 0.4, "{sensor}");
        assert!(number("share") > 0.85 && number("press") > 1023.0 / 64.0 && sensor["fits"] == true, "{sensor}");
        let circuit = FsrCircuit { wiper: sensor["wiper"].as_u64().unwrap() as u8 };
        let own = f64::from(circuit.counts(firm(*id as u32).unwrap()));
        assert!((own - number("press")).abs() < 0.02 * 1023.0, "{own} in the paper's circuit: {sensor}");
    }
    assert!(text.contains("never pressed; left as it was: taxel 7"), "{text}");

    // What was written is set whenever a board starts, in the right order: no value is of another wiper.
    let wiring = Wiring::load(&tuned).unwrap();
    let wanted: Vec<Option<u8>> = wiring.boards()[0].wipers.clone();
    assert_eq!(wanted.iter().flatten().count(), 40);
    let mut board = Touched::start(folder.path(), "again", HAND, &["--faults", "reset@3s"]);
    let source = board.port.clone();
    let run =
        ["run", "--backend", "cpu", "--source", &source, "--sink", "-", "--wiring", &tuned, "--calibration", &fsr];
    let mut child = somatic(&[&run[..], &["--for", "6s", "--outputs", "total", "--quiet"]].concat())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_millis(300));
    board.touch(firm);
    let mut totals = Vec::new();
    for line in BufReader::new(child.stdout.take().unwrap()).lines() {
        let frame: Value = serde_json::from_str(&line.unwrap()).unwrap();
        let back = frame["fields"].as_array().unwrap().iter().find(|field| field["field"] == "hand/back").cloned();
        let whole = back.filter(|field| !field["flags"].to_string().contains("incomplete"));
        totals.extend(whole.and_then(|field| field["total"].as_f64()));
    }
    assert_eq!(code_of(&mut child), Some(0));
    let wipers = board.wipers();
    assert!(
        (0..).zip(&wanted).all(|(channel, wiper)| wiper.is_none_or(|wiper| u64::from(wiper) == wipers[channel])),
        "{wipers:?}"
    );
    // The linear signal is 100 a newton, to the converter's step: nine taxels of 2 N + 0.15 N each.
    let force: f64 = (16..25).filter_map(firm).sum();
    let right = totals.iter().filter(|total| (*total / 100.0 - force).abs() < 0.05 * force).count();
    assert!(right > 100 && totals.len() - right <= 10, "{force} N: {right} of {}: {totals:?}", totals.len());

    // A calibration at other wiper positions is refused; a name says which.
    std::fs::write(&fsr, "[all]\nsensor = \"fsr\"\nwiper = 38\n").unwrap();
    let output = somatic(&[&run[..], &["--for", "1s"]].concat()).output().unwrap();
    let said = super::stderr(&output);
    assert!(output.status.code() == Some(1) && said.contains("and the calibration has wiper 38"), "{said}");
}

#[test]
fn an_interrupted_tuning_puts_all_wipers_back() {
    let folder = tempfile::tempdir().unwrap();
    let mut boards = [Touched::start(folder.path(), "hand", HAND, &[])];
    let source = boards[0].port.clone();
    let output = folder.path().join("tuned.toml");
    let arguments = [&TUNE[..], &["--source", &source, "--wiring", HAND, "-o", text_of(&output)]].concat();
    let (_, said, code) = guided(&arguments, &mut boards, Some("once more"));
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("setting 39 wipers") && said.contains("all wipers are as they were at first"), "{said}");
    let [board] = boards;
    let wipers = board.wipers();
    let wired = Wiring::load(HAND).unwrap().boards()[0].taxels.clone();
    assert!(
        wired.iter().zip(&wipers).all(|(taxel, wiper)| *wiper == if taxel.is_some() { 3 } else { 38 }),
        "{wipers:?}"
    );
    assert!(!output.exists());
}

#[test]
fn boards_that_set_no_wipers_are_named_and_the_others_are_tuned() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let board = |id: u32, first: u32| {
        format!("[[board]]\nid = {id}\ntaxels = [{{ channel = 0, first = {first}, count = 4 }}]\n")
    };
    let [one, two] = [board(1, 0), board(2, 16)];
    let both = file("both.toml", &format!("{one}{two}"));
    let mut boards = [
        Touched::start(folder.path(), "one", &file("one.toml", &one), &[]),
        Touched::start(folder.path(), "two", &file("two.toml", &two), &["--wipers", "unknown"]),
    ];
    let [first, second] = boards.each_ref().map(|board| board.port.clone());
    let arguments = [&TUNE[..], &["--source", &first, "--source", &second, "--wiring", &both]].concat();
    let (text, said, code) = guided(&arguments, &mut boards, None);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("board 2 does not know `wiper`; 4 of its channels stay as they are"), "{said}");
    assert!(text.contains("board 2 refuses `wiper`: taxel 16, 17, 18, 19"), "{text}");
    let sensors = sensors(&text);
    let which = |key: &str| -> Vec<u64> { sensors.iter().filter(|(_, s)| s[key] == true).map(|(id, _)| *id).collect() };
    assert_eq!((which("fits"), which("acknowledged")), (vec![0, 1, 2, 3], vec![0, 1, 2, 3]));

    let deaf = Touched::start(folder.path(), "deaf", HAND, &["--wipers", "ignored"]);
    let source = deaf.port.clone();
    let start = Instant::now();
    let (_, said, code) = guided(&[&TUNE[..], &["--source", &source, "--wiring", HAND]].concat(), &mut [deaf], None);
    assert!(code == Some(1) && said.contains("board 1 does not answer `wiper`; 40 of its channels"), "{said}");
    assert!(said.contains("no board sets a wiper") && start.elapsed() < Duration::from_secs(15), "{said}");
}

#[test]
fn what_makes_no_sense_is_reported_before_anything_is_set() {
    let refused = |arguments: &[&str]| super::fails(2, &[&["tune"], arguments].concat());
    assert!(refused(&["--source", "a.csv", "--press", "3"]).contains("give --source serial:PORT"));
    assert!(refused(&["--source", "serial:a"]).contains("is not a terminal; give --press"));
    assert!(refused(&["--source", "serial:a", "--press", "0"]).contains("must be over 0"));
    assert!(refused(&["--source", "serial:a", "--press", "3", "--wiper", "256"]).contains("256"));
    assert!(refused(&["--source", "serial:a", "--source", "-", "--press", "3"]).contains("only serial lines"));
    let (_folder, path) = super::file("there.toml", "mine");
    let why = super::fails(1, &["tune", "--source", "serial:a", "--press", "3", "-o", text_of(&path)]);
    assert!(why.contains("it exists") && why.contains("--force") && std::fs::read_to_string(&path).unwrap() == "mine");
    let why = super::fails(1, &["tune", "--source", "serial:/no/such/port", "--press", "3"]);
    assert!(why.contains("there is no such port"), "{why}");
}

#[test]
fn a_calibration_is_made_live_with_a_wiring_and_rates() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let mut boards = [Touched::start(folder.path(), "hand", HAND, &[])];
    let (source, toml) = (boards[0].port.clone(), at("hand.toml"));
    let first =
        ["calibrate", "--body", "hand", "--source", &source, "--wiring", HAND, "--bits", "10", "--json", "-o", &toml];
    let rates = ["--board-rate", "40", "--live-rate", "20", "--rest", "1", "--press", "2.5"];
    let (text, said, code) = guided(&[&first[..], &rates].concat(), &mut boards, None);
    assert_eq!(code, Some(0), "{said}");
    let found: Value = serde_json::from_str(&text).unwrap();
    for sensor in found["sensors"].as_array().unwrap() {
        let id = sensor["taxel"].as_u64().unwrap() as u32;
        let travel = firm(id).map(|newton| 1023.0 - f64::from(FsrCircuit::default().counts(newton)));
        assert_eq!((sensor["baseline"].as_f64(), sensor["travel"].as_f64()), (Some(1023.0), travel), "{sensor}");
    }
    let why =
        super::fails(2, &["calibrate", "--body", "hand", "--source", "a.csv", "--wiring", HAND, "-o", &at("a.toml")]);
    assert!(why.contains("--wiring is for boards on serial lines"), "{why}");
}
