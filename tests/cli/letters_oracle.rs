//! Shear, temperature and proximity, and what touches have of them, against a definition of their own in Python, on random bodies, poses,
//! calibrations and frames.

use serde_json::Value;

use super::touches_oracle;

/// What `tests/letters/oracle.py` finds, `None` without Python, which is said.
fn found(flags: &[&str]) -> Option<Value> {
    touches_oracle::found("letters/oracle.py", &[], flags)
}

fn assert_right(found: &Value, cells: u64, touches: u64) {
    assert_eq!(found["wrong"], 0, "{}", found["examples"]);
    assert_eq!(found["missed"], serde_json::json!([]), "changed, and not found to be wrong");
    for (name, least) in [("cells", cells), ("touches", touches)] {
        assert!(found[name].as_u64().unwrap() >= least, "{name}: {}", found[name]);
    }
    // Each quantity was there often.
    let present = found["present"].as_object().unwrap();
    assert_eq!(present.len(), 42);
    assert!(present.values().all(|number| number.as_u64().unwrap() * 200 >= cells), "{present:?}");
    let [in_world, all] = ["in_world", "touches"].map(|name| found[name].as_u64().unwrap());
    assert!((all / 4..all).contains(&in_world), "{in_world} of {all} touches are in the world");
    // And each flag of touches, but for `stale` and `several_links`, which these recordings are not.
    let flags = found["touch_flags"].as_object().unwrap();
    assert_eq!(flags.len(), 11, "{flags:?}");
    assert!(flags.values().all(|number| number.as_u64().unwrap() * 100 >= touches), "{flags:?}");
}

#[test]
fn letters_are_those_of_a_definition_of_its_own() {
    let Some(found) = found(&[]) else { return };
    assert_right(&found, 10_000, 3000);
}

#[test]
#[ignore = "takes minutes"]
fn a_million_cells_are_those_of_a_definition_of_its_own() {
    let Some(found) = found(&["--long"]) else { return };
    assert_right(&found, 1_000_000, 250_000);
}
