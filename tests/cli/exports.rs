//! Exports of pressure systems at the process boundary: read as they are, with exit codes for what is wrong with them.

use std::path::Path;

use serde_json::Value;

use super::{done, fails, file, frames, output, stderr, text_of};

/// The documentation's example: two insoles.
const INSOLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/exports/insoles.csv");

fn run(arguments: &[&str]) -> Vec<Value> {
    frames(&done(&[&["run", "--backend", "cpu", "--quiet", "--sink", "-"][..], arguments].concat()))
}

#[test]
fn an_export_needs_nothing_beside_it() {
    let all = run(&["--source", INSOLES]);
    assert_eq!(all.len(), 60);
    // With a unit there is a force without being asked for.
    let touched: Vec<&Value> = all.iter().flat_map(|frame| frame["fields"].as_array().unwrap()).collect();
    assert!(touched.len() > 40 && touched.iter().all(|field| field["force"].as_f64().unwrap() > 0.0));
    let largest = |side: &str| {
        let of_side = touched.iter().filter(|field| field["field"] == side);
        of_side.map(|field| field["force"].as_f64().unwrap()).fold(0.0, f64::max)
    };
    assert!((100.0..2000.0).contains(&largest("left")) && (largest("left") / largest("right") - 1.0).abs() < 0.05);
    // Without one there is none, and no flag that nobody asked for.
    let counts = run(&[]);
    let first = &counts[20]["fields"][0];
    assert!(first["force"].is_null() && !first["flags"].to_string().contains("no_unit"), "{first}");
    let asked = run(&["--outputs", "force,total"]);
    assert!(asked[20]["fields"][0]["flags"].to_string().contains("no_unit"));
}

#[test]
fn a_header_says_units_and_body() {
    let lines = run(&["--source", INSOLES, "--header", "--outputs", "total,force,centroid"]);
    let header = serde_json::json!({
        "somatic": 2,
        "units": {"total": "Pa", "centroid": "m", "force": "N"},
        "body": {"name": "insoles.glb", "taxels": 682, "fields": ["left", "right"]},
    });
    assert_eq!((lines.len(), &lines[0]), (61, &header));
    let counts = run(&["--header", "--outputs", "peak"]);
    assert_eq!(counts[0]["units"], serde_json::json!({"peak": "count"}));
    // Without being asked for, the first line is the first frame.
    assert_eq!(run(&["--source", INSOLES, "--outputs", "total,force,centroid"])[..], lines[1..]);
}

#[test]
fn a_converted_export_has_its_sensors_and_its_unit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("insoles.mcap");
    done(&["convert", INSOLES, text_of(&path)]);
    assert_eq!(run(&["--source", text_of(&path)]), run(&["--source", INSOLES]));
    let recorded = folder.path().join("run.mcap");
    done(&[
        "run",
        "--quiet",
        "--backend",
        "cpu",
        "--source",
        INSOLES,
        "--sink",
        &format!("mcap:{}", recorded.display()),
    ]);
    assert_eq!(run(&["--source", text_of(&recorded)]), run(&["--source", INSOLES]));
    let bytes = std::fs::read(&recorded).unwrap();
    let has = |word: &[u8]| bytes.windows(word.len()).any(|window| window == word);
    assert!(has(b"unit_force") && has(b"unit_total") && !has(b"unit_of_nothing"));
}

#[test]
fn what_is_known_of_an_export_is_reported() {
    let known: Value = serde_json::from_str(&done(&["info", INSOLES, "--json"])).unwrap();
    assert_eq!((&known["kind"], &known["unit"], &known["frames"]), (&"XSENSOR".into(), &"mmHg".into(), &60.into()));
    assert_eq!((&known["panels"][1]["name"], &known["panels"][1]["taxels"]), (&"right".into(), &341.into()));
    let left = &known["fields"][0];
    assert_eq!((&left["field"], &left["contacts"], &left["load_unit"]), (&"left".into(), &1.into(), &"N".into()));
    assert!((0.5..0.7).contains(&left["stance"].as_f64().unwrap()), "{left}");
    let text = done(&["info", INSOLES]);
    assert!(text.contains("682: left 341, right 341") && text.contains("unit        mmHg"), "{text}");
}

