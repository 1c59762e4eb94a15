//! Where a touch is: the fit's place and the moments', weighted by the inverse squares of their errors.
//!
//! Let c be the weighted mean of a touch's taxels in its chart, f the place of the fit, mᵢ what the fit makes taxel i feel, qᵢ its weight
//! in the mean and D = f − c. The mean of what the fit makes the same taxels feel lies at
//!
//! c' = Σ qᵢmᵢxᵢ / Σ qᵢmᵢ
//!
//! so the moments are off by b = c' − f for want of sensors: beyond a rim, between coarse or scattered sensors, under a dead band. Noise
//! and gains add to that
//!
//! V = Σ (qᵢ(xᵢ − c)/Σ qP)² (σᵢ² + (g·Pᵢ)²)
//!
//! The place is c + t·D with t = (V + b²)/(V + b² + S), where S is the fit's variance; V, b² and S are sums over both directions of the
//! chart. Of a line the fit knows only the place across: only that is blended.
//!
//! Both errors come of the same noise, so their standard deviations add up: t·√S + (1 − t)·√(V + b² + L), for each direction. L is what
//! the layer may change of b, V with the kind's floor in the place of σ. It has no part in t: it would draw places on quiet sensors to the
//! fit, whose own error is mostly the layer's.

use glam::DVec2;

use super::touch::Touch;

/// Where a touch is in its chart, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    pub(crate) place: [f64; 2],
    /// Standard deviation along u and v, where the noise of the sensors is known.
    pub(crate) sigma: Option<[f64; 2]>,
}

/// What a fit says of the place, in units of the fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlaceOfFit<'a> {
    /// What it makes the taxels feel, as shares of the touch's largest pressure.
    pub(super) felt: &'a [f64],
    pub(super) place: DVec2,
    /// Along u and v.
    pub(super) variance: DVec2,
    /// What it may be off by at any taxel, as a share of the largest pressure.
    pub(super) floor: f64,
    /// The direction of a line.
    pub(super) line: Option<DVec2>,
}

/// A weighted mean.
#[derive(Clone, Copy, Debug)]
struct Mean {
    place: DVec2,
    total: f64,
}

impl Mean {
    /// The mean of places, each with its pull as weight.
    fn from_pulls(pulls: impl Iterator<Item = (DVec2, f64)>) -> Self {
        let (mut sum, mut total) = (DVec2::ZERO, 0.0);
        for (at, pull) in pulls {
            sum += at * pull;
            total += pull;
        }
        Self { place: sum / total, total }
    }
}

