//! Presses whose pressure on the taxels is given: it falls off from a point or a line on the skin, as that under a layer does.
//!
//! Nothing is sunk into a layer to find the pressure, so that thousands of such presses cost what a few of an indenter do.

use std::f64::consts::TAU;

use glam::DVec3;

use super::super::noise;
use super::cells::{Cells, UNFELT};
use super::chart::{is_beside, unrolled};
use super::footprint::Footprint;
use super::indenter::{Pose, STEP_M, middle_line};
use super::press::{Felt, reached};
use super::surface::{Spot, WholeSurface};
use crate::body::{Body, area_vector};
use crate::signal::RawValue;

/// The pressure ends at this many standard deviations: 0.03 % of a point's force lie beyond.
const REACH_SIGMAS: f64 = 4.0;
/// Edges of the pieces of the surface, and distances of the points of a line, in standard deviations at most.
const PIECE_SIGMAS: f64 = 0.25;
const LINE_SIGMAS: f64 = 0.3;
/// A place of the skin belongs to a taxel at most this many sides of its cell away, if both face the same way to 60°.
const NEAR_SIDES: f64 = 1.2;
const NEAR_COSINE: f64 = 0.5;

/// The skin of a body at rest, as given presses press it.
pub struct GivenPresses {
    surface: WholeSurface,
    cells: Cells,
    ids: Vec<u32>,
    /// Area of the facets up to each, m².
    area_up_to_m2: Vec<f64>,
    sigma_m: f64,
}

/// Where, and how, it is pressed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenPress {
    /// Even numbers in [0, 1): they choose the place, anywhere on the surface with equal chances.
    pub chance: [f64; 3],
    /// The direction of a line, in turns from any direction in the tangent plane.
    pub turns: f64,
    /// Length of the line; 0 for a point, m.
    pub length_m: f64,
}

/// What is true of a press of 1 N, in the frame of the body at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenTruth {
    /// The surface point under pressure that is nearest to the mean of the pressure, m.
    pub position: DVec3,
    /// Smooth outward normal there.
    pub normal: DVec3,
    /// Of a line: unit vector along the pressure's second moments.
    pub principal_axis: Option<DVec3>,
}

/// Sensors of ten bits with noise.
pub struct NoisySensors {
    /// Standard deviation of the noise, as a share of a press's largest force on a taxel.
    pub noise: f64,
    /// What that largest force reads.
    pub steps: f64,
    /// Of the noise.
    pub seed: u64,
}

impl GivenPresses {
    /// The skin of `body`. `taxels` are those that feel it: their indices, and the sides of squares of their cells' area, m. The
    /// pressure falls off as a Gaussian with the standard deviation `sigma_m`.
    pub fn new(body: &Body, taxels: &[(usize, f64)], sigma_m: f64) -> Self {
        let surface = WholeSurface::new(body, PIECE_SIGMAS * sigma_m);
        let mut sum = 0.0;
        let area_up_to_m2 = surface.facets().map(|facet| {
            sum += area_vector(facet.corners).length() / 2.0;
            sum
        });
        Self {
            area_up_to_m2: area_up_to_m2.collect(),
            cells: Cells::new(body, taxels),
            ids: taxels.iter().map(|&(index, _)| body.taxels[index].id).collect(),
            surface,
            sigma_m,
        }
    }

    /// Presses with 1 N, and puts what each taxel feels in place of what `forces_newton` holds. `None` where there is no skin.
    pub fn press(&self, press: &GivenPress, forces_newton: &mut [f64]) -> Option<GivenTruth> {
        forces_newton.fill(0.0);
        let spot = self.spot(press.chance).filter(|spot| self.is_skin(spot))?;
        let normal = self.surface.smooth_normal(&spot);
        let ahead = normal.any_orthonormal_vector();
        let angle = TAU * press.turns;
        let along = ahead * libm::cos(angle) + normal.cross(ahead) * libm::sin(angle);
        let line = self.line(&Pose { spot, normal, along }, press.length_m);
        let felt = self.felt(&line);
        let Footprint { spot, normal, principal_axis, .. } = Footprint::new(&self.surface, &felt)?;
        for felt in felt.iter().filter(|felt| felt.piece.taxel != UNFELT) {
            forces_newton[felt.piece.taxel as usize] += felt.force_newton;
        }
        let principal_axis = principal_axis.filter(|_| line.len() > 1);
        Some(GivenTruth { position: spot.position, normal, principal_axis })
    }

