//! The stages that turn raw values into pressures, and these into changes.

use super::adapter::Device;
use super::columns::NOTHING;
use super::pack::{HEADER, header};
use super::shaders;
use super::stage::{Over, Stage, UNIFORM, WORKING};
use crate::scene::Plan;
use crate::stage::layout;

/// The buffers of these stages.
pub(super) struct Calibrated<'a> {
    pub(super) batch: &'a wgpu::Buffer,
    pub(super) steps: &'a wgpu::Buffer,
    pub(super) taxels: &'a wgpu::Buffer,
    pub(super) raw: &'a wgpu::Buffer,
    /// The curves of sensors, and their knots.
    pub(super) curves: [&'a wgpu::Buffer; 2],
    /// Pressures and statuses.
    pub(super) to: [&'a wgpu::Buffer; 2],
}

pub(super) struct Calibrating {
    pub(super) stages: Vec<Stage>,
    /// For a plan that ceases to be plain.
    pub(super) fallback: Vec<Stage>,
    /// The raw values of the frame before, if the plan has changes.
    pub(super) before: Option<wgpu::Buffer>,
}

impl Calibrating {
    /// For a plan that is plain or not, whose fields read raw values directly or not.
    pub(super) fn new(device: &Device, plan: &Plan, (plain, direct): (bool, bool), over: &Calibrated<'_>) -> Self {
        let Calibrated { batch, steps, taxels, raw, curves: [curves, knots], to: [pressures, statuses] } = *over;
        let (entry, used) = if plan.curves.curves.is_empty() { ("main", 5) } else { ("curved", 7) };
        let buffers = [batch, taxels, raw, pressures, statuses, curves, knots];
        let calibrated = |plain: bool| {
            let signals = (plan.calibrated() / plan.channels()) as f64;
            let overrides = [("SIGNALS", signals), ("PLAIN", f64::from(u8::from(plain)))];
            Stage::new(device, &shaders::CALIBRATE, entry, Over::Calibrated, &overrides, &buffers[..used])
        };
        let mut stages = if direct { Vec::new() } else { vec![calibrated(plain)] };
        let mut fallback: Vec<Stage> = plain.then(|| calibrated(false)).into_iter().collect();
        if !plan.has_changes() {
            return Self { stages, fallback, before: None };
        }
        // What changes needs the frame before the batch's first: its raw values, calibrated as these are.
        let working = |name: &str, size: u64| device.buffer(name, size, WORKING);
        let before = working("raw before", layout::padded_channels(plan.channels()) as u64 * 4);
        let one = device.buffer("one frame", HEADER, UNIFORM);
        device.queue.write_buffer(&one, 0, bytemuck::bytes_of(&header(plan, 1)));
        let count = plan.calibrated() as u64;
        let pressed = working("pressures before", count * 16);
        let statuses_before = working("statuses before", count * 4);
        let buffers = [&one, taxels, &before, &pressed, &statuses_before, curves, knots];
        for stages in [&mut stages, &mut fallback].into_iter().filter(|stages| !stages.is_empty()) {
            stages.push(stages[0].again(device, Over::CalibratedOnce, &buffers[..used]));
        }
        let buffers = [batch, taxels, steps, &pressed, &statuses_before, pressures, statuses];
        stages.push(Stage::new(device, &shaders::CHANGE, "main", Over::Changes, NOTHING, &buffers));
        Self { stages, fallback, before: Some(before) }
    }
}
