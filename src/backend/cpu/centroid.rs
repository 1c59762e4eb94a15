//! centroid in f32 lanes; see [`crate::stage::centroid`].

use super::Lanes;
use crate::percept::Outputs;
use crate::scene::PlanField;
use crate::stage::layout::Member;

pub(super) fn lanes<const L: usize>(
    field: &PlanField,
    members: &[Member],
    pressures: &[[f32; L]],
    lanes: &mut Lanes<L>,
) {
    let mut sum = [[0.0_f32; L]; 3];
    for (member, depth) in members.iter().zip(&field.depths) {
        let pressures = &pressures[member.slot as usize];
        for lane in 0..L {
            let pull = member.weight * pressures[lane];
            sum[0][lane] += pull * member.u;
            sum[1][lane] += pull * member.v;
            sum[2][lane] += pull * depth;
        }
    }
    let found = if field.charted { Outputs::CENTROID | Outputs::POSITION | Outputs::NORMAL } else { Outputs::POSITION };
    for lane in 0..L {
        if lanes.active[lane] > 0 {
            lanes.centroid[0][lane] = sum[0][lane] / lanes.total[lane];
            lanes.centroid[1][lane] = sum[1][lane] / lanes.total[lane];
            lanes.centroid[2][lane] = if field.charted { 0.0 } else { sum[2][lane] / lanes.total[lane] };
            lanes.present[lane] |= found.bits();
        }
    }
}
