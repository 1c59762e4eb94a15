//! What a compliant layer makes of a force on it: the share that a square taxel below it feels.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// How the pressure of a point force spreads on its way down.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum Kernel {
    /// A Gaussian, with a standard deviation that is a share of the depth.
    #[default]
    Gaussian,
    /// Boussinesq's pressure in an elastic half-space, 3z³/2π(r² + z²)^(5/2).
    Boussinesq,
}

/// Pressure of a Gaussian farther out than this many standard deviations is ignored: a share of 10⁻¹⁵.
const CUTOFF_SIGMAS: f64 = 8.0;
/// Boussinesq's pressure farther out than this many depths is ignored: a share of 4 · 10⁻⁶.
const CUTOFF_DEPTHS: f64 = 64.0;

/// The spread of a line or point load by the layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Blur {
    Gaussian { sigma_across_m: f64, sigma_along_m: f64 },
    Boussinesq { depth_m: f64 },
}

impl Blur {
    /// How far across and along pressure counts.
    pub(super) fn reach_m(self) -> [f64; 2] {
        match self {
            Self::Gaussian { sigma_across_m, sigma_along_m } => {
                [CUTOFF_SIGMAS * sigma_across_m, CUTOFF_SIGMAS * sigma_along_m]
            }
            Self::Boussinesq { depth_m } => [CUTOFF_DEPTHS * depth_m; 2],
        }
    }

    /// The standard deviation across, and for Boussinesq's, whose variance is infinite, of the Gaussian of the same peak.
    pub(super) fn sigma_m(self) -> f64 {
        match self {
            Self::Gaussian { sigma_across_m, .. } => sigma_across_m,
            Self::Boussinesq { depth_m } => depth_m / 3.0_f64.sqrt(),
        }
    }

    /// What a square of ± `margin_m` whose middle lies at (`across_m`, `along_m`) feels of `part`, a load that is spread
    /// evenly from −`half_m` to `half_m` along. Boussinesq's is that of points only.
    pub(super) fn share(self, part: f64, across_m: f64, along_m: f64, half_m: f64, margin_m: f64) -> f64 {
        match self {
            Self::Gaussian { sigma_across_m, sigma_along_m } => {
                part * mass_of_point(across_m, margin_m, sigma_across_m)
                    * mass_of_line(along_m, half_m, margin_m, sigma_along_m)
            }
            Self::Boussinesq { depth_m } => part * mass_below_point(across_m, along_m, margin_m, depth_m),
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

/// ∫∫ 3z³/2π(x² + y² + z²)^(5/2) over the square of ± `margin` about (x, y).
fn mass_below_point(x: f64, y: f64, margin: f64, depth: f64) -> f64 {
    // On one side of each axis the corners' signs are equal, so that nothing depends on the side.
    let (x, y) = (x.abs(), y.abs());
    let at = |x: f64, y: f64| quadrant(x, y, depth);
    (at(x + margin, y + margin) - at(x - margin, y + margin))
        - (at(x + margin, y - margin) - at(x - margin, y - margin))
}

/// The same over the rectangle from (0, 0) to (x, y), with its sign: Holl's closed form for the pressure below the corner of
/// an evenly loaded rectangle, which by symmetry is what the rectangle feels of a force above its corner.
fn quadrant(x: f64, y: f64, z: f64) -> f64 {
    let (xx, yy, zz) = (x * x, y * y, z * z);
    let corner = (xx + yy + zz).sqrt();
    let straight = x * y * z / corner * (1.0 / (xx + zz) + 1.0 / (yy + zz));
    (libm::atan(x * y / (z * corner)) + straight) / (2.0 * PI)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::simulated::patch::gauss_legendre;

    fn pressure(x: f64, y: f64, z: f64) -> f64 {
        3.0 * z.powi(3) / (2.0 * PI * (x * x + y * y + z * z).powf(2.5))
    }

    #[test]
    fn boussinesqs_pressure_is_integrated_over_the_taxel() {
        let nodes = gauss_legendre(40);
        for (x, y, side, depth) in [
            (0.0, 0.0, 4e-3, 7e-3),
            (3e-3, -1e-3, 4e-3, 7e-3),
            (-20e-3, 11e-3, 10e-3, 4e-3),
            (2e-3, 2e-3, 4e-3, 2e-3),
            (60e-3, 0.0, 5e-3, 7e-3),
        ] {
            let at = |middle: f64, node: f64| middle + side * (node - 0.5);
            let integral: f64 = nodes
                .iter()
                .flat_map(|a| nodes.iter().map(move |b| (a, b)))
                .map(|(&(u, p), &(v, q))| p * q * side * side * pressure(at(x, u), at(y, v), depth))
                .sum();
            let closed = mass_below_point(x, y, side / 2.0, depth);
            assert!((closed - integral).abs() <= 1e-9 * integral + 1e-15, "({x}, {y}): {closed:e} {integral:e}");
            // Another depth is told apart.
            assert!((mass_below_point(x, y, side / 2.0, 1.01 * depth) - integral).abs() > 1e-4 * integral);
        }
    }

    #[test]
    fn all_of_a_force_is_felt_somewhere() {
        // Within ± x of the middle it is 1 but for the known tail: beyond a circle of radius r lies z³/(r² + z²)^(3/2).
        let tail = |r: f64, z: f64| z.powi(3) / (r * r + z * z).powf(1.5);
        for (half, depth) in [(0.05, 7e-3), (0.4, 7e-3), (10.0, 2e-3)] {
            let lost = 1.0 - mass_below_point(0.0, 0.0, half, depth);
            assert!(lost < tail(half, depth) + 1e-15 && lost > tail(half * 2.0_f64.sqrt(), depth) - 1e-15, "{lost:e}");
        }
    }
}
