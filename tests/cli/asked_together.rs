//! Letters, outputs and fields that are asked for together: what goes together, and what is said where it does not.

use std::path::PathBuf;

use serde_json::{Value, json};

use super::{done, fails, file, frames, output, stderr, text_of};

/// A body with 9 taxels of `kinds`, three of each, in a field of their own called by their kind; and the folder that it is in.
fn body_of(kinds: &[&str]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let (mut rows, mut fields) = (String::new(), String::new());
    for (number, kind) in kinds.iter().enumerate() {
        let tangent = if *kind == "force3" { "0,1,0" } else { ",," };
        for id in 3 * number..3 * number + 3 {
            rows += &format!("{id},pad,{},0,0,0,0,1,1.6e-5,{kind},{tangent}\n", 0.005 * id as f64);
        }
        let ids = (3 * number, 3 * number + 2);
        fields += &format!("[[fields]]\nname = \"{kind}\"\ntaxels = [\"{}..={}\"]\n", ids.0, ids.1);
    }
    std::fs::write(at("skin.csv"), format!("id,link,x,y,z,nx,ny,nz,area,modality,tx,ty,tz\n{rows}")).unwrap();
    std::fs::write(at("fields.toml"), fields).unwrap();
    let (skin, bare, recipe, pad) = (at("skin.csv"), at("bare.glb"), at("fields.toml"), at("pad.glb"));
    done(&["author", "--csv-skin", text_of(&skin), "-o", text_of(&bare)]);
    done(&["author", text_of(&bare), "--recipe", text_of(&recipe), "-o", text_of(&pad)]);
    std::fs::write(at("newton.toml"), "[all]\nunit = \"N\"\n").unwrap();
    (folder, pad)
}

/// Flags that read `columns` of 20 frames, in which each but the time is 5, and their file.
fn reading(body: &std::path::Path, columns: &str) -> ([String; 6], tempfile::TempDir) {
    let row = |n: u32| format!("{}{}\n", f64::from(n) * 0.05, ",5".repeat(columns.split(',').count()));
    let (folder, touch) = file("touch.csv", &format!("t,{columns}\n{}", (0..20).map(row).collect::<String>()));
    let calibration = body.with_file_name("newton.toml");
    let of = |path: &std::path::Path| text_of(path).to_owned();
    let flags = ["--body".into(), of(body), "--source".into(), of(&touch), "--calibration".into(), of(&calibration)];
    (flags, folder)
}

const IDS: &str = "0,1,2,3,4,5";

