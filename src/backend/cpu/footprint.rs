//! footprint in lanes: eight touches abreast, each with the bits that it has alone; see [`crate::stage::footprint`].

use std::sync::Mutex;

use fearless_simd::prelude::*;
use fearless_simd::{f64x8, mask64x8};

use super::{Level, with_widest};
use crate::parallel;
use crate::stage::footprint::{Fits, Real, Sensor, Start, Touch, fit};

/// Touches side by side.
const ABREAST: usize = 8;
/// So many touches are fitted faster abreast than one after the other.
const FASTER_ABREAST: usize = 3;

/// Of each of `touches` the fits of all kinds; none where it has too few taxels for any.
pub(crate) fn fit_all(touches: &[&Touch]) -> Vec<Option<Fits<f64>>> {
    fit_all_with(Level::new(), touches)
}

pub(crate) fn fit_all_with(level: Level, touches: &[&Touch]) -> Vec<Option<Fits<f64>>> {
    let mut started: Vec<(usize, &Touch, Start<f64>)> =
        touches.iter().enumerate().filter_map(|(index, touch)| Some((index, *touch, touch.start()?))).collect();
    let mut fits: Vec<Option<Fits<f64>>> = touches.iter().map(|_| None).collect();
    if started.len() < FASTER_ABREAST {
        for (index, touch, start) in started {
            fits[index] = Some(fit(touch.sensors(), &start));
        }
        return fits;
    }
    // Those with as many taxels side by side: the others wait for the one with most.
    started.sort_by_key(|(_, touch, start)| (start.is_long, touch.sensors().len()));
    let groups = started.len().div_ceil(ABREAST);
    let made = Mutex::new(&mut fits);
    parallel::for_each(parallel::threads().min(groups), started.chunks(ABREAST), |group| {
        let lanes = with_widest!(level, simd => abreast(simd, group));
        if let Ok(mut fits) = made.lock() {
            group.iter().zip(lanes).for_each(|((index, ..), lane)| fits[*index] = Some(lane));
        }
    });
    fits
}

/// The fits of up to eight touches.
#[inline(always)]
fn abreast<S: Simd>(simd: S, group: &[(usize, &Touch, Start<f64>)]) -> [Fits<f64>; ABREAST] {
    let lanes = |numbers: [f64; ABREAST]| f64x8::simd_from(simd, numbers);
    let of_lane = |lane: usize| &group[lane.min(group.len() - 1)];
    let most = group.iter().map(|(_, touch, _)| touch.sensors().len()).max().unwrap_or(0);
    let mut sensors = Vec::with_capacity(most);
    for index in 0..most {
        let of = std::array::from_fn(|lane| of_lane(lane).1.sensors().get(index).unwrap_or(&Sensor::NONE));
        sensors.push(Sensor::abreast(of, lanes));
    }
    let start = Start::abreast(std::array::from_fn(|lane| &of_lane(lane).2), lanes);
    let fits = fit(&sensors, &start);
    std::array::from_fn(|lane| fits.map(|numbers| numbers[lane]))
}

impl<S: Simd> Real for f64x8<S> {
    type Mask = mask64x8<S>;

    #[inline(always)]
    fn all(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.simd.sqrt_f64x8(self)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.simd.abs_f64x8(self)
    }

    #[inline(always)]
    fn is_below(self, other: Self) -> Self::Mask {
        self.simd_lt(other)
    }

    #[inline(always)]
    fn choose(mask: Self::Mask, yes: Self, no: Self) -> Self {
        mask.select(yes, no)
    }

    #[inline(always)]
    fn power_of_two(self) -> Self {
        Self::from_bits((self + <f64 as Real>::POWERS).to_bits() << 52)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::super::lanes::levels;
    use super::*;
    use crate::stage::footprint::{Footprint, Layer, Taxel};

    const LAYER: Layer = Layer { sigma_m: 2e-3, gain_spread: 0.05, reach_m: 4e-3, steps: 6 };

    /// Touches of all sizes, round and long, on a grid of 5 mm.
    fn touches(layer: Layer) -> Vec<Touch> {
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
                Taxel { place_m, area_m2: 2.5e-5, pressure, threshold: 0.02, sigma: Some(2e-3) }
            };
            let taxels: Vec<Taxel> = (-5..=5).flat_map(|i| (-5..=5).map(move |j| taxel(i, j))).collect();
            Touch::new(&taxels, &layer)
        };
        (0..61).map(touch).collect()
    }

    fn concluded(touches: &[Touch], fits: &[Option<Fits<f64>>]) -> Vec<Option<Footprint>> {
        touches.iter().zip(fits).map(|(touch, fits)| touch.conclude(fits.as_ref()).0).collect()
    }

    #[test]
    fn lanes_have_the_bits_of_one_touch_alone_on_every_level() {
        let touches = touches(LAYER);
        let borrowed: Vec<&Touch> = touches.iter().collect();
        let alone: Vec<_> =
            touches.iter().map(|touch| touch.start().map(|start| fit(touch.sensors(), &start))).collect();
        let right = concluded(&touches, &alone);
        assert!(right.iter().flatten().count() > 40, "{}", right.iter().flatten().count());
        for level in levels() {
            assert_eq!(concluded(&touches, &fit_all_with(level, &borrowed)), right, "{level:?}");
        }
        // Negative control: another layer has other bits.
        let others = self::touches(Layer { sigma_m: 2.000_001e-3, ..LAYER });
        assert_ne!(concluded(&others, &fit_all(&others.iter().collect::<Vec<_>>())), right);
    }
}
