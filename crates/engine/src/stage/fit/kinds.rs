//! The kinds of contact: what a taxel feels of each, and how that changes with each of its parameters.

use super::mass;
use super::real::Real;
use super::shape::{Parameter, Shape};

/// The floors of contacts that have a middle, and of those along a line, whose tails add up.
const POINT_FLOOR: f64 = 0.01;
const LINE_FLOOR: f64 = 0.03;

/// A kind of contact, with K parameters.
pub(crate) trait Kind<const K: usize> {
    /// Its parameters.
    const FREE: [Parameter; K];
    /// What this kind may be off by at any taxel, as a share of the largest pressure: layers have tails that the Gaussian has not.
    const FLOOR: f64;

    /// What a square taxel with its middle `at` and half a side of `margin` feels, and how that changes with each of [`Self::FREE`].
    fn felt<R: Real>(contact: &Contact<R>, at: [R; 2], margin: R) -> (R, [R; K]);
}

/// A shape with its logarithms taken back.
#[derive(Clone, Copy)]
pub(crate) struct Contact<R> {
    shape: Shape<R>,
    force: R,
    width: R,
    length: R,
}

impl<R: Real> Contact<R> {
    #[inline(always)]
    pub(crate) fn from_shape(shape: &Shape<R>) -> Self {
        Self { shape: *shape, force: shape.force.exp(), width: shape.width.exp(), length: shape.length.exp() }
    }
}

/// m = F · G(x) · G(y), where G is the part of a Gaussian of the spread that lies within the taxel.
pub(crate) struct Point;

impl Kind<4> for Point {
    const FREE: [Parameter; 4] = [Parameter::Across, Parameter::Along, Parameter::Force, Parameter::Width];
    const FLOOR: f64 = POINT_FLOOR;

    #[inline(always)]
    fn felt<R: Real>(contact: &Contact<R>, at: [R; 2], margin: R) -> (R, [R; 4]) {
        let &Contact { shape, force, width, .. } = contact;
        let [x, y] = shape.seen(at);
        let (across, along) = (mass::of_point(x, margin, width), mass::of_point(y, margin, width));
        let felt = force * across.value * along.value;
        let by_width = force * (across.by_spread * along.value + across.value * along.by_spread);
        (felt, [-(force * across.by_place * along.value), -(force * across.value * along.by_place), felt, by_width])
    }
}

/// m = q · s · G(x): q newtons a unit of length, without ends, over a taxel with sides of s.
pub(crate) struct Line;

impl Kind<4> for Line {
    const FREE: [Parameter; 4] = [Parameter::Across, Parameter::Turn, Parameter::Force, Parameter::Width];
    const FLOOR: f64 = LINE_FLOOR;

    #[inline(always)]
    fn felt<R: Real>(contact: &Contact<R>, at: [R; 2], margin: R) -> (R, [R; 4]) {
        let &Contact { shape, force, width, .. } = contact;
        let [x, y] = shape.seen(at);
        let across = mass::of_point(x, margin, width);
        let force = force * margin * 2.0;
        let by_place = force * across.by_place;
        (force * across.value, [-by_place, -(by_place * y), force * across.value, force * across.by_spread])
    }
}

/// m = F · G(x) · L(y), where L is the part of an even line of its length, blurred alike, that lies within the taxel.
pub(crate) struct Segment;

impl Kind<6> for Segment {
    const FREE: [Parameter; 6] = ALL;
    const FLOOR: f64 = LINE_FLOOR;

    #[inline(always)]
    fn felt<R: Real>(contact: &Contact<R>, at: [R; 2], margin: R) -> (R, [R; 6]) {
        let &Contact { shape, force, width, length } = contact;
        let [x, y] = shape.seen(at);
        let (across, along) = (mass::of_point(x, margin, width), mass::of_line(y, margin, length, width));
        let felt = force * across.value * along.value;
        let by_x = force * across.by_place * along.value;
        let by_y = force * across.value * along.by_place;
        let by_width = force * (across.by_spread * along.value + across.value * along.by_spread);
        (felt, [-by_x, -by_y, by_y * x - by_x * y, felt, by_width, force * across.value * along.by_half])
    }
}

