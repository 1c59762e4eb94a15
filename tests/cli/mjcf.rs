//! Robots for MuJoCo that have their skin: every taxel accounted for, and where MuJoCo itself has it.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::python::python_with;
use super::{done, fails, stderr, text_of};
use somatic_testing::skip;

const MODEL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/mujoco/skin.xml");

/// The sensors of the model in their order: name, taxels, those without a place, the body that has them, and values of each taxel.
const SENSORS: [(&str, u64, u64, &str, u64); 8] = [
    ("palm", 35, 0, "palm", 3),
    ("palm grid", 49, 0, "palm", 3),
    ("finger", 54, 0, "finger", 3),
    ("nail", 4, 0, "nail", 3),
    ("tip", 12, 0, "finger", 1),
    ("stl", 8, 0, "thumb", 3),
    ("obj", 9, 1, "thumb", 3),
    ("thumb", 30, 0, "thumb", 1),
];

/// A box of 20 × 40 × 60 as MuJoCo reads it: binary STL, and OBJ with a vertex that no face has.
fn write_boxes(folder: &Path) {
    let corner = |index: usize| {
        [20.0, 40.0, 60.0]
            .map(f64::from)
            .iter()
            .enumerate()
            .map(|(axis, x)| if index >> axis & 1 == 1 { *x } else { 0.0 })
            .collect::<Vec<f64>>()
    };
    // Not in the order of the corners.
    let sides = [[1, 3, 7, 5], [0, 2, 3, 1], [4, 5, 7, 6], [2, 6, 7, 3], [0, 1, 5, 4], [0, 4, 6, 2]];
    let triangles: Vec<[usize; 3]> = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let mut stl = vec![0; 80];
    stl.extend((triangles.len() as u32).to_le_bytes());
    for triangle in &triangles {
        stl.extend([0; 12]);
        triangle.iter().flat_map(|&index| corner(index)).for_each(|x| stl.extend((x as f32).to_le_bytes()));
        stl.extend([0; 2]);
    }
    std::fs::write(folder.join("box.stl"), stl).unwrap();
    let mut obj = String::from("# a box\n");
    for index in (0..8).rev() {
        let place: Vec<String> = corner(index).iter().map(f64::to_string).collect();
        obj += &format!("v {}\n", place.join(" "));
    }
    obj += "v 5 5 5\nvn 0 0 1\n";
    for [a, b, c] in triangles {
        obj += &format!("f {}//1 {}//1 {}//1\n", 8 - a, 8 - b, 8 - c);
    }
    std::fs::write(folder.join("box.obj"), obj).unwrap();
}

/// A folder with the model and the meshes that it names.
fn folder() -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    write_boxes(folder.path());
    let model = folder.path().join("skin.xml");
    std::fs::copy(MODEL, &model).unwrap();
    (folder, model)
}

