//! A field of many members: sixteen of them abreast, so that one large field costs no more a member than small ones.
//!
//! Every sum is sixteen sums, one for every sixteenth member, added up in a fixed tree; a choice between equals still goes
//! to the lower id. [`Wide`] does that for one frame, a sum a lane; [`super::sixteen::ManyAbreast`] has sixteen frames
//! abreast, and keeps sixteen sums of each.

use fearless_simd::Level;
use fearless_simd::prelude::*;

use super::axis::{self, Moments};
use super::centroid;
use super::contact::{self, Sums};
use super::lines::Lines;
use super::lot::{Between, Wanted, touch};
use super::orientation::{Apart, point};
use super::simd::{F, LANES, M, Row, U, load, load_u, splat, splat_u, store, store_u, width, with_widest};
use super::touch::{Cells, Members, OneKind, Part, Sweep, Touch};
use crate::scene::Plan;
use crate::stage::calibrate::UNUSABLE;

/// A wide field's members in rows of [`LANES`], the last one filled up with unpressed ones.
#[derive(Clone, Debug, Default)]
pub(super) struct Table {
    pub(super) slots: Vec<u32>,
    weights: Lines<f32>,
    u: Lines<f32>,
    v: Lines<f32>,
    depths: Lines<f32>,
    areas: Lines<f32>,
}

impl Table {
    /// Of members with slot, weight, u, v, depth and area.
    pub(super) fn new(members: impl ExactSizeIterator<Item = (u32, [f32; 5])>) -> Self {
        let rows = members.len().div_ceil(LANES);
        let blank = Lines::new(rows, 0.0);
        let mut table = Self {
            slots: Vec::with_capacity(members.len()),
            weights: blank.clone(),
            u: blank.clone(),
            v: blank.clone(),
            depths: blank.clone(),
            areas: blank,
        };
        for (index, (slot, [weight, u, v, depth, area])) in members.enumerate() {
            let (row, lane) = (index / LANES, index % LANES);
            table.slots.push(slot);
            table.weights[row][lane] = weight;
            table.u[row][lane] = u;
            table.v[row][lane] = v;
            table.depths[row][lane] = depth;
            table.areas[row][lane] = area;
        }
        table
    }
}

/// Its values in one frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Values {
    pressures: Lines<f32>,
    statuses: Lines<u32>,
}

impl Values {
    /// Reads the pressures and, where `faults` says so, statuses of `table`'s taxels.
    pub(super) fn gather(
        &mut self,
        table: &Table,
        faults: bool,
        pressure: impl Fn(usize) -> f32,
        status: impl Fn(usize) -> u32,
    ) {
        self.pressures.make(table.weights.len(), 0.0);
        self.statuses.make(table.weights.len(), 0);
        for (row, slots) in self.pressures.iter_mut().zip(table.slots.chunks(LANES)) {
            row[slots.len()..].fill(0.0);
            for (value, &slot) in row.iter_mut().zip(slots) {
                *value = pressure(slot as usize);
            }
        }
        if faults {
            for (row, slots) in self.statuses.iter_mut().zip(table.slots.chunks(LANES)) {
                // What is not there does not keep the others from being all unusable.
                row[slots.len()..].fill(UNUSABLE);
                for (value, &slot) in row.iter_mut().zip(slots) {
                    *value = status(slot as usize);
                }
            }
        }
    }
}

/// A wide field in one frame: every lane of an answer is the field's.
#[derive(Clone, Copy)]
pub(super) struct Wide<'a> {
    pub(super) table: &'a Table,
    pub(super) values: &'a Values,
}

impl<S: Simd> Members<S> for Wide<'_> {
    #[inline(always)]
    fn count(self) -> usize {
        self.table.weights.len()
    }

    #[inline(always)]
    fn part(self, simd: S, member: usize, at: usize) -> Part<S> {
        let pressure = load(simd, &self.values.pressures[member], at);
        Part {
            pressure,
            pull: load(simd, &self.table.weights[member], at) * pressure,
            u: load(simd, &self.table.u[member], at),
            v: load(simd, &self.table.v[member], at),
        }
    }

    #[inline(always)]
    fn depth(self, simd: S, member: usize, at: usize) -> F<S> {
        load(simd, &self.table.depths[member], at)
    }

    #[inline(always)]
    fn area(self, simd: S, member: usize, at: usize) -> F<S> {
        load(simd, &self.table.areas[member], at)
    }

    #[inline(always)]
    fn status(self, simd: S, member: usize, at: usize) -> U<S> {
        load_u(simd, &self.values.statuses[member], at)
    }
}

