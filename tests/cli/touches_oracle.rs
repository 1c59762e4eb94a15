//! Touches of the whole body against a definition of its own in Python, on random recordings.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::python::python_with;
use crate::{stderr, text_of};
use somatic_testing::skip;

/// What `tests/touches/oracle.py` finds on random recordings, `None` without Python, which is said.
fn random(flags: &[&str]) -> Option<Value> {
    found("touches/oracle.py", &["random"], flags)
}

/// What a script in `tests/` finds of the command in a folder of its own: it gets the words `first`, the command, the folder and `flags`,
/// and prints JSON. `None` without Python, which is said.
pub(super) fn found(script: &str, first: &[&str], flags: &[&str]) -> Option<Value> {
    let python = match python_with("touches", "import numpy") {
        Ok(python) => python,
        Err(why) => {
            skip("PYTHON", why);
            return None;
        }
    };
    let folder = tempfile::tempdir().unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(script);
    let own = [env!("CARGO_BIN_EXE_somatic"), text_of(folder.path())];
    // Matrices are small: threads cost more than they bring.
    let threads = ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"].map(|name| (name, "1"));
    let output = Command::new(python).arg(script).args(first).args(own).args(flags).envs(threads).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    eprintln!("{}{text}", stderr(&output));
    Some(serde_json::from_str(&text).unwrap())
}

fn assert_right(found: &Value, touches: u64) {
    assert_eq!(found["wrong"], 0, "{}", found["examples"]);
    assert_eq!(found["missed"], serde_json::json!([]), "changed, and not found to be wrong");
    let number = |key: &str| found[key].as_u64().unwrap();
    assert!(number("touches") >= touches, "{found}");
    let excluded: u64 = found["excluded"].as_object().unwrap().values().map(|number| number.as_u64().unwrap()).sum();
    assert!(excluded * 20 < number("touches"), "too many choices are too close to call: {found}");
    assert!(number("placed") * 2 > number("touches"), "too few positions have cells that are certain: {found}");
}

#[test]
fn touches_are_those_of_a_definition_of_its_own() {
    let Some(found) = random(&[]) else { return };
    assert_right(&found, 2000);
}

#[test]
#[ignore = "takes many minutes"]
fn a_hundred_thousand_touches_are_those_of_a_definition_of_its_own() {
    let Some(found) = random(&["--long"]) else { return };
    assert_right(&found, 100_000);
}
