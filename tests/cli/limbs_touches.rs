//! Touches of the whole body over limbs: found once by the host of frames; a host of percepts qualifies them by limb.

use std::collections::{BTreeMap, BTreeSet};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::limbs_network::{Head, Limb, PERIOD, Place, free_port, taxels_of, wait_for};

/// The two sides of the hand: a limb each.
const SIDES: [(&str, &str); 2] = [("hand/palm", "palm"), ("hand/back", "back")];
const PRESSED: f64 = 100.0;

/// The taxels of each touch of a line.
fn touched(line: &Value) -> Vec<BTreeSet<u64>> {
    let taxels = |touch: &Value| touch["taxels"].as_array().unwrap().iter().map(|id| id.as_u64().unwrap()).collect();
    line["touches"].as_array().unwrap().iter().map(taxels).collect()
}

/// The touches on `fields`, all pressed, where nothing is distributed.
fn undistributed(place: &Place, fields: &[&str]) -> Vec<BTreeSet<u64>> {
    let taxels: Vec<String> = fields.iter().flat_map(|field| taxels_of(field)).map(|id| id.to_string()).collect();
    let row = vec![PRESSED.to_string(); taxels.len()].join(",");
    let path = place.path("undistributed.csv");
    std::fs::write(&path, format!("t,{}\n0,{row}\n", taxels.join(","))).unwrap();
    let source = format!("csv:{path}");
    let outputs = ["--outputs", "touches,touches.taxels,total", "--backend", "cpu"];
    let text = super::done(&[&["run", "-q", "--source", &source, "--sink", "-"], &outputs[..]].concat());
    touched(&super::frames(&text)[0])
}

/// Has all `limbs` send `value` until `until`.
fn press(limbs: &mut [Limb], value: f64, mut until: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !until() {
        limbs.iter_mut().for_each(|limb| limb.send_all(value));
        thread::sleep(PERIOD);
        assert!(begin.elapsed() < Duration::from_secs(40), "it goes on and on");
    }
}

/// So many times.
fn times(count: usize) -> impl FnMut() -> bool {
    let mut left = count;
    move || {
        let is_over = left == 0;
        left = left.saturating_sub(1);
        is_over
    }
}

#[test]
fn limbs_that_send_frames_are_one_skin_whose_touches_are_found_once() {
    let (place, port) = (Place::new(), free_port());
    let head_config = place.config("head.json5", Some(port), None);
    let limb_config = place.config("limb.json5", None, Some(port));
    let fields = SIDES.map(|(field, _)| field);
    let whole = undistributed(&place, &fields);
    let sides = fields.map(|field| undistributed(&place, &[field]));
    let all: BTreeSet<u64> = fields.iter().flat_map(|field| taxels_of(field)).map(u64::from).collect();
    assert_eq!(whole, [all]);
    assert!(sides.iter().all(|side| side.len() == 1 && *side != whole), "one side is another touch");

    let outputs = ["--outputs", "touches,touches.taxels,total"];
    let head = Head::start_with(&place, &SIDES.map(|(_, key)| key), &head_config, &outputs);
    // A limb looks for touches of its own, which reads all taxels of the body; it sends those of its fields.
    let own = ["--outputs", "touches,total"];
    let mut limbs = SIDES.map(|(field, key)| Limb::start_as(None, field, key, &limb_config, &own));
    let is_whole = |line: &Value| touched(line) == whole;
    let last = || -> Option<Value> { serde_json::from_str(head.running.out.all().last()?).ok() };
    press(&mut limbs, PRESSED, || last().is_some_and(|line| is_whole(&line)));
    press(&mut limbs, PRESSED, times(25));
    press(&mut limbs, 0.0, || last().is_some_and(|line: Value| line["touches"].as_array().unwrap().is_empty()));
    limbs.into_iter().for_each(|limb| drop(limb.end()));
    wait_for("the end of both", || {
        SIDES.iter().all(|(_, key)| head.running.reported.has(&format!("{key}: the limb has ended")))
    });
    let (lines, messages, accounts) = head.end(&[0]);
    for (_, key) in SIDES {
        assert_eq!(accounts[key]["lost"], 0, "{messages:?}");
    }
    let mut ids = BTreeSet::new();
    for line in &lines {
        let touches = touched(line);
        // Before both are heard, and while one is let go, there is a side alone.
        assert!(touches.is_empty() || touches == whole || sides.contains(&touches), "{line}");
        if touches == whole {
            let touch = &line["touches"][0];
            assert_eq!(touch["total"], PRESSED * whole[0].len() as f64, "each taxel once");
            ids.insert(touch["id"].as_u64().unwrap());
        }
    }
    assert!(
        lines.iter().filter(|line| is_whole(line)).count() >= 10 && ids.len() == 1,
        "{ids:?} in {} lines",
        lines.len()
    );
    let released: Vec<u64> =
        lines.iter().flat_map(|line| line["released"].as_array().unwrap()).map(|id| id.as_u64().unwrap()).collect();
    assert!(ids.iter().all(|id| released.iter().filter(|other| *other == id).count() == 1), "{ids:?} {released:?}");
}

