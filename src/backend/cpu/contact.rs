//! contact in lanes; see [`crate::stage::contact`].

use fearless_simd::prelude::*;

use super::simd::{F, U, splat, splat_u};
use super::touch::{Members, Part};
use crate::stage::calibrate::UNUSABLE;

/// S, how many taxels are pressed, and the numerators of the centroid.
pub(super) struct Sums<S: Simd> {
    pub(super) total: F<S>,
    pub(super) active: U<S>,
    pub(super) u: F<S>,
    pub(super) v: F<S>,
}

/// One pass over the members; the centroid's sums ride along where they are wanted.
#[inline(always)]
pub(super) fn sums<S: Simd, P: Members<S>>(simd: S, members: P, at: usize, centroid: bool) -> Sums<S> {
    let none = splat(simd, 0.0);
    let (mut total, mut active, mut u, mut v) = (none, splat_u(simd, 0), none, none);
    // Two loops, as the choice is not to be made for every member.
    if centroid {
        for member in 0..members.count() {
            let part = members.part(simd, member, at);
            total += part.pull;
            active += pressed(simd, &part);
            u += part.pull * part.u;
            v += part.pull * part.v;
        }
    } else {
        for member in 0..members.count() {
            let part = members.part(simd, member, at);
            total += part.pull;
            active += pressed(simd, &part);
        }
    }
    Sums { total, active, u, v }
}

/// 1 where P > 0, else 0. No P is negative or −0, so that its bits tell.
#[inline(always)]
pub(super) fn pressed<S: Simd>(simd: S, part: &Part<S>) -> U<S> {
    part.pressure.bitcast::<U<S>>().min(splat_u(simd, 1))
}

/// The largest P, and the area of the pressed taxels, m².
#[inline(always)]
pub(super) fn peak_and_area<S: Simd, P: Members<S>>(simd: S, members: P, at: usize) -> (F<S>, F<S>) {
    let none = splat(simd, 0.0);
    let (mut peak, mut area) = (none, none);
    for member in 0..members.count() {
        let pressure = members.part(simd, member, at).pressure;
        peak = peak.max(pressure);
        area += pressure.simd_gt(none).select(members.area(simd, member, at), none);
    }
    (peak, area)
}

/// What calibration says of any member, and what it says of all.
#[inline(always)]
pub(super) fn statuses<S: Simd, P: Members<S>>(simd: S, members: P, at: usize) -> (U<S>, U<S>) {
    let (mut any, mut all) = (splat_u(simd, 0), splat_u(simd, UNUSABLE));
    for member in 0..members.count() {
        let status = members.status(simd, member, at);
        any |= status;
        all &= status;
    }
    (any, all)
}
