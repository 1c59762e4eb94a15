//! What fitting contacts needs to know of a plan: the layer over each field, and from when on a taxel feels anything.

use glam::DVec2;

use super::OrientationBy;
use super::plan::{Plan, PlanField};
use crate::percept::{Flags, TouchOutputs};
use crate::signal::{LayerResponse, Quantity, RawValue, Receptor};
use crate::stage::calibrate::{self, Felt};
use crate::stage::fit::{Layer, STEPS, Taxel};

/// A chart that is off by more than this share of a distance between neighbours is too far from flat to fit a contact in: it
/// would be off by as much as the layer's σ where that is a tenth wrong.
const CURVED: f64 = 0.1;
/// A place is beyond the sensors where it is farther from every one than this share of the longest way between neighbours.
pub(crate) const REACH: f64 = 0.6;

impl PlanField {
    /// What contacts are fitted under, for a letter of `receptor` and orientations `by` something, or why none are.
    pub(super) fn layer_under(
        &self,
        layer: Option<LayerResponse>,
        receptor: Receptor,
        by: OrientationBy,
    ) -> Result<Layer, Flags> {
        let Some(chart) = &self.chart else { return Err(Flags::NO_CHART) };
        let Some(LayerResponse { sigma_m, gain_spread }) = layer else { return Err(Flags::NO_LAYER) };
        if !self.area_known || receptor != Receptor::Sustained {
            return Err(Flags::NO_LAYER);
        }
        if chart.distortion > CURVED {
            return Err(Flags::CURVED);
        }
        let place = |member: usize| self.places[member].truncate();
        let ways = self.beside.iter().enumerate().flat_map(|(member, beside)| {
            beside.iter().map(move |&other| place(member).distance(place(other as usize)))
        });
        let reach_m = REACH * ways.fold(0.0, f64::max) * f64::from(self.unit_m);
        Ok(Layer { sigma_m, gain_spread, reach_m, steps: by.steps().unwrap_or(STEPS) })
    }
}

impl Plan {
    /// What member `member` of `field` feels where it reads `value`, as fits of contacts take it, if that can be used.
    pub(crate) fn pressed_taxel(&self, field: &PlanField, member: usize, value: RawValue) -> Option<Taxel> {
        let slot = self.members_of(field)[member].slot as usize;
        self.felt(slot, field.quantity, field.places[member].truncate() * f64::from(field.unit_m), value)
    }

    /// What the taxel of `slot`, whose P is `quantity`, feels at `place_m` in a chart where it reads `value`, as fits of contacts take
    /// it, if that can be used.
    pub(crate) fn felt(&self, slot: usize, quantity: Quantity, place_m: DVec2, value: RawValue) -> Option<Taxel> {
        let (channel, curve) = (self.channel_of(slot), self.curve_of(slot));
        let calibration = &self.calibrations[channel];
        let Felt { pressure, sigma } = calibrate::felt(value, calibration, curve)?;
        // What a soft onset has taken off, the contact has pressed with all the same.
        let taken_off = self.onset(channel).threshold;
        // Contacts press with a force.
        let by = if quantity == Quantity::Pascal { self.areas[channel] } else { 1.0 };
        let noted = self.feels_from.get(slot).copied();
        let feels_from = noted.unwrap_or_else(|| calibrate::threshold(calibration, curve));
        Some(Taxel {
            place_m,
            area_m2: self.areas[channel],
            pressure: if pressure > 0.0 { by * (pressure + taken_off) } else { 0.0 },
            threshold: by * (feels_from + taken_off),
            sigma: sigma.map(|sigma| by * sigma),
        })
    }

    /// Notes from when on each slot's taxel feels anything, where contacts are fitted.
    pub(super) fn note_what_is_felt(&mut self) {
        if self.stages().fit || self.touch_outputs().is_some_and(|outputs| outputs.intersects(TouchOutputs::FIT)) {
            let of = |slot: usize| {
                calibrate::threshold(&self.calibrations[slot % self.calibrations.len()], self.curve_of(slot))
            };
            self.feels_from = (0..self.calibrated()).map(of).collect();
        }
    }
}
