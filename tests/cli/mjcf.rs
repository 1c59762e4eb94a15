//! Robots for MuJoCo that have their skin: every taxel accounted for, and where MuJoCo itself has it.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::python::python_with;
use super::{done, fails, stderr, text_of};
use somatic_testing::skip;

const MODEL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/mujoco/skin.xml");

/// The sensors of the model in their order: name, taxels, those without a place, and the body that has them.
const SENSORS: [(&str, u64, u64, &str); 8] = [
    ("palm", 35, 0, "palm"),
    ("palm grid", 49, 0, "palm"),
    ("finger", 54, 0, "finger"),
    ("nail", 4, 0, "nail"),
    ("tip", 12, 0, "finger"),
    ("stl", 8, 0, "thumb"),
    ("obj", 9, 1, "thumb"),
    ("thumb", 30, 0, "thumb"),
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
    for ((name, count, missing, body), place) in SENSORS.into_iter().zip(places) {
        assert_eq!((&place["name"], &place["taxels"]), (&name.into(), &(count - missing).into()), "{place}");
        let own: Vec<u64> = taxels.range(first..first + count).map(|(id, _)| *id).collect();
        assert_eq!(own.len() as u64, count - missing, "{name}");
        assert!(own.iter().all(|id| taxels[id].0 == body), "{name}");
        first += count;
    }
    assert_eq!(places.len(), SENSORS.len());
    assert_eq!(taxels.len() as u64, SENSORS.iter().map(|(_, count, missing, _)| count - missing).sum::<u64>());
    let notes = report["notes"].to_string();
    assert!(notes.contains("sensor `obj`: 1 of its 9 taxels are in no triangle"), "{notes}");
    assert!(notes.contains("1 <touch> sensors have no surface"), "{notes}");
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
    for ((name, count, ..), sensor) in SENSORS.into_iter().zip(real["sensors"].as_array().unwrap()) {
        let of_sensor = sensor["taxels"].as_array().unwrap();
        assert_eq!((&sensor["name"], of_sensor.len() as u64), (&name.into(), count));
        for there in of_sensor {
            if let Some((link, place)) = taxels.get(&id) {
                assert_eq!(&there[0], link, "{name}, {id}");
                let apart = place.iter().zip(1..).map(|(x, axis)| (x - there[axis].as_f64().unwrap()).powi(2));
                farthest_m = farthest_m.max(apart.sum::<f64>().sqrt());
                compared += 1;
            }
            id += 1;
        }
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
