//! Backend `gpu`: WGSL compute shaders through wgpu, the only place that knows wgpu.
//!
//! One submission takes a batch: the raw values go up, every stage runs over all fields and frames at once, and the
//! columns that were asked for come back. Pipelines, buffers and bind groups are made once; a call allocates no device
//! memory. On the device a taxel's frames, and a field's, lie side by side, so that neighbouring invocations read
//! neighbouring words whether the batch is one frame or many.

pub(crate) mod adapter;
pub(crate) mod shaders;
mod stage;
mod unpack;

#[cfg(test)]
mod tests;

use std::sync::mpsc;

pub use adapter::{AdapterSummary, adapters};
use bytemuck::cast_slice;

use self::adapter::Device;
use self::shaders::StageShader;
use self::stage::{Over, Stage, groups, table};
use super::{Backend, RawBatch};
use crate::error::{Error, Result};
use crate::percept::{CellsMut, Outputs, Percepts};
use crate::scene::Plan;
use crate::signal::RawValue;
use crate::stage::layout;

/// Invocations a group, as `shaders/shared/layout.wgsl` has it.
const GROUP: u32 = 64;
/// Bytes before the raw values in the upload buffer: the batch's uniform block.
const HEADER: u64 = size_of::<layout::Batch>() as u64;
/// Bytes of a frame's step, which follow.
const STEP: u64 = size_of::<layout::Step>() as u64;

/// The backend, with everything it needs on the device.
pub(crate) struct Gpu {
    plan: Plan,
    device: Device,
    /// Frames that one submission takes at most.
    capacity: usize,
    upload: wgpu::Buffer,
    batch: wgpu::Buffer,
    steps: wgpu::Buffer,
    raw: wgpu::Buffer,
    /// The raw values of the frame before, where the plan has changes.
    before: Option<wgpu::Buffer>,
    taxels: wgpu::Buffer,
    stages: Vec<Stage>,
    /// Number of wide fields.
    wide: u32,
    results: Vec<Column>,
    readback: wgpu::Buffer,
    /// The batch's steps as the device reads them; kept so that a call allocates nothing.
    packed_steps: Vec<layout::Step>,
    packed_row: Vec<RawValue>,
    /// What a restart sets to zero.
    memory: [wgpu::Buffer; 2],
}

/// A result that is read back.
struct Column {
    what: What,
    buffer: wgpu::Buffer,
    /// Bytes a cell, or a taxel.
    stride: u64,
}

impl Column {
    fn bytes_a_frame(&self, slots: u64, fields: u64) -> u64 {
        self.stride * if self.what == What::Pressures { slots } else { fields }
    }
}

#[derive(Clone, Copy, PartialEq)]
enum What {
    Cells,
    Contacts,
    Centroids,
    Orientations,
    Axes,
    Motions,
    /// Per taxel and frame, where every other is per field and frame.
    Pressures,
}

impl Gpu {
    /// The backend for `plan` on the process's device, for calls of about `batch` frames.
    ///
    /// # Errors
    /// No adapter, or a plan whose tables are beyond what every WebGPU device can bind.
    pub(crate) fn new(plan: &Plan, batch: usize) -> Result<Self> {
        Self::on(adapter::shared()?, plan, batch)
    }

