//! Backend `gpu`: WGSL compute shaders through wgpu, the only place that knows wgpu.
//!
//! Frames stream through a few sets of buffers: while the device computes some, the next are packed and those before are
//! read. Every stage runs over all fields and frames of a submission at once, and only the columns that were asked for
//! come back, in the order that percepts have. Pipelines, buffers and bind groups are made once; a call allocates no
//! device memory. On the device a taxel's frames lie side by side, four to a vector, so that neighbouring invocations
//! read neighbouring words.

mod across;
pub(crate) mod adapter;
mod bus;
mod calibrating;
mod capacity;
mod chain;
mod columns;
mod members;
mod over_fields;
mod pack;
#[doc(hidden)]
pub mod raster;
mod report;
mod ring;
pub(crate) mod shaders;
mod shares;
mod stage;
mod unpack;

#[cfg(test)]
mod tests;

pub use adapter::{AdapterSummary, adapters};
pub use bus::silent_gpus;
use bytemuck::cast_slice;
use glam::DVec2;
pub use report::{Bandwidth, DeviceTime, EmptyCall, bandwidth, device_time};

use self::adapter::Device;
use self::capacity::FRAMES_A_BLOCK;
use self::chain::{Buffers, Chain};
use self::columns::Columns;
use self::pack::{Form, HEADER, Packer, STEP, header};
use self::ring::{SETS, Set};
use self::shares::Shares;
use self::stage::Stage;
use super::{Backend, BackendState, FieldState, RawBatch};
use crate::error::Result;
use crate::percept::Percepts;
use crate::scene::Plan;
use crate::signal::RawValue;
use crate::stage::{layout, motion};

/// The backend, with everything it needs on the device.
pub(crate) struct Gpu {
    plan: Plan,
    device: Device,
    /// Frames that one submission takes at most.
    capacity: usize,
    ring: Vec<Set>,
    batch: wgpu::Buffer,
    /// What is in `batch`.
    batch_header: Option<layout::Batch>,
    steps: wgpu::Buffer,
    raw: wgpu::Buffer,
    /// The raw values of the frame before, where the plan has changes.
    before: Option<wgpu::Buffer>,
    taxels: wgpu::Buffer,
    stages: Vec<Stage>,
    /// If the plan ceases to be plain: how many of the first stages are replaced, and the stages that replace them.
    fallback: (usize, Vec<Stage>),
    packer: Packer,
    columns: Columns,
    results: wgpu::Buffer,
    /// Per taxel and frame, where they are read back.
    pressures: Option<wgpu::Buffer>,
    /// Per field, the unit of its lengths, m: a power of two, so that dividing by it is exact.
    units_m: Vec<f32>,
    /// Per field, contact and centroid of the last frame, which hysteresis and motion start from.
    memory: [wgpu::Buffer; 2],
}

impl Gpu {
    /// Makes the backend for `plan` on the process's device. Buffers have room for `batch` frames, and grow where a call has more.
    pub(crate) fn new(plan: &Plan, batch: usize) -> Result<Self> {
        Self::on(adapter::shared()?, plan, batch)
    }

    /// The same on a device that is not the CPU itself.
    pub(crate) fn on_hardware(plan: &Plan, batch: usize) -> Result<Self> {
        Self::on(adapter::hardware()?, plan, batch)
    }

    fn on(device: Device, plan: &Plan, batch: usize) -> Result<Self> {
        let cut = (over_fields::of_part(&device), over_fields::most_members(&device));
        Self::in_shares(device, plan, batch, cut)
    }

