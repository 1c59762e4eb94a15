//! Touches for tests.

use glam::DVec2;

use super::{Layer, Pull, Taxel, Touch};

pub(crate) const LAYER: Layer = Layer { sigma_m: 2e-3, gain_spread: 0.05, reach_m: 4e-3, steps: 6 };

/// Touches of all sizes, round and long, on a grid of 5 mm.
pub(crate) fn touches(layer: Layer) -> Vec<Touch> {
    let touch = |number: i32| {
        let wide = 3e-3 + 1e-4 * f64::from(number % 40);
        let long = wide * (1.0 + 0.1 * f64::from(number % 17));
        let (sin, cos) = (0.3 * f64::from(number)).sin_cos();
        let taxel = |i: i32, j: i32| {
            let place_m = DVec2::new(f64::from(i), f64::from(j)) * 5e-3;
            let from = place_m - DVec2::new(1e-3, -0.5e-3);
            let (x, y) = (from.x * cos + from.y * sin, from.y * cos - from.x * sin);
            let pressure = (-0.5 * (x * x / (long * long) + y * y / (wide * wide))).exp();
            let pressure = if pressure > 0.02 { pressure } else { 0.0 };
            let pull = Pull { weight: 1.0, less: 0.0 };
            Taxel { place_m, area_m2: 2.5e-5, pressure, threshold: 0.02, sigma: Some(2e-3), gain_spread: None, pull }
        };
        let taxels: Vec<Taxel> = (-5..=5).flat_map(|i| (-5..=5).map(move |j| taxel(i, j))).collect();
        Touch::new(&taxels, &layer)
    };
    (0..61).map(touch).collect()
}
