//! Angles: of a line in [0, π), with its seam; and the bound on the arctangent that the f32 backends share.

use std::f64::consts::PI;

/// Error of `shaders/shared/angle.wgsl` and of the CPU's lanes, rad: the polynomial and its evaluation lose 1.5u of at
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
pub fn between_lines(a: f64, b: f64) -> f64 {
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
    }
}