    /// The place on the body at rest that `press` presses, if there is skin: a taxel near that faces the same way.
    pub fn skin_at(&self, press: &GivenPress) -> Option<DVec3> {
        self.spot(press.chance).filter(|spot| self.is_skin(spot)).map(|spot| spot.position)
    }

    /// What `sensors` read of `forces_newton` in press number `number`.
    pub fn read(&self, sensors: &NoisySensors, number: u64, forces_newton: &[f64]) -> Vec<RawValue> {
        let most = forces_newton.iter().copied().fold(0.0, f64::max);
        let of_taxel = |(&force, &id): (&f64, &u32)| {
            // Noise alone never leaves the dead band.
            if force <= 0.0 {
                return RawValue::new(0.0);
            }
            let value = force / most + sensors.noise * noise::normal(sensors.seed, number, id);
            RawValue::new((value * sensors.steps).round().clamp(0.0, 1023.0))
        };
        forces_newton.iter().zip(&self.ids).map(of_taxel).collect()
    }

    /// The place that `chance` chooses; `None` without a surface.
    fn spot(&self, [facet, a, b]: [f64; 3]) -> Option<Spot> {
        let whole = self.area_up_to_m2.last().filter(|area| **area > 0.0)?;
        let facet = self.area_up_to_m2.partition_point(|&area| area <= facet * whole);
        let facet = facet.min(self.area_up_to_m2.len() - 1);
        let at = self.surface.facet(facet);
        let (a, [p, q, r]) = (a.sqrt(), at.corners);
        let position = p * (1.0 - a) + q * (a * (1.0 - b)) + r * (a * b);
        Some(Spot { position, normal: at.normal, facet })
    }

    /// Whether a taxel is near that faces the same way.
    fn is_skin(&self, spot: &Spot) -> bool {
        self.cells.nearest(spot.position).is_some_and(|taxel| {
            taxel.position.distance(spot.position) <= NEAR_SIDES * taxel.side_m
                && taxel.normal.dot(spot.normal) >= NEAR_COSINE
        })
    }

    /// Points and directions along the surface through the place of `pose`, close enough together to stand for a line.
    fn line(&self, pose: &Pose, length_m: f64) -> Vec<(Spot, DVec3)> {
        let fine = middle_line(&self.surface, pose, length_m);
        let last = fine.len() - 1;
        let parts = (last as f64 * STEP_M / (LINE_SIGMAS * self.sigma_m)).ceil().max(1.0) as usize;
        let mut chosen: Vec<usize> = (0..=parts).map(|part| part * last / parts).collect();
        chosen.dedup();
        chosen.into_iter().map(|index| fine[index]).collect()
    }