/// The report of `author`, and taxels by id: the link, and the place in its frame.
fn authored(model: &Path) -> (Value, BTreeMap<u64, (String, [f64; 3])>) {
    let body = model.with_extension("glb");
    let report = done(&["author", "--mjcf-skin", text_of(model), "-o", text_of(&body), "--force", "--json"]);
    let known: Value = serde_json::from_str(&done(&["inspect", text_of(&body), "--json"])).unwrap();
    let taxel = |taxel: &Value| {
        let place: Vec<f64> = taxel["position"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        (taxel["id"].as_u64().unwrap(), (taxel["link"].as_str().unwrap().to_owned(), place.try_into().unwrap()))
    };
    (serde_json::from_str(&report).unwrap(), known["taxels"].as_array().unwrap().iter().map(taxel).collect())
}

#[test]
fn every_taxel_of_every_sensor_is_accounted_for() {
    let (_folder, model) = folder();
    let (report, taxels) = authored(&model);
    let places = report["places"].as_array().unwrap();
    let mut first = 0;
    for ((name, count, missing, body, channels), place) in SENSORS.into_iter().zip(places) {
        assert_eq!((&place["name"], &place["taxels"]), (&name.into(), &(count - missing).into()), "{place}");
        let own: Vec<u64> = taxels.range(first..first + count).map(|(id, _)| *id).collect();
        assert_eq!(own.len() as u64, count - missing, "{name}");
        assert!(own.iter().all(|id| taxels[id].0 == body), "{name}");
        first += count * channels;
    }
    assert_eq!(places.len(), SENSORS.len());
    assert_eq!(taxels.len() as u64, SENSORS.iter().map(|(_, count, missing, ..)| count - missing).sum::<u64>());
    let notes = report["notes"].to_string();
    assert!(notes.contains("sensor `obj`: 1 of its 9 taxels are in no triangle"), "{notes}");
    assert!(notes.contains("1 <touch> sensors have no surface"), "{notes}");
    assert!(notes.contains("a `sensordata` of one sensor with three axes, and this one has 9 more"), "{notes}");
}

#[test]
fn taxels_are_where_mujoco_has_them() {
    let python = match python_with("mujoco", "import mujoco") {
        Ok(python) => python,
        Err(why) => return skip("MUJOCO", why),
    };
    let (_folder, model) = folder();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/mujoco/positions.py");
    let output = Command::new(python).args([script, text_of(&model)]).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let real: Value = serde_json::from_slice(&output.stdout).unwrap();
    let (_, taxels) = authored(&model);
    let (mut id, mut compared, mut farthest_m) = (0, 0, 0.0_f64);
    for ((name, count, .., channels), sensor) in SENSORS.into_iter().zip(real["sensors"].as_array().unwrap()) {
        let of_sensor = sensor["taxels"].as_array().unwrap();
        assert_eq!((&sensor["name"], of_sensor.len() as u64), (&name.into(), count));
        assert_eq!(sensor["numbers"], count * channels, "{name}");
        for there in of_sensor {
            if let Some((link, place)) = taxels.get(&id) {
                assert_eq!(&there[0], link, "{name}, {id}");
                let apart = place.iter().zip(1..).map(|(x, axis)| (x - there[axis].as_f64().unwrap()).powi(2));
                farthest_m = farthest_m.max(apart.sum::<f64>().sqrt());
                compared += 1;
            }
            id += 1;
        }
        id += count * (channels - 1);
    }
    // Both hold vertices in single precision.
    assert!(compared == 200 && farthest_m < 1e-7, "{compared} taxels, at most {farthest_m} m apart");
}

#[test]
fn what_is_wrong_with_a_model_is_one_line_with_its_place() {
    let (folder, model) = folder();
    let text = std::fs::read_to_string(&model).unwrap();
    let output = folder.path().join("a.glb");
    let why = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        std::fs::write(&model, text.replacen(from, to, 1)).unwrap();
        let why = fails(1, &["author", "--mjcf-skin", text_of(&model), "-o", text_of(&output)]);
        assert!(why.contains("skin.xml: ") && why.lines().count() == 1, "{why}");
        why
    };
    assert!(why("geom=\"palm skin\"", "geom=\"palm skim\"").contains("names the geom `palm skim`"));
    assert!(why("geom=\"palm skin\" mesh=\"plate\"", "geom=\"palm skin\" mesh=\"wedge\"").contains("another shape"));
    assert!(why("objname=\"inside\"", "objname=\"insid\"").contains("the site `insid`"));
    assert!(why("value=\"45 45\"", "value=\"45 95\"").contains("at most 180 and 90"));
    assert!(why("key=\"nchannel\" value=\"3\"", "key=\"nchannel\" value=\"7\"").contains("`nchannel` is `7`"));
    assert!(why("file=\"box.stl\"", "file=\"bix.stl\"").contains("no such file"));
    assert!(why("<frame pos", "<replicate count=\"3\"/><frame pos").contains("to_xml()"));
    assert!(why("<worldbody>", "<worldbdy>").contains("not valid XML"));
    assert!(why("pos=\"0 0 0.5\"", "pos=\"0 0 half\"").contains("`half`, which is not a number"));
    assert!(
        why("type=\"box\" size=\"0.02 0.03 0.01\"", "type=\"box\" size=\"0.02\"").contains("a box has more numbers")
    );
    std::fs::write(&model, "<robot/>").unwrap();
    let error = fails(1, &["author", "--mjcf-skin", text_of(&model), "-o", text_of(&output)]);
    assert!(error.contains("not an MJCF"), "{error}");
    assert!(!output.exists());
}

