//! How an indenter's force spreads over the taxels under a compliant skin.
//!
//! `docs/simulation.md` has the model: a contact patch after Hertz, spread by a Gaussian for the depth of the layer.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// The touching object. Lengths in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Indenter {
    /// A rigid cylinder lying on the skin.
    Rod {
        radius_m: f64,
        length_m: f64,
    },
    Ball {
        radius_m: f64,
    },
    /// The pad of a human finger: a soft ball.
    Fingertip {
        radius_m: f64,
    },
    /// The flat end of a cylinder: even pressure over a disc.
    Flat {
        radius_m: f64,
    },
    /// A blade, without width.
    Edge {
        length_m: f64,
    },
}

impl Indenter {
    /// Default radius of a fingertip.
    pub(super) const FINGERTIP_RADIUS_M: f64 = 0.008;

    /// Whether it has a direction.
    pub(super) fn is_long(&self) -> bool {
        matches!(self, Self::Rod { .. } | Self::Edge { .. })
    }
}

/// The compliant layer over the taxels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Skin {
    pub(super) thickness_m: f64,
    /// Standard deviation of a point force's pressure at the bottom, as a share of the thickness.
    pub(super) spread: f64,
    /// Reduced modulus E* = E/(1 − ν²).
    pub(super) stiffness_pa: f64,
}

impl Skin {
    /// The Gaussian that has the same peak as Boussinesq's pressure at this depth: 1/√3.
    pub(super) const SPREAD: f64 = 0.577_350_269_189_625_8;
    /// A soft silicone rubber.
    pub(super) const STIFFNESS_PA: f64 = 400e3;
    /// Taxels that lie bare.
    pub(super) const NONE: Self = Self { thickness_m: 0.0, spread: Self::SPREAD, stiffness_pa: Self::STIFFNESS_PA };

    fn sigma_m(&self) -> f64 {
        self.spread * self.thickness_m
    }

    /// The calibration's table of the layer; empty where taxels lie bare.
    pub(super) fn calibration(&self) -> String {
        if self.thickness_m > 0.0 { format!("\n[skin]\nsigma_m = {}\n", self.sigma_m()) } else { String::new() }
    }

    /// Compliance 1/E* with an indenter whose own is `other`; a bare taxel does not give.
    fn compliance(&self, other: f64) -> f64 {
        if self.thickness_m > 0.0 { 1.0 / self.stiffness_pa + other } else { other }
    }
}

/// Reduced modulus of a fingertip: 1 N then presses a disc of 5 mm radius, as fingers do.
const FINGERTIP_STIFFNESS_PA: f64 = 50e3;
/// Minimum standard deviation of a footprint, which avoids division by zero.
const MIN_SIGMA_M: f64 = 1e-6;
/// Pressure farther out than this many standard deviations is ignored: a share of 10⁻¹⁵.
const CUTOFF_SIGMAS: f64 = 8.0;
/// Maximum distance of a taxel from the contact's tangent plane, beside the footprint's size.
const MAX_DEPTH_M: f64 = 5e-3;

/// A line load along the indenter.
#[derive(Clone, Copy, Debug)]
struct Strip {
    across_m: f64,
    /// Half its length; 0 for a point.
    half_m: f64,
    part: f64,
}

/// The pressure under an indenter, per newton, along and across it.
#[derive(Clone, Debug)]
pub(super) struct Footprint {
    strips: Vec<Strip>,
    sigma_across_m: f64,
    sigma_along_m: f64,
    half_across_m: f64,
    half_along_m: f64,
}

impl Footprint {
    /// The footprint of `indenter` pressed with `force_newton` on `skin`.
    pub(super) fn new(indenter: &Indenter, skin: &Skin, force_newton: f64) -> Self {
        let layer = skin.sigma_m().max(MIN_SIGMA_M);
        let widened = |variance: f64| (layer * layer + variance).sqrt();
        let point = |half_m: f64| vec![Strip { across_m: 0.0, half_m, part: 1.0 }];
        let line = |half_m: f64, sigma_across_m: f64| Self {
            strips: point(half_m),
            sigma_across_m,
            sigma_along_m: layer,
            half_across_m: 0.0,
            half_along_m: half_m,
        };
        match *indenter {
            Indenter::Rod { radius_m, length_m } => {
                let load = force_newton / length_m;
                let half_width = (4.0 * load * radius_m * skin.compliance(0.0) / PI).sqrt().min(radius_m);
                line(length_m / 2.0, widened(half_width * half_width / 4.0))
            }
            Indenter::Edge { length_m } => line(length_m / 2.0, layer),
            Indenter::Ball { radius_m } => Self::round(&widened, radius_m, force_newton * skin.compliance(0.0)),
            Indenter::Fingertip { radius_m } => {
                Self::round(&widened, radius_m, force_newton * skin.compliance(1.0 / FINGERTIP_STIFFNESS_PA))
            }
            Indenter::Flat { radius_m } => Self::disc(radius_m, layer),
        }
    }

