//! The stages from contact to principal_axis, in their order, over as many cells as there are lanes.
//!
//! Whether the lanes are frames of one field or fields of one frame, each does the operations of its own cell in one
//! fixed order, never fused: percepts have the same bits either way, and on every instruction set. A cell's stages wait for
//! each other: the distances for the centroid's quotient, the angle for roots and another quotient. Taken stage by stage for
//! some sets of cells, a core goes on with the next set's members while one waits.

use fearless_simd::prelude::*;

use super::contact::{self, Sums};
use super::lanes::{F, LANES, M, Row, U, bits_where, load, load_u, splat, splat_u, store, store_u, width};
use super::members::{Compensated, Kind, KindLanes, Members, OnePass, Sum, Touch};
use super::orientation::{self, Farthest};
use super::principal_axis;
use super::write::Answers;
use crate::percept::{Component, Flags, Outputs};
use crate::scene::{Plan, Stages};
use crate::stage::calibrate::UNUSABLE;

/// Goes over all members, once a quantity.
pub(super) trait Sweep<S: Simd>: Copy {
    /// S, how many are pressed, and the centroid's numerators where `centroid` says so.
    fn sums<A: Sum<S>>(self, simd: S, at: usize, centroid: bool) -> Sums<S, F<S>>;
    #[inline(always)]
    fn two_sums<A: Sum<S>>(self, simd: S, at: usize, centroid: bool) -> [Sums<S, F<S>>; 2] {
        [self.sums::<A>(simd, at, centroid), self.sums::<A>(simd, at + width::<S>(), centroid)]
    }
    /// The largest P, and the area of the pressed taxels, m².
    fn peak_and_area(self, simd: S, at: usize) -> (F<S>, F<S>);
    /// The statuses of all members together, and where all of them are unusable.
    fn statuses(self, simd: S, at: usize) -> (U<S>, M<S>);
    /// The numerator of the centroid's third coordinate.
    fn depth<A: Sum<S>>(self, simd: S, at: usize) -> F<S>;
    fn farthest(self, simd: S, at: usize, touch: &Touch<S>) -> Farthest<S>;
    /// a, b and d of the second moments.
    fn moments<A: Sum<S>>(self, simd: S, at: usize, touch: &Touch<S>) -> [F<S>; 3];
}

/// A cell a lane, each going over its members in their order.
#[derive(Clone, Copy)]
pub(super) struct Abreast<P>(pub(super) P);

impl<S: Simd, P: Members<S>> Sweep<S> for Abreast<P> {
    #[inline(always)]
    fn sums<A: Sum<S>>(self, simd: S, at: usize, centroid: bool) -> Sums<S, F<S>> {
        let [sums] = contact::sums::<S, A, P, 1>(simd, self.0, at, centroid);
        sums.totals()
    }

    #[inline(always)]
    fn two_sums<A: Sum<S>>(self, simd: S, at: usize, centroid: bool) -> [Sums<S, F<S>>; 2] {
        let [one, other] = contact::sums::<S, A, P, 2>(simd, self.0, at, centroid);
        [one.totals(), other.totals()]
    }

    #[inline(always)]
    fn peak_and_area(self, simd: S, at: usize) -> (F<S>, F<S>) {
        contact::peak_and_area(simd, self.0, at)
    }

    #[inline(always)]
    fn statuses(self, simd: S, at: usize) -> (U<S>, M<S>) {
        let (any, all) = contact::statuses(simd, self.0, at);
        (any & !UNUSABLE, (all & UNUSABLE).simd_gt(splat_u(simd, 0)))
    }

    #[inline(always)]
    fn depth<A: Sum<S>>(self, simd: S, at: usize) -> F<S> {
        contact::depth::<S, A, P>(simd, self.0, at).total()
    }

    #[inline(always)]
    fn farthest(self, simd: S, at: usize, touch: &Touch<S>) -> Farthest<S> {
        orientation::farthest(simd, self.0, at, touch)
    }

    #[inline(always)]
    fn moments<A: Sum<S>>(self, simd: S, at: usize, touch: &Touch<S>) -> [F<S>; 3] {
        let [a, b, d] = principal_axis::moments::<S, A, P>(simd, self.0, at, touch);
        [a.total(), b.total(), d.total()]
    }
}

/// What is to be computed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    pub(super) stages: Stages,
    /// Columns that no stage or output of these fills are left as they are.
    pub(super) outputs: Outputs,
    /// Whether any value has a status.
    pub(super) faults: bool,
    pub(super) compensated: bool,
}

impl Wanted {
    pub(super) fn new(plan: &Plan, faults: bool) -> Self {
        Self { stages: plan.stages(), outputs: plan.columns, faults, compensated: plan.is_compensated() }
    }
}

