//! Messages of text to the page.

use serde_json::{Value, json};

use super::log::{Event, EventKind};
use super::readings::Reading;
use super::scale::Scale;
use crate::signal::BoardHealth;

pub(super) fn scale(scale: Scale) -> String {
    json!({"type": "scale", "max": scale.max, "from": scale.from.word()}).to_string()
}

/// Events after those that are no longer known; fields are called `labels`.
pub(super) fn events(lost: u64, events: &[Event], labels: &[String]) -> String {
    let event = |event: &Event| {
        let label = event.field.and_then(|field| labels.get(field as usize)).map_or("", String::as_str);
        let text = match (&event.text, event.kind) {
            (Some(text), _) => text.clone(),
            (None, EventKind::Onset) => format!("{label} is touched"),
            (None, EventKind::Release) => format!("{label} is released"),
            (None, _) => label.to_owned(),
        };
        json!({"seq": event.seq, "t_s": event.t_s, "kind": event.kind.word(), "field": event.field, "text": text})
    };
    json!({"type": "events", "lost": lost, "events": events.iter().map(event).collect::<Vec<Value>>()}).to_string()
}

pub(super) fn boards(boards: &[BoardHealth]) -> String {
    json!({"type": "boards", "boards": boards}).to_string()
}

pub(super) fn taxel(taxel: usize, t_s: f64, reading: &Reading) -> String {
    let Reading { raw, pressure, health } = reading;
    json!({
        "type": "taxel",
        "taxel": taxel,
        "t_s": t_s,
        "raw": raw,
        "pressure": pressure,
        "health": health.word(),
    })
    .to_string()
}

pub(super) fn ended(reason: &str) -> String {
    json!({"type": "ended", "reason": reason}).to_string()
}

/// What a run that nobody plays is doing.
pub(super) fn live_status(at_end: bool) -> String {
    json!({"type": "status", "playing": !at_end, "speed": 1.0, "at_end": at_end}).to_string()
}

/// Why a percept is not explained.
pub(super) fn no_explanation(field: usize, why: &str) -> String {
    json!({"type": "explain", "field": field, "error": why}).to_string()
}
