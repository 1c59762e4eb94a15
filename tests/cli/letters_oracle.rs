//! Shear, temperature and proximity against a definition of their own in Python, on random bodies, calibrations and frames.

use std::path::Path;
use std::process::Command;

use serde_json::Value;
use somatic_testing::skip;

use crate::python::python_with;
use crate::{stderr, text_of};

/// What `tests/letters/oracle.py` finds, `None` without Python, which is said.
fn found(flags: &[&str]) -> Option<Value> {
    let python = match python_with("touches", "import numpy") {
        Ok(python) => python,
        Err(why) => {
            skip("PYTHON", why);
            return None;
        }
    };
    let folder = tempfile::tempdir().unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/letters/oracle.py");
    let arguments = [text_of(&script), env!("CARGO_BIN_EXE_somatic"), text_of(folder.path())];
    let threads = ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"].map(|name| (name, "1"));
    let output = Command::new(python).args(arguments).args(flags).envs(threads).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    eprintln!("{}{text}", stderr(&output));
    Some(serde_json::from_str(&text).unwrap())
}

fn assert_right(found: &Value, cells: u64) {
    assert_eq!(found["wrong"], 0, "{}", found["examples"]);
    assert_eq!(found["missed"], serde_json::json!([]), "changed, and not found to be wrong");
    assert!(found["cells"].as_u64().unwrap() >= cells, "{}", found["cells"]);
    // Each quantity was there often.
    let present = found["present"].as_object().unwrap();
    assert_eq!(present.len(), 24);
    assert!(present.values().all(|number| number.as_u64().unwrap() * 200 >= cells), "{present:?}");
}

#[test]
fn letters_are_those_of_a_definition_of_its_own() {
    let Some(found) = found(&[]) else { return };
    assert_right(&found, 10_000);
}

#[test]
#[ignore = "takes minutes"]
fn a_million_cells_are_those_of_a_definition_of_its_own() {
    let Some(found) = found(&["--long"]) else { return };
    assert_right(&found, 1_000_000);
}
