//! A survey's findings as JSON, for machines and for Python.

use serde_json::{Value, json};

use super::Findings;

impl Findings {
    /// All that was found: `sensors` has a row each, and every row the same keys.
    #[must_use]
    pub fn json(&self) -> Value {
        let sensors = self.sensors.iter().map(|found| {
            let mut sensor = json!({
                "taxel": found.id, "baseline": found.baseline, "strays": found.noise, "noise": found.sigma,
                "dead_band": found.dead_band, "travel": found.travel, "full": found.full, "gain": found.gain,
            });
            if !self.with_axes.is_empty() {
                sensor["shear_baseline"] = json!(self.tangential_baselines(found.id));
                sensor["shear_noise"] = json!(self.shear_noise(found.id));
            }
            sensor
        });
        json!({
            "invert": self.invert, "raw_range": self.raw_range, "sensors": sensors.collect::<Vec<_>>(),
            "crosstalk": self.crosstalk.map(|found| json!({
                "share": found.share, "frames": found.frames, "frames_with_touches_by_it": found.split,
                "dead_band": found.dead_band,
            })),
            "remarks": self.remarks(),
        })
    }
}
