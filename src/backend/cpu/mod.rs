//! Backend `cpu`: single precision, up to [`LANES`] frames side by side, all cores.
//!
//! Every lane does the operations of its frame in one fixed order, never fused, so that percepts have the same bits
//! however a recording is cut and whatever instructions the compiler picks.

mod axis;
mod calibrate;
mod centroid;
mod change;
mod contact;
mod hysteresis;
mod motion;
mod orientation;

use super::{Backend, RawBatch, Step};
use crate::error::Result;
use crate::percept::{CellsMut, Outputs, Percepts};
use crate::scene::{Plan, PlanField};
use crate::signal::RawValue;

/// Frames that are computed side by side.
const LANES: usize = 16;
/// Frames that one task takes; a multiple of [`LANES`].
const TASK: usize = 8 * LANES;

/// The backend, with the memory it needs from frame to frame.
pub(crate) struct Cpu {
    plan: Plan,
    single: Scratch<1>,
    /// The raw values of the frame before, where the plan has changes.
    before: Vec<RawValue>,
    /// Per field, whether the frame before was in contact.
    touched: Vec<bool>,
    /// Per field, its centroid in the frame before, in its unit, if that was in contact.
    last: Vec<Option<[f32; 2]>>,
}

impl Cpu {
    pub(crate) fn new(plan: &Plan) -> Self {
        Self {
            plan: plan.clone(),
            single: Scratch::new(plan.slots()),
            before: vec![RawValue::MISSING; plan.channels()],
            touched: vec![false; plan.fields.len()],
            last: vec![None; plan.fields.len()],
        }
    }
}

impl Backend for Cpu {
    fn name(&self) -> &'static str {
        "cpu"
    }

    fn describe(&self) -> String {
        format!("single precision, {} threads", rayon::current_num_threads())
    }

    fn restart(&mut self) {
        self.touched.fill(false);
        self.last.fill(None);
    }

    fn recalibrate(&mut self, plan: &Plan) {
        self.plan.recalibrate(plan);
    }

    fn run(&mut self, raw: &RawBatch<'_>, percepts: &mut Percepts) -> Result<()> {
        let Some(all) = percepts.cells_f32() else { unreachable!("the engine made percepts of this precision") };
        let mut cells = all.split_at(raw.first).1;
        if raw.frames < LANES {
            let mut rest = cells.reborrow();
            let mut before = &self.before[..];
            for (frame, step) in raw.values.chunks_exact(self.plan.channels().max(1)).zip(raw.steps) {
                let (mut first, later) = rest.split_at(1);
                self.single.block(&self.plan, before, frame, std::slice::from_ref(step), &mut first);
                (rest, before) = (later, frame);
            }
        } else {
            batch(&self.plan, &self.before, raw.values, raw.steps, cells.reborrow());
        }
        if self.plan.has_changes() && raw.frames > 0 {
            self.before.copy_from_slice(&raw.values[raw.values.len() - self.plan.channels()..]);
        }
        // What hangs on the frame before goes through the frames in order.
        let stages = self.plan.stages();
        if stages.hysteresis {
            hysteresis::scan(&self.plan, raw.frames, &mut cells, &mut self.touched);
        }
        if stages.motion {
            motion::scan(&self.plan, raw.steps, &mut cells, &mut self.last);
        }
        Ok(())
    }
}

/// Halves the batch until a task remains, and runs the halves in parallel.
fn batch(plan: &Plan, before: &[RawValue], raw: &[RawValue], steps: &[Step], cells: CellsMut<'_>) {
    let (frames, channels) = (steps.len(), plan.channels());
    if frames > TASK {
        let left = (frames / TASK).div_ceil(2) * TASK;
        let (left_raw, right_raw) = raw.split_at(left * channels);
        let (left_steps, right_steps) = steps.split_at(left);
        let between = &left_raw[left_raw.len() - channels..];
        let (left_cells, right_cells) = cells.split_at(left);
        rayon::join(
            || batch(plan, before, left_raw, left_steps, left_cells),
            || batch(plan, between, right_raw, right_steps, right_cells),
        );
        return;
    }
    let mut scratch = Scratch::<LANES>::new(plan.slots());
    let (mut rest, mut before) = (cells, before);
    for (raw, steps) in raw.chunks(LANES * channels).zip(steps.chunks(LANES)) {
        let (mut cells, later) = rest.split_at(steps.len());
        scratch.block(plan, before, raw, steps, &mut cells);
        (rest, before) = (later, &raw[raw.len() - channels..]);
    }
}

