//! What tuning came to: as a table, as JSON, and as files.

use std::collections::BTreeMap;

use serde_json::{Value, json};
use somatic::internal::survey::tuning::{Tuned, Tuning};
use somatic::signal::{FsrCircuit, Wiring};
use somatic::{Error, Result};

use super::session::TunedChannel;
use crate::cli::table::{more, plain, shown};
use crate::cli::words::{bullet, count};

/// More sensors than this are summed up.
const LISTED: usize = 64;

pub(super) fn table(tuning: &Tuning, places: &[TunedChannel]) -> String {
    let fits = tuning.outcomes().filter(|(_, tuned, _)| *tuned == Tuned::Fits).count();
    let mut text = format!(
        "{} of {} fit after {}; raw values {} when pressed\n",
        fits,
        count(places.len() as u64, "sensor"),
        count(tuning.rounds() as u64, "round"),
        if tuning.falls() { "fall" } else { "rise" }
    );
    let mut table = plain(["taxel", "board", "channel", "wiper", "at rest", "firm press", "of the range"], 0..7);
    let dash = || "–".to_owned();
    for (at, (sensor, _, [before, after])) in places.iter().zip(tuning.outcomes()).take(LISTED) {
        let number = |raw: f64| format!("{raw:.0}");
        let percent = |share: Option<f64>| share.map_or_else(dash, |share| format!("{:.0}", 100.0 * share));
        let last = sensor.last();
        table.add_row([
            at.taxel.to_string(),
            at.id.to_string(),
            at.channel.to_string(),
            if sensor.wiper == sensor.before {
                sensor.wiper.to_string()
            } else {
                format!("{} → {}", sensor.before, sensor.wiper)
            },
            last.map_or_else(dash, |look| number(look.rest)),
            last.map_or_else(dash, |look| number(look.press)),
            if before.or(after).is_none() { dash() } else { format!("{} → {} %", percent(before), percent(after)) },
        ]);
    }
    text += &shown(&table);
    text += &more(places.len(), LISTED);
    remarks(tuning, places).iter().for_each(|remark| text += &bullet(remark));
    text
}

/// What a person should know, a line a kind of trouble.
fn remarks(tuning: &Tuning, places: &[TunedChannel]) -> Vec<String> {
    let mut kinds: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for (at, (_, tuned, _)) in places.iter().zip(tuning.outcomes()) {
        let why = match at.trouble {
            Some(trouble) => Some(format!("board {} {trouble}", at.id)),
            None => tuned.words().map(ToOwned::to_owned),
        };
        if let Some(why) = why {
            kinds.entry(why).or_default().push(at.taxel.to_string());
        }
    }
    kinds.into_iter().map(|(why, taxels)| format!("{why}: taxel {}", taxels.join(", "))).collect()
}

pub(super) fn json(tuning: &Tuning, places: &[TunedChannel]) -> String {
    let sensors: Vec<Value> = places
        .iter()
        .zip(tuning.outcomes())
        .map(|(at, (sensor, tuned, [before, after]))| {
            let last = sensor.last();
            json!({
                "taxel": at.taxel, "board": at.id, "channel": at.channel,
                "wiper_before": sensor.before, "wiper": sensor.wiper, "acknowledged": at.is_set,
                "rest": last.map(|look| look.rest), "press": last.map(|look| look.press),
                "share_before": before, "share": after,
                "fits": tuned == Tuned::Fits,
                "why": at.trouble.or_else(|| tuned.words()),
            })
        })
        .collect();
    let json = json!({
        "rounds": tuning.rounds(), "invert": tuning.falls(), "sensors": sensors, "remarks": remarks(tuning, places),
    });
    format!("{json:#}\n")
}

pub(super) fn wiring(wiring: &Wiring) -> String {
    format!("# With the wipers that `somatic tune` found.\n{}", wiring.to_toml())
}

/// A calibration for the paper's circuit.
pub(super) fn fsr(tuning: &Tuning, body: &str) -> Result<String> {
    if !tuning.falls() || tuning.sensors().iter().any(|sensor| sensor.most != f64::from(FsrCircuit::OPEN_COUNTS)) {
        return Err(Error::failed(
            "no calibration for the paper's circuit is written: its values have 10 bits and fall when pressed",
        ));
    }
    let mut counts = BTreeMap::new();
    tuning.sensors().iter().for_each(|sensor| *counts.entry(sensor.wiper).or_insert(0) += 1);
    let usual = counts.iter().max_by_key(|(_, count)| **count).map_or(FsrCircuit::MIDDLE_WIPER, |(wiper, _)| *wiper);
    let body = Value::from(body);
    let mut text = format!("body = {body}\n\n[all]\nsensor = \"fsr\"\nwiper = {usual}\n");
    for sensor in tuning.sensors().iter().filter(|sensor| sensor.wiper != usual) {
        text += &format!("\n[taxel.{}]\nwiper = {}\n", sensor.id, sensor.wiper);
    }
    Ok(text)
}
