//! The objective: how badly a contact explains a touch's sensors, and the normal equations of its next improvement.

use super::kinds::{Contact, Kind};
use super::real::Real;
use super::shape::{Parameter, Shape};

/// A taxel, in units of the fit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sensor<R> {
    pub(crate) at: [R; 2],
    /// Half a side of a square of its area.
    pub(crate) margin: R,
    /// P; of one that is not pressed its threshold.
    pub(crate) pressure: R,
    /// σ², of P or at the threshold.
    pub(crate) variance: R,
    /// 1 if it is pressed, else 0.
    pub(crate) pressed: R,
}

impl Sensor<f64> {
    /// What says nothing.
    pub(crate) const NONE: Self = Self { at: [0.0; 2], margin: 1.0, pressure: f64::MAX, variance: 1.0, pressed: 0.0 };
}

impl<R> Sensor<R> {
    /// Several side by side, of numbers that `lanes` puts side by side.
    #[inline(always)]
    pub(crate) fn abreast<const N: usize>(sensors: [&Sensor<f64>; N], lanes: impl Fn([f64; N]) -> R) -> Self {
        Self {
            at: [lanes(sensors.map(|sensor| sensor.at[0])), lanes(sensors.map(|sensor| sensor.at[1]))],
            margin: lanes(sensors.map(|sensor| sensor.margin)),
            pressure: lanes(sensors.map(|sensor| sensor.pressure)),
            variance: lanes(sensors.map(|sensor| sensor.variance)),
            pressed: lanes(sensors.map(|sensor| sensor.pressed)),
        }
    }
}

/// A contact's spread is about this many times the layer's σ, by the prior.
pub(crate) const USUAL_WIDTH: f64 = 1.2;
/// The standard deviation of its logarithm there.
const WIDTH_VARIES: f64 = 0.3;

/// χ² and the prior at a shape, with the lower half of A = JᵀJ, and g = Jᵀr.
#[derive(Clone, Copy)]
pub(crate) struct Objective<R, const K: usize> {
    /// Σr², the prior's included.
    pub(crate) cost: R,
    /// Σr² of the sensors alone.
    pub(crate) chi_squared: R,
    pub(crate) a: [[R; K]; K],
    pub(crate) g: [R; K],
}

impl<R: Real, const K: usize> Objective<R, K> {
    /// Of no sensors and no prior.
    #[inline(always)]
    pub(super) fn none(zero: R) -> Self {
        Self { cost: zero, chi_squared: zero, a: [[zero; K]; K], g: [zero; K] }
    }

    /// The objective of kind M at `shape`; gains vary with `gain_variance`.
    #[inline(always)]
    pub(crate) fn at<M: Kind<K>>(sensors: &[Sensor<R>], gain_variance: R, shape: &Shape<R>) -> Self {
        let (zero, one) = (shape.force.all(0.0), shape.force.all(1.0));
        let mut sum = Self::none(zero);
        let contact = Contact::from_shape(shape);
        for sensor in sensors {
            let (felt, by) = M::felt(&contact, sensor.at, sensor.margin);
            let off = felt - sensor.pressure;
            // One that is not pressed says only that it feels no more than its threshold.
            let over = R::choose(zero.is_below(off), one, zero);
            let counts = R::choose(zero.is_below(sensor.pressed), one, over);
            // r = (m − P)/D with D² = σ² + f² + g²m², so that dr/dm = (1 − r·g²m/D)/D.
            let per = one / (sensor.variance + gain_variance * felt * felt + M::FLOOR * M::FLOOR).sqrt();
            let r = counts * off * per;
            let slope = counts * per * (one - r * gain_variance * felt * per);
            sum.chi_squared = sum.chi_squared + r * r;
            sum.add(by, slope, r);
        }
        sum.cost = sum.chi_squared;
        for k in 0..K {
            if M::FREE[k] == Parameter::Width {
                let r = (shape.width - libm::log(USUAL_WIDTH)) * (1.0 / WIDTH_VARIES);
                sum.cost = sum.cost + r * r;
                sum.g[k] = sum.g[k] + r * (1.0 / WIDTH_VARIES);
                sum.a[k][k] = sum.a[k][k] + 1.0 / (WIDTH_VARIES * WIDTH_VARIES);
            }
        }
        sum
    }

    #[inline(always)]
    fn add(&mut self, mut by: [R; K], slope: R, r: R) {
        for i in 0..K {
            by[i] = by[i] * slope;
            self.g[i] = self.g[i] + by[i] * r;
            for j in 0..=i {
                self.a[i][j] = self.a[i][j] + by[i] * by[j];
            }
        }
    }

    /// `yes` where `mask` holds, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn choose(mask: R::Mask, yes: &Self, no: &Self) -> Self {
        let choose = |yes, no| R::choose(mask, yes, no);
        let mut chosen = *no;
        (chosen.cost, chosen.chi_squared) = (choose(yes.cost, no.cost), choose(yes.chi_squared, no.chi_squared));
        for i in 0..K {
            chosen.g[i] = choose(yes.g[i], no.g[i]);
            for j in 0..=i {
                chosen.a[i][j] = choose(yes.a[i][j], no.a[i][j]);
            }
        }
        chosen
    }
}
