//! **sigma**: how sure total, centroid and axis are, as standard deviations from the noise of the sensors.
//!
//! The calibration's `noise` is the standard deviation of a raw value; of P it is σᵢ = |dP/draw| · noise. To first order, over
//! the pressed taxels, independent of each other:
//!
//! var S = Σ (wᵢσᵢ)²,  var c = Σ (wᵢσᵢ/S)² (xᵢ − c)²,  for u and for v,
//!
//! var θ = Σ (wᵢσᵢ)² ((a − d)·ΔuᵢΔvᵢ − b·(Δuᵢ² − Δvᵢ²))² / h⁴
//!
//! with Δ = x − c, the moments a, b, d of [`super::principal_axis`] and h² = (a − d)² + (2b)². The centroid's own error does not turn the
//! axis, as Σ wP Δ = 0. A touch of the whole body counts P without weights in its total, and its chart stands for u and v.
//!
//! **Where it does not hold**, a quantity has no sigma, `unsure`. A taxel within [`NEAR_SIGMAS`] σ of its threshold may be
//! pressed in one frame and not in the next. With a hard onset P then jumps by the threshold: the quantity has no sigma where the
//! squares of what such jumps make of it add up to more than [`NEAR_SHARE`] of its variance. A soft onset does not jump, and what
//! it cuts off is too little to tell, unless the threshold is under [`LEAST_THRESHOLD`] σ: then the noise of untouched taxels,
//! cut off below 0, adds up to a bias, [`RECTIFIED`] σ each, which is held to the same share. Nothing has a sigma where no taxel is
//! [`LEAST_PEAK`] σ over its threshold, nor an axis whose sigma is over [`MAX_TURN`]: noise alone may cause one. These
//! numbers are fitted to simulations. One pressed taxel, `one_taxel`, tells nothing of how its neighbours stray; without `noise` of
//! every pressed taxel all is absent, `noise_unknown`, as it is for changes of pressure. What noise does not explain is not part of
//! it: few sensors, and the pressure at which they begin to feel, shift a quantity by as much in every frame.
//!
//! This stage is the host's, in f64, from the raw values: where there is contact for certain it has the same bits on every
//! backend. **Bound.** That of its own arithmetic, taken as 16(n + 32) roundings of f64: σᵢ is a difference of two pressures.

use glam::DVec2;

use super::{Given, scalar};
use crate::percept::{Flags, Host, Outputs};

/// How near its threshold a taxel is in doubt, in its own σ.
const NEAR_SIGMAS: f64 = 2.0;
/// Share of the variance up to which taxels near their threshold do not matter.
const NEAR_SHARE: f64 = 0.25;
/// The threshold under which noise alone presses a taxel, in its σ.
const LEAST_THRESHOLD: f64 = 3.0;
/// The mean of a normal number that is cut off below 0: 1/√2π.
const RECTIFIED: f64 = 0.4;
/// How far at least one taxel is over its threshold, in its σ.
const LEAST_PEAK: f64 = 10.0;
/// Sigma up to which there is an axis, rad.
const MAX_TURN: f64 = 0.1;

/// A taxel that can be used, pressed or not.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Felt {
    /// Of its P in place and axis,
    pub(crate) weight: f64,
    /// and in the total.
    pub(crate) weight_in_total: f64,
    /// P ≥ 0.
    pub(crate) pressure: f64,
    /// P, were there no threshold, less that threshold.
    pub(crate) margin: f64,
    /// The P at which it begins to be felt,
    pub(crate) threshold: f64,
    /// and what it jumps to there: that with a hard onset, 0 with a soft one.
    pub(crate) jump: f64,
    /// Standard deviation of P; `None` where it is not known.
    pub(crate) sigma: Option<f64>,
    /// (u, v), m.
    pub(crate) place_m: DVec2,
}

/// How sure a field's percept is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sigmas {
    pub(crate) flags: Flags,
    pub(crate) total: Option<f64>,
    /// m, along u and along v.
    pub(crate) centroid: Option<DVec2>,
    /// rad.
    pub(crate) principal_axis: Option<f64>,
    /// Number of pressed taxels.
    pub(crate) pressed: usize,
}

impl Sigmas {
    /// Of a field of whose taxels the noise is not known.
    pub(crate) fn unknown() -> Self {
        Self { flags: Flags::NOISE_UNKNOWN, ..Self::default() }
    }

