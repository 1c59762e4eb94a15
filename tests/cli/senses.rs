//! Shear, temperature and proximity in plots and pictures.

use std::path::{Path, PathBuf};

use somatic::internal::colours::{distance_colours, pressure_colours, temperature_colours};
use somatic_testing::skip;

use super::{done, fails, frames, output, stderr, text_of};

/// A skin with two taxels of each kind, its calibration and a recording: pressed and pulled along y, warmer from second to second,
/// with something that comes nearer to the first proximity taxel, and nothing near the second.
struct Skin {
    folder: tempfile::TempDir,
}

impl Skin {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let kinds = [("force3", "0,1,0"), ("temperature", ",,"), ("proximity", ",,")];
        let rows = kinds.into_iter().enumerate().flat_map(|(kind, (name, tangent))| {
            (0..2).map(move |n| {
                format!(
                    "{},pad,{},{},0,0,0,1,1.6e-5,{name},{tangent}\n",
                    10 * kind + n,
                    0.01 * kind as f64,
                    0.005 * n as f64
                )
            })
        });
        let rows: String = rows.collect();
        std::fs::write(at("skin.csv"), format!("id,link,x,y,z,nx,ny,nz,area,modality,tx,ty,tz\n{rows}")).unwrap();
        std::fs::write(at("fields.toml"), "[[fields]]\nname = \"pad\"\ntaxels = [\"0..=99\"]\n").unwrap();
        let calibration = "[all]\nunit = \"N\"\np_max = 0.4\n[temperature]\nraw_range = [0, 50]\n[proximity]\nunit = \"mm\"\nrange = 80\n";
        std::fs::write(at("senses.toml"), calibration).unwrap();
        let frames: String = (0..21)
            .map(|n| f64::from(n) * 0.1)
            .map(|t| format!("{t},0.4,0.2,{},{},{},200,0.2,0.1,0,0\n", 20.0 + 5.0 * t, 30.0 + 5.0 * t, 60.0 - 20.0 * t))
            .collect();
        std::fs::write(at("touch.csv"), format!("t,0,1,10,11,20,21,0.u,1.u,0.v,1.v\n{frames}")).unwrap();
        done(&["author", "--csv-skin", text_of(&at("skin.csv")), "-o", text_of(&at("bare.glb"))]);
        done(&[
            "author",
            text_of(&at("bare.glb")),
            "--recipe",
            text_of(&at("fields.toml")),
            "-o",
            text_of(&at("pad.glb")),
        ]);
        Self { folder }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn plot(&self, outputs: &str) -> Vec<String> {
        let [body, calibration, touch, to] = ["pad.glb", "senses.toml", "touch.csv", "a.svg"].map(|name| self.at(name));
        let from = ["plot", text_of(&touch), "--body", text_of(&body), "--calibration", text_of(&calibration)];
        done(&[&from[..], &["--outputs", outputs, "-o", text_of(&to), "--force"]].concat());
        let svg = std::fs::read_to_string(&to).unwrap();
        svg.lines().map(str::to_owned).collect()
    }

    /// The colours of a picture, or none where no adapter answers.
    fn render(&self, letter: &[&str]) -> Option<Vec<[u8; 3]>> {
        let [body, calibration, touch, to] = ["pad.glb", "senses.toml", "touch.csv", "a.png"].map(|name| self.at(name));
        let from = ["render", text_of(&body), "--source", text_of(&touch), "--calibration", text_of(&calibration)];
        let how = ["--at", "2s", "--view", "front", "--size", "900", "-o", text_of(&to), "--force"];
        drawn(&[&from[..], &how, letter].concat(), &to)
    }
}

/// The colours of the picture that `arguments` draw at `to`, or none where no adapter answers.
pub(super) fn drawn(arguments: &[&str], to: &Path) -> Option<Vec<[u8; 3]>> {
    let output = output(arguments);
    let said = stderr(&output);
    if said.contains("no GPU driver answers") {
        skip("GPU", "no adapter answers");
        return None;
    }
    assert_eq!((output.status.code(), said.as_str()), (Some(0), ""));
    Some(pixels(to))
}