    /// With at most `most_of_part` members in a part of a wide field, and `most_of_share` in one table on the device.
    fn in_shares(
        device: Device,
        plan: &Plan,
        batch: usize,
        (most_of_part, most_of_share): (usize, usize),
    ) -> Result<Self> {
        let columns = Columns::new(plan);
        let capacity = capacity::frames_per_submission(&device, plan, &columns, batch)?;
        let shares = Shares::new(plan, most_of_part, most_of_share);
        let plain = is_plain(plan);
        let direct = plain && !plan.has_changes() && !plan.stages().pressures && plan.calibrated() == plan.channels();
        let form = match (direct, capacity) {
            (false, _) => Form::Rows,
            (true, 1) => Form::One,
            (true, _) => Form::Quads,
        };
        // Should the plan cease to be plain, they go up in rows.
        let up = [Form::Rows, form].map(|form| form.bytes(plan.channels(), capacity));
        let up = up[0].max(up[1]) as u64;
        let buffers = Buffers::new(&device, plan, &columns, capacity, up);
        let Chain { stages, fallback, before } =
            Chain::new(&device, plan, (plain, direct), &shares, &columns, capacity, &buffers);
        let Buffers { batch, steps, raw, taxels, pressures, results, touched, last, .. } = buffers;

        let reads_pressures = plan.stages().pressures;
        let [frames, fields, read] = [capacity, plan.fields.len(), columns.read().len()].map(|count| count as u64);
        let back = frames * fields * 4 * read;
        let back = back + if reads_pressures { pressures.size() } else { 0 };
        // Calls that fit into one submission never have another on its way.
        let sets = if capacity < FRAMES_A_BLOCK { 1 } else { SETS };
        let ring = (0..sets).map(|_| Set::new(&device, pack::values_at(capacity) + up, back)).collect();
        device.check()?;
        Ok(Self {
            plan: plan.clone(),
            device,
            capacity,
            ring,
            batch,
            batch_header: None,
            steps,
            raw,
            before,
            taxels,
            stages,
            fallback,
            packer: Packer::new(form, plan.channels(), capacity),
            columns,
            results,
            pressures: reads_pressures.then_some(pressures),
            units_m: plan.fields.iter().map(|field| field.unit_m).collect(),
            memory: [touched, last],
        })
    }

    /// Sends `raw`, which is at most the capacity and starts at frame `first` of a call, with set `set`, which is free.
    fn submit(&mut self, set: usize, raw: &RawBatch<'_>, first: usize) -> Result<()> {
        let header = header(&self.plan, raw.frames as u32);
        let (upload, readback) = (&self.ring[set].upload, &self.ring[set].readback);
        let bytes = self.packer.bytes(raw.frames) as u64;
        let mapped = upload.get_mapped_range_mut(0..pack::values_at(raw.frames) + bytes);
        self.packer.pack(raw, &header, mapped.map_err(|e| self.device.lost(&e))?.slice(..));
        upload.unmap();
        let frames = raw.frames as u64;
        let steps = frames * STEP;
        let mut encoder = self.device.encoder();
        // Each copy waits for the one before: none that changes nothing.
        if self.batch_header != Some(header) {
            encoder.copy_buffer_to_buffer(upload, 0, &self.batch, 0, HEADER);
            self.batch_header = Some(header);
        }
        if self.plan.stages().motion || self.plan.has_changes() {
            encoder.copy_buffer_to_buffer(upload, HEADER, &self.steps, 0, steps);
        }
        encoder.copy_buffer_to_buffer(upload, pack::values_at(raw.frames), &self.raw, 0, bytes);
        {
            let descriptor = wgpu::ComputePassDescriptor { label: Some("somatic"), timestamp_writes: None };
            let mut pass = encoder.begin_compute_pass(&descriptor);
            self.stages.iter().for_each(|stage| stage.dispatch(&mut pass, stage.over.groups(&header)));
        }
        if let Some(before) = &self.before {
            let row = layout::padded_channels(self.plan.channels()) as u64 * 4;
            encoder.copy_buffer_to_buffer(&self.raw, (frames - 1) * row, before, 0, row);
        }
        let mut end = frames * self.plan.fields.len() as u64 * 4 * self.columns.read().len() as u64;
        encoder.copy_buffer_to_buffer(&self.results, 0, readback, 0, end);
        if let Some(pressures) = &self.pressures {
            let size = (layout::padded_quads(raw.frames) * self.plan.slots()) as u64 * 16;
            encoder.copy_buffer_to_buffer(pressures, 0, readback, end, size);
            end += size;
        }
        self.ring[set].submit(&self.device, encoder.finish(), (first, raw.frames), end);
        Ok(())
    }

