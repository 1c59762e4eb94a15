//! A touch in lanes: contact, centroid, orientation and axis of [`LANES`](super::simd::LANES) cells at a time.
//!
//! Whether the lanes are frames of one field or fields of one frame, each does the operations of its own cell in one
//! fixed order, never fused: percepts have the same bits either way, and on every instruction set.

use fearless_simd::prelude::*;

use super::axis::{self, Moments};
use super::centroid;
use super::compensated::Compensated;
use super::contact::{self, Sums};
use super::orientation::{self, Apart};
use super::simd::{F, LANES, M, Row, U, load, load_u, splat, splat_u, width};
use crate::percept::{Flags, Outputs};
use crate::scene::PlanField;
use crate::stage::calibrate::UNUSABLE;

/// A taxel's part in a field, a lane each.
pub(super) struct Part<S: Simd> {
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
    fn part(self, simd: S, member: usize, at: usize) -> Part<S>;
    /// The third coordinate.
    fn depth(self, simd: S, member: usize, at: usize) -> F<S>;
    /// m².
    fn area(self, simd: S, member: usize, at: usize) -> F<S>;
    /// What calibration says of the value, where it said anything of any.
    fn status(self, simd: S, member: usize, at: usize) -> U<S>;
}

/// Goes over all members, once a quantity.
pub(super) trait Sweep<S: Simd>: Compensated<S> {
    /// S, how many are pressed, and the centroid's numerators where `centroid` says so.
    fn sums(self, simd: S, at: usize, centroid: bool) -> Sums<S>;
    /// The same for two vectors of lanes.
    #[inline(always)]
    fn two_sums(self, simd: S, at: usize, centroid: bool) -> [Sums<S>; 2] {
        [self.sums(simd, at, centroid), self.sums(simd, at + width::<S>(), centroid)]
    }
    /// The largest P, and the area of the pressed taxels, m².
    fn peak_and_area(self, simd: S, at: usize) -> (F<S>, F<S>);
    /// What calibration says of the members together, and where it left all of them out.
    fn statuses(self, simd: S, at: usize) -> (U<S>, M<S>);
    /// The numerator of the centroid's third coordinate.
    fn depth(self, simd: S, at: usize) -> F<S>;
    fn farthest(self, simd: S, at: usize, touch: &Touch<S>) -> Apart<S>;
    fn moments(self, simd: S, at: usize, touch: &Touch<S>) -> Moments<S>;
}

/// A cell a lane, each going over its members in their order.
#[derive(Clone, Copy)]
pub(super) struct Abreast<P>(pub(super) P);

impl<S: Simd, P: Members<S>> Sweep<S> for Abreast<P> {
    #[inline(always)]
    fn sums(self, simd: S, at: usize, centroid: bool) -> Sums<S> {
        let [sums] = contact::sums(simd, self.0, at, centroid);
        sums
    }

    #[inline(always)]
    fn two_sums(self, simd: S, at: usize, centroid: bool) -> [Sums<S>; 2] {
        contact::sums(simd, self.0, at, centroid)
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
    fn depth(self, simd: S, at: usize) -> F<S> {
        centroid::depth(simd, self.0, at)
    }

    #[inline(always)]
    fn farthest(self, simd: S, at: usize, touch: &Touch<S>) -> Apart<S> {
        orientation::farthest(simd, self.0, at, touch)
    }

    #[inline(always)]
    fn moments(self, simd: S, at: usize, touch: &Touch<S>) -> Moments<S> {
        axis::moments(simd, self.0, at, touch)
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
        let sums = Outputs::TOTAL | Outputs::PEAK | Outputs::ACTIVE;
        let in_chart = Outputs::CENTROID | Outputs::POSITION | Outputs::NORMAL;
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

/// What the stages found, a row each; lengths in metres.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Cells {
    pub(super) flags: Row<u32>,
    pub(super) present: Row<u32>,
    pub(super) total: Row<f32>,
    pub(super) peak: Row<f32>,
    pub(super) area: Row<f32>,
    pub(super) active: Row<u32>,
    pub(super) u: Row<f32>,
    pub(super) v: Row<f32>,
    pub(super) depth: Row<f32>,
    pub(super) orientation: Row<f32>,
    pub(super) axis: Row<f32>,
    pub(super) anisotropy: Row<f32>,
}

impl Cells {
    pub(super) const EMPTY: Self = Self {
        flags: [0; LANES],
        present: [0; LANES],
        total: [0.0; LANES],
        peak: [0.0; LANES],
        area: [0.0; LANES],
        active: [0; LANES],
        u: [0.0; LANES],
        v: [0.0; LANES],
        depth: [0.0; LANES],
        orientation: [0.0; LANES],
        axis: [0.0; LANES],
        anisotropy: [0.0; LANES],
    };

    /// Those of a field that nothing presses.
    pub(super) fn at_rest(field: &OneKind) -> Self {
        let (flags, present) = field.untouched();
        Self { flags: [flags; LANES], present: [present; LANES], ..Self::EMPTY }
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

/// A line in a field's chart: its angle where there is one, and what is to be said.
pub(super) struct Line<S: Simd> {
    pub(super) angle: F<S>,
    pub(super) flags: U<S>,
    pub(super) present: U<S>,
}
