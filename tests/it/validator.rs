//! The Khronos glTF validator on what the crate writes. It comes from npm; without node, or a network to install it from,
//! this is a skip.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use serde_json::Value;
use somatic::author::{Recipe, author};
use somatic::internal::body::Original;

use crate::common::data;
use somatic_testing::skip;

/// The folder with the installed validator, or why there is none.
fn installed() -> Result<PathBuf, String> {
    static ONCE: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    ONCE.get_or_init(install).clone()
}

fn install() -> Result<PathBuf, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("validator");
    std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
    for name in ["package.json", "package-lock.json", "validate.cjs"] {
        std::fs::copy(root.join("tests/validator").join(name), folder.join(name)).map_err(|e| e.to_string())?;
    }
    if !folder.join("node_modules/gltf-validator").is_dir() {
        let mut npm = Command::new("npm");
        npm.args(["ci", "--no-audit", "--no-fund", "--ignore-scripts"]).current_dir(&folder);
        let output = npm.output().map_err(|e| format!("npm cannot be run: {e}"))?;
        if !output.status.success() {
            return Err(format!("npm could not install it: {}", String::from_utf8_lossy(&output.stderr).trim()));
        }
    }
    Ok(folder)
}

/// What the validator says of each file; `None` where it is not to be had and not required.
pub(crate) fn reports(files: &[PathBuf]) -> Option<Vec<Value>> {
    let run = || -> Result<String, String> {
        let folder = installed()?;
        let output = Command::new("node").arg(folder.join("validate.cjs")).args(files).output();
        let output = output.map_err(|e| format!("node cannot be run: {e}"))?;
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        if output.status.success() { Ok(String::from_utf8_lossy(&output.stdout).into_owned()) } else { Err(said) }
    };
    match run() {
        Ok(text) => Some(text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()),
        Err(why) => {
            skip("VALIDATOR", format!("no glTF validator: {why}"));
            None
        }
    }
}

#[test]
fn the_validator_has_no_complaint_about_the_bundled_bodies() {
    let bodies = Path::new(env!("CARGO_MANIFEST_DIR")).join("bodies");
    let files: Vec<PathBuf> = somatic::bundled::BODIES.map(|name| bodies.join(format!("{name}.glb"))).into();
    let Some(reports) = reports(&files) else { return };
    assert_eq!(reports.len(), files.len());
    for report in reports {
        assert_eq!((&report["errors"], &report["warnings"]), (&0.into(), &0.into()), "{report:#}");
    }
}

#[test]
fn the_validator_finds_no_error_in_what_is_authored_on_other_tools_meshes() {
    let folder = tempfile::tempdir().unwrap();
    let recipe = Recipe::simple(Some(200), None, &[]).unwrap();
    let mut files = Vec::new();
    for part in [
        "meshes/webxr/generic-hand_left.glb",
        "meshes/blender_io/02_suzanne/02_suzanne.gltf",
        "meshes/blender_io/03_skinned_cylinder/03_skinned_cylinder.gltf",
        "meshes/blender_io/06_parent-inverse-anim/06_parent-inverse-anim.gltf",
    ] {
        let Some(path) = data(part) else { return };
        let made = author(Original::open(path).unwrap(), &recipe, |_| {}).unwrap();
        let file = folder.path().join(format!("{}.glb", files.len()));
        std::fs::write(&file, made.file.to_glb().unwrap()).unwrap();
        files.push(file);
    }
    let Some(reports) = reports(&files) else { return };
    assert_eq!(reports.len(), files.len());
    for report in reports {
        assert_eq!(report["errors"], 0, "{report:#}");
    }
}

#[test]
fn the_validator_complains_of_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("broken.gltf");
    std::fs::write(&path, r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[7]}]}"#).unwrap();
    let Some(reports) = reports(&[path]) else { return };
    assert_eq!(reports[0]["errors"], 1, "{:#}", reports[0]);
}