/// Pressures and statuses of `L` frames, taxel by taxel.
struct Scratch<const L: usize> {
    pressures: Vec<[f32; L]>,
    statuses: Vec<[u32; L]>,
}

/// What a field's stages know of `L` frames, each filled by the stage of its name.
#[derive(Clone, Copy)]
struct Lanes<const L: usize> {
    /// Flags, as [`crate::percept::Flags`].
    flags: [u32; L],
    /// Quantities present, as [`Outputs`].
    present: [u32; L],
    total: [f32; L],
    peak: [f32; L],
    area: [f32; L],
    active: [u32; L],
    centroid: [[f32; L]; 3],
    orientation: [f32; L],
    axis: [f32; L],
    anisotropy: [f32; L],
}

impl<const L: usize> Scratch<L> {
    fn new(slots: usize) -> Self {
        Self { pressures: vec![[0.0; L]; slots], statuses: vec![[0; L]; slots] }
    }

    /// All stages for `steps.len() ≤ L` frames of `raw`, frame by frame as recordings have them; `before` is the one before.
    fn block(&mut self, plan: &Plan, before: &[RawValue], raw: &[RawValue], steps: &[Step], cells: &mut CellsMut<'_>) {
        let count = steps.len();
        calibrate::lanes(plan, raw, count, &mut self.pressures, &mut self.statuses);
        change::lanes(plan, before, steps, &mut self.pressures, &mut self.statuses);
        if !cells.pressures.is_empty() {
            for (slot, lanes) in self.pressures.iter().enumerate() {
                for lane in 0..count {
                    cells.pressures[lane * plan.slots() + slot] = lanes[lane].into();
                }
            }
        }
        let stages = plan.stages();
        for (index, field) in plan.fields.iter().enumerate() {
            let members = plan.members_of(field);
            let mut lanes = contact::lanes(plan, field, members, &self.pressures, &self.statuses);
            let touched = lanes.active.iter().any(|&active| active > 0);
            if touched && stages.centroid {
                centroid::lanes(field, members, &self.pressures, &mut lanes);
            }
            if touched && stages.orientation && field.charted {
                orientation::lanes(members, &self.pressures, &mut lanes);
            }
            if touched && stages.axis && field.charted {
                axis::lanes(members, &self.pressures, &mut lanes);
            }
            for lane in 0..count {
                store(plan, field, &lanes, lane, cells, lane * plan.fields.len() + index);
            }
        }
    }
}

/// Copies one lane into its cell: lengths in metres, only what was asked for.
fn store<const L: usize>(
    plan: &Plan,
    field: &PlanField,
    lanes: &Lanes<L>,
    lane: usize,
    cells: &mut CellsMut<'_>,
    cell: usize,
) {
    let outputs = plan.columns;
    cells.set_status(cell, lanes.flags[lane], lanes.present[lane] & plan.outputs.bits());
    let write = |output, column: &mut [f32], value: f32| {
        if outputs.contains(output) {
            column[cell] = value;
        }
    };
    write(Outputs::TOTAL, cells.total, lanes.total[lane]);
    write(Outputs::PEAK, cells.peak, lanes.peak[lane]);
    write(Outputs::AREA, cells.area, lanes.area[lane]);
    write(Outputs::ORIENTATION, cells.orientation, lanes.orientation[lane]);
    write(Outputs::AXIS, cells.axis, lanes.axis[lane]);
    write(Outputs::ANISOTROPY, cells.anisotropy, lanes.anisotropy[lane]);
    if outputs.contains(Outputs::ACTIVE) {
        cells.active[cell] = lanes.active[lane];
    }
    if let Some(centroid) = cells.centroid.get_mut(cell) {
        *centroid = lanes.centroid.map(|axis| axis[lane] * field.unit_m);
    }
}

/// The power of two that brings `total` into [1, 2).
fn scale_of(total: f32) -> f32 {
    f32::from_bits((254 << 23) - (total.to_bits() & 0x7F80_0000))
}
