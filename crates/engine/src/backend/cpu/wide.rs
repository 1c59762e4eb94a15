//! A field of many members: sixteen of them abreast, so that one large field costs no more a member than small ones.
//!
//! Every sum is sixteen sums, one for every sixteenth member, added up in a fixed tree; a choice between equals still goes
//! to the lower id. [`Wide`] does that for one frame, a sum a lane; [`WideAbreast`] has sixteen frames abreast, and keeps
//! sixteen sums of each.

use fearless_simd::prelude::*;

use super::contact::{self, Sums};
use super::lanes::{F, I, LANES, M, Row, U, splat, splat_u, store, store_u, width};
use super::members::{Members, OnePass, Sum, Touch};
use super::orientation::{Farthest, point};
use super::pipeline::{Abreast, Sweep};
use super::principal_axis;
use crate::stage::calibrate::UNUSABLE;

/// A wide field in one frame: all lanes have members of it, and its answer.
#[derive(Clone, Copy)]
pub(super) struct Wide<P>(pub(super) P);

/// The sum of all lanes, as a tree.
#[inline(always)]
fn add_up(mut row: Row<f32>) -> f32 {
    let mut half = LANES / 2;
    while half > 0 {
        for lane in 0..half {
            row[lane] += row[lane + half];
        }
        half /= 2;
    }
    row[0]
}

/// Sums of all lanes, in all lanes of the result; `sums` has `K` sums of the lanes from a place on.
#[inline(always)]
fn all_lanes<S: Simd, A: Sum<S>, const K: usize>(simd: S, sums: impl Fn(usize) -> [A; K]) -> [F<S>; K] {
    // A sum has two vectors at most.
    let mut rows = [[[0.0; LANES]; 2]; K];
    let mut at = 0;
    while at < LANES {
        for (rows, sum) in rows.iter_mut().zip(sums(at)) {
            let mut index = 0;
            while index < A::VECTORS {
                store(simd, sum.vector(index), &mut rows[index], at);
                index += 1;
            }
        }
        at += width::<S>();
    }
    rows.map(
        #[inline(always)]
        |rows| {
            A::value(
                #[inline(always)]
                |index| splat(simd, add_up(rows[index])),
            )
        },
    )
}

impl<S: Simd, P: Members<S>> Sweep<S> for Wide<P> {
    #[inline(always)]
    fn sums<A: Sum<S>>(self, simd: S, _: usize, centroid: bool) -> Sums<S, F<S>> {
        let (none, sums) = (splat(simd, 0.0), contact::sums::<S, A, P, 1>);
        let [total, active, u, v] = all_lanes(
            simd,
            #[inline(always)]
            |at| {
                let [Sums { total, active, u, v }] = sums(simd, self.0, at, centroid);
                let mut count = A::zero(simd);
                count.add(active.bitcast::<I<S>>().to_float::<F<S>>(), none.simd_ge(none));
                [total, count, u, v]
            },
        );
        Sums { total, active: active.to_int::<U<S>>(), u, v }
    }

    #[inline(always)]
    fn peak_and_area(self, simd: S, _: usize) -> (F<S>, F<S>) {
        let mut rows = [[0.0; LANES]; 2];
        let mut at = 0;
        while at < LANES {
            let (peak, area) = contact::peak_and_area(simd, self.0, at);
            store(simd, peak, &mut rows[0], at);
            store(simd, area, &mut rows[1], at);
            at += width::<S>();
        }
        let peak = rows[0].into_iter().fold(0.0, f32::max);
        (splat(simd, peak), splat(simd, add_up(rows[1])))
    }

    #[inline(always)]
    fn statuses(self, simd: S, _: usize) -> (U<S>, M<S>) {
        let mut rows = [[0; LANES]; 2];
        let mut at = 0;
        while at < LANES {
            let (any, all) = contact::statuses(simd, self.0, at);
            store_u(simd, any, &mut rows[0], at);
            store_u(simd, all, &mut rows[1], at);
            at += width::<S>();
        }
        let any = rows[0].into_iter().fold(0, |any, status| any | status);
        let all = rows[1].into_iter().fold(UNUSABLE, |all, status| all & status);
        (splat_u(simd, any & !UNUSABLE), splat_u(simd, all).simd_gt(splat_u(simd, 0)))
    }

    #[inline(always)]
    fn depth<A: Sum<S>>(self, simd: S, _: usize) -> F<S> {
        let [depth] = all_lanes(
            simd,
            #[inline(always)]
            |at| [contact::depth::<S, A, P>(simd, self.0, at)],
        );
        depth
    }

    #[inline(always)]
    fn farthest(self, simd: S, _: usize, touch: &Touch<S>) -> Farthest<S> {
        let (none, unset) = (splat(simd, 0.0), splat(simd, -1.0));
        let mut third = -1.0_f32;
        let mut candidates = [Candidate::NONE; 2 * LANES];
        let mut at = 0;
        while at < LANES {
            let (mut r1, mut r2, mut r3) = (unset, unset, unset);
            let (mut x1, mut y1, mut x2, mut y2) = (none, none, none, none);
            let (mut i1, mut i2) = (splat_u(simd, 0), splat_u(simd, 0));
            for member in 0..self.0.count() {
                let (r, x, y) = point::<S, P, true>(simd, self.0, member, at, touch);
                let here = splat_u(simd, member as u32);
                let (first, second) = (r.simd_gt(r1), r.simd_gt(r2));
                r3 = r3.max(r2.min(r));
                r2 = r2.max(r1.min(r));
                r1 = r1.max(r);
                x2 = first.select(x1, second.select(x, x2));
                y2 = first.select(y1, second.select(y, y2));
                i2 = first.select(i1, second.select(here, i2));
                x1 = first.select(x, x1);
                y1 = first.select(y, y1);
                i1 = first.select(here, i1);
            }
            for lane in 0..width::<S>() {
                let id = |row: u32| row as usize * LANES + at + lane;
                candidates[2 * (at + lane)] = Candidate { r: r1[lane], x: x1[lane], y: y1[lane], id: id(i1[lane]) };
                candidates[2 * (at + lane) + 1] = Candidate { r: r2[lane], x: x2[lane], y: y2[lane], id: id(i2[lane]) };
                third = third.max(r3[lane]);
            }
            at += width::<S>();
        }
        let [first, second] = two_farthest(&candidates, &mut third);
        Farthest {
            r: [first.r, second.r, third].map(
                #[inline(always)]
                |r| splat(simd, r),
            ),
            x: splat(simd, first.x - second.x),
            y: splat(simd, first.y - second.y),
        }
    }