#[test]
fn a_ball_that_slides_in_mujoco_pulls_where_it_slides() {
    let python = match python_with("mujoco", "import mujoco") {
        Ok(python) => python,
        Err(why) => return skip("MUJOCO", why),
    };
    let folder = tempfile::tempdir().unwrap();
    let (frames, map) = (folder.path().join("slide.ndjson"), folder.path().join("grid.toml"));
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/mujoco/slide.py");
    let output = Command::new(python).args([script, text_of(&frames)]).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let truth: Vec<[f64; 2]> = serde_json::from_slice(&output.stdout).unwrap();
    // The grid looks up through the pad: its rows are drawn from above, and its y points down on paper.
    let grid = "values = ['sensordata[0:81]', 'sensordata[81:162]', 'sensordata[162:243]']\naxes = 'n,u,-v'\ngrid = '9x9'\npitch = '5mm'\n";
    std::fs::write(&map, grid).unwrap();
    let source = format!("ndjson:{}", frames.display());
    let asked = ["--map", text_of(&map), "--backend", "reference", "--outputs", "total,shear,shear_direction"];
    let lines = done(&[&["run", "--source", &source][..], &asked].concat());
    let directions: Vec<f64> = super::frames(&lines)
        .iter()
        .map(|frame| {
            let fields = frame["fields"].as_array().unwrap();
            fields.iter().find_map(|field| field["shear_direction"].as_f64()).expect("something pulls")
        })
        .collect();
    assert_eq!((directions.len(), truth.len()), (24, 24));
    for (found, [pulled, slid]) in directions.iter().zip(truth) {
        for right in [pulled, slid] {
            let off = (found - right).sin().atan2((found - right).cos()).abs().to_degrees();
            assert!(off < 3.0, "{found} is {off}° from {right}");
        }
    }
    // With the axes exchanged it is not.
    std::fs::write(&map, grid.replace("n,u,-v", "n,-v,u")).unwrap();
    let turned = super::frames(&done(&[&["run", "--source", &source][..], &asked].concat()));
    let first = turned[0]["fields"].as_array().unwrap().iter().find_map(|field| field["shear_direction"].as_f64());
    assert!((first.unwrap() - directions[0]).abs() > 0.3);
}

/// The frames of a ball that slides over a touch grid, their model, whose site is turned, and in which directions it pulls.
fn slid(python: &Path, folder: &Path) -> Vec<[f64; 2]> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/mujoco/slide.py");
    let files = ["slide.ndjson", "slide.xml"].map(|name| folder.join(name));
    let output = Command::new(python).arg(script).args(&files).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_skin_of_mujoco_with_three_axes_reads_its_own_data() {
    let python = match python_with("mujoco", "import mujoco") {
        Ok(python) => python,
        Err(why) => return skip("MUJOCO", why),
    };
    let folder = tempfile::tempdir().unwrap();
    let truth = slid(&python, folder.path());
    let model = folder.path().join("slide.xml");
    let (report, taxels) = authored(&model);
    assert_eq!(taxels.len(), 71);
    let notes = report["notes"].to_string();
    assert!(notes.contains("10 of its 81 taxels look past every shape") && !notes.contains("--map mujoco"), "{notes}");
    let (body, source) = (model.with_extension("glb"), folder.path().join("slide.ndjson"));
    let asked = ["--map", "mujoco", "--backend", "reference", "--outputs", "total,shear_vector"];
    let output =
        super::output(&[&["run", "--body", text_of(&body), "--source", text_of(&source)][..], &asked].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("the body lacks 10 of 81 taxels, which are skipped: 0, 1, "),
        "{}",
        stderr(&output)
    );
    let lines = String::from_utf8(output.stdout).unwrap();
    // In the link's frame, which is that of the model's body.
    let found: Vec<[f64; 2]> = super::frames(&lines)
        .iter()
        .map(|frame| {
            let fields = frame["fields"].as_array().unwrap();
            let shear = fields.iter().find_map(|field| field["shear_vector"].as_array()).expect("something pulls");
            assert!(shear[2].as_f64().unwrap().abs() < 1e-3, "{shear:?}");
            [0, 1].map(|axis| shear[axis].as_f64().unwrap())
        })
        .collect();
    assert_eq!((found.len(), truth.len()), (24, 24));
    for ([x, y], [pulled, slid]) in found.into_iter().zip(truth) {
        for right in [pulled, slid] {
            let off = (y.atan2(x) - right).sin().atan2((y.atan2(x) - right).cos()).abs().to_degrees();
            assert!(off < 3.0, "({x}, {y}) is {off}° from {right}");
        }
    }
}

