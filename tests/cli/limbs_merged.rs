//! Four limbs on this computer and a head that brings them together, over Zenoh.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use super::limbs_network::{
    Head, LIMBS, Limb, OUTPUTS, Place, Running, compared, free_port, limbs_are_read, number, play, undistributed,
    wait_for,
};

#[test]
fn frames_of_four_limbs_are_merged_and_every_one_is_accounted_for() {
    let (place, port) = (Place::new(), free_port());
    let head_config = place.config("head.json5", Some(port), None);
    let limb_config = place.config("limb.json5", None, Some(port));
    let keys = ["hand/thumb", "hand/index", "hand/middle", "hand/ring"];
    let head = Head::start(&place, &keys, &head_config, &["--live-rate", "0"]);
    let mut limbs: Vec<Limb> =
        LIMBS.iter().zip(keys).map(|(field, key)| Limb::start(field, key, &limb_config)).collect();
    let row = play(&mut limbs, 0, |_| limbs_are_read(&head));
    let rows = play(&mut limbs, row, |now| now == row + 100);
    let reported: Vec<Vec<String>> = limbs.into_iter().map(Limb::end).collect();
    wait_for("the end of all limbs", || {
        keys.iter().all(|key| head.running.reported.has(&format!("zenoh:{key}: the limb has ended")))
    });
    let (lines, messages, accounts) = head.end(&[0]);
    for (field, key) in LIMBS.iter().zip(keys) {
        let account = &accounts[key];
        let (sent, delivered, lost) =
            (number(&account["sent"]), number(&account["delivered"]), number(&account["lost"]));
        assert_eq!((sent, lost), (delivered, 0), "{account} {messages:?} {reported:?}");
        // From the first that was understood on: the last rows of them all.
        let seen = compared(&lines, field, &undistributed(&place, field, rows));
        let expected: BTreeSet<u64> = (rows - sent..rows).collect();
        assert!(sent >= 100, "{account}");
        // The last may still wait for a frame of the skin at the end.
        let missing: Vec<&u64> = expected.difference(&seen.rows).filter(|row| **row < rows - 1).collect();
        assert_eq!(
            missing.len() as u64,
            number(&account["replaced"]) + number(&account["dropped"]),
            "{account}: {missing:?}"
        );
        // A frame that comes after a younger one of another limb waits for the next frame of the skin; half of them do. It is
        // replaced if the next frame to come is of its own limb, one of four. So an eighth of 100 are expected, with a deviation of 3.4;
        // 30 is five deviations above that.
        assert!(seen.rows.is_subset(&expected) && seen.rows.len() >= 70, "{seen:?}");
    }
    // A comparison that sees nothing would hold, too.
    let mut other = lines.iter().rev().find(|line| line["fields"].as_array().unwrap().len() == 4).unwrap().clone();
    other["fields"][0]["total"] = json!(1.0);
    let field = other["fields"][0]["field"].as_str().unwrap().to_owned();
    let all = undistributed(&place, &field, rows);
    assert!(std::panic::catch_unwind(|| compared(&[other], &field, &all)).is_err());
}

