//! From a rest and a press to a calibration that `somatic run` takes.

use serde_json::Value;

use crate::{done, fails, frames, output, stderr};

const SURVEY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/simulations/survey.toml");

#[test]
fn a_survey_becomes_a_calibration_under_which_rest_is_nothing_and_a_press_is_felt() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let (csv, toml, svg) = (at("survey.csv"), at("hand.toml"), at("hand.svg"));
    done(&["simulate", SURVEY, "-o", &csv]);
    let calibrate = ["calibrate", "--body", "hand", "--source", &csv, "--bits", "10", "-o", &toml];
    let found: Value = serde_json::from_str(&done(&[&calibrate[..], &["--plot", &svg, "--json"]].concat())).unwrap();
    assert_eq!((&found["invert"], &found["raw_range"]), (&true.into(), &serde_json::json!([0.0, 1023.0])));
    let sensors = found["sensors"].as_array().unwrap();
    assert_eq!(sensors.len(), 40);
    let sensor = |id: u64| sensors.iter().find(|sensor| sensor["taxel"] == id).unwrap();
    // The simulation's noise has σ = 1.5; below the end of the range it is cut off, so that the median is the end itself.
    for id in [0, 18, 25] {
        let number = |key: &str| sensor(id)[key].as_f64().unwrap();
        assert_eq!(number("baseline"), 1023.0);
        assert!((2.0..=8.0).contains(&number("strays")) && number("travel") > 500.0, "{}", sensor(id));
    }
    // It is dead, by the simulation; and the remark says so.
    assert!(sensor(17)["travel"].is_null());
    assert!(found["remarks"][0].as_str().unwrap().contains("were not pressed, and so have no travel: 17"), "{found}");
    assert!(std::fs::read_to_string(&svg).unwrap().contains("raw values falling when pressed"));

    let run = done(&[
        "run",
        "--body",
        "hand",
        "--source",
        &csv,
        "--calibration",
        &toml,
        "--backend",
        "cpu",
        "--outputs",
        "total",
    ]);
    let touched = |from_s: f64, to_s: f64| {
        let within = frames(&run).into_iter().filter(|frame| (from_s..to_s).contains(&frame["t"].as_f64().unwrap()));
        let touched: Vec<bool> = within.map(|frame| !frame["fields"].as_array().unwrap().is_empty()).collect();
        (touched.iter().filter(|touched| **touched).count(), touched.len())
    };
    let (at_rest, of) = touched(0.0, 4.0);
    // One value in a thousand is over the noise, and less over 1.5 times that.
    assert!(at_rest * 20 <= of, "touched in {at_rest} of {of} frames at rest");
    assert_eq!(touched(5.0, 5.6), (30, 30));

    // What is there stays, unless it is to be replaced.
    let before = std::fs::read_to_string(&toml).unwrap();
    assert!(fails(1, &calibrate).contains("it exists"));
    assert_eq!(std::fs::read_to_string(&toml).unwrap(), before);
    done(&[&calibrate[..], &["--force"]].concat());
}

/// Twelve barometers that rest at 100000 and fall to 60000, and say 30000 where they have no reading.
#[test]
fn codes_that_are_not_readings_are_left_out_and_written_down() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let ids: Vec<String> = (0..12).map(|id| id.to_string()).collect();
    let mut text = format!("t,{}\n", ids.join(","));
    for n in 0..300 {
        let row = (0..12).map(|sensor| match (n, n % 37 == 3 * sensor, n / 20 == sensor + 3) {
            (_, true, _) => "30000".to_owned(),
            (100.., false, true) => "60000".to_owned(),
            _ => (100_000 + [0, 1, -1][n % 3]).to_string(),
        });
        text += &format!("{},{}\n", 0.02 * n as f64, row.collect::<Vec<_>>().join(","));
    }
    std::fs::write(at("codes.csv"), text).unwrap();
    let (source, toml) = (at("codes.csv"), at("codes.toml"));
    let body = at("grid.glb");
    done(&["author", "--grid", "3x4", "--pitch", "5mm", "-o", &body]);
    let first = ["calibrate", "--body", &body, "--source", &source, "--rest", "1.2", "-o", &toml];
    done(&[&first[..], &["--missing", "30000"]].concat());
    let written = std::fs::read_to_string(&toml).unwrap();
    assert!(written.contains("missing = [30000.0]") && written.contains("invert = true"), "{written}");
    let run = ["run", "--body", &body, "--source", &source, "--calibration", &toml, "--backend", "cpu"];
    let all = frames(&done(&[&run[..], &["--outputs", "total", "--all-fields", "--verify"]].concat()));
    let flagged = all.iter().filter(|frame| frame["fields"].to_string().contains("incomplete")).count();
    assert!(flagged > 0 && flagged < all.len() / 2, "{flagged} of {} frames have a code", all.len());
    // A pressed sensor gives 40000; a code is nothing.
    let totals = all.iter().flat_map(|frame| frame["fields"].as_array().unwrap()).filter_map(|f| f["total"].as_f64());
    let largest = totals.fold(0.0, f64::max);
    assert!((39_990.0..40_010.0).contains(&largest), "{largest}");
}

