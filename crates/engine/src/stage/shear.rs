//! Shear: how a touch pulls along the skin, of taxels that measure force along three axes.
//!
//! Over the pressed taxels, at x in the chart with weight w, normal part P > 0 and tangential force s = sᵤ t + sᵥ n × t: the sum
//! s = Σ wᵢsᵢ, along u and v of the chart and as a vector in space; its direction; the torsion Σ wᵢ(xᵢ − c) × sᵢ · n about the
//! centroid c = Σ wPx/Σ wP; the friction ‖s‖/Σ wP along the chart, and without a chart Σ w‖sᵢ‖/Σ wP, as a sum in space gets shorter
//! where the skin is curved; and the force on the skin, Σ Aᵢ(−Pᵢnᵢ + sᵢ) with A = 1 where P is in N. A taxel whose s is not known is in
//! none of these but the force, with its normal part. A tangent comes into the chart by the smallest turn that takes its taxel's normal to
//! the chart's, so that no length is lost, as a sum in space loses it where the skin is curved.
//!
//! This stage is the host's, in f64 of raw values, so that it gives the same bits on every backend. Each sum goes over the taxels once,
//! the torsion as Σ wx × s − c × Σ ws, and sums in space are turned into the world link by link.
//!
//! **Sigma.** A taxel's s along a direction e, that of the sum in the chart or without a chart its own, is e·C(P, u, v)ᵀ = aₚP + aᵤu + aᵥv,
//! with C its `cross_axis` and u and v its tangential values. With σₚ and σ the standard deviations of P and of u and v, all of independent
//! noise, that of the friction f is √(Σ w²((aₚ − f)²σₚ² + aᵤ²σᵤ² + aᵥ²σᵥ²))/Σ wP. Where P has bᵤu + bᵥv in it, by a third row of
//! `cross_axis`, noise of P and of u goes together: then aᵤ(aᵤ + 2(aₚ − f)bᵤ) is in the place of aᵤ², and that of v alike.

use glam::{DVec2, DVec3};

use super::U;
use super::calibrate::{self, Table};
use super::tangential::{Sides, Tangential};
use crate::signal::{RawValue, ShearCalibration, TaxelCalibration};

/// A pressed taxel with three axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pulled<'a> {
    pub(crate) weight: f64,
    /// P > 0.
    pub(crate) pressure: f64,
    /// s, where it is known.
    pub(crate) felt: Option<Tangential>,
    /// t and n × t along u and v of the chart.
    pub(crate) tangents_in_chart: &'a [DVec2; 2],
    /// t and n × t in space.
    pub(crate) tangents: &'a [DVec3; 2],
    /// In space, outward.
    pub(crate) normal: DVec3,
    /// In the field's chart, m.
    pub(crate) place_m: DVec2,
    /// N for each unit of P, where that is known.
    pub(crate) newtons_per_p: Option<f64>,
}

/// What a field's shear is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sums {
    taxels: usize,
    /// Taxels whose tangential forces are not known.
    normal_only: usize,
    /// Σ wP.
    pub(crate) pull: f64,
    /// Σ ws along u and v of the chart.
    pub(crate) along_chart: DVec2,
    /// Σ wPx, and Σ wx × s · n.
    moment: DVec2,
    turn: f64,
    /// Σ w of what each s is made of: what the sums' rounding is a share of.
    size: f64,
    /// Σ w‖s‖.
    lengths: f64,
    space: InSpace,
}

/// The sums that are vectors in space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct InSpace {
    shear: DVec3,
    force: DVec3,
    /// For some taxel the force is not known.
    lacks_force: bool,
}

impl Sums {
    /// Adds a taxel; one whose tangential force is not known with its normal part alone, to the force.
    #[inline]
    pub(crate) fn add(&mut self, taxel: &Pulled<'_>) {
        let in_space = match &taxel.felt {
            Some(felt) => self.add_felt(taxel, felt),
            None => {
                self.normal_only += 1;
                DVec3::ZERO
            }
        };
        match taxel.newtons_per_p {
            Some(newtons) => self.space.force += newtons * (in_space - taxel.pressure * taxel.normal),
            None => self.space.lacks_force = true,
        }
    }

