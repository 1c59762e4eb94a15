//! Files that are compressed, LeRobot datasets, and files that are known and not read.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::{done, fails, file, text_of};

/// `bytes` in a `.gz` called `name`.
fn packed(name: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let mut file = flate2::write::GzEncoder::new(std::fs::File::create(&path).unwrap(), flate2::Compression::fast());
    file.write_all(bytes).unwrap();
    file.finish().unwrap();
    (folder, path)
}

#[test]
fn a_recording_in_gz_gives_what_it_gives_unpacked() {
    let touch = somatic::bundled::TOUCH;
    let (_plain_folder, plain) = file("touch.csv", std::str::from_utf8(touch).unwrap());
    let (_folder, gz) = packed("touch.csv.gz", touch);
    let run = |path: &Path, more: &[&str]| {
        done(
            &[&["run", "--backend", "cpu", "--source", text_of(path), "--sink", "-", "--fields", "hand/palm"], more]
                .concat(),
        )
    };
    for more in [&[][..], &["--from", "1", "--to", "2.5"]] {
        assert_eq!(run(&gz, more), run(&plain, more));
    }
    let known: Value = serde_json::from_str(&done(&["info", text_of(&gz), "--json"])).unwrap();
    assert_eq!((&known["frames"], &known["taxels"]), (&280.into(), &40.into()));
    let back = plain.with_file_name("back.csv");
    done(&["convert", text_of(&gz), text_of(&back)]);
    let read = |path: &Path| done(&["info", text_of(path), "--json"]);
    assert_eq!(serde_json::from_str::<Value>(&read(&back)).unwrap()["frames"], 280);
}

#[test]
fn an_export_in_gz_has_its_own_name() {
    let rows = "1,2,3\n4,5,6\n7,8,9\n".repeat(4);
    let (_folder, gz) = packed("walk.csv.gz", rows.as_bytes());
    let flags = ["--grid", "1x3", "--rate", "10"];
    let known: Value = serde_json::from_str(&done(&[&["info", text_of(&gz), "--json"], &flags[..]].concat())).unwrap();
    assert_eq!((&known["frames"], &known["taxels"]), (&12.into(), &3.into()));
    let mcap = gz.with_file_name("walk.mcap");
    done(&[&["convert", text_of(&gz), text_of(&mcap)], &flags[..]].concat());
    let known: Value = serde_json::from_str(&done(&["info", text_of(&mcap), "--json"])).unwrap();
    assert!(known["attached"].as_array().unwrap().iter().any(|file| file["name"] == "walk.glb"), "{known}");
}

#[test]
fn a_damaged_gz_is_an_error_in_one_line() {
    let (_folder, gz) = packed("touch.csv.gz", somatic::bundled::TOUCH);
    let whole = std::fs::read(&gz).unwrap();
    std::fs::write(&gz, &whole[..whole.len() / 2]).unwrap();
    let error = fails(1, &["run", "--backend", "cpu", "--quiet", "--source", text_of(&gz), "--sink", "-"]);
    let line = format!("somatic: error: {}: its gzip data ends too soon; copy the file again\n", gz.display());
    assert_eq!(error, line);
}

/// A grasp by a real hand, as it is stored.
#[test]
fn a_real_recording_in_gz_is_read() {
    let root = std::env::var_os("SOMATIC_DATA").map_or_else(|| PathBuf::from("../shared/data"), PathBuf::from);
    let path = root.join("recordings/drimus_sdh/csv/ball_rubber-00.csv.gz");
    if !path.exists() {
        somatic_testing::skip(
            "DATA",
            format!("{} is not there; set SOMATIC_DATA to the folder that has it", path.display()),
        );
        return;
    }
    let known: Value = serde_json::from_str(&done(&["info", text_of(&path), "--json"])).unwrap();
    assert_eq!((&known["frames"], &known["taxels"]), (&341.into(), &486.into()));
}

#[test]
fn files_that_are_known_and_not_read_say_what_to_do() {
    for (name, wanted) in [
        ("a.xls", "it is a workbook of a spreadsheet; save it as CSV"),
        ("walk.fsx", "save it as ASCII (.asf) in Tekscan's program"),
        ("a.parquet", "name its folder, lerobot:DIR, or save it as CSV"),
        ("a.h5", "HDF5 is read in Python: somatic_touch.read(FILE, dataset=NAME)"),
        ("a.mcap.gz", "only text is read from .gz; unpack it first: gunzip -k "),
    ] {
        let (_folder, path) = file(name, "not text");
        for command in [&["run", "--source"][..], &["info"], &["convert"]] {
            let out = path.with_file_name("out.csv");
            let more: &[&str] = if command == ["convert"] { &[text_of(&out)] } else { &[] };
            let error = fails(2, &[command, &[text_of(&path)], more].concat());
            assert!(error.contains(wanted) && error.lines().count() <= 2, "{command:?}: {error}");
        }
    }
    let (_folder, bag) = file("a.bag", "#ROSBAG V2.0\n");
    assert!(fails(1, &["info", text_of(&bag)]).contains("rosbags-convert --src"));
}

#[test]
fn a_dataset_without_parquet_names_another_build_and_python() {
    let folder = tempfile::tempdir().unwrap();
    let meta = folder.path().join("meta");
    std::fs::create_dir(&meta).unwrap();
    let text =
        r#"{"codebase_version": "v3.0", "features": {"observation.tactile": {"dtype": "float32", "shape": [40]}}}"#;
    std::fs::write(meta.join("info.json"), text).unwrap();
    let named = format!("lerobot:{}", folder.path().display());
    for source in [text_of(folder.path()), &named, &format!("{named}:observation.tactile#2")] {
        let error = fails(1, &["run", "--quiet", "--body", "hand", "--source", source, "--sink", "-"]);
        let wanted = if cfg!(feature = "parquet") {
            "it has no data/chunk-*/*.parquet; copy the dataset again"
        } else {
            "this build reads no Parquet: cargo install --path . --features parquet, or use somatic_touch.lerobot.read in Python"
        };
        assert_eq!(error, format!("somatic: error: {}: {wanted}\n", folder.path().display()));
    }
}
