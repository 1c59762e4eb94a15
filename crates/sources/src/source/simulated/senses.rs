//! Temperature and distance sensors of a simulated body.
//!
//! **Temperature.** Taxels follow T̂ = Tₐ + Σ aₖ(Tₖ − Tₐ)/max(1, Σ aₖ) with dT/dt = (T̂ − T)/τ: Tₐ is the ambient's, where they begin,
//! Tₖ that of the indenter k, and aₖ the pressure there over that in the middle of the touch, so that heat spreads in the layer
//! as pressure does, and a light touch warms as a firm one. T̂ is held from frame to frame: T += (T̂ − T)(1 − exp(−Δt/τ)).
//!
//! **Distance** is of the nearest indenter in sight ([`super::nearness`]), read in mm, never under 0. What sees nothing within the
//! range reads twice the range.

use std::fmt::Write as _;

use super::file::{ProximityKeys, TemperatureKeys};
use super::noise;
use super::senses_setup::celsius;
use crate::body::{Body, Modality};
use crate::error::Result;
use crate::keys::Text;

/// °C of a body that says nothing else.
const AMBIENT_CELSIUS: f64 = 22.0;
/// The time in which a taxel comes within 1/e of a temperature, s.
const TIME_CONSTANT_S: f64 = 1.0;
/// How far distance sensors see, m.
const RANGE_M: f64 = 0.1;
/// The side of a temperature taxel without an area, m.
const SMALL_M: f64 = 1e-3;

/// The sensors of a body that measure no force.
pub(super) struct Senses {
    /// Indices of the temperature taxels in the body, and the sides of their squares, m.
    pub(super) warm: Vec<(usize, f64)>,
    /// The same of the proximity taxels, whose sides mean nothing.
    pub(super) near: Vec<(usize, f64)>,
    ambient_celsius: f64,
    time_constant_s: f64,
    warm_sigma_celsius: f64,
    range_m: f64,
    near_sigma_m: f64,
    /// By temperature taxel.
    celsius: Vec<f64>,
    last_s: Option<f64>,
}

/// What touches of a frame do to such sensors.
#[derive(Clone, Debug, Default)]
pub(super) struct Sensed {
    /// By temperature taxel Σ aₖ and Σ aₖTₖ.
    pub(super) warmed: Vec<[f64; 2]>,
    /// By proximity taxel the least distance, m; infinite where nothing is in sight.
    pub(super) distances_m: Vec<f64>,
}

impl Senses {
    /// Those of `body`.
    pub(super) fn new(text: Text<'_>, body: &Body, warm: &TemperatureKeys, near: &ProximityKeys) -> Result<Self> {
        let of = |modality: Modality| {
            let taxels = body.taxels.iter().enumerate().filter(move |(_, taxel)| taxel.modality == modality);
            let side = |area: f64| if area > 0.0 { area.sqrt() } else { SMALL_M };
            taxels.map(|(index, taxel)| (index, side(taxel.area))).collect::<Vec<_>>()
        };
        let (warm_taxels, near_taxels) = (of(Modality::Temperature), of(Modality::Proximity));
        let ambient = warm.ambient_celsius.as_ref().map(|ambient| celsius(text, "ambient_celsius", ambient));
        let ambient_celsius = ambient.transpose()?.unwrap_or(AMBIENT_CELSIUS);
        let time_constant = warm.time_constant_s.as_ref().map(|tau| text.positive("time_constant_s", tau));
        let warm_sigma = warm.noise_sigma.as_ref().map(|sigma| text.not_negative("noise_sigma", sigma));
        let range = near.range_m.as_ref().map(|range| text.positive("range_m", range));
        let near_sigma = near.noise_sigma.as_ref().map(|sigma| text.not_negative("noise_sigma", sigma));
        Ok(Self {
            celsius: vec![ambient_celsius; warm_taxels.len()],
            warm: warm_taxels,
            near: near_taxels,
            ambient_celsius,
            time_constant_s: time_constant.transpose()?.unwrap_or(TIME_CONSTANT_S),
            warm_sigma_celsius: warm_sigma.transpose()?.unwrap_or(0.0),
            range_m: range.transpose()?.unwrap_or(RANGE_M),
            near_sigma_m: 1e-3 * near_sigma.transpose()?.unwrap_or(0.0),
            last_s: None,
        })
    }

    /// Forgets what warmed the taxels.
    pub(super) fn rest(&mut self) {
        self.celsius.fill(self.ambient_celsius);
        self.last_s = None;
    }

    /// What no touch has done anything to.
    pub(super) fn untouched(&self) -> Sensed {
        Sensed { warmed: vec![[0.0; 2]; self.warm.len()], distances_m: vec![f64::INFINITY; self.near.len()] }
    }

    /// Goes on to `t_s`, with what touches do there.
    pub(super) fn feel(&mut self, t_s: f64, sensed: &Sensed) {
        let follow = self.last_s.map_or(0.0, |last_s| 1.0 - libm::exp((last_s - t_s) / self.time_constant_s));
        for (celsius, [shares, warmth]) in self.celsius.iter_mut().zip(&sensed.warmed) {
            let target = self.ambient_celsius + (warmth - shares * self.ambient_celsius) / shares.max(1.0);
            *celsius += follow * (target - *celsius);
        }
        self.last_s = Some(t_s);
    }

    /// The temperatures of the taxels, °C, in the order of [`Senses::warm`].
    pub(super) fn celsius(&self) -> &[f64] {
        &self.celsius
    }

    /// The reading of the temperature taxel `index`, with the id `id`.
    pub(super) fn warm_reading(&self, index: usize, id: u32, [seed, frame]: [u64; 2]) -> f64 {
        self.celsius[index] + noise_of(self.warm_sigma_celsius, id, [seed, frame])
    }

    /// The reading of the proximity taxel `index`, with the id `id`, at `distance_m` from what it sees.
    pub(super) fn near_reading(&self, distance_m: f64, id: u32, [seed, frame]: [u64; 2]) -> f64 {
        match distance_m <= self.range_m {
            true => 1e3 * (distance_m + noise_of(self.near_sigma_m, id, [seed, frame])).max(0.0),
            false => 2e3 * self.range_m,
        }
    }

    /// The calibration's tables of these sensors.
    pub(super) fn calibration(&self) -> String {
        let mut text = String::new();
        if !self.warm.is_empty() {
            text += "\n[temperature]\nunit = \"°C\"\n";
        }
        if !self.near.is_empty() {
            // A reading at the end of the range may be noise beyond it.
            let range = 1e3 * (self.range_m + 6.0 * self.near_sigma_m).min(1.5 * self.range_m);
            let _ = write!(text, "\n[proximity]\nunit = \"mm\"\nrange = {range}\n");
        }
        text
    }
}

fn noise_of(sigma: f64, id: u32, [seed, frame]: [u64; 2]) -> f64 {
    if sigma > 0.0 { sigma * noise::normal(seed, frame, id) } else { 0.0 }
}