#[test]
fn a_skin_of_mujoco_with_one_axis_reads_its_own_data() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("pad.xml");
    let pad = |channels: u32| {
        let text = format!(
            "<mujoco><worldbody><body name=\"pad\"><geom type=\"box\" size=\"0.03 0.03 0.004\"/>\
             <site name=\"eye\" pos=\"0 0 -0.02\" euler=\"180 0 0\"/></body></worldbody><sensor>\
             <plugin name=\"grid\" plugin=\"mujoco.sensor.touch_grid\" objtype=\"site\" objname=\"eye\">\
             <config key=\"nchannel\" value=\"{channels}\"/><config key=\"size\" value=\"9 9\"/>\
             <config key=\"fov\" value=\"60 60\"/></plugin></sensor></mujoco>"
        );
        std::fs::write(&model, text).unwrap();
        authored(&model).0["notes"].to_string()
    };
    let (body, source) = (model.with_extension("glb"), folder.path().join("pad.ndjson"));
    for (channels, says) in [(1, ""), (6, "of its 6 channels the first is read")] {
        assert!(pad(channels).contains(says));
        let values: Vec<u32> = (0..81 * channels).map(|at| if at == 40 { 7 } else { 0 }).collect();
        std::fs::write(&source, format!("{{\"time\": 0, \"sensordata\": {values:?}}}\n")).unwrap();
        let asked = ["--map", "mujoco", "--backend", "reference", "--outputs", "total,active"];
        let lines = done(&[&["run", "--body", text_of(&body), "--source", text_of(&source)][..], &asked].concat());
        let field = &super::frames(&lines)[0]["fields"][0];
        assert_eq!((field["total"].as_f64(), field["active"].as_u64()), (Some(7.0), Some(1)), "{channels}: {lines}");
    }
}

/// A `<tactile>` sensor gives speeds of slip, without a sign: a direction between both tangents is told, and others are mirrored into it.
#[test]
fn a_ball_that_slides_over_a_tactile_mesh_in_mujoco_slips_where_it_slides() {
    let python = match python_with("mujoco", "import mujoco") {
        Ok(python) => python,
        Err(why) => return skip("MUJOCO", why),
    };
    let folder = tempfile::tempdir().unwrap();
    let (frames, map) = (folder.path().join("slide.ndjson"), folder.path().join("tactile.toml"));
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/mujoco/tactile.py");
    let output = Command::new(python).args([script, text_of(&frames)]).output().unwrap();
    assert!(output.status.success(), "{}", stderr(&output));
    let truth: Vec<(f64, f64, f64, bool)> = serde_json::from_slice(&output.stdout).unwrap();
    let source = format!("ndjson:{}", frames.display());
    // Direction, and the centroid.
    let found = |axes: &str| -> Vec<(f64, f64, f64)> {
        let text = format!("values = ['normal', 'first', 'second']\naxes = '{axes}'\ngrid = '17x17'\npitch = '4mm'\n");
        std::fs::write(&map, text).unwrap();
        let asked = ["--map", text_of(&map), "--backend", "reference", "--outputs", "centroid,shear_direction"];
        let lines = done(&[&["run", "--source", &source][..], &asked].concat());
        let of_frame = |frame: &Value| {
            let letter = |name: &str| {
                frame["fields"].as_array().unwrap().iter().find(|field| field["letter"] == name).unwrap().clone()
            };
            let centroid = &letter("sustained")["centroid"];
            let direction = letter("shear")["shear_direction"].as_f64().expect("something slips");
            (direction, centroid[0].as_f64().unwrap(), centroid[1].as_f64().unwrap())
        };
        super::frames(&lines).iter().map(of_frame).collect()
    };
    let off_deg = |one: f64, other: f64| (one - other).sin().atan2((one - other).cos()).abs().to_degrees();
    // The sensor's second tangent points against n × t.
    let right = found("n,u,-v");
    assert_eq!((right.len(), truth.len()), (7, 7));
    for (&(direction, u, v), &(slid, x, y, is_told)) in right.iter().zip(&truth) {
        let off = off_deg(direction, slid);
        assert_eq!(off < 3.0, is_told, "{direction} is {off}° from {slid}");
        assert!((u - x).hypot(v - y) < 1e-3, "({u}, {v}) m and ({x}, {y}) m");
    }
    assert_eq!(truth.iter().filter(|(.., is_told)| *is_told).count(), 4);
    // With its axes exchanged, or with the other sign, no direction is right.
    for axes in ["n,-v,u", "n,u,v"] {
        let wrong = found(axes).into_iter().zip(&truth).filter(|(_, (.., is_told))| *is_told);
        assert!(wrong.into_iter().all(|((direction, ..), (slid, ..))| off_deg(direction, *slid) > 3.0), "{axes}");
    }
}