    /// The force on each piece around `line`, 1 N in all.
    fn felt(&self, line: &[(Spot, DVec3)]) -> Vec<Felt> {
        let reach_m = REACH_SIGMAS * self.sigma_m;
        let near: Vec<DVec3> = line.iter().map(|(spot, _)| spot.position).collect();
        let apart_m = near.windows(2).map(|pair| pair[0].distance(pair[1])).fold(0.0, f64::max);
        let (_, tiles) = reached(&self.surface, line.iter().map(|(spot, _)| spot.facet), &near, reach_m);
        let (mut felt, mut whole) = (Vec::new(), 0.0);
        for (facet, tile) in tiles {
            let normal = self.surface.facet(facet).normal;
            let within_m = reach_m + tile.radius_m + apart_m;
            let beside: Vec<usize> = (0..line.len())
                .filter(|&point| {
                    is_beside(line[point].0.normal, normal)
                        && near[point].distance_squared(tile.middle) <= within_m * within_m
                })
                .collect();
            if beside.is_empty() {
                continue;
            }
            for piece in self.surface.pieces(facet, tile, &self.cells) {
                let away_m = self.away(line, &beside, apart_m, piece.middle, normal);
                if away_m <= reach_m {
                    let sigmas = away_m / self.sigma_m;
                    let force_newton = piece.area_m2 * libm::exp(-0.5 * sigmas * sigmas);
                    whole += force_newton;
                    felt.push(Felt { piece: *piece, facet, force_newton });
                }
            }
        }
        felt.iter_mut().for_each(|felt| felt.force_newton /= whole);
        felt
    }

