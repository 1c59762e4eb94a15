//! Touches of the whole body as the command gives them, against the truth of a simulation.

use std::collections::BTreeSet;

use glam::DVec3;
use serde_json::Value;

use super::{done, fails, file, frames, text_of};

/// A ball that is drawn down the humanoid's left forearm, after a tap on the chest.
const DRAWN: &str = r#"body = "humanoid"
rate_hz = 25
duration_s = 1.6
[layer]
thickness_m = 0.005
[[touch]]
name = "tap"
on = "body"
indenter = "ball"
radius_m = 0.02
path = [{ link = "chest", at = [0.0, 0.04, 0.07] }]
press = { from_s = 0.1, to_s = 0.3, newton = 6, ramp_s = 0.05 }
[[touch]]
name = "draw"
on = "body"
indenter = "ball"
radius_m = 0.02
path = [{ link = "left_forearm", at = [0.0, 0.0, -0.04] }, { link = "left_forearm", at = [0.025, -0.05, -0.035] }]
times_s = [0.5, 1.4]
force_newton = [[0.5, 8], [1.4, 8]]
"#;

fn vector(value: &Value) -> DVec3 {
    let parts: Vec<f64> = value.as_array().unwrap().iter().map(|part| part.as_f64().unwrap()).collect();
    DVec3::from_slice(&parts)
}