    /// A ball's: Hertz's disc has a³ = 3FR/4E*, and a variance of a²/5 in each direction.
    fn round(widened: &dyn Fn(f64) -> f64, radius_m: f64, force_over_modulus: f64) -> Self {
        let patch = libm::cbrt(0.75 * radius_m * force_over_modulus).min(radius_m);
        let sigma = widened(patch * patch / 5.0);
        Self {
            strips: vec![Strip { across_m: 0.0, half_m: 0.0, part: 1.0 }],
            sigma_across_m: sigma,
            sigma_along_m: sigma,
            half_across_m: 0.0,
            half_along_m: 0.0,
        }
    }

    /// A disc's: strips at Gauss's nodes for a weight of √(1 − x²), which is how long a strip of a disc is. They lie
    /// closer than its blur, which therefore is never less than a 64th of its radius.
    fn disc(radius_m: f64, layer: f64) -> Self {
        let layer = layer.max(radius_m / 64.0);
        let count = (4.0 * radius_m / layer).max(8.0) as u32;
        let strips = (1..=count).map(|k| {
            let angle = PI * f64::from(k) / f64::from(count + 1);
            let sin = libm::sin(angle);
            Strip {
                across_m: radius_m * libm::cos(angle),
                half_m: radius_m * sin,
                part: 2.0 * sin * sin / f64::from(count + 1),
            }
        });
        Self {
            strips: strips.collect(),
            sigma_across_m: layer,
            sigma_along_m: layer,
            half_across_m: radius_m,
            half_along_m: radius_m,
        }
    }

    /// Maximum distance from the tangent plane at which a taxel is touched, m.
    pub(super) fn depth_m(&self) -> f64 {
        MAX_DEPTH_M + self.half_across_m + CUTOFF_SIGMAS / 2.0 * self.sigma_across_m
    }

    /// The share of the force on a square taxel with sides of `side_m` whose middle lies `across_m` and `along_m` from the
    /// middle of the indenter: the integral of the pressure over it.
    pub(super) fn share_on(&self, across_m: f64, along_m: f64, side_m: f64) -> f64 {
        let margin = side_m / 2.0;
        if across_m.abs() > self.half_across_m + margin + CUTOFF_SIGMAS * self.sigma_across_m
            || along_m.abs() > self.half_along_m + margin + CUTOFF_SIGMAS * self.sigma_along_m
        {
            return 0.0;
        }
        let parts = self.strips.iter().map(|strip| {
            strip.part
                * mass_of_point(across_m - strip.across_m, margin, self.sigma_across_m)
                * mass_of_line(along_m, strip.half_m, margin, self.sigma_along_m)
        });
        parts.sum::<f64>().max(0.0)
    }
}

/// Φ, the standard normal distribution.
fn normal(z: f64) -> f64 {
    0.5 * libm::erfc(-z * FRAC_1_SQRT_2)
}

/// ∫Φ: z·Φ(z) + φ(z).
fn normal_integral(z: f64) -> f64 {
    /// 1/√2π.
    const PEAK: f64 = 0.398_942_280_401_432_7;
    z * normal(z) + PEAK * libm::exp(-0.5 * z * z)
}

/// The mass of a Gaussian about 0 in x ± `margin`.
fn mass_of_point(x: f64, margin: f64, sigma: f64) -> f64 {
    // On the side where both tails are small, their difference is exact.
    let x = -x.abs();
    normal((x + margin) / sigma) - normal((x - margin) / sigma)
}

