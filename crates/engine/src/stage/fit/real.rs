//! Numbers, or several side by side: the fit is written once for both, and gives the same bits in both.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// A number, or one in each lane. Every operation rounds once and alike everywhere; none is fused with another.
pub(crate) trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
{
    /// Whether something holds, lane by lane.
    type Mask: Copy;

    /// `value` in every lane that `self` has.
    fn all(self, value: f64) -> Self;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    /// The natural logarithm, by `libm`.
    fn ln(self) -> Self;
    fn is_below(self, other: Self) -> Self::Mask;
    fn choose(mask: Self::Mask, yes: Self, no: Self) -> Self;
    /// Added to a whole number n within ±1000, it has n's sum with an exponent's bias in its last bits.
    const POWERS: f64 = ROUNDS + 1023.0;

    /// 2 to the power of a whole number within ±1000.
    fn power_of_two(self) -> Self;

    #[inline(always)]
    fn at_most(self, most: f64) -> Self {
        let most = self.all(most);
        Self::choose(self.is_below(most), self, most)
    }

    #[inline(always)]
    fn at_least(self, least: f64) -> Self {
        let least = self.all(least);
        Self::choose(least.is_below(self), self, least)
    }

    /// e to the power of a number within ±690, to 2⁻⁵⁰ of itself.
    #[inline(always)]
    fn exp(self) -> Self {
        let whole = (self * std::f64::consts::LOG2_E + ROUNDS) - ROUNDS;
        let rest = (self - whole * LN_2[0]) - whole * LN_2[1];
        let mut sum = self.all(EXP[0]);
        for &coefficient in &EXP[1..] {
            sum = sum * rest + coefficient;
        }
        sum * whole.power_of_two()
    }

    /// Φ, the standard normal distribution, and φ, its density; within 2⁻⁵⁰.
    #[inline(always)]
    fn normal(self) -> (Self, Self) {
        let size = self.abs().at_most(30.0);
        let density = (size * size * -0.5).exp() * PER_SQRT_TAU;
        let (mut above, mut below) = (self.all(MILLS[0][0]), self.all(MILLS[1][0]));
        for k in 1..MILLS[0].len() {
            (above, below) = (above * size + MILLS[0][k], below * size + MILLS[1][k]);
        }
        // One degree more below: the tail falls like φ(z)/z.
        let tail = density * above / (below * size + MILLS_LAST) * SQRT_TAU;
        (Self::choose(self.is_below(self.all(0.0)), tail, -tail + 1.0), density)
    }
}

/// 1.5 · 2⁵²: added, it leaves no room for parts of a whole number.
const ROUNDS: f64 = 6_755_399_441_055_744.0;
/// ln 2 in two parts; the first times a whole number is exact.
const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];
/// 1/n!, the last first.
const EXP: [f64; 14] = [
    1.0 / 6_227_020_800.0,
    1.0 / 479_001_600.0,
    1.0 / 39_916_800.0,
    1.0 / 3_628_800.0,
    1.0 / 362_880.0,
    1.0 / 40_320.0,
    1.0 / 5_040.0,
    1.0 / 720.0,
    1.0 / 120.0,
    1.0 / 24.0,
    1.0 / 6.0,
    0.5,
    1.0,
    1.0,
];
/// 1/√2π and √2π.
const PER_SQRT_TAU: f64 = 0.398_942_280_401_432_7;
const SQRT_TAU: f64 = 2.506_628_274_631_000_7;
/// Mills' ratio Φ(−z)/φ(z) as a quotient of polynomials, by Hart, as West has it.
const MILLS: [[f64; 7]; 2] = [
    [
        3.526_249_659_989_11e-2,
        0.700_383_064_443_688,
        6.373_962_203_531_65,
        33.912_866_078_383,
        112.079_291_497_871,
        221.213_596_169_931,
        220.206_867_912_376,
    ],
    [
        8.838_834_764_831_84e-2,
        1.755_667_163_182_64,
        16.064_177_579_207,
        86.780_732_202_946_1,
        296.564_248_779_674,
        637.333_633_378_831,
        793.826_512_519_948,
    ],
];
const MILLS_LAST: f64 = 440.413_735_824_752;

impl Real for f64 {
    type Mask = bool;

    #[inline(always)]
    fn all(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }

    #[inline(always)]
    fn ln(self) -> Self {
        libm::log(self)
    }

    #[inline(always)]
    fn is_below(self, other: Self) -> bool {
        self < other
    }

    #[inline(always)]
    fn choose(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    #[inline(always)]
    fn power_of_two(self) -> Self {
        Self::from_bits((self + Self::POWERS).to_bits() << 52)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponentials_and_normals_are_within_their_bounds() {
        let bound = 2.0_f64.powi(-50);
        for i in -4000..=4000 {
            let x = f64::from(i) * 0.17;
            let off = (Real::exp(x) / libm::exp(x) - 1.0).abs();
            assert!(off < bound, "e^{x}: {off:e}");
            let z = f64::from(i) * 0.0021;
            let (up_to, density) = z.normal();
            let right = 0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2);
            assert!((up_to - right).abs() < bound, "Φ({z}): {:e}", up_to - right);
            assert!((density - PER_SQRT_TAU * libm::exp(-0.5 * z * z)).abs() < bound);
        }
        // Far out nothing is left, whatever is beyond.
        for z in [40.0, 1e300] {
            assert_eq!([z.normal(), (-z).normal()].map(|(up_to, _)| up_to.abs()).map(f64::round), [1.0, 0.0]);
        }
    }

    #[test]
    fn limits_hold_on_either_side() {
        assert_eq!([-3.0, 0.5, 7.0].map(|x: f64| x.at_least(-1.0).at_most(2.0)), [-1.0, 0.5, 2.0]);
    }
}
