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
/// Number of measurements; their median counts.
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
    let [one, other] = ["one", "other"].map(|name| device.buffer(name, MUCH, usage));
    let mut set = Set::new(&device, MUCH, MUCH);
    let (upload, readback) = (set.upload.clone(), set.readback.clone());
    let mut seconds = |between: Option<(&wgpu::Buffer, &wgpu::Buffer)>, bytes_back: u64| {
        let copy = |encoder: &mut wgpu::CommandEncoder| {
            between.into_iter().for_each(|(from, to)| encoder.copy_buffer_to_buffer(from, 0, to, 0, MUCH));
        };
        median(|| timed(&device, &mut set, bytes_back, copy, |_| ()))
    };
    let nothing = seconds(None, 16)?;
    let rate = |seconds: f64| MUCH as f64 / (seconds - nothing).max(1e-9);
    Ok(Bandwidth {
        on_device: rate(seconds(Some((&one, &other)), 16)?),
        up: rate(seconds(Some((&upload, &one)), 16)?),
        down: rate(seconds(Some((&one, &readback)), MUCH)?),
    })
}

/// Submits what `record` encodes with `set`, and lets `take` read the `bytes` that come back; how long until then, s.
fn timed(
    device: &Device,
    set: &mut Set,
    bytes: u64,
    record: impl FnOnce(&mut wgpu::CommandEncoder),
    take: impl FnOnce(&[u8]),
) -> Result<f64> {
    let start = Instant::now();
    set.upload.unmap();
    let mut encoder = device.encoder();
    record(&mut encoder);
    set.submit(device, encoder.finish(), (0, 0), bytes);
    set.collect(device, |_, bytes| take(bytes))?;
    Ok(start.elapsed().as_secs_f64())
}

fn fill(device: &Device, set: &Set, bytes: &[u8]) -> Result<()> {
    let mapped = set.upload.get_mapped_range_mut(..bytes.len() as u64);
    mapped.map_err(|e| device.lost(&e))?.slice(..).copy_from_slice(bytes);
    Ok(())
}

fn median(mut measure: impl FnMut() -> Result<f64>) -> Result<f64> {
    // The first pays for memory that was never touched.
    measure()?;
    let mut seconds = (0..ROUNDS).map(|_| measure()).collect::<Result<Vec<f64>>>()?;
    seconds.sort_by(f64::total_cmp);
    Ok(seconds[ROUNDS / 2])
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
    // Every taxel pressed.
    let values: Vec<f32> = (0..up / 4).map(|i| (i % 977 + 1) as f32).collect();
    fill(&gpu.device, &set, bytemuck::cast_slice(&values))?;
    let mut run = |over: &dyn Fn(Over) -> [u32; 3], clock: Option<&Clock>| {
        let readback = set.readback.clone();
        let record = |encoder: &mut wgpu::CommandEncoder| {
            let timestamp_writes = clock.map(Clock::writes);
            let descriptor = wgpu::ComputePassDescriptor { label: Some("somatic"), timestamp_writes };
            let mut pass = encoder.begin_compute_pass(&descriptor);
            gpu.stages.iter().for_each(|stage| stage.dispatch(&mut pass, over(stage.over)));
            drop(pass);
            clock.into_iter().for_each(|clock| clock.resolve(encoder, &readback));
        };
        let mut ticks = [0_u64; 2];
        let take = |bytes: &[u8]| bytemuck::bytes_of_mut(&mut ticks).copy_from_slice(&bytes[..16]);
        let host_s = timed(&gpu.device, &mut set, 16, record, take)?;
        Ok(clock.map_or(host_s, |clock| ticks[1].wrapping_sub(ticks[0]) as f64 * clock.tick_s))
    };
    let cells = (frames * plan.fields.len()) as u64;
    let (bytes_up, bytes_down) = (up as u64, cells * 4 * gpu.columns.read().len() as u64);
    let nothing = |_: Over| [0, 0, 0];
    let everything = |over: Over| over.groups(&batch);
    let programs_s = match &clock {
        Some(clock) => median(|| run(&everything, Some(clock)))?,
        None => {
            let still = median(|| run(&nothing, None))?;
            (median(|| run(&everything, None))? - still).max(0.0)
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
        let module = gpu.device.shader("empty", format!("@compute @workgroup_size({GROUP}) fn main() {{}}"));
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
        let Gpu { device, ring, raw, results, .. } = &mut self.gpu;
        let set = &mut ring[0];
        fill(device, set, &self.values)?;
        let (upload, readback) = (set.upload.clone(), set.readback.clone());
        let record = |encoder: &mut wgpu::CommandEncoder| {
            encoder.copy_buffer_to_buffer(&upload, 0, raw, 0, self.values.len() as u64);
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.pipeline);
            let [wide, tall, deep] = self.groups;
            pass.dispatch_workgroups(wide, tall, deep);
            drop(pass);
            encoder.copy_buffer_to_buffer(results, 0, &readback, 0, self.bytes_down);
        };
        timed(device, set, self.bytes_down.max(16), record, |_| ()).map(|_| ())
    }
}

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
            ticks: device.buffer("ticks", 256, wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
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
