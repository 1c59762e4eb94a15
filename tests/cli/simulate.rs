//! Simulated touches from the command line.

use crate::{done, fails, frames, somatic, stderr};

const ROD: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/simulations/rod.toml");

#[test]
fn a_simulation_is_written_with_its_truth_and_runs_the_same_from_both() {
    let folder = tempfile::tempdir().unwrap();
    let csv = folder.path().join("rod.csv");
    done(&["simulate", ROD, "-o", csv.to_str().unwrap()]);
    let truth = std::fs::read_to_string(folder.path().join("rod.truth.csv")).unwrap();
    assert!(truth.starts_with("t,frame,touch,") && truth.lines().count() > 20);
    let calibration = folder.path().join("rod.calibration.toml");
    let calibrated = ["--calibration", calibration.to_str().unwrap()];
    let from_file = done(&[&["run", "--source", csv.to_str().unwrap(), "--backend", "cpu"][..], &calibrated].concat());
    let direct = done(&["run", "--source", &format!("sim:{ROD}"), "--backend", "cpu"]);
    assert!(from_file == direct && frames(&direct).len() > 20);
}

/// How far the centroid's v is from the truth over frames of rod.toml, RMS in mm, and the fields that are touched in the
/// frames before the rod comes down.
fn rod_is_seen(percepts: &str) -> (f64, usize) {
    let (mut squares, mut compared, mut untouched) = (0.0, 0.0, 0);
    for frame in frames(percepts) {
        let t_s = frame["t"].as_f64().unwrap();
        let fields = frame["fields"].as_array().unwrap();
        let back = fields.iter().find(|field| field["field"] == "hand/back");
        untouched += if t_s < 0.5 { fields.len() } else { 0 };
        if let Some(back) = back.filter(|_| (0.7..=3.3).contains(&t_s)) {
            let off_m = back["centroid"][1].as_f64().unwrap() - (0.015 - 0.01 * (t_s - 0.5));
            (squares, compared) = (squares + off_m * off_m * 1e6, compared + 1.0);
        }
    }
    assert!(compared > 120.0, "{compared}");
    ((squares / compared).sqrt(), untouched)
}

#[test]
fn a_simulation_is_read_by_its_own_calibration_unless_another_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let sim = format!("sim:{ROD}");
    let run = ["run", "--source", &sim, "--backend", "cpu"];
    let output = somatic(&run).output().unwrap();
    assert_eq!(stderr(&output), "");
    let own = String::from_utf8(output.stdout).unwrap();
    let (off_mm, untouched) = rod_is_seen(&own);
    assert!(off_mm < 1.5 && untouched == 0, "{off_mm} mm, {untouched}");
    // An empty file leaves raw values, which fall when pressed.
    let empty = folder.path().join("empty.toml");
    std::fs::write(&empty, "").unwrap();
    let raw = done(&[&run[..], &["--calibration", empty.to_str().unwrap()]].concat());
    let (off_mm, untouched) = rod_is_seen(&raw);
    assert!(off_mm > 5.0 && untouched > 25, "{off_mm} mm, {untouched}");

    // What is recorded has it beside it, whoever records.
    let (ran, converted) = (folder.path().join("ran.mcap"), folder.path().join("converted.mcap"));
    done(&[&run[..], &["--sink", &format!("mcap:{}", ran.display())]].concat());
    done(&["convert", &sim, converted.to_str().unwrap()]);
    for recording in [ran, converted] {
        let again = done(&["run", "--source", recording.to_str().unwrap(), "--backend", "cpu"]);
        assert!(again == own, "{}", recording.display());
    }
}

#[test]
fn a_simulation_brings_its_body() {
    let mat = concat!("sim:", env!("CARGO_MANIFEST_DIR"), "/examples/simulations/mat.toml");
    let text = done(&["run", "--source", mat, "--backend", "cpu", "--fields", "mat", "--outputs", "total"]);
    assert!(frames(&text).iter().any(|frame| frame["fields"][0]["field"] == "mat"));
}

#[test]
fn what_cannot_be_simulated_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let (toml, csv) = (folder.path().join("bad.toml"), folder.path().join("bad.csv"));
    std::fs::write(&toml, "body = \"hand\"\nrate_hz = 0\nduration_s = 1\n").unwrap();
    let line = fails(1, &["simulate", toml.to_str().unwrap(), "-o", csv.to_str().unwrap()]);
    assert!(line.contains("bad.toml") && line.contains("rate_hz") && line.lines().count() == 1, "{line}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn without_a_driver_auto_says_so_once_and_runs_on_the_cpu() {
    let output = somatic(&["run"]).env("VK_DRIVER_FILES", "/nonexistent").output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(frames(&String::from_utf8_lossy(&output.stdout)).len(), 280);
    let reported = stderr(&output);
    if cfg!(target_os = "linux") {
        assert_eq!(reported.matches("no GPU driver answers").count(), 1, "{reported}");
        let refused = somatic(&["run", "--backend", "gpu"]).env("VK_DRIVER_FILES", "/nonexistent").output().unwrap();
        assert_eq!(refused.status.code(), Some(1));
        assert!(stderr(&refused).contains("no GPU driver answers") && refused.stdout.is_empty());
    }
}