fn pixels(path: &Path) -> Vec<[u8; 3]> {
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    bytes.chunks_exact(3).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
}

/// Pixels of a colour, as near as an adapter rounds: of discs, which are flat, and a column of the legend.
pub(super) fn count(picture: &[[u8; 3]], colour: [u8; 3]) -> usize {
    let is_of = |pixel: &&[u8; 3]| pixel.iter().zip(colour).all(|(&one, other)| one.abs_diff(other) <= 2);
    picture.iter().filter(is_of).count()
}

#[test]
fn the_kinds_of_taxels_are_counted() {
    let skin = Skin::new();
    assert!(done(&["inspect", text_of(&skin.at("pad.glb"))]).contains("2 temperature, 2 proximity, 2 force3"));
    assert!(!done(&["inspect", "hand"]).contains("pressure"));
    // A recording has three values of a taxel with three axes.
    let recording = done(&["info", text_of(&skin.at("touch.csv")), "--json"]);
    let known: serde_json::Value = serde_json::from_str(&recording).unwrap();
    assert_eq!(known["taxels"], 6, "{known}");
}

#[test]
fn each_quantity_is_plotted_in_the_letter_that_gives_it_with_its_unit() {
    let skin = Skin::new();
    let lines = skin.plot("temperature,nearest,shear,friction,torsion");
    let svg = lines.join("\n");
    for label in ["temperature [°C]", "nearest [mm]", "shear [N]", "friction", "torsion [N mm]"] {
        assert!(svg.contains(label), "{label}");
    }
    // A line for each: of the shear along u and v.
    let points = |line: &String| {
        line.split_once("points=\"").map_or(0, |(_, rest)| rest.split('"').next().unwrap().split_whitespace().count())
    };
    // Of as many points as there are frames.
    let drawn = |outputs: &str| skin.plot(outputs).iter().filter(|line| points(line) == 21).count();
    let without = drawn("total");
    let more = ["temperature", "nearest", "shear"].map(|output| drawn(&format!("total,{output}")) - without);
    assert!(without > 0 && more == [1, 1, 2], "{without} {more:?}");
    // 25 to 35 °C and 60 to 20 mm: numbers of their axes.
    for number in ["30", "40", "60"] {
        assert!(lines.iter().any(|line| line.trim() == number), "{number}");
    }
    assert!(fails(2, &["plot", "-o", text_of(&skin.at("b.svg")), "--outputs", "temperature"]).contains("temperature"));
}

#[test]
fn a_panel_without_values_says_why() {
    let skin = Skin::new();
    std::fs::write(skin.at("senses.toml"), "[all]\nunit = \"kPa\"\n[proximity]\nunit = \"mm\"\nrange = 10\n").unwrap();
    let svg = skin.plot("nearest,slip_ratio,torsion,warmest_taxel,total_sigma").join("\n");
    for text in ["nothing in range", "no slips_at in the calibration", "no noise in the calibration", "torsion [Pa m]"]
    {
        assert_eq!(svg.matches(text).count(), 1, "{text}");
    }
    // The ids of its axis are whole: 11 and its neighbours.
    let numbers: Vec<&str> = svg.lines().map(str::trim).filter(|line| line.parse::<f64>().is_ok()).collect();
    assert!(["10", "11", "12"].iter().all(|id| numbers.contains(id)) && !numbers.contains(&"10.5"), "{numbers:?}");
    // With something in range there is a line, and no reason.
    let all = Skin::new().plot("nearest").join("\n");
    assert!(!all.contains("nothing in range") && all.contains("nearest [mm]"));
}

