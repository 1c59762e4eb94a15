//! Whether something can touch the taxels that `author` places, by rays of another program, in Python.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::python::python_with;
use crate::stderr;
use somatic_testing::skip;

/// What `tests/hidden/escape.py` finds on `files` with these numbers of `taxels`; `None` without Python, which is reported.
fn checked(taxels: &str, files: &[&str]) -> Option<Value> {
    let python = match python_with("hidden", "import embreex, numpy, trimesh") {
        Ok(python) => python,
        Err(why) => {
            skip("PYTHON", why);
            return None;
        }
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hidden/escape.py");
    let mut command = Command::new(python);
    let output = command.arg(script).args([env!("CARGO_BIN_EXE_somatic"), taxels]).args(files).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    eprintln!("{}", stderr(&output));
    Some(serde_json::from_slice(&output.stdout).unwrap())
}

/// At most 0.2 % of the taxels of each file are where nothing can touch them, and links have their shares.
fn assert_open(found: &Value) {
    for (file, found) in found.as_object().unwrap() {
        let number = |key: &str| found[key].as_f64().unwrap_or_else(|| panic!("{file}: {found}"));
        assert!(number("hidden") <= 0.002 * number("taxels"), "{file}: {found}");
        assert_eq!(found["by_link"], serde_json::json!([]), "{file}");
    }
}

#[test]
fn rays_of_another_program_leave_every_taxel() {
    let Some(found) = checked("200", &["hand"]) else { return };
    assert_open(&found);
    // The check sees what it is for: with hidden surface, an eighth of the hand's taxels are closed.
    let Some(kept) = checked("200", &["hand", "--keep"]) else { return };
    assert!(kept["hand"]["closed"].as_f64().unwrap() > 10.0, "{kept}");
}

#[test]
#[ignore = "takes minutes"]
fn rays_of_another_program_leave_the_taxels_of_bundled_bodies_and_meshes() {
    let root = std::env::var("SOMATIC_DATA").unwrap_or_else(|_| "../shared/data".to_owned());
    let meshes = [
        "webxr/generic-hand_left.glb",
        "blender_io/03_skinned_cylinder/03_skinned_cylinder.gltf",
        "blender_io/02_suzanne/02_suzanne.gltf",
    ];
    let meshes: Vec<String> = meshes.iter().map(|mesh| format!("{root}/meshes/{mesh}")).collect();
    let mut files = vec!["hand", "humanoid"];
    match meshes.iter().find(|mesh| !Path::new(mesh).exists()) {
        Some(missing) => skip("DATA", format!("{missing} is not there; set SOMATIC_DATA to the folder that has it")),
        None => files.extend(meshes.iter().map(String::as_str)),
    }
    for taxels in ["500", "2000"] {
        let Some(found) = checked(taxels, &files) else { return };
        assert_open(&found);
    }
}