#[test]
fn a_calibration_is_laid_over_that_of_an_export() {
    let (folder, path) = file("dead.toml", "[all]\ndead_band = 2\n");
    let asked = ["--source", INSOLES, "--calibration", text_of(&path), "--outputs", "force,total", "--sink", "-"];
    let output = output(&[&["run", "--backend", "cpu", "--header"][..], &asked].concat());
    let said = stderr(&output);
    let stays = format!("somatic: {INSOLES}: of its own calibration, this stays under --calibration: unit = \"mmHg\"");
    assert_eq!(said.matches(&stays).count(), 1, "{said}");
    let lines = frames(&String::from_utf8(output.stdout).unwrap());
    assert_eq!(lines[0]["units"], serde_json::json!({"total": "Pa", "force": "N"}));
    let largest = |lines: &[Value]| {
        let fields = lines.iter().filter_map(|line| line["fields"].as_array()).flatten();
        fields.filter_map(|field| field["force"].as_f64()).fold(0.0, f64::max)
    };
    // The dead band takes single cells at the edge away, and no more.
    let own = largest(&run(&["--source", INSOLES]));
    assert!((0.9..=1.0).contains(&(largest(&lines) / own)) && own > 100.0);
    // In a recording of it, too, both as it is converted and as it is read.
    let recording = folder.path().join("dead.mcap");
    done(&["convert", INSOLES, text_of(&recording), "--calibration", text_of(&path)]);
    assert_eq!(run(&["--source", text_of(&recording), "--outputs", "force,total"]), lines[1..]);
    let newton = folder.path().join("newton.toml");
    std::fs::write(&newton, "[all]\nunit = \"N\"\n").unwrap();
    let both =
        ["run", "--source", text_of(&recording), "--calibration", text_of(&newton), "--backend", "cpu", "--sink", "-"];
    let said = stderr(&super::output(&both));
    assert!(said.contains("this stays under --calibration: dead_band = 2\n"), "{said}");
    assert!(said.contains("--calibration replaces its unit mmHg by N"), "{said}");
    // What is wrong with the file has its own line.
    std::fs::write(&newton, "[all]\n\nunit = \"newtn\"\n").unwrap();
    assert!(fails(1, &both).contains("newton.toml: line 3"), "{}", fails(1, &both));
}

#[test]
fn what_was_understood_of_a_plain_table_is_reported_in_a_line() {
    let rows = "millis,a,b,c,d\n1000,512,300,10,7\n1050,500,310,12,6\n1100,500,310,12,6\n";
    let (_folder, path) = file("millis.csv", rows);
    let grid = ["--grid", "2x2", "--pitch", "5mm"];
    let understood = format!("somatic: {}: column 1: the time in ms; columns 2 to 5: a 2 × 2 grid\n", path.display());
    let info = output(&[&["info", text_of(&path), "--json"][..], &grid].concat());
    assert_eq!((info.status.code(), stderr(&info)), (Some(0), understood.clone()));
    let known: Value = serde_json::from_slice(&info.stdout).unwrap();
    assert!(known["frames"] == 3 && (known["duration"].as_f64().unwrap() - 0.1).abs() < 1e-9, "{known}");
    let asked = [&["run", "--backend", "cpu", "--source", text_of(&path), "--outputs", "speed"][..], &grid].concat();
    let ran = output(&asked);
    assert!(ran.status.success() && stderr(&ran).contains(&understood), "{}", stderr(&ran));
    // Without flags, the way out is named.
    let why = fails(1, &["info", text_of(&path)]);
    assert!(why.contains("column 2 is headed `a`") && why.contains("--grid 2x2") && why.lines().count() == 1, "{why}");
    // A frame in place of a header, and ids in place of a frame.
    let (_folder, path) = file("headless.csv", "512,300,10,7\n500,310,12,6\n490,311,13,5\n");
    let why = fails(2, &["info", text_of(&path)]);
    assert!(why.contains("give --rate HZ, and add --grid 2x2") && why.lines().count() == 1, "{why}");
    let known: Value =
        serde_json::from_str(&done(&["info", text_of(&path), "--rate", "10", "--grid", "2x2", "--json"])).unwrap();
    assert_eq!(known["frames"], 3);
    let (_folder, path) = file("headless.csv", "1,2,3,4\n512,300,10,7\n");
    let said = output(&["info", text_of(&path), "--rate", "10"]);
    assert!(
        stderr(&said).contains("row 1 (1,2,3,4) is read as the taxels' ids; if it is a frame, --grid 2x2"),
        "{}",
        stderr(&said)
    );
}

