//! Stage *sigma* over a field of a plan, from its raw values: the same for every backend.

use super::RawBatch;
use crate::scene::{Plan, PlanField};
use crate::signal::{RawValue, Receptor};
use crate::stage::calibrate::{self, UNUSABLE};
use crate::stage::sigma::{self, Felt, Sigmas};

/// How sure the percept of `field` in frame `frame` of `raw` is, if it is in contact.
pub(crate) fn of_field(plan: &Plan, field: &PlanField, raw: &RawBatch<'_>, frame: usize) -> Sigmas {
    if plan.letters()[field.letter].receptor != Receptor::Sustained {
        return Sigmas::unknown();
    }
    let unit_m = f64::from(field.unit_m);
    let felt = plan.members_of(field).iter().enumerate().filter_map(|(index, member)| {
        let slot = member.slot as usize;
        let felt = felt(plan, slot, raw.rows.value(frame, plan.channel_of(slot)))?;
        let weight = plan.weight(field, index);
        let place_m = field.places[index].truncate() * unit_m;
        Some(Felt { weight, weight_in_total: weight, place_m, ..felt })
    });
    sigma::reference(&felt.collect::<Vec<_>>(), field.charted)
}

/// What the taxel of `slot` feels where it reads `value`, without weights and place, if that can be used.
pub(crate) fn felt(plan: &Plan, slot: usize, value: RawValue) -> Option<Felt> {
    let (channel, curve) = (plan.channel_of(slot), plan.curve_of(slot));
    let taxel = &plan.calibrations[channel];
    let pressure = calibrate::reference(value, taxel, curve);
    if pressure.status & UNUSABLE != 0 {
        return None;
    }
    let number = value.number()?;
    let threshold = calibrate::threshold(taxel, curve);
    Some(Felt {
        pressure: pressure.value,
        margin: calibrate::response(number, taxel, curve) - threshold,
        threshold: threshold + plan.onset(channel).threshold,
        jump: threshold,
        sigma: taxel.noise.map(|noise| calibrate::sigma(number, noise, taxel, curve)),
        ..Felt::default()
    })
}
