//! What fitting contacts needs to know of a plan: the layer over each field, and from when on a taxel feels anything.

use super::OrientationBy;
use super::plan::{Plan, PlanField};
use crate::percept::Flags;
use crate::signal::{Receptor, SkinResponse};
use crate::stage::calibrate;
use crate::stage::footprint::{Layer, STEPS};

/// A chart that is off by more than this share of a distance between neighbours is too far from flat to fit a contact in: it
/// would be off by as much as the layer's σ where that is a tenth wrong.
const CURVED: f64 = 0.1;
/// A place is beyond the sensors where it is farther from every one than this share of the longest way between neighbours.
const REACH: f64 = 0.6;

/// What contacts are fitted under in `field`, whose letter is of `receptor`, for orientations `by` something, or why none are.
pub(super) fn layer(
    skin: Option<SkinResponse>,
    field: &PlanField,
    receptor: Receptor,
    by: OrientationBy,
) -> Result<Layer, Flags> {
    let Some(chart) = &field.chart else { return Err(Flags::NO_CHART) };
    let Some(SkinResponse { sigma_m, gain_spread }) = skin else { return Err(Flags::NO_SKIN) };
    if !field.area_known || receptor != Receptor::Sustained {
        return Err(Flags::NO_SKIN);
    }
    if chart.distortion > CURVED {
        return Err(Flags::CURVED);
    }
    let places = &field.places;
    let ways = places.iter().zip(&field.beside).flat_map(|(place, beside)| {
        beside.iter().map(|&other| place.truncate().distance(places[other as usize].truncate()))
    });
    let reach_m = REACH * ways.fold(0.0, f64::max) * f64::from(field.unit_m);
    Ok(Layer { sigma_m, gain_spread, reach_m, steps: by.steps().unwrap_or(STEPS) })
}

impl Plan {
    /// Notes from when on each slot's taxel feels anything, where contacts are fitted.
    pub(super) fn note_what_is_felt(&mut self) {
        if self.stages().footprint {
            let of = |slot: usize| {
                calibrate::threshold(&self.calibrations[slot % self.calibrations.len()], self.curve_of(slot))
            };
            self.feels_from = (0..self.calibrated()).map(of).collect();
        }
    }
}