/// All stages for one cell of a wide field, whose answer is the first lane of `cells`.
#[inline(never)]
pub(super) fn cell(level: Level, plan: &Plan, field: Wide<'_>, kind: &OneKind, faults: bool, cells: &mut Cells) {
    let wanted = Wanted { stages: plan.stages(), outputs: plan.columns, faults, care: plan.is_compensated() };
    let (mut between, cells) = (Between::EMPTY, std::slice::from_mut(cells));
    let between = std::slice::from_mut(&mut between);
    with_widest!(level, simd => touch(simd, |_| (field, kind), 1, wanted, between, cells));
}

/// The sum of all lanes, as a tree.
#[inline(always)]
pub(super) fn add_up(mut row: Row<f32>) -> f32 {
    let mut half = LANES / 2;
    while half > 0 {
        for lane in 0..half {
            row[lane] += row[lane + half];
        }
        half /= 2;
    }
    row[0]
}

impl<S: Simd> Sweep<S> for Wide<'_> {
    #[inline(always)]
    fn sums(self, simd: S, _: usize, centroid: bool) -> Sums<S> {
        let (mut rows, mut active) = ([[0.0; LANES]; 3], [0; LANES]);
        let mut at = 0;
        while at < LANES {
            let [sums] = contact::sums(simd, self, at, centroid);
            store(simd, sums.total, &mut rows[0], at);
            store_u(simd, sums.active, &mut active, at);
            store(simd, sums.u, &mut rows[1], at);
            store(simd, sums.v, &mut rows[2], at);
            at += width::<S>();
        }
        let all = |row: Row<f32>| splat(simd, add_up(row));
        let active = splat_u(simd, active.iter().sum());
        Sums { total: all(rows[0]), active, u: all(rows[1]), v: all(rows[2]) }
    }

    #[inline(always)]
    fn peak_and_area(self, simd: S, _: usize) -> (F<S>, F<S>) {
        let mut rows = [[0.0; LANES]; 2];
        let mut at = 0;
        while at < LANES {
            let (peak, area) = contact::peak_and_area(simd, self, at);
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
            let (any, all) = contact::statuses(simd, self, at);
            store_u(simd, any, &mut rows[0], at);
            store_u(simd, all, &mut rows[1], at);
            at += width::<S>();
        }
        let any = rows[0].into_iter().fold(0, |any, status| any | status);
        let all = rows[1].into_iter().fold(UNUSABLE, |all, status| all & status);
        (splat_u(simd, any & !UNUSABLE), splat_u(simd, all).simd_gt(splat_u(simd, 0)))
    }

    #[inline(always)]
    fn depth(self, simd: S, _: usize) -> F<S> {
        let mut row = [0.0; LANES];
        let mut at = 0;
        while at < LANES {
            store(simd, centroid::depth(simd, self, at), &mut row, at);
            at += width::<S>();
        }
        splat(simd, add_up(row))
    }

    #[inline(always)]
    fn farthest(self, simd: S, _: usize, touch: &Touch<S>) -> Apart<S> {
        let (none, unset) = (splat(simd, 0.0), splat(simd, -1.0));
        let mut third = -1.0_f32;
        let mut candidates = [Candidate::NONE; 2 * LANES];
        let mut at = 0;
        while at < LANES {
            let (mut r1, mut r2, mut r3) = (unset, unset, unset);
            let (mut x1, mut y1, mut x2, mut y2) = (none, none, none, none);
            let (mut i1, mut i2) = (splat_u(simd, 0), splat_u(simd, 0));
            for member in 0..Members::<S>::count(self) {
                let (r, x, y) = point::<S, Self, true>(simd, self, member, at, touch);
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
        Apart {
            r: [first.r, second.r, third].map(
                #[inline(always)]
                |r| splat(simd, r),
            ),
            x: splat(simd, first.x - second.x),
            y: splat(simd, first.y - second.y),
        }
    }

    #[inline(always)]
    fn moments(self, simd: S, _: usize, touch: &Touch<S>) -> Moments<S> {
        let mut rows = [[0.0; LANES]; 3];
        let mut at = 0;
        while at < LANES {
            let sums = axis::moments(simd, self, at, touch);
            store(simd, sums.a, &mut rows[0], at);
            store(simd, sums.b, &mut rows[1], at);
            store(simd, sums.d, &mut rows[2], at);
            at += width::<S>();
        }
        let all = |row: Row<f32>| splat(simd, add_up(row));
        Moments { a: all(rows[0]), b: all(rows[1]), d: all(rows[2]) }
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