#[test]
fn the_usual_quantities_are_those_of_the_fields_that_are_chosen() {
    let skin = Skin::new();
    let [bare, body, recipe, touch, to] =
        ["bare.glb", "parts.glb", "parts.toml", "touch.csv", "b.svg"].map(|name| skin.at(name));
    let field = |name: &str, taxels: &str| format!("[[fields]]\nname = \"{name}\"\ntaxels = [\"{taxels}\"]\n");
    std::fs::write(&recipe, field("pressed", "0..=1") + &field("warm", "10..=11") + &field("near", "20..=21")).unwrap();
    done(&["author", text_of(&bare), "--recipe", text_of(&recipe), "-o", text_of(&body)]);
    let labels = |fields: &[&str]| {
        let from = ["plot", text_of(&touch), "--body", text_of(&body), "-o", text_of(&to), "--force"];
        done(&[&from[..], fields].concat());
        let svg = std::fs::read_to_string(&to).unwrap();
        ["area", "warmest", "nearest"].map(|name| svg.contains(&format!("{name} [")))
    };
    assert_eq!(labels(&["--fields", "warm"]), [false, true, false]);
    assert_eq!(labels(&["--fields", "warm", "--fields", "near"]), [false, true, true]);
    assert_eq!(labels(&["--fields", "pressed"]), [true, false, false]);
    assert_eq!(labels(&[]), [true, false, false]);
}

#[test]
fn a_quantity_that_no_upper_field_has_is_plotted_of_the_first_one_that_has_it() {
    let folder = tempfile::tempdir().unwrap();
    let to = folder.path().join("a.svg");
    let named = |outputs: &str, from_s: &str| {
        let asked = ["plot", "--body", "sensing-hand", "--outputs", outputs, "--from", from_s, "-o", text_of(&to)];
        done(&[&asked[..], &["--force"]].concat());
        std::fs::read_to_string(&to).unwrap().matches("hand/midhand/index").count()
    };
    // Maps name it twice. While the finger alone is touched, the fields above it have a friction, and no chart to have a shear in.
    assert_eq!((named("friction", "4"), named("shear", "4")), (2, 3));
    // Before, the palm has both.
    assert_eq!(named("shear", "0"), 2);
}

#[test]
fn taxels_have_the_colours_of_the_letter_that_is_asked_for() {
    let skin = Skin::new();
    let at = |map: [[u8; 3]; 256], share: f64| map[(255.0 * share).round() as usize];
    let Some(pressures) = skin.render(&[]) else { return };
    for share in [1.0, 0.5] {
        assert!(count(&pressures, at(pressure_colours(), share)) > 200, "{share}");
    }
    let warm = at(temperature_colours(), 40.0 / 50.0);
    assert_eq!(count(&pressures, warm), 0);
    let temperatures = skin.render(&["--letter", "temperature"]).unwrap();
    assert!(count(&temperatures, warm) > 200 && count(&temperatures, at(temperature_colours(), 0.6)) > 200);
    let distances = skin.render(&["--letter", "proximity"]).unwrap();
    assert!(count(&distances, at(distance_colours(), 20.0 / 80.0)) > 200);
    let shears = skin.render(&["--letter", "shear"]).unwrap();
    assert!(count(&shears, at(pressure_colours(), 0.5)) > 200);
    // Arrows are black around white, and there are none on temperatures.
    let black = [0; 3];
    assert!(count(&shears, black) > count(&temperatures, black) + 50);
}

#[test]
fn letters_that_cannot_be_drawn_are_refused() {
    let skin = Skin::new();
    let [body, touch, to] = ["pad.glb", "touch.csv", "a.png"].map(|name| skin.at(name));
    let render = ["render", text_of(&body), "-o", text_of(&to)];
    assert!(fails(2, &[&render[..], &["--letter", "shear"]].concat()).contains("--letter"));
    let drawn = [&render[..], &["--source", text_of(&touch)]].concat();
    assert!(fails(2, &[&drawn[..], &["--letter", "warmth"]].concat()).contains("there is no letter `warmth`"));
    assert!(fails(2, &[&drawn[..], &["--letter", "change"]].concat()).contains("changes are not drawn"));
    let bundled = concat!("csv:", env!("CARGO_MANIFEST_DIR"), "/bodies/touch.csv");
    let hand = ["render", "hand", "--source", bundled, "--letter", "temperature", "-o", text_of(&to)];
    assert!(fails(2, &hand).contains("letter `temperature` has no taxels"));
}

