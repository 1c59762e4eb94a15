//! Angles: of a line in [0, π), with its seam; and the bound on the arctangent that the f32 backends share.

use std::f64::consts::PI;

/// Error of `shaders/shared/angle.wgsl` and of [`atan2_f32`], rad: the polynomial and its evaluation lose 1.5u of at
/// most π/4, the quotient 5u of it, and the reflections at π/2, at π and the constants' own rounding u·π each.
pub(crate) const ATAN2_ERROR: f64 = 16.0 * super::U;

/// The angle of the line along (x, y), in [0, π). The direction along it does not matter, nor does a negative zero.
pub(crate) fn of_line(x: f64, y: f64) -> f64 {
    // +0 + (−0) is +0: both seams of atan2 are decided by this.
    let turned = if y < 0.0 || (y == 0.0 && x < 0.0) { (-y + 0.0).atan2(-x + 0.0) } else { (y + 0.0).atan2(x + 0.0) };
    if turned >= PI { 0.0 } else { turned }
}

/// The distance between two directions, in [0, π].
pub(crate) fn between_directions(a: f64, b: f64) -> f64 {
    let d = (a - b).abs() % (2.0 * PI);
    d.min(2.0 * PI - d)
}

/// The distance between two angles of lines, in [0, π/2].
pub(crate) fn between_lines(a: f64, b: f64) -> f64 {
    let d = (a - b).abs() % PI;
    d.min(PI - d)
}

/// Coefficients of Q in atan(a) ≈ a + a·z·Q(z), z = a², 0 ≤ a ≤ 1, lowest first: a minimax fit of relative error 2.6e-9.
/// `shaders/shared/angle.wgsl` has the same numbers.
pub(crate) const ATAN: [f32; 9] = [
    -0.333_333,
    0.199_985_49,
    -0.142_642_42,
    0.109_521_86,
    -0.084_034_5,
    0.057_957_586,
    -0.031_177_837,
    0.010_914_601,
    -0.001_793_620_5,
];

/// atan2(y, x) for y ≥ 0, in [0, π].
#[cfg(test)]
pub(crate) fn atan2_f32(y: f32, x: f32) -> f32 {
    let (wide, tall) = (x.abs(), y);
    let (low, high) = if tall > wide { (wide, tall) } else { (tall, wide) };
    let a = if high > 0.0 { low / high } else { 0.0 };
    let z = a * a;
    // By pairs rather than one after the other, so that less waits for what comes before.
    let pair = |k: usize| ATAN[k] + ATAN[k + 1] * z;
    let z2 = z * z;
    let z4 = z2 * z2;
    let q = (pair(0) + pair(2) * z2) + (pair(4) + pair(6) * z2) * z4 + ATAN[8] * (z4 * z4);
    let octant = a + (a * z) * q;
    let quadrant = if tall > wide { std::f32::consts::FRAC_PI_2 - octant } else { octant };
    if x < 0.0 { std::f32::consts::PI - quadrant } else { quadrant }
}

/// atan2(y, x), in (−π, π], as lanes have it.
#[cfg(test)]
pub(crate) fn full_f32(x: f32, y: f32) -> f32 {
    // The largest single-precision number under π: f32's own π is above it.
    let size = atan2_f32(y.abs(), x).min(3.141_592_5);
    if y < 0.0 { -size } else { size }
}

/// The angle of the line along (x, y), in [0, π): [`of_line`] in f32, as lanes have it.
#[cfg(test)]
pub(crate) fn of_line_f32(x: f32, y: f32) -> f32 {
    let flip = y < 0.0 || (y == 0.0 && x < 0.0);
    let (x, y) = if flip { (-x, -y) } else { (x, y) };
    let turned = atan2_f32(y, x);
    // f32's π is above π.
    if turned >= std::f32::consts::PI { 0.0 } else { turned }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_seam_wraps_to_zero() {
        assert_eq!(of_line(-1.0, 0.0), 0.0);
        assert_eq!(of_line(-1.0, -0.0).to_bits(), 0);
        assert_eq!(of_line(1.0, -0.0).to_bits(), 0);
        assert_eq!(of_line(-1.0, 1e-300), 0.0);
        assert!((of_line(0.0, -2.0) - PI / 2.0).abs() < 1e-15);
        for (x, y) in [(-1.0, 0.0), (-1.0, -0.0), (1.0, -0.0), (-1.0, 1e-30), (-1.0, -1e-30_f32)] {
            assert_eq!(of_line_f32(x, y).to_bits() & 0x7FFF_FFFF, of_line_f32(x, y).to_bits());
            assert!(of_line_f32(x, y) < 3.0e-30_f32.max(f32::EPSILON), "{x} {y}");
        }
    }

    #[test]
    fn the_arctangent_keeps_its_bound() {
        let mut worst: f64 = 0.0;
        for step in 0..200_000_u32 {
            let angle = f64::from(step) / 200_000.0 * PI;
            for scale in [1.0, 1e-15, 3e12] {
                let (x, y) = ((angle.cos() * scale) as f32, (angle.sin() * scale) as f32);
                let right = f64::from(y).atan2(f64::from(x));
                worst = worst.max((f64::from(atan2_f32(y, x)) - right).abs());
            }
        }
        assert!(worst <= ATAN2_ERROR, "{worst:e}");
        // The bound is not idle: an arctangent eight times worse would be caught.
        assert!(worst > ATAN2_ERROR / 8.0, "{worst:e}");
    }
}
