//! What stages' formulas read in lanes: members of fields, sums over them, and what fields are like.

use fearless_simd::prelude::*;

use super::lanes::{F, LANES, Lines, M, Row, U, load, load_u, splat, splat_u};
use crate::percept::{Flags, Outputs};
use crate::scene::{Plan, PlanField};
use crate::stage::layout::Member;

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
    fn any_charted(&self) -> bool;
    fn any_uncharted(&self) -> bool;
    fn lanes(&self, simd: S, at: usize) -> KindLanes<S>;
}

/// What fields are like, a lane each.
#[derive(Clone, Copy)]
pub(super) struct KindLanes<S: Simd> {
    /// Those that a field always has.
    pub(super) flags: U<S>,
    /// The sums it can give.
    pub(super) sums: U<S>,
    /// What it can give with its centroid.
    pub(super) found: U<S>,
    pub(super) unit_m: F<S>,
}

/// Every lane's field is the same.
#[derive(Clone, Copy, Debug)]
pub(super) struct OneKind {
    charted: bool,
    flags: u32,
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
            flags: if field.charted { Flags::empty() } else { Flags::NO_CHART }.bits(),
            sums: if field.area_known { sums | Outputs::AREA } else { sums }.low(),
            found: if field.charted { in_chart } else { Outputs::POSITION }.low(),
            unit_m: field.unit_m,
        }
    }

    /// Flags and quantities of a field that nothing presses.
    pub(super) fn untouched(&self) -> (u32, u32) {
        (self.flags | Flags::NO_CONTACT.bits(), self.sums)
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
    fn lanes(&self, simd: S, _: usize) -> KindLanes<S> {
        KindLanes {
            flags: splat_u(simd, self.flags),
            sums: splat_u(simd, self.sums),
            found: splat_u(simd, self.found),
            unit_m: splat(simd, self.unit_m),
        }
    }
}

/// Every lane has a field of its own; lanes without one are charted and give nothing.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Kinds {
    any_charted: bool,
    any_uncharted: bool,
    flags: Row<u32>,
    sums: Row<u32>,
    found: Row<u32>,
    unit_m: Row<f32>,
}

impl Kinds {
    pub(super) fn new<'a>(fields: impl Iterator<Item = &'a PlanField>) -> Self {
        let none = [0; LANES];
        let (any_charted, any_uncharted, unit_m) = (false, false, [1.0; LANES]);
        let mut kinds = Self { any_charted, any_uncharted, flags: none, sums: none, found: none, unit_m };
        for (lane, kind) in fields.map(OneKind::new).enumerate() {
            kinds.any_charted |= kind.charted;
            kinds.any_uncharted |= !kind.charted;
            kinds.flags[lane] = kind.flags;
            kinds.sums[lane] = kind.sums;
            kinds.found[lane] = kind.found;
            kinds.unit_m[lane] = kind.unit_m;
        }
        kinds
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
    fn lanes(&self, simd: S, at: usize) -> KindLanes<S> {
        KindLanes {
            flags: load_u(simd, &self.flags, at),
            sums: load_u(simd, &self.sums, at),
            found: load_u(simd, &self.found, at),
            unit_m: load(simd, &self.unit_m, at),
        }
    }
}

/// Members of one frame in rows: one of each of sixteen fields, or sixteen of a wide field.
#[derive(Clone, Debug)]
pub(super) struct MemberRows {
    /// Where each has its value. What fills up rows has that of no taxel: unpressed, and unusable, so that it does not keep
    /// the others from being all unusable.
    slots: Lines<u32>,
    places: Vec<PlaceRow>,
    /// None where all are 1.
    weights: Option<Lines<f32>>,
    depths: Lines<f32>,
    areas: Lines<f32>,
}

#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct PlaceRow {
    u: Row<f32>,
    v: Row<f32>,
}

impl MemberRows {
    /// `rows` rows of nobody, whose value is in slot `unpressed`.
    fn new(rows: usize, unpressed: usize, weighted: bool) -> Self {
        let blank = Lines::new(rows, 0.0);
        Self {
            slots: Lines::new(rows, unpressed as u32),
            places: vec![PlaceRow { u: [0.0; LANES], v: [0.0; LANES] }; rows],
            weights: weighted.then(|| blank.clone()),
            depths: blank.clone(),
            areas: blank,
        }
    }

