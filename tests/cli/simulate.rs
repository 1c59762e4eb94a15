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
    let from_file = done(&["run", "--source", csv.to_str().unwrap(), "--backend", "cpu"]);
    let direct = done(&["run", "--source", &format!("sim:{ROD}"), "--backend", "cpu"]);
    assert!(from_file == direct && frames(&direct).len() > 20);
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
    let told = stderr(&output);
    if cfg!(target_os = "linux") {
        assert_eq!(told.matches("no GPU driver answers").count(), 1, "{told}");
        let refused = somatic(&["run", "--backend", "gpu"]).env("VK_DRIVER_FILES", "/nonexistent").output().unwrap();
        assert_eq!(refused.status.code(), Some(1));
        assert!(stderr(&refused).contains("no GPU driver answers") && refused.stdout.is_empty());
    }
}