/// The mass in x ± `margin` of an even line from −`half` to `half`, blurred by a Gaussian.
fn mass_of_line(x: f64, half: f64, margin: f64, sigma: f64) -> f64 {
    if half < 1e-3 * sigma {
        return mass_of_point(x, margin, sigma);
    }
    let x = -x.abs();
    let at = |edge: f64| normal_integral(edge / sigma);
    let ends = (at(x + half + margin) - at(x + half - margin)) - (at(x - half + margin) - at(x - half - margin));
    sigma * ends / (2.0 * half)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SKIN: Skin = Skin { thickness_m: 7e-3, ..Skin::NONE };
    const ALL: [Indenter; 5] = [
        Indenter::Rod { radius_m: 0.0127, length_m: 0.05 },
        Indenter::Ball { radius_m: 0.01 },
        Indenter::Fingertip { radius_m: 0.008 },
        Indenter::Flat { radius_m: 0.02 },
        Indenter::Edge { length_m: 0.03 },
    ];

    #[test]
    fn tiles_without_gaps_feel_all_of_the_force() {
        for indenter in ALL {
            for (skin, pitch) in [(SKIN, 4e-3), (SKIN, 1.3e-3), (Skin::NONE, 4e-3)] {
                let footprint = Footprint::new(&indenter, &skin, 5.0);
                let steps = (0.09 / pitch) as i32;
                let at = |i: i32| 0.37 * pitch + f64::from(i) * pitch;
                let sum: f64 = (-steps..=steps)
                    .flat_map(|i| (-steps..=steps).map(move |j| (i, j)))
                    .map(|(i, j)| footprint.share_on(at(i), at(j), pitch))
                    .sum();
                // Masses telescope over the tiles: what is left is rounding, magnified in a line's double difference by
                // |x|/margin, and the cut tails.
                assert!((sum - 1.0).abs() < 1e-10, "{indenter:?}: {sum}");
            }
        }
    }

    #[test]
    fn footprints_are_as_wide_as_the_model_says() {
        let sigma = SKIN.sigma_m();
        let (force, pitch) = (5.0_f64, 1e-3);
        // Of Hertz's patches by their textbook formulas; an even line has a variance of L²/12, an even disc of R²/4.
        let rod = force / 0.05 * 0.0127 / (PI * 400e3);
        let ball = (0.75 * force * 0.01 / 400e3).powf(2.0 / 3.0) / 5.0;
        let finger = (0.75 * force * 0.008 * (1.0 / 400e3 + 1.0 / 50e3)).powf(2.0 / 3.0).min(0.008 * 0.008) / 5.0;
        let right = [
            (rod, 0.05 * 0.05 / 12.0),
            (ball, ball),
            (finger, finger),
            (0.02 * 0.02 / 4.0, 0.02 * 0.02 / 4.0),
            (0.0, 0.03 * 0.03 / 12.0),
        ];
        for (indenter, (across, along)) in ALL.iter().zip(right) {
            let footprint = Footprint::new(indenter, &SKIN, force);
            let (mut got_across, mut got_along) = (0.0, 0.0);
            for (i, j) in (-70..=70).flat_map(|i| (-70..=70).map(move |j| (f64::from(i) * pitch, f64::from(j) * pitch)))
            {
                let part = footprint.share_on(i, j, pitch);
                got_across += part * i * i;
                got_along += part * j * j;
            }
            // Tiles add the variance of an even square; σ over four pitches leaves nothing else.
            let tile = sigma * sigma + pitch * pitch / 12.0;
            assert!((got_across / (across + tile) - 1.0).abs() < 1e-7, "{indenter:?}: {got_across} {across}");
            assert!((got_along / (along + tile) - 1.0).abs() < 1e-7, "{indenter:?}: {got_along} {along}");
        }
    }

    #[test]
    fn a_larger_force_presses_a_larger_patch_up_to_the_indenters_size() {
        for indenter in &ALL[..3] {
            let peak = |force: f64| Footprint::new(indenter, &SKIN, force).share_on(0.0, 0.0, 1e-3);
            assert!(peak(1.0) > peak(10.0));
            assert_eq!(peak(1e6), peak(1e7));
        }
    }

    #[test]
    fn a_point_force_has_boussinesqs_peak() {
        let ball = Indenter::Ball { radius_m: 1e-9 };
        let (side, z) = (1e-5, SKIN.thickness_m);
        let peak = Footprint::new(&ball, &SKIN, 1.0).share_on(0.0, 0.0, side) / (side * side);
        let right = 3.0 / (2.0 * PI * z * z);
        assert!((peak / right - 1.0).abs() < 1e-6, "{peak} {right}");
    }

    #[test]
    fn a_disc_is_even_inside_and_nothing_outside() {
        let bare = Footprint::new(&Indenter::Flat { radius_m: 0.02 }, &Skin::NONE, 1.0);
        let side = 2e-3;
        let even = side * side / (PI * 0.02 * 0.02);
        for (x, y) in [(0.0, 0.0), (0.01, 0.003), (-0.005, 0.012)] {
            let felt = bare.share_on(x, y, side);
            assert!((felt / even - 1.0).abs() < 1e-4, "{felt} {even}");
        }
        assert_eq!(bare.share_on(0.024, 0.0, side), 0.0);
    }
}
