//! Other letters that are asked for, and what is said where a body or a scene does not have them.

use std::path::PathBuf;

use serde_json::{Value, json};

use super::{done, fails, file, frames, output, stderr, text_of};

const HAND: [&str; 5] = ["run", "--backend", "cpu", "--body", "sensing-hand"];

/// A body with 5 taxels of `modality`, and the folder that it is in.
fn body_of(modality: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let tangent = if modality == "force3" { "0,1,0" } else { ",," };
    let rows: String =
        (0..5).map(|n| format!("{n},pad,{},0,0,0,0,1,1.6e-5,{modality},{tangent}\n", 0.005 * f64::from(n))).collect();
    std::fs::write(at("skin.csv"), format!("id,link,x,y,z,nx,ny,nz,area,modality,tx,ty,tz\n{rows}")).unwrap();
    std::fs::write(at("fields.toml"), "[[fields]]\nname = \"pad\"\ntaxels = [\"0..=99\"]\n").unwrap();
    let (skin, bare, fields, pad) = (at("skin.csv"), at("bare.glb"), at("fields.toml"), at("pad.glb"));
    done(&["author", "--csv-skin", text_of(&skin), "-o", text_of(&bare)]);
    done(&["author", text_of(&bare), "--recipe", text_of(&fields), "-o", text_of(&pad)]);
    (folder, pad)
}

/// Values of taxels 0 to 4, 60 frames.
fn recording(value: f64) -> (tempfile::TempDir, PathBuf) {
    let row = |n: u32| format!("{}{}\n", f64::from(n) * 0.05, format!(",{value}").repeat(5));
    file("touch.csv", &format!("t,0,1,2,3,4\n{}", (0..60).map(row).collect::<String>()))
}

fn hand(more: &[&str]) -> Vec<Value> {
    frames(&done(&[&HAND[..], &["--quiet", "--sink", "-"], more].concat()))
}

fn touches(lines: &[Value]) -> Vec<&Value> {
    lines.iter().filter_map(|line| line["touches"].as_array()).flatten().collect()
}

#[test]
fn touches_have_other_letters_whatever_fields_have() {
    let whole = hand(&[]);
    let keys = ["shear", "torsion", "friction", "temperature"];
    let of = |lines: &[Value]| -> Vec<Vec<Value>> {
        touches(lines).iter().map(|touch| keys.map(|key| touch[key].clone()).to_vec()).collect()
    };
    assert!(keys.iter().all(|key| touches(&whole).iter().any(|touch| !touch[key].is_null())));
    for asked in ["touches", "touches,touches.shear", "touches.temperature", "total,touches"] {
        let lines = hand(&["--outputs", asked]);
        assert_eq!(of(&lines), of(&whole), "{asked}");
        // Fields have no letter that nobody asked for.
        let fields = lines.iter().filter_map(|line| line["fields"].as_array()).flatten();
        assert!(fields.into_iter().all(|field| field["letter"].is_null() && field["friction"].is_null()), "{asked}");
    }
    // Whoever names letters has these alone.
    let pressed = hand(&["--letters", "sustained", "--outputs", "touches"]);
    assert!(!touches(&pressed).is_empty() && of(&pressed).iter().flatten().all(Value::is_null));
    let lacks = fails(2, &[&HAND[..], &["--letters", "sustained", "--outputs", "touches.shear"]].concat());
    assert!(
        lacks.contains("`touches.shear` is of letter `shear`, which --letters leaves out; add `shear` to --letters"),
        "{lacks}"
    );
    let plain = fails(2, &["run", "--body", "hand", "--outputs", "touches.temperature"]);
    assert!(
        plain.contains("`touches.temperature` is of letter `temperature`, which no field's taxels have"),
        "{plain}"
    );
}

#[test]
fn a_letter_that_is_left_out_is_told_from_one_that_no_taxel_has() {
    let of = |body: &str, more: &[&str]| fails(2, &[&["run", "--body", body], more].concat());
    let left_out = of("sensing-hand", &["--letters", "sustained", "--outputs", "shear"]);
    assert!(
        left_out.contains("`shear` is of letter `shear`, which --letters leaves out; add `shear` to --letters"),
        "{left_out}"
    );
    let none = of("hand", &["--outputs", "shear,friction"]);
    assert!(none.contains("`shear`, `friction` are of letter `shear`, which no field's taxels have"), "{none}");
    let with = of("hand", &["--outputs", "touches.torsion"]);
    assert!(with.contains("`touches.torsion` comes with `touches.shear`: ask for that"), "{with}");
}

#[test]
fn a_body_without_pressures_is_told_so() {
    let (_of_body, body) = body_of("temperature");
    let (_of_touch, touch) = recording(22.0);
    let read = ["--body", text_of(&body), "--source", text_of(&touch)];
    let no_pressure = "pad.glb: no field has a taxel that measures pressure, of which ";
    for (more, what) in [
        (
            ["--letters", "sustained"],
            "letter `sustained` is made; leave out what asks for it: the taxels have temperature",
        ),
        (["--outputs", "touches"], "`touches` is made; leave that out of --outputs"),
        (["--outputs", "centroid,touches"], "`centroid`, `touches` are made; leave that out of --outputs"),
    ] {
        let why = fails(2, &[&["run"][..], &read, &more].concat());
        assert!(why.contains(&format!("{no_pressure}{what}")), "{why}");
    }
    let within = fails(2, &[&["run"][..], &read, &["--within", "3 mm"]].concat());
    assert!(within.contains("options are for letters of pressure, and there is none; leave --within"), "{within}");
    let surveyed = fails(2, &[&["calibrate"][..], &read, &["--rest", "0.5", "-o", "/dev/null"]].concat());
    assert!(surveyed.contains("pad.glb: no taxel measures pressure"), "{surveyed}");
    // What is warm is not pressed.
    let ran = output(&[&["run", "--backend", "cpu", "--sink", "-"][..], &read].concat());
    assert!(ran.status.success() && !stderr(&ran).contains("wholly pressed"), "{}", stderr(&ran));
    assert!(frames(&String::from_utf8(ran.stdout).unwrap())[0]["fields"][0]["temperature"] == json!(22.0));
}