    pub(crate) fn on(device: Device, plan: &Plan, batch: usize) -> Result<Self> {
        let limit = device.device.limits().max_storage_buffer_binding_size;
        let (slots, channels, fields) = (plan.slots() as u64, plan.channels() as u64, plan.fields.len() as u64);
        // The widest buffer that shaders bind, and the one that all results come back in.
        let widest = (slots * 4).max(fields * size_of::<layout::Motion>() as u64);
        let back = slots * 4 + fields * (4 + 16 + 16 + 4 + 8 + size_of::<layout::Motion>() as u64);
        let tables = (plan.members.len() * size_of::<layout::Member>()) as u64;
        let knots = (plan.curves.knots.len() * size_of::<layout::Knot>()) as u64;
        if tables > limit || widest > limit || knots > limit {
            return Err(Error::failed(format!(
                "{} memberships and {channels} taxels are more than a GPU binding holds ({limit} bytes); use the cpu backend",
                plan.members.len()
            )));
        }
        let most = (limit / widest).min(device.device.limits().max_buffer_size / back).max(1);
        let capacity = batch.clamp(1, most as usize);
        let frames = capacity as u64;

        let buffer = |name: &str, size: u64, usage: wgpu::BufferUsages, mapped: bool| {
            device.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(name),
                size: size.max(16).next_multiple_of(16),
                usage,
                mapped_at_creation: mapped,
            })
        };
        let working = |name: &str, size: u64| {
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
            buffer(name, size, usage, false)
        };
        let upload = buffer(
            "upload",
            HEADER + frames * (STEP + channels * 4),
            wgpu::BufferUsages::MAP_WRITE | wgpu::BufferUsages::COPY_SRC,
            true,
        );
        let uniform = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
        let batch = buffer("batch", HEADER, uniform, false);
        let steps = working("steps", frames * STEP);
        let raw = working("raw", frames * channels * 4);
        let taxels = table(&device, "taxels", &plan.taxels);
        let gpu_fields: Vec<layout::Field> = plan.fields.iter().map(gpu_field).collect();
        let field_table = table(&device, "fields", &gpu_fields);
        let members = table(&device, "members", &plan.members);
        let all_depths: Vec<f32> = plan.fields.iter().flat_map(|field| field.depths.iter().copied()).collect();
        let depths = table(&device, "depths", &all_depths);
        let pressures = working("pressures", frames * slots * 4);
        let statuses = working("statuses", frames * slots * 4);
        let cells = working("cells", frames * fields * 4);
        let contacts = working("contacts", frames * fields * 16);
        let centroids = working("centroids", frames * fields * 16);
        let orientations = working("orientations", frames * fields * 4);
        let axes = working("axes", frames * fields * 8);
        let motions = working("motions", frames * fields * size_of::<layout::Motion>() as u64);
        let thresholds: Vec<[f32; 2]> = plan.fields.iter().map(|f| [f.thresholds.on, f.thresholds.off]).collect();
        let still: Vec<f32> = plan.fields.iter().map(|field| field.still_within).collect();
        // What the frame before left; buffers begin as zeros, and zero is no contact.
        let (touched, last) = (working("touched", fields * 4), working("last", fields * 16));

        let wide: Vec<u32> =
            (0..).zip(&plan.fields).filter(|(_, field)| field.count > layout::WIDE).map(|(index, _)| index).collect();
        let wide_fields = table(&device, "wide fields", &wide);

        let wanted = plan.stages();
        let (curves, knots) =
            (table(&device, "curves", &plan.curves.curves), table(&device, "knots", &plan.curves.knots));
        let buffers = [&batch, &taxels, &raw, &pressures, &statuses, &curves, &knots];
        let (entry, used) = if plan.curves.curves.is_empty() { ("main", 5) } else { ("curved", 7) };
        let calibrate = Stage::new(&device, &shaders::CALIBRATE, entry, Over::Calibrated, &buffers[..used]);
        let mut stages = Vec::new();
        // What changes needs the frame before the batch's first: its raw values, calibrated as these are.
        let before = plan.has_changes().then(|| working("raw before", channels * 4));
        if let Some(before) = &before {
            let one = buffer("one frame", HEADER, uniform, false);
            device.queue.write_buffer(&one, 0, bytemuck::bytes_of(&header(plan, 1, wide.len() as u32)));
            let calibrated = plan.calibrated() as u64 * 4;
            let (pressed, heard) = (working("pressures before", calibrated), working("statuses before", calibrated));
            let buffers = [&one, &taxels, before, &pressed, &heard, &curves, &knots];
            stages.push(calibrate.again(&device, Over::CalibratedOnce, &buffers[..used]));
            let buffers = [&batch, &taxels, &steps, &pressed, &heard, &pressures, &statuses];
            stages.push(Stage::new(&device, &shaders::CHANGE, "main", Over::Changes, &buffers));
        }
        stages.insert(0, calibrate);
        let mut over_fields = |shader: &StageShader, buffers: [&wgpu::Buffer; 8]| {
            stages.push(Stage::new(&device, shader, "main", Over::Fields, &buffers));
            if !wide.is_empty() {
                let buffers = [&buffers[..], &[&wide_fields]].concat();
                stages.push(Stage::new(&device, shader, "wide", Over::WideFields, &buffers));
            }
        };
        let buffers = [&batch, &taxels, &field_table, &members, &pressures, &statuses, &cells, &contacts];
        over_fields(&shaders::CONTACT, buffers);
        if wanted.centroid {
            let buffers = [&batch, &field_table, &members, &depths, &pressures, &contacts, &cells, &centroids];
            over_fields(&shaders::CENTROID, buffers);
        }
        let line = |result| [&batch, &field_table, &members, &pressures, &contacts, &centroids, &cells, result];
        if wanted.orientation {
            over_fields(&shaders::ORIENTATION, line(&orientations));
        }
        if wanted.axis {
            over_fields(&shaders::AXIS, line(&axes));
        }
        if wanted.hysteresis {
            let buffers = [&batch, &table(&device, "thresholds", &thresholds), &contacts, &cells, &touched];
            stages.push(Stage::new(&device, &shaders::HYSTERESIS, "main", Over::FieldsOnce, &buffers));
        }
        if wanted.motion {
            let still = table(&device, "still", &still);
            let main = [(0, &batch), (1, &steps), (2, &still), (3, &centroids), (4, &cells), (5, &last), (6, &motions)];
            stages.push(Stage::bound(&device, &shaders::MOTION, "main", Over::Fields, &main));
            let keep = [(0, &batch), (3, &centroids), (4, &cells), (5, &last)];
            stages.push(Stage::bound(&device, &shaders::MOTION, "keep", Over::FieldsOnce, &keep));
        }

        let sums = Outputs::TOTAL | Outputs::PEAK | Outputs::ACTIVE | Outputs::AREA;
        let place = Outputs::CENTROID | Outputs::POSITION | Outputs::NORMAL | Outputs::FILTERED;
        let results: Vec<Column> = [
            (true, What::Cells, cells, 4),
            (plan.outputs.intersects(sums), What::Contacts, contacts, 16),
            (plan.outputs.intersects(place), What::Centroids, centroids, 16),
            (wanted.orientation, What::Orientations, orientations, 4),
            (wanted.axis, What::Axes, axes, 8),
            (wanted.motion, What::Motions, motions, size_of::<layout::Motion>() as u64),
            (wanted.touches, What::Pressures, pressures, 4),
        ]
        .into_iter()
        .filter(|(read, ..)| *read)
        .map(|(_, what, buffer, stride)| Column { what, buffer, stride })
        .collect();
        let bytes_back = frames * results.iter().map(|column| column.bytes_a_frame(slots, fields)).sum::<u64>();
        let readback =
            buffer("readback", bytes_back, wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST, false);
        Ok(Self {
            plan: plan.clone(),
            device,
            capacity,
            upload,
            batch,
            steps,
            raw,
            before,
            taxels,
            stages,
            wide: wide.len() as u32,
            results,
            readback,
            packed_steps: Vec::with_capacity(capacity),
            packed_row: Vec::with_capacity(plan.slots()),
            memory: [touched, last],
        })
    }

    /// One submission: `raw.frames` is at most the capacity.
    fn submit(&mut self, raw: &RawBatch<'_>, cells: &mut CellsMut<'_>) -> Result<()> {
        let (frames, slots, fields) = (raw.frames as u32, self.plan.slots() as u32, self.plan.fields.len() as u32);
        let calibrated = self.plan.calibrated() as u32;
        self.packed_steps.clear();
        self.packed_steps.extend(raw.steps.iter().map(|s| layout::Step { dt_s: s.dt_s as f32, flags: s.flags.bits() }));
        let header = header(&self.plan, frames, self.wide);
        let channels = self.plan.channels();
        let size = u64::from(frames) * channels as u64 * 4;
        let lost =
            |e: &dyn std::fmt::Display| Error::failed(format!("{} stopped answering: {e}", self.device.info.name));
        {
            let from = HEADER + u64::from(frames) * STEP;
            let end = from + size;
            let mut mapped = self.upload.get_mapped_range_mut(0..end.next_multiple_of(4)).map_err(|e| lost(&e))?;
            let mut mapped = mapped.slice(..);
            mapped.slice(..HEADER as usize).copy_from_slice(bytemuck::bytes_of(&header));
            mapped.slice(HEADER as usize..from as usize).copy_from_slice(cast_slice(&self.packed_steps));
            for frame in 0..raw.frames {
                self.packed_row.clear();
                self.packed_row.extend(raw.rows.row(frame));
                let at = from as usize + frame * channels * 4;
                mapped.slice(at..at + channels * 4).copy_from_slice(cast_slice(&self.packed_row));
            }
        }
        self.upload.unmap();

        let mut encoder = self.device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(&self.upload, 0, &self.batch, 0, HEADER);
        let steps = u64::from(frames) * STEP;
        encoder.copy_buffer_to_buffer(&self.upload, HEADER, &self.steps, 0, steps);
        encoder.copy_buffer_to_buffer(&self.upload, HEADER + steps, &self.raw, 0, size);
        for stage in &self.stages {
            let mut pass = encoder
                .begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some(stage.name), timestamp_writes: None });
            let count = match stage.over {
                Over::Calibrated => (frames * calibrated).div_ceil(GROUP),
                Over::CalibratedOnce => calibrated.div_ceil(GROUP),
                Over::Changes => (frames * (slots - calibrated)).div_ceil(GROUP),
                Over::Fields => (frames * fields).div_ceil(GROUP),
                Over::WideFields => frames * self.wide,
                Over::FieldsOnce => fields.div_ceil(GROUP),
            };
            let (wide, tall) = groups(count);
            pass.set_pipeline(&stage.pipeline);
            pass.set_bind_group(0, &stage.bound, &[]);
            pass.dispatch_workgroups(wide, tall, 1);
        }
        if let Some(before) = &self.before {
            let row = self.plan.channels() as u64 * 4;
            encoder.copy_buffer_to_buffer(&self.raw, u64::from(frames - 1) * row, before, 0, row);
        }
        let length = |column: &Column| u64::from(frames) * column.bytes_a_frame(u64::from(slots), u64::from(fields));
        let mut end = 0;
        for column in &self.results {
            encoder.copy_buffer_to_buffer(&column.buffer, 0, &self.readback, end, length(column));
            end += length(column);
        }
        self.device.queue.submit([encoder.finish()]);

        let (told, outcome) = mpsc::channel();
        let told_too = told.clone();
        self.readback.map_async(wgpu::MapMode::Read, 0..end, move |result| {
            let _ = told.send(result);
        });
        self.upload.map_async(wgpu::MapMode::Write, .., move |result| {
            let _ = told_too.send(result);
        });
        self.device.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| lost(&e))?;
        for _ in 0..2 {
            outcome.recv().map_err(|e| lost(&e))?.map_err(|e| lost(&e))?;
        }
        {
            let mapped = self.readback.get_mapped_range(0..end).map_err(|e| lost(&e))?;
            let mut start = 0;
            for column in &self.results {
                let length = length(column) as usize;
                self.unpack(column.what, &mapped[start..start + length], raw.frames, cells);
                start += length;
            }
        }
        self.readback.unmap();
        Ok(())
    }
}

