//! Shear: how a touch pulls along the skin, of taxels that measure force along three axes.
//!
//! Over the pressed taxels, at x in the chart with weight w, normal part P > 0 and tangential force s = sᵤ t + sᵥ n × t: the sum
//! s = Σ wᵢsᵢ, along u and v of the chart and as a vector in space; its direction; the torsion Σ wᵢ(xᵢ − c) × sᵢ · n about the
//! centroid c = Σ wPx/Σ wP; the friction ‖s‖/Σ wP, along the chart where there is one; and the force on the skin,
//! Σ Aᵢ(−Pᵢnᵢ + sᵢ) with A = 1 where P is in N. A tangent comes into the chart by the smallest turn that takes its taxel's normal to
//! the chart's, so that no length is lost, as a sum in space loses it where the skin is curved.
//!
//! This stage is the host's, in f64 of raw values, so that it gives the same bits on every backend.
//!
//! **Sigma.** With σₛ and σₚ the standard deviations of s along its own direction and of Σ wP, both of independent noise, that of
//! the friction f is √(σₛ² + f²σₚ²)/Σ wP.

use glam::{DVec2, DVec3};

/// A pressed taxel with its tangential force.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pulled {
    pub(crate) weight: f64,
    /// P > 0.
    pub(crate) pressure: f64,
    /// Along u and v of the chart.
    pub(crate) shear: DVec2,
    /// In space.
    pub(crate) shear_in_space: DVec3,
    /// In space, outward.
    pub(crate) normal: DVec3,
    /// In the field's chart, m.
    pub(crate) place_m: DVec2,
    /// N for each unit of P, where that is known.
    pub(crate) newtons_per_p: Option<f64>,
    /// Standard deviations of P and of a tangential force, where the noise is known.
    pub(crate) sigmas: Option<[f64; 2]>,
}

/// What a field's shear is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Shear {
    pub(crate) along_chart: DVec2,
    pub(crate) in_space: DVec3,
    /// Absent where nothing pulls.
    pub(crate) direction: Option<f64>,
    pub(crate) torsion: f64,
    pub(crate) friction: f64,
    pub(crate) friction_sigma: Option<f64>,
    /// N, where it is known.
    pub(crate) force: Option<DVec3>,
}

/// The share of Σ w‖s‖ under which a sum is the rounding of its terms, and has no direction.
pub(crate) const ROUNDING: f64 = 1e-12;