/// `text` as an export of its own.
fn changed(text: &str) -> (tempfile::TempDir, std::path::PathBuf) {
    file("insoles.csv", text)
}

#[test]
fn what_was_read_of_a_file_that_is_cut_short_is_kept() {
    let whole = std::fs::read_to_string(INSOLES).unwrap();
    let at = whole.match_indices("FRAME").nth(40).unwrap().0;
    let (_folder, path) = changed(&whole[..at + 2500]);
    let output = output(&["run", "--backend", "cpu", "--quiet", "--source", text_of(&path), "--sink", "-"]);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert_eq!(frames(&String::from_utf8(output.stdout).unwrap())[..], run(&["--source", INSOLES])[..40]);
    assert!(said.contains("insoles.csv: line ") && said.contains("cut short") && said.lines().count() == 1, "{said}");
    fails(3, &["info", text_of(&path)]);
}

#[test]
fn a_wrong_row_in_the_middle_is_an_error_with_its_place() {
    let whole = std::fs::read_to_string(INSOLES).unwrap();
    let at = whole.match_indices("\n0,0,0,0,0,0,0,0,0,0,0\n").nth(400).unwrap().0;
    let line = whole[..at + 1].lines().count() + 1;
    let (_folder, path) = changed(&format!("{}0,0,O,0{}", &whole[..at + 1], &whole[at + 8..]));
    let error = fails(1, &["run", "--backend", "cpu", "--quiet", "--source", text_of(&path), "--sink", "-"]);
    assert!(error.contains(&format!("insoles.csv: line {line}: sensor `")), "{error}");
    assert!(error.contains("column 3: `O` is not a number") && error.lines().count() == 1, "{error}");
}

#[test]
fn what_is_given_must_fit_what_is_read() {
    let error = fails(2, &["run", "--source", INSOLES, "--rate", "50", "--sink", "-"]);
    assert!(error.contains("the recording has its own times"), "{error}");
    let touch = concat!(env!("CARGO_MANIFEST_DIR"), "/bodies/touch.csv");
    assert!(fails(2, &["run", "--source", touch, "--unit", "kPa"]).contains("--unit is for recordings"));
    assert!(
        fails(2, &["run", "--source", INSOLES, "--grid", "3x3"]).contains("--grid and --pitch are for plain matrices")
    );
    assert!(fails(2, &["run", "--source", INSOLES, "--unit", "kpascal"]).contains("--unit: there is no unit"));
    assert!(fails(2, &["info", INSOLES, "--format", "xsensr"]).contains("xsensor"));
    // Sensors and frames are read one after the other.
    if Path::new("/dev/stdin").exists() {
        let error = fails(2, &["run", "--source", "csv:/dev/stdin", "--format", "xsensor"]);
        assert!(error.contains("read more than once"), "{error}");
    }
    let error = fails(1, &["run", "--source", "no/such.lst"]);
    assert_eq!(error.matches("no/such.lst").count(), 1, "{error}");
}

#[test]
fn a_field_does_not_mix_quantities() {
    let (_folder, path) = file("mixed.toml", "[all]\nunit = \"kPa\"\n[taxel.4]\nunit = \"N\"\n");
    let error = fails(1, &["run", "--calibration", text_of(&path), "--sink", "-"]);
    assert!(error.contains("mixes quantities") && error.contains("taxel 4") && error.lines().count() == 1, "{error}");
    let (_folder, path) = file("unit.toml", "[all]\nunit = \"kPascal\"\n");
    let error = fails(1, &["run", "--calibration", text_of(&path), "--sink", "-"]);
    assert!(error.contains("line 2") && error.contains("no unit `kPascal`"), "{error}");
}