#[test]
fn ids_of_touches_of_limbs_that_send_percepts_say_which_limb_they_are_of() {
    let (place, port) = (Place::new(), free_port());
    let head_config = place.config("head.json5", Some(port), None);
    let limb_config = place.config("limb.json5", None, Some(port));
    let head = Head::start_with(&place, &SIDES.map(|(_, key)| key), &head_config, &["--outputs", "total"]);
    // What each has computed is on its own standard output, too.
    let own = ["--outputs", "touches,total", "--sink", "-"];
    let mut limbs =
        SIDES.map(|(field, key)| Limb::start_as(None, field, &format!("zenoh-percepts:{key}"), &limb_config, &own));
    let has = |key: &str, part: &str| {
        head.running.out.all().iter().any(|line| line.contains(&format!("\"limb\":\"{key}\"")) && line.contains(part))
    };
    press(&mut limbs, PRESSED, || SIDES.iter().all(|(_, key)| has(key, &format!("\"id\":\"{key}/"))));
    press(&mut limbs, 0.0, || SIDES.iter().all(|(_, key)| has(key, &format!("\"released\":[\"{key}/"))));
    press(&mut limbs, PRESSED, times(10));
    let ends = limbs.map(|limb| {
        let out = limb.running.out.clone();
        limb.end();
        super::frames(&out.all().join("\n"))
    });
    wait_for("the end of both", || {
        SIDES.iter().all(|(_, key)| head.running.reported.has(&format!("{key}: the limb has ended")))
    });
    let (lines, ..) = head.end(&[0]);
    let mut ids: Vec<BTreeSet<String>> = Vec::new();
    for ((_, key), own) in SIDES.iter().zip(&ends) {
        let by_frame: BTreeMap<u64, &Value> = own.iter().map(|line| (line["frame"].as_u64().unwrap(), line)).collect();
        let qualified = |id: &Value| Value::from(format!("{key}/{id}"));
        let (mut of_limb, mut released) = (BTreeSet::new(), 0);
        for line in lines.iter().filter(|line| line["limb"] == *key) {
            let mut right = (*by_frame[&line["frame"].as_u64().unwrap()]).clone();
            // The limb's line, with the head's time and with its ids.
            right["t"] = line["t"].clone();
            for touch in right["touches"].as_array_mut().unwrap() {
                touch["id"] = qualified(&touch["id"]);
                of_limb.insert(touch["id"].as_str().unwrap().to_owned());
            }
            for id in right["released"].as_array_mut().unwrap() {
                *id = qualified(id);
                released += 1;
            }
            for field in right["fields"].as_array_mut().unwrap() {
                let shares = field["touches"].as_object().unwrap().clone();
                let shares = shares.into_iter().map(|(id, share)| (format!("{key}/{id}"), share));
                field["touches"] = Value::Object(shares.collect());
            }
            let mut found = line.clone();
            found.as_object_mut().unwrap().remove("limb");
            assert_eq!(found, right);
        }
        assert!(of_limb.len() >= 2 && released >= 1, "{key}: {of_limb:?}, {released} released");
        ids.push(of_limb);
    }
    // Both count alike, and no id is there twice.
    assert!(ids[0].is_disjoint(&ids[1]), "{ids:?}");
    let numbers =
        |of: &BTreeSet<String>| of.iter().map(|id| id.split_once('/').unwrap().1.to_owned()).collect::<BTreeSet<_>>();
    assert!(!numbers(&ids[0]).is_disjoint(&numbers(&ids[1])), "{ids:?}");
}
