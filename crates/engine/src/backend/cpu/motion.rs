//! motion in lanes, sixteen fields of a frame abreast; see [`crate::stage::motion`].
//!
//! A cell's motion needs the cell of the same field in the frame before, and nothing else: runs of frames are computed on
//! all cores, each from the last frame of the run before it.

use bytemuck::{cast_slice, cast_slice_mut};
use fearless_simd::Level;
use fearless_simd::prelude::*;
use glam::DVec2;

use super::super::Step;
use super::lanes::{
    F, I, LANES, Row, bits_where, load, load_u, of_direction, splat, splat_u, store, store_u, width, with_widest,
};
use crate::parallel;
use crate::percept::{CellsMut, Component, Flags, Outputs};
use crate::scene::Plan;
use crate::stage::motion::Centroid;

/// Flags of a cell without a centroid to measure motion from.
const NOWHERE: Flags = Flags::NO_CONTACT.union(Flags::NO_CHART);

/// What this stage fills.
const PARTS: [Component; 7] = [
    Component::DisplacementU,
    Component::DisplacementV,
    Component::Direction,
    Component::Distance,
    Component::RadialDistance,
    Component::Speed,
    Component::RadialSpeed,
];

/// Cells that a thread takes at least: some ten microseconds' worth.
const CELLS_A_TASK: usize = 1 << 12;

/// What motion has to know of every field, field by field.
#[derive(Clone, Debug)]
pub(super) struct Fields {
    /// 1/unit, 1/m; a power of two, so that it loses nothing.
    per_unit: Vec<f32>,
    unit_m: Vec<f32>,
    /// [`Still`](crate::stage::layout::Still), part by part.
    least: Vec<f32>,
    rounding: Vec<f32>,
    per_taxel: Vec<f32>,
}

impl Fields {
    pub(super) fn new(plan: &Plan) -> Self {
        Self {
            per_unit: plan.fields.iter().map(|field| 1.0 / field.unit_m).collect(),
            unit_m: plan.fields.iter().map(|field| field.unit_m).collect(),
            least: plan.fields.iter().map(|field| field.still.least).collect(),
            rounding: plan.fields.iter().map(|field| field.still.rounding).collect(),
            per_taxel: plan.fields.iter().map(|field| field.still.per_taxel).collect(),
        }
    }
}

/// A frame's contacts, pressed taxels and centroids, field by field: what the motion of the next frame starts from.
#[derive(Clone, Debug, Default)]
pub(super) struct Before {
    flags: Vec<u32>,
    pressed: Vec<u32>,
    u: Vec<f32>,
    v: Vec<f32>,
}

impl Before {
    /// Of fields with these centroids, m; `None` is a field out of contact or without a chart.
    pub(super) fn new(centroids: impl Iterator<Item = Option<Centroid>>) -> Self {
        let mut before = Self::default();
        for centroid in centroids {
            let flags = if centroid.is_some() { Flags::empty() } else { Flags::NO_CONTACT };
            let Centroid { place, pressed } = centroid.unwrap_or_default();
            before.flags.push(flags.bits());
            before.pressed.push(pressed);
            before.u.push(place.x as f32);
            before.v.push(place.y as f32);
        }
        before
    }

    /// The fields' centroids, m; `None` where motion has nothing to start from.
    pub(super) fn centroids(&self) -> impl Iterator<Item = Option<Centroid>> + '_ {
        let places = self.u.iter().zip(&self.v).map(|(&u, &v)| DVec2::new(u.into(), v.into()));
        self.flags
            .iter()
            .zip(&self.pressed)
            .zip(places)
            .map(|((&flags, &pressed), place)| (flags & NOWHERE.bits() == 0).then_some(Centroid { place, pressed }))
    }

    fn copy(&mut self, cells: &CellsMut<'_>, frame: usize) {
        let row = frame * self.flags.len()..(frame + 1) * self.flags.len();
        self.flags.copy_from_slice(cast_slice(&cells.flags[row.clone()]));
        self.pressed.copy_from_slice(&cells.active[row.clone()]);
        self.u.copy_from_slice(&cells[Component::CentroidU][row.clone()]);
        self.v.copy_from_slice(&cells[Component::CentroidV][row]);
    }

    fn row(&self) -> RowBefore<'_> {
        RowBefore { flags: &self.flags, pressed: &self.pressed, u: &self.u, v: &self.v }
    }
}