/// The colours of the chart of a field of the bundled meeting, or none where no adapter answers.
fn chart(field: &str, letter: &str, at: &[&str]) -> Option<Vec<[u8; 3]>> {
    let folder = tempfile::tempdir().unwrap();
    let to = folder.path().join("chart.png");
    let from = ["render", "sensing-hand", "--source", MEETING, "--calibration", CALIBRATION, "--size", "600"];
    drawn(&[&from[..], &["--uv", field, "--letter", letter, "-o", text_of(&to)], at].concat(), &to)
}

const MEETING: &str = concat!("csv:", env!("CARGO_MANIFEST_DIR"), "/bodies/meeting.csv");
const CALIBRATION: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/bodies/sensing-hand.toml");
const BLACK: [u8; 3] = [0; 3];

#[test]
fn charts_have_arrows_of_tangential_forces_that_point_where_they_pull() {
    let Some(dragged) = chart("hand/midhand/index", "shear", &["--at", "4.8s"]) else { return };
    let resting = chart("hand/midhand/index", "shear", &["--at", "4.1s"]).unwrap();
    // Before the finger is dragged the legend alone has an arrow.
    let rows = |picture: &[[u8; 3]]| {
        let black = picture.iter().enumerate().filter(|(_, pixel)| **pixel == BLACK);
        black.map(|(at, _)| at / 600).collect::<Vec<_>>()
    };
    let (pulled, before) = (rows(&dragged), rows(&resting));
    assert!(!before.is_empty() && pulled.len() > 3 * before.len(), "{} and {} pixels", pulled.len(), before.len());
    // The shear is along −v, as percepts have it too. An arrow's head is at its lower end, and is wider than its tail.
    let of_arrows: Vec<usize> = pulled.into_iter().filter(|row| !before.contains(row)).collect();
    let [top, bottom] = [of_arrows.iter().min().unwrap(), of_arrows.iter().max().unwrap()];
    let wide = |from: usize, to: usize| of_arrows.iter().filter(|row| (from..to).contains(row)).count();
    assert!(wide(bottom - 12, bottom + 1) > wide(*top, top + 13), "{top} to {bottom}");
    let line =
        done(&["run", "--body", "sensing-hand", "--outputs", "shear", "--fields", "hand/midhand/index", "--sink", "-"]);
    let frame = frames(&line).into_iter().find(|frame| frame["t"] == 4.8).unwrap();
    let shear = frame["fields"].as_array().unwrap().iter().find_map(|field| field["shear"].as_array()).unwrap();
    let [u, v] = [0, 1].map(|axis| shear[axis].as_f64().unwrap());
    assert!(v < -0.5 && u.abs() < 0.1 * -v, "({u}, {v}) N");
}

#[test]
fn charts_have_the_colours_of_their_letter_and_dots_for_other_taxels() {
    let Some(temperatures) = chart("hand/palm", "temperature", &[]) else { return };
    let shares = |map: [[u8; 3]; 256], picture: &[[u8; 3]]| {
        (0..256).filter(|&index| count(picture, map[index]) > 500).map(|index| index as f64 / 255.0).collect::<Vec<_>>()
    };
    // By default when it is warmest: most of the palm is in the upper half of the map.
    let warm = shares(temperature_colours(), &temperatures);
    assert!(warm.len() >= 4 && warm.iter().all(|share| *share > 0.6), "{warm:?}");
    assert!(shares(distance_colours(), &temperatures).is_empty(), "and of no other letter");
    assert_eq!(count(&temperatures, BLACK), 0, "no arrows");
    let distances = chart("hand/palm", "proximity", &[]).unwrap();
    let near = shares(distance_colours(), &distances);
    assert!(!near.is_empty() && near.iter().all(|share| *share < 0.1), "{near:?}");
    // What measures something else is grey in both, and small: less of the picture than in one with ids.
    let grey = |picture: &[[u8; 3]]| count(picture, [0xD6, 0xD6, 0xD4]);
    let named = chart("hand/palm", "temperature", &["--ids"]).unwrap();
    assert!(grey(&temperatures) > 500 && 2 * grey(&temperatures) < grey(&named));
    let why = ["render", "sensing-hand", "--source", MEETING, "--uv", "hand/back", "--letter", "shear", "-o", "no.png"];
    assert!(fails(2, &why).contains("no taxel of field `hand/back` measures what letter `shear` shows"));
}