    /// How far `p`, where the normal is `normal`, is from the points `beside` of `line` and what lies between them, along the surface.
    fn away(&self, line: &[(Spot, DVec3)], beside: &[usize], apart_m: f64, p: DVec3, normal: DVec3) -> f64 {
        let (last, mut least_m) = (line.len() - 1, f64::INFINITY);
        for &point in beside {
            let (spot, along) = &line[point];
            let offset = p - spot.position;
            // Straight, nothing is farther than along the surface.
            if (offset.length() - apart_m).max(0.0) >= least_m {
                continue;
            }
            let (back, front) =
                (if point == 0 { 0.0 } else { apart_m / 2.0 }, if point == last { 0.0 } else { apart_m / 2.0 });
            let flat = unrolled(offset, spot.normal, normal);
            let ahead = flat.dot(*along).clamp(-back, front);
            let straight_m = offset.length_squared() - flat.length_squared();
            // Never less than straight, as the surface may be a step of two parallel faces.
            let squared = (flat - *along * ahead).length_squared() + straight_m.max(0.0);
            least_m = least_m.min(squared.sqrt());
        }
        least_m
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::plane;
    use super::*;
    use crate::body::{Modality, Taxel};

    const SIGMA_M: f64 = 5e-3;

    fn presses() -> GivenPresses {
        let mut body = plane();
        let at = |step: u32| (f64::from(step) + 0.5) * 0.01 - 0.08;
        body.taxels = (0..256_u32)
            .map(|id| Taxel {
                id,
                link: 0,
                position_in_link: DVec3::new(at(id % 16), at(id / 16), 0.0),
                normal_in_link: DVec3::Z,
                area: 1e-4,
                modality: Modality::Pressure,
                tangent_in_link: None,
            })
            .collect();
        let taxels: Vec<(usize, f64)> = (0..body.taxels.len()).map(|taxel| (taxel, 0.01)).collect();
        GivenPresses::new(&body, &taxels, SIGMA_M)
    }

    /// Where a press in the middle of the plane is, and how wide along and across x.
    fn moments(length_m: f64) -> (DVec3, f64, f64, f64) {
        let skin = presses();
        let spot = Spot { position: DVec3::new(1e-3, 2e-3, 0.0), normal: DVec3::Z, facet: 0 };
        let spot = skin.surface.nearest(spot.position, DVec3::Z).unwrap();
        let felt = skin.felt(&skin.line(&Pose { spot, normal: DVec3::Z, along: DVec3::X }, length_m));
        let force: f64 = felt.iter().map(|felt| felt.force_newton).sum();
        let mean: DVec3 = felt.iter().map(|felt| felt.piece.middle * felt.force_newton).sum();
        let spread = |of: fn(DVec3) -> f64| -> f64 {
            felt.iter().map(|felt| of(felt.piece.middle - mean).powi(2) * felt.force_newton).sum()
        };
        (mean, force, spread(|p| p.x), spread(|p| p.y))
    }

    #[test]
    fn the_pressure_of_a_point_is_a_gaussian_around_it() {
        let (mean, force, along, across) = moments(0.0);
        assert!((force - 1.0).abs() < 1e-12 && mean.distance(DVec3::new(1e-3, 2e-3, 0.0)) < 2e-5, "{mean}");
        // What lies beyond four standard deviations takes 0.3 % of the variance.
        for spread in [along, across] {
            assert!((spread / (SIGMA_M * SIGMA_M) - 1.0).abs() < 0.01, "{spread:e}");
        }
    }

    #[test]
    fn a_line_is_as_wide_across_and_as_long_as_it_says() {
        let length_m = 0.04;
        let (mean, _, along, across) = moments(length_m);
        assert!(mean.distance(DVec3::new(1e-3, 2e-3, 0.0)) < 1e-4, "{mean}");
        assert!((across / (SIGMA_M * SIGMA_M) - 1.0).abs() < 0.02, "{across:e}");
        // A strip with round ends: weight √(2π)·σ·L of the strip, 2πσ² of the two ends together, as half discs.
        let (strip, ends) = (TAU.sqrt() * SIGMA_M * length_m, TAU * SIGMA_M * SIGMA_M);
        let (half, mean_of_half) = (length_m / 2.0, SIGMA_M * (4.0 / TAU).sqrt());
        let of_ends = half * half + 2.0 * half * mean_of_half + SIGMA_M * SIGMA_M;
        let wanted = (strip * length_m * length_m / 12.0 + ends * of_ends) / (strip + ends);
        assert!((along / wanted - 1.0).abs() < 0.02, "{along:e} {wanted:e}");
    }

    #[test]
    fn places_are_all_over_the_skin_and_never_off_it() {
        let (skin, mut forces) = (presses(), vec![0.0; 256]);
        let mut quarters = [0; 4];
        for index in 0..400_u32 {
            let even = |step: f64| (f64::from(index) * step).fract();
            let chance = [even(0.618_034), even(0.754_878), even(0.569_840)];
            let length_m = if index % 2 == 0 { 0.0 } else { 0.03 };
            let press = GivenPress { chance, turns: even(0.3), length_m };
            assert!(skin.skin_at(&press).is_some());
            let truth = skin.press(&press, &mut forces).unwrap();
            assert_eq!(truth.principal_axis.is_some(), length_m > 0.0);
            assert!(truth.position.z.abs() < 1e-9 && truth.position.abs().max_element() <= 0.08);
            assert!((forces.iter().sum::<f64>() - 1.0).abs() < 1e-9);
            quarters[usize::from(truth.position.x > 0.0) + 2 * usize::from(truth.position.y > 0.0)] += 1;
        }
        assert!(quarters.iter().all(|&count| (70..130).contains(&count)), "{quarters:?}");
    }

    #[test]
    fn sensors_read_in_steps_with_noise_that_a_seed_decides() {
        let skin = presses();
        let mut forces = vec![0.0; 256];
        let press = GivenPress { chance: [0.4, 0.5, 0.5], turns: 0.0, length_m: 0.0 };
        skin.press(&press, &mut forces).unwrap();
        let read = |seed: u64, noise: f64| skin.read(&NoisySensors { noise, steps: 800.0, seed }, 3, &forces);
        let largest = |values: &[RawValue]| values.iter().filter_map(|value| value.number()).fold(0.0, f64::max);
        assert_eq!(largest(&read(1, 0.0)), 800.0);
        assert_eq!(read(1, 0.015), read(1, 0.015));
        assert_ne!(read(1, 0.015), read(2, 0.015));
        assert!((largest(&read(1, 0.015)) - 800.0).abs() < 80.0);
        let untouched = forces.iter().position(|force| *force == 0.0).unwrap();
        assert_eq!(read(1, 0.015)[untouched], RawValue::new(0.0));
    }
}