    #[inline(always)]
    fn moments<A: Sum<S>>(self, simd: S, _: usize, touch: &Touch<S>) -> [F<S>; 3] {
        all_lanes(
            simd,
            #[inline(always)]
            |at| principal_axis::moments::<S, A, P>(simd, self.0, at, touch),
        )
    }
}

/// One that may be the farthest.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    r: f32,
    x: f32,
    y: f32,
    id: usize,
}

impl Candidate {
    const NONE: Self = Self { r: -1.0, x: 0.0, y: 0.0, id: usize::MAX };
}

/// The farthest two, the lower id where they are equal; `third` becomes the largest of the other distances.
fn two_farthest(candidates: &[Candidate], third: &mut f32) -> [Candidate; 2] {
    let [mut first, mut second] = [Candidate::NONE; 2];
    for &candidate in candidates {
        let before = |other: Candidate| candidate.r > other.r || (candidate.r == other.r && candidate.id < other.id);
        let out = if before(first) {
            let out = second;
            (first, second) = (candidate, first);
            out
        } else if before(second) {
            std::mem::replace(&mut second, candidate)
        } else {
            candidate
        };
        *third = third.max(out.r);
    }
    [first, second]
}

/// A wide field over sixteen frames: what [`Abreast`] is for others.
#[derive(Clone, Copy)]
pub(super) struct WideAbreast<P>(pub(super) P);

/// Members whose values stay in the nearest cache while sixteen sums go over them in turn; a multiple of [`LANES`].
const MEMBERS_IN_TURN: usize = 256;

/// `K` sums over all members to which `add` adds one's part, each as sixteen that are then added up as a tree.
#[inline(always)]
fn in_sixteen<S: Simd, A: Sum<S>, const K: usize>(
    simd: S,
    count: usize,
    add: impl Fn(usize, &mut [A; K]),
) -> [F<S>; K] {
    let mut sums = [[A::zero(simd); K]; LANES];
    let mut start = 0;
    while start < count {
        let end = count.min(start + MEMBERS_IN_TURN);
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
                sums[lane][k] = sums[lane][k].join(sums[lane + half][k]);
                k += 1;
            }
            lane += 1;
        }
        half /= 2;
    }
    sums[0].map(A::total)
}

impl<S: Simd, P: Members<S>> Sweep<S> for WideAbreast<P> {
    #[inline(always)]
    fn sums<A: Sum<S>>(self, simd: S, at: usize, centroid: bool) -> Sums<S, F<S>> {
        let (none, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let [total, active, u, v] = in_sixteen(
            simd,
            self.0.count(),
            #[inline(always)]
            |member, [total, active, u, v]: &mut [A; 4]| {
                let sample = self.0.sample(simd, member, at);
                let pressed = sample.pressure.simd_gt(none);
                active.add(pressed.select(one, none), pressed);
                contact::add(simd, &sample, centroid, [total, u, v]);
            },
        );
        Sums { total, active: active.to_int::<U<S>>(), u, v }
    }

    #[inline(always)]
    fn peak_and_area(self, simd: S, at: usize) -> (F<S>, F<S>) {
        let (peak, _) = contact::peak_and_area(simd, self.0, at);
        let none = splat(simd, 0.0);
        let [area] = in_sixteen(
            simd,
            self.0.count(),
            #[inline(always)]
            |member, [area]: &mut [OnePass<S>; 1]| {
                let pressed = self.0.sample(simd, member, at).pressure.simd_gt(none);
                area.add(pressed.select(self.0.area(simd, member, at), none), pressed);
            },
        );
        (peak, area)
    }

    #[inline(always)]
    fn statuses(self, simd: S, at: usize) -> (U<S>, M<S>) {
        Abreast(self.0).statuses(simd, at)
    }

    #[inline(always)]
    fn depth<A: Sum<S>>(self, simd: S, at: usize) -> F<S> {
        let [sum] = in_sixteen(
            simd,
            self.0.count(),
            #[inline(always)]
            |member, [sum]: &mut [A; 1]| contact::add_depth(simd, self.0, member, at, sum),
        );
        sum
    }

    #[inline(always)]
    fn farthest(self, simd: S, at: usize, touch: &Touch<S>) -> Farthest<S> {
        // In the members' order, which is that of the ids.
        Abreast(self.0).farthest(simd, at, touch)
    }

    #[inline(always)]
    fn moments<A: Sum<S>>(self, simd: S, at: usize, touch: &Touch<S>) -> [F<S>; 3] {
        in_sixteen(
            simd,
            self.0.count(),
            #[inline(always)]
            |member, sums: &mut [A; 3]| principal_axis::add(simd, self.0, member, at, touch, sums),
        )
    }
}
