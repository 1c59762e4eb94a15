//! fit in lanes: eight touches abreast, each with the bits that it has alone; see [`crate::stage::fit`].

use fearless_simd::prelude::*;
use fearless_simd::{f64x8, mask64x8};

use super::Level;
use crate::parallel;
use crate::stage::fit::{Fits, Real, Sensor, Start, Touch, fit, fit_alone};

/// Touches side by side.
const ABREAST: usize = 8;
/// So many touches are fitted faster abreast than one after the other.
const FASTER_ABREAST: usize = 3;

/// Fits all kinds to each of `touches`, on all cores, and gives what `of` makes of each touch and its fits: none where it has too few
/// taxels for any.
pub(crate) fn fit_each<T: Send>(touches: &[&Touch], of: impl Fn(&Touch, Option<&Fits<f64>>) -> T + Sync) -> Vec<T> {
    each(Level::new(), touches, of)
}

/// A touch that can be fitted.
struct Startable<'a> {
    /// Its place in the group.
    at: usize,
    touch: &'a Touch,
    start: Start<f64>,
}

fn each<T: Send>(level: Level, touches: &[&Touch], of: impl Fn(&Touch, Option<&Fits<f64>>) -> T + Sync) -> Vec<T> {
    if touches.len() < FASTER_ABREAST {
        let fits = |touch: &Touch| touch.start().map(|start| fit_alone(touch.sensors(), &start));
        return touches.iter().map(|touch| of(touch, fits(touch).as_ref())).collect();
    }
    // Those with as many taxels side by side: the others wait for the one with most.
    let mut order: Vec<usize> = (0..touches.len()).collect();
    order.sort_by_key(|&index| (touches[index].is_long(), touches[index].sensors().len()));
    let mut made: Vec<Option<T>> = order.iter().map(|_| None).collect();
    let groups = order.chunks(ABREAST).zip(made.chunks_mut(ABREAST));
    parallel::for_each(parallel::threads().min(groups.len()), groups, |(group, made)| {
        let startable = |(at, &index): (usize, &usize)| {
            touches[index].start().map(|start| Startable { at, touch: touches[index], start })
        };
        let group_startable: Vec<Startable<'_>> = group.iter().enumerate().filter_map(startable).collect();
        for (&Startable { at, touch, .. }, fits) in group_startable.iter().zip(fits_of(level, &group_startable)) {
            made[at] = Some(of(touch, Some(&fits)));
        }
        for (&index, made) in group.iter().zip(made) {
            made.get_or_insert_with(|| of(touches[index], None));
        }
    });
    let mut places: Vec<usize> = vec![0; order.len()];
    order.iter().enumerate().for_each(|(at, &index)| places[index] = at);
    places.into_iter().filter_map(|at| made[at].take()).collect()
}

/// The fits of up to eight touches, with the widest instructions that there are. The fit is compiled here and in [`fit_alone`] only: it
/// is a tenth of the library's code. SSE2 gains nothing from lanes of eight: a touch alone has the same bits.
#[inline(never)]
fn fits_of(level: Level, group: &[Startable<'_>]) -> Vec<Fits<f64>> {
    if group.is_empty() {
        return Vec::new();
    }
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = level.as_avx512() {
        simd.vectorize(
            #[inline(always)]
            || abreast(simd, group),
        )
    } else if let Some(simd) = level.as_avx2() {
        simd.vectorize(
            #[inline(always)]
            || abreast(simd, group),
        )
    } else {
        group.iter().map(|startable| fit_alone(startable.touch.sensors(), &startable.start)).collect()
    }
    #[cfg(not(target_arch = "x86_64"))]
    fearless_simd::dispatch!(level, simd => abreast(simd, group))
}

/// The same in lanes; the last touch stands in for those that are not there.
#[inline(always)]
fn abreast<S: Simd>(simd: S, group: &[Startable<'_>]) -> Vec<Fits<f64>> {
    let lanes = |numbers: [f64; ABREAST]| f64x8::simd_from(simd, numbers);
    let of_lane = |lane: usize| &group[lane.min(group.len() - 1)];
    let most = group.iter().map(|startable| startable.touch.sensors().len()).max().unwrap_or(0);
    let mut sensors = Vec::with_capacity(most);
    for index in 0..most {
        let abreast = std::array::from_fn(|lane| of_lane(lane).touch.sensors().get(index).unwrap_or(&Sensor::NONE));
        sensors.push(Sensor::abreast(abreast, lanes));
    }
    let start = Start::abreast(std::array::from_fn(|lane| &of_lane(lane).start), lanes);
    let fits = fit(&sensors, &start);
    (0..group.len()).map(|lane| fits.map(|numbers| numbers[lane])).collect()
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
    use super::super::lanes::levels;
    use super::*;
    use crate::stage::fit::made_up::{LAYER, touches};
    use crate::stage::fit::{Fit, Layer};

    fn concluded(level: Level, touches: &[Touch]) -> Vec<Option<Fit>> {
        each(level, &touches.iter().collect::<Vec<_>>(), |touch, fits| touch.conclude(fits).0)
    }

    #[test]
    fn lanes_have_the_bits_of_one_touch_alone_on_every_level() {
        let made_up = touches(LAYER);
        let alone = |touch: &Touch| {
            let fits = touch.start().map(|start| fit(touch.sensors(), &start));
            touch.conclude(fits.as_ref()).0
        };
        let right: Vec<_> = made_up.iter().map(alone).collect();
        assert!(right.iter().flatten().count() > 40, "{}", right.iter().flatten().count());
        for level in levels() {
            assert_eq!(concluded(level, &made_up), right, "{level:?}");
        }
        // Negative control: another layer has other bits.
        let others = touches(Layer { sigma_m: 2.000_001e-3, ..LAYER });
        assert_ne!(concluded(Level::new(), &others), right);
    }
}
