//! Skins put on meshes from the command line, and fed.

use std::fmt::Write as _;
use std::path::Path;

use serde_json::Value;

use crate::{done, fails, file, files_in, frames, text_of};

/// A folder, and in it the humanoid with 300 taxels.
fn skin(more: &[&str]) -> (tempfile::TempDir, std::path::PathBuf, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skin.glb");
    let text = done(&[&["author", "humanoid", "-o", text_of(&path)], more].concat());
    (folder, path, text)
}

#[test]
fn a_mesh_gets_a_skin_that_is_inspected_and_run() {
    let (folder, path, text) = skin(&["--taxels", "300", "--seed", "1"]);
    assert!(text.contains("300 taxels in 17 fields") && text.contains("0–299") && text.contains("least mm"), "{text}");
    let told: Value = serde_json::from_str(&done(&["inspect", text_of(&path), "--json"])).unwrap();
    assert_eq!(told["taxels"].as_array().unwrap().len(), 300);
    // Each taxel pressed in its turn is felt by the field of its link.
    let mut csv = format!("t,{}\n", (0..300).map(|id| id.to_string()).collect::<Vec<_>>().join(","));
    for frame in 0..300 {
        let row: Vec<&str> = (0..300).map(|id| if id == frame { "50" } else { "0" }).collect();
        writeln!(csv, "{},{}", f64::from(frame) * 0.01, row.join(",")).unwrap();
    }
    let touch = folder.path().join("touch.csv");
    std::fs::write(&touch, csv).unwrap();
    let percepts = done(&["run", "--body", text_of(&path), "--source", text_of(&touch), "--backend", "cpu"]);
    let felt = frames(&percepts);
    assert_eq!(felt.len(), 300);
    for (frame, taxel) in felt.iter().zip(told["taxels"].as_array().unwrap()) {
        let [field] = &frame["fields"].as_array().unwrap()[..] else { panic!("{frame}") };
        assert_eq!((&field["field"], &field["total"]), (&taxel["link"], &Value::from(50.0)));
    }
}

#[test]
fn a_recipe_places_region_by_region_and_says_so_as_json() {
    let (folder, recipe) = file(
        "recipe.toml",
        "seed = 3\n[regions.head]\nnode = \"head\"\n[regions.arms]\nnode = \"*arm*\"\n\
         [[place]]\nregion = \"head\"\nfirst_id = 0\ntaxels = 40\n\
         [[place]]\nregion = \"arms\"\nfirst_id = 1000\nspacing = \"15 mm\"\nmodality = \"temperature\"\n",
    );
    let output = folder.path().join("out.gltf");
    let text = done(&["author", "humanoid", "--recipe", text_of(&recipe), "-o", text_of(&output), "--json"]);
    let told: Value = serde_json::from_str(&text).unwrap();
    let [head, arms] = &told["places"].as_array().unwrap()[..] else { panic!("{told}") };
    assert_eq!((&head["name"], &head["ids"]), (&"head".into(), &serde_json::json!([[0, 39]])));
    assert_eq!(head["links"], serde_json::json!({"head": 40}));
    assert!(arms["spacing"]["least"].as_f64().unwrap() >= 0.015, "{arms}");
    let body: Value = serde_json::from_str(&done(&["inspect", text_of(&output), "--json"])).unwrap();
    let taxels = body["taxels"].as_array().unwrap();
    assert_eq!(taxels.len() as u64, told["taxels"].as_u64().unwrap());
    assert!(taxels.iter().all(|taxel| (taxel["modality"] == "temperature") == (taxel["id"].as_u64().unwrap() >= 1000)));
}

#[test]
fn nothing_is_overwritten_unless_forced() {
    let (folder, path, _) = skin(&["--taxels", "300"]);
    let before = std::fs::read(&path).unwrap();
    let again = ["author", text_of(&path), "--taxels", "20", "-o", text_of(&path)];
    let line = fails(1, &again);
    assert!(line.contains("--force") && line.lines().count() == 1, "{line}");
    assert!(std::fs::read(&path).unwrap() == before);
    done(&[&again[..], &["--force"]].concat());
    assert!(std::fs::read(&path).unwrap() != before);
    assert_eq!(files_in(folder.path()), ["skin.glb"]);
}

#[test]
fn what_cannot_be_authored_is_one_line_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out.glb");
    let out = text_of(&output);
    let one = |code: i32, arguments: &[&str], word: &str| {
        let line = fails(code, arguments);
        assert!(line.contains(word) && line.lines().count() == 1, "{arguments:?}: {line}");
        assert!(!Path::new(out).exists());
    };
    one(2, &["author", "humanoid", "-o", out], "--taxels");
    one(1, &["author", "humanoid", "--taxels", "0", "-o", out], "--taxels: 0 taxels");
    one(2, &["author", "humanoid", "--spacing", "8", "-o", out], "--spacing: `8` has no unit");
    one(1, &["author", "humanoid", "--taxels", "100", "--spacing", "1m", "-o", out], "do not fit");
    one(1, &["author", "humanoid", "--taxels", "9", "--region", "haed", "-o", out], "did you mean `head`?");
    one(2, &["author", "humanoid", "--taxels", "9", "--unit", "inch", "-o", out], "--unit");
    one(1, &["author", "humanoyd", "--taxels", "9", "-o", out], "did you mean the bundled body `humanoid`?");
    one(1, &["author", "humanoid", "--recipe", "/no/such.toml", "-o", out], "no such file");
    one(2, &["author", "humanoid", "--taxels", "9", "-o", "body.stl"], "a .glb or a .gltf");
    one(1, &["author", "humanoid", "--taxels", "9", "-o", "/no/such/folder/out.glb"], "no such file or directory");
    assert!(fails(2, &["author", "humanoid", "--recipe", "r.toml", "--taxels", "9", "-o", out]).contains("--recipe"));
    assert_eq!(files_in(folder.path()), [""; 0]);
}

#[test]
fn help_teaches_recipes() {
    let help = done(&["author", "--help"]);
    for word in ["--recipe", "--spacing", "Examples:", "[[place]]", "--force", "mm"] {
        assert!(help.contains(word), "{word}: {help}");
    }
}
