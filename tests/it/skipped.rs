//! Skipped tests are reported where people look.

use std::path::Path;
use std::process::Command;

/// Runs a test of this binary that needs real meshes, where there are none; gives whether it passed, and what is written
/// to the file of skips.
fn without_data(required: &str) -> (bool, String) {
    let folder = tempfile::tempdir().unwrap();
    let skips = folder.path().join("skips");
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "meshes::a_hand_of_25_joints"]).env("SOMATIC_DATA", folder.path());
    let output = command.env("SOMATIC_SKIPS", &skips).env("SOMATIC_REQUIRE_DATA", required).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("running 1 test"), "{said}");
    (output.status.success(), std::fs::read_to_string(skips).unwrap_or_default())
}

#[test]
fn a_skip_leaves_its_reason_and_fails_where_what_it_needs_is_required() {
    for required in ["", "0"] {
        let (passed, skips) = without_data(required);
        assert!(passed && skips.lines().count() == 1, "{skips}");
        let columns: Vec<&str> = skips.trim().split('\t').collect();
        assert!(columns[1].contains("generic-hand_left.glb is not there; set SOMATIC_DATA"), "{skips}");
        assert_eq!([columns[0], columns[2]], ["DATA", "meshes::a_hand_of_25_joints"]);
    }
    assert_eq!(without_data("1"), (false, String::new()));
}

#[test]
fn every_skip_goes_through_the_helper() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (mut open, mut looked_at) = (["tests", "src", "crates"].map(|folder| root.join(folder)).to_vec(), 0);
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let skips = ["tests/shared/lib.rs", "tests/it/skipped.rs"].iter().any(|own| path.ends_with(own));
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") && !skips {
                let text = std::fs::read_to_string(&path).unwrap();
                let by_itself = ["\"SKIPPED", "SOMATIC_REQUIRE_"].iter().find(|word| text.contains(**word));
                assert_eq!(by_itself, None, "{}: use tests/shared", path.display());
                looked_at += 1;
            }
        }
    }
    assert!(looked_at > 200, "{looked_at}");
}
