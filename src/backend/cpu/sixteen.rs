//! A wide field over sixteen frames: sixteen sums of everything, a lane a frame; see [`super::wide`].

use std::ops::Range;

use fearless_simd::prelude::*;

use super::axis::{self, Moments};
use super::contact::{self, Sums};
use super::orientation::Apart;
use super::simd::{F, LANES, M, U, splat};
use super::touch::{Abreast, Members, Sweep, Touch};

/// A wide field over sixteen frames: what [`Abreast`] is for others.
#[derive(Clone, Copy)]
pub(super) struct ManyAbreast<P>(pub(super) P);

/// Members whose parts stay in the nearest cache while sixteen sums go over them in turn; a multiple of [`LANES`].
pub(super) const BLOCK: usize = 256;

/// `K` sums over all members to which `add` adds one's part, each as sixteen that are then added up as a tree.
#[inline(always)]
pub(super) fn in_sixteen<S: Simd, const K: usize>(
    simd: S,
    count: usize,
    add: impl Fn(usize, &mut [F<S>; K]),
) -> [F<S>; K] {
    let mut sums = [[splat(simd, 0.0); K]; LANES];
    add_in_sixteen::<S, K>(
        0..count,
        &mut sums,
        add,
        #[inline(always)]
        || {},
    );
    as_a_tree::<S, K>(sums)
}

/// How often [`add_in_sixteen`] calls `meanwhile` for so many members.
pub(super) fn calls(members: usize) -> usize {
    LANES * members.div_ceil(BLOCK)
}

/// Adds the parts of `members`, of which the first one's number is a multiple of sixteen, to the sixteen `sums` of each.
#[inline(always)]
pub(super) fn add_in_sixteen<S: Simd, const K: usize>(
    members: Range<usize>,
    sums: &mut [[F<S>; K]; LANES],
    add: impl Fn(usize, &mut [F<S>; K]),
    mut meanwhile: impl FnMut(),
) {
    let mut start = members.start;
    while start < members.end {
        let end = members.end.min(start + BLOCK);
        let mut lane = 0;
        while lane < LANES {
            meanwhile();
            let mut sum = sums[lane];
            let mut member = start + lane;
            while member < end {
                add(member, &mut sum);
                member += LANES;
            }
            sums[lane] = sum;
            lane += 1;
        }
        start = end;
    }
}

/// Sixteen sums of each as one.
#[inline(always)]
pub(super) fn as_a_tree<S: Simd, const K: usize>(mut sums: [[F<S>; K]; LANES]) -> [F<S>; K] {
    let mut half = LANES / 2;
    while half > 0 {
        let mut lane = 0;
        while lane < half {
            let mut k = 0;
            while k < K {
                let other = sums[lane + half][k];
                sums[lane][k] += other;
                k += 1;
            }
            lane += 1;
        }
        half /= 2;
    }
    sums[0]
}

/// Adds a member's part to S, how many are pressed, and the centroid's numerators where `centroid` says so.
#[inline(always)]
pub(super) fn add_touch<S: Simd, P: Members<S>>(
    simd: S,
    members: P,
    member: usize,
    at: usize,
    centroid: bool,
    [total, active, u, v]: &mut [F<S>; 4],
) {
    let part = members.part(simd, member, at);
    *total += part.pull;
    *active += part.pressure.simd_gt(splat(simd, 0.0)).select(splat(simd, 1.0), splat(simd, 0.0));
    if centroid {
        *u += part.pull * part.u;
        *v += part.pull * part.v;
    }
}

/// Adds the area of a member that is pressed.
#[inline(always)]
pub(super) fn add_area<S: Simd, P: Members<S>>(simd: S, members: P, member: usize, at: usize, [area]: &mut [F<S>; 1]) {
    let none = splat(simd, 0.0);
    let pressed = members.part(simd, member, at).pressure.simd_gt(none);
    *area += pressed.select(members.area(simd, member, at), none);
}

/// Adds a member's part to the third coordinate's numerator.
#[inline(always)]
pub(super) fn add_depth<S: Simd, P: Members<S>>(simd: S, members: P, member: usize, at: usize, [sum]: &mut [F<S>; 1]) {
    let part = members.part(simd, member, at);
    *sum += part.pull * members.depth(simd, member, at);
}

impl<S: Simd, P: Members<S>> Sweep<S> for ManyAbreast<P> {
    #[inline(always)]
    fn sums(self, simd: S, at: usize, centroid: bool) -> Sums<S> {
        let [total, active, u, v] = in_sixteen(
            simd,
            self.0.count(),
            #[inline(always)]
            |member, sums| add_touch(simd, self.0, member, at, centroid, sums),
        );
        Sums { total, active: active.to_int::<U<S>>(), u, v }
    }

    #[inline(always)]
    fn peak_and_area(self, simd: S, at: usize) -> (F<S>, F<S>) {
        let (peak, _) = contact::peak_and_area(simd, self.0, at);
        let [area] = in_sixteen(
            simd,
            self.0.count(),
            #[inline(always)]
            |member, area| add_area(simd, self.0, member, at, area),
        );
        (peak, area)
    }

    #[inline(always)]
    fn statuses(self, simd: S, at: usize) -> (U<S>, M<S>) {
        Abreast(self.0).statuses(simd, at)
    }

    #[inline(always)]
    fn depth(self, simd: S, at: usize) -> F<S> {
        let [sum] = in_sixteen(
            simd,
            self.0.count(),
            #[inline(always)]
            |member, sum| add_depth(simd, self.0, member, at, sum),
        );
        sum
    }

    #[inline(always)]
    fn farthest(self, simd: S, at: usize, touch: &Touch<S>) -> Apart<S> {
        // In the members' order, which is that of the ids.
        Abreast(self.0).farthest(simd, at, touch)
    }

    #[inline(always)]
    fn moments(self, simd: S, at: usize, touch: &Touch<S>) -> Moments<S> {
        let [a, b, d] = in_sixteen(
            simd,
            self.0.count(),
            #[inline(always)]
            |member, sums| axis::add(simd, self.0, member, at, touch, sums),
        );
        Moments { a, b, d }
    }
}
