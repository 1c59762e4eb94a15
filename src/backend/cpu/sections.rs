//! A wide field whose taxels are more than a window keeps, section by section.
//!
//! Sixteen frames of a million taxels' pressures are 64 MB: if they are kept, they go to memory once and come back with each
//! pass over the field. Half of that is enough to read the raw values twice, a section after the other: a first time for sums,
//! and once the centroid is known for what hangs on it. Sums go on where the section before left them, in the same order as if all
//! were there, and have the same bits.

use std::ops::Range;

use fearless_simd::Level;
use fearless_simd::prelude::*;

use super::super::Rows;
use super::Tables;
use super::ahead::{Ahead, Coming};
use super::axis::{self, Moments};
use super::batch::{OverFrames, Skin};
use super::compensated::Compensated;
use super::contact::Sums;
use super::in_view::InView;
use super::lot::{Between, Wanted, so_far, touch};
use super::orientation::{Apart, Search, UNSEEN};
use super::simd::{F, LANES, M, Row, U, load, load_u, splat, splat_u, store, store_u, width, with_widest};
use super::sixteen::{BLOCK, add_area, add_depth, add_in_sixteen, add_touch, as_a_tree, calls};
use super::touch::{Cells, Kind, Members, OneKind, Sweep, Touch};
use super::window::{around, tiles_of};
use crate::percept::Outputs;
use crate::scene::{Plan, Stages};
use crate::stage::calibrate::UNUSABLE;

/// Tiles that a section has at most: their raw values, the next ones' and their pressures are 192 KiB.
const TILES: usize = 64;

/// A field, and in which sections it is gone over.
#[derive(Clone, Debug)]
pub(super) struct InSections {
    pub(super) field: usize,
    sections: Vec<Section>,
}

/// Members that follow each other.
#[derive(Clone, Debug)]
struct Section {
    /// Of the field's, from a multiple of [`LANES`] on.
    members: Range<usize>,
    /// Where they have their taxels.
    tiles: Range<usize>,
}

impl InSections {
    /// Field `field` of `plan`, if members that follow each other have taxels that do.
    pub(super) fn new(plan: &Plan, field: usize) -> Option<Self> {
        let members = plan.members_of(&plan.fields[field]);
        let mut sections = Vec::<Section>::new();
        for (index, sixteen) in members.chunks(LANES).enumerate() {
            let (start, tiles) = (index * LANES, tiles_of(sixteen));
            let members = start..start + sixteen.len();
            match sections.last_mut() {
                Some(last) if around(&last.tiles, &tiles).len() <= TILES => {
                    *last = Section { members: last.members.start..members.end, tiles: around(&last.tiles, &tiles) };
                }
                _ if tiles.len() > TILES => return None,
                _ => sections.push(Section { members, tiles }),
            }
        }
        Some(Self { field, sections })
    }

    /// How many tiles are read, each time.
    pub(super) fn tiles(&self) -> usize {
        self.sections.iter().map(|section| section.tiles.len()).sum()
    }
}

/// What was found in sixteen frames of a field, a lane a frame.
pub(super) struct Found {
    /// Whether nothing presses any taxel.
    pub(super) rests: bool,
    pub(super) cells: Cells,
    between: Between,
    sums: Sixteen,
}

/// What goes on from section to section.
struct Sixteen {
    /// As [`add_touch`] has them.
    touch: [[Row<f32>; 4]; LANES],
    area: [[Row<f32>; 1]; LANES],
    depth: [[Row<f32>; 1]; LANES],
    moments: [[Row<f32>; 3]; LANES],
    peak: Row<f32>,
    /// What calibration says of any member, and what it says of all.
    statuses: [Row<u32>; 2],
    search: [Row<f32>; 7],
}

impl Found {
    /// Before the first section.
    pub(super) fn new() -> Box<Self> {
        let sums = Sixteen {
            touch: [[[0.0; LANES]; 4]; LANES],
            area: [[[0.0; LANES]; 1]; LANES],
            depth: [[[0.0; LANES]; 1]; LANES],
            moments: [[[0.0; LANES]; 3]; LANES],
            peak: [0.0; LANES],
            statuses: [[0; LANES], [UNUSABLE; LANES]],
            search: UNSEEN.map(|number| [number; LANES]),
        };
        Box::new(Self { rests: true, cells: Cells::EMPTY, between: Between::EMPTY, sums })
    }
}

/// What is fetched while a section is gone over: the next one's raw values, and members, which are as many bytes as their raw
/// values in four frames.
struct Beside<'a> {
    ahead: Ahead<'a>,
    coming: Coming<'a>,
}

impl Beside<'_> {
    #[inline(always)]
    fn step(&mut self) {
        self.ahead.step();
        self.coming.step();
    }
}