#[test]
fn tangential_values_beside_normal_ones_are_no_doubt_of_these() {
    let (_of_body, body) = body_of("force3");
    let head: String = (0..5).map(|id| format!(",{id}.u,{id}.v,{id}")).collect();
    // The normal values rest at 0 and the others never do.
    let row = |n: u32| format!("{}{}\n", f64::from(n) * 0.05, ",3,4,0".repeat(5));
    let (_of_touch, touch) = file("touch.csv", &format!("t{head}\n{}", (0..60).map(row).collect::<String>()));
    let read = ["run", "--backend", "cpu", "--sink", "-", "--body", text_of(&body), "--source", text_of(&touch)];
    let ran = output(&read);
    assert!(ran.status.success() && !stderr(&ran).contains("wholly pressed"), "{}", stderr(&ran));
    // Each channel is a value, and a taxel may have three.
    let (_of_few, few) = file("few.csv", "t,tip_n,tip_u,tip_v\n0,5,1,2\n1,5,1,2\n");
    let source = format!("csv:{}", text_of(&few));
    let why = fails(2, &["run", "--body", text_of(&body), "--source", &source, "--columns", "tip_*"]);
    assert!(why.contains("3 columns are sensors, and the body has 5 taxels with 15 values; "), "{why}");
    let json: Value = serde_json::from_str(&done(&["inspect", text_of(&body), "--json"])).unwrap();
    assert_eq!(json["taxels"][2]["tangent"], json!([0.0, 1.0, 0.0]));
}

#[test]
fn a_tangential_column_of_a_taxel_with_one_axis_is_refused_as_in_lines() {
    let (_of_body, body) = body_of("pressure");
    let (_of_touch, touch) = file("u.csv", "t,4.u\n0,1\n");
    let why = fails(1, &["run", "--body", text_of(&body), "--source", text_of(&touch)]);
    assert!(why.contains("taxel 4 has one value, and 4.u is given; its modality is not force3"), "{why}");
    let json: Value = serde_json::from_str(&done(&["inspect", text_of(&body), "--json"])).unwrap();
    assert!(json["taxels"][2].get("tangent").is_none());
}

#[test]
fn a_header_names_fields_and_letters_as_lines_do() {
    let lines = hand(&["--header", "--all-fields", "--to", "0.1"]);
    let named = |key: &str| -> Vec<Value> {
        let mut seen: Vec<Value> = Vec::new();
        for field in lines[1]["fields"].as_array().unwrap() {
            if !seen.contains(&field[key]) {
                seen.push(field[key].clone());
            }
        }
        seen
    };
    assert_eq!(lines[0]["body"]["fields"], json!(named("field")));
    assert_eq!(lines[0]["letters"], json!(["sustained", "shear", "temperature", "proximity"]));
    assert!(lines[0]["letters"].as_array().unwrap().iter().all(|letter| named("letter").contains(letter)));
    let plain = frames(&done(&["run", "--backend", "cpu", "--header", "--quiet", "--sink", "-", "--to", "0.1"]));
    assert!(plain[0].get("letters").is_none());
}

#[test]
fn topics_of_fields_have_a_letter_only_where_two_have_totals() {
    let folder = tempfile::tempdir().unwrap();
    let topics = |letters: &[&str]| -> Vec<String> {
        let to = folder.path().join("run.mcap");
        let sink = format!("mcap:{}", text_of(&to));
        done(&[&HAND[..], &["--quiet", "--force", "--to", "0.2", "--sink", &sink], letters].concat());
        let bytes = std::fs::read(&to).unwrap();
        let found: Vec<String> = ["hand", "hand (sustained)", "hand (change)", "hand (shear)"]
            .into_iter()
            .filter(|name| {
                // A channel's topic has its length before it.
                let topic = format!("/somatic/fields/{name}");
                let with_length = [&(topic.len() as u32).to_le_bytes()[..], topic.as_bytes()].concat();
                bytes.windows(with_length.len()).any(|window| window == with_length)
            })
            .map(str::to_owned)
            .collect();
        found
    };
    assert_eq!(topics(&[]), ["hand"]);
    assert_eq!(topics(&["--letters", "sustained,change"]), ["hand (sustained)", "hand (change)"]);
}

#[test]
fn a_calibration_knows_what_each_taxel_measures() {
    let (_of_body, body) = body_of("temperature");
    let (_of_touch, touch) = recording(24.0);
    let run = |keys: &str| {
        let (folder, path) = file("a.toml", keys);
        let read = [
            "run",
            "--backend",
            "cpu",
            "--quiet",
            "--sink",
            "-",
            "--body",
            text_of(&body),
            "--source",
            text_of(&touch),
        ];
        let ran = output(&[&read[..], &["--calibration", text_of(&path)]].concat());
        drop(folder);
        ran
    };
    let inverted = run("[taxel.2]\ninvert = true\nbaseline = 100\n");
    let lines = frames(&String::from_utf8(inverted.stdout).unwrap());
    assert_eq!(lines[0]["fields"][0]["warmest"], json!(76.0));
    let refused = stderr(&run("[taxel.2]\np_max = 4\n"));
    assert!(
        refused.contains(
            "a.toml: line 2, column 9: `p_max` is for pressures, and taxel 2 measures temperature; remove it"
        ),
        "{refused}"
    );
}
