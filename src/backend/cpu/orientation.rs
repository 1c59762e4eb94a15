//! orientation in f32 lanes; see [`crate::stage::orientation`].

use super::{Lanes, scale_of};
use crate::percept::{Flags, Outputs};
use crate::stage::angle::of_line_f32;
use crate::stage::layout::Member;

/// 2⁻¹⁴.
const NEAR: f32 = 1.0 / 16_384.0;

pub(super) fn lanes<const L: usize>(members: &[Member], pressures: &[[f32; L]], lanes: &mut Lanes<L>) {
    let scale = lanes.total.map(scale_of);
    // The three largest squared distances, and the points of the two largest. Strictly larger, so that the lower id stays.
    let (mut r1, mut r2, mut r3) = ([-1.0_f32; L], [-1.0_f32; L], [-1.0_f32; L]);
    let (mut x1, mut y1, mut x2, mut y2) = ([0.0; L], [0.0; L], [0.0; L], [0.0; L]);
    for member in members {
        let pressures = &pressures[member.slot as usize];
        for lane in 0..L {
            let pressure = pressures[lane];
            let q = (member.weight * pressure) * scale[lane];
            let x = (member.u - lanes.centroid[0][lane]) * q;
            let y = (member.v - lanes.centroid[1][lane]) * q;
            let r = if pressure > 0.0 { x * x + y * y } else { -1.0 };
            let (first, second, third) = (r > r1[lane], r > r2[lane], r > r3[lane]);
            r3[lane] = if second {
                r2[lane]
            } else if third {
                r
            } else {
                r3[lane]
            };
            (r2[lane], x2[lane], y2[lane]) = if first {
                (r1[lane], x1[lane], y1[lane])
            } else if second {
                (r, x, y)
            } else {
                (r2[lane], x2[lane], y2[lane])
            };
            (r1[lane], x1[lane], y1[lane]) = if first { (r, x, y) } else { (r1[lane], x1[lane], y1[lane]) };
        }
    }
    for lane in 0..L {
        match lanes.active[lane] {
            0 => {}
            1 => lanes.flags[lane] |= Flags::ONE_TAXEL.bits(),
            active => {
                let (x, y) = (x1[lane] - x2[lane], y1[lane] - y2[lane]);
                let near = NEAR * r1[lane].sqrt();
                if (x * x + y * y).sqrt() <= near {
                    lanes.flags[lane] |= Flags::COINCIDENT.bits();
                    continue;
                }
                if active > 2 && r2[lane].sqrt() - r3[lane].max(0.0).sqrt() <= near {
                    lanes.flags[lane] |= Flags::TIE.bits();
                }
                lanes.orientation[lane] = of_line_f32(x, y);
                lanes.present[lane] |= Outputs::ORIENTATION.bits();
            }
        }
    }
}
