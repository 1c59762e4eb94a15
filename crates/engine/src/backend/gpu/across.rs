//! The stages that start from the frame before: hysteresis of contact, and motion.

use super::adapter::Device;
use super::columns::Columns;
use super::shaders;
use super::stage::{Over, Stage, table};
use crate::scene::Plan;
use crate::stage::layout;

/// The buffers of these stages.
pub(super) struct Cells<'a> {
    pub(super) batch: &'a wgpu::Buffer,
    pub(super) steps: &'a wgpu::Buffer,
    pub(super) results: &'a wgpu::Buffer,
    pub(super) touched: &'a wgpu::Buffer,
    pub(super) last: &'a wgpu::Buffer,
}

pub(super) fn across_frames(device: &Device, plan: &Plan, columns: &Columns, cells: &Cells<'_>) -> Vec<Stage> {
    let Cells { batch, steps, results, touched, last } = cells;
    let mut stages = Vec::new();
    if plan.stages().hysteresis {
        let thresholds: Vec<[f32; 2]> = plan.fields.iter().map(|f| f.thresholds.rounded()).collect();
        let buffers = [batch, &table(device, "thresholds", &thresholds), results, touched];
        let overrides = columns.of_hysteresis();
        stages.push(Stage::new(device, &shaders::HYSTERESIS, "main", Over::Fields, &overrides, &buffers));
    }
    if plan.stages().motion {
        let still: Vec<layout::Still> = plan.fields.iter().map(|field| field.still).collect();
        let still = table(device, "still", &still);
        let overrides = columns.of_motion();
        let main = [batch, steps, &still, results, last];
        stages.push(Stage::new(device, &shaders::MOTION, "main", Over::Cells, &overrides, &main));
        let keep = [(0, batch), (3, results), (4, last)];
        let keep = keep.map(|(binding, buffer)| (binding, buffer.as_entire_binding()));
        stages.push(Stage::bound(device, &shaders::MOTION, "keep", Over::Fields, &overrides, &keep));
    }
    stages
}