#[test]
fn percepts_of_limbs_pass_by_the_engine_as_they_are() {
    let (place, port) = (Place::new(), free_port());
    let head_config = place.config("head.json5", Some(port), None);
    let limb_config = place.config("limb.json5", None, Some(port));
    let head = Head::start(&place, &["thumb", "index"], &head_config, &[]);
    // One computes by itself, one has the head compute.
    let mut limbs =
        [Limb::start(LIMBS[0], "zenoh-percepts:thumb", &limb_config), Limb::start(LIMBS[1], "index", &limb_config)];
    let is_told = |head: &Head| head.running.out.has("\"limb\":\"thumb\"") && head.running.out.has("\"contact\":true");
    let row = play(&mut limbs, 0, |_| is_told(&head));
    let rows = play(&mut limbs, row, |now| now == row + 50);
    limbs.into_iter().for_each(|limb| drop(limb.end()));
    wait_for("the end", || {
        ["thumb", "index"].iter().all(|key| head.running.reported.has(&format!("{key}: the limb has ended")))
    });
    let (lines, messages, accounts) = head.end(&[0]);
    assert!(
        messages.iter().any(|line| line.contains("zenoh:thumb: it sends percepts, which go to sinks of NDJSON alone"))
    );
    let (of_limb, of_head): (Vec<Value>, Vec<Value>) = lines.into_iter().partition(|line| line.get("limb").is_some());
    let all = undistributed(&place, LIMBS[0], rows);
    let seen: Vec<u64> = of_limb.iter().map(|line| all[&line["fields"][0].to_string()]).collect();
    let sent = number(&accounts["thumb"]["sent"]);
    assert_eq!(seen, (rows - sent..rows).collect::<Vec<_>>(), "each once, in order");
    assert!(sent >= 50 && number(&accounts["thumb"]["lost"]) == 0, "{accounts:?}");
    // Their times are those of the head: as long as those of its own frames.
    let span = |lines: &[Value]| {
        let t_s = |line: Option<&Value>| line.unwrap()["t"].as_f64().unwrap();
        (t_s(lines.first()), t_s(lines.last()))
    };
    let (limb_s, head_s) = (span(&of_limb), span(&of_head));
    assert!((limb_s.1 - limb_s.0 - 0.02 * (sent - 1) as f64).abs() < 0.2, "{limb_s:?}");
    assert!(limb_s.0 > 0.0 && (limb_s.1 - head_s.1).abs() < 1.0, "{limb_s:?} {head_s:?}");
    // And those that the head computes are not the limb's.
    assert!(compared(&of_head, LIMBS[1], &undistributed(&place, LIMBS[1], rows)).rows.len() >= 40);
    assert!(of_head.iter().all(|line| {
        line["fields"].as_array().unwrap().iter().all(|own| own["field"] != LIMBS[0] || own["contact"] == false)
    }));
}

#[test]
fn a_limb_of_another_body_and_one_with_another_s_taxels_are_reported() {
    let (place, port) = (Place::new(), free_port());
    let head_config = place.config("head.json5", Some(port), None);
    let limb_config = place.config("limb.json5", None, Some(port));
    let head = Head::start(&place, &["one", "two", "mat"], &head_config, &[]);
    let mut limbs = [Limb::start(LIMBS[0], "one", &limb_config), Limb::start(LIMBS[0], "two", &limb_config)];
    let sink = ["--sink", "zenoh:mat", "--zenoh-config", &limb_config];
    let path = place.path("mat.csv");
    std::fs::write(&path, "t,2000\n0,1\n0.5,1\n1,1\n1.5,1\n2,1\n2.5,1\n3,1\n3.5,1\n4,1\n").unwrap();
    let source = format!("csv:{path}");
    let strange = Running::start(
        None,
        &[&["run", "-q", "--body", "mat", "--source", &source, "--speed", "1"], &sink[..]].concat(),
    );
    play(&mut limbs, 0, |_| {
        let reported = &head.running.reported;
        reported.has("another limb sends taxel") && reported.has("zenoh:mat: the body has no taxel 2000")
    });
    drop(strange);
    limbs.into_iter().for_each(|limb| drop(limb.end()));
    // What could not be used is lost.
    let (_, _, accounts) = head.end(&[3]);
    let refused = ["one", "two"].iter().filter(|key| number(&accounts[**key]["delivered"]) == 0).count();
    assert_eq!(refused, 1, "{accounts:?}");
}

#[test]
fn a_plan_says_what_a_limb_would_send() {
    let arguments = ["plan", "--outputs", OUTPUTS, "--fields", LIMBS[0], "--sink", "zenoh-percepts:thumb", "--json"];
    let plan: Value = serde_json::from_str(&super::done(&arguments)).unwrap();
    let network = &plan["network"];
    assert_eq!(network["frame_bytes"], 16.0 + 4.0 * 5.0);
    assert!(network["percepts_bytes"].as_f64().unwrap() > 60.0, "{network}");
    assert!(network["rate_hz"].as_f64().is_some_and(|hz| hz > 1.0), "of the bundled touch: {network}");
    let text = super::done(&arguments[..arguments.len() - 1]);
    assert!(text.contains("zenoh: 36 B a frame, zenoh-percepts: ") && text.contains(" kB/s"), "{text}");
    let without: Value = serde_json::from_str(&super::done(&["plan", "--fields", LIMBS[0], "--json"])).unwrap();
    assert!(without.get("network").is_none());
}
