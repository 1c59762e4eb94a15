//! What a device could do at best, and what the backend's programs make of it: for `benches/gpu.rs`, on machines whose
//! device nobody here has seen.

use std::time::Instant;

use super::adapter::{self, Device};
use super::pack::Form;
use super::ring::Set;
use super::stage::{GROUP, Over};
use super::{Gpu, header};
use crate::error::Result;
use crate::scene::Plan;
use crate::stage::layout;

/// Bytes that bandwidths are measured with: far beyond any cache but for the largest.
const MUCH: u64 = 128 << 20;
/// Of so many measurements the median counts.
const ROUNDS: usize = 9;

/// What a machine copies, bytes a second; a copy on the device reads and writes each byte and is counted once.
#[derive(Clone, Copy, Debug)]
pub struct Bandwidth {
    /// From one of the device's buffers to another.
    pub on_device: f64,
    /// From host memory into a buffer of the device.
    pub up: f64,
    /// From a buffer of the device into host memory.
    pub down: f64,
}

/// A submission's programs by themselves, everything on the device.
#[derive(Clone, Copy, Debug)]
pub struct DeviceTime {
    /// Frames of the submission.
    pub frames: usize,
    /// The programs, s: by the device's own clock where it has one that may be read, else by the host's.
    pub programs_s: f64,
    /// Whether the device's clock was read.
    pub by_device: bool,
    /// Bytes that the programs must at least read and write, each once.
    pub least_bytes: u64,
    /// Raw values that go up.
    pub bytes_up: u64,
    /// Percepts that come down.
    pub bytes_down: u64,
}

/// Measures what the process's device copies.
///
/// # Errors
/// No adapter, or a device without memory for it.
pub fn bandwidth() -> Result<Bandwidth> {
    let device = adapter::shared()?;
    let usage = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
    let buffer = |label| {
        let descriptor = wgpu::BufferDescriptor { label: Some(label), size: MUCH, usage, mapped_at_creation: false };
        device.device.create_buffer(&descriptor)
    };
    let (one, other) = (buffer("one"), buffer("other"));
    let mut set = Set::new(&device, MUCH, MUCH);
    let nothing = median(ROUNDS, || copy(&device, &mut set, None))?;
    let rate = |seconds: f64| MUCH as f64 / (seconds - nothing).max(1e-9);
    let on_device = rate(median(ROUNDS, || copy(&device, &mut set, Some((&one, &other))))?);
    let upload = set.upload.clone();
    let up = median(ROUNDS, || {
        let start = Instant::now();
        {
            let mapped = upload.get_mapped_range_mut(..).map_err(|e| device.lost(&e))?;
            drop(mapped);
        }
        upload.unmap();
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(&upload, 0, &one, 0, MUCH);
        set.submit(&device, encoder.finish(), (0, 0), 16);
        set.collect(&device, |_, _| ())?;
        Ok(start.elapsed().as_secs_f64())
    })?;
    let readback = set.readback.clone();
    let down = median(ROUNDS, || {
        let start = Instant::now();
        set.upload.unmap();
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.copy_buffer_to_buffer(&one, 0, &readback, 0, MUCH);
        set.submit(&device, encoder.finish(), (0, 0), MUCH);
        set.collect(&device, |_, _| ())?;
        Ok(start.elapsed().as_secs_f64())
    })?;
    Ok(Bandwidth { on_device, up: rate(up), down: rate(down) })
}

/// A submission that copies from one buffer to another, or does nothing; how long until the host knows.
fn copy(device: &Device, set: &mut Set, between: Option<(&wgpu::Buffer, &wgpu::Buffer)>) -> Result<f64> {
    let start = Instant::now();
    set.upload.unmap();
    let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    if let Some((from, to)) = between {
        encoder.copy_buffer_to_buffer(from, 0, to, 0, MUCH);
    }
    set.submit(device, encoder.finish(), (0, 0), 16);
    set.collect(device, |_, _| ())?;
    Ok(start.elapsed().as_secs_f64())
}

fn median(rounds: usize, mut measure: impl FnMut() -> Result<f64>) -> Result<f64> {
    // The first pays for memory that was never touched.
    measure()?;
    let mut seconds = (0..rounds).map(|_| measure()).collect::<Result<Vec<f64>>>()?;
    seconds.sort_by(f64::total_cmp);
    Ok(seconds[rounds / 2])
}

