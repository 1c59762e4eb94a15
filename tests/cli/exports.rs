//! Exports of pressure systems at the process boundary: read as they are, with exit codes for what is wrong with them.

use std::path::Path;

use serde_json::Value;

use somatic_testing::skip;

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
    assert_eq!((&left["field"], &left["contacts"], &left["unit"]), (&"left".into(), &1.into(), &"N".into()));
    assert_eq!((&left["quantity"], &left["threshold"]), (&"force".into(), &20.0.into()));
    assert!((0.5..0.7).contains(&left["stance"].as_f64().unwrap()), "{left}");
    let text = done(&["info", INSOLES]);
    assert!(text.contains("682: left 341, right 341") && text.contains("unit        mmHg"), "{text}");
}

/// Rows of a plain table of two sensors in N at 100 Hz, of which one feels these forces.
fn plain(forces: &[f64]) -> String {
    forces.iter().map(|force| format!("{force} 0\n")).collect()
}

#[test]
fn a_flicker_is_no_stance() {
    let mut forces = vec![0.0; 20];
    for stance in 0..3 {
        forces.extend([3.0, 0.0, 3.0, 0.0, 0.0]);
        forces.extend((0..60).map(|frame| 600.0 - 8.0 * f64::from((frame - 30_i32).abs()) + f64::from(stance)));
        forces.extend([15.0, 3.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0]);
    }
    let (_folder, path) = file("step.txt", &plain(&forces));
    let info = |more: &[&str]| -> Value {
        let asked =
            ["info", text_of(&path), "--grid", "1x2", "--pitch", "5mm", "--rate", "100", "--unit", "N", "--json"];
        serde_json::from_str(&done(&[&asked[..], more].concat())).unwrap()
    };
    let field = &info(&[])["fields"][0];
    assert_eq!((&field["contacts"], &field["whole"], &field["threshold"]), (&3.into(), &3.into(), &20.0.into()));
    assert!((0.60..=0.62).contains(&field["stance"].as_f64().unwrap()), "{field}");
    assert_eq!(info(&["--threshold", "1N", "--shortest", "0"])["fields"][0]["contacts"], 12);
    assert_eq!(info(&["--threshold", "1%", "--shortest", "100ms"])["fields"][0]["contacts"], 3);
    let text = done(&["info", text_of(&path), "--grid", "1x2", "--pitch", "5mm", "--rate", "100", "--unit", "N"]);
    assert!(text.contains("force, peak") && !text.contains("load") && text.contains("lasts 50 ms or more"), "{text}");
    // A sum of pressures is no load.
    let (_folder, pedar, _) = pedar();
    let text = done(&["info", &pedar]);
    assert!(text.contains("total, peak") && !text.contains("load") && !text.contains("force"), "{text}");
    assert!(fails(2, &["info", &pedar, "--threshold", "20N"]).contains("give a share of the peak"));
}

#[test]
fn contacts_of_several_recordings_are_one_table() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("contacts.csv");
    let mat = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/exports/mat.asf");
    done(&["info", INSOLES, mat, "--contacts", text_of(&table)]);
    let text = std::fs::read_to_string(&table).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 4, "{text}");
    let column = |name: &str| rows[0].iter().position(|head| *head == name).unwrap_or_else(|| panic!("{name}: {text}"));
    assert_eq!(rows[1..].iter().map(|row| row[column("recording")]).collect::<Vec<_>>(), [INSOLES, INSOLES, mat]);
    assert_eq!(rows[1..].iter().map(|row| row[column("field")]).collect::<Vec<_>>(), ["left", "right", "sensor"]);
    for row in &rows[1..] {
        let number = |name: &str| row[column(name)].parse::<f64>().unwrap_or_else(|_| panic!("{name}: {row:?}"));
        let lasts = number("offset [s]") - number("onset [s]");
        let mean = number("impulse [N s]") / lasts;
        assert!(lasts > 0.4 && mean > 0.3 * number("force_peak [N]") && mean < number("force_peak [N]"), "{row:?}");
        assert!(number("pressure_time") > 0.0 && number("pressure_time") < lasts * number("pressure_peak"), "{row:?}");
        assert!(number("area [m²]") > 1e-4 && number("path [m]") > 0.0 && row[column("unit")] == "Pa", "{row:?}");
    }
    // The force of an insole is what `run` gives.
    let left = run(&["--source", INSOLES, "--outputs", "force", "--fields", "left"]);
    let forces = left.iter().filter_map(|frame| frame["fields"][0]["force"].as_f64());
    let largest = rows[1][column("force_peak [N]")].parse::<f64>().unwrap();
    assert!((forces.fold(0.0, f64::max) / largest - 1.0).abs() < 1e-5, "{text}");
    assert!(fails(1, &["info", INSOLES, "--contacts", text_of(&table)]).contains("it exists"));
    let touch = concat!(env!("CARGO_MANIFEST_DIR"), "/bodies/touch.csv");
    let none = folder.path().join("none.csv");
    assert!(fails(1, &["info", touch, "--contacts", text_of(&none)]).contains("it has no body"));
    assert!(!none.exists());
    let both: Value = serde_json::from_str(&done(&["info", INSOLES, mat, "--json"])).unwrap();
    assert_eq!(both.as_array().map(Vec::len), Some(2));
}