/// What is right of a field, which has a chart if it is `charted`; `taxels` is not empty.
pub(crate) fn reference(taxels: &[Pulled], charted: bool) -> Shear {
    let pull: f64 = taxels.iter().map(|taxel| taxel.weight * taxel.pressure).sum();
    let along_chart: DVec2 = taxels.iter().map(|taxel| taxel.weight * taxel.shear).sum();
    let in_space: DVec3 = taxels.iter().map(|taxel| taxel.weight * taxel.shear_in_space).sum();
    let size: f64 = taxels.iter().map(|taxel| taxel.weight * taxel.shear.length()).sum();
    let centroid = taxels.iter().map(|taxel| taxel.weight * taxel.pressure * taxel.place_m).sum::<DVec2>() / pull;
    let torsion = taxels.iter().map(|taxel| taxel.weight * (taxel.place_m - centroid).perp_dot(taxel.shear)).sum();
    let friction = if charted { along_chart.length() } else { in_space.length() } / pull;
    let force = taxels.iter().try_fold(DVec3::ZERO, |sum, taxel| {
        Some(sum + taxel.newtons_per_p? * (taxel.shear_in_space - taxel.pressure * taxel.normal))
    });
    let variances = taxels.iter().try_fold([0.0; 2], |[of_pull, of_shear], taxel| {
        let [pressure, shear] = taxel.sigmas?.map(|sigma| (taxel.weight * sigma).powi(2));
        Some([of_pull + pressure, of_shear + shear])
    });
    Shear {
        along_chart,
        in_space,
        direction: (along_chart.length() > ROUNDING * size).then(|| along_chart.to_angle()),
        torsion,
        friction,
        friction_sigma: variances.map(|[of_pull, of_shear]| (of_shear + friction.powi(2) * of_pull).sqrt() / pull),
        force,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(u: f64, v: f64, pressure: f64, shear: [f64; 2]) -> Pulled {
        let [x, y] = shear;
        Pulled {
            weight: 1.0,
            pressure,
            shear: DVec2::from_array(shear),
            shear_in_space: DVec3::new(x, y, 0.0),
            normal: DVec3::Z,
            place_m: DVec2::new(u, v),
            newtons_per_p: Some(1.0),
            sigmas: Some([0.1, 0.2]),
        }
    }

    #[test]
    fn a_drag_has_its_direction_and_no_torsion() {
        let taxels = [at(0.0, 0.0, 2.0, [0.6, 0.8]), at(0.01, 0.0, 2.0, [0.6, 0.8])];
        let shear = reference(&taxels, true);
        assert!((shear.along_chart - DVec2::new(1.2, 1.6)).length() < 1e-15);
        assert!((shear.direction.unwrap() - 0.8_f64.atan2(0.6)).abs() < 1e-15);
        assert!(shear.torsion.abs() < 1e-15 && (shear.friction - 0.5).abs() < 1e-15);
        assert!((shear.force.unwrap() - DVec3::new(1.2, 1.6, -4.0)).length() < 1e-15);
        // σₛ² = 2 · 0.04, σₚ² = 2 · 0.01.
        let sigma = (0.08_f64 + 0.25 * 0.02).sqrt() / 4.0;
        assert!((shear.friction_sigma.unwrap() - sigma).abs() < 1e-15);
    }

    #[test]
    fn a_twist_has_a_torsion_by_its_sense_and_no_direction() {
        let ring = |sense: f64| {
            let corner = |i: i32| {
                let angle = f64::from(i) * std::f64::consts::FRAC_PI_2;
                let (sin, cos) = angle.sin_cos();
                at(0.01 * cos, 0.01 * sin, 1.0, [-sense * sin, sense * cos])
            };
            reference(&(0..4).map(corner).collect::<Vec<_>>(), true)
        };
        let left = ring(1.0);
        assert!((left.torsion - 0.04).abs() < 1e-15 && (ring(-1.0).torsion + 0.04).abs() < 1e-15);
        assert!(left.direction.is_none() && left.friction < 1e-15);
    }

    #[test]
    fn what_is_not_known_of_a_taxel_is_not_known_of_the_sum() {
        let taxels = [
            at(0.0, 0.0, 2.0, [0.6, 0.8]),
            Pulled { newtons_per_p: None, sigmas: None, ..at(0.01, 0.0, 2.0, [0.6, 0.8]) },
        ];
        let shear = reference(&taxels, true);
        assert!(shear.force.is_none() && shear.friction_sigma.is_none() && shear.direction.is_some());
    }

    #[test]
    fn a_drag_around_a_limb_has_the_friction_of_each_of_its_taxels() {
        let tilted = |turn: f64| Pulled {
            shear_in_space: DVec3::new(turn.cos(), 0.0, -turn.sin()),
            normal: DVec3::new(turn.sin(), 0.0, turn.cos()),
            ..at(0.03 * turn, 0.0, 2.0, [1.0, 0.0])
        };
        let taxels = [tilted(-1.0), tilted(0.0), tilted(1.0)];
        assert!((reference(&taxels, true).friction - 0.5).abs() < 1e-15);
        // Without a chart it is that of what is left in space.
        let left = (1.0 + 2.0 * 1.0_f64.cos()) / 6.0;
        assert!((reference(&taxels, false).friction - left).abs() < 1e-15 && left < 0.4);
    }
}