#[test]
fn a_survey_that_says_nothing_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let still: String = (0..100).fold("t,0,1\n".to_owned(), |text, n| text + &format!("{},5,7\n", f64::from(n) * 0.1));
    std::fs::write(at("still.csv"), still).unwrap();
    let (source, toml) = (at("still.csv"), at("hand.toml"));
    let refused = |more: &[&str], what: &str, code: i32| {
        let first = ["calibrate", "--body", "hand", "--source", &source, "-o", &toml];
        let output = output(&[&first[..], more].concat());
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        assert!(stderr(&output).contains(what), "{}", stderr(&output));
        assert!(!std::path::Path::new(&toml).exists());
    };
    refused(&[], "no sensor left its rest", 1);
    refused(&["--rest=-1"], "must be over 0", 2);
    refused(&["--plot", "a.gif"], "ends in .svg or .png", 2);
}

#[test]
fn a_rest_in_which_something_moved_leaves_nothing_behind_but_the_names_of_its_sensors() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let (csv, toml) = (at("survey.csv"), at("hand.toml"));
    done(&["simulate", SURVEY, "-o", &csv]);
    // The back of the hand is pressed from 4.5 s on.
    let rest =
        |seconds| ["calibrate", "--body", "hand", "--source", &csv, "--bits", "10", "-o", &toml, "--rest", seconds];
    let error = fails(1, &rest("5"));
    assert!(error.lines().count() == 1 && error.contains(" of 40 sensors moved during the rest: 16, 18, "), "{error}");
    assert!(error.contains("of a raw range of 1023. Keep everything off the robot"), "{error}");
    assert!(!std::path::Path::new(&toml).exists());

    let masked = done(&[&rest("5")[..], &["--mask-moved"]].concat());
    assert!(masked.contains("sensors moved at rest, and are masked: 16, 18, "), "{masked}");
    assert!(std::fs::read_to_string(&toml).unwrap().contains("[taxel.16]\nmask = true\n"));
    done(&[&rest("4.4")[..], &["--force"]].concat());
    assert!(!std::fs::read_to_string(&toml).unwrap().contains("[taxel.16]\nmask = true\n"));
}

#[test]
fn gains_from_a_wandering_finger_are_written_into_the_calibration() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let simulation = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/simulations/finger.toml");
    let text = std::fs::read_to_string(simulation).unwrap().replace("../../grid.glb", "grid.glb");
    std::fs::write(at("finger.toml"), text).unwrap();
    let (grid, touches, first, second) = (at("grid.glb"), at("t.csv"), at("t.calibration.toml"), at("skin.toml"));
    done(&["author", "--grid", "13x13", "--pitch", "5mm", "-o", &grid]);
    done(&["simulate", &at("finger.toml"), "-o", &touches]);
    let calibrate = ["calibrate", "--body", &grid, "--gains-from", &touches, "--calibration", &first];
    let reported = done(&[&calibrate[..], &["-o", &second]].concat());
    assert!(
        reported.contains("of 145 of 169 taxels; they differ by 20") && reported.contains("pressed too seldom"),
        "{reported}"
    );
    let written = std::fs::read_to_string(&second).unwrap();
    assert!(written.contains("[taxel.162]\ngain = ") && written.contains("[layer]\nsigma_m = 0.0035"), "{written}");
    // It is what `run` takes, and fits come of it.
    let run =
        ["run", "--body", &grid, "--source", &touches, "--calibration", &second, "--outputs", "touches.fit_place"];
    let lines = done(&run);
    // Once in the first line, which says what it is measured in.
    assert!(lines.matches("\"fit_place\"").count() > 2000, "{}", lines.lines().next().unwrap());
    std::fs::write(at("one.csv"), "t,84\n0,5\n").unwrap();
    let (one, no) = (at("one.csv"), at("no"));
    let too_few = fails(1, &[&calibrate[..4], &[&one], &calibrate[5..], &["-o", &no]].concat());
    assert!(
        too_few.contains("taxels or more, away from others, and 0 do") && too_few.contains("two minutes"),
        "{too_few}"
    );
    assert!(!folder.path().join("no").exists());
}