    /// The rows of `fields`, up to sixteen, a lane each.
    pub(super) fn of_each(plan: &Plan, fields: &[usize], unpressed: usize) -> Self {
        let fields = fields.iter().map(|&field| &plan.fields[field]);
        let count = fields.clone().map(|field| field.count).max().unwrap_or(0);
        let mut rows = Self::new(count, unpressed, !fields.clone().all(|field| field.unweighted));
        for (lane, field) in fields.enumerate() {
            (0..field.count).for_each(|member| rows.set(plan, field, member, (member, lane)));
        }
        rows
    }

    /// The rows of `field`, with the weights of its members.
    pub(super) fn of_one(plan: &Plan, field: &PlanField, unpressed: usize) -> Self {
        let mut rows = Self::new(field.count.div_ceil(LANES), unpressed, true);
        (0..field.count).for_each(|member| rows.set(plan, field, member, (member / LANES, member % LANES)));
        rows
    }

    fn set(&mut self, plan: &Plan, field: &PlanField, index: usize, (row, lane): (usize, usize)) {
        let Member { slot, weight, u, v } = plan.members_of(field)[index];
        self.slots[row][lane] = slot;
        if let Some(weights) = &mut self.weights {
            weights[row][lane] = weight;
        }
        self.places[row].u[lane] = u;
        self.places[row].v[lane] = v;
        self.depths[row][lane] = field.depths[index];
        self.areas[row][lane] = plan.taxels[slot as usize].area;
    }

    pub(super) fn count(&self) -> usize {
        self.places.len()
    }

    pub(super) fn is_weighted(&self) -> bool {
        self.weights.is_some()
    }

    /// Has weights from now on, of 1 if it had none.
    pub(super) fn weigh(&mut self) {
        self.weights.get_or_insert_with(|| Lines::new(self.places.len(), 1.0));
    }

    /// Brings its members' values side by side.
    pub(super) fn gather<T: Copy>(&self, values: &[T], rows: &mut [Row<T>]) {
        for (row, slots) in rows.iter_mut().zip(&self.slots[..]) {
            for (value, &slot) in row.iter_mut().zip(slots) {
                *value = values[slot as usize];
            }
        }
    }
}

/// Members with their values; `WEIGHTED` where weights are not all 1.
#[derive(Clone, Copy)]
pub(super) struct InFrame<'a, const WEIGHTED: bool> {
    rows: &'a MemberRows,
    weights: &'a [Row<f32>],
    pressures: &'a [Row<f32>],
    statuses: &'a [Row<u32>],
}

impl<'a, const WEIGHTED: bool> InFrame<'a, WEIGHTED> {
    pub(super) fn new(rows: &'a MemberRows, pressures: &'a [Row<f32>], statuses: &'a [Row<u32>]) -> Self {
        Self { rows, weights: rows.weights.as_deref().unwrap_or_default(), pressures, statuses }
    }
}

impl<S: Simd, const WEIGHTED: bool> Members<S> for InFrame<'_, WEIGHTED> {
    #[inline(always)]
    fn count(self) -> usize {
        self.rows.count()
    }

    #[inline(always)]
    fn sample(self, simd: S, member: usize, at: usize) -> Sample<S> {
        let PlaceRow { u, v } = &self.rows.places[member];
        let pressure = load(simd, &self.pressures[member], at);
        Sample {
            pressure,
            pull: if WEIGHTED { load(simd, &self.weights[member], at) * pressure } else { pressure },
            u: load(simd, u, at),
            v: load(simd, v, at),
        }
    }

    #[inline(always)]
    fn depth(self, simd: S, member: usize, at: usize) -> F<S> {
        load(simd, &self.rows.depths[member], at)
    }

    #[inline(always)]
    fn area(self, simd: S, member: usize, at: usize) -> F<S> {
        load(simd, &self.rows.areas[member], at)
    }

    #[inline(always)]
    fn status(self, simd: S, member: usize, at: usize) -> U<S> {
        load_u(simd, &self.statuses[member], at)
    }
}

/// The lanes' touches, as they are known after the centroid.
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
