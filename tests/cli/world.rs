//! Places and speeds in the world, or in a link that stands for it, against two plates whose truth is known.

use glam::DVec3;
use serde_json::Value;

use super::self_contacts::{Plates, Truth, truth};
use super::{done, fails, text_of};

/// The percept of `field` in `frame`.
fn percept<'a>(frame: &'a Value, field: &str) -> &'a Value {
    let mut fields = frame["fields"].as_array().unwrap().iter();
    fields.find(|percept| percept["field"] == field).unwrap_or_else(|| panic!("no {field}: {frame}"))
}

fn position(percept: &Value) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|axis| percept["position"][axis].as_f64().unwrap()))
}

/// The plates pressed on each other, sliding.
fn closed() -> Vec<Truth> {
    truth()[5..12].to_vec()
}

/// Where a place of the URDF's world is in the upper plate.
fn in_upper(truth: &Truth, place: DVec3) -> DVec3 {
    place - DVec3::new(truth.slide, 0.0, 0.05 + truth.lift)
}

#[test]
fn a_link_can_stand_for_the_world() {
    let (plates, truth) = (Plates::new(), closed());
    let lines = plates.lines(&truth, 0.0);
    let outputs = ["--outputs", "position,normal,self_contacts"];
    let run = |flags: &[&str]| plates.jointed(&lines, &[&outputs[..], flags].concat());
    let (in_world, in_link, in_anchor) = (run(&[]), run(&["--relative-to", "upper"]), plates.anchored(&lines));
    for (index, truth) in truth.iter().enumerate() {
        for field in ["lower", "upper"] {
            let [world, link] = [&in_world, &in_link].map(|frames| percept(&frames[index], field));
            assert_eq!((&world["link"], &link["link"]), (&"world".into(), &"upper".into()));
            let p = position(world);
            let expected = in_upper(truth, p);
            assert!(position(link).distance(expected) < 1e-6, "frame {index}, {field}: {link}");
        }
        // A touch of the link itself is where it is without any pose.
        let [own, link] = [&in_anchor, &in_link].map(|frames| percept(&frames[index], "upper"));
        assert!(position(own).distance(position(link)) < 1e-9, "{own} {link}");
        let contact = &in_link[index]["self_contacts"][0];
        assert!(position(contact).distance(in_upper(truth, truth.place)) < 0.001, "frame {index}: {contact}");
        assert_eq!(contact["links"], in_world[index]["self_contacts"][0]["links"]);
    }
}

#[test]
fn speed_in_the_world_is_that_of_the_skin_and_the_link_together() {
    let (plates, truth) = (Plates::new(), closed());
    let outputs = ["--outputs", "position,speed,speed_in_world"];
    let run = |flags: &[&str]| plates.jointed(&plates.lines(&truth, 0.0), &[&outputs[..], flags].concat());
    // The contact goes 1 mm in a frame of 50 ms, the upper plate 1.3 mm.
    for (flags, lower, upper) in [(&[][..], 0.02, 0.02), (&["--relative-to", "upper"], 0.006, 0.006)] {
        let found = run(flags);
        for (field, expected, over_skin) in [("lower", lower, 0.02), ("upper", upper, 0.006)] {
            let of = |index: usize| percept(&found[index], field);
            assert!(of(0).get("speed_in_world").is_none() && of(0)["flags"].to_string().contains("no_previous"));
            for index in 1..truth.len() {
                let reported = of(index)["speed_in_world"].as_f64().unwrap();
                let moved = position(of(index)).distance(position(of(index - 1))) / 0.05;
                assert!((reported - moved).abs() < 1e-9, "{reported} is not {moved}");
                assert!((reported - expected).abs() < 0.05 * 0.02, "{field} {flags:?}: {reported}, not {expected}");
                let speed = of(index)["speed"].as_f64().unwrap();
                assert!((speed - over_skin).abs() < 0.05 * 0.02, "{field}: {speed}, not {over_skin}");
            }
        }
    }
}

#[test]
fn without_poses_there_is_no_speed_in_the_world_and_a_flag_says_why() {
    let frames: Vec<Value> = done(&["run", "--outputs", "speed,speed_in_world", "--sink", "-"])
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let percepts: Vec<&Value> = frames.iter().flat_map(|frame| frame["fields"].as_array().unwrap()).collect();
    assert!(percepts.iter().any(|percept| percept.get("speed").is_some()));
    for percept in percepts {
        assert!(
            percept.get("speed_in_world").is_none() && percept["flags"].to_string().contains("no_pose"),
            "{percept}"
        );
    }
}

#[test]
fn a_link_that_cannot_stand_for_the_world_is_refused() {
    let said = fails(2, &["run", "--relative-to", "plam"]);
    assert!(said.contains("the body has no link `plam`"), "{said}");
    let said = fails(2, &["run", "--relative-to", "hand", "--coordinates", "anchor"]);
    assert!(said.contains("leave one of them out"), "{said}");
    let said = fails(2, &["run", "--relative-to", "hand", "--sink", "page:127.0.0.1:0"]);
    assert!(said.contains("a page shows the world"), "{said}");
    let said = fails(2, &["run", "--outputs", "speed_in_world", "--coordinates", "anchor"]);
    assert!(said.contains("`speed_in_world` is made of places in the world"), "{said}");
    let said = fails(2, &["run", "--outputs", "speed_in_world", "--cadence", "on-change"]);
    assert!(said.contains("speed_in_world are made of them"), "{said}");
}

#[test]
fn tables_name_the_link_that_stands_for_the_world() {
    let (plates, truth) = (Plates::new(), closed());
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("upper.csv");
    plates.jointed(
        &plates.lines(&truth, 0.0),
        &["--relative-to", "upper", "--outputs", "total,position", "--sink", text_of(&table), "--sink", "-"],
    );
    let rows = std::fs::read_to_string(&table).unwrap();
    assert!(rows.lines().skip(1).all(|row| row.contains(",upper,")) && rows.lines().count() > 7, "{rows}");
}