/// [`Before`], wherever it lies.
#[derive(Clone, Copy)]
struct RowBefore<'a> {
    flags: &'a [u32],
    pressed: &'a [u32],
    u: &'a [f32],
    v: &'a [f32],
}

/// The motion of all of `cells`, which start after frame `before` and leave it their last one.
pub(super) fn all_frames(
    level: Level,
    outputs: Outputs,
    fields: &Fields,
    steps: &[Step],
    mut cells: CellsMut<'_>,
    before: &mut Before,
) {
    let (count, frames) = (cells.fields(), cells.frames());
    if count == 0 || frames == 0 {
        return;
    }
    let threads = parallel::threads().min((count * frames).div_ceil(CELLS_A_TASK));
    if threads < 2 {
        run_of_frames(level, outputs, fields, steps, &mut cells, before);
        before.copy(&cells, frames - 1);
        return;
    }
    let a_run = frames.div_ceil(4 * threads).max(CELLS_A_TASK.div_ceil(count));
    let mut runs = Vec::new();
    let (mut rest, mut from) = (cells, std::mem::take(before));
    for steps in steps.chunks(a_run) {
        let mut next = from.clone();
        next.copy(&rest, steps.len() - 1);
        let (run, later) = rest.split_at(steps.len());
        runs.push((run, steps, std::mem::replace(&mut from, next)));
        rest = later;
    }
    parallel::for_each(threads, runs, |(mut run, steps, from)| {
        run_of_frames(level, outputs, fields, steps, &mut run, &from);
    });
    *before = from;
}

/// The motion of frames that follow each other, from frame `before` on.
fn run_of_frames(
    level: Level,
    outputs: Outputs,
    fields: &Fields,
    steps: &[Step],
    cells: &mut CellsMut<'_>,
    before: &Before,
) {
    let count = cells.fields();
    let CellsMut { flags, present, active, parts, .. } = cells;
    let flags = cast_slice_mut::<Flags, u32>(flags);
    let mut written = PARTS.map(|part| std::mem::take(&mut parts[part as usize]));
    let (u, v) = (&parts[Component::CentroidU as usize], &parts[Component::CentroidV as usize]);
    with_widest!(level, simd => {
        for (frame, step) in steps.iter().enumerate() {
            let start = frame * count;
            let (earlier, now) = flags.split_at_mut(start);
            let from = match frame.checked_sub(1) {
                None => before.row(),
                Some(last) => {
                    let row = last * count..start;
                    RowBefore {
                        flags: &earlier[row.clone()],
                        pressed: &active[row.clone()],
                        u: &u[row.clone()],
                        v: &v[row],
                    }
                }
            };
            let row = start..start + count;
            let touched = (&active[row.clone()], &u[row.clone()], &v[row.clone()]);
            let mut to = MotionRow {
                flags: &mut now[..count],
                present: &mut present[row.clone()],
                parts: written.each_mut().map(|part| if part.is_empty() { &mut [] } else { &mut part[row.clone()] }),
            };
            for first in (0..count).step_by(LANES) {
                sixteen_fields(simd, outputs, fields, step, from, touched, &mut to, first);
            }
        }
    });
}

/// Where a frame's motion goes, field by field; parts that nobody asked for are empty.
struct MotionRow<'a> {
    flags: &'a mut [u32],
    present: &'a mut [u32],
    /// As [`PARTS`] counts.
    parts: [&'a mut [f32]; PARTS.len()],
}

