//! Percepts as tables: CSV in both shapes, Parquet, touches beside them, and their descriptions.

use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::{done, fails, files_in, frames, output, somatic, stderr, text_of};

const ALL: &str = "total,peak,active,area,centroid,position,normal,orientation,principal_axis,anisotropy,displacement,direction,distance,radial_distance,speed,radial_speed,filtered_displacement,filtered_direction,filtered_speed,touches";

/// A table of CSV: the titles, and its rows.
fn table(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let titles = reader.headers().unwrap().iter().map(str::to_owned).collect();
    (titles, reader.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect())
}

/// The cells that a field's object of NDJSON has under `title`.
fn cell(t: &Value, frame: &Value, field: &Value, title: &str) -> String {
    let name = title.split(" [").next().unwrap();
    let text = |value: &Value| match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        Value::Array(words) => words.iter().map(|word| word.as_str().unwrap()).collect::<Vec<_>>().join(";"),
        // Shares by name.
        Value::Object(shares) => shares.keys().map(String::as_str).collect::<Vec<_>>().join(";"),
        other => other.to_string(),
    };
    match name {
        "t" => return text(t),
        "frame" => return text(frame),
        _ => {}
    }
    if let Some(value) = field.get(name) {
        return text(value);
    }
    let suffixes = [("_u", 0), ("_v", 1), ("_x", 0), ("_y", 1), ("_z", 2), ("_along", 0), ("_across", 1)];
    for (suffix, component) in suffixes {
        if let Some(value) = name.strip_suffix(suffix).and_then(|name| field.get(name)) {
            return text(&value[component]);
        }
    }
    String::new()
}

/// Whether two cells are one text, or one number: JSON's printer writes small ones in another way.
fn same(got: &str, wanted: &str, title: &str) {
    let bits =
        |text: &str| text.parse::<f64>().map_or_else(|_| text.to_owned(), |number| format!("{:x}", number.to_bits()));
    assert_eq!(bits(got), bits(wanted), "{title}: {got} is not {wanted}");
}

#[test]
fn a_row_is_a_field_of_a_line_of_ndjson() {
    // The bundled touch, and one under a known layer with what was fitted to it.
    let rod = ["--source", "sim:examples/simulations/turn.toml", "--fields", "hand/back"];
    let fitted = "touches.fit_kind,touches.fit_place,touches.fit_force,touches.fit_direction,touches.fit_width,\
                  touches.fit_length,touches.fit_sigmas,total";
    for (backend, source, outputs, least) in
        [("cpu", &[][..], ALL, 10_000), ("reference", &[], ALL, 10_000), ("cpu", &rod, fitted, 1500)]
    {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let sinks = [format!("csv:{}", text_of(&at("a.csv"))), format!("ndjson:{}", text_of(&at("a.ndjson")))];
        let run = ["run", "--outputs", outputs, "--backend", backend, "--sink", &sinks[0], "--sink", &sinks[1]];
        done(&[&run[..], source].concat());
        assert_eq!(files_in(folder.path()), ["a.csv", "a.ndjson", "a.touches.csv"]);
        let lines = frames(&std::fs::read_to_string(at("a.ndjson")).unwrap());
        let (titles, rows) = table(&at("a.csv"));
        assert_eq!(titles[..5], ["t [s]", "frame", "field", "link", "contact"]);
        let has = |titles: &[String], title: &str| titles.iter().any(|own| own == title);
        let is_usual = has(&titles, "centroid_u [m]") && has(&titles, "total [count]");
        assert!(is_usual || outputs == fitted, "{titles:?}");
        let (touch_titles, touch_rows) = table(&at("a.touches.csv"));
        assert_eq!(has(&touch_titles, "fit_angle [rad]"), outputs == fitted, "{touch_titles:?}");
        let (mut rows, mut touch_rows) = (rows.into_iter(), touch_rows.into_iter());
        let mut compared = 0;
        for line in &lines {
            for field in line["fields"].as_array().unwrap() {
                let row = rows.next().unwrap();
                for (title, got) in titles.iter().zip(&row) {
                    same(got, &cell(&line["t"], &line["frame"], field, title), title);
                    compared += usize::from(!got.is_empty());
                }
            }
            for touch in line["touches"].as_array().into_iter().flatten() {
                let row = touch_rows.next().unwrap();
                for (title, got) in touch_titles.iter().zip(&row) {
                    let title = if title == "touch" { "id" } else { title };
                    same(got, &cell(&line["t"], &line["frame"], touch, title), title);
                    compared += usize::from(outputs == fitted && !got.is_empty());
                }
            }
        }
        assert!(rows.next().is_none() && touch_rows.next().is_none() && compared > least, "{compared}");
    }
}