fn run<'a>(read: &'a [String; 6], more: &[&'a str]) -> Vec<&'a str> {
    let begin = ["run", "--backend", "reference", "--quiet"];
    begin.into_iter().chain(read.iter().map(String::as_str)).chain(more.iter().copied()).collect()
}

#[test]
fn touches_are_found_whatever_fields_are_asked_for() {
    let (folder, body) = body_of(&["pressure", "temperature"]);
    let (read, _of_touch) = reading(&body, IDS);
    let touches = |more: &[&str]| -> Vec<Value> {
        let lines = frames(&done(&run(&read, &[&["--sink", "-"][..], more].concat())));
        let without_fields = |mut touch: Value| {
            touch.as_object_mut().unwrap().remove("fields");
            touch
        };
        lines.iter().flat_map(|line| line["touches"].as_array().unwrap().clone()).map(without_fields).collect()
    };
    let all = touches(&[]);
    assert!(all.len() == 20 && all.iter().all(|touch| touch["total"] == json!(15.0) && !touch["force"].is_null()));
    let warm = ["--fields", "temperature"];
    assert_eq!(touches(&warm), all);
    for outputs in ["touches", "touches,temperature"] {
        assert_eq!(touches(&[&warm[..], &["--outputs", outputs]].concat()), all, "{outputs}");
    }
    let csv = folder.path().join("run.csv");
    done(&run(&read, &[&warm[..], &["--sink", text_of(&csv)]].concat()));
    let table = std::fs::read_to_string(folder.path().join("run.touches.csv")).unwrap();
    assert!(table.starts_with("t [s],") && table.contains("total [N]") && table.lines().count() == 21, "{table}");
    // Of fields there is nothing of pressures to give.
    let why = fails(2, &run(&read, &[&warm[..], &["--outputs", "total,touches"]].concat()));
    assert!(why.contains("pressure, of which `total` is made; leave that out of --outputs"), "{why}");
    let why = fails(2, &run(&read, &[&warm[..], &["--outputs", "shear"]].concat()));
    assert!(why.ends_with("pad.glb: `shear` is of letter `shear`, which no field's taxels have\n"), "{why}");
}

#[test]
fn without_pressures_there_is_no_table_of_touches() {
    let (folder, body) = body_of(&["temperature"]);
    let (read, _of_touch) = reading(&body, "0,1,2");
    for name in [
        "run.csv",
        #[cfg(feature = "parquet")]
        "run.parquet",
    ] {
        let to = folder.path().join(name);
        done(&run(&read, &["--sink", text_of(&to)]));
        let beside = folder.path().join(name.replace("run.", "run.touches."));
        assert!(to.is_file() && !beside.exists(), "{name}");
    }
    let why = fails(2, &run(&read, &["--sink", "csv:-", "--table", "touches"]));
    assert!(why.contains("there is no table of touches") && why.lines().count() == 1, "{why}");
    let why = fails(2, &run(&read, &["--outputs", "touches,temperature"]));
    assert!(why.contains("of which `touches` is made; leave that out of --outputs"), "{why}");
}

#[test]
fn outputs_and_letters_that_do_not_go_together_are_refused() {
    let (_folder, body) = body_of(&["pressure", "temperature"]);
    let (read, _of_touch) = reading(&body, IDS);
    for (letters, outputs, what) in [
        ("temperature", "total", "`total` is of letters `sustained` and `change`, which --letters leaves out; add"),
        (
            "temperature",
            "temperature,total",
            "`total` is of letters `sustained` and `change`, which --letters leaves out",
        ),
        (
            "sustained,temperature",
            "total",
            "--outputs has none of letter `temperature`; add one, such as `temperature`, or leave",
        ),
        (
            "sustained,temperature",
            "warmest",
            "--outputs has none of letter `sustained`; add one, such as `total`, or leave",
        ),
        ("sustained", "warmest", "`warmest` is of letter `temperature`, which --letters leaves out"),
    ] {
        let why = fails(2, &run(&read, &["--letters", letters, "--outputs", outputs]));
        assert!(why.contains(what) && why.lines().count() == 1, "{letters} {outputs}: {why}");
    }
    // Each letter gives what is named of it, and no more.
    let both =
        done(&run(&read, &["--letters", "sustained,temperature", "--outputs", "total,warmest", "--sink", "csv:-"]));
    assert!(both.starts_with("t [s],frame,field,link,letter,contact,total [N],warmest [°C],flags\n"), "{both}");
    let alone =
        done(&run(&read, &["--letters", "sustained,temperature", "--outputs", "total,touches", "--sink", "csv:-"]));
    assert!(alone.starts_with("t [s],frame,field,link,letter,contact,total [N],flags\n"), "{alone}");
}

#[test]
fn a_field_has_no_percept_of_pressures_where_nothing_of_pressures_is_asked_for() {
    let (_folder, body) = body_of(&["pressure", "temperature"]);
    let (read, _of_touch) = reading(&body, IDS);
    let lines = frames(&done(&run(&read, &["--outputs", "temperature", "--all-fields", "--sink", "-"])));
    for line in &lines {
        let fields = line["fields"].as_array().unwrap();
        assert!(fields.len() == 1 && fields[0]["temperature"] == json!(5.0), "{line}");
    }
    let table = done(&run(&read, &["--outputs", "temperature", "--sink", "csv:-"]));
    assert!(table.lines().count() == 21 && table.lines().skip(1).all(|row| row.contains(",5.0,")), "{table}");
}

#[test]
fn a_plan_runs_no_stage_of_pressures_where_no_field_is_read_as_pressures() {
    let (_folder, body) = body_of(&["pressure", "temperature"]);
    let asked = ["plan", "--json", "--backend", "cpu", "--body", text_of(&body), "--letters", "temperature"];
    let bill: Value = serde_json::from_str(&done(&asked)).unwrap();
    for stage in bill["stages"].as_array().unwrap() {
        let runs = matches!(stage["stage"].as_str().unwrap(), "calibrate" | "temperature");
        assert_eq!(stage["runs"], json!(runs), "{stage}");
    }
    let why = |name: &str| {
        let mut stages = bill["stages"].as_array().unwrap().iter();
        stages.find(|stage| stage["stage"] == name).unwrap()["why"].clone()
    };
    assert_eq!([why("contact"), why("centroid")], [json!("no field is read as pressures"), why("contact")]);
    assert_eq!(bill["bytes_down"], json!(0));
}

#[test]
fn changes_alone_are_per_second() {
    let (_folder, body) = body_of(&["pressure", "temperature"]);
    let (read, _of_touch) = reading(&body, IDS);
    let units = |letters: &str| {
        let line = frames(&done(&run(&read, &["--letters", letters, "--header", "--sink", "-"])))[0].clone();
        ["total", "peak", "active"].map(|name| line["units"][name].clone())
    };
    assert_eq!(units("change"), ["N/s", "N/s", "1"].map(Value::from));
    assert_eq!(units("sustained,change"), ["N", "N", "1"].map(Value::from));
    let table = done(&run(&read, &["--letters", "change", "--sink", "csv:-"]));
    assert!(table.contains(",total [N/s],peak [N/s],"), "{table}");
}

#[test]
fn missing_tangential_values_are_told_once() {
    let (_folder, body) = body_of(&["force3"]);
    for (columns, here) in [("0,1,2", Some(0)), ("0,0.u,1,1.u,2,2.u", Some(0)), ("0,0.u,0.v,1,2", Some(1))] {
        let (read, _of_touch) = reading(&body, columns);
        let told = |more: &[&str]| {
            let flags: Vec<&str> = run(&read, &[&["--sink", "-"][..], more].concat());
            let loud: Vec<&str> = flags.into_iter().filter(|flag| *flag != "--quiet").collect();
            stderr(&output(&loud))
        };
        let said = told(&[]);
        let wanted = here.map(|here| format!("`0.u` and `0.v`, of {here} of the 3 taxels of force3 · shear"));
        assert_eq!(said.matches(&wanted.unwrap()).count(), 1, "{columns}: {said}");
        // Whoever asks for no shear misses nothing.
        assert!(!told(&["--letters", "sustained"]).contains("0.u"), "{columns}");
    }
    let (read, _of_touch) = reading(&body, "0,0.u,0.v,1,1.u,1.v,2");
    let flags: Vec<&str> = run(&read, &["--sink", "-"]).into_iter().filter(|flag| *flag != "--quiet").collect();
    assert!(!stderr(&output(&flags)).contains("tangential"));
}