#[test]
fn a_press_that_shows_its_row_and_its_column_is_named_with_its_size() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let (body, simulation, csv, toml) = (at("grid.glb"), at("press.toml"), at("press.csv"), at("grid.toml"));
    done(&["author", "--grid", "13x13", "--pitch", "5mm", "-o", &body]);
    let found = |crosstalk: f64| -> Value {
        let text = format!(
            "body = \"grid.glb\"\nrate_hz = 25\nduration_s = 16\nseed = 3\n[layer]\nthickness_m = 0.004\nkernel = \"boussinesq\"\n\
             [sensor]\nkind = \"linear\"\ngain = 600\noffset = 100\nbits = 12\nnoise_sigma = 1.5\ncrosstalk = {crosstalk}\n\
             [[touch]]\non = \"grid\"\nindenter = \"fingertip\"\npath = [[-0.02, -0.02], [0.02, -0.01], [0, 0.01]]\n\
             times_s = [4, 9, 15]\nforce_newton = [[4, 0], [4.5, 6], [10, 3], [15, 8], [15.5, 0]]\n"
        );
        std::fs::write(&simulation, text).unwrap();
        done(&["simulate", &simulation, "-o", &csv, "--force"]);
        let calibrate =
            ["calibrate", "--body", &body, "--source", &csv, "--bits", "12", "-o", &toml, "--force", "--json"];
        serde_json::from_str(&done(&calibrate)).unwrap()
    };
    let with = found(0.01);
    let [share, pressed, split, band] = ["share", "frames", "frames_with_touches_by_it", "dead_band"]
        .map(|key| with["crosstalk"][key].as_f64().unwrap_or_else(|| panic!("{with:#}")));
    assert!((share - 0.01).abs() < 0.001, "{share}");
    assert!(split > 0.5 * pressed && pressed > 100.0, "{split} of {pressed}");
    let remark = with["remarks"].as_array().unwrap().last().unwrap().as_str().unwrap();
    assert!(remark.contains("crosstalk: a press shows 0.9 % on the other sensors of its rows and columns"), "{remark}");

    // With the dead band that it names, what nothing touches is not touched.
    let touches = |arguments: &[&str]| {
        let run =
            ["run", "--body", &body, "--source", &csv, "--outputs", "touches", "--backend", "cpu", "--calibration"];
        let frames = frames(&done(&[&run, arguments].concat()));
        frames.iter().map(|frame| frame["touches"].as_array().map_or(0, Vec::len)).max().unwrap()
    };
    let wide = at("wide.toml");
    std::fs::write(
        &wide,
        std::fs::read_to_string(&toml).unwrap().replace("dead_band = ", &format!("dead_band = {band} # ")),
    )
    .unwrap();
    let counts = [touches(&[&toml]), touches(&[&wide])];
    assert!(counts[0] > 3 && counts[1] == 1, "{counts:?}");

    assert!(found(0.0)["crosstalk"].is_null());
}

/// Frames at 50 Hz of four sensors that rest at 100: two seconds of rest, then these presses, how far each sensor goes.
fn presses(all: &[[f64; 4]]) -> String {
    let mut text = "t,0,1,2,3\n".to_owned();
    let mut frame = 0;
    let mut put = |values: [f64; 4], times: usize| {
        for _ in 0..times {
            let cells = values.map(|value| (100.0 + value).to_string()).join(",");
            text += &format!("{},{cells}\n", 0.02 * f64::from(frame));
            frame += 1;
        }
    };
    put([0.0; 4], 100);
    for &press in all {
        put(press, 20);
        put([0.0; 4], 20);
    }
    text
}

