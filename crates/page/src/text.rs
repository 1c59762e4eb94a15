//! Messages of text to the page.

use serde_json::{Value, json};

use super::log::{About, Event, EventKind};
use super::readings::Reading;
use super::scale::Scale;
use super::sense_scale::SenseScales;
use crate::signal::BoardHealth;

pub(super) fn scale(scale: Scale, senses: Option<&SenseScales>) -> String {
    let mut message = json!({"type": "scale", "max": scale.max, "from": scale.from.word()});
    if let Some(senses) = senses {
        message["senses"] = senses.json();
    }
    message.to_string()
}

/// What people call what events are about.
#[derive(Clone, Debug, Default)]
pub(super) struct Names {
    pub(super) fields: Vec<String>,
    pub(super) links: Vec<String>,
}

/// Events after those that are no longer known.
pub(super) fn events(lost: u64, events: &[Event], names: &Names) -> String {
    let event = |event: &Event| {
        let (field, touch, link) = match event.about {
            About::Run => (None, None, None),
            About::Field(field) => (Some(field), None, None),
            About::Touch { id, link } => (None, Some(id), Some(link)),
        };
        json!({
            "seq": event.seq,
            "t_s": event.t_s,
            "kind": event.kind.word(),
            "field": field,
            "touch": touch,
            "link": link,
            "text": event.text.clone().unwrap_or_else(|| said(event, names)),
        })
    };
    json!({"type": "events", "lost": lost, "events": events.iter().map(event).collect::<Vec<Value>>()}).to_string()
}

/// What an event says whose kind says all.
fn said(event: &Event, names: &Names) -> String {
    let name = |names: &[String], index: u32| names.get(index as usize).cloned().unwrap_or_default();
    let is_onset = event.kind == EventKind::Onset;
    match event.about {
        About::Run => String::new(),
        About::Field(field) if is_onset => format!("{} is touched", name(&names.fields, field)),
        About::Field(field) => format!("{} is released", name(&names.fields, field)),
        About::Touch { id, link } if is_onset => format!("touch {id} begins on {}", name(&names.links, link)),
        About::Touch { id, link } => format!("touch {id} ends on {}", name(&names.links, link)),
    }
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
