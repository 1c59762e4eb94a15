//! Centroids put on the skin, and into the world: [`crate::stage::position`] over a batch.

use std::ops::Range;

use glam::{DAffine3, DVec3};

use super::links::Links;
use super::spread::{Frames, Now};
use crate::backend::cpu::{Level, with_widest};
use crate::parallel;
use crate::percept::{Flags, Percepts, PlaceCells};
use crate::scene::{Plan, PlanField};
use crate::signal::Frame;
use crate::stage::position::{inverse_length, unit};

/// Cells that a thread takes at least: some tens of microseconds' worth.
const CELLS_A_TASK: usize = 1 << 11;
/// Frames in which one field is put on the skin before the next.
const FRAMES_IN_TURN: usize = 16;
/// Cells whose normals are brought to unit length together.
const AT_ONCE: usize = 16;

/// Puts the centroids of `of.frames` on the skin: positions, normals, and whether they are in the world. `now` is memory for what is
/// known of a frame.
pub(super) fn all_frames(of: Frames<'_>, percepts: &mut Percepts, now: &mut Now) {
    let (fields, frames) = (of.plan.fields.len(), of.frames.len());
    let threads = parallel::threads().min((frames * fields).div_ceil(CELLS_A_TASK));
    let mut cells = percepts.place_cells(of.raw.first + of.offset, frames);
    if threads < 2 {
        run_of_frames(of, 0..frames, &mut cells, now);
        return;
    }
    let a_run = frames.div_ceil(4 * threads).max(CELLS_A_TASK.div_ceil(fields));
    let mut runs = Vec::new();
    for start in (0..frames).step_by(a_run) {
        let range = start..frames.min(start + a_run);
        let (run, later) = cells.split_at(range.len() * fields);
        runs.push((range, run));
        cells = later;
    }
    parallel::for_each(threads, runs, |(range, mut cells)| run_of_frames(of, range, &mut cells, &mut Now::default()));
}

fn run_of_frames(of: Frames<'_>, range: Range<usize>, cells: &mut PlaceCells<'_>, now: &mut Now) {
    let (plan, links, frames) = (of.plan, of.links, &of.frames[range.clone()]);
    let first = of.number_of(range.start);
    with_widest!(Level::new(), simd => with_vectors_of(simd, plan, links, (first, frames), cells));
    if !plan.spread_slots.is_empty() {
        link_by_link(of, range, cells, now);
    }
}

/// Places the fields on several links once more, each member by its own link, in the frames that say where links are.
fn link_by_link(of: Frames<'_>, range: Range<usize>, cells: &mut PlaceCells<'_>, now: &mut Now) {
    let fields = of.plan.fields.len();
    now.forget();
    for (row, frame) in range.enumerate().filter(|&(_, frame)| of.links.may_pose(&of.frames[frame])) {
        let in_world = of.links.are_posed(&of.frames[frame]);
        for (index, field) in of.plan.fields.iter().enumerate() {
            let cell = row * fields + index;
            if field.parts.is_empty() || cells.flags[cell].contains(Flags::NO_CONTACT) {
                continue;
            }
            match of.position(field, frame, now) {
                Ok(position) => cells.put(cell, position, DVec3::ZERO, in_world),
                Err(why) => {
                    // Of its touches some may be in the world all the same.
                    cells.put(cell, DVec3::ZERO, DVec3::ZERO, in_world);
                    cells.remove_position(cell, why);
                }
            }
        }
    }
}

/// The same, for `frames`, of which the first has the number `first` in the call; the compiler uses the vectors of whoever calls it.
#[inline(always)]
fn with_vectors_of<S>(
    _: S,
    plan: &Plan,
    links: &Links,
    (first, frames): (usize, &[Frame]),
    cells: &mut PlaceCells<'_>,
) {
    let fields = plan.fields.len();
    let mut found = Found::new();
    // Some frames of a field in turn, so that its surface is at hand.
    for (block, some) in frames.chunks(FRAMES_IN_TURN).enumerate() {
        for (index, field) in plan.fields.iter().enumerate() {
            for frame in block * FRAMES_IN_TURN..block * FRAMES_IN_TURN + some.len() {
                let cell = frame * fields + index;
                if cells.flags[cell].contains(Flags::NO_CONTACT) {
                    cells.put(cell, DVec3::ZERO, DVec3::ZERO, false);
                    continue;
                }
                found.add(field, frame, cell, cells.centroid(cell));
                if found.is_full() {
                    found.put(links, (first, frames), cells);
                }
            }
        }
    }
    found.put(links, (first, frames), cells);
}

/// Cells that were read off their surfaces, whose normals are brought to unit length together: a root and a quotient
/// take as long as all the rest, but for several cells no longer than for one.
struct Found<'a> {
    count: usize,
    at: [(Option<&'a PlanField>, usize, usize); AT_ONCE],
    points: [DVec3; AT_ONCE],
    normals: [DVec3; AT_ONCE],
}

impl<'a> Found<'a> {
    #[inline(always)]
    fn new() -> Self {
        Self { count: 0, at: [(None, 0, 0); AT_ONCE], points: [DVec3::ZERO; AT_ONCE], normals: [DVec3::ZERO; AT_ONCE] }
    }

    #[inline(always)]
    fn add(&mut self, field: &'a PlanField, frame: usize, cell: usize, place: DVec3) {
        (self.points[self.count], self.normals[self.count]) = read(field, place);
        self.at[self.count] = (Some(field), frame, cell);
        self.count += 1;
    }

    #[inline(always)]
    fn is_full(&self) -> bool {
        self.count == AT_ONCE
    }

    #[inline(always)]
    fn put(&mut self, links: &Links, (first, frames): (usize, &[Frame]), cells: &mut PlaceCells<'_>) {
        let inverse = self.normals.map(inverse_length);
        for i in 0..self.count {
            let (Some(field), frame, cell) = self.at[i] else { continue };
            let (position, normal) = (self.points[i], unit(self.normals[i], inverse[i], field.surface.as_ref()));
            match links.world_from_anchor(field, first + frame, &frames[frame]) {
                Some(world) => {
                    let (position, normal) = in_world(&world, position, normal);
                    cells.put(cell, position, normal, true);
                }
                None => cells.put(cell, position, normal, false),
            }
        }
        self.count = 0;
    }
}

/// The point of the skin at `place` (m, in the field's chart or from its origin) and the normal there, not of unit length,
/// both in the anchor.
#[inline(always)]
fn read(field: &PlanField, place: DVec3) -> (DVec3, DVec3) {
    match &field.surface {
        Some(surface) => surface.read(place.truncate()),
        None => (field.origin_in_anchor + place, DVec3::ZERO),
    }
}

/// The same with the unit normal.
pub(super) fn on_skin(field: &PlanField, place: DVec3) -> (DVec3, DVec3) {
    match &field.surface {
        Some(surface) => surface.at(place.truncate()),
        None => (field.origin_in_anchor + place, DVec3::ZERO),
    }
}

pub(super) fn in_world(world_from_anchor: &DAffine3, position: DVec3, normal: DVec3) -> (DVec3, DVec3) {
    (world_from_anchor.transform_point3(position), world_from_anchor.transform_vector3(normal))
}