    pub(crate) fn outputs(&self) -> [(Host, Given); 3] {
        [
            (Host::TotalSigma, (Outputs::TOTAL_SIGMA, self.total.map(scalar))),
            (Host::CentroidSigma, (Outputs::CENTROID_SIGMA, self.centroid.map(|sigma| sigma.to_array()))),
            (Host::PrincipalAxisSigma, (Outputs::PRINCIPAL_AXIS_SIGMA, self.principal_axis.map(scalar))),
        ]
    }

    /// How far the arithmetic may be off, as a share.
    pub(crate) fn rounding(&self) -> f64 {
        16.0 * (self.pressed as f64 + 32.0) * 0.5 * f64::EPSILON
    }
}

/// A quantity's variance, and the part of it from taxels near their thresholds.
#[derive(Clone, Copy, Debug, Default)]
struct Variance {
    of_noise: f64,
    of_jumps: f64,
    bias: f64,
}

impl Variance {
    /// Adds a taxel with whose P the quantity changes by `slope`.
    fn add(&mut self, taxel: &Felt, sigma: f64, slope: f64) {
        if taxel.pressure > 0.0 {
            self.of_noise += (slope * sigma).powi(2);
        }
        if taxel.margin.abs() <= NEAR_SIGMAS * sigma {
            self.of_jumps += (slope * taxel.jump).powi(2);
            if taxel.threshold < LEAST_THRESHOLD * sigma {
                self.bias += slope * RECTIFIED * sigma;
            }
        }
    }

    fn holds(&self) -> bool {
        self.of_jumps + self.bias * self.bias <= NEAR_SHARE * self.of_noise
    }

    fn sigma(&self) -> Option<f64> {
        self.holds().then(|| self.of_noise.sqrt())
    }
}