#[test]
fn a_ball_drawn_down_a_forearm_is_one_touch_with_place_speed_and_links() {
    let (folder, simulation) = file("draw.toml", DRAWN);
    let at = |name: &str| folder.path().join(name);
    done(&["simulate", text_of(&simulation), "-o", text_of(&at("draw.csv"))]);
    let mut truth = csv::Reader::from_path(at("draw.truth.csv")).unwrap();
    let titles = truth.headers().unwrap().clone();
    let rows: Vec<csv::StringRecord> = truth.records().map(Result::unwrap).collect();
    let of = |row: &csv::StringRecord, title: &str| -> f64 {
        let column = titles.iter().position(|own| own.split(' ').next() == Some(title)).unwrap();
        row[column].parse().unwrap()
    };
    let source = format!("sim:{}", text_of(&simulation));
    let outputs = "touches,touches.wrench,touches.taxels,total";
    let sinks = [format!("csv:{}", text_of(&at("touch.csv"))), format!("ndjson:{}", text_of(&at("touch.ndjson")))];
    done(&[
        "run",
        "--source",
        &source,
        "--outputs",
        outputs,
        "--backend",
        "cpu",
        "--sink",
        &sinks[0],
        "--sink",
        &sinks[1],
    ]);
    let lines = frames(&std::fs::read_to_string(at("touch.ndjson")).unwrap());
    let (mut ids, mut released, mut compared, mut placed, mut speeds) = (BTreeSet::new(), Vec::new(), 0, 0, Vec::new());
    for (number, line) in lines.iter().enumerate() {
        let touches = line["touches"].as_array().unwrap();
        released.extend(line["released"].as_array().unwrap().iter().map(|id| id.as_u64().unwrap()));
        let pressed: Vec<_> = rows.iter().filter(|row| of(row, "frame") as usize == number).collect();
        assert_eq!(touches.len(), pressed.len(), "frame {number}: {touches:?}");
        let [touch] = &touches[..] else { continue };
        ids.insert(touch["id"].as_u64().unwrap());
        let right = DVec3::new(of(pressed[0], "x"), of(pressed[0], "y"), of(pressed[0], "z"));
        let normal = DVec3::new(of(pressed[0], "nx"), of(pressed[0], "ny"), of(pressed[0], "nz"));
        // At the elbow most of it may be felt by the other link than the one that the ball is on: its place is in that one's frame.
        let said = titles.iter().position(|own| own == "link").map(|column| &pressed[0][column]);
        if said == touch["link"].as_str() {
            // Half of the way between taxels, which lie up to 30 mm apart.
            assert!(vector(&touch["position"]).distance(right) < 0.015, "frame {number}: {touch} {right}");
            assert!(vector(&touch["normal"]).angle_between(normal) < 0.5, "frame {number}: {touch} {normal}");
            placed += 1;
        }
        // Simulated sensors feel newtons, and their calibration says so.
        let number_of = |name: &str| touch[name].as_f64().unwrap();
        let force = number_of("force");
        assert!((force / of(pressed[0], "force") - 1.0).abs() < 0.1, "frame {number}: {force}");
        assert!((force / number_of("total") - 1.0).abs() < 1e-12, "{touch}");
        assert!((number_of("mean_pressure") * number_of("area") / force - 1.0).abs() < 1e-9, "{touch}");
        // The force on each link is at most the sum of the taxels' forces, which have directions of their own.
        let wrenches = touch["wrench"].as_object().unwrap();
        let pressed_by: f64 = wrenches.values().map(|wrench| vector(&wrench["force"]).length()).sum();
        assert!(pressed_by <= force * (1.0 + 1e-9) && pressed_by > 0.5 * force, "{touch}");
        let links = touch["links"].as_object().unwrap();
        assert!((links.values().map(|share| share.as_f64().unwrap()).sum::<f64>() - 1.0).abs() < 1e-12);
        let link = touch["link"].as_str().unwrap();
        assert!(
            ["chest", "left_forearm", "left_upper_arm"].contains(&link)
                && touch["in"] == touch["link"]
                && links.contains_key(link)
        );
        assert_eq!(touch["taxels"].as_array().unwrap().len() as u64, touch["active"].as_u64().unwrap());
        // The fields that hold it say so.
        for (name, share) in touch["fields"].as_object().unwrap() {
            let field = line["fields"].as_array().unwrap().iter().find(|field| field["field"] == *name).unwrap();
            assert_eq!(field["touches"][touch["id"].to_string()], *share, "{name}");
        }
        if let Some(velocity) = touch.get("velocity").filter(|_| link != "chest") {
            speeds.push(vector(velocity).length());
        }
        compared += 1;
    }
    assert!(
        ids.len() == 2 && compared >= 25 && placed >= 15 && speeds.len() >= 8,
        "{ids:?} {compared} {placed} {speeds:?}"
    );
    // It is drawn at 62 mm/s; where taxels lie far apart, at the elbow, it seems now slower, now faster.
    let mean = speeds.iter().sum::<f64>() / speeds.len() as f64;
    assert!((0.03..0.1).contains(&mean), "{mean} m/s");
    assert_eq!(released, ids.into_iter().collect::<Vec<_>>());
    let table = std::fs::read_to_string(at("touch.touches.csv")).unwrap();
    assert_eq!(table.lines().count(), 1 + compared);
    assert!(table.starts_with("t [s],frame,touch,age [s],link,in,total [N],force [N],peak [N],"), "{table:.200}");

    // A scene says from when on it counts.
    let scene = at("scene.toml");
    std::fs::write(&scene, "outputs = [\"touches\"]\n[touch]\non = 7\noff = 3\n").unwrap();
    let text = done(&["run", text_of(&scene), "--source", &source, "--quiet", "--sink", "-"]);
    let mut totals = frames(&text).into_iter().flat_map(|line| line["touches"].as_array().unwrap().clone());
    assert!(totals.all(|touch| touch["total"].as_f64().unwrap() > 3.0));
}

#[test]
fn what_cannot_be_asked_of_touches_is_reported() {
    assert!(fails(2, &["run", "--outputs", "touches.wrenches"]).contains("touches.wrench"));
    let scene = |text: &str| {
        let (_folder, path) = file("scene.toml", text);
        fails(2, &["run", text_of(&path)])
    };
    assert!(scene("outputs = [\"touches\"]\n[touch]\non = 1\noff = 2\n").contains("off no larger than on"));
    assert!(scene("outputs = [\"total\"]\n[touch]\non = 1\n").contains("add them to `outputs`"));
    assert!(fails(2, &["run", "--outputs", "touches", "--letters", "change"]).contains("letter `sustained`"));
}