/// The motion of the fields from `first` on, at most sixteen.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a frame, the one before it, and which fields of them")]
fn sixteen_fields<S: Simd>(
    simd: S,
    outputs: Outputs,
    fields: &Fields,
    step: &Step,
    from: RowBefore<'_>,
    (pressed, u, v): (&[u32], &[f32], &[f32]),
    to: &mut MotionRow<'_>,
    first: usize,
) {
    let count = (u.len() - first).min(LANES);
    let mut found = Found::default();
    let lanes = |column: &[f32]| -> Row<f32> { row(column, first, count, 0.0) };
    let bits = |column: &[u32], rest: u32| -> Row<u32> { row(column, first, count, rest) };
    let (u, v, u0, v0) = (lanes(u), lanes(v), lanes(from.u), lanes(from.v));
    let nobody = NOWHERE.bits();
    let (now, before) = (bits(to.flags, nobody), bits(from.flags, nobody));
    let (per_unit, unit) = (lanes(&fields.per_unit), lanes(&fields.unit_m));
    let (pressed, pressed_before) = (bits(pressed, 0), bits(from.pressed, 0));
    let (least, rounding, per_taxel) = (lanes(&fields.least), lanes(&fields.rounding), lanes(&fields.per_taxel));
    let dt = splat(simd, step.dt_s as f32);
    let none = splat(simd, 0.0);
    let mut at = 0;
    while at < LANES {
        let load = |row: &Row<f32>| load(simd, row, at);
        let count = |row: &Row<u32>| load_u(simd, row, at);
        let is_away = |row: &Row<u32>| (count(row) & nobody).simd_gt(splat_u(simd, 0));
        let (touched, had_previous) = (!is_away(&now), !is_away(&before));
        let no_previous = touched & !had_previous;
        let bad_step = if step.flags.is_empty() { no_previous & !no_previous } else { touched & had_previous };
        let moved = touched & had_previous & !bad_step;
        let (per_unit, unit) = (load(&per_unit), load(&unit));
        let (u, v, u0, v0) = (load(&u) * per_unit, load(&v) * per_unit, load(&u0) * per_unit, load(&v0) * per_unit);
        let (du, dv) = (u - u0, v - v0);
        let distance = (du * du + dv * dv).sqrt();
        let radial = (u * u + v * v).sqrt() - (u0 * u0 + v0 * v0).sqrt();
        let pressed = (count(&pressed) + count(&pressed_before)).bitcast::<I<S>>().to_float::<F<S>>();
        let still = (load(&rounding) + load(&per_taxel) * pressed).max(load(&least));
        let is_still = moved & distance.simd_le(still);
        let directed = moved & !is_still;
        let where_moved = |value: F<S>| moved.select(value, none);
        let mut direction = none;
        if outputs.contains(Outputs::DIRECTION) {
            direction = directed.select(of_direction(simd, du, dv), none);
        }
        let parts = [
            where_moved(du * unit),
            where_moved(dv * unit),
            direction,
            where_moved(distance * unit),
            where_moved(radial * unit),
            where_moved(distance / dt * unit),
            where_moved(radial / dt * unit),
        ];
        let mut i = 0;
        while i < PARTS.len() {
            store(simd, parts[i], &mut found.parts[i], at);
            i += 1;
        }
        let flags = bits_where(simd, no_previous, Flags::NO_PREVIOUS.bits())
            | bits_where(simd, bad_step, step.flags.bits())
            | bits_where(simd, is_still, Flags::STILL.bits());
        store_u(simd, flags, &mut found.flags, at);
        let motion = (Outputs::MOTION - Outputs::DIRECTION) & outputs;
        let present =
            bits_where(simd, moved, motion.low()) | bits_where(simd, directed, (Outputs::DIRECTION & outputs).low());
        store_u(simd, present, &mut found.present, at);
        at += width::<S>();
    }
    let range = first..first + count;
    for (to, found) in [(&mut to.flags, &found.flags), (&mut to.present, &found.present)] {
        to[range.clone()].iter_mut().zip(found).for_each(|(to, found)| *to |= found);
    }
    for (column, found) in to.parts.iter_mut().zip(&found.parts) {
        if !column.is_empty() {
            column[range.clone()].copy_from_slice(&found[..count]);
        }
    }
}

/// What was found of sixteen fields; 0 where there is nothing.
#[derive(Default)]
struct Found {
    flags: Row<u32>,
    present: Row<u32>,
    parts: [Row<f32>; PARTS.len()],
}

/// `count` values of a column from `first` on, and `rest` in the lanes beyond them.
#[inline(always)]
fn row<T: Copy>(column: &[T], first: usize, count: usize, rest: T) -> Row<T> {
    match column[first..].first_chunk() {
        Some(row) if count == LANES => *row,
        _ => {
            let mut row = [rest; LANES];
            row[..count].copy_from_slice(&column[first..first + count]);
            row
        }
    }
}