/// All stages for the fields that are gone over in sections, in those `frames` of `raw`, which are at most sixteen.
pub(super) fn go_over(
    level: Level,
    plan: &Plan,
    tables: &Tables,
    raw: Rows<'_>,
    frames: Range<usize>,
    in_view: &mut InView,
    all: &mut [Box<Found>],
) {
    for (InSections { field, sections }, found) in tables.window.in_sections().iter().zip(all) {
        *found = Found::new();
        let brief = &tables.briefs[*field];
        let (kind, seen) = (brief.kind, &tables.seen[brief.members()]);
        let (stages, outputs) = (plan.stages(), plan.columns);
        let sums_only = Stages { orientation: false, axis: false, ..stages };
        let mut wanted = Wanted { stages: sums_only, outputs, faults: false, care: false };
        // Whether calibration says anything of a section's values, and what is fetched while it is gone over.
        let read = |index: usize, steps: usize, in_view: &mut InView| {
            let Section { members, tiles } = &sections[index];
            let next = sections.get(index + 1).unwrap_or(&sections[0]).tiles.clone();
            let faults = in_view.read(level, plan, tables, raw, frames.clone(), tiles.clone());
            let [start, end] = [members.start, members.end].map(|member| seen.len().min(member + BLOCK));
            let ahead = Ahead::new(raw, frames.clone(), next, steps);
            (faults, Beside { ahead, coming: Coming::members(&seen[start..end], LANES) })
        };
        for (index, Section { members, tiles }) in sections.iter().enumerate() {
            let (faults, mut beside) = read(index, calls(members.len()), in_view);
            if in_view.rests(&tables.window, tiles.clone()) {
                // Sums stay what they are, and some members are usable.
                found.sums.statuses[1] = [0; LANES];
                (0..calls(members.len())).for_each(|_| beside.step());
                continue;
            }
            (found.rests, wanted.faults) = (false, wanted.faults | faults);
            let (skin, sums) = (Skin::new(plan, in_view), &mut found.sums);
            let (members_of, members) = (OverFrames::of(&skin, tables, *field), members.clone());
            with_widest!(level, simd => sum_up(simd, members_of, members, wanted, faults, &kind, sums, || beside.step()));
        }
        if found.rests {
            found.cells = Cells::at_rest(&kind);
            continue;
        }
        with_widest!(level, simd => answer(simd, wanted, &kind, found));
        // Without a chart there is nothing to see from a centroid.
        if stages == sums_only || !plan.fields[*field].charted {
            continue;
        }
        wanted.stages = stages;
        for (index, Section { members, .. }) in sections.iter().enumerate() {
            let (_, mut beside) = read(index, members.len().div_ceil(LANES), in_view);
            let skin = Skin::new(plan, in_view);
            let (members_of, members) = (OverFrames::of(&skin, tables, *field), members.clone());
            with_widest!(level, simd => look_from_centroid(simd, members_of, members, stages, &kind, found, || beside.step()));
        }
        with_widest!(level, simd => answer(simd, wanted, &kind, found));
    }
}

/// Goes on with what needs no centroid; `faults` says whether calibration says anything of these members.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "what is summed up, and how")]
fn sum_up<S: Simd>(
    simd: S,
    seen: impl Members<S>,
    members: Range<usize>,
    wanted: Wanted,
    faults: bool,
    kind: &OneKind,
    sums: &mut Sixteen,
    mut meanwhile: impl FnMut(),
) {
    let Wanted { stages, outputs, .. } = wanted;
    for at in (0..LANES).step_by(width::<S>()) {
        go_on(
            simd,
            members.clone(),
            &mut sums.touch,
            at,
            #[inline(always)]
            |member, sums| add_touch(simd, seen, member, at, stages.centroid, sums),
            #[inline(always)]
            || {
                if at == 0 {
                    meanwhile();
                }
            },
        );
        if outputs.intersects(Outputs::PEAK | Outputs::AREA) {
            let mut peak = load(simd, &sums.peak, at);
            for member in members.clone() {
                peak = peak.max(seen.part(simd, member, at).pressure);
            }
            store(simd, peak, &mut sums.peak, at);
            go_on(
                simd,
                members.clone(),
                &mut sums.area,
                at,
                #[inline(always)]
                |member, sums| add_area(simd, seen, member, at, sums),
                #[inline(always)]
                || {},
            );
        }
        if stages.centroid && Kind::<S>::any_uncharted(&kind) {
            go_on(
                simd,
                members.clone(),
                &mut sums.depth,
                at,
                #[inline(always)]
                |member, sums| add_depth(simd, seen, member, at, sums),
                #[inline(always)]
                || {},
            );
        }
        let [mut any, mut all] = [load_u(simd, &sums.statuses[0], at), load_u(simd, &sums.statuses[1], at)];
        if faults {
            for member in members.clone() {
                let status = seen.status(simd, member, at);
                any |= status;
                all &= status;
            }
        } else {
            all = splat_u(simd, 0);
        }
        store_u(simd, any, &mut sums.statuses[0], at);
        store_u(simd, all, &mut sums.statuses[1], at);
    }
}