#[test]
fn a_calibration_is_converted_once_and_thresholds_with_it() {
    let with = |text: &str| {
        let (_folder, path) = file("unit.toml", text);
        run(&["--calibration", text_of(&path), "--outputs", "total,peak,force,area"])
    };
    let pascal = with("[all]\nunit = \"Pa\"\ngain = 2000\ndead_band = 3000\n[contact]\non = 40000\n");
    let kilopascal = with("[all]\nunit = \"kPa\"\ngain = 2\ndead_band = 3\n[contact]\non = 40\n");
    assert_eq!(pascal, kilopascal);
    assert!(pascal.iter().any(|frame| frame["fields"][0]["force"].as_f64().is_some_and(|newtons| newtons > 0.0)));
    assert_ne!(pascal, with("[all]\nunit = \"kPa\"\ngain = 2\ndead_band = 3\n[contact]\non = 400\n"));
    // A force in newtons adds up without areas.
    let newton = with("[all]\nunit = \"mN\"\n");
    let field = &newton[20]["fields"][0];
    let (total, force) = (field["total"].as_f64().unwrap(), field["force"].as_f64().unwrap());
    assert!((total - force).abs() < 1e-6 * total, "{field}");
}

/// pedar's insoles of five sensors each, and a table of their places.
fn pedar() -> (tempfile::TempDir, String, String) {
    let mut text = "pressure values in  kPa\n\nleft insole: 1,2,3,4,5,\nright insole: 1,2,3,4,5,\n\n".to_owned();
    text += "time[secs]    1 2 3 4 5 1 2 3 4 5\n";
    for frame in 0..20 {
        let load = |side: usize, sensor: usize| ((frame + 7 * side) % 20) * (10 + sensor);
        let row: Vec<String> = (0..10).map(|cell| load(cell / 5, cell % 5).to_string()).collect();
        text += &format!("  {:.2} {}\n", 0.02 * frame as f64, row.join(" "));
    }
    let (folder, path) = file("walk.asc", &text);
    let table = folder.path().join("insole.csv");
    let rows = (1..=5).map(|id| format!("{id},{},{},1e-4\n", 0.01 * f64::from(id % 2), 0.02 * f64::from(id)));
    std::fs::write(&table, format!("id,x,y,area\n{}", rows.collect::<String>())).unwrap();
    let (path, table) = (text_of(&path).to_owned(), text_of(&table).to_owned());
    (folder, path, table)
}

#[test]
fn places_of_insoles_are_used_by_every_command_that_reads_them() {
    let (folder, path, table) = pedar();
    let bare = run(&["--source", &path]);
    assert!(bare[5]["fields"][0]["force"].is_null() && bare[5]["fields"][0]["centroid"].is_null());
    // Nor has a touch a place, as a line or in a table.
    assert!(bare.iter().all(|frame| frame["touches"].is_null()));
    let tables = folder.path().join("bare.csv");
    done(&["run", "--quiet", "--backend", "cpu", "--source", &path, "--sink", &format!("csv:{}", text_of(&tables))]);
    assert!(tables.is_file() && !folder.path().join("bare.touches.csv").exists());
    let placed = run(&["--source", &path, "--layout", &table]);
    let (force, centroid) = (&placed[5]["fields"][0]["force"], &placed[5]["fields"][0]["centroid"]);
    assert!((force.as_f64().unwrap() - 5.0 * 60.0 * 1000.0 * 1e-4).abs() < 1e-3 && centroid.is_array(), "{force}");
    let info: Value = serde_json::from_str(&done(&["info", &path, "--layout", &table, "--json"])).unwrap();
    assert_eq!((&info["panels"][0]["placed"], &info["fields"][0]["load_unit"]), (&true.into(), &"N".into()), "{info}");
    let plot = folder.path().join("walk.svg");
    done(&["plot", &path, "--layout", &table, "-o", text_of(&plot)]);
    assert!(std::fs::read_to_string(&plot).unwrap().len() > 1000);
    let mcap = folder.path().join("walk.mcap");
    done(&["convert", &path, text_of(&mcap), "--layout", &table]);
    assert_eq!(run(&["--source", text_of(&mcap)]), placed);
    // A scene names it beside itself.
    let scene = folder.path().join("walk.scene.toml");
    std::fs::write(&scene, "source = \"walk.asc\"\nlayout = \"insole.csv\"\n").unwrap();
    assert_eq!(run(&[text_of(&scene)]), placed);
    assert!(fails(2, &["run", "--source", INSOLES, "--layout", &table]).contains("--layout is for pedar"));
    let touch = concat!(env!("CARGO_MANIFEST_DIR"), "/bodies/touch.csv");
    assert!(fails(2, &["run", "--source", touch, "--layout", &table]).contains("--layout is for recordings"));
    // What is read is no output.
    let output = format!("ndjson:{table}");
    fails(2, &["run", "--source", &path, "--layout", &table, "--sink", &output, "--force"]);
}
