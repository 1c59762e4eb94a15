//! What a limb would send: its frames, or its percepts.

use serde_json::{Value, json};
use somatic::internal::setup::Setup;
use somatic::internal::sink::{SkinNames, limb_frame_bytes, limb_percept_bytes};
use somatic::sink::{FieldNames, SinkSpec};
use somatic::{Body, Engine, Frame, Result};

/// Bytes that a limb sends, without those of Zenoh and of the network.
pub(super) struct Network {
    /// Of a frame, and of its percepts on average.
    bytes: [f64; 2],
    /// Frames a second, where it is known.
    rate_hz: Option<f64>,
}

impl Network {
    /// What `calls` on `body` send after `engine` has made percepts of them; `None` without a network. `is_recorded`: their times are real.
    pub(super) fn for_calls(
        (asked, body): (&Setup, &Body),
        engine: &mut Engine,
        calls: &[Vec<Frame>],
        is_recorded: bool,
    ) -> Result<Option<Self>> {
        if !asked.sinks.iter().any(|sink| matches!(sink, SinkSpec::Zenoh { .. })) {
            return Ok(None);
        }
        let names = FieldNames::all_of(engine.plan());
        let skin = SkinNames::for_plan(body, engine.plan());
        let frame_bytes = limb_frame_bytes(engine.plan()) as f64;
        let (mut bytes, mut frames) = (0, 0);
        for call in calls {
            bytes += limb_percept_bytes(&names, asked.all_fields, skin.as_ref(), engine.process(call)?);
            frames += call.len();
        }
        let times = || calls.iter().flatten().map(|frame| frame.t_s);
        let lasts_s = times().fold(f64::NEG_INFINITY, f64::max) - times().fold(f64::INFINITY, f64::min);
        let rate_hz = (frames - 1) as f64 / lasts_s;
        let rate_hz = Some(rate_hz).filter(|hz| is_recorded && hz.is_finite() && *hz > 0.0);
        Ok(Some(Self { bytes: [frame_bytes, bytes as f64 / frames as f64], rate_hz }))
    }

    pub(super) fn words(&self) -> String {
        let [frame, percepts] = self.bytes;
        let each = format!("zenoh: {frame:.0} B a frame, zenoh-percepts: {percepts:.0} B");
        let second =
            |hz: f64| format!("; at {hz:.1} frames/s {:.1} and {:.1} kB/s", frame * hz * 1e-3, percepts * hz * 1e-3);
        each + &self.rate_hz.map_or(String::new(), second)
    }

    pub(super) fn json(&self) -> Value {
        let [frame, percepts] = self.bytes;
        json!({"frame_bytes": frame, "percepts_bytes": percepts, "rate_hz": self.rate_hz})
    }
}
