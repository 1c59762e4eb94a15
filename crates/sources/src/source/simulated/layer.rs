//! What a compliant layer makes of a force on it: the share that a square taxel below it feels.

use std::f64::consts::FRAC_1_SQRT_2;

use super::radial::Radial;

/// How the pressure of a point force spreads on its way down.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum Kernel {
    /// A Gaussian, with a standard deviation that is a share of the depth.
    #[default]
    Gaussian,
    /// Another that is alike in all directions.
    Radial(Radial),
}

/// Pressure of a Gaussian farther out than this many standard deviations is ignored: a share of 10⁻¹⁵.
const CUTOFF_SIGMAS: f64 = 8.0;

/// The spread of a line or point load by the layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Blur {
    Gaussian { sigma_across_m: f64, sigma_along_m: f64 },
    Radial { kernel: Radial, depth_m: f64 },
}

impl Blur {
    /// How far across and along pressure counts.
    pub(super) fn reach_m(self) -> [f64; 2] {
        match self {
            Self::Gaussian { sigma_across_m, sigma_along_m } => {
                [CUTOFF_SIGMAS * sigma_across_m, CUTOFF_SIGMAS * sigma_along_m]
            }
            Self::Radial { kernel, depth_m } => [kernel.reach() * depth_m; 2],
        }
    }

    /// The standard deviation across, and for kernels that are none that of the Gaussian of the same peak.
    pub(super) fn sigma_m(self) -> f64 {
        match self {
            Self::Gaussian { sigma_across_m, .. } => sigma_across_m,
            Self::Radial { kernel, depth_m } => kernel.spread() * depth_m,
        }
    }

    /// What a square of ± `margin_m` whose middle lies at (`across_m`, `along_m`) feels of `part`, a load that is spread
    /// evenly from −`half_m` to `half_m` along. Kernels that are not Gaussian are those of points only.
    pub(super) fn share(self, part: f64, across_m: f64, along_m: f64, half_m: f64, margin_m: f64) -> f64 {
        match self {
            Self::Gaussian { sigma_across_m, sigma_along_m } => {
                part * mass_of_point(across_m, margin_m, sigma_across_m)
                    * mass_of_line(along_m, half_m, margin_m, sigma_along_m)
            }
            Self::Radial { kernel, depth_m } => part * kernel.mass(across_m, along_m, margin_m, depth_m),
        }
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
