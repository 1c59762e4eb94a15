//! Layers that spread a point force alike in all directions, but not as a Gaussian.
//!
//! Lengths are in depths: the pressure at a distance r below a force F under a layer of thickness h is F·k(r/h)/h².

use std::f64::consts::PI;
use std::sync::OnceLock;

use super::quadrature::gauss_legendre;

/// How the pressure of a point force falls off with the distance from it, at the bottom of the layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Radial {
    /// In an elastic half-space, after Boussinesq: k = 3/2π(1 + r²)^(5/2).
    Boussinesq,
    /// k = exp(−√3·r)·3/2π: a sharp top and light tails.
    Exponential,
    /// In an incompressible elastic layer that is bonded to a rigid base.
    Bonded,
}

/// The rest of a bonded layer's pressure is not followed farther out than this many depths: a share of 10⁻⁸ of the peak.
const BONDED_REACH: f64 = 24.0;
/// Steps of the table of a bonded layer's pressure in a depth.
const STEPS_PER_DEPTH: usize = 32;
/// ∫ T(s)·s ds of a bonded layer.
const BONDED_INTEGRAL: f64 = 4.712_880_442_452_917;

/// Nodes and weights from −1 to 1 of Gauss and Legendre.
const NODES_3: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];
/// A square this many depths and more from the force is one cell, a nearer one has cells of half a depth.
const FAR: f64 = 4.0;

impl Radial {
    /// k(0).
    fn peak(self) -> f64 {
        match self {
            Self::Boussinesq | Self::Exponential => 1.5 / PI,
            Self::Bonded => BONDED_INTEGRAL / (2.0 * PI),
        }
    }

    /// The standard deviation, in depths, of the Gaussian with the same peak: 1/√3 but for a bonded layer, 0.461.
    pub(super) fn spread(self) -> f64 {
        1.0 / (2.0 * PI * self.peak()).sqrt()
    }

    /// How far from a force its pressure counts, in depths.
    pub(super) fn reach(self) -> f64 {
        match self {
            // A share of 4 · 10⁻⁶ of the force lies beyond.
            Self::Boussinesq => 64.0,
            Self::Exponential => 16.0,
            Self::Bonded => BONDED_REACH,
        }
    }

    /// The same where a few thousandths of a force may be lost, in depths: 0.1, 0.04 and 0.2 % lie beyond.
    pub(super) fn near_reach(self) -> f64 {
        match self {
            Self::Boussinesq => 10.0,
            Self::Exponential => 6.0,
            Self::Bonded => 8.0,
        }
    }

    /// k(r)/k(0).
    pub(super) fn fall(self, depths: f64) -> f64 {
        match self {
            Self::Boussinesq => {
                let slope = 1.0 / (1.0 + depths * depths);
                slope * slope * slope.sqrt()
            }
            Self::Exponential => libm::exp(-3.0_f64.sqrt() * depths),
            Self::Bonded => bonded(depths),
        }
    }

    /// What the square of ± `margin_m` about (`x_m`, `y_m`) feels of a force of 1 above the origin.
    pub(super) fn mass(self, x_m: f64, y_m: f64, margin_m: f64, depth_m: f64) -> f64 {
        if self == Self::Boussinesq {
            return below_point(x_m, y_m, margin_m, depth_m);
        }
        // On one side of each axis, so that nothing depends on the side.
        let (x, y, margin) = (x_m.abs() / depth_m, y_m.abs() / depth_m, margin_m / depth_m);
        let nearest = (x - margin).max(0.0).hypot((y - margin).max(0.0));
        if nearest > self.reach() {
            return 0.0;
        }
        let cells = if nearest > FAR { 1.0 } else { (4.0 * margin).ceil().max(1.0) };
        let half = margin / cells;
        let nodes = |middle: f64| {
            (0..cells as u32).flat_map(move |cell| {
                let at = middle - margin + half * (2.0 * f64::from(cell) + 1.0);
                NODES_3.map(|(node, weight)| (at + half * node, half * weight))
            })
        };
        let sum: f64 = nodes(x).map(|(u, p)| nodes(y).map(|(v, q)| p * q * self.fall(u.hypot(v))).sum::<f64>()).sum();
        sum * self.peak()
    }
}

/// T(s), what of a wave of pressure with the wave number s on top arrives at the rigid base:
/// (cosh s + s·sinh s)/(cosh² s + s²), from the plane strain of an incompressible layer whose base does not move.
fn arrives(s: f64) -> f64 {
    let (cosh, sinh) = (libm::cosh(s), libm::sinh(s));
    (cosh + s * sinh) / (cosh * cosh + s * s)
}

/// k(r)/k(0) of a bonded layer, k = ∫ T(s)·J₀(s·r)·s ds/2π, from a table with cubics between its steps.
fn bonded(depths: f64) -> f64 {
    static TABLE: OnceLock<Vec<f64>> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        /// Beyond this wave number nothing arrives: T·s is under 10⁻¹⁰.
        const MOST: u32 = 32;
        /// Parts of a wave number; the integrand is smooth enough for its nodes in each.
        const PARTS: u32 = 4;
        let nodes = gauss_legendre(8);
        let waves: Vec<(f64, f64)> = (0..MOST * PARTS)
            .flat_map(|part| nodes.iter().map(move |(node, weight)| (f64::from(part) + node, *weight)))
            .map(|(at, weight)| (at / f64::from(PARTS), weight / f64::from(PARTS)))
            .map(|(s, weight)| (s, weight * s * arrives(s)))
            .collect();
        let at = |step: usize| {
            let r = step as f64 / STEPS_PER_DEPTH as f64;
            waves.iter().map(|(s, part)| part * libm::j0(s * r)).sum::<f64>() / BONDED_INTEGRAL
        };
        (0..=BONDED_REACH as usize * STEPS_PER_DEPTH + 2).map(at).collect()
    });
    let at = depths * STEPS_PER_DEPTH as f64;
    let step = at as usize;
    if step + 2 >= table.len() {
        return 0.0;
    }
    // Lagrange's cubic through the four nearest; the pressure is even about 0.
    let [a, b, c, d] = [table[if step == 0 { 1 } else { step - 1 }], table[step], table[step + 1], table[step + 2]];
    let t = at - step as f64;
    let (before, after) = (t - 1.0, t - 2.0);
    (b * (t + 1.0) * before * after - c * (t + 1.0) * t * after) / 2.0
        + (d * (t + 1.0) * t * before - a * t * before * after) / 6.0
}

