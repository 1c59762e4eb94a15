//! A wide field over sixteen frames: sixteen sums of everything, a lane a frame; see [`super::wide`].

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
    let mut start = 0;
    while start < count {
        let end = count.min(start + BLOCK);
        let mut lane = 0;
        while lane < LANES {
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

impl<S: Simd, P: Members<S>> Sweep<S> for ManyAbreast<P> {
    #[inline(always)]
    fn sums(self, simd: S, at: usize, centroid: bool) -> Sums<S> {
        let [total, active, u, v] = in_sixteen(
            simd,
            self.0.count(),
            #[inline(always)]
            |member, [total, active, u, v]| {
                let part = self.0.part(simd, member, at);
                *total += part.pull;
                *active += part.pressure.simd_gt(splat(simd, 0.0)).select(splat(simd, 1.0), splat(simd, 0.0));
                if centroid {
                    *u += part.pull * part.u;
                    *v += part.pull * part.v;
                }
            },
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
            |member, [area]| {
                let none = splat(simd, 0.0);
                let pressed = self.0.part(simd, member, at).pressure.simd_gt(none);
                *area += pressed.select(self.0.area(simd, member, at), none);
            },
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
            |member, [sum]| *sum += self.0.part(simd, member, at).pull * self.0.depth(simd, member, at),
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
