//! contact in lanes; see [`crate::stage::contact`].

use fearless_simd::prelude::*;

use super::simd::{F, U, splat, splat_u, width};
use super::touch::{Members, Part};
use crate::stage::calibrate::UNUSABLE;

/// S, how many taxels are pressed, and the numerators of the centroid.
#[derive(Clone, Copy)]
pub(super) struct Sums<S: Simd> {
    pub(super) total: F<S>,
    pub(super) active: U<S>,
    pub(super) u: F<S>,
    pub(super) v: F<S>,
}

/// One pass over the members for `N` vectors of lanes from `at` on; the centroid's sums ride along where they are wanted.
///
/// A sum waits for the one before it: two vectors' sums side by side keep a core busy that takes eight lanes at a time.
#[inline(always)]
pub(super) fn sums<S: Simd, P: Members<S>, const N: usize>(
    simd: S,
    members: P,
    at: usize,
    centroid: bool,
) -> [Sums<S>; N] {
    let none = splat(simd, 0.0);
    let mut sums = [Sums { total: none, active: splat_u(simd, 0), u: none, v: none }; N];
    // Two loops, as the choice is not to be made for every member.
    if centroid {
        for member in 0..members.count() {
            let mut i = 0;
            while i < N {
                let part = members.part(simd, member, at + i * width::<S>());
                sums[i].total += part.pull;
                sums[i].active += pressed(simd, &part);
                sums[i].u += part.pull * part.u;
                sums[i].v += part.pull * part.v;
                i += 1;
            }
        }
    } else {
        for member in 0..members.count() {
            let mut i = 0;
            while i < N {
                let part = members.part(simd, member, at + i * width::<S>());
                sums[i].total += part.pull;
                sums[i].active += pressed(simd, &part);
                i += 1;
            }
        }
    }
    sums
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