/// Goes on with what is seen from the centroid.
#[inline(always)]
fn look_from_centroid<S: Simd>(
    simd: S,
    seen: impl Members<S>,
    members: Range<usize>,
    stages: Stages,
    kind: &OneKind,
    found: &mut Found,
    mut meanwhile: impl FnMut(),
) {
    let Found { cells, between, sums, .. } = found;
    for at in (0..LANES).step_by(width::<S>()) {
        let Some(touch) = so_far::<S, 1>(simd, &kind, at, between, cells) else { continue };
        if stages.orientation {
            let mut search = Search::of_numbers(loaded(simd, &sums.search, at));
            for start in members.clone().step_by(LANES) {
                meanwhile();
                search = search.over(simd, seen, start..members.end.min(start + LANES), at, &touch);
            }
            for (row, number) in sums.search.iter_mut().zip(search.numbers()) {
                store(simd, number, row, at);
            }
        }
        if stages.axis {
            go_on(
                simd,
                members.clone(),
                &mut sums.moments,
                at,
                #[inline(always)]
                |member, sums| axis::add(simd, seen, member, at, &touch, sums),
                #[inline(always)]
                || {},
            );
        }
    }
}

/// Adds the parts of some more `members` to lanes of `rows`.
#[inline(always)]
fn go_on<S: Simd, const K: usize>(
    simd: S,
    members: Range<usize>,
    rows: &mut [[Row<f32>; K]; LANES],
    at: usize,
    add: impl Fn(usize, &mut [F<S>; K]),
    meanwhile: impl FnMut(),
) {
    let mut sums = all_loaded(simd, rows, at);
    add_in_sixteen::<S, K>(members, &mut sums, add, meanwhile);
    for (rows, sums) in rows.iter_mut().zip(sums) {
        for (row, sum) in rows.iter_mut().zip(sums) {
            store(simd, sum, row, at);
        }
    }
}

#[inline(always)]
fn all_loaded<S: Simd, const K: usize>(simd: S, rows: &[[Row<f32>; K]; LANES], at: usize) -> [[F<S>; K]; LANES] {
    let mut all = [[splat(simd, 0.0); K]; LANES];
    for (all, rows) in all.iter_mut().zip(rows) {
        *all = loaded(simd, rows, at);
    }
    all
}

#[inline(always)]
fn loaded<S: Simd, const K: usize>(simd: S, rows: &[Row<f32>; K], at: usize) -> [F<S>; K] {
    let mut all = [splat(simd, 0.0); K];
    for (lanes, row) in all.iter_mut().zip(rows) {
        *lanes = load(simd, row, at);
    }
    all
}

/// The stages that `wanted` says, from the sums that there are.
#[inline(always)]
fn answer<S: Simd>(simd: S, wanted: Wanted, kind: &OneKind, found: &mut Found) {
    let Found { cells, between, sums, .. } = found;
    let (between, cells) = (std::slice::from_mut(between), std::slice::from_mut(cells));
    touch(simd, |_| (&*sums, kind), LANES, wanted, || {}, between, cells);
}

impl<S: Simd> Sweep<S> for &Sixteen {
    #[inline(always)]
    fn sums(self, simd: S, at: usize, _: bool) -> Sums<S> {
        let [total, active, u, v] = as_a_tree::<S, 4>(all_loaded(simd, &self.touch, at));
        Sums { total, active: active.to_int::<U<S>>(), u, v }
    }

    #[inline(always)]
    fn peak_and_area(self, simd: S, at: usize) -> (F<S>, F<S>) {
        let [area] = as_a_tree::<S, 1>(all_loaded(simd, &self.area, at));
        (load(simd, &self.peak, at), area)
    }

    #[inline(always)]
    fn statuses(self, simd: S, at: usize) -> (U<S>, M<S>) {
        let [any, all] = [load_u(simd, &self.statuses[0], at), load_u(simd, &self.statuses[1], at)];
        (any & !UNUSABLE, (all & UNUSABLE).simd_gt(splat_u(simd, 0)))
    }

    #[inline(always)]
    fn depth(self, simd: S, at: usize) -> F<S> {
        let [sum] = as_a_tree::<S, 1>(all_loaded(simd, &self.depth, at));
        sum
    }

    #[inline(always)]
    fn farthest(self, simd: S, at: usize, _: &Touch<S>) -> Apart<S> {
        Search::of_numbers(loaded(simd, &self.search, at)).far
    }

    #[inline(always)]
    fn moments(self, simd: S, at: usize, _: &Touch<S>) -> Moments<S> {
        let [a, b, d] = as_a_tree::<S, 3>(all_loaded(simd, &self.moments, at));
        Moments { a, b, d }
    }
}

/// A plan with compensated sums keeps all of its slots, and has no sections.
impl<S: Simd> Compensated<S> for &Sixteen {
    #[inline(always)]
    fn sums_with_care(self, simd: S, at: usize, centroid: bool) -> Sums<S> {
        self.sums(simd, at, centroid)
    }

    #[inline(always)]
    fn depth_with_care(self, simd: S, at: usize) -> F<S> {
        self.depth(simd, at)
    }

    #[inline(always)]
    fn moments_with_care(self, simd: S, at: usize, touch: &Touch<S>) -> Moments<S> {
        self.moments(simd, at, touch)
    }
}
