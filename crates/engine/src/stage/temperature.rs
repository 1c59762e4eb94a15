//! Temperature: how warm a field is, where it is warmest and coldest, how that changes over it and over time.
//!
//! Over the taxels that have a reading, at x (u and v of the chart) with weight w and temperature T: the mean Σ wT/Σ w; the
//! highest and the lowest T, of equal ones that of the lowest id; the gradient, by least squares of T − T̄ on x − x̄ with the
//! weights, absent for under three taxels and for taxels in a line; the rate, [`super::window`] over the mean.
//!
//! This stage is the host's, in f64 of raw values, so that it gives the same bits on every backend.

use glam::DVec2;

/// A taxel that has a reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Warm {
    pub(crate) weight: f64,
    pub(crate) celsius: f64,
    /// In the field's chart, m.
    pub(crate) place_m: DVec2,
}

/// Share of the longer axis that the taxels' spread has across it, squared, under which they lie in a line.
const IN_A_LINE: f64 = 1e-6;

/// Σ wT/Σ w, °C; `taxels` is not empty.
pub(crate) fn mean(taxels: &[Warm]) -> f64 {
    mean_of(taxels.iter().map(|taxel| [taxel.weight, taxel.celsius])).unwrap_or_default()
}

/// The same of weights and temperatures, if there are any.
pub(crate) fn mean_of(taxels: impl Iterator<Item = [f64; 2]>) -> Option<f64> {
    let [sum, weights] =
        taxels.fold([0.0; 2], |[sum, weights], [weight, celsius]| [sum + weight * celsius, weights + weight]);
    (weights > 0.0).then(|| sum / weights)
}

/// The taxel that is first by `goes_before` of two temperatures; the earlier of equal ones.
pub(crate) fn extreme(taxels: &[Warm], goes_before: impl Fn(f64, f64) -> bool) -> Option<usize> {
    let first = |best: usize, next: usize| {
        if goes_before(taxels[next].celsius, taxels[best].celsius) { next } else { best }
    };
    (0..taxels.len()).reduce(first)
}

/// K/m along u and v.
pub(crate) fn gradient(taxels: &[Warm]) -> Option<DVec2> {
    let weights: f64 = taxels.iter().map(|taxel| taxel.weight).sum();
    let middle = taxels.iter().map(|taxel| taxel.weight * taxel.place_m).sum::<DVec2>() / weights;
    let mean = mean(taxels);
    let [mut uu, mut uv, mut vv] = [0.0; 3];
    let mut right = DVec2::ZERO;
    for taxel in taxels {
        let x = taxel.place_m - middle;
        uu += taxel.weight * x.x * x.x;
        uv += taxel.weight * x.x * x.y;
        vv += taxel.weight * x.y * x.y;
        right += taxel.weight * (taxel.celsius - mean) * x;
    }
    let (trace, determinant) = (uu + vv, uu * vv - uv * uv);
    // λ₂/λ₁ is about det/trace² where it is small.
    let is_spread = taxels.len() >= 3 && determinant > IN_A_LINE * trace * trace;
    is_spread.then(|| DVec2::new(vv * right.x - uv * right.y, uu * right.y - uv * right.x) / determinant)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(u: f64, v: f64, celsius: f64) -> Warm {
        Warm { weight: 1.0, celsius, place_m: DVec2::new(u, v) }
    }

    #[test]
    fn a_plane_of_temperatures_has_its_gradient_whatever_the_weights() {
        let plane = |u: f64, v: f64| 30.0 + 200.0 * u - 50.0 * v;
        let places = [(0.0, 0.0), (0.01, 0.002), (-0.003, 0.008), (0.004, -0.006), (0.009, 0.009)];
        let taxels: Vec<Warm> = places
            .iter()
            .zip(1..)
            .map(|(&(u, v), weight)| Warm { weight: weight.into(), ..at(u, v, plane(u, v)) })
            .collect();
        let found = gradient(&taxels).unwrap();
        assert!((found - DVec2::new(200.0, -50.0)).length() < 1e-9, "{found}");
    }

    #[test]
    fn few_taxels_and_taxels_in_a_line_have_no_gradient() {
        assert_eq!(gradient(&[at(0.0, 0.0, 20.0), at(0.01, 0.0, 21.0)]), None);
        let line: Vec<Warm> = (0..5).map(|i| at(0.01 * f64::from(i), 0.02 * f64::from(i), f64::from(i))).collect();
        assert_eq!(gradient(&line), None);
        // One that stands 1 % aside is enough.
        let mut bent = line;
        bent.push(at(0.0, 0.0005, 9.0));
        assert!(gradient(&bent).is_some());
    }

    #[test]
    fn extremes_are_the_first_of_equal_ones() {
        let taxels = [at(0.0, 0.0, 20.0), at(0.1, 0.0, 25.0), at(0.2, 0.0, 25.0), at(0.3, 0.0, 20.0)];
        assert_eq!(extreme(&taxels, |a, b| a > b), Some(1));
        assert_eq!(extreme(&taxels, |a, b| a < b), Some(0));
        assert_eq!(mean(&taxels), 22.5);
        assert_eq!(extreme(&[], |a, b| a > b), None);
    }
}
