//! **centroid**: the pressure-weighted mean place, eq. 1–2: c = Σ wᵢPᵢxᵢ / Σ wᵢPᵢ.
//!
//! In a field's chart x is (u, v); in a field without one it is the offset from its origin in three dimensions.
//!
//! **Bound.** With A = Σ wP|x| / S: a term of the numerator carries 2u (pressure), u (wP), u (x rounded), u (product)
//! and r of the sum ([`super::Sums`]; n − 1 in one pass), the denominator (r + 3)u, the quotient 5u; |c| ≤ A. Together
//! |δc| ≤ (2r + 13)u·A, each coordinate by itself. Pressures that are off by ε more than 2u move c by Σ wδ(x − c) / (S + Σ wδ), |δ| ≤ ε, exactly: at most
//! Σ wε|x − c| / (S − Σ wε), and never out of the taxels' midst. Products that fall under the smallest normal number add less than 2⁻⁴⁶ of
//! the unit.

use glam::DVec3;

use super::{DIVISION, Pressed, SLACK, Sums, U};

/// What is right, in f64; `pressed` is not empty.
pub(crate) fn reference(pressed: &[Pressed]) -> DVec3 {
    let total: f64 = pressed.iter().map(Pressed::pull).sum();
    pressed.iter().map(|taxel| taxel.pull() * taxel.place).sum::<DVec3>() / total
}

/// How far each coordinate of a single-precision centroid may be off.
pub(crate) fn bound(pressed: &[Pressed], sums: Sums) -> DVec3 {
    let total: f64 = pressed.iter().map(Pressed::pull).sum();
    let mean_size = pressed.iter().map(|taxel| taxel.pull() * taxel.place.abs()).sum::<DVec3>() / total;
    let r = sums.roundings(pressed.len());
    SLACK * (((2.0 * r + 8.0) * U + DIVISION) * mean_size + DVec3::splat(UNDERFLOW) + moved_by_excess(pressed, total))
}

fn moved_by_excess(pressed: &[Pressed], total: f64) -> DVec3 {
    let excess: f64 = pressed.iter().map(Pressed::pull_excess).sum();
    if excess == 0.0 {
        return DVec3::ZERO;
    }
    let c = reference(pressed);
    let farthest = pressed.iter().map(|taxel| (taxel.place - c).abs()).fold(DVec3::ZERO, DVec3::max);
    if excess >= total {
        return farthest;
    }
    let sum = pressed.iter().map(|taxel| taxel.pull_excess() * (taxel.place - c).abs()).sum::<DVec3>();
    (sum / (total - excess)).min(farthest)
}

/// 2⁻⁴⁶, see above.
const UNDERFLOW: f64 = 1.5e-14;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stage::contact;

    #[test]
    fn what_pressures_are_off_by_is_in_the_bounds() {
        let taxel = |u: f64, v: f64, weight: f64, pressure: f64, excess: f64| Pressed {
            weight,
            weight_rounding: 0.0,
            pressure,
            excess,
            place: DVec3::new(u, v, 0.0),
            area: 0.0,
        };
        for share in [0.0, 1e-3, 0.4, 1.0, 3.0] {
            let right = [
                taxel(0.1, -0.9, 1.0, 5.0, 5.0 * share),
                taxel(-0.7, 0.2, 2.0, 1.0, 0.3 * share),
                taxel(0.9, 0.8, 0.5, 7.0, 0.0),
            ];
            let (c, c_bound) = (reference(&right), bound(&right, Sums::OnePass));
            let (sums, sums_bound) = (contact::reference(&right), contact::bound(&right, Sums::OnePass));
            for signs in 0..4 {
                let sign = |bit: usize| if signs >> bit & 1 == 1 { 1.0 } else { -0.999 };
                let mut off = right;
                for (bit, taxel) in off.iter_mut().take(2).enumerate() {
                    taxel.pressure = (taxel.pressure + sign(bit) * taxel.excess).max(1e-3);
                }
                let moved = (reference(&off) - c).abs();
                assert!(moved.cmple(c_bound).all(), "{share} {signs}: {moved} {c_bound}");
                let now = contact::reference(&off);
                assert!((now.total - sums.total).abs() <= sums_bound.total);
                assert!((now.peak - sums.peak).abs() <= sums_bound.peak);
            }
            assert!(share > 0.0 || c_bound.max_element() < 1e-5);
            // Negative control: without its excess the bound would not hold.
            let mut off = right.map(|taxel| Pressed { excess: 0.0, ..taxel });
            off[0].pressure += right[0].excess;
            assert_eq!((reference(&off) - c).abs().cmple(bound(&off, Sums::OnePass)).all(), share == 0.0);
        }
    }
}