/// What a cell's stages leave for later ones, a row each.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Between {
    active: Row<u32>,
    /// The centroid's numerators, then the centroid, in the field's unit.
    u: Row<f32>,
    v: Row<f32>,
    /// What orientation has found, then what principal_axis has.
    found: [Row<f32>; 5],
}

impl Between {
    pub(super) const EMPTY: Self =
        Self { active: [0; LANES], u: [0.0; LANES], v: [0.0; LANES], found: [[0.0; LANES]; 5] };
}

/// All stages for as many sets of cells as `cells` and `between` have, up to lane `lanes` of each; `set` says where a set
/// finds its members, and what its fields are like.
#[inline(always)]
pub(super) fn all_stages<S: Simd, P: Sweep<S>, K: Kind<S>>(
    simd: S,
    set: impl Fn(usize) -> (P, K),
    lanes: usize,
    wanted: Wanted,
    between: &mut [Between],
    answers: &mut [Answers],
) {
    let Wanted { stages, compensated, .. } = wanted;
    // Runs a stage on all sets of fields, one vector of lanes after the other.
    macro_rules! for_each_vector {
        (|$members:pat_param, $kind:ident, $at:ident, $between:ident, $answers:ident| $stage:expr) => {
            for (index, ($answers, $between)) in answers.iter_mut().zip(&mut *between).enumerate() {
                let ($members, $kind) = set(index);
                let mut $at = 0;
                while $at < lanes {
                    $stage;
                    $at += width::<S>();
                }
            }
        };
    }
    for_each_vector!(|members, kind, at, between, answers| {
        let next = at + width::<S>();
        if next >= lanes {
            let sums = match compensated {
                true => members.sums::<Compensated<S>>(simd, at, stages.centroid),
                false => members.sums::<OnePass<S>>(simd, at, stages.centroid),
            };
            find_contact(simd, members, &kind, wanted, at, &sums, between, answers);
        } else {
            let [sums, next_sums] = match compensated {
                true => members.two_sums::<Compensated<S>>(simd, at, stages.centroid),
                false => members.two_sums::<OnePass<S>>(simd, at, stages.centroid),
            };
            find_contact(simd, members, &kind, wanted, at, &sums, between, answers);
            find_contact(simd, members, &kind, wanted, next, &next_sums, between, answers);
            at = next;
        }
    });
    if !stages.centroid {
        return;
    }
    for_each_vector!(|members, kind, at, between, answers| {
        find_centroid(simd, members, &kind, compensated, at, between, answers);
    });
    if stages.orientation {
        for_each_vector!(|members, kind, at, between, answers| {
            if let Some(touch) = charted_touch::<S, 2>(simd, &kind, at, between, answers) {
                let Farthest { r: [r1, r2, r3], x, y } = members.farthest(simd, at, &touch);
                keep(simd, [r1, r2, r3, x, y], at, between);
            }
        });
        for_each_vector!(|_, kind, at, between, answers| {
            if let Some(touch) = charted_touch::<S, 1>(simd, &kind, at, between, answers) {
                let [r1, r2, r3, x, y] = kept(simd, at, between);
                orientation::finish(simd, &touch, &Farthest { r: [r1, r2, r3], x, y }, at, answers);
            }
        });
    }
    if stages.principal_axis {
        for_each_vector!(|members, kind, at, between, answers| {
            if let Some(touch) = charted_touch::<S, 1>(simd, &kind, at, between, answers) {
                let moments = match compensated {
                    true => members.moments::<Compensated<S>>(simd, at, &touch),
                    false => members.moments::<OnePass<S>>(simd, at, &touch),
                };
                keep(simd, moments, at, between);
            }
        });
        for_each_vector!(|_, kind, at, between, answers| {
            if let Some(touch) = charted_touch::<S, 1>(simd, &kind, at, between, answers) {
                principal_axis::finish(simd, &touch, kept(simd, at, between), at, answers);
            }
        });
    }
}

/// Total, contact, peak, area and active; and the centroid's numerators.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a cell, what it is made of, and where")]
fn find_contact<S: Simd, P: Sweep<S>>(
    simd: S,
    members: P,
    kind: &impl Kind<S>,
    wanted: Wanted,
    at: usize,
    sums: &Sums<S, F<S>>,
    between: &mut Between,
    answers: &mut Answers,
) {
    let Wanted { outputs, faults, .. } = wanted;
    let none = splat(simd, 0.0);
    let touched = sums.total.simd_gt(none);
    let KindLanes { flags, sums: mut present, .. } = kind.lanes(simd, at);
    let mut flags = flags | bits_where(simd, !touched, Flags::NO_CONTACT.bits());
    if faults {
        let (statuses, unusable) = members.statuses(simd, at);
        flags |= statuses;
        present = unusable.select(splat_u(simd, 0), present);
    }
    store_u(simd, flags, &mut answers.flags, at);
    store_u(simd, present, &mut answers.present, at);
    answers.put(simd, Component::Total, sums.total, at);
    store_u(simd, sums.active, &mut between.active, at);
    store(simd, sums.u, &mut between.u, at);
    store(simd, sums.v, &mut between.v, at);
    if outputs.intersects(Outputs::PEAK | Outputs::AREA) {
        let (peak, area) = members.peak_and_area(simd, at);
        answers.put(simd, Component::Peak, peak, at);
        answers.put(simd, Component::Area, area, at);
    }
    if outputs.contains(Outputs::ACTIVE) {
        store_u(simd, sums.active, &mut answers.active, at);
    }
    if !(touched.any_true() && kind.any_charted()) {
        for part in orientation::PARTS.into_iter().chain(principal_axis::PARTS) {
            answers.put(simd, part, none, at);
        }
    }
    if !touched.any_true() {
        for part in [Component::CentroidU, Component::CentroidV, Component::CentroidDepth] {
            answers.put(simd, part, none, at);
        }
    }
}

