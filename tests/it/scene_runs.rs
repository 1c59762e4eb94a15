//! Scenes that a program runs without the command.

use std::path::Path;
use std::sync::{Arc, Mutex};

use somatic::error::ErrorKind;
use somatic::run::{Observer, Remark, Run, Tell};
use somatic::scene::file::SceneFile;

/// Who writes down what is remarked.
#[derive(Default)]
struct Listener {
    remarks: Vec<String>,
    frames: usize,
    began: usize,
}

impl Observer for Listener {
    fn remark(&mut self, _: Remark, text: &str) {
        self.remarks.push(text.to_owned());
    }

    fn computed(&mut self, _: &somatic::Engine, frames: &[somatic::Frame], _: &somatic::run::FrameInfo) {
        self.frames += frames.len();
    }

    fn began(&mut self, _: &str, _: &somatic::Engine, _: &[u32]) {
        self.began += 1;
    }
}

fn scene(folder: &Path, text: &str) -> SceneFile {
    let file = folder.join("a.scene.toml");
    std::fs::write(&file, text).unwrap();
    SceneFile::load(&file).unwrap()
}

#[test]
fn a_scene_becomes_a_file_of_percepts() {
    let folder = tempfile::tempdir().unwrap();
    let text = "backend = \"cpu\"\nfields = \"hand/palm*\"\noutputs = [\"total\"]\nsink = [\"ndjson:a.ndjson\", \"csv:a.csv\"]\n";
    let mut run = Run::of(scene(folder.path(), text), &Tell::default()).unwrap();
    let mut listener = Listener::default();
    let ending = run.run(&mut listener, || false).unwrap();
    assert!(!folder.path().join("a.csv").exists(), "a table of a recording appears when it is whole");
    let outcome = run.finish(ending).unwrap();
    let lines = std::fs::read_to_string(folder.path().join("a.ndjson")).unwrap();
    assert_eq!((outcome.frames as usize, listener.frames), (lines.lines().count(), lines.lines().count()));
    assert!(lines.contains("hand/palm") && !lines.contains("centroid") && !lines.contains("hand/thumb"));
    assert!(folder.path().join("a.csv").exists() && outcome.losses.is_empty() && !outcome.has_failed);
}

#[test]
fn several_recordings_are_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let text = include_str!("../../bodies/touch.csv");
    for name in ["a.csv", "b.csv"] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    let keys = "source = [\"a.csv\", \"b.csv\"]\nsink = \"csv:both.csv\"\noutputs = \"total\"\n";
    let mut run = Run::of(scene(folder.path(), keys), &Tell::default()).unwrap();
    let mut listener = Listener::default();
    let ending = run.run(&mut listener, || false).unwrap();
    let outcome = run.finish(ending).unwrap();
    let frames = 2 * (text.lines().count() - 1);
    assert_eq!((outcome.frames as usize, listener.frames, listener.began), (frames, frames, 1));
    let both = std::fs::read_to_string(folder.path().join("both.csv")).unwrap();
    let of =
        |name: &str| -> Vec<&str> { both.lines().filter_map(|row| row.split_once(name)).map(|(_, row)| row).collect() };
    assert!(of("a.csv").len() > 50 && of("a.csv") == of("b.csv"));
    // Interrupted in the second one, there is no part of a table.
    let keys = keys.replace("both", "cut");
    let mut run = Run::of(scene(folder.path(), &keys), &Tell::default()).unwrap();
    let began = std::cell::Cell::new(0);
    let ending = run.run(&mut Counter(&began), || began.get() > 0).unwrap();
    let outcome = run.finish(ending).unwrap();
    assert!(outcome.losses[0].contains("b.csv: interrupted before its first frame"), "{:?}", outcome.losses);
    assert!(!folder.path().join("cut.csv").exists());
}

/// Who counts the recordings after the first one.
struct Counter<'a>(&'a std::cell::Cell<usize>);

impl Observer for Counter<'_> {
    fn began(&mut self, _: &str, _: &somatic::Engine, _: &[u32]) {
        self.0.set(self.0.get() + 1);
    }
}

#[test]
fn a_run_that_is_ended_early_leaves_no_part_of_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let mut run = Run::of(scene(folder.path(), "sink = \"csv:a.csv\"\nbatch = 1\n"), &Tell::default()).unwrap();
    let ending = run.run(&mut (), || true).unwrap();
    let outcome = run.finish(ending).unwrap();
    assert!(outcome.losses[0].contains("interrupted before its first frame"), "{:?}", outcome.losses);
    assert!(!folder.path().join("a.csv").exists());
}

#[test]
fn what_a_scene_finds_out_is_reported_once_and_in_keys() {
    let folder = tempfile::tempdir().unwrap();
    let export = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/exports/insoles.csv");
    std::fs::write(folder.path().join("cal.toml"), "[all]\ndead_band = 2\n").unwrap();
    let reported = Arc::new(Mutex::new(Vec::new()));
    let to = Arc::clone(&reported);
    let tell = Tell::new(move |line| to.lock().unwrap().push(line.to_owned()));
    let text = format!("source = {:?}\ncalibration = \"cal.toml\"\n", export.display().to_string());
    drop(Run::of(scene(folder.path(), &format!("{text}quiet = true\n")), &tell).unwrap());
    assert!(reported.lock().unwrap().is_empty());
    drop(Run::of(scene(folder.path(), &text), &tell).unwrap());
    let reported = reported.lock().unwrap();
    let stays = reported.iter().filter(|line| line.contains("this stays under `calibration`: unit = \"mmHg\""));
    assert_eq!(stays.count(), 1, "{reported:?}");
}

#[test]
fn errors_of_scenes_speak_of_keys() {
    let folder = tempfile::tempdir().unwrap();
    for (text, says) in [
        ("body = \"mat\"\n", "needs a `source`"),
        ("source = \"-\"\nfrom_s = 1.0\n", "`from_s`, `to_s` and `loop` are for recordings"),
        ("[accuracy]\nbudget = \"1 ms\"\n", "tolerances and a budget are met by measuring"),
    ] {
        let error = Run::of(scene(folder.path(), text), &Tell::default()).err().unwrap();
        assert_eq!(error.kind(), ErrorKind::Usage, "{error}");
        assert!(error.to_string().contains(says), "{error}");
    }
}
