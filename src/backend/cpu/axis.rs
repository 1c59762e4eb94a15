//! axis in f32 lanes; see [`crate::stage::axis`].

use super::{Lanes, scale_of};
use crate::percept::{Flags, Outputs};
use crate::stage::angle::of_line_f32;
use crate::stage::layout::Member;

/// 2⁻³⁰.
const TOGETHER: f32 = 1.0 / 1_073_741_824.0;
const ISOTROPIC_UNDER: f32 = 1e-3;

pub(super) fn lanes<const L: usize>(members: &[Member], pressures: &[[f32; L]], lanes: &mut Lanes<L>) {
    let scale = lanes.total.map(scale_of);
    let (mut a, mut b, mut d) = ([0.0_f32; L], [0.0_f32; L], [0.0_f32; L]);
    for member in members {
        let pressures = &pressures[member.slot as usize];
        for lane in 0..L {
            let q = (member.weight * pressures[lane]) * scale[lane];
            let x = member.u - lanes.centroid[0][lane];
            let y = member.v - lanes.centroid[1][lane];
            let qx = q * x;
            a[lane] += qx * x;
            b[lane] += qx * y;
            d[lane] += (q * y) * y;
        }
    }
    for lane in 0..L {
        match lanes.active[lane] {
            0 => continue,
            1 => {
                lanes.flags[lane] |= Flags::ONE_TAXEL.bits();
                continue;
            }
            _ => {}
        }
        let trace = a[lane] + d[lane];
        if trace <= TOGETHER * (lanes.total[lane] * scale[lane]) {
            lanes.flags[lane] |= Flags::COINCIDENT.bits();
            continue;
        }
        let (x, y) = (a[lane] - d[lane], 2.0 * b[lane]);
        let h = (x * x + y * y).sqrt();
        lanes.anisotropy[lane] = (h / trace).min(1.0);
        lanes.present[lane] |= Outputs::ANISOTROPY.bits();
        if lanes.anisotropy[lane] < ISOTROPIC_UNDER {
            lanes.flags[lane] |= Flags::ISOTROPIC.bits();
            continue;
        }
        lanes.axis[lane] = if x >= 0.0 { of_line_f32(h + x, y) } else { of_line_f32(y, h - x) };
        lanes.present[lane] |= Outputs::AXIS.bits();
    }
}