#[test]
fn pictures_are_of_the_time_at_which_there_is_most_to_see_of_their_letter() {
    // Most is pressed when it begins to slip, and it is warmest when the other hand goes.
    let most = [("shear", "2.54s"), ("pressure", "2.58s"), ("temperature", "3.44s")];
    for (letter, at) in most {
        let Some(usual) = chart("hand/palm", letter, &[]) else { return };
        for (_, other) in most {
            let drawn = chart("hand/palm", letter, &["--at", other]).unwrap();
            assert_eq!(usual == drawn, at == other, "{letter} at {other}");
        }
    }
    // The finger is dragged after the palm, which is pulled harder.
    let [usual, drawn] = [&[][..], &["--at", "2.54s"]].map(|at| chart("hand/midhand/index", "shear", at).unwrap());
    let black = |picture: &[[u8; 3]]| picture.iter().filter(|pixel| **pixel == BLACK).count();
    assert!(black(&usual) > 3 * black(&drawn), "{} and {} pixels", black(&usual), black(&drawn));
}

/// A skin of temperature taxels alone, and a recording in which they warm up.
fn warm_pad() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let rows: String = (0..4)
        .map(|n| {
            format!("{n},pad,{},{},0,0,0,1,1.6e-5,temperature\n", 0.005 * f64::from(n % 2), 0.005 * f64::from(n / 2))
        })
        .collect();
    std::fs::write(at("skin.csv"), format!("id,link,x,y,z,nx,ny,nz,area,modality\n{rows}")).unwrap();
    let warmer = |n: i32| format!("{},{},{},25,26\n", 0.1 * f64::from(n), 24.0 + 0.1 * f64::from(n), 24.5);
    std::fs::write(at("warm.csv"), format!("t,0,1,2,3\n{}", (0..40).map(warmer).collect::<String>())).unwrap();
    done(&["author", "--csv-skin", text_of(&at("skin.csv")), "-o", text_of(&at("pad.glb"))]);
    folder
}

