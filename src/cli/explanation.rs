//! Why a percept is what it is: raw values, pressures, and each quantity beside the reference's.

use std::sync::mpsc::{Sender, channel};

use serde_json::{Value, json};
use somatic::internal::sink::Question;
use somatic::{Body, Engine, EngineState, Frame, Options, Result, Verdict};

/// The message that says how `field` came about in the last of `frames`, which `engine` processes beside the reference, from the
/// same state. `taxels` are the ids of a frame's values, `ids` those of the body's taxels; `recorded` are quantities that a
/// recording holds and that differ from those computed now.
///
/// # Errors
/// The device was lost.
pub(super) fn explanation(
    engine: &mut Engine,
    frames: &[Frame],
    field: usize,
    (taxels, ids): (&[u32], &[u32]),
    recorded: &[(&str, Option<Vec<f64>>)],
) -> Result<String> {
    let Some(last) = frames.len().checked_sub(1) else { return Ok(String::new()) };
    let frame = &frames[last];
    let (percepts, _) = engine.process_and_compare(frames)?;
    let number = percepts.frame_number(last);
    let flags: Vec<String> = percepts.get(last, field).flags.names().collect();
    let columns = engine.compared(last, field).into_iter().map(|compared| {
        let components = compared.column.components;
        let numbers = |value: Option<[f64; 3]>| value.map(|value| value[..components].to_vec());
        let other = recorded.iter().find(|(name, _)| *name == compared.column.name);
        json!({
            "name": compared.column.name,
            // Null where the recording has the same, or no percepts.
            "recorded": other.map(|(_, value)| json!({"value": value})),
            "value": numbers(compared.value),
            "reference": numbers(compared.reference),
            "bound": compared.bound,
            "verdict": match compared.verdict {
                Verdict::Agrees => "agrees",
                Verdict::Differs => "differs",
                Verdict::TooClose => "too close",
                _ => "not compared",
            },
        })
    });
    let columns: Vec<Value> = columns.collect();
    let mut pressures = Vec::new();
    engine.pressures(frame, &mut pressures);
    let members = engine.plan().taxels_of(field).map(|taxel| {
        let id = ids[taxel];
        let pressure = pressures.iter().find(|&&(of, _)| of == id).map(|&(_, pressure)| pressure);
        let place = taxels.iter().position(|&of| of == id);
        let raw = place.and_then(|place| frame.values[place].number());
        json!({"taxel": taxel, "raw": raw, "pressure": pressure})
    });
    Ok(json!({
        "type": "explain",
        "field": field,
        "frame": number,
        "t_s": frame.t_s,
        "backend": engine.backend().name,
        "flags": flags,
        "members": members.collect::<Vec<Value>>(),
        "columns": columns,
    })
    .to_string())
}

/// The message that says why `field` is not explained.
pub(super) fn no_explanation(field: usize, why: &str) -> String {
    json!({"type": "explain", "field": field, "error": why}).to_string()
}

/// A question, the state before the frames of a call, and these.
type Asked = (Vec<Question>, EngineState, Vec<Frame>);

/// Explains percepts of a live run on a thread of its own, with an engine of its own.
pub(super) struct LiveExplainer(Sender<Asked>);

impl LiveExplainer {
    /// Starts the thread for a run on `body`, whose frames have values of `taxels`. It ends when this is dropped.
    pub(super) fn start(body: Body, options: Options, taxels: Vec<u32>) -> Self {
        let (sender, asked) = channel::<Asked>();
        std::thread::spawn(move || {
            let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
            let mut started = None;
            for (questions, state, frames) in asked {
                for Question { field, answer } in questions {
                    let engine = match started.take() {
                        Some(engine) => Ok(engine),
                        None => Engine::new(&body, options.clone()),
                    };
                    let explained = engine.and_then(|mut engine: Engine| {
                        engine.set_channels(&taxels)?;
                        engine.restore(&state)?;
                        let explained = explanation(&mut engine, &frames, field, (&taxels, &ids), &[])?;
                        started = Some(engine);
                        Ok(explained)
                    });
                    answer(explained.unwrap_or_else(|e| no_explanation(field, &e.to_string())));
                }
            }
        });
        Self(sender)
    }

    /// Answers `questions` on the last of `frames`; `state` is the engine's before them.
    pub(super) fn explain(&self, questions: Vec<Question>, state: EngineState, frames: &[Frame]) {
        // The thread ends with this alone.
        let _ = self.0.send((questions, state, frames.to_vec()));
    }
}
