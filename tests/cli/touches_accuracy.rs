//! The programs that measure how true touches are (`docs/evidence/touches.md`, `docs/evidence/placement.md`), on a few presses.

use std::path::Path;
use std::process::Command;

use serde_json::Value;
use somatic_testing::skip;

use crate::python::python_with;
use crate::{stderr, text_of};

/// What a program of `tests/touches` prints, `None` without Python, which is said.
fn printed(script: &str, flags: &[&str]) -> Option<String> {
    let python = match python_with("touches", "import numpy") {
        Ok(python) => python,
        Err(why) => {
            skip("PYTHON", why);
            return None;
        }
    };
    let folder = tempfile::tempdir().unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/touches").join(script);
    let arguments = [text_of(&script), env!("CARGO_BIN_EXE_somatic"), text_of(folder.path())];
    let threads = ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"].map(|name| (name, "1"));
    let output = Command::new(python).args(arguments).args(flags).envs(threads).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    Some(String::from_utf8(output.stdout).unwrap())
}

#[test]
fn presses_strokes_and_pairs_are_measured_against_the_truth() {
    let Some(text) = printed("accuracy.py", &["--body", "hand", "--presses", "4", "--strokes", "2", "--pairs", "4"])
    else {
        return;
    };
    let found: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(found["presses"]["flat"], 4);
    // On the sheet a place is off by a small part of the spacing.
    let (flat_mm, spacing_mm) = (&found["presses"]["position, all"]["flat_median"], &found["presses"]["spacing_mm"]);
    assert!((0.0..0.1 * spacing_mm.as_f64().unwrap()).contains(&flat_mm.as_f64().unwrap()), "{flat_mm} {spacing_mm}");
    assert_eq!(found["strokes"]["strokes"], 2);
    assert_eq!(found["pairs"]["gains 0.05"]["ball"]["as_many_as_wanted"], 1.0);
}

#[test]
fn touches_are_truer_on_even_taxels() {
    let flags = ["--on", "cylinder", "--taxels", "250", "--presses", "6", "--layers", "0.4"];
    let Some(text) = printed("even.py", &flags) else { return };
    let rows: Vec<Vec<&str>> = text.lines().skip(3).map(|row| row.split('|').map(str::trim).collect()).collect();
    assert_eq!(rows.len(), 4, "{text}");
    for row in rows {
        let ratio: f64 = row[7].split(' ').next().unwrap().parse().unwrap();
        assert!(row[4] == "6" && (0.0..0.7).contains(&ratio), "{text}");
    }
}
