//! Centroids put on the skin, and into the world: [`crate::stage::position`] over a batch.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};

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

/// What poses are applied to: the body's links and how they hang together at rest.
pub(super) struct Links {
    /// Whether poses are heeded.
    pub(super) posed: bool,
    /// The link in whose frame everything is put instead of the world.
    pub(super) in_link: Option<usize>,
    pub(super) index_of: HashMap<String, usize>,
    pub(super) names: Vec<String>,
    pub(super) parent: Vec<Option<usize>>,
    pub(super) world_from_link: Vec<DAffine3>,
}

/// Puts the centroids of `frames` on the skin, which stand in `percepts` from frame `first` on: positions, normals, and
/// whether they are in the world.
pub(super) fn all_frames(plan: &Plan, links: &Links, frames: &[Frame], first: usize, percepts: &mut Percepts) {
    let fields = plan.fields.len();
    let threads = parallel::threads().min((frames.len() * fields).div_ceil(CELLS_A_TASK));
    let mut cells = percepts.place_cells(first, frames.len());
    if threads < 2 {
        run_of_frames(plan, links, frames, &mut cells);
        return;
    }
    let a_run = frames.len().div_ceil(4 * threads).max(CELLS_A_TASK.div_ceil(fields));
    let mut runs = Vec::new();
    for frames in frames.chunks(a_run) {
        let (run, later) = cells.split_at(frames.len() * fields);
        runs.push((frames, run));
        cells = later;
    }
    parallel::for_each(threads, runs, |(frames, mut cells)| run_of_frames(plan, links, frames, &mut cells));
}

fn run_of_frames(plan: &Plan, links: &Links, frames: &[Frame], cells: &mut PlaceCells<'_>) {
    with_widest!(Level::new(), simd => with_vectors_of(simd, plan, links, frames, cells));
}

/// The same; the compiler uses the vectors of whoever calls it.
#[inline(always)]
fn with_vectors_of<S>(_: S, plan: &Plan, links: &Links, frames: &[Frame], cells: &mut PlaceCells<'_>) {
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
                    found.put(links, frames, cells);
                }
            }
        }
    }
    found.put(links, frames, cells);
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
    fn put(&mut self, links: &Links, frames: &[Frame], cells: &mut PlaceCells<'_>) {
        let inverse = self.normals.map(inverse_length);
        for i in 0..self.count {
            let (Some(field), frame, cell) = self.at[i] else { continue };
            let (position, normal) = (self.points[i], unit(self.normals[i], inverse[i], field.surface.as_ref()));
            match links.world_from_anchor(field, &frames[frame]) {
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

impl Links {
    /// world_from_anchor of `field` in `frame`, if that says where it is; the world is the scene's link, where it names one.
    #[inline(always)]
    pub(super) fn world_from_anchor(&self, field: &PlanField, frame: &Frame) -> Option<DAffine3> {
        if frame.pose.is_empty() || !self.posed {
            return None;
        }
        let world_from_anchor = self.world_from(field.anchor?, frame)?;
        match self.in_link {
            None => Some(world_from_anchor),
            Some(link) => Some(self.world_from(link, frame)?.inverse() * world_from_anchor),
        }
    }

    /// world_from_link of `link` in `frame`: its own pose, or that of its nearest ancestor that has one, at rest from
    /// there on. `None` where the frame poses neither.
    fn world_from(&self, link: usize, frame: &Frame) -> Option<DAffine3> {
        let mut at = Some(link);
        while let Some(ancestor) = at {
            let posed = frame.pose.iter().find(|(name, _)| *name == self.names[ancestor]);
            if let Some((_, pose)) = posed {
                let world_from_ancestor = DAffine3::from_rotation_translation(pose.rotation, pose.translation);
                let ancestor_from_link = self.world_from_link[ancestor].inverse() * self.world_from_link[link];
                return Some(world_from_ancestor * ancestor_from_link);
            }
            at = self.parent[ancestor];
        }
        None
    }
}
