//! contact and centroid in lanes, whose sums go over members together; see [`crate::stage::contact`] and
//! [`crate::stage::centroid`].

use fearless_simd::prelude::*;

use super::lanes::{F, M, U, splat, splat_u, width};
use super::members::{Members, Sample, Sum};
use crate::stage::calibrate::UNUSABLE;

/// S, how many taxels are pressed, and the numerators of the centroid.
#[derive(Clone, Copy)]
pub(super) struct Sums<S: Simd, A> {
    pub(super) total: A,
    pub(super) active: U<S>,
    pub(super) u: A,
    pub(super) v: A,
}

impl<S: Simd, A: Sum<S>> Sums<S, A> {
    #[inline(always)]
    pub(super) fn totals(self) -> Sums<S, F<S>> {
        Sums { total: self.total.total(), active: self.active, u: self.u.total(), v: self.v.total() }
    }
}

/// Adds a member to S and to the centroid's numerators, where these are wanted.
#[inline(always)]
pub(super) fn add<S: Simd, A: Sum<S>>(simd: S, sample: &Sample<S>, centroid: bool, [total, u, v]: [&mut A; 3]) {
    let counts = sample.pull.simd_gt(splat(simd, 0.0));
    total.add(sample.pull, counts);
    if centroid {
        u.add(sample.pull * sample.u, counts);
        v.add(sample.pull * sample.v, counts);
    }
}

/// One pass over the members for `N` vectors of lanes from `at` on.
///
/// A sum waits for the one before it: two vectors' sums side by side keep a core busy that takes eight lanes at a time.
#[inline(always)]
pub(super) fn sums<S: Simd, A: Sum<S>, P: Members<S>, const N: usize>(
    simd: S,
    members: P,
    at: usize,
    centroid: bool,
) -> [Sums<S, A>; N] {
    let zero = A::zero(simd);
    let mut sums = [Sums { total: zero, active: splat_u(simd, 0), u: zero, v: zero }; N];
    // Two loops, as the choice is not to be made for every member.
    if centroid {
        for member in 0..members.count() {
            add_to_each(simd, members, member, at, true, &mut sums);
        }
    } else {
        for member in 0..members.count() {
            add_to_each(simd, members, member, at, false, &mut sums);
        }
    }
    sums
}

#[inline(always)]
fn add_to_each<S: Simd, A: Sum<S>, P: Members<S>, const N: usize>(
    simd: S,
    members: P,
    member: usize,
    at: usize,
    centroid: bool,
    sums: &mut [Sums<S, A>; N],
) {
    let mut i = 0;
    while i < N {
        let sample = members.sample(simd, member, at + i * width::<S>());
        let Sums { total, active, u, v } = &mut sums[i];
        *active += pressed(simd, &sample);
        add(simd, &sample, centroid, [total, u, v]);
        i += 1;
    }
}

/// 1 where P > 0, else 0. No P is negative or −0, so that its bits tell.
#[inline(always)]
fn pressed<S: Simd>(simd: S, sample: &Sample<S>) -> U<S> {
    sample.pressure.bitcast::<U<S>>().min(splat_u(simd, 1))
}

/// The largest P, and the area of the pressed taxels, m².
#[inline(always)]
pub(super) fn peak_and_area<S: Simd, P: Members<S>>(simd: S, members: P, at: usize) -> (F<S>, F<S>) {
    let none = splat(simd, 0.0);
    let (mut peak, mut area) = (none, none);
    for member in 0..members.count() {
        let pressure = members.sample(simd, member, at).pressure;
        peak = peak.max(pressure);
        area += pressure.simd_gt(none).select(members.area(simd, member, at), none);
    }
    (peak, area)
}

/// The statuses that any member has, and those that all have.
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

/// (u, v) where `touched`, 0 elsewhere.
#[inline(always)]
pub(super) fn quotients<S: Simd>(simd: S, total: F<S>, (u, v): (F<S>, F<S>), touched: M<S>) -> (F<S>, F<S>) {
    let none = splat(simd, 0.0);
    // One division for both: a unit in the last place more, of the five that the bound allows.
    let share = touched.select(splat(simd, 1.0) / total, none);
    (u * share, v * share)
}

/// The numerator of the third coordinate, which only fields without a chart need.
#[inline(always)]
pub(super) fn depth<S: Simd, A: Sum<S>, P: Members<S>>(simd: S, members: P, at: usize) -> A {
    let mut sum = A::zero(simd);
    for member in 0..members.count() {
        add_depth(simd, members, member, at, &mut sum);
    }
    sum
}

#[inline(always)]
pub(super) fn add_depth<S: Simd, A: Sum<S>, P: Members<S>>(simd: S, members: P, member: usize, at: usize, sum: &mut A) {
    let sample = members.sample(simd, member, at);
    sum.add(sample.pull * members.depth(simd, member, at), sample.pull.simd_gt(splat(simd, 0.0)));
}
