//! What fitting contacts needs to know of a plan: from when on a taxel feels anything, and what those around a touch feel.

use glam::DVec2;

use super::plan::Plan;
use crate::percept::TouchOutputs;
use crate::signal::{Quantity, RawValue};
use crate::stage::calibrate::{self, Felt};
use crate::stage::fit::{Pull, Taxel};
use crate::touch::{Skin, Unrolled};

/// A place is beyond the sensors where it is farther from every one than this share of the longest way between neighbours: over half
/// of the diagonal of four that form a square.
pub(crate) const REACH: f64 = 0.75;
/// Cosine of the angle to the normal of a touch's base, 60°, over which a taxel that nothing presses says nothing of the contact: the
/// skin turns away from what presses, which would not reach it however wide it is.
const TURNED_AWAY_COSINE: f64 = 0.5;

/// What the taxels around a touch feel.
#[derive(Clone, Debug, Default)]
pub(crate) struct Around {
    /// Nodes of the skin, ascending, and what they feel in the chart of the touch.
    pub(crate) felt: Vec<(u32, Taxel)>,
    /// The longest way between two of them that are neighbours, m.
    pub(crate) longest_way_m: f64,
}

impl Plan {
    /// What the taxels `near` a touch of the whole body feel that reads `value`, of those that tell something of what presses.
    pub(crate) fn felt_around(&self, skin: &Skin, near: &Unrolled, value: impl Fn(u32) -> RawValue) -> Around {
        let first_slot = self.touched_from.unwrap_or(0);
        let felt = near.nodes.iter().zip(&near.places_m).filter_map(|(&node, &place_m)| {
            let quantity = self.calibrations[node as usize].quantity;
            let mut taxel = self.felt(first_slot + node as usize, quantity, place_m, value(node))?;
            taxel.pull.weight *= skin.taxels()[node as usize].weight();
            let tells = taxel.pressure > 0.0 || near.cosine_to_base(skin, node) >= TURNED_AWAY_COSINE;
            tells.then_some((node, taxel))
        });
        let felt: Vec<(u32, Taxel)> = felt.collect();
        let place_of =
            |node: u32| felt.binary_search_by_key(&node, |(node, _)| *node).ok().map(|at| felt[at].1.place_m);
        let ways = felt.iter().flat_map(|&(node, Taxel { place_m: from, .. })| {
            skin.beside(node).iter().filter_map(move |&other| place_of(other)).map(move |to| from.distance(to))
        });
        let longest_way_m = ways.fold(0.0, f64::max);
        Around { longest_way_m, felt }
    }

    /// What the taxel of `slot`, whose P is `quantity`, feels at `place_m` in a chart where it reads `value`, as fits of contacts take
    /// it, if that can be used.
    fn felt(&self, slot: usize, quantity: Quantity, place_m: DVec2, value: RawValue) -> Option<Taxel> {
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
            gain_spread: calibration.gain_spread,
            pull: Pull { weight: if by > 0.0 { 1.0 / by } else { 0.0 }, less: by * taken_off },
        })
    }

    /// Whether contacts are fitted to touches.
    pub(crate) fn fits(&self) -> bool {
        self.touch_outputs().is_some_and(|outputs| outputs.intersects(TouchOutputs::FIT))
    }

    /// Notes from when on each slot's taxel feels anything, where contacts are fitted.
    pub(super) fn note_what_is_felt(&mut self) {
        if self.fits() {
            let threshold = |slot: usize| {
                calibrate::threshold(&self.calibrations[slot % self.calibrations.len()], self.curve_of(slot))
            };
            self.feels_from = (0..self.calibrated()).map(threshold).collect();
        }
    }
}
