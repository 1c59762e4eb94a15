//! How much of a contact's pressure falls on a taxel, along one direction: the integral of a blurred point or line over it.

use super::real::Real;

/// A mass, and how it changes with place, with the logarithm of the spread, and with that of half the line's length.
#[derive(Clone, Copy)]
pub(crate) struct Mass<R> {
    pub(crate) value: R,
    pub(crate) by_place: R,
    pub(crate) by_spread: R,
    pub(crate) by_half: R,
}

/// Where a taxel at `place` lies seen from the side on which that is below 0, and the sign that slopes by it have from there. Masses are
/// the same on both sides, and differences of Φ keep their digits where it is small.
#[inline(always)]
fn from_below<R: Real>(place: R) -> (R, R) {
    let is_above = place.all(0.0).is_below(place);
    (-place.abs(), R::choose(is_above, place.all(-1.0), place.all(1.0)))
}

/// Of a point, blurred by a Gaussian of `spread` w, in `place` x ± `margin` a: Φ((x + a)/w) − Φ((x − a)/w).
#[inline(always)]
pub(crate) fn of_point<R: Real>(place: R, margin: R, spread: R) -> Mass<R> {
    let per = spread.all(1.0) / spread;
    let (place, side) = from_below(place);
    let (far, near) = ((place + margin) * per, (place - margin) * per);
    let ((up_to_far, at_far), (up_to_near, at_near)) = (far.normal(), near.normal());
    Mass {
        value: up_to_far - up_to_near,
        by_place: side * ((at_far - at_near) * per),
        by_spread: near * at_near - far * at_far,
        by_half: place.all(0.0),
    }
}

/// The same of an even line of length 2h: (w/2h) [K((x+h+a)/w) − K((x+h−a)/w) − K((x−h+a)/w) + K((x−h−a)/w)], where
/// K(z) = z·Φ(z) + φ(z) is Φ's integral.
#[inline(always)]
pub(crate) fn of_line<R: Real>(place: R, margin: R, half: R, spread: R) -> Mass<R> {
    let (per, share) = (spread.all(1.0) / spread, spread.all(0.5) / half);
    let (place, side) = from_below(place);
    let a = integrated((place + half + margin) * per);
    let b = integrated((place + half - margin) * per);
    let c = integrated((place - half + margin) * per);
    let d = integrated((place - half - margin) * per);
    let value = share * spread * ((a.2 - b.2) - (c.2 - d.2));
    Mass {
        value,
        by_place: side * (share * ((a.0 - b.0) - (c.0 - d.0))),
        by_spread: share * spread * ((a.1 - b.1) - (c.1 - d.1)),
        by_half: ((a.0 - b.0) + (c.0 - d.0)) * 0.5 - value,
    }
}

/// Φ(z), φ(z) and K(z).
#[inline(always)]
fn integrated<R: Real>(z: R) -> (R, R, R) {
    let (up_to, at) = z.normal();
    (up_to, at, z * up_to + at)
}
