//! footprint in lanes: eight touches abreast, each with the bits that it has alone; see [`crate::stage::footprint`].

use fearless_simd::prelude::*;
use fearless_simd::{f64x8, mask64x8};

use super::{Level, with_widest};
use crate::parallel;
use crate::stage::footprint::{Fits, Real, Sensor, Start, Touch, fit};

/// Touches side by side.
const ABREAST: usize = 8;
/// So many touches are fitted faster abreast than one after the other.
const FASTER_ABREAST: usize = 3;

/// Fits all kinds to each of `touches`, on all cores, and gives what `of` makes of each touch and its fits: none where it has too few
/// taxels for any.
pub(crate) fn fit_each<T: Send>(touches: &[&Touch], of: impl Fn(&Touch, Option<&Fits<f64>>) -> T + Sync) -> Vec<T> {
    fit_each_with(Level::new(), touches, of)
}

fn fit_each_with<T: Send>(
    level: Level,
    touches: &[&Touch],
    of: impl Fn(&Touch, Option<&Fits<f64>>) -> T + Sync,
) -> Vec<T> {
    if touches.len() < FASTER_ABREAST {
        let fitted = |touch: &&Touch| touch.start().map(|start| fit(touch.sensors(), &start));
        return touches.iter().map(|touch| of(touch, fitted(touch).as_ref())).collect();
    }
    // Those with as many taxels side by side: the others wait for the one with most.
    let mut order: Vec<usize> = (0..touches.len()).collect();
    order.sort_by_key(|&index| (touches[index].is_long(), touches[index].sensors().len()));
    let mut made: Vec<Option<T>> = order.iter().map(|_| None).collect();
    let groups = order.chunks(ABREAST).zip(made.chunks_mut(ABREAST));
    parallel::for_each(parallel::threads().min(groups.len()), groups, |(group, made)| {
        let started: Vec<(usize, &Touch, Start<f64>)> = group
            .iter()
            .enumerate()
            .filter_map(|(at, &index)| Some((at, touches[index], touches[index].start()?)))
            .collect();
        if !started.is_empty() {
            let lanes = with_widest!(level, simd => abreast(simd, &started));
            for (&(at, touch, _), fits) in started.iter().zip(&lanes) {
                made[at] = Some(of(touch, Some(fits)));
            }
        }
        for (&index, made) in group.iter().zip(made) {
            made.get_or_insert_with(|| of(touches[index], None));
        }
    });
    let mut places: Vec<usize> = vec![0; order.len()];
    order.iter().enumerate().for_each(|(at, &index)| places[index] = at);
    places.into_iter().filter_map(|at| made[at].take()).collect()
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
    fn ln(self) -> Self {
        Self::simd_from(self.simd, std::array::from_fn(|lane| libm::log(self[lane])))
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
    use crate::percept::Footprint;
    use crate::stage::footprint::{Layer, Taxel};

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

    fn concluded(level: Level, touches: &[Touch]) -> Vec<Option<Footprint>> {
        fit_each_with(level, &touches.iter().collect::<Vec<_>>(), |touch, fits| touch.conclude(fits).0)
    }

    #[test]
    fn lanes_have_the_bits_of_one_touch_alone_on_every_level() {
        let touches = touches(LAYER);
        let alone = |touch: &Touch| {
            let fits = touch.start().map(|start| fit(touch.sensors(), &start));
            touch.conclude(fits.as_ref()).0
        };
        let right: Vec<_> = touches.iter().map(alone).collect();
        assert!(right.iter().flatten().count() > 40, "{}", right.iter().flatten().count());
        for level in levels() {
            assert_eq!(concluded(level, &touches), right, "{level:?}");
        }
        // Negative control: another layer has other bits.
        let others = self::touches(Layer { sigma_m: 2.000_001e-3, ..LAYER });
        assert_ne!(concluded(Level::new(), &others), right);
    }
}
