//! contact in f32 lanes; see [`crate::stage::contact`].

use super::Lanes;
use crate::percept::{Flags, Outputs};
use crate::scene::{Plan, PlanField};
use crate::stage::calibrate::UNUSABLE;
use crate::stage::layout::Member;

pub(super) fn lanes<const L: usize>(
    plan: &Plan,
    field: &PlanField,
    members: &[Member],
    pressures: &[[f32; L]],
    statuses: &[[u32; L]],
) -> Lanes<L> {
    let mut total = [0.0; L];
    let mut peak = [0.0_f32; L];
    let mut area = [0.0; L];
    let mut active = [0; L];
    let mut flags = [0; L];
    let mut unusable = [UNUSABLE; L];
    for member in members {
        let slot = member.slot as usize;
        let (pressures, statuses, member_area) = (&pressures[slot], &statuses[slot], plan.taxels[slot].area);
        for lane in 0..L {
            let pressure = pressures[lane];
            flags[lane] |= statuses[lane];
            unusable[lane] &= statuses[lane];
            total[lane] += member.weight * pressure;
            peak[lane] = peak[lane].max(pressure);
            let pressed = pressure > 0.0;
            active[lane] += u32::from(pressed);
            area[lane] += if pressed { member_area } else { 0.0 };
        }
    }
    let sums = Outputs::TOTAL | Outputs::PEAK | Outputs::ACTIVE;
    let sums = if field.area_known { sums | Outputs::AREA } else { sums }.bits();
    let always = if field.charted { Flags::empty() } else { Flags::NO_CHART }.bits();
    let mut present = [0; L];
    for lane in 0..L {
        let untouched = if active[lane] == 0 { Flags::NO_CONTACT.bits() } else { 0 };
        flags[lane] = (flags[lane] & !UNUSABLE) | always | untouched;
        present[lane] = if unusable[lane] & UNUSABLE == 0 { sums } else { 0 };
    }
    Lanes {
        flags,
        present,
        total,
        peak,
        area,
        active,
        centroid: [[0.0; L]; 3],
        orientation: [0.0; L],
        axis: [0.0; L],
        anisotropy: [0.0; L],
    }
}
