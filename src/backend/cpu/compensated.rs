//! Compensated sums in lanes: Kahan's, which carries along what each addition loses; see [`crate::stage::Sums`].
//!
//! A member that is not pressed changes nothing, not even what is carried: lanes that have fewer members than others go on
//! with such ones, and have the same bits as without.

use fearless_simd::prelude::*;

use super::axis::Moments;
use super::contact::{Sums, pressed};
use super::simd::{F, LANES, M, Row, U, splat, splat_u, store, store_u, width};
use super::sixteen::{ManyAbreast, in_sixteen};
use super::touch::{Abreast, Members, Part, Touch};
use super::wide::{Wide, add_up};

/// A sum, and what it has too much.
type Pair<S> = [F<S>; 2];

/// The sums of a [`super::touch::Sweep`], compensated.
pub(super) trait Compensated<S: Simd>: Copy {
    /// As [`super::touch::Sweep::sums`].
    fn sums_with_care(self, simd: S, at: usize, centroid: bool) -> Sums<S>;
    /// As [`super::touch::Sweep::depth`].
    fn depth_with_care(self, simd: S, at: usize) -> F<S>;
    /// As [`super::touch::Sweep::moments`].
    fn moments_with_care(self, simd: S, at: usize, touch: &Touch<S>) -> Moments<S>;
}

/// Adds `term` where `counts`.
#[inline(always)]
fn add<S: Simd>(counts: M<S>, term: F<S>, [sum, over]: &mut Pair<S>) {
    let term = term - *over;
    let next = *sum + term;
    *over = counts.select((next - *sum) - term, *over);
    *sum = counts.select(next, *sum);
}

#[inline(always)]
fn is_pressed<S: Simd>(simd: S, part: &Part<S>) -> M<S> {
    part.pull.simd_gt(splat(simd, 0.0))
}

/// A member's part in total, u and v.
#[inline(always)]
fn add_place<S: Simd>(simd: S, part: &Part<S>, centroid: bool, [total, u, v]: &mut [Pair<S>; 3]) {
    let counts = is_pressed(simd, part);
    add::<S>(counts, part.pull, total);
    if centroid {
        add::<S>(counts, part.pull * part.u, u);
        add::<S>(counts, part.pull * part.v, v);
    }
}

/// A member's part in a, b and d.
#[inline(always)]
fn add_moments<S: Simd>(simd: S, part: &Part<S>, touch: &Touch<S>, [a, b, d]: &mut [Pair<S>; 3]) {
    let counts = is_pressed(simd, part);
    let q = part.pull * touch.scale;
    let (x, y) = (part.u - touch.u, part.v - touch.v);
    let qx = q * x;
    add::<S>(counts, qx * x, a);
    add::<S>(counts, qx * y, b);
    add::<S>(counts, (q * y) * y, d);
}

/// Three sums over all members of each lane, and how many of these are pressed.
#[inline(always)]
fn abreast<S: Simd, P: Members<S>>(
    simd: S,
    members: P,
    at: usize,
    add_one: impl Fn(&Part<S>, &mut [Pair<S>; 3]),
) -> ([Pair<S>; 3], U<S>) {
    let (mut sums, mut active) = ([[splat(simd, 0.0); 2]; 3], splat_u(simd, 0));
    for member in 0..members.count() {
        let part = members.part(simd, member, at);
        active += pressed(simd, &part);
        add_one(&part, &mut sums);
    }
    (sums, active)
}

#[inline(always)]
fn depth_abreast<S: Simd, P: Members<S>>(simd: S, members: P, at: usize) -> Pair<S> {
    let mut sum = [splat(simd, 0.0); 2];
    for member in 0..members.count() {
        let part = members.part(simd, member, at);
        add::<S>(is_pressed(simd, &part), part.pull * members.depth(simd, member, at), &mut sum);
    }
    sum
}

impl<S: Simd, P: Members<S>> Compensated<S> for Abreast<P> {
    #[inline(always)]
    fn sums_with_care(self, simd: S, at: usize, centroid: bool) -> Sums<S> {
        let ([total, u, v], active) = abreast(
            simd,
            self.0,
            at,
            #[inline(always)]
            |part: &Part<S>, sums: &mut [Pair<S>; 3]| add_place(simd, part, centroid, sums),
        );
        Sums { total: total[0] - total[1], active, u: u[0] - u[1], v: v[0] - v[1] }
    }

    #[inline(always)]
    fn depth_with_care(self, simd: S, at: usize) -> F<S> {
        let [sum, over] = depth_abreast(simd, self.0, at);
        sum - over
    }

    #[inline(always)]
    fn moments_with_care(self, simd: S, at: usize, touch: &Touch<S>) -> Moments<S> {
        let ([a, b, d], _) = abreast(
            simd,
            self.0,
            at,
            #[inline(always)]
            |part: &Part<S>, sums: &mut [Pair<S>; 3]| add_moments(simd, part, touch, sums),
        );
        Moments { a: a[0] - a[1], b: b[0] - b[1], d: d[0] - d[1] }
    }
}