#[test]
fn a_wide_table_has_a_row_for_every_frame() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wide.csv");
    let flags = ["--fields", "hand/palm", "--fields", "hand/back", "--outputs", "total,centroid", "--backend", "cpu"];
    let lines = frames(&done(&[&["run", "--sink", "-", "--all-fields"], &flags[..]].concat()));
    done(&[&["run", "--wide", "--sink", text_of(&path)], &flags[..]].concat());
    let (titles, rows) = table(&path);
    let wanted = [
        "t [s]",
        "frame",
        "hand/back contact",
        "hand/back total [count]",
        "hand/back centroid_u [m]",
        "hand/back centroid_v [m]",
        "hand/back flags",
        "hand/palm contact",
    ];
    assert_eq!(titles[..8], wanted);
    assert_eq!(rows.len(), lines.len());
    for (row, line) in rows.iter().zip(&lines) {
        for (title, got) in titles.iter().zip(row) {
            let parts: Vec<&str> = title.splitn(2, ' ').collect();
            let field = line["fields"].as_array().unwrap().iter().find(|field| field["field"] == parts[0]);
            let (field, title) = match field {
                Some(field) => (field, parts[1]),
                None => (&Value::Null, title.as_str()),
            };
            same(got, &cell(&line["t"], &line["frame"], field, title), title);
        }
    }
    assert!(fails(2, &["run", "--wide", "--sink", "a.ndjson"]).contains("csv:FILE"));
}

#[test]
fn a_wide_table_has_of_a_field_what_its_letter_gives() {
    let folder = tempfile::tempdir().unwrap();
    let [wide, long] = ["wide.csv", "long.csv"].map(|name| folder.path().join(name));
    let flags = ["run", "--body", "sensing-hand", "--backend", "cpu", "--sink"];
    done(&[&flags[..], &[text_of(&wide), "--wide"]].concat());
    done(&[&flags[..], &[text_of(&long), "--all-fields"]].concat());
    let (titles, rows) = table(&wide);
    let has = |title: &str| titles.iter().any(|other| other == title);
    assert!(has("hand/palm sustained total [N]") && has("hand/palm temperature warmest [°C]"), "{titles:?}");
    for other in
        ["hand/palm sustained warmest [°C]", "hand/palm temperature total [N]", "hand/palm proximity shear_u [N]"]
    {
        assert!(!has(other), "{other}");
    }
    // What is left out is empty in the long table, and all else is in both.
    let (columns, lines) = table(&long);
    let fields = lines.len() / rows.len();
    let of_letters = columns.iter().position(|column| column == "letter").unwrap();
    let first = columns.iter().position(|column| column == "contact").unwrap();
    for (row, lines) in rows.iter().zip(lines.chunks(fields)) {
        let mut known = 2;
        for line in lines {
            for (column, value) in columns.iter().zip(line).skip(first) {
                let title = format!("{} {} {column}", line[2], line[of_letters]);
                match titles.iter().position(|other| *other == title) {
                    Some(at) => {
                        assert_eq!(row[at], *value, "{title}");
                        known += 1;
                    }
                    None => assert!(value.is_empty(), "{title}: {value}"),
                }
            }
        }
        assert_eq!(known, titles.len());
    }
}