/// The centroid from its numerators, where there is a touch.
#[inline(always)]
fn find_centroid<S: Simd, P: Sweep<S>>(
    simd: S,
    members: P,
    kind: &impl Kind<S>,
    compensated: bool,
    at: usize,
    between: &mut Between,
    answers: &mut Answers,
) {
    let none = splat(simd, 0.0);
    let total = load(simd, &answers[Component::Total], at);
    let touched = total.simd_gt(none);
    if !touched.any_true() {
        return;
    }
    let KindLanes { found, unit_m, .. } = kind.lanes(simd, at);
    let present = load_u(simd, &answers.present, at) | touched.select(found, splat_u(simd, 0));
    store_u(simd, present, &mut answers.present, at);
    let numerators = (load(simd, &between.u, at), load(simd, &between.v, at));
    let (u, v) = contact::quotients(simd, total, numerators, touched);
    store(simd, u, &mut between.u, at);
    store(simd, v, &mut between.v, at);
    answers.put(simd, Component::CentroidU, u * unit_m, at);
    answers.put(simd, Component::CentroidV, v * unit_m, at);
    let depth = if kind.any_uncharted() {
        let charted = (found & Outputs::CENTROID.low()).simd_gt(splat_u(simd, 0));
        let sum = match compensated {
            true => members.depth::<Compensated<S>>(simd, at),
            false => members.depth::<OnePass<S>>(simd, at),
        };
        let depth = sum / total;
        (touched & !charted).select(depth, none) * unit_m
    } else {
        none
    };
    answers.put(simd, Component::CentroidDepth, depth, at);
}

/// Touches in charts as they are known after the centroid, if there are any of `LEAST` taxels and more.
#[inline(always)]
fn charted_touch<S: Simd, const LEAST: u32>(
    simd: S,
    kind: &impl Kind<S>,
    at: usize,
    between: &Between,
    answers: &Answers,
) -> Option<Touch<S>> {
    let total = load(simd, &answers[Component::Total], at);
    let touched = total.simd_gt(splat(simd, 0.0));
    let active = load_u(simd, &between.active, at);
    let enough = if LEAST > 1 { touched & active.simd_ge(splat_u(simd, LEAST)) } else { touched };
    if !(enough.any_true() && kind.any_charted()) {
        return None;
    }
    let charted = (kind.lanes(simd, at).found & Outputs::CENTROID.low()).simd_gt(splat_u(simd, 0));
    Some(Touch {
        active,
        touched: touched & charted,
        total,
        scale: scale_of(simd, total),
        u: load(simd, &between.u, at),
        v: load(simd, &between.v, at),
    })
}

#[inline(always)]
fn keep<S: Simd, const N: usize>(simd: S, found: [F<S>; N], at: usize, between: &mut Between) {
    for (row, found) in between.found.iter_mut().zip(found) {
        store(simd, found, row, at);
    }
}

#[inline(always)]
fn kept<S: Simd, const N: usize>(simd: S, at: usize, between: &Between) -> [F<S>; N] {
    let mut found = [splat(simd, 0.0); N];
    for (found, row) in found.iter_mut().zip(&between.found) {
        *found = load(simd, row, at);
    }
    found
}

/// 1 where `total` is neither under 1 nor so large that squares would be none; the power of two that brings it into [1, 2)
/// elsewhere.
#[inline(always)]
fn scale_of<S: Simd>(simd: S, total: F<S>) -> F<S> {
    const ONE: u32 = 127 << 23;
    const LARGE: u32 = (127 + 40) << 23;
    let exponent = total.bitcast::<U<S>>() & 0x7F80_0000;
    let is_fit = (exponent - splat_u(simd, ONE)).simd_lt(splat_u(simd, LARGE - ONE));
    is_fit.select(splat_u(simd, ONE), splat_u(simd, 2 * ONE) - exponent).bitcast()
}
