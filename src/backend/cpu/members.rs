//! What stages' formulas read and write in lanes: members of fields, sums over them, what fields are like, and cells.

use std::ops::{Index, IndexMut};

use fearless_simd::prelude::*;

use super::lanes::{F, LANES, M, Row, U, load, load_u, splat, splat_u, store, store_u};
use crate::percept::{Component, Flags, Outputs};
use crate::scene::PlanField;

/// A member's value and place, a lane each.
pub(super) struct Sample<S: Simd> {
    pub(super) pressure: F<S>,
    /// wP.
    pub(super) pull: F<S>,
    pub(super) u: F<S>,
    pub(super) v: F<S>,
}

/// Where lanes find their fields' members, from lane `at` on.
pub(super) trait Members<S: Simd>: Copy {
    /// The longest lane's number of members; shorter ones go on with pressures of 0.
    fn count(self) -> usize;
    fn sample(self, simd: S, member: usize, at: usize) -> Sample<S>;
    /// The third coordinate.
    fn depth(self, simd: S, member: usize, at: usize) -> F<S>;
    /// m².
    fn area(self, simd: S, member: usize, at: usize) -> F<S>;
    /// The value's calibration status, where any value has one.
    fn status(self, simd: S, member: usize, at: usize) -> U<S>;
}

/// How terms are added up.
pub(super) trait Sum<S: Simd>: Copy {
    /// Vectors that it consists of.
    const VECTORS: usize;
    fn zero(simd: S) -> Self;
    /// Adds `term`, which is 0 where not `counts`.
    fn add(&mut self, term: F<S>, counts: M<S>);
    /// One of its vectors.
    fn vector(self, index: usize) -> F<S>;
    /// Adds another sum's vectors to its own.
    fn join(self, other: Self) -> Self;
    /// The sum, given all its vectors.
    fn value(vectors: impl Fn(usize) -> F<S>) -> F<S>;

    #[inline(always)]
    fn total(self) -> F<S> {
        Self::value(
            #[inline(always)]
            |index| self.vector(index),
        )
    }
}

/// Each term added once.
#[derive(Clone, Copy)]
pub(super) struct OnePass<S: Simd>(F<S>);

impl<S: Simd> Sum<S> for OnePass<S> {
    const VECTORS: usize = 1;

    #[inline(always)]
    fn zero(simd: S) -> Self {
        Self(splat(simd, 0.0))
    }

    #[inline(always)]
    fn add(&mut self, term: F<S>, _: M<S>) {
        self.0 += term;
    }

    #[inline(always)]
    fn vector(self, _: usize) -> F<S> {
        self.0
    }

    #[inline(always)]
    fn join(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }

    #[inline(always)]
    fn value(vectors: impl Fn(usize) -> F<S>) -> F<S> {
        vectors(0)
    }
}

/// Kahan's sum, which carries along what each addition loses; see [`crate::stage::Sums`].
///
/// A member that is not pressed changes nothing, not even what is carried: lanes that have fewer members than others go on
/// with such ones, and have the same bits as without.
#[derive(Clone, Copy)]
pub(super) struct Compensated<S: Simd> {
    sum: F<S>,
    /// What the sum has too much.
    excess: F<S>,
}

impl<S: Simd> Sum<S> for Compensated<S> {
    const VECTORS: usize = 2;

    #[inline(always)]
    fn zero(simd: S) -> Self {
        Self { sum: splat(simd, 0.0), excess: splat(simd, 0.0) }
    }

    #[inline(always)]
    fn add(&mut self, term: F<S>, counts: M<S>) {
        let term = term - self.excess;
        let next = self.sum + term;
        self.excess = counts.select((next - self.sum) - term, self.excess);
        self.sum = counts.select(next, self.sum);
    }

    #[inline(always)]
    fn vector(self, index: usize) -> F<S> {
        if index == 0 { self.sum } else { self.excess }
    }

    #[inline(always)]
    fn join(self, other: Self) -> Self {
        Self { sum: self.sum + other.sum, excess: self.excess + other.excess }
    }

    #[inline(always)]
    fn value(vectors: impl Fn(usize) -> F<S>) -> F<S> {
        vectors(0) - vectors(1)
    }
}

/// What the lanes' fields are like.
pub(super) trait Kind<S: Simd> {
    /// Whether any has a chart.
    fn any_charted(&self) -> bool;
    /// Whether any has none.
    fn any_uncharted(&self) -> bool;
    /// Flags that a field always has.
    fn always(&self, simd: S, at: usize) -> U<S>;
    /// The sums it can give.
    fn sums(&self, simd: S, at: usize) -> U<S>;
    /// What it can give with its centroid.
    fn found(&self, simd: S, at: usize) -> U<S>;
    /// m.
    fn unit_m(&self, simd: S, at: usize) -> F<S>;
}

/// Every lane's field is the same.
#[derive(Clone, Copy, Debug)]
pub(super) struct OneKind {
    charted: bool,
    always: u32,
    sums: u32,
    found: u32,
    unit_m: f32,
}