#[test]
fn names_that_need_it_are_quoted() {
    let folder = tempfile::tempdir().unwrap();
    let (body, path) = (folder.path().join("a, \"b\".glb"), folder.path().join("a.csv"));
    done(&["author", "--grid", "1x2", "--pitch", "5mm", "-o", text_of(&body)]);
    let touch = folder.path().join("touch.csv");
    std::fs::write(&touch, "t,0,1\n0,1,2\n").unwrap();
    done(&["run", "--body", text_of(&body), "--source", text_of(&touch), "--sink", text_of(&path)]);
    let (_, rows) = table(&path);
    assert_eq!(rows[0][2], "a, \"b\"");
}

#[test]
fn a_description_has_every_column_and_runs_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.csv");
    let text = done(&["run", "--describe", "--sink", text_of(&path), "--outputs", ALL, "--backend", "cpu"]);
    assert!(files_in(folder.path()).is_empty());
    done(&["run", "--sink", text_of(&path), "--outputs", ALL, "--backend", "cpu"]);
    for name in ["a.csv", "a.touches.csv"] {
        for title in table(&folder.path().join(name)).0 {
            let name = title.split(" [").next().unwrap();
            assert!(text.lines().any(|line| line.split_whitespace().next() == Some(name)), "{name}: {text}");
        }
    }
    let row = |name: &str| text.lines().find(|line| line.trim_start().starts_with(name)).unwrap().to_owned();
    assert!(row("centroid_u").contains("f32 or absent") && row("position_x").contains("f64"), "{text}");
    // A file that is there does not stand in its way.
    assert_eq!(done(&["run", "--describe", "--sink", text_of(&path), "--outputs", ALL, "--backend", "cpu"]), text);
    assert!(fails(2, &["run", "--describe", "--sink", "a.ndjson"]).contains("NDJSON has the same names as keys"));
}

