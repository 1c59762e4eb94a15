//! What presses, whatever its kind: where, along which direction, how hard, how wide and how long.

use super::real::Real;

/// A contact. Lengths are in σ of the layer, forces in the touch's largest pressure.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape<R> {
    pub(crate) place: [R; 2],
    /// A unit vector; across is to its left.
    pub(crate) along: [R; 2],
    /// The logarithm of the force; of a line, of the force on a unit of length.
    pub(crate) force: R,
    /// The logarithm of the spread across.
    pub(crate) width: R,
    /// The logarithm of half the length, or of the spread along.
    pub(crate) length: R,
}

/// What of a shape is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Parameter {
    Across,
    Along,
    Turn,
    Force,
    Width,
    Length,
}

/// The longest step: of a place in σ, of a turn by its tangent, of a logarithm.
const LONGEST: f64 = 1.5;
/// Spreads stay within e to this power times σ, on either side.
const WIDEST: f64 = 4.0;

impl<R: Real> Shape<R> {
    /// (across, along) of a point.
    #[inline(always)]
    pub(crate) fn seen(&self, [u, v]: [R; 2]) -> [R; 2] {
        let ([c, s], u, v) = (self.along, u - self.place[0], v - self.place[1]);
        [v * c - u * s, u * c + v * s]
    }

    /// The shape after a step of each of `free`.
    #[inline(always)]
    pub(crate) fn moved<const K: usize>(&self, free: [Parameter; K], steps: [R; K]) -> Self {
        let mut moved = *self;
        let [c, s] = self.along;
        for k in 0..K {
            let step = steps[k].at_least(-LONGEST).at_most(LONGEST);
            match free[k] {
                Parameter::Across => moved.shift([-s * step, c * step]),
                Parameter::Along => moved.shift([c * step, s * step]),
                Parameter::Turn => {
                    let turned = [c - s * step, s + c * step];
                    let length = (turned[0] * turned[0] + turned[1] * turned[1]).sqrt();
                    moved.along = [turned[0] / length, turned[1] / length];
                }
                Parameter::Force => moved.force = moved.force + step,
                Parameter::Width => moved.width = (moved.width + step).at_least(-WIDEST).at_most(WIDEST),
                Parameter::Length => moved.length = (moved.length + step).at_least(-WIDEST).at_most(WIDEST),
            }
        }
        moved
    }

    #[inline(always)]
    fn shift(&mut self, by: [R; 2]) {
        self.place = [self.place[0] + by[0], self.place[1] + by[1]];
    }

    /// Several shapes side by side, of numbers that `lanes` puts side by side.
    #[inline(always)]
    pub(crate) fn abreast<const N: usize>(shapes: [&Shape<f64>; N], lanes: impl Fn([f64; N]) -> R) -> Self {
        Self {
            place: [lanes(shapes.map(|shape| shape.place[0])), lanes(shapes.map(|shape| shape.place[1]))],
            along: [lanes(shapes.map(|shape| shape.along[0])), lanes(shapes.map(|shape| shape.along[1]))],
            force: lanes(shapes.map(|shape| shape.force)),
            width: lanes(shapes.map(|shape| shape.width)),
            length: lanes(shapes.map(|shape| shape.length)),
        }
    }

    /// `yes` where `mask` holds, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn choose(mask: R::Mask, yes: &Self, no: &Self) -> Self {
        let choose = |yes, no| R::choose(mask, yes, no);
        Self {
            place: [choose(yes.place[0], no.place[0]), choose(yes.place[1], no.place[1])],
            along: [choose(yes.along[0], no.along[0]), choose(yes.along[1], no.along[1])],
            force: choose(yes.force, no.force),
            width: choose(yes.width, no.width),
            length: choose(yes.length, no.length),
        }
    }
}
