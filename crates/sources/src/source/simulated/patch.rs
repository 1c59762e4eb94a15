//! The contact patch under an indenter as loads: lines along it, or points, whose parts add up to 1.

use std::f64::consts::PI;

use super::layer::Blur;
use super::quadrature::gauss_legendre;

/// How the profile of the contact's pressure is modelled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) enum Pressure {
    /// As a Gaussian of the same variance, which the layer's is widened by.
    #[default]
    Gaussian,
    /// As it is: Hertz's, an ellipse across a rod and over a disc.
    Hertz,
}

/// A line load along the indenter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Load {
    pub(super) across_m: f64,
    pub(super) along_m: f64,
    /// Half its length; 0 for a point.
    pub(super) half_m: f64,
    pub(super) part: f64,
}

impl Load {
    /// All of the force on one line; on a point where it has no length.
    pub(super) fn line(half_m: f64) -> Vec<Self> {
        vec![Self { across_m: 0.0, along_m: 0.0, half_m, part: 1.0 }]
    }
}

/// Number of nodes over `size_m` for what the layer blurs by `scale_m`: `least`, and `each` per scale.
fn count(size_m: f64, scale_m: f64, least: f64, each: f64) -> u32 {
    (least + each * size_m / scale_m).ceil() as u32
}

/// The distance over which the layer smooths: the depth, or the depth at which Boussinesq's peak is the Gaussian's.
pub(super) fn scale_m(blur: Blur) -> f64 {
    3.0_f64.sqrt() * blur.sigma_m()
}

/// Hertz's pressure under a rod of half-width `half_across_m`: lines at Gauss's nodes for a weight of √(1 − x²).
pub(super) fn rod(half_across_m: f64, half_along_m: f64, scale_m: f64) -> Vec<Load> {
    let count = count(half_across_m, scale_m, 6.0, 8.0);
    let lines = (1..=count).map(|k| {
        let angle = PI * f64::from(k) / f64::from(count + 1);
        let sin = libm::sin(angle);
        let part = 2.0 * sin * sin / f64::from(count + 1);
        Load { across_m: half_across_m * libm::cos(angle), along_m: 0.0, half_m: half_along_m, part }
    });
    lines.collect()
}

/// Hertz's pressure over a disc, √(1 − r²/R²).
pub(super) fn dome(radius_m: f64, scale_m: f64) -> Vec<Load> {
    // With s = √(1 − r²/R²) the force within a ring is 3s² ds.
    rings(radius_m, scale_m, |s| ((1.0 - s * s).sqrt(), 3.0 * s * s))
}

/// Even pressure over a disc.
pub(super) fn disc(radius_m: f64, scale_m: f64) -> Vec<Load> {
    rings(radius_m, scale_m, |s| (s.sqrt(), 1.0))
}

/// Points on rings; `of` gives a ring's radius over that of the disc and its part, for Gauss's nodes from 0 to 1.
fn rings(radius_m: f64, scale_m: f64, of: impl Fn(f64) -> (f64, f64)) -> Vec<Load> {
    let round = 2 * count(radius_m, scale_m, 4.0, 6.0);
    let nodes = gauss_legendre(count(radius_m, scale_m, 4.0, 4.0));
    // Points of a ring in opposite pairs, turned from ring to ring.
    let points = nodes.iter().enumerate().flat_map(|(ring, &(node, weight))| {
        let (radius, part) = of(node);
        (0..round).map(move |k| {
            let turn = f64::from(k) + if ring % 2 == 0 { 0.25 } else { 0.75 };
            let angle = 2.0 * PI * turn / f64::from(round);
            Load {
                across_m: radius_m * radius * libm::cos(angle),
                along_m: radius_m * radius * libm::sin(angle),
                half_m: 0.0,
                part: weight * part / f64::from(round),
            }
        })
    });
    points.collect()
}

/// The lines of `loads` as points at Gauss's nodes.
pub(super) fn points(loads: Vec<Load>, scale_m: f64) -> Vec<Load> {
    let on_line = |load: Load| -> Vec<Load> {
        if load.half_m == 0.0 {
            return vec![load];
        }
        let nodes = gauss_legendre(count(load.half_m, scale_m, 6.0, 8.0));
        let point = |&(node, weight): &(f64, f64)| Load {
            along_m: load.along_m + load.half_m * (2.0 * node - 1.0),
            half_m: 0.0,
            part: load.part * weight,
            ..load
        };
        nodes.iter().map(point).collect()
    };
    loads.into_iter().flat_map(on_line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loads_have_the_force_and_the_variance_of_their_profile() {
        let radius = 3e-3;
        for scale in [1e-3, 7e-3] {
            let sum = |loads: &[Load], of: &dyn Fn(&Load) -> f64| -> f64 {
                loads.iter().map(|load| load.part * of(load)).sum()
            };
            let profiles = [
                (rod(radius, 0.02, scale), radius * radius / 4.0),
                (dome(radius, scale), radius * radius / 5.0),
                (disc(radius, scale), radius * radius / 4.0),
            ];
            for (loads, variance) in &profiles {
                assert!((sum(loads, &|_| 1.0) - 1.0).abs() < 1e-12);
                assert!(sum(loads, &|load| load.across_m).abs() < 1e-15);
                assert!((sum(loads, &|load| load.across_m.powi(2)) / variance - 1.0).abs() < 1e-9);
            }
            for (loads, variance) in &profiles[1..] {
                assert!((sum(loads, &|load| load.along_m.powi(2)) / variance - 1.0).abs() < 1e-9);
            }
            let along = points(profiles[0].0.clone(), scale);
            assert!((sum(&along, &|load| load.along_m.powi(2)) / (0.02 * 0.02 / 3.0) - 1.0).abs() < 1e-9);
        }
    }
}