    /// Waits for set `set`, if it is on its way, and takes what it brings into `percepts` from frame `first` on.
    fn collect(&mut self, set: usize, first: usize, percepts: &mut Percepts) -> Result<()> {
        let mut taken = std::mem::take(&mut self.ring);
        let done = taken[set].collect(&self.device, |pending, bytes| {
            let Some(all) = percepts.cells_f32() else { unreachable!("the engine made percepts of this precision") };
            let mut cells = all.split_at(first + pending.first).1.split_at(pending.frames).0;
            self.unpack(bytes, pending.frames, &mut cells);
        });
        self.ring = taken;
        done
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

    fn state(&mut self) -> Result<BackendState> {
        let [touched, last] = &self.memory;
        let touched: Vec<u32> = readback(&self.device, touched)?;
        let last: Vec<[u32; 4]> = readback(&self.device, last)?;
        let mut raw = match &self.before {
            Some(before) => readback(&self.device, before)?,
            None => Vec::new(),
        };
        raw.resize(self.plan.channels(), RawValue::MISSING);
        let fields = self.units_m.iter().zip(touched).zip(last).map(|((&unit_m, touched), [u, v, pressed, known])| {
            let place = DVec2::new(f32::from_bits(u).into(), f32::from_bits(v).into()) * f64::from(unit_m);
            let centroid = (known == 1).then_some(motion::Centroid { place, pressed });
            FieldState { contact: touched == 1 || centroid.is_some(), centroid }
        });
        Ok(BackendState { raw, fields: fields.collect() })
    }

    fn restore(&mut self, state: &BackendState) -> Result<()> {
        let fields = || state.fields.iter();
        let touched: Vec<u32> = fields().map(|field| field.contact.into()).collect();
        let last = fields().zip(&self.units_m).map(|(field, &unit_m)| match field.centroid {
            Some(motion::Centroid { place, pressed }) => {
                let place = (place / f64::from(unit_m)).as_vec2();
                [place.x.to_bits(), place.y.to_bits(), pressed, 1]
            }
            None => [0; 4],
        });
        let last: Vec<[u32; 4]> = last.collect();
        self.device.queue.write_buffer(&self.memory[0], 0, cast_slice(&touched));
        self.device.queue.write_buffer(&self.memory[1], 0, cast_slice(&last));
        if let Some(before) = &self.before {
            self.device.queue.write_buffer(before, 0, cast_slice(&state.raw));
        }
        Ok(())
    }

    fn recalibrate(&mut self, plan: &Plan) {
        self.plan.recalibrate(plan);
        self.device.queue.write_buffer(&self.taxels, 0, cast_slice(&self.plan.taxels));
        if !is_plain(&self.plan) {
            let (replaced, fallback) = std::mem::take(&mut self.fallback);
            self.stages.splice(..replaced, fallback);
            self.packer.form = Form::Rows;
        }
    }

    fn run(&mut self, raw: &RawBatch<'_>, percepts: &mut Percepts) -> Result<()> {
        self.device.check()?;
        // What is on its way when something goes wrong is never collected: the device is not to be used again.
        self.stream(raw, percepts).inspect_err(|e| self.device.note(&e.to_string()))
    }
}

impl Gpu {
    /// All frames of `raw`, some sets of buffers on their way at any time.
    fn stream(&mut self, raw: &RawBatch<'_>, percepts: &mut Percepts) -> Result<()> {
        let sets = self.ring.len();
        let mut parts = 0;
        for (part, steps) in raw.steps.chunks(self.capacity).enumerate() {
            let (first, frames) = (part * self.capacity, steps.len());
            self.collect(part % sets, raw.first, percepts)?;
            let rows = raw.rows.part(first..first + frames);
            self.submit(part % sets, &RawBatch { first: 0, frames, rows, steps }, first)?;
            parts = part + 1;
        }
        // The oldest first.
        for part in parts..parts + sets {
            self.collect(part % sets, raw.first, percepts)?;
        }
        Ok(())
    }
}

/// The contents of `buffer`, waiting for all work before.
fn readback<T: bytemuck::Pod>(device: &Device, buffer: &wgpu::Buffer) -> Result<Vec<T>> {
    let copy = device.buffer("state", buffer.size(), wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
    let mut encoder = device.encoder();
    encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
    encoder.map_buffer_on_submit(&copy, wgpu::MapMode::Read, .., |_| {});
    let submission = device.queue.submit([encoder.finish()]);
    let until = wgpu::PollType::Wait { submission_index: Some(submission), timeout: None };
    device.device.poll(until).map_err(|e| device.lost(&e))?;
    device.check()?;
    let bytes = copy.get_mapped_range(..).map_err(|e| device.lost(&e))?;
    Ok(bytemuck::pod_collect_to_vec(&bytes))
}

/// Whether raw values are pressures, with nothing to check but that they are numbers.
fn is_plain(plan: &Plan) -> bool {
    plan.taxels[..plan.calibrated()].iter().all(layout::Taxel::raw_is_pressure)
}
