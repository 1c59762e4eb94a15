//! The calibration of simulated sensors, exact but for what the file wants otherwise; faulty ones are masked.

use std::fmt::Write as _;

use super::sensor::{FsrOutput, Kind, Sensor};
use crate::signal::{FsrCircuit, Sensors};

/// Width of a dead band, standard deviations of the noise: one value in 10⁹ exceeds it.
const DEAD_BAND_SIGMAS: f64 = 6.0;

/// A dead band without noise, N: what single precision tells of the firmest presses. What the tails of a layer's spread leave of them, far
/// from a press, is no touch.
const LEAST_NEWTON: f64 = 1e-6;

impl Sensor {
    /// The calibration file for sensors of the taxels `ids` on the body called `body`, which cover what `sensors` says.
    pub(super) fn calibration(&self, body: &str, ids: &[u32], sensors: Sensors) -> String {
        let mut text = String::from("# The sensors of a simulation as they are.\n\n");
        let _ = writeln!(text, "body = {}\n\n[all]", toml::Value::from(body));
        let unit = self.gives_newtons().then(|| ("unit", "\"N\"".to_owned()));
        let mut keys = vec![("sensors", format!("\"{}\"", sensors.name()))];
        keys.extend(unit.into_iter().chain(self.keys()));
        if let Some(noise) = self.noise() {
            keys.push(("noise", noise.to_string()));
        }
        if let Some(dead_band) = self.dead_band {
            keys.retain(|(key, _)| *key != "dead_band");
            keys.push(("dead_band", dead_band.to_string()));
        }
        for (key, value) in keys {
            let _ = writeln!(text, "{key} = {value}");
        }
        for (id, _) in ids.iter().zip(&self.faults).filter(|(_, fault)| fault.is_some()) {
            let _ = write!(text, "\n[taxel.{id}]\nmask = true\n");
        }
        text
    }

    /// Whether P is the force in newtons, and not one of the paper's signals.
    fn gives_newtons(&self) -> bool {
        matches!(self.kind, Kind::Ideal | Kind::Linear { .. })
    }

    /// Standard deviation of a raw value, with that of rounding to whole counts; `None` where it depends on the force.
    fn noise(&self) -> Option<f64> {
        let counts = match self.kind {
            Kind::Fsr { output: FsrOutput::Counts, .. } | Kind::Linear { bits: Some(_), .. } => true,
            Kind::Ideal | Kind::Linear { bits: None, .. } => false,
            Kind::Fsr { .. } => return None,
        };
        let rounding = if counts { 1.0 / 12.0 } else { 0.0 };
        Some((self.noise_sigma * self.noise_sigma + rounding).sqrt())
    }

    fn keys(&self) -> Vec<(&'static str, String)> {
        let noise = DEAD_BAND_SIGMAS * self.noise_sigma;
        match self.kind {
            Kind::Ideal => vec![("dead_band", noise.max(LEAST_NEWTON).to_string())],
            Kind::Linear { offset, gain, bits } => {
                let rounding = if bits.is_some() { 0.5 } else { 0.0 };
                vec![
                    ("baseline", offset.to_string()),
                    ("gain", (1.0 / gain.abs()).to_string()),
                    ("invert", (gain < 0.0).to_string()),
                    ("dead_band", ((noise + rounding) / gain.abs()).max(LEAST_NEWTON).to_string()),
                ]
            }
            Kind::Fsr { circuit, output } => {
                // The lowest reading of an open sensor with noise.
                let open = FsrCircuit::convert(FsrCircuit::STEPS - noise);
                let dead_band = match output {
                    FsrOutput::Counts => return counts_keys(circuit, open),
                    FsrOutput::Logarithmic => circuit.logarithmic(open),
                    FsrOutput::Linearised { full_scale_newton } => circuit.linearised(open, full_scale_newton),
                };
                vec![("dead_band", dead_band.to_string())]
            }
        }
    }
}

/// For readings of the paper's circuit; `open` is the lowest reading of an open sensor.
fn counts_keys(circuit: FsrCircuit, open: u16) -> Vec<(&'static str, String)> {
    let linear = |counts| circuit.linearised(counts, FsrCircuit::SATURATION_NEWTON);
    // The raw signal needs the wider dead band; it is used for both if it ends below the smallest force.
    let raw = circuit.logarithmic(open);
    let dead_band = if raw < linear(circuit.counts(FsrCircuit::BREAK_NEWTON)) { raw } else { linear(open) };
    vec![("sensor", "\"fsr\"".to_owned()), ("wiper", circuit.wiper.to_string()), ("dead_band", dead_band.to_string())]
}