#[test]
fn a_skin_of_temperatures_alone_is_planned_compared_drawn_and_has_nothing_to_trade() {
    let folder = warm_pad();
    let [body, warm, plot] = ["pad.glb", "warm.csv", "plot.svg"].map(|name| folder.path().join(name));
    let (body, warm) = (text_of(&body), text_of(&warm));
    for source in [&["--source", warm][..], &[]] {
        let bill = done(&[&["plan", "--json", "--body", body][..], source].concat());
        let bill: serde_json::Value = serde_json::from_str(&bill).unwrap();
        assert_eq!([&bill["taxels"], &bill["of_taxels"], &bill["fields"], &bill["of_fields"]], [4, 4, 1, 1]);
        let text = done(&[&["plan", "--body", body][..], source].concat());
        assert!(text.contains("memberships 4\n") && text.contains("1 of 1\n") && !text.contains("pressed"), "{text}");
        let timed = bill["stages"].as_array().unwrap().iter().filter(|stage| stage["us"].is_number());
        assert_eq!(timed.map(|stage| stage["stage"].as_str().unwrap()).collect::<Vec<_>>(), ["temperature"]);
    }
    // Every value counts, and temperatures that are never 0 are no pressures at rest.
    let folder_out = folder.path().join("out.csv");
    let run = output(&[
        "run",
        "--verify",
        "--body",
        body,
        "--source",
        warm,
        "--sink",
        &format!("csv:{}", text_of(&folder_out)),
    ]);
    let said = stderr(&run);
    assert!(run.status.success() && said.contains("warmest_taxel") && !said.contains("pressed"), "{said}");
    assert!(said.contains("in 40 percepts") && said.contains(" 0 different"), "{said}");
    done(&["plot", "--body", body, warm, "-o", text_of(&plot)]);
    assert!(std::fs::read_to_string(&plot).unwrap().contains("warmest [°C]"));
    let trade = done(&["tradeoff", "--body", body, "--source", warm, "--seconds", "0.1"]);
    assert!(trade.contains("nothing to trade; timed on the CPU, without touches") && trade.contains("of all fields"));
    assert!(trade.contains("100 %") && !trade.contains("combination"), "{trade}");
    for (command, code) in [("tradeoff", 2), ("run", 2)] {
        let wish = [command, "--body", body, "--source", warm, "--within", "3 mm", "--sink", "csv:no.csv"];
        let why = fails(code, &wish);
        assert!(
            why.contains("nothing to choose for 3 mm") && why.contains("--within") && why.lines().count() == 1,
            "{why}"
        );
    }
    let to = folder.path().join("no.svg");
    assert!(
        fails(2, &["tradeoff", "--body", body, "--plot", text_of(&to), "--seconds", "0.1"]).contains("nothing to draw")
    );
}

#[test]
fn a_plan_and_a_trade_tell_what_each_letter_costs() {
    let bill = |letters: &[&str]| -> serde_json::Value {
        let asked = ["plan", "--json", "--body", "sensing-hand", "--backend", "cpu"];
        serde_json::from_str(&done(&[&asked[..], letters].concat())).unwrap()
    };
    let all = bill(&[]);
    let stage = |bill: &serde_json::Value, name: &str| {
        bill["stages"].as_array().unwrap().iter().find(|stage| stage["stage"] == name).unwrap().clone()
    };
    for letter in ["shear", "temperature", "proximity"] {
        assert!(stage(&all, letter)["us"].is_number(), "{letter}: {all}");
    }
    assert_eq!((&all["taxels"], &all["fields"], &all["of_fields"]), (&53.into(), &28.into(), &28.into()));
    // In words, fields of the body are told apart from their percepts, and memberships of pressures from others.
    let text = done(&["plan", "--body", "sensing-hand", "--backend", "cpu"]);
    assert!(text.contains("13 of 13, 28 percepts of 4 letters") && text.contains(" of other letters\n"), "{text}");
    // A letter that is not asked for does not run, and it is not said that there are no taxels.
    let two = bill(&["--letters", "sustained,temperature"]);
    assert!(stage(&two, "temperature")["us"].is_number() && stage(&two, "shear")["runs"] == false);
    assert_eq!(stage(&two, "shear")["why"], "no letter is `shear`");
    assert_eq!((&two["taxels"], &two["of_fields"]), (&49.into(), &15.into()));
    let trade = |letters: &[&str]| -> Vec<String> {
        let asked =
            ["tradeoff", "--json", "--body", "sensing-hand", "--backend", "cpu", "--seconds", "0.1", "--frames", "40"];
        let report: serde_json::Value = serde_json::from_str(&done(&[&asked[..], letters].concat())).unwrap();
        assert!(report["rows"].as_array().unwrap().len() > 10);
        let costs = report["letters"].as_array().unwrap().iter();
        costs.map(|cost| format!("{} {}", cost["way"].as_str().unwrap(), cost["letter"].as_str().unwrap())).collect()
    };
    let both = |way: &str| ["shear", "temperature", "proximity"].map(|letter| format!("{way} {letter}"));
    assert_eq!(trade(&[]), [both("live"), both("batch")].concat());
    assert!(trade(&["--letters", "sustained"]).is_empty());
}