    /// Adds what a taxel feels along the skin; gives that as a vector in space.
    #[inline]
    fn add_felt(&mut self, taxel: &Pulled<'_>, felt: &Tangential) -> DVec3 {
        let &Pulled { weight, pressure, tangents_in_chart, tangents, place_m, .. } = taxel;
        let [along, across] = felt.forces;
        let pull = weight * pressure;
        let along_chart = weight * (along * tangents_in_chart[0] + across * tangents_in_chart[1]);
        let in_space = along * tangents[0] + across * tangents[1];
        self.taxels += 1;
        self.pull += pull;
        self.along_chart += along_chart;
        self.moment += pull * place_m;
        self.turn += place_m.perp_dot(along_chart);
        self.size += weight * felt.size;
        self.lengths += weight * DVec2::from_array(felt.forces).length();
        self.space.shear += weight * in_space;
        in_space
    }

    /// Whether any taxel is in it, also with its normal part alone.
    pub(crate) fn is_pressed(&self) -> bool {
        self.taxels + self.normal_only > 0
    }

    /// Whether one taxel alone is pressed.
    pub(crate) fn is_one_taxel(&self) -> bool {
        self.taxels + self.normal_only == 1
    }

    /// Takes in what `other` sums up, whose space `turn` turns into this one's.
    pub(crate) fn join(&mut self, other: &Self, turn: impl Fn(DVec3) -> DVec3) {
        self.taxels += other.taxels;
        self.normal_only += other.normal_only;
        self.pull += other.pull;
        self.along_chart += other.along_chart;
        self.moment += other.moment;
        self.turn += other.turn;
        self.size += other.size;
        self.lengths += other.lengths;
        self.space.shear += turn(other.space.shear);
        self.space.force += turn(other.space.force);
        self.space.lacks_force |= other.space.lacks_force;
    }

    /// Σ ws in space.
    pub(crate) fn in_space(&self) -> DVec3 {
        self.space.shear
    }

    /// N, where it is known.
    pub(crate) fn force(&self) -> Option<DVec3> {
        (!self.space.lacks_force).then_some(self.space.force)
    }

    /// Of Σ ws in the chart; absent where nothing pulls: up to what raw values' own rounding to single precision may make of it.
    pub(crate) fn direction(&self) -> Option<f64> {
        let DVec2 { x, y } = self.along_chart;
        (self.along_chart.length() > U * self.size).then(|| libm::atan2(y + 0.0, x + 0.0))
    }

    /// Absent where that of one taxel is known: it has no arm.
    pub(crate) fn torsion(&self) -> Option<f64> {
        (self.taxels > 1).then(|| self.turn - (self.moment / self.pull).perp_dot(self.along_chart))
    }

    /// In the chart if there is one, which is `charted`.
    pub(crate) fn friction(&self, charted: bool) -> f64 {
        let length = if charted { self.along_chart.length() } else { self.lengths };
        length / self.pull
    }

    /// The standard deviation of that friction, from all the `taxels` whose s is known; `None` where the noise of one is not known.
    pub(crate) fn friction_sigma<'a>(
        &self,
        charted: bool,
        by: &ShearCalibration,
        mut taxels: impl Iterator<Item = Option<Noisy<'a>>>,
    ) -> Option<f64> {
        let (friction, direction) = (self.friction(charted), self.along_chart.normalize_or(DVec2::X));
        let variance = taxels.try_fold(0.0, |sum, taxel| {
            let Noisy { weight, felt, noise, tangents_in_chart } = taxel?;
            // Without a chart, each along its own direction; where nothing pulls, every direction is as good.
            let along = match charted {
                true => tangents_in_chart.map(|tangent| tangent.dot(direction)),
                false => DVec2::from_array(felt.forces).normalize_or(DVec2::X).to_array(),
            };
            Some(sum + weight.powi(2) * noise.variance(by, along, friction))
        })?;
        Some(variance.sqrt() / self.pull)
    }
}

/// A taxel whose s is known, and the noise of what it is made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noisy<'a> {
    pub(crate) weight: f64,
    pub(crate) felt: Tangential,
    pub(crate) noise: Noise,
    /// As of [`Pulled`].
    pub(crate) tangents_in_chart: &'a [DVec2; 2],
}

/// The noise of a taxel's raw values, in the unit of P.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    /// Standard deviation of P.
    pub(crate) of_pressure: f64,
    /// Of gᵤu and of gᵥv.
    pub(crate) of_sides: [f64; 2],
}

