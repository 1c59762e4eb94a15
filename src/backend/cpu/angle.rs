//! Angles of lines in lanes: what [`crate::stage::angle`] does one by one, bit for bit.

use fearless_simd::prelude::*;

use super::simd::{F, splat};
use crate::stage::angle::ATAN;

/// The angle of the line along (x, y), in [0, π).
#[inline(always)]
pub(super) fn of_line<S: Simd>(simd: S, x: F<S>, y: F<S>) -> F<S> {
    let none = splat(simd, 0.0);
    let flip = y.simd_lt(none) | (y.simd_eq(none) & x.simd_lt(none));
    let (x, y) = (flip.select(none - x, x), flip.select(none - y, y));
    let turned = atan2(simd, y, x);
    turned.simd_ge(splat(simd, std::f32::consts::PI)).select(none, turned)
}

/// atan2(y, x) for y ≥ 0, in [0, π].
#[inline(always)]
fn atan2<S: Simd>(simd: S, y: F<S>, x: F<S>) -> F<S> {
    let none = splat(simd, 0.0);
    let wide = x.max(none - x);
    let steep = y.simd_gt(wide);
    let (low, high) = (steep.select(wide, y), steep.select(y, wide));
    let a = high.simd_gt(none).select(low / high, none);
    let z = a * a;
    let pair = |k: usize| splat(simd, ATAN[k]) + splat(simd, ATAN[k + 1]) * z;
    let z2 = z * z;
    let z4 = z2 * z2;
    let q = (pair(0) + pair(2) * z2) + (pair(4) + pair(6) * z2) * z4 + splat(simd, ATAN[8]) * (z4 * z4);
    let octant = a + (a * z) * q;
    let quadrant = steep.select(splat(simd, std::f32::consts::FRAC_PI_2) - octant, octant);
    x.simd_lt(none).select(splat(simd, std::f32::consts::PI) - quadrant, quadrant)
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
                (x[3], y[3], x[5], y[5], x[6], y[6]) = (-1.0, 0.0, 0.0, 0.0, -1.0, -0.0);
            }
            let angles = with_widest!(Level::new(), simd => row(simd, &x, &y));
            for lane in 0..LANES {
                assert_eq!(angles[lane].to_bits(), of_line_f32(x[lane], y[lane]).to_bits(), "{} {}", x[lane], y[lane]);
            }
        }
    }
}