impl OneKind {
    pub(super) fn new(field: &PlanField) -> Self {
        let sums = Outputs::of_stage("contact") - Outputs::AREA;
        let in_chart = Outputs::of_stage("centroid") | Outputs::of_stage("position");
        Self {
            charted: field.charted,
            always: if field.charted { Flags::empty() } else { Flags::NO_CHART }.bits(),
            sums: if field.area_known { sums | Outputs::AREA } else { sums }.bits(),
            found: if field.charted { in_chart } else { Outputs::POSITION }.bits(),
            unit_m: field.unit_m,
        }
    }

    /// Flags and quantities of a field that nothing presses.
    pub(super) fn untouched(&self) -> (u32, u32) {
        (self.always | Flags::NO_CONTACT.bits(), self.sums)
    }

    /// The cells of such a field.
    pub(super) fn at_rest(&self) -> Cells {
        let (flags, present) = self.untouched();
        Cells { flags: [flags; LANES], present: [present; LANES], ..Cells::EMPTY }
    }
}

impl<S: Simd> Kind<S> for &OneKind {
    #[inline(always)]
    fn any_charted(&self) -> bool {
        self.charted
    }

    #[inline(always)]
    fn any_uncharted(&self) -> bool {
        !self.charted
    }

    #[inline(always)]
    fn always(&self, simd: S, _: usize) -> U<S> {
        splat_u(simd, self.always)
    }

    #[inline(always)]
    fn sums(&self, simd: S, _: usize) -> U<S> {
        splat_u(simd, self.sums)
    }

    #[inline(always)]
    fn found(&self, simd: S, _: usize) -> U<S> {
        splat_u(simd, self.found)
    }

    #[inline(always)]
    fn unit_m(&self, simd: S, _: usize) -> F<S> {
        splat(simd, self.unit_m)
    }
}

/// Every lane has a field of its own; lanes without one are charted and give nothing.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Kinds {
    any_charted: bool,
    any_uncharted: bool,
    always: Row<u32>,
    sums: Row<u32>,
    found: Row<u32>,
    unit_m: Row<f32>,
}

impl Kinds {
    pub(super) const EMPTY: Self = Self {
        any_charted: false,
        any_uncharted: false,
        always: [0; LANES],
        sums: [0; LANES],
        found: [0; LANES],
        unit_m: [1.0; LANES],
    };

    /// Puts `field` into `lane`.
    pub(super) fn set(&mut self, lane: usize, field: &PlanField) {
        let kind = OneKind::new(field);
        self.any_charted |= kind.charted;
        self.any_uncharted |= !kind.charted;
        self.always[lane] = kind.always;
        self.sums[lane] = kind.sums;
        self.found[lane] = kind.found;
        self.unit_m[lane] = kind.unit_m;
    }
}

impl<S: Simd> Kind<S> for &Kinds {
    #[inline(always)]
    fn any_charted(&self) -> bool {
        self.any_charted
    }

    #[inline(always)]
    fn any_uncharted(&self) -> bool {
        self.any_uncharted
    }

    #[inline(always)]
    fn always(&self, simd: S, at: usize) -> U<S> {
        load_u(simd, &self.always, at)
    }

    #[inline(always)]
    fn sums(&self, simd: S, at: usize) -> U<S> {
        load_u(simd, &self.sums, at)
    }

    #[inline(always)]
    fn found(&self, simd: S, at: usize) -> U<S> {
        load_u(simd, &self.found, at)
    }

    #[inline(always)]
    fn unit_m(&self, simd: S, at: usize) -> F<S> {
        load(simd, &self.unit_m, at)
    }
}

/// What the lanes know of their touch so far.
#[derive(Clone, Copy)]
pub(super) struct Touch<S: Simd> {
    /// Number of pressed taxels.
    pub(super) active: U<S>,
    pub(super) touched: M<S>,
    pub(super) total: F<S>,
    /// A power of two that brings the total where squares of its parts are numbers.
    pub(super) scale: F<S>,
    /// In the field's unit.
    pub(super) u: F<S>,
    pub(super) v: F<S>,
}

/// What the stages found, a row each; lengths in metres.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Cells {
    pub(super) flags: Row<u32>,
    pub(super) present: Row<u32>,
    pub(super) active: Row<u32>,
    parts: [Row<f32>; Component::COUNT],
}

impl Cells {
    pub(super) const EMPTY: Self =
        Self { flags: [0; LANES], present: [0; LANES], active: [0; LANES], parts: [[0.0; LANES]; Component::COUNT] };

    /// Stores lanes of a part.
    #[inline(always)]
    pub(super) fn put<S: Simd>(&mut self, simd: S, part: Component, lanes: F<S>, at: usize) {
        store(simd, lanes, &mut self[part], at);
    }

    /// Adds flags and outputs that are present.
    #[inline(always)]
    pub(super) fn say<S: Simd>(&mut self, simd: S, (flags, present): (U<S>, U<S>), at: usize) {
        let flags = load_u(simd, &self.flags, at) | flags;
        store_u(simd, flags, &mut self.flags, at);
        let present = load_u(simd, &self.present, at) | present;
        store_u(simd, present, &mut self.present, at);
    }
}

impl Index<Component> for Cells {
    type Output = Row<f32>;

    #[inline(always)]
    fn index(&self, part: Component) -> &Row<f32> {
        &self.parts[part as usize]
    }
}

impl IndexMut<Component> for Cells {
    #[inline(always)]
    fn index_mut(&mut self, part: Component) -> &mut Row<f32> {
        &mut self.parts[part as usize]
    }
}