#[test]
fn steps_of_real_insoles_are_those_that_were_made() {
    let root = std::env::var("SOMATIC_DATA").unwrap_or_else(|_| "../shared/data".to_owned());
    let path = format!("{root}/recordings/vendor/pedar_example.asc");
    if !Path::new(&path).exists() {
        return skip("DATA", format!("{path} is not there; set SOMATIC_DATA to the folder that has it"));
    }
    let known: Value = serde_json::from_str(&done(&["info", &path, "--json"])).unwrap();
    let counted =
        |of: &str| known["fields"].as_array().unwrap().iter().map(|field| field[of].clone()).collect::<Vec<_>>();
    // Ten of each foot. Both stand when the recording begins, and the right one when it ends.
    assert_eq!(counted("contacts"), [10, 10]);
    assert_eq!(counted("whole"), [9, 8]);
}

#[test]
fn an_export_becomes_a_body_with_named_zones() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let (body, zones, listed) = (at("body.glb"), at("zones.glb"), at("listed.glb"));
    done(&["convert", INSOLES, "-o", &body]);
    let reported = done(&["author", &body, "--zones", "heel=30%,midfoot,forefoot=30%,toes=15%", "-o", &zones]);
    assert!(reported.contains("left/heel: ") && reported.contains("right/toes: "), "{reported}");
    let force = |frame: &Value, name: &str| {
        let fields = frame["fields"].as_array().unwrap();
        fields.iter().find(|field| field["field"] == name).and_then(|field| field["force"].as_f64()).unwrap_or(0.0)
    };
    // The zones of a foot are all of it, and a step goes from the heel to the toes.
    let all = run(&["--source", INSOLES, "--body", &zones, "--outputs", "force", "--all-fields"]);
    let names = ["left/heel", "left/midfoot", "left/forefoot", "left/toes"];
    for frame in &all {
        let sum: f64 = names.iter().map(|name| force(frame, name)).sum();
        assert!((sum - force(frame, "left")).abs() < 1e-3 * sum.max(1.0), "{frame}");
    }
    let peaks = names.map(|name| all.iter().map(|frame| force(frame, name)).fold(0.0, f64::max));
    assert!(peaks.iter().filter(|peak| **peak > 0.0).count() >= 3, "{peaks:?}");
    std::fs::write(at("masks.csv"), "taxel,zone\n0,toe\n1,toe\n2,big\n").unwrap();
    done(&["author", &body, "--zones", &at("masks.csv"), "-o", &listed]);
    let inspected: Value = serde_json::from_str(&done(&["inspect", &listed, "--json"])).unwrap();
    let named: Vec<&str> =
        inspected["fields"].as_array().unwrap().iter().map(|field| field["name"].as_str().unwrap()).collect();
    assert!(named.contains(&"left/toe") && named.contains(&"left/big"), "{named:?}");
    let (_folder, bare, _) = pedar();
    assert!(fails(1, &["convert", &bare, "-o", &at("no.glb")]).contains("give their places as --layout"));
    assert!(fails(2, &["author", &body, "--zones", "heel,heel", "-o", &at("no.glb")]).contains("a name of its own"));
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
    assert_eq!((&info["panels"][0]["placed"], &info["fields"][0]["unit"]), (&true.into(), &"N".into()), "{info}");
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
