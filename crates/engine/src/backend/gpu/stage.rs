//! A stage on the device: its pipeline, its buffers, and how far a dispatch of it counts.

use bytemuck::{Pod, cast_slice};

use super::adapter::Device;
use super::shaders::Shader;
use crate::stage::layout;

/// The usages of buffers that stages read and write, and of those that describe a batch.
pub(super) const WORKING: wgpu::BufferUsages =
    wgpu::BufferUsages::STORAGE.union(wgpu::BufferUsages::COPY_SRC).union(wgpu::BufferUsages::COPY_DST);
pub(super) const UNIFORM: wgpu::BufferUsages = wgpu::BufferUsages::UNIFORM.union(wgpu::BufferUsages::COPY_DST);

/// Invocations a group, as `shaders/shared/layout.wgsl` has it.
pub(super) const GROUP: u32 = 64;

/// Quads that an invocation of calibrate takes at most, as its shader says.
pub(super) const TURNS: u32 = 4;

/// Invocations a group of the program over fields for one frame at a time, as `shaders/shared/one_cell.wgsl` has it.
pub(super) const FIELDS_GROUP: u32 = 128;

/// Values of a program's overrides, by name.
pub(super) type Constants<'a> = &'a [(&'a str, f64)];

/// A stage's pipeline, with its buffers bound.
pub(super) struct Stage {
    pub(super) name: &'static str,
    pub(super) pipeline: wgpu::ComputePipeline,
    pub(super) bound: wgpu::BindGroup,
    pub(super) over: Over,
}

/// What a dispatch counts.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Over {
    /// One invocation four slots that are calibrated and a few quads.
    Calibrated,
    /// One invocation four slots that are calibrated, for one frame.
    CalibratedOnce,
    /// One invocation a slot that is a change and a quad.
    Changes,
    /// One invocation per quad and field; the number of fields.
    Quads(u32),
    /// The same for one frame, in larger groups.
    OneFrame(u32),
    /// One group per quad and wide field, or part of one; the number of these.
    Wide(u32),
    /// One invocation a field and frame.
    Cells,
    /// One invocation a field.
    Fields,
}

impl Over {
    /// How many groups a batch takes: along x and folded over z, and along y, which counts frames.
    pub(super) fn groups(self, batch: &layout::Batch) -> [u32; 3] {
        let (quads, lanes) = (batch.frames.div_ceil(4), 1 << batch.lanes_log2);
        // Four channels of each signal.
        let vectors = batch.channels.div_ceil(4) * (batch.calibrated / batch.channels);
        let (count, tall) = match self {
            Self::Calibrated => (vectors.div_ceil(GROUP), quads.div_ceil(TURNS.min(lanes))),
            Self::CalibratedOnce => (vectors.div_ceil(GROUP), 1),
            Self::Changes => (batch.changes.div_ceil(GROUP), quads),
            Self::Quads(fields) => (fields.div_ceil(GROUP / lanes), quads.div_ceil(lanes)),
            Self::OneFrame(fields) => (fields.div_ceil(FIELDS_GROUP), 1),
            Self::Wide(count) => (count, quads),
            Self::Cells => ((batch.fields * batch.frames).div_ceil(GROUP), 1),
            Self::Fields => (batch.fields.div_ceil(GROUP), 1),
        };
        let (wide, deep) = folded(count);
        [wide, tall, deep]
    }
}

impl Stage {
    /// A program whose entry point uses the bindings 0, 1, 2, … for `buffers`.
    pub(super) fn new(
        device: &Device,
        shader: &Shader,
        entry: &str,
        over: Over,
        constants: Constants<'_>,
        buffers: &[&wgpu::Buffer],
    ) -> Self {
        Self::bound(device, shader, entry, over, constants, &numbered(buffers))
    }

    /// A stage whose entry point uses only some of its shader's bindings.
    pub(super) fn bound(
        device: &Device,
        shader: &Shader,
        entry: &str,
        over: Over,
        constants: Constants<'_>,
        resources: &[(u32, wgpu::BindingResource<'_>)],
    ) -> Self {
        Self::with(pipeline(device, shader, entry, constants), shader.name, device, over, resources)
    }

    /// The same program on other buffers: the very same, so that it gives the same bits.
    pub(super) fn again(&self, device: &Device, over: Over, buffers: &[&wgpu::Buffer]) -> Self {
        Self::with(self.pipeline.clone(), self.name, device, over, &numbered(buffers))
    }

    /// Adds it to `pass`, with this number of groups along x, y and z.
    pub(super) fn dispatch(&self, pass: &mut wgpu::ComputePass<'_>, [wide, tall, deep]: [u32; 3]) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bound, &[]);
        pass.dispatch_workgroups(wide, tall, deep);
    }

    fn with(
        pipeline: wgpu::ComputePipeline,
        name: &'static str,
        device: &Device,
        over: Over,
        resources: &[(u32, wgpu::BindingResource<'_>)],
    ) -> Self {
        let entries: Vec<wgpu::BindGroupEntry<'_>> = resources
            .iter()
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding: *binding, resource: resource.clone() })
            .collect();
        let bound = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(name),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        Self { name, pipeline, bound, over }
    }
}

/// Bindings 0, 1, 2, … for `buffers`.
fn numbered<'a>(buffers: &[&'a wgpu::Buffer]) -> Vec<(u32, wgpu::BindingResource<'a>)> {
    (0..).zip(buffers.iter().map(|buffer| buffer.as_entire_binding())).collect()
}

/// The compute pipeline of one stage's entry point.
pub(super) fn pipeline(
    device: &Device,
    shader: &Shader,
    entry: &str,
    constants: Constants<'_>,
) -> wgpu::ComputePipeline {
    let module = device.shader(shader.name, shader.wgsl());
    device.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(shader.name),
        layout: None,
        module: &module,
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions {
            constants,
            ..wgpu::PipelineCompilationOptions::default()
        },
        cache: None,
    })
}

pub(super) fn table<T: Pod>(device: &Device, name: &str, rows: &[T]) -> wgpu::Buffer {
    table_as(device, name, rows, wgpu::BufferUsages::STORAGE, 16)
}

/// The same, bound as `usage` says, with room for `least` bytes.
pub(super) fn table_as<T: Pod>(
    device: &Device,
    name: &str,
    rows: &[T],
    usage: wgpu::BufferUsages,
    least: u64,
) -> wgpu::Buffer {
    let bytes: &[u8] = cast_slice(rows);
    let buffer = device.buffer(name, (bytes.len() as u64).max(least), usage | wgpu::BufferUsages::COPY_DST);
    device.queue.write_buffer(&buffer, 0, bytes);
    buffer
}

/// Folds a row of groups into a rectangle, as no side may be longer than 65,535.
pub(super) fn folded(count: u32) -> (u32, u32) {
    const LONGEST: u32 = 65_535;
    let tall = count.div_ceil(LONGEST).max(1);
    (count.div_ceil(tall).max(1), tall)
}