impl Noise {
    /// Of the raw value `normal`, calibrated so, and of the `sides`; `None` where it is not known.
    pub(crate) fn of(
        normal: RawValue,
        (calibration, curve): (&TaxelCalibration, Table<'_>),
        sides: &Sides,
    ) -> Option<Self> {
        let of_pressure = calibrate::sigma(normal.number()?, calibration.noise?, calibration, curve);
        Some(Self { of_pressure, of_sides: sides.noise()? })
    }

    /// The variance of what a taxel adds to (ΣwP) f, for a weight of 1 and the friction f: `along` are its t and n × t along the direction
    /// of Σ ws.
    fn variance(self, by: &ShearCalibration, along: [f64; 2], friction: f64) -> f64 {
        let [of_p, of_u, of_v] = [0, 1, 2].map(|of| along[0] * by.cross_axis[0][of] + along[1] * by.cross_axis[1][of]);
        let ([_, into_u, into_v], of_p) = (by.into_normal, of_p - friction);
        // What of u and v is in P has its part in σₚ already.
        let of_side = |of: f64, into: f64, noise: f64| of * (of + 2.0 * of_p * into) * noise.powi(2);
        let sides = of_side(of_u, into_u, self.of_sides[0]) + of_side(of_v, into_v, self.of_sides[1]);
        ((of_p * self.of_pressure).powi(2) + sides).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANE: ([DVec2; 2], [DVec3; 2]) = ([DVec2::X, DVec2::Y], [DVec3::X, DVec3::Y]);

    fn at(u: f64, v: f64, pressure: f64, shear: [f64; 2]) -> Pulled<'static> {
        Pulled {
            weight: 1.0,
            pressure,
            felt: Some(Tangential { forces: shear, size: shear[0].abs() + shear[1].abs() }),
            tangents_in_chart: &PLANE.0,
            tangents: &PLANE.1,
            normal: DVec3::Z,
            place_m: DVec2::new(u, v),
            newtons_per_p: Some(1.0),
        }
    }

    fn sums_of(taxels: &[Pulled<'_>]) -> Sums {
        let mut sums = Sums::default();
        taxels.iter().for_each(|taxel| sums.add(taxel));
        sums
    }

    #[test]
    fn a_drag_has_its_direction_and_no_torsion() {
        let sums = sums_of(&[at(0.0, 0.0, 2.0, [0.6, 0.8]), at(0.01, 0.0, 2.0, [0.6, 0.8])]);
        assert!((sums.along_chart - DVec2::new(1.2, 1.6)).length() < 1e-15);
        assert!((sums.direction().unwrap() - 0.8_f64.atan2(0.6)).abs() < 1e-15);
        assert!(sums.torsion().unwrap().abs() < 1e-15 && (sums.friction(true) - 0.5).abs() < 1e-15);
        assert!((sums.force().unwrap() - DVec3::new(1.2, 1.6, -4.0)).length() < 1e-15);
    }

    #[test]
    fn a_twist_has_a_torsion_by_its_sense_and_no_direction() {
        // About a middle that is not the chart's.
        let ring = |sense: f64| {
            let corner = |i: i32| {
                let angle = f64::from(i) * std::f64::consts::FRAC_PI_2;
                let (sin, cos) = angle.sin_cos();
                at(0.3 + 0.01 * cos, 0.01 * sin - 0.2, 1.0, [-sense * sin, sense * cos])
            };
            sums_of(&(0..4).map(corner).collect::<Vec<_>>())
        };
        let left = ring(1.0);
        assert!((left.torsion().unwrap() - 0.04).abs() < 1e-15 && (ring(-1.0).torsion().unwrap() + 0.04).abs() < 1e-15);
        assert!(left.direction().is_none() && left.friction(true) < 1e-15);
    }

    #[test]
    fn noise_goes_through_what_mixes_the_axes() {
        let noise = Noise { of_pressure: 0.1, of_sides: [0.2, 0.3] };
        let plain = ShearCalibration::default();
        for (along, of_sides) in [([1.0, 0.0], 0.04), ([0.6, 0.8], 0.36 * 0.04 + 0.64 * 0.09)] {
            assert!((noise.variance(&plain, along, 0.5) - (of_sides + 0.25 * 0.01)).abs() < 1e-15);
        }
        // P leaks into s as much as the friction is: what P strays does not matter.
        let leaking = ShearCalibration { cross_axis: [[0.5, 5.0, 0.0], [0.0, 0.0, 5.0]], ..plain };
        assert!((noise.variance(&leaking, [1.0, 0.0], 0.5) - 25.0 * 0.04).abs() < 1e-15);
        assert!((noise.variance(&leaking, [0.0, 1.0], 0.5) - (25.0 * 0.09 + 0.25 * 0.01)).abs() < 1e-15);
    }

    #[test]
    fn noise_that_p_and_the_sides_share_counts_once() {
        // P = 2N + u/2 − v and s = (0.3N + u + 0.2v, 0.1u + 1.5v), of N, u and v with noise of their own.
        let matrix = [[2.0, 0.5, -1.0], [0.3, 1.0, 0.2], [0.0, 0.1, 1.5]];
        let of_p = |row: [f64; 3]| [row[0] / 2.0, row[1] - row[0] * 0.25, row[2] + row[0] * 0.5];
        let by = ShearCalibration {
            into_normal: matrix[0],
            cross_axis: [of_p(matrix[1]), of_p(matrix[2])],
            ..ShearCalibration::default()
        };
        let (own, along, friction) = ([0.1, 0.2, 0.3], [0.6, 0.8], 0.7);
        let squares = |shares: [f64; 3]| (0..3).map(|of| (shares[of] * own[of]).powi(2)).sum::<f64>();
        let noise = Noise { of_pressure: squares(matrix[0]).sqrt(), of_sides: [own[1], own[2]] };
        let pulled = [0, 1, 2].map(|of| 0.6 * matrix[1][of] + 0.8 * matrix[2][of] - friction * matrix[0][of]);
        assert!((noise.variance(&by, along, friction) - squares(pulled)).abs() < 1e-12);
    }

    #[test]
    fn parts_are_turned_and_joined() {
        let (one, other) = (at(0.0, 0.0, 2.0, [0.6, 0.8]), at(0.01, 0.02, 1.0, [0.3, -0.1]));
        let mut sums = Sums::default();
        sums.join(&sums_of(&[one]), |vector| DVec3::new(-vector.y, vector.x, vector.z));
        sums.join(&sums_of(&[other]), |vector| vector);
        assert!((sums.in_space() - DVec3::new(-0.8 + 0.3, 0.6 - 0.1, 0.0)).length() < 1e-15);
        assert!((sums.force().unwrap() - DVec3::new(-0.5, 0.5, -3.0)).length() < 1e-15);
        let whole = sums_of(&[one, other]);
        assert!(
            (sums.torsion().unwrap() - whole.torsion().unwrap()).abs() < 1e-15 && sums.along_chart == whole.along_chart
        );
    }

    #[test]
    fn what_is_not_known_of_a_taxel_is_not_known_of_the_sum() {
        let taxels = [at(0.0, 0.0, 2.0, [0.6, 0.8]), Pulled { newtons_per_p: None, ..at(0.01, 0.0, 2.0, [0.6, 0.8]) }];
        let sums = sums_of(&taxels);
        assert!(sums.force().is_none() && sums.direction().is_some());
        let mut half_known = sums_of(&taxels[..1]);
        half_known.add(&Pulled { felt: None, ..at(0.02, 0.0, 3.0, [9.0, 9.0]) });
        assert!((half_known.force().unwrap() - DVec3::new(0.6, 0.8, -5.0)).length() < 1e-15 && half_known.pull == 2.0);
        assert!(sums_of(&taxels[..1]).torsion().is_none(), "one taxel has no arm");
    }

    #[test]
    fn a_drag_around_a_limb_has_the_friction_of_each_of_its_taxels() {
        let turns = [-1.0, 0.0, 1.0_f64];
        let tangents = turns.map(|turn| [DVec3::new(turn.cos(), 0.0, -turn.sin()), DVec3::Y]);
        let tilted = |(turn, tangents)| Pulled { tangents, ..at(0.03 * turn, 0.0, 2.0, [1.0, 0.0]) };
        let sums = sums_of(&turns.into_iter().zip(&tangents).map(tilted).collect::<Vec<_>>());
        assert!((sums.friction(true) - 0.5).abs() < 1e-15);
        // Without a chart, too: of what pulls, less than 0.4 of what presses is left in space.
        assert!((sums.friction(false) - 0.5).abs() < 1e-15 && sums.in_space().length() < 0.4 * sums.pull);
    }
}