/// What is right, in f64, over the taxels of a field in contact; without `charted` only the total's.
pub(crate) fn reference(taxels: &[Felt], charted: bool) -> Sigmas {
    let pressed = || taxels.iter().filter(|taxel| taxel.pressure > 0.0);
    let mut sigmas = Sigmas { pressed: pressed().count(), ..Sigmas::default() };
    if pressed().any(|taxel| taxel.sigma.is_none()) {
        return Sigmas { flags: Flags::NOISE_UNKNOWN, ..sigmas };
    }
    if sigmas.pressed < 2 {
        return Sigmas { flags: Flags::ONE_TAXEL, ..sigmas };
    }
    if !pressed().any(|taxel| taxel.sigma.is_some_and(|sigma| taxel.margin >= LEAST_PEAK * sigma)) {
        return Sigmas { flags: Flags::UNSURE, ..sigmas };
    }
    let pull = |taxel: &Felt| taxel.weight * taxel.pressure;
    let total: f64 = pressed().map(pull).sum();
    let centroid = pressed().map(|taxel| taxel.place_m * pull(taxel)).sum::<DVec2>() / total;
    let (mut straight, mut skew) = (0.0, 0.0);
    for taxel in pressed() {
        let offset = taxel.place_m - centroid;
        straight += pull(taxel) * (offset.x * offset.x - offset.y * offset.y);
        skew += pull(taxel) * offset.x * offset.y;
    }
    let squared = straight * straight + 4.0 * skew * skew;
    let mut variances = [Variance::default(); 4];
    for taxel in taxels {
        let Some(sigma) = taxel.sigma else { continue };
        let offset = taxel.place_m - centroid;
        let turn = straight * offset.x * offset.y - skew * (offset.x * offset.x - offset.y * offset.y);
        let slopes = [offset.x / total, offset.y / total, turn / squared].map(|slope| taxel.weight * slope);
        for (variance, slope) in variances.iter_mut().zip([taxel.weight_in_total].into_iter().chain(slopes)) {
            variance.add(taxel, sigma, slope);
        }
    }
    let [of_total, of_u, of_v, of_axis] = variances;
    sigmas.total = of_total.sigma();
    if charted {
        sigmas.centroid = of_u.sigma().zip(of_v.sigma()).map(|(u, v)| DVec2::new(u, v));
        sigmas.principal_axis = of_axis.sigma().filter(|&sigma| sigma <= MAX_TURN);
    }
    if sigmas.total.is_none() || (charted && (sigmas.centroid.is_none() || sigmas.principal_axis.is_none())) {
        sigmas.flags |= Flags::UNSURE;
    }
    sigmas
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stage::{centroid, contact, pressed_at, principal_axis};

    fn felt(taxels: &[(f64, f64, f64)]) -> Vec<Felt> {
        let taxel = |&(u, v, pressure): &(f64, f64, f64)| Felt {
            weight: 1.0,
            weight_in_total: 1.0,
            pressure,
            margin: pressure,
            threshold: 0.5,
            jump: 0.0,
            sigma: Some(0.01 * (1.0 + u)),
            place_m: DVec2::new(u, v),
        };
        taxels.iter().map(taxel).collect()
    }

    const TOUCH: [(f64, f64, f64); 5] =
        [(0.1, 0.2, 3.0), (0.7, 0.3, 5.0), (0.4, 0.9, 2.0), (0.9, 0.8, 4.0), (0.2, 0.6, 1.0)];

    #[test]
    fn variances_are_those_of_the_quantities_own_slopes() {
        let quantities = |taxels: &[(f64, f64, f64)]| {
            let pressed = pressed_at(taxels);
            let c = centroid::reference(&pressed).truncate();
            let angle = principal_axis::reference(&pressed, c).line.angle.unwrap();
            [contact::reference(&pressed).total, c.x, c.y, angle]
        };
        let step = 1e-6;
        let mut variances = [0.0; 4];
        for index in 0..TOUCH.len() {
            let [less, more] = [-step, step].map(|step| {
                let mut moved = TOUCH;
                moved[index].2 += step;
                quantities(&moved)
            });
            let sigma = 0.01 * (1.0 + TOUCH[index].0);
            for (variance, (more, less)) in variances.iter_mut().zip(more.into_iter().zip(less)) {
                *variance += ((more - less) / (2.0 * step) * sigma).powi(2);
            }
        }
        let sigmas = reference(&felt(&TOUCH), true);
        let c = sigmas.centroid.unwrap();
        let found = [sigmas.total.unwrap(), c.x, c.y, sigmas.principal_axis.unwrap()];
        for (found, variance) in found.iter().zip(variances) {
            assert!((found / variance.sqrt() - 1.0).abs() < 1e-7, "{found} {}", variance.sqrt());
        }
        assert!(sigmas.flags.is_empty());
        assert_eq!(reference(&felt(&TOUCH), false), Sigmas { centroid: None, principal_axis: None, ..sigmas });
    }

    #[test]
    fn what_is_unknown_is_absent_with_its_reason() {
        let none = |taxels: &[Felt]| {
            let sigmas = reference(taxels, true);
            assert_eq!((sigmas.total, sigmas.centroid, sigmas.principal_axis), (None, None, None));
            sigmas.flags
        };
        let mut unknown = felt(&TOUCH);
        unknown[2].sigma = None;
        assert_eq!(none(&unknown), Flags::NOISE_UNKNOWN);
        unknown[2].pressure = 0.0;
        assert!(reference(&unknown, true).flags.is_empty(), "what is not pressed has no part in it");
        assert_eq!(none(&felt(&TOUCH[..1])), Flags::ONE_TAXEL);
        // A taxel that is not pressed, and nearly is: with a jump of a third of the others' P.
        let mut near = felt(&TOUCH);
        near.push(Felt { pressure: 0.0, margin: -0.01, jump: 1.0, place_m: DVec2::new(2.0, 3.0), ..near[0] });
        assert_eq!(none(&near), Flags::UNSURE);
        near[5].margin = -1.0;
        assert!(reference(&near, true).flags.is_empty());
        // With a soft onset it is cut off, which is little; without any threshold so is the noise of many.
        (near[5].margin, near[5].jump) = (-0.01, 0.0);
        assert!(reference(&near, true).flags.is_empty());
        near.extend(vec![Felt { threshold: 0.01, ..near[5] }; 40]);
        assert_eq!(none(&near), Flags::UNSURE);
        // A touch as light as the noise.
        let light: Vec<Felt> = felt(&TOUCH).iter().map(|taxel| Felt { margin: 0.09, ..*taxel }).collect();
        assert_eq!(none(&light), Flags::UNSURE);
        // An axis that noise turns by radians: the rest is known.
        let round = felt(&[(0.0, 0.0, 1.0), (1.0, 0.0, 1.0), (0.0, 1.0, 1.0), (1.0, 1.01, 1.0)]);
        let sigmas = reference(&round, true);
        assert_eq!((sigmas.principal_axis, sigmas.flags), (None, Flags::UNSURE));
        assert!(sigmas.total.is_some() && sigmas.centroid.is_some());
    }
}