/// Measures the programs of `plan`, as many of `frames` as one submission takes, on whatever the buffers hold.
///
/// # Errors
/// No adapter, or a plan that the device cannot run.
pub fn device_time(plan: &Plan, frames: usize) -> Result<DeviceTime> {
    let device = adapter::with_clock()?;
    let mut gpu = Gpu::on(device, plan, frames)?;
    let frames = frames.min(gpu.capacity);
    let batch = header(plan, frames as u32);
    gpu.device.queue.write_buffer(&gpu.batch, 0, bytemuck::bytes_of(&batch));
    let clock = Clock::new(&gpu.device);
    let up = gpu.packer.bytes(frames);
    let mut set = gpu.ring.swap_remove(0);
    {
        // Every taxel pressed.
        let values: Vec<f32> = (0..up / 4).map(|i| (i % 977 + 1) as f32).collect();
        let mapped = set.upload.get_mapped_range_mut(..(values.len() * 4) as u64);
        mapped.map_err(|e| gpu.device.lost(&e))?.slice(..).copy_from_slice(bytemuck::cast_slice(&values));
    }
    let mut run = |over: &dyn Fn(Over) -> [u32; 3], clock: Option<&Clock>| {
        let start = Instant::now();
        set.upload.unmap();
        let mut encoder = gpu.device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let timestamp_writes = clock.map(Clock::writes);
            let descriptor = wgpu::ComputePassDescriptor { label: Some("somatic"), timestamp_writes };
            let mut pass = encoder.begin_compute_pass(&descriptor);
            for stage in &gpu.stages {
                let [wide, tall, deep] = over(stage.over);
                pass.set_pipeline(&stage.pipeline);
                pass.set_bind_group(0, &stage.bound, &[]);
                pass.dispatch_workgroups(wide, tall, deep);
            }
        }
        if let Some(clock) = clock {
            clock.resolve(&mut encoder, &set.readback);
        }
        set.submit(&gpu.device, encoder.finish(), (0, 0), 16);
        let mut ticks = [0_u64; 2];
        set.collect(&gpu.device, |_, bytes| bytemuck::bytes_of_mut(&mut ticks).copy_from_slice(&bytes[..16]))?;
        let device_s = clock.map(|clock| ticks[1].wrapping_sub(ticks[0]) as f64 * clock.tick_s);
        Ok(device_s.unwrap_or(start.elapsed().as_secs_f64()))
    };
    let cells = (frames * plan.fields.len()) as u64;
    let (bytes_up, bytes_down) = (up as u64, cells * 4 * gpu.columns.read().len() as u64);
    let nothing = |_: Over| [0, 0, 0];
    let everything = |over: Over| over.groups(&batch);
    let programs_s = match &clock {
        Some(clock) => median(ROUNDS, || run(&everything, Some(clock)))?,
        None => {
            let still = median(ROUNDS, || run(&nothing, None))?;
            (median(ROUNDS, || run(&everything, None))? - still).max(0.0)
        }
    };
    // Raw values, pressures and statuses there and back where there are any, what is known of members, and the results.
    let members = (plan.members.len() * size_of::<layout::Member>()) as u64;
    let slots = (frames * plan.slots()) as u64;
    let results = cells * 4 * gpu.columns.count() as u64;
    let pressures = if gpu.packer.form != Form::Rows { 0 } else { 2 * slots * 5 };
    let least_bytes = bytes_up + pressures + members + results;
    Ok(DeviceTime { frames, programs_s, by_device: clock.is_some(), least_bytes, bytes_up, bytes_down })
}

/// A call that computes nothing, to hold a call of an engine to: as many bytes go up and come down as in a submission of a
/// plan, and a program without a statement is dispatched in as many groups as the largest of its programs.
pub struct EmptyCall {
    gpu: Gpu,
    pipeline: wgpu::ComputePipeline,
    groups: [u32; 3],
    values: Vec<u8>,
    bytes_down: u64,
}

impl EmptyCall {
    /// In place of a call of `plan` on `frames` frames, as many of them as one submission takes.
    ///
    /// # Errors
    /// No adapter, or a plan that the device cannot run.
    pub fn new(plan: &Plan, frames: usize) -> Result<Self> {
        let gpu = Gpu::on(adapter::shared()?, plan, frames)?;
        let frames = frames.min(gpu.capacity);
        let batch = header(plan, frames as u32);
        let module = gpu.device.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("empty"),
            source: wgpu::ShaderSource::Wgsl(format!("@compute @workgroup_size({GROUP}) fn main() {{}}").into()),
        });
        let pipeline = gpu.device.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("empty"),
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        let groups = gpu.stages.iter().map(|stage| stage.over.groups(&batch));
        let groups = groups.max_by_key(|groups| groups.iter().product::<u32>()).unwrap_or([1, 1, 1]);
        let bytes_down = (frames * plan.fields.len() * 4 * gpu.columns.read().len()) as u64;
        Ok(Self { pipeline, groups, values: vec![0; gpu.packer.bytes(frames)], bytes_down, gpu })
    }

    /// From the host's first byte to its last.
    ///
    /// # Errors
    /// The device was lost.
    pub fn run(&mut self) -> Result<()> {
        let Gpu { device, ring, .. } = &mut self.gpu;
        let mut set = ring.swap_remove(0);
        {
            let mapped = set.upload.get_mapped_range_mut(..self.values.len() as u64);
            mapped.map_err(|e| device.lost(&e))?.slice(..).copy_from_slice(&self.values);
        }
        set.upload.unmap();
        let mut encoder = device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let bytes = self.values.len() as u64;
        encoder.copy_buffer_to_buffer(&set.upload, 0, &self.gpu.raw, 0, bytes);
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.pipeline);
            let [wide, tall, deep] = self.groups;
            pass.dispatch_workgroups(wide, tall, deep);
        }
        encoder.copy_buffer_to_buffer(&self.gpu.results, 0, &set.readback, 0, self.bytes_down);
        set.submit(&self.gpu.device, encoder.finish(), (0, 0), self.bytes_down.max(16));
        let done = set.collect(&self.gpu.device, |_, _| ());
        self.gpu.ring.insert(0, set);
        done
    }
}

/// The device's clock.
struct Clock {
    queries: wgpu::QuerySet,
    ticks: wgpu::Buffer,
    tick_s: f64,
}

impl Clock {
    /// `None` where a program may not read it.
    fn new(device: &Device) -> Option<Self> {
        device.device.features().contains(wgpu::Features::TIMESTAMP_QUERY).then(|| Self {
            queries: device.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("clock"),
                ty: wgpu::QueryType::Timestamp,
                count: 2,
            }),
            ticks: device.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("ticks"),
                size: 256,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            tick_s: f64::from(device.queue.get_timestamp_period()) * 1e-9,
        })
    }

    fn writes(&self) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        }
    }

    fn resolve(&self, encoder: &mut wgpu::CommandEncoder, into: &wgpu::Buffer) {
        encoder.resolve_query_set(&self.queries, 0..2, &self.ticks, 0);
        encoder.copy_buffer_to_buffer(&self.ticks, 0, into, 0, 16);
    }
}