impl Backend for Gpu {
    fn name(&self) -> &'static str {
        "gpu"
    }

    fn describe(&self) -> String {
        let summary = adapter::summary(&self.device.info);
        format!("{}, {} ({}, {})", summary.name, summary.kind, summary.api, summary.driver)
    }

    fn restart(&mut self) {
        let mut encoder = self.device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for buffer in &self.memory {
            encoder.clear_buffer(buffer, 0, None);
        }
        self.device.queue.submit([encoder.finish()]);
    }

    fn recalibrate(&mut self, plan: &Plan) {
        self.plan.recalibrate(plan);
        self.device.queue.write_buffer(&self.taxels, 0, cast_slice(&self.plan.taxels));
    }

    fn run(&mut self, raw: &RawBatch<'_>, percepts: &mut Percepts) -> Result<()> {
        let Some(all) = percepts.cells_f32() else { unreachable!("the engine made percepts of this precision") };
        let mut rest = all.split_at(raw.first).1;
        for (part, steps) in raw.steps.chunks(self.capacity).enumerate() {
            let (first, frames) = (part * self.capacity, steps.len());
            let (mut cells, later) = rest.split_at(frames);
            self.submit(&RawBatch { first: 0, frames, rows: raw.rows.part(first..first + frames), steps }, &mut cells)?;
            rest = later;
        }
        Ok(())
    }
}

/// What a dispatch over `frames` frames is told of the plan.
fn header(plan: &Plan, frames: u32, wide: u32) -> layout::Batch {
    layout::Batch {
        frames,
        channels: plan.channels() as u32,
        calibrated: plan.calibrated() as u32,
        changes: (plan.slots() - plan.calibrated()) as u32,
        fields: plan.fields.len() as u32,
        wide,
    }
}

fn gpu_field(field: &crate::scene::PlanField) -> layout::Field {
    layout::Field {
        first: field.first as u32,
        count: field.count as u32,
        charted: field.charted.into(),
        area_known: field.area_known.into(),
    }
}