/// The pairs of six numbers, and back.
#[inline(always)]
fn pairs<S: Simd>([a, b, c, d, e, f]: [F<S>; 6]) -> [Pair<S>; 3] {
    [[a, b], [c, d], [e, f]]
}

#[inline(always)]
fn six<S: Simd>([[a, b], [c, d], [e, f]]: [Pair<S>; 3]) -> [F<S>; 6] {
    [a, b, c, d, e, f]
}

impl<S: Simd, P: Members<S>> Compensated<S> for ManyAbreast<P> {
    #[inline(always)]
    fn sums_with_care(self, simd: S, at: usize, centroid: bool) -> Sums<S> {
        let (none, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let [t0, t1, u0, u1, v0, v1, active] = in_sixteen(
            simd,
            self.0.count(),
            #[inline(always)]
            |member, [t0, t1, u0, u1, v0, v1, active]| {
                let part = self.0.part(simd, member, at);
                let mut sums = pairs::<S>([*t0, *t1, *u0, *u1, *v0, *v1]);
                add_place(simd, &part, centroid, &mut sums);
                [*t0, *t1, *u0, *u1, *v0, *v1] = six::<S>(sums);
                *active += part.pressure.simd_gt(none).select(one, none);
            },
        );
        Sums { total: t0 - t1, active: active.to_int::<U<S>>(), u: u0 - u1, v: v0 - v1 }
    }

    #[inline(always)]
    fn depth_with_care(self, simd: S, at: usize) -> F<S> {
        let [sum, over] = in_sixteen(
            simd,
            self.0.count(),
            #[inline(always)]
            |member, sum| {
                let part = self.0.part(simd, member, at);
                add::<S>(is_pressed(simd, &part), part.pull * self.0.depth(simd, member, at), sum);
            },
        );
        sum - over
    }

    #[inline(always)]
    fn moments_with_care(self, simd: S, at: usize, touch: &Touch<S>) -> Moments<S> {
        let [a0, a1, b0, b1, d0, d1] = in_sixteen(
            simd,
            self.0.count(),
            #[inline(always)]
            |member, [a0, a1, b0, b1, d0, d1]| {
                let part = self.0.part(simd, member, at);
                let mut sums = pairs::<S>([*a0, *a1, *b0, *b1, *d0, *d1]);
                add_moments(simd, &part, touch, &mut sums);
                [*a0, *a1, *b0, *b1, *d0, *d1] = six::<S>(sums);
            },
        );
        Moments { a: a0 - a1, b: b0 - b1, d: d0 - d1 }
    }
}

/// Sixteen sums of each of three quantities, joined as trees, in all lanes.
#[inline(always)]
fn joined<S: Simd>(simd: S, rows: [[Row<f32>; 2]; 3]) -> [F<S>; 3] {
    rows.map(
        #[inline(always)]
        |[sum, over]| splat(simd, add_up(sum) - add_up(over)),
    )
}

#[inline(always)]
fn put<S: Simd>(simd: S, sums: [Pair<S>; 3], rows: &mut [[Row<f32>; 2]; 3], at: usize) {
    for (rows, sums) in rows.iter_mut().zip(sums) {
        store(simd, sums[0], &mut rows[0], at);
        store(simd, sums[1], &mut rows[1], at);
    }
}

impl<S: Simd> Compensated<S> for Wide<'_> {
    #[inline(always)]
    fn sums_with_care(self, simd: S, _: usize, centroid: bool) -> Sums<S> {
        let (mut rows, mut active) = ([[[0.0; LANES]; 2]; 3], [0; LANES]);
        let mut at = 0;
        while at < LANES {
            let (sums, some) = abreast(
                simd,
                self,
                at,
                #[inline(always)]
                |part: &Part<S>, sums: &mut [Pair<S>; 3]| add_place(simd, part, centroid, sums),
            );
            put(simd, sums, &mut rows, at);
            store_u(simd, some, &mut active, at);
            at += width::<S>();
        }
        let [total, u, v] = joined(simd, rows);
        Sums { total, active: splat_u(simd, active.iter().sum()), u, v }
    }

    #[inline(always)]
    fn depth_with_care(self, simd: S, _: usize) -> F<S> {
        let (mut sums, mut overs) = ([0.0; LANES], [0.0; LANES]);
        let mut at = 0;
        while at < LANES {
            let [sum, over] = depth_abreast(simd, self, at);
            store(simd, sum, &mut sums, at);
            store(simd, over, &mut overs, at);
            at += width::<S>();
        }
        splat(simd, add_up(sums) - add_up(overs))
    }

    #[inline(always)]
    fn moments_with_care(self, simd: S, _: usize, touch: &Touch<S>) -> Moments<S> {
        let mut rows = [[[0.0; LANES]; 2]; 3];
        let mut at = 0;
        while at < LANES {
            let (sums, _) = abreast(
                simd,
                self,
                at,
                #[inline(always)]
                |part: &Part<S>, sums: &mut [Pair<S>; 3]| add_moments(simd, part, touch, sums),
            );
            put(simd, sums, &mut rows, at);
            at += width::<S>();
        }
        let [a, b, d] = joined(simd, rows);
        Moments { a, b, d }
    }
}
