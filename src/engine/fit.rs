//! Contacts fitted to touches: [`crate::stage::footprint`] over a batch.
//!
//! It starts from the raw values in double precision, whatever the backend: which taxels are one touch is the backend's to say,
//! what they feel is the same on all.

use std::collections::BTreeSet;

use crate::backend::RawBatch;
use crate::backend::cpu::footprint::fit_all;
use crate::percept::{Host, Outputs, Percepts};
use crate::scene::{Plan, PlanField};
use crate::stage::footprint::{Footprint, Layer, Taxel, Touch};
use crate::stage::touches::Found;

/// A touch that waits to be fitted, and its cell.
pub(super) type Waiting = (usize, Touch);

/// The touch of `found` with the most pressure, as the fit takes it: its taxels and those beside them that can be used.
pub(super) fn strongest(
    plan: &Plan,
    (field, layer): (&PlanField, &Layer),
    (raw, frame): (&RawBatch<'_>, usize),
    found: &[Found],
) -> Option<Touch> {
    let taxels = |touch: &Found| {
        let own: Vec<u32> = touch.members().collect();
        let around = own.iter().flat_map(|&member| &field.beside[member as usize]).copied();
        let members: BTreeSet<u32> = own.iter().copied().chain(around).collect();
        members
            .into_iter()
            .filter_map(|member| {
                let (member, slot) = (member as usize, plan.members_of(field)[member as usize].slot as usize);
                plan.pressed_taxel(field, member, raw.rows.value(frame, plan.channel_of(slot)))
            })
            .collect::<Vec<_>>()
    };
    let total = |taxels: &Vec<Taxel>| taxels.iter().map(|taxel| taxel.pressure).sum::<f64>();
    // The first of those that are equal.
    let strongest = found.iter().map(taxels).rev().max_by(|a, b| total(a).total_cmp(&total(b)))?;
    (total(&strongest) > 0.0).then(|| Touch::new(&strongest, layer))
}

/// Fits the touches that wait, and puts what comes of it into their cells.
pub(super) fn all(plan: &Plan, waiting: &mut Vec<Waiting>, percepts: &mut Percepts) {
    if waiting.is_empty() {
        return;
    }
    let touches: Vec<&Touch> = waiting.iter().map(|(_, touch)| touch).collect();
    let fits = fit_all(&touches);
    for ((cell, touch), fits) in waiting.drain(..).zip(fits) {
        let (footprint, flags) = touch.conclude(fits.as_ref());
        percepts.flags[cell] |= flags;
        if let Some(footprint) = footprint {
            put(plan, &footprint, cell, percepts);
        }
    }
}

fn put(plan: &Plan, footprint: &Footprint, cell: usize, percepts: &mut Percepts) {
    let sigma = footprint.sigma;
    let place = |place: glam::DVec2| [place.x, place.y];
    let scalar = |value: f64| [value, 0.0];
    let (is_whole, is_long) = (footprint.force.is_some(), footprint.angle.is_some());
    let columns = [
        (Host::FootprintKind, Some(scalar(f64::from(footprint.kind as u8)))),
        (Host::FootprintPlace, Some(place(footprint.place))),
        (Host::FootprintPlaceSigma, sigma.map(|sigma| place(sigma.place))),
        (Host::FootprintForce, footprint.force.map(scalar)),
        (Host::FootprintForceSigma, sigma.filter(|_| is_whole).map(|sigma| scalar(sigma.force))),
        (Host::FootprintAngle, footprint.angle.map(scalar)),
        (Host::FootprintAngleSigma, sigma.filter(|_| is_long).map(|sigma| scalar(sigma.angle))),
        (Host::FootprintWidth, Some(scalar(footprint.width))),
        (Host::FootprintLength, footprint.length.map(scalar)),
    ];
    for (host, components) in columns {
        let Some(components) = components else { continue };
        let column = host.column();
        percepts.add_present(cell, column.output & plan.outputs & Outputs::FOOTPRINT);
        percepts.set_host(host, cell, &components[..column.components]);
    }
}