/// m = F · G(x) · G(y), each with a spread of its own.
pub(crate) struct Blob;

impl Kind<6> for Blob {
    const FREE: [Parameter; 6] = ALL;
    const FLOOR: f64 = POINT_FLOOR;

    #[inline(always)]
    fn felt<R: Real>(contact: &Contact<R>, at: [R; 2], margin: R) -> (R, [R; 6]) {
        let &Contact { shape, force, width, length } = contact;
        let [x, y] = shape.seen(at);
        let (across, along) = (mass::of_point(x, margin, width), mass::of_point(y, margin, length));
        let felt = force * across.value * along.value;
        let by_x = force * across.by_place * along.value;
        let by_y = force * across.value * along.by_place;
        let (by_width, by_length) = (across.by_spread * along.value, across.value * along.by_spread);
        (felt, [-by_x, -by_y, by_y * x - by_x * y, felt, force * by_width, force * by_length])
    }
}

const ALL: [Parameter; 6] =
    [Parameter::Across, Parameter::Along, Parameter::Turn, Parameter::Force, Parameter::Width, Parameter::Length];

#[cfg(test)]
mod tests {
    use super::*;

    /// By how much slopes differ from quotients of differences, as a share of what is felt.
    fn worst<M: Kind<K>, const K: usize>() -> f64 {
        let shape = Shape { place: [0.3, -0.2], along: [0.6, 0.8], force: 0.4, width: 0.2, length: 0.9 };
        let felt = |shape: &Shape<f64>, at| M::felt(&Contact::from_shape(shape), at, 0.5);
        let mut worst: f64 = 0.0;
        for at in [[0.0, 0.0], [1.0, 0.4], [-1.3, 2.0], [0.2, -2.2]] {
            let (value, slopes) = felt(&shape, at);
            for k in 0..K {
                let step =
                    |by: f64| felt(&shape.moved(M::FREE, std::array::from_fn(|i| if i == k { by } else { 0.0 })), at).0;
                let quotient = (step(1e-5) - step(-1e-5)) / 2e-5;
                worst = worst.max((quotient - slopes[k]).abs() / value);
            }
        }
        worst
    }

    #[test]
    fn slopes_are_the_limits_of_differences() {
        // Differences of second order over 10⁻⁵ lose 10⁻¹⁰ of the third derivative, and 10⁻¹⁶/10⁻⁵ to rounding.
        for worst in [worst::<Point, 4>(), worst::<Line, 4>(), worst::<Segment, 6>(), worst::<Blob, 6>()] {
            assert!(worst < 1e-8, "{worst}");
        }
    }

    #[test]
    fn kinds_meet_where_they_are_the_same_contact() {
        let shape = Shape { place: [0.3, -0.2], along: [0.6, 0.8], force: 0.4, width: 0.2, length: 0.2 };
        let felt = |shape: &Shape<f64>, at: [f64; 2]| {
            let contact = Contact::from_shape(shape);
            [
                Point::felt(&contact, at, 0.5).0,
                Blob::felt(&contact, at, 0.5).0,
                Segment::felt(&contact, at, 0.5).0,
                Line::felt(&contact, at, 0.5).0,
            ]
        };
        for at in [[0.0, 0.0], [1.0, 0.4], [-1.3, 2.0]] {
            // Two equal spreads are one; a segment of no length is a point; of a long one each unit feels its part.
            let [point, blob, ..] = felt(&shape, at);
            assert!((blob - point).abs() < 1e-15, "{blob} {point}");
            let [point, _, segment, _] = felt(&Shape { length: -6.0, ..shape }, at);
            assert!((segment / point - 1.0).abs() < 1e-5, "{segment} {point}");
            let length = 4.0_f64;
            let [_, _, segment, line] = felt(&Shape { length, ..shape }, at);
            let a_unit = segment * 2.0 * length.exp();
            assert!((a_unit / line - 1.0).abs() < 1e-12, "{a_unit} {line}");
        }
    }
}