impl Touch {
    /// The place of `fitted` and that of the moments as one; `None` if the moments have none.
    pub(super) fn blended(&self, fitted: PlaceOfFit<'_>) -> Option<Place> {
        let own = || self.sensors().iter().zip(&self.pulls).zip(fitted.felt);
        let own = || own().filter(|((sensor, pull), _)| sensor.pressed > 0.0 && pull.weight > 0.0);
        let at = |sensor: &super::Sensor<f64>| DVec2::from_array(sensor.at);
        let found = Mean::from_pulls(own().map(|((sensor, pull), _)| (at(sensor), pull.weighted(sensor.pressure))));
        let expected = Mean::from_pulls(own().map(|((sensor, pull), felt)| (at(sensor), pull.weighted(*felt))));
        if !(found.total > 0.0 && expected.total > 0.0) {
            return None;
        }
        let along = fitted.line.unwrap_or(DVec2::Y);
        let directions = [DVec2::new(along.y, -along.x), along];
        let bias = expected.place - fitted.place;
        let mut of_moments = directions.map(|direction| bias.dot(direction).powi(2));
        let mut of_layer = [0.0; 2];
        for ((sensor, pull), _) in own() {
            let variance = sensor.variance + self.gain_variance() * sensor.pressure * sensor.pressure;
            let slope = (at(sensor) - found.place) * (pull.weight / found.total);
            for k in 0..2 {
                let squared = slope.dot(directions[k]).powi(2);
                of_moments[k] += squared * variance;
                of_layer[k] += squared * fitted.floor * fitted.floor;
            }
        }
        let of_fit = directions.map(|direction| fitted.variance.dot(direction * direction));
        let share = |moments: f64, fit: f64| if moments + fit > 0.0 { moments / (moments + fit) } else { 0.0 };
        let to_fit = if fitted.line.is_some() {
            // Of a bias along a line nothing is known.
            of_moments[1] -= bias.dot(along).powi(2);
            [share(of_moments[0], of_fit[0]), 0.0]
        } else {
            [share(of_moments[0] + of_moments[1], of_fit[0] + of_fit[1]); 2]
        };
        let apart = fitted.place - found.place;
        let (mut place, mut variance) = (found.place, DVec2::ZERO);
        for k in 0..2 {
            place += directions[k] * (to_fit[k] * apart.dot(directions[k]));
            let sigma = to_fit[k] * of_fit[k].sqrt() + (1.0 - to_fit[k]) * (of_moments[k] + of_layer[k]).sqrt();
            variance += directions[k] * directions[k] * (sigma * sigma);
        }
        let sigma = variance.map(f64::sqrt) * self.unit_m;
        Some(Place {
            place: (place * self.unit_m + self.origin).to_array(),
            sigma: self.has_noise.then_some(sigma.to_array()),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stage::fit::{Layer, Pull, Taxel};

    const UNIT_M: f64 = 2e-3;

    /// Taxels on a square grid of 5 mm, pressed by a Gaussian of 4 mm at `at_m` where that is over 2 %; `cut` has the first column.
    fn touch(at_m: DVec2, cut: i32, noise: Option<f64>) -> (Touch, Vec<f64>) {
        let felt = |place_m: DVec2| (-0.5 * place_m.distance_squared(at_m) / 16e-6).exp();
        let taxel = |i: i32, j: i32| {
            let place_m = DVec2::new(f64::from(i), f64::from(j)) * 5e-3;
            let pressure = if felt(place_m) > 0.02 { felt(place_m) } else { 0.0 };
            let pull = Pull { weight: 1.0, less: 0.0 };
            Taxel { place_m, area_m2: 2.5e-5, pressure, threshold: 0.02, sigma: noise, gain_spread: None, pull }
        };
        let taxels: Vec<Taxel> = (cut..=4).flat_map(|i| (-4..=4).map(move |j| taxel(i, j))).collect();
        let peak = taxels.iter().map(|taxel| taxel.pressure).fold(0.0, f64::max);
        let layer = Layer { sigma_m: UNIT_M, gain_spread: 0.0, reach_m: 4e-3, steps: 6 };
        (Touch::new(&taxels, &layer), taxels.iter().map(|taxel| felt(taxel.place_m) / peak).collect())
    }

    fn blended(touch: &Touch, felt: &[f64], place_m: DVec2, variance: f64, line: Option<DVec2>) -> Place {
        let place = (place_m - touch.origin) / UNIT_M;
        let fitted = PlaceOfFit { felt, place, variance: DVec2::splat(variance), floor: 0.01, line };
        touch.blended(fitted).unwrap()
    }

    #[test]
    fn places_are_the_moments_where_these_are_right_and_the_fits_at_a_rim() {
        let at_m = DVec2::new(0.7e-3, -1.1e-3);
        // A fit that is 0.1 mm off and 0.1 mm sure.
        let (fit_m, variance) = (at_m + DVec2::new(1e-4, 0.0), (1e-4 / UNIT_M).powi(2));
        let off = |cut: i32| {
            let (touch, felt) = touch(at_m, cut, Some(1e-4));
            let place = DVec2::from_array(blended(&touch, &felt, fit_m, variance, None).place);
            (place.distance(at_m), touch.origin.distance(at_m))
        };
        let (inside, moments) = off(-4);
        // What the threshold leaves of the moments.
        assert!(moments < 6e-5 && inside < moments + 3e-5, "{inside} {moments}");
        let (at_rim, moments) = off(0);
        assert!(moments > 1.4e-3 && at_rim < 1.2e-4, "{at_rim} {moments}");
    }

    #[test]
    fn of_a_line_only_the_place_across_is_blended() {
        let (touch, felt) = touch(DVec2::ZERO, 0, Some(1e-4));
        let along = DVec2::new(0.6, 0.8);
        let fit_m = DVec2::new(3e-3, 2e-3);
        let place = DVec2::from_array(blended(&touch, &felt, fit_m, 1e-6, Some(along)).place);
        let moved = place - touch.origin;
        assert!(moved.dot(along).abs() < 1e-12 && moved.length() > 1e-4, "{moved}");
    }

    #[test]
    fn how_sure_a_place_is_hangs_on_the_noise() {
        let sigma = |noise: Option<f64>| {
            let (touch, felt) = touch(DVec2::new(0.7e-3, -1.1e-3), -4, noise);
            blended(&touch, &felt, DVec2::new(0.7e-3, -1.1e-3), 1e3, None).sigma
        };
        assert_eq!(sigma(None), None);
        let [quiet, loud] = [1e-3, 0.1].map(|noise| sigma(Some(noise)).unwrap());
        // The floor of 1 % alone, Σ(0.01·slope)², on quiet sensors.
        assert!(quiet[0] > 2e-5 && loud[0] > 2.0 * quiet[0] && loud[1] > 2.0 * quiet[1], "{quiet:?} {loud:?}");
    }

    #[test]
    fn taxels_of_other_touches_do_not_pull() {
        let (mut touch, felt) = touch(DVec2::ZERO, -4, Some(1e-3));
        let all = blended(&touch, &felt, DVec2::ZERO, 1e3, None);
        for (sensor, pull) in touch.sensors().to_vec().iter().zip(&mut touch.pulls) {
            pull.weight = if sensor.at[0] > 0.1 { 0.0 } else { 1.0 };
        }
        let half = blended(&touch, &felt, DVec2::ZERO, 1e3, None);
        assert!(all.place[0].abs() < 1e-9 && half.place[0] < -1e-3, "{all:?} {half:?}");
    }
}
