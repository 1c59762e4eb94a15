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

#[cfg(test)]
mod tests {
    use fearless_simd::Level;

    use super::super::simd::{LANES, Row, load, store, width, with_widest};
    use super::*;
    use crate::stage::angle::of_line_f32;

    #[inline(always)]
    fn row<S: Simd>(simd: S, x: &Row<f32>, y: &Row<f32>) -> Row<f32> {
        let mut angles = [0.0; LANES];
        for at in (0..LANES).step_by(width::<S>()) {
            store(simd, of_line(simd, load(simd, x, at), load(simd, y, at)), &mut angles, at);
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
            let angles = with_widest!(Level::new(), simd => row(simd, &x, &y));
            for lane in 0..LANES {
                assert_eq!(angles[lane].to_bits(), of_line_f32(x[lane], y[lane]).to_bits(), "{} {}", x[lane], y[lane]);
            }
        }
    }
}
