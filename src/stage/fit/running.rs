//! Running error analysis: the fit in double precision, where each number carries how far single precision may be off in it.
//!
//! Each operation adds what it makes of its operands' errors and its own rounding, as in Higham, *Accuracy and Stability of Numerical
//! Algorithms* (2002), section 3.3. With u = 2⁻²⁴ sums, differences and products round by u; WGSL lets quotients and roots be off by 2.5
//! units in the last place, 5 u. A choice that single precision may take otherwise may have either outcome.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::real::{PER_SQRT_TAU, Real};
use crate::stage::U;

/// A number, and how far single precision may be off in it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Running {
    pub(crate) value: f64,
    pub(crate) off: f64,
}

/// Whether something holds, and whether single precision may think otherwise.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Verdict {
    holds: bool,
    is_close: bool,
}

/// What a device may take for 0.
const TINY: f64 = f32::MIN_POSITIVE as f64;

impl Running {
    /// A number that single precision rounds.
    pub(crate) fn rounded(value: f64) -> Self {
        Self { value, off: U * value.abs() + TINY }
    }

    /// A number that it has.
    pub(crate) fn exact(value: f64) -> Self {
        Self { value, off: 0.0 }
    }

    /// `value`, off by `from` for its operands, and by so many u for itself.
    fn made(value: f64, from: f64, roundings: f64) -> Self {
        // The rounding is of the operands as they are.
        Self { value, off: from + roundings * U * (value.abs() + from) + TINY }
    }
}

impl Add for Running {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self::made(self.value + other.value, self.off + other.off, 1.0)
    }
}

impl Sub for Running {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Neg for Running {
    type Output = Self;

    fn neg(self) -> Self {
        Self { value: -self.value, ..self }
    }
}

impl Mul for Running {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let from = self.value.abs() * other.off + other.value.abs() * self.off + self.off * other.off;
        Self::made(self.value * other.value, from, 1.0)
    }
}

impl Div for Running {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let (value, least) = (self.value / other.value, other.value.abs() - other.off);
        let from = if least > 0.0 { (self.off + value.abs() * other.off) / least } else { f64::INFINITY };
        Self::made(value, from, 5.0)
    }
}

impl Add<f64> for Running {
    type Output = Self;

    fn add(self, other: f64) -> Self {
        self + Self::rounded(other)
    }
}

impl Sub<f64> for Running {
    type Output = Self;

    fn sub(self, other: f64) -> Self {
        self - Self::rounded(other)
    }
}

impl Mul<f64> for Running {
    type Output = Self;

    fn mul(self, other: f64) -> Self {
        self * Self::rounded(other)
    }
}

impl Real for Running {
    type Mask = Verdict;

    fn all(self, value: f64) -> Self {
        Self::rounded(value)
    }

    fn sqrt(self) -> Self {
        let least = (self.value - self.off).max(0.0);
        // √a − √b = (a − b)/(√a + √b).
        let from = self.off / (self.value.sqrt() + least.sqrt()).max(f64::MIN_POSITIVE);
        Self::made(self.value.sqrt(), from, 5.0)
    }

    fn abs(self) -> Self {
        Self { value: self.value.abs(), ..self }
    }

    /// WGSL's own, off by 3 units in the last place, or 2⁻²¹ near 1.
    fn ln(self) -> Self {
        let least = (self.value - self.off).max(f64::MIN_POSITIVE);
        Self::made(libm::log(self.value), self.off / least + 8.0 * U, 6.0)
    }

    fn is_below(self, other: Self) -> Verdict {
        Verdict {
            holds: self.value < other.value,
            is_close: (self.value - other.value).abs() <= self.off + other.off && self.off + other.off > TINY * 4.0,
        }
    }

    fn choose(mask: Verdict, yes: Self, no: Self) -> Self {
        let (chosen, other) = if mask.holds { (yes, no) } else { (no, yes) };
        let apart = if mask.is_close { (yes.value - no.value).abs() + other.off } else { 0.0 };
        Self { value: chosen.value, off: chosen.off.max(apart) }
    }

    fn power_of_two(self) -> Self {
        Self { value: libm::exp2(self.value), off: 0.0 }
    }

    /// Its argument is split to u of itself, and eight terms add a u each.
    fn exp(self) -> Self {
        let value = libm::exp(self.value);
        Self::made(value, value * (self.off.exp_m1() + 2.0 * U * self.value.abs()), 10.0)
    }

    /// The tail, on either side, is a quotient of polynomials of positive terms times the density: forty roundings of itself. Seen from
    /// above, one more of 1.
    fn normal(self) -> (Self, Self) {
        let z = self.value;
        let density = PER_SQRT_TAU * libm::exp(-0.5 * z * z);
        let tail = 0.5 * libm::erfc(z.abs() * std::f64::consts::FRAC_1_SQRT_2);
        // φ' = −zφ is at most 0.242, and falls off from √3 on.
        let steep = |at: f64| {
            if at.abs() < 1.0 { 0.242 } else { at.abs() * PER_SQRT_TAU * libm::exp(-0.5 * at * at) }
        };
        let nearest = (z.abs() - self.off).max(0.0);
        let most = PER_SQRT_TAU * libm::exp(-0.5 * nearest * nearest);
        let own = 12.0 + z * z;
        let density_off = steep(nearest).max(steep(z)) * self.off;
        let of_tail = Self::made(tail, most * self.off, 30.0 + own);
        let up_to = if z < 0.0 { of_tail } else { Self::made(1.0 - tail, of_tail.off, 1.0) };
        (up_to, Self::made(density, density_off, own))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn single_precision_is_within_its_running_bound() {
        // A quotient of differences, as in masses, with operands that single precision has.
        for k in 1..200_u16 {
            let (a, b, c) = (f32::from(k) * 0.37, f32::from(k) * 0.36 + 0.011, 0.3 / f32::from(k));
            let single = ((a - b) * c + a) / (b + c) - (a * c).sqrt();
            let [x, y, z] = [a, b, c].map(|number| Running::exact(number.into()));
            let bounded = ((x - y) * z + x) / (y + z) - (x * z).sqrt();
            let off = (f64::from(single) - bounded.value).abs();
            assert!(off <= bounded.off, "{k}: {off:e} of {:e}", bounded.off);
            // A bound that allows anything would tell nothing.
            assert!(k != 7 || bounded.off < 1e-4, "{:e}", bounded.off);
        }
        let [one, close] = [1.0, 1.0 + 1e-9].map(Running::rounded);
        let chosen = Running::choose(one.is_below(close), Running::exact(3.0), Running::exact(5.0));
        assert!(chosen.value == 3.0 && chosen.off == 2.0, "either may be chosen: {chosen:?}");
    }
}