/// The largest force of the whole body in each press of `source`, N.
fn forces(body: &str, source: &str, calibration: &str, count: usize) -> Vec<f64> {
    let run = ["run", "--quiet", "--body", body, "--source", source, "--calibration", calibration, "--backend", "cpu"];
    let all = frames(&done(&[&run[..], &["--outputs", "force", "--all-fields"]].concat()));
    let force = |frame: &Value| frame["fields"][0]["force"].as_f64().unwrap_or(0.0);
    (0..count).map(|press| force(&all[100 + 40 * press + 10])).collect()
}

#[test]
fn several_weights_make_a_curve_of_each_sensor_and_one_scale_of_a_field() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).display().to_string();
    let body = at("row.glb");
    done(&["author", "--grid", "1x4", "--pitch", "18mm", "-o", &body]);
    let calibrate = |source: &str, to: &str, more: &[&str]| {
        done(&[&["calibrate", "--body", &body, "--source", source, "-o", to][..], more].concat())
    };
    // Each sensor has its own gain, and answers less and less.
    let each: Vec<[f64; 4]> = [1.0, 1.1, 0.9, 1.2]
        .iter()
        .enumerate()
        .flat_map(|(sensor, gain)| {
            [100.0, 160.0, 250.0].map(|travel: f64| {
                let mut press = [0.0; 4];
                press[sensor] = (travel * gain).round();
                press
            })
        })
        .collect();
    std::fs::write(at("each.csv"), presses(&each)).unwrap();
    calibrate(&at("each.csv"), &at("curve.toml"), &["--rest", "2", "--known", "1N,2N,5N", "--on", "taxel"]);
    let curves = std::fs::read_to_string(at("curve.toml")).unwrap();
    assert!(curves.contains("curve = \"taxel_3\"") && curves.contains("[curve.usual]"), "{curves}");
    for (press, force) in forces(&body, &at("each.csv"), &at("curve.toml"), 12).into_iter().enumerate() {
        let known = [1.0, 2.0, 5.0][press % 3];
        assert!((force / known - 1.0).abs() < 1e-3, "press {press}: {force} N");
    }
    let wrong = ["--rest", "2", "--known", "1N,2N", "--on", "taxel"];
    let why =
        fails(1, &[&["calibrate", "--body", &body, "--source", &at("each.csv"), "-o", &at("no")][..], &wrong].concat());
    assert!(why.contains("sensor 0 was pressed 3 times, and 2 forces are known"), "{why}");

    // One scale beside gains that were found before.
    calibrate(&at("each.csv"), &at("equal.toml"), &["--rest", "2", "--equalise"]);
    let gains = std::fs::read_to_string(at("equal.toml")).unwrap();
    let field = [100.0, 200.0, 150.0].map(|travel: f64| [1.0, 1.1, 0.9, 1.2].map(|gain| (travel * gain).round()));
    std::fs::write(at("field.csv"), presses(&field)).unwrap();
    let known = ["--known", "4N,8N,6N", "--on", "field", "--calibration", &at("equal.toml")];
    let reported = calibrate(&at("field.csv"), &at("newton.toml"), &known);
    assert!(reported.contains("one scale for 3 presses"), "{reported}");
    let scaled = std::fs::read_to_string(at("newton.toml")).unwrap();
    assert!(scaled.contains("\nscale = 0.0") && scaled.contains("unit = \"N\""), "{scaled}");
    assert!(gains.lines().filter(|line| line.starts_with("gain = ")).all(|line| scaled.contains(line)), "{scaled}");
    for (force, known) in forces(&body, &at("field.csv"), &at("newton.toml"), 3).into_iter().zip([4.0, 8.0, 6.0]) {
        assert!((force / known - 1.0).abs() < 0.02, "{force} N for {known} N");
    }
    // The same without a file before: what is found at rest gets it.
    calibrate(&at("field.csv"), &at("once.toml"), &["--rest", "2", "--known", "4N,8N,6N", "--on", "field"]);
    for (force, known) in forces(&body, &at("field.csv"), &at("once.toml"), 3).into_iter().zip([4.0, 8.0, 6.0]) {
        assert!((force / known - 1.0).abs() < 0.02, "{force} N for {known} N");
    }
    let alone = [
        "calibrate",
        "--body",
        &body,
        "--source",
        &at("field.csv"),
        "-o",
        &at("no"),
        "--calibration",
        &at("newton.toml"),
    ];
    assert!(fails(2, &alone).contains("--calibration is for --gains-from and --known"));
    assert!(!folder.path().join("no").exists());
}
