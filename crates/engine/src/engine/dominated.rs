//! Orientations of touches that one taxel dominates, in double precision on every backend.
//!
//! The point of a taxel that is nearly all of S is q(x − c), a difference of nearly equal numbers: with ρ the share of all
//! others it is about ρ long, and single precision puts it off by some u·n. Where ρ is under [`SHARE`] that may choose other points,
//! and turn the line arbitrarily, so the host computes it from the raw values: [`crate::stage::orientation::reference`]. Above, the
//! pair of points is off by n²·u/ρ of its length at most, a hundredth for a dozen taxels.

use std::f64::consts::PI;

use crate::backend::RawBatch;
use crate::percept::{Component, Flags, Outputs, Percepts, Values};
use crate::scene::Plan;
use crate::signal::Receptor;
use crate::stage::{Pressed, calibrate, centroid, orientation};

/// The share of S, of all taxels but one, under which single precision does not do.
const SHARE: f32 = 1.0 / 1024.0;

/// Computes the orientations of such touches in the frames of `raw` anew. `pressed` is memory, empty before and after.
pub(super) fn orient_again(plan: &Plan, raw: &RawBatch<'_>, percepts: &mut Percepts, pressed: &mut Vec<Pressed>) {
    if !plan.stages().orientation || !plan.outputs().contains(Outputs::ORIENTATION) {
        return;
    }
    let fields = plan.fields.len();
    for frame in 0..raw.frames {
        let first = (raw.first + frame) * fields;
        let Values::F32(parts) = &percepts.values else { return };
        let [total, peak] = [Component::Total, Component::Peak].map(|part| &parts[part][first..first + fields]);
        let cells = plan.heaviest.iter().zip(total.iter().zip(peak));
        // All of them without a branch, as there is nearly always none.
        if !cells.fold(false, |any, (heaviest, (total, peak))| any | is_dominated(*heaviest, *total, *peak)) {
            continue;
        }
        for field in 0..fields {
            let Values::F32(parts) = &percepts.values else { return };
            let [total, peak] = [Component::Total, Component::Peak].map(|part| parts[part][first + field]);
            if is_dominated(plan.heaviest[field], total, peak) {
                orient(plan, (raw, frame), field, first + field, percepts, pressed);
                pressed.clear();
            }
        }
    }
}

fn is_dominated(heaviest: f32, total: f32, peak: f32) -> bool {
    total - heaviest * peak < SHARE * total
}

fn orient(
    plan: &Plan,
    (raw, frame): (&RawBatch<'_>, usize),
    index: usize,
    cell: usize,
    percepts: &mut Percepts,
    pressed: &mut Vec<Pressed>,
) {
    let (field, flags) = (&plan.fields[index], percepts.flags[cell]);
    let none = Flags::NO_CONTACT | Flags::ONE_TAXEL | Flags::NO_CHART;
    if flags.intersects(none) || plan.letters()[field.letter].receptor == Receptor::Change {
        return;
    }
    let members = plan.members_of(field).iter().enumerate();
    pressed.extend(members.filter_map(|(index, member)| {
        let slot = member.slot as usize;
        let channel = plan.channel_of(slot);
        let value = raw.rows.value(frame, channel);
        let pressure = calibrate::pressure(value, &plan.calibrations[channel], plan.curve_of(slot))?;
        let (weight, place) = (plan.weight(field, index), field.places[index]);
        (pressure > 0.0).then(|| Pressed { weight, pressure, place, ..Pressed::default() })
    }));
    // Single precision has another set of pressed taxels only where one is at its threshold.
    if pressed.len() != percepts.active[cell] as usize {
        return;
    }
    let line = orientation::reference(pressed, centroid::reference(pressed).truncate());
    // An axis that is absent may have the same reason.
    let has_axis = percepts.present(cell).intersects(Outputs::PRINCIPAL_AXIS | Outputs::ANISOTROPY);
    let is_axis_together = plan.stages().principal_axis && !has_axis && !flags.contains(Flags::ISOTROPIC);
    let own = if is_axis_together { Flags::TIE } else { Flags::TIE | Flags::COINCIDENT };
    percepts.flags[cell] = (flags - own) | line.flags;
    percepts.remove_present(cell, Outputs::ORIENTATION);
    let Some(angle) = line.angle else { return };
    percepts.add_present(cell, Outputs::ORIENTATION);
    let Values::F32(parts) = &mut percepts.values else { return };
    // What rounds to π is 0.
    let angle = angle as f32;
    parts[Component::Orientation][cell] = if angle >= PI as f32 { 0.0 } else { angle };
}
