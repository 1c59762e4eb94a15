//! Angles of lines in lanes: what [`crate::stage::angle`] does one by one, bit for bit.

use std::f32::consts::{FRAC_PI_2, PI};

use fearless_simd::prelude::*;

use super::simd::{F, I, splat};
use crate::stage::angle::ATAN;

/// The angle of the line along (x, y), in [0, π); not a number where both are 0.
#[inline(always)]
pub(super) fn of_line<S: Simd>(simd: S, x: F<S>, y: F<S>) -> F<S> {
    let turned = up_to_pi(simd, x, y);
    turned.simd_ge(splat(simd, PI)).select(splat(simd, 0.0), turned)
}

/// The same, where a line that leans to the left by too little to tell may have π.
#[inline(always)]
fn up_to_pi<S: Simd>(simd: S, x: F<S>, y: F<S>) -> F<S> {
    let (wide, tall) = (x.abs(), y.abs());
    let a = wide.min(tall) / wide.max(tall);
    let z = a * a;
    let pair = |k: usize| splat(simd, ATAN[k]) + splat(simd, ATAN[k + 1]) * z;
    let z2 = z * z;
    let z4 = z2 * z2;
    let q = (pair(0) + pair(2) * z2) + (pair(4) + pair(6) * z2) * z4 + splat(simd, ATAN[8]) * (z4 * z4);
    let octant = a + (a * z) * q;
    let quadrant = tall.simd_gt(wide).select(splat(simd, FRAC_PI_2) - octant, octant);
    // The signs alone tell which way it leans: where one of the two is 0, both ways are the same line.
    let leans_left = (x.bitcast::<I<S>>() ^ y.bitcast::<I<S>>()).simd_lt(I::<S>::splat(simd, 0));
    leans_left.select(splat(simd, PI) - quadrant, quadrant)
}

/// The direction of (x, y), in (−π, π]; not a number where both are 0.
#[inline(always)]
pub(super) fn of_direction<S: Simd>(simd: S, x: F<S>, y: F<S>) -> F<S> {
    // Above the axis a direction is a line. The largest number under π: f32's own π is above it.
    let size = up_to_pi(simd, x, y.abs()).min(splat(simd, 3.141_592_5));
    y.simd_lt(splat(simd, 0.0)).select(-size, size)
}

#[cfg(test)]
mod tests {
    use fearless_simd::Level;

    use super::super::simd::{LANES, Row, load, store, width, with_widest};
    use super::*;
    use crate::stage::angle::{full_f32, of_line_f32};

    /// Angles of lines, and directions.
    #[inline(always)]
    fn rows<S: Simd>(simd: S, x: &Row<f32>, y: &Row<f32>) -> [Row<f32>; 2] {
        let mut angles = [[0.0; LANES]; 2];
        for at in (0..LANES).step_by(width::<S>()) {
            let (x, y) = (load(simd, x, at), load(simd, y, at));
            store(simd, of_line(simd, x, y), &mut angles[0], at);
            store(simd, of_direction(simd, x, y), &mut angles[1], at);
        }
        angles
    }

    #[test]
    fn lanes_have_the_bits_of_one() {
        for step in 0..4000_u16 {
            let angle = f32::from(step) * 0.003;
            let mut x = [angle.cos(); LANES];
            let mut y = [angle.sin(); LANES];
            for lane in 0..LANES {
                x[lane] *= 10.0_f32.powi(lane as i32 - 8);
                y[lane] *= 10.0_f32.powi(lane as i32 - 8);
            }
            if step < 3 {
                let seams = [(-1.0, 0.0), (-1.0, -0.0), (1.0, 0.0), (0.0, 2.0), (-0.0, 2.0), (0.0, -2.0), (-0.0, -2.0)];
                for (lane, seam) in seams.into_iter().enumerate() {
                    (x[lane], y[lane]) = seam;
                }
            }
            let [lines, directions] = with_widest!(Level::new(), simd => rows(simd, &x, &y));
            for lane in 0..LANES {
                let (x, y) = (x[lane], y[lane]);
                assert_eq!(lines[lane].to_bits(), of_line_f32(x, y).to_bits(), "{x} {y}");
                assert_eq!(directions[lane].to_bits(), full_f32(x, y).to_bits(), "{x} {y}");
            }
        }
    }
}