#[test]
fn a_table_is_whole_or_not_there() {
    let endings = if cfg!(feature = "parquet") { &["csv", "parquet"][..] } else { &["csv"] };
    for ending in endings {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(format!("a.{ending}"));
        // Killed in the middle of it: what is left is called otherwise.
        let mut child =
            somatic(&["run", "--speed", "0.5", "--loop", "--outputs", "total,touches", "--sink", text_of(&path)])
                .stderr(Stdio::null())
                .spawn()
                .unwrap();
        let start = Instant::now();
        while files_in(folder.path()).len() < 2 && start.elapsed() < Duration::from_secs(20) {
            std::thread::sleep(Duration::from_millis(20));
        }
        std::thread::sleep(Duration::from_millis(300));
        child.kill().unwrap();
        child.wait().unwrap();
        let left = files_in(folder.path());
        assert!(left.len() == 2 && left.iter().all(|name| name.ends_with(".part")), "{left:?}");
        // A file that fails takes the other with it.
        let at = folder.path().join("b").join(format!("a.{ending}"));
        std::fs::create_dir(at.parent().unwrap()).unwrap();
        std::fs::write(at.with_extension(format!("touches.{ending}")), "mine").unwrap();
        let why = fails(1, &["run", "--outputs", "total,touches", "--sink", text_of(&at)]);
        assert!(why.contains("touches") && why.contains("--force"), "{why}");
        assert_eq!(files_in(at.parent().unwrap()).len(), 1);
        done(&["run", "--outputs", "total,touches", "--sink", text_of(&at), "--force"]);
        assert_eq!(files_in(at.parent().unwrap()).len(), 2);
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_leaves_no_table() {
    let endings = if cfg!(feature = "parquet") { &["csv", "parquet"][..] } else { &["csv"] };
    for ending in endings {
        let folder = tempfile::tempdir().unwrap();
        let why = fails(1, &["run", "--sink", &format!("{ending}:/dev/full"), "--force"]);
        assert!(why.lines().last().unwrap().contains("/dev/full: cannot write"), "{why}");
        let program = env!("CARGO_BIN_EXE_somatic");
        let sink = folder.path().join(format!("a.{ending}"));
        // The system lets no file grow beyond some kilobytes.
        let script = format!("trap '' XFSZ; ulimit -f 16; exec {program} run --sink {}", text_of(&sink));
        let output = std::process::Command::new("sh").args(["-c", &script]).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
        assert!(stderr(&output).contains("cannot write"), "{}", stderr(&output));
        assert!(files_in(folder.path()).is_empty());
    }
}

#[test]
fn without_the_feature_parquet_is_refused_with_what_to_do() {
    if cfg!(feature = "parquet") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let why = fails(1, &["run", "--sink", text_of(&folder.path().join("a.parquet"))]);
    assert!(why.contains("--features parquet") && why.contains("csv:FILE"), "{why}");
    assert!(files_in(folder.path()).is_empty() && !output(&["run", "--sink", "parquet:"]).status.success());
}

/// Parquet in other libraries.
#[cfg(feature = "parquet")]
mod parquet {
    use std::path::PathBuf;
    use std::process::Command;

    use super::*;
    use crate::python::python_with;
    use somatic_testing::skip;

    fn compared(python: &Path, arguments: &[&Path]) -> Result<Value, String> {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/parquet/compare.py");
        let output = Command::new(python).arg(script).args(arguments).output().unwrap();
        match output.status.success() {
            true => Ok(serde_json::from_slice(&output.stdout).unwrap()),
            false => Err(stderr(&output)),
        }
    }

    fn python() -> Option<PathBuf> {
        let python = python_with("parquet", "import pyarrow, polars");
        python.inspect_err(|why| skip("PARQUET", format!("no other reader of Parquet: {why}"))).ok()
    }

    #[test]
    fn other_libraries_read_the_same_values() {
        let Some(python) = python() else { return };
        for (backend, more) in
            [("cpu", &["--letters", "sustained,change"][..]), ("cpu", &["--all-fields"]), ("reference", &[])]
        {
            let folder = tempfile::tempdir().unwrap();
            let at = |name: &str| folder.path().join(name);
            let sinks = [at("a.parquet"), at("a.ndjson")];
            let run = [
                "run",
                "--backend",
                backend,
                "--outputs",
                ALL,
                "--sink",
                text_of(&sinks[0]),
                "--sink",
                text_of(&sinks[1]),
            ];
            done(&[&run[..], more].concat());
            let said = compared(&python, &[&sinks[0], &sinks[1], &at("a.touches.parquet")]).unwrap();
            assert!(said["rows"].as_u64().unwrap() > 500, "{said}");
            assert_eq!((&said["units"]["speed"], &said["units"]["area"]), (&"m/s".into(), &"m²".into()));
            let wanted = if backend == "cpu" { "float" } else { "double" };
            assert_eq!((&said["types"]["total"], &said["types"]["position_x"]), (&wanted.into(), &"double".into()));
            assert!(said["types"]["field"].as_str().unwrap().starts_with("dictionary<values=string"), "{said}");
            let about = &said["about"];
            let body = about["somatic.body.sha256"].as_str().unwrap();
            assert!(body.len() == 64 && about["somatic.backend"].as_str().unwrap().contains(backend), "{about}");
            // A comparison that must fail: another run's lines.
            let other = at("other.ndjson");
            done(&["run", "--backend", backend, "--outputs", "total", "--fields", "hand", "--sink", text_of(&other)]);
            assert!(compared(&python, &[&sinks[0], &other]).is_err());
        }
    }

    #[test]
    fn a_table_is_a_sixth_of_its_ndjson() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for (backend, most) in [("cpu", 6.0), ("reference", 4.0)] {
            let sinks = [at(&format!("{backend}.parquet")), at(&format!("{backend}.ndjson"))];
            let mat = format!("sim:{}/examples/simulations/mat.toml", env!("CARGO_MANIFEST_DIR"));
            done(&[
                "run",
                "--source",
                &mat,
                "--backend",
                backend,
                "--all-fields",
                "--sink",
                text_of(&sinks[0]),
                "--sink",
                text_of(&sinks[1]),
            ]);
            let size = |path: &PathBuf| std::fs::metadata(path).unwrap().len() as f64;
            let rows: usize = std::fs::read_to_string(&sinks[1]).unwrap().matches("\"field\":").count();
            let ratio = size(&sinks[1]) / size(&sinks[0]);
            eprintln!("{backend}: {rows} rows, NDJSON is {ratio:.1} times as large");
            assert!(rows >= 10_000 && ratio >= most, "{backend}: {rows} rows, {ratio}");
        }
    }
}
