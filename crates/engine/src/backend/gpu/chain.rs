//! The buffers of a plan, and all stages that run over them.

use super::across::{Cells, across_frames};
use super::adapter::Device;
use super::calibrating::{Calibrated, Calibrating};
use super::columns::Columns;
use super::over_fields::{Bound, OverFields};
use super::pack::{HEADER, STEP};
use super::shaders::Values;
use super::shares::Shares;
use super::stage::{Stage, UNIFORM, WORKING, table};
use crate::scene::Plan;
use crate::stage::layout;

/// What stages read and write. Buffers begin as zeros.
pub(super) struct Buffers {
    pub(super) batch: wgpu::Buffer,
    pub(super) steps: wgpu::Buffer,
    pub(super) raw: wgpu::Buffer,
    pub(super) taxels: wgpu::Buffer,
    pub(super) pressures: wgpu::Buffer,
    statuses: wgpu::Buffer,
    pub(super) results: wgpu::Buffer,
    /// Per field, whether the frame before had contact; zero is not a contact.
    pub(super) touched: wgpu::Buffer,
    /// Per field, where its centroid was in the last frame with contact.
    pub(super) last: wgpu::Buffer,
}

impl Buffers {
    /// With room for `capacity` frames, whose raw values are up to `raw_bytes`.
    pub(super) fn new(device: &Device, plan: &Plan, columns: &Columns, capacity: usize, raw_bytes: u64) -> Self {
        let (slots, fields, frames) = (plan.slots() as u64, plan.fields.len() as u64, capacity as u64);
        let quads = layout::padded_quads(capacity) as u64;
        let working = |name: &str, size: u64| device.buffer(name, size, WORKING);
        Self {
            batch: device.buffer("batch", HEADER, UNIFORM),
            steps: working("steps", frames * STEP),
            raw: working("raw", raw_bytes),
            taxels: table(device, "taxels", &plan.taxels),
            pressures: working("pressures", quads * slots * 16),
            statuses: working("statuses", quads * slots * 4),
            results: working("results", frames * fields * 4 * columns.count() as u64),
            touched: working("touched", fields * 4),
            last: working("last", fields * 16),
        }
    }
}

/// Stages in their order.
pub(super) struct Chain {
    pub(super) stages: Vec<Stage>,
    /// If the plan ceases to be plain: how many of the first stages are replaced, and the stages that replace them.
    pub(super) fallback: (usize, Vec<Stage>),
    /// The raw values of the frame before, if the plan has changes.
    pub(super) before: Option<wgpu::Buffer>,
}

impl Chain {
    /// For a plan that is plain or not, whose fields read raw values directly or not.
    pub(super) fn new(
        device: &Device,
        plan: &Plan,
        (plain, direct): (bool, bool),
        shares: &Shares,
        columns: &Columns,
        capacity: usize,
        buffers: &Buffers,
    ) -> Self {
        let Buffers { batch, steps, raw, taxels, pressures, statuses, results, touched, last } = buffers;
        let curves = &table(device, "curves", &plan.curves.curves);
        let knots = &table(device, "knots", &plan.curves.knots);
        let over = Calibrated { batch, steps, taxels, raw, curves: [curves, knots], to: [pressures, statuses] };
        let Calibrating { mut stages, mut fallback, before } = Calibrating::new(device, plan, (plain, direct), &over);
        let tables = OverFields::new(device, plan, shares, columns, capacity);
        let over_fields = |direct: bool| {
            let (values, at) = match direct {
                true => (Values::Raw, (raw.as_entire_binding(), None)),
                false => (Values::Pressures, (pressures.as_entire_binding(), Some(statuses.as_entire_binding()))),
            };
            tables.stages(device, &Bound { batch, taxels, results, values, at })
        };
        let replaced = match direct {
            true => {
                fallback.extend(over_fields(false));
                fallback.len() - 1
            }
            false => fallback.len(),
        };
        stages.extend(over_fields(direct));
        stages.extend(across_frames(device, plan, columns, &Cells { batch, steps, results, touched, last }));
        Self { stages, fallback: (replaced, fallback), before }
    }
}
