//! footprint in lanes: eight touches abreast, each with the bits that it has alone; see [`crate::stage::footprint`].

use fearless_simd::prelude::*;
use fearless_simd::{f64x8, mask64x8};

use super::{Level, with_widest};
use crate::parallel;
use crate::stage::footprint::{Ends, Fits, Real, Sensor, Start, Touch, fit};

/// Touches side by side.
const ABREAST: usize = 8;
/// So many touches are fitted faster abreast than one after the other.
const FASTER_ABREAST: usize = 3;

/// Fits all kinds to each of `touches`, on all cores, and gives what `of` makes of each touch and its fits: none where it has too few
/// taxels for any.
pub(crate) fn fit_each<T: Send>(touches: &[&Touch], of: impl Fn(&Touch, Option<&Fits<f64>>) -> T + Sync) -> Vec<T> {
    each(Level::new(), touches, |index| touches[index].start(), of)
}

/// The same where descents were made elsewhere, and `ends` says of each touch where they ended.
pub(crate) fn judge_each<T: Send>(
    touches: &[&Touch],
    ends: &[Option<Ends<f64>>],
    of: impl Fn(&Touch, Option<&Fits<f64>>) -> T + Sync,
) -> Vec<T> {
    each(Level::new(), touches, |index| ends[index], of)
}

/// What a touch's fits are made of.
trait Origin: Copy + Send {
    /// The fits of up to eight touches, the last of which stands in for those that are not there.
    fn fits_abreast<S: Simd>(simd: S, sensors: &[Sensor<f64x8<S>>], of: [&Self; ABREAST]) -> Fits<f64x8<S>>;
    /// Those of one.
    fn fits(&self, sensors: &[Sensor<f64>]) -> Fits<f64>;
}

impl Origin for Start<f64> {
    #[inline(always)]
    fn fits_abreast<S: Simd>(simd: S, sensors: &[Sensor<f64x8<S>>], of: [&Self; ABREAST]) -> Fits<f64x8<S>> {
        fit(sensors, &Start::abreast(of, |numbers| f64x8::simd_from(simd, numbers)))
    }

    fn fits(&self, sensors: &[Sensor<f64>]) -> Fits<f64> {
        fit(sensors, self)
    }
}

impl Origin for Ends<f64> {
    #[inline(always)]
    fn fits_abreast<S: Simd>(simd: S, sensors: &[Sensor<f64x8<S>>], of: [&Self; ABREAST]) -> Fits<f64x8<S>> {
        Ends::abreast(of, |numbers| f64x8::simd_from(simd, numbers)).judged(sensors)
    }

    fn fits(&self, sensors: &[Sensor<f64>]) -> Fits<f64> {
        self.judged(sensors)
    }
}

fn each<O: Origin, T: Send>(
    level: Level,
    touches: &[&Touch],
    origin: impl Fn(usize) -> Option<O> + Sync,
    of: impl Fn(&Touch, Option<&Fits<f64>>) -> T + Sync,
) -> Vec<T> {
    if touches.len() < FASTER_ABREAST {
        let fits = |index: usize| origin(index).map(|origin| origin.fits(touches[index].sensors()));
        return touches.iter().enumerate().map(|(index, touch)| of(touch, fits(index).as_ref())).collect();
    }
    // Those with as many taxels side by side: the others wait for the one with most.
    let mut order: Vec<usize> = (0..touches.len()).collect();
    order.sort_by_key(|&index| (touches[index].is_long(), touches[index].sensors().len()));
    let mut made: Vec<Option<T>> = order.iter().map(|_| None).collect();
    let groups = order.chunks(ABREAST).zip(made.chunks_mut(ABREAST));
    parallel::for_each(parallel::threads().min(groups.len()), groups, |(group, made)| {
        let fitted: Vec<(usize, &Touch, O)> =
            group.iter().enumerate().filter_map(|(at, &index)| Some((at, touches[index], origin(index)?))).collect();
        if !fitted.is_empty() {
            let lanes = with_widest!(level, simd => abreast(simd, &fitted));
            for (&(at, touch, _), fits) in fitted.iter().zip(&lanes) {
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
fn abreast<S: Simd, O: Origin>(simd: S, group: &[(usize, &Touch, O)]) -> [Fits<f64>; ABREAST] {
    let lanes = |numbers: [f64; ABREAST]| f64x8::simd_from(simd, numbers);
    let of_lane = |lane: usize| &group[lane.min(group.len() - 1)];
    let most = group.iter().map(|(_, touch, _)| touch.sensors().len()).max().unwrap_or(0);
    let mut sensors = Vec::with_capacity(most);
    for index in 0..most {
        let of = std::array::from_fn(|lane| of_lane(lane).1.sensors().get(index).unwrap_or(&Sensor::NONE));
        sensors.push(Sensor::abreast(of, lanes));
    }
    let fits = O::fits_abreast(simd, &sensors, std::array::from_fn(|lane| &of_lane(lane).2));
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
    use super::super::lanes::levels;
    use super::*;
    use crate::percept::Footprint;
    use crate::stage::footprint::Layer;
    use crate::stage::footprint::made_up::{LAYER, touches};

    fn concluded(level: Level, touches: &[Touch]) -> Vec<Option<Footprint>> {
        each(
            level,
            &touches.iter().collect::<Vec<_>>(),
            |index| touches[index].start(),
            |touch, fits| touch.conclude(fits).0,
        )
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