/// ∫∫ 3z³/2π(x² + y² + z²)^(5/2) over the square of ± `margin` about (x, y).
fn below_point(x: f64, y: f64, margin: f64, depth: f64) -> f64 {
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

    const ALL: [Radial; 3] = [Radial::Boussinesq, Radial::Exponential, Radial::Bonded];

    #[test]
    fn pressure_is_integrated_over_the_taxel() {
        let nodes = gauss_legendre(60);
        for (x, y, side, depth) in [
            (0.0, 0.0, 4e-3, 7e-3),
            (3e-3, -1e-3, 4e-3, 7e-3),
            (-20e-3, 11e-3, 10e-3, 4e-3),
            (2e-3, 2e-3, 4e-3, 2e-3),
            (60e-3, 0.0, 5e-3, 7e-3),
        ] {
            for kernel in ALL {
                let at = |middle: f64, node: f64| (middle + side * (node - 0.5)) / depth;
                let pressure = |u: f64, v: f64| kernel.peak() * kernel.fall(u.hypot(v)) / (depth * depth);
                let integral: f64 = nodes
                    .iter()
                    .flat_map(|a| nodes.iter().map(move |b| (a, b)))
                    .map(|(&(u, p), &(v, q))| p * q * side * side * pressure(at(x, u), at(y, v)))
                    .sum();
                let got = kernel.mass(x, y, side / 2.0, depth);
                let within =
                    if kernel == Radial::Boussinesq { 1e-9 * integral + 1e-15 } else { 2e-3 * integral + 1e-7 };
                assert!((got - integral).abs() <= within, "{kernel:?} ({x}, {y}): {got:e} {integral:e}");
                // Where much is felt, another depth makes a difference.
                let other = kernel.mass(x, y, side / 2.0, 1.15 * depth);
                assert!(integral < 1e-4 || (other - integral).abs() > within, "{kernel:?} ({x}, {y})");
            }
        }
    }

    #[test]
    fn all_of_a_force_is_felt_somewhere() {
        // Within ± x of the middle it is 1 but for the known tail: beyond a circle of radius r lies z³/(r² + z²)^(3/2).
        let tail = |r: f64, z: f64| z.powi(3) / (r * r + z * z).powf(1.5);
        for (half, depth) in [(0.05, 7e-3), (0.4, 7e-3), (10.0, 2e-3)] {
            let lost = 1.0 - Radial::Boussinesq.mass(0.0, 0.0, half, depth);
            assert!(lost < tail(half, depth) + 1e-15 && lost > tail(half * 2.0_f64.sqrt(), depth) - 1e-15, "{lost:e}");
        }
        for kernel in [Radial::Exponential, Radial::Bonded] {
            let (pitch, depth) = (3e-3, 4e-3);
            let at = |i: i32| 0.3 * pitch + f64::from(i) * pitch;
            let tiles = (-34..=33).flat_map(|i| (-34..=33).map(move |j| (at(i), at(j))));
            let sum: f64 = tiles.map(|(x, y)| kernel.mass(x, y, pitch / 2.0, depth)).sum();
            assert!((sum - 1.0).abs() < 1e-3, "{kernel:?}: {sum}");
        }
    }

    #[test]
    fn a_bonded_layers_table_is_its_integral() {
        // By another rule: Simpson's, with many small steps.
        let k = |r: f64| {
            let (steps, most) = (40_000_u32, 40.0);
            let value = |i: u32| {
                let s = most * f64::from(i) / f64::from(steps);
                let weight = if i == 0 || i == steps { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
                weight * s * arrives(s) * libm::j0(s * r)
            };
            (0..=steps).map(value).sum::<f64>() * most / f64::from(steps) / 3.0
        };
        assert!((k(0.0) / BONDED_INTEGRAL - 1.0).abs() < 1e-9);
        for r in [0.0, 0.01, 0.37, 0.9, 1.5, 3.3, 7.7] {
            // A cubic between four steps h apart is off by h⁴/43 of the fourth derivative, which is about 150 near 0.
            assert!((bonded(r) - k(r) / k(0.0)).abs() < 5e-6, "{r}: {} {}", bonded(r), k(r) / k(0.0));
        }
        // A thin layer passes all of a long wave, and nothing of a short one.
        assert!((arrives(0.0) - 1.0).abs() < 1e-15 && arrives(30.0) < 1e-11);
    }

    #[test]
    fn a_gaussian_of_the_spread_has_the_same_peak() {
        for kernel in ALL {
            let (side, depth) = (1e-5, 5e-3);
            let sigma = kernel.spread() * depth;
            let peak = kernel.mass(0.0, 0.0, side / 2.0, depth) / (side * side);
            assert!((peak * 2.0 * PI * sigma * sigma - 1.0).abs() < 2e-3, "{kernel:?}");
        }
    }
}