#[test]
fn what_runs_has_a_plan_also_if_touches_have_shear_and_no_field_has() {
    let scenes: [&[&str]; 4] = [
        &["--outputs", "touches"],
        &["--outputs", "touches.wrench,touches.total"],
        &["--fields", "hand/back"],
        &["--letters", "sustained,shear", "--outputs", "total,touches.friction_sigma"],
    ];
    for asked in scenes {
        let flags = [&["--body", "sensing-hand", "--backend", "cpu"][..], asked].concat();
        let run = done(&[&["run", "--quiet", "--all-fields", "--sink", "csv:-"][..], &flags].concat());
        assert!(run.lines().count() > 1, "{asked:?}");
        let bill: serde_json::Value = serde_json::from_str(&done(&[&["plan", "--json"][..], &flags].concat())).unwrap();
        let stages = bill["stages"].as_array().unwrap();
        let touches = stages.iter().find(|stage| stage["stage"] == "touches").unwrap();
        assert!(touches["us"].is_number() && bill["agrees"] == true, "{asked:?}: {bill}");
        let sum: f64 = stages.iter().filter_map(|stage| stage["us"].as_f64()).sum();
        assert!(sum >= bill["us"].as_f64().unwrap() - 0.01, "{asked:?}: {bill}");
    }
}

#[test]
fn the_bundled_meeting_is_read_in_its_own_units() {
    let header = |more: &[&str]| {
        let asked = ["run", "--body", "sensing-hand", "--outputs", "total,slip_ratio", "--sink", "csv:-"];
        done(&[&asked[..], more].concat()).lines().next().unwrap().to_owned()
    };
    assert!(header(&[]).contains("total [N]"));
    assert_eq!(header(&[]), header(&["--calibration", CALIBRATION]));
    // From its file it is a table like any other.
    assert!(header(&["--source", MEETING]).contains("total [count]"));
}

#[test]
fn a_calibration_is_laid_over_what_single_taxels_of_its_kinds_have() {
    let skin = Skin::new();
    let at = |name: &str| text_of(&skin.at(name)).to_owned();
    let (recording, given, laid) = (at("pad.mcap"), at("given.toml"), at("laid.mcap"));
    std::fs::write(skin.at("own.toml"), "[taxel.10]\ngain = 0.1\nbaseline = 5\n").unwrap();
    done(&["convert", &at("touch.csv"), &recording, "--body", &at("pad.glb"), "--calibration", &at("own.toml")]);
    let found = |recording: &str, calibration: &[&str]| {
        let asked = ["run", "--source", recording, "--outputs", "temperature", "--backend", "cpu", "--sink", "-"];
        let output = output(&[&asked[..], calibration].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let first = frames(&String::from_utf8_lossy(&output.stdout))[0].clone();
        let fields = first["fields"].as_array().unwrap();
        let celsius = fields.iter().find_map(|field| field["temperature"].as_f64()).unwrap();
        (celsius, stderr(&output))
    };
    // Taxels 10 and 11 read 20 and 30 in the first frame.
    for (text, celsius, stays) in [
        ("[all]\ngain = 2\nbaseline = 1\nraw_range = [0, 255]\n", (1.5 + 30.0) / 2.0, Some("[taxel.10]")),
        ("[temperature]\ngain = 2\nbaseline = 10\n", (20.0 + 40.0) / 2.0, None),
    ] {
        std::fs::write(&given, text).unwrap();
        let (as_read, said) = found(&recording, &["--calibration", &given]);
        let told = said.split_once("this stays under --calibration: ").and_then(|(_, after)| after.lines().next());
        assert_eq!(told, stays, "{said}");
        done(&["convert", &recording, &laid, "--calibration", &given, "--force"]);
        let converted = found(&laid, &[]).0;
        assert!(
            [as_read, converted].iter().all(|found| (found - celsius).abs() < 1e-9),
            "{text}: {as_read} {converted}"
        );
    }
}
