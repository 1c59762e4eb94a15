//! **centroid**: the pressure-weighted mean place, eq. 1–2: c = Σ wᵢPᵢxᵢ / Σ wᵢPᵢ.
//!
//! In a field's chart x is (u, v); in a field without one it is the offset from its origin in three dimensions.
//!
//! **Bound.** With A = Σ wP|x| / S: a term of the numerator carries 2u (pressure), u (wP), u (x rounded), u (product)
//! and n − 1 sums, the denominator (n + 2)u, the quotient 5u; |c| ≤ A. Together |δc| ≤ (2n + 11)u·A, each coordinate by
//! itself. Products that fall under the smallest normal number add less than 2⁻⁴⁶ of the unit.

use glam::DVec3;

use super::{DIVISION, Pressed, SLACK, U};

/// What is right, in f64; `pressed` is not empty.
pub(crate) fn reference(pressed: &[Pressed]) -> DVec3 {
    let total: f64 = pressed.iter().map(Pressed::pull).sum();
    pressed.iter().map(|taxel| taxel.pull() * taxel.place).sum::<DVec3>() / total
}

/// How far each coordinate of a single-precision centroid may be off.
pub(crate) fn bound(pressed: &[Pressed]) -> DVec3 {
    let total: f64 = pressed.iter().map(Pressed::pull).sum();
    let mean_size = pressed.iter().map(|taxel| taxel.pull() * taxel.place.abs()).sum::<DVec3>() / total;
    let n = pressed.len() as f64;
    SLACK * (((2.0 * n + 6.0) * U + DIVISION) * mean_size + DVec3::splat(UNDERFLOW))
}

/// 2⁻⁴⁶, see above.
const UNDERFLOW: f64 = 1.5e-14;
