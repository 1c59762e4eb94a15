//! Limbs whose taxels measure force along three axes: their host feels how they pull, as a run of one skin does.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::limbs_network::{
    Head, Limb, PERIOD, Place, compared, free_port, number, play_by, run_undistributed, taxels_of, value, wait_for,
};

/// Two fingers of the hand with three axes, a limb each.
const FINGERS: [(&str, &str); 2] = [("hand/midhand/thumb", "hand/thumb"), ("hand/midhand/index", "hand/index")];
const ASKED: [&str; 4] = ["--body", "sensing-hand", "--outputs", "total,shear_vector,shear,torsion,friction"];

/// What a taxel of a finger reads in a row: along its normal, and along the skin.
fn axes(row: u64, taxel: usize) -> [f64; 3] {
    let (row_of, place) = ((row % 31) as f64, taxel as f64);
    [value(row, taxel), 3.0 * row_of - 40.0 + place, 25.0 - 2.0 * row_of * (1.0 - 0.25 * place)]
}

/// The percepts of `field` and `letter` in each of `rows` rows where nothing is distributed, as text; and the row of each.
fn undistributed(place: &Place, field: &str, letter: &str, rows: u64) -> BTreeMap<String, u64> {
    let taxels = taxels_of(field);
    let names: Vec<String> = taxels.iter().map(|id| format!("{id},{id}.u,{id}.v")).collect();
    let mut text = format!("t,{}\n", names.join(","));
    for row in 0..rows {
        let values: Vec<String> =
            (0..taxels.len()).flat_map(|taxel| axes(row, taxel)).map(|value| value.to_string()).collect();
        text += &format!("{},{}\n", row as f64 * PERIOD.as_secs_f64(), values.join(","));
    }
    let lines = of_letter(&run_undistributed(place, field, &text, &ASKED), letter);
    let all: BTreeMap<String, u64> =
        lines.iter().zip(0..).map(|(line, row)| (line["fields"][0].to_string(), row)).collect();
    assert_eq!(all.len() as u64, rows, "every row has percepts of its own");
    all
}

/// Lines with the percepts of one letter alone.
fn of_letter(lines: &[Value], letter: &str) -> Vec<Value> {
    let own = |line: &Value| {
        let fields = line["fields"].as_array().unwrap().iter();
        json!({"fields": fields.filter(|field| field["letter"] == letter).collect::<Vec<_>>()})
    };
    lines.iter().map(own).collect()
}

#[test]
fn limbs_with_three_axes_are_felt_along_the_skin_by_their_host() {
    let (place, port) = (Place::new(), free_port());
    let head_config = place.config("head.json5", Some(port), None);
    let limb_config = place.config("limb.json5", None, Some(port));
    let all = [&ASKED[..], &["--fields", "hand/midhand/*", "--all-fields"]].concat();
    let head = Head::start_with(&place, &FINGERS.map(|(_, key)| key), &head_config, &all);
    let mut limbs = FINGERS.map(|(field, key)| Limb::start_as(None, field, key, &limb_config, &ASKED));
    let send = |limb: &mut Limb, row: u64| {
        limb.send_line(row as f64 * PERIOD.as_secs_f64(), |taxel| json!(axes(row, taxel)));
    };
    let pulls = |line: &str| line.matches("\"friction\":").count() == FINGERS.len();
    let row = play_by(&mut limbs, 0, send, |_| head.running.out.all().last().is_some_and(|line| pulls(line)));
    let rows = play_by(&mut limbs, row, send, |now| now == row + 120);
    limbs.into_iter().for_each(|limb| drop(limb.end()));
    wait_for("the end of both", || {
        FINGERS.iter().all(|(_, key)| head.running.reported.has(&format!("zenoh:{key}: the limb has ended")))
    });
    let (lines, messages, accounts) = head.end(&[0]);
    for (field, key) in FINGERS {
        assert_eq!(number(&accounts[key]["lost"]), 0, "{accounts:?} {messages:?}");
        for (letter, output) in [("sustained", "total"), ("shear", "friction")] {
            let right = undistributed(&place, field, letter, rows);
            assert!(right.keys().all(|percept| percept.contains(&format!("\"{output}\":"))), "{letter}: {right:?}");
            let seen = compared(&of_letter(&lines, letter), field, &right);
            // Of the 120 many are replaced on a busy machine, as where limbs are merged.
            assert!(seen.rows.len() >= 40, "{field}, {letter}: {seen:?}");
        }
    }
    // What has no sign along the skin is found to be another.
    let mut other =
        of_letter(&lines, "shear").into_iter().rev().find(|line| line.to_string().contains("friction")).unwrap();
    let field = other["fields"].as_array().unwrap().iter().position(|own| own["friction"].is_number()).unwrap();
    let name = other["fields"][field]["field"].as_str().unwrap().to_owned();
    let along = other["fields"][field]["shear"][0].as_f64().unwrap();
    other["fields"][field]["shear"][0] = json!(-along);
    let right = undistributed(&place, &name, "shear", rows);
    assert!(std::panic::catch_unwind(|| compared(&[other], &name, &right)).is_err());
}
