//! A stage on the device: its pipeline, its buffers, and how far a dispatch of it counts.

use bytemuck::{Pod, cast_slice};

use super::adapter::Device;
use super::shaders::StageShader;

/// A stage's pipeline, with its buffers bound.
pub(super) struct Stage {
    pub(super) name: &'static str,
    pub(super) pipeline: wgpu::ComputePipeline,
    pub(super) bound: wgpu::BindGroup,
    pub(super) over: Over,
}

/// What a dispatch counts up to, times the frames.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Over {
    /// One invocation a slot that is calibrated.
    Calibrated,
    /// The same, whatever the frames.
    CalibratedOnce,
    /// One invocation a slot that is a change.
    Changes,
    /// One invocation a field; wide ones return at once.
    Fields,
    /// One group a wide field.
    WideFields,
    /// One invocation a field, whatever the frames.
    FieldsOnce,
}

impl Stage {
    /// A stage whose entry point uses the bindings 0, 1, 2, … for `buffers`.
    pub(super) fn new(
        device: &Device,
        shader: &StageShader,
        entry: &str,
        over: Over,
        buffers: &[&wgpu::Buffer],
    ) -> Self {
        let numbered: Vec<(u32, &wgpu::Buffer)> = (0..).zip(buffers.iter().copied()).collect();
        Self::bound(device, shader, entry, over, &numbered)
    }

    /// A stage whose entry point uses only some of its shader's bindings.
    pub(super) fn bound(
        device: &Device,
        shader: &StageShader,
        entry: &str,
        over: Over,
        buffers: &[(u32, &wgpu::Buffer)],
    ) -> Self {
        Self::with(pipeline(device, shader, entry), shader.name, device, over, buffers)
    }

    /// The same program on other buffers: the very same, so that it gives the same bits.
    pub(super) fn again(&self, device: &Device, over: Over, buffers: &[&wgpu::Buffer]) -> Self {
        let numbered: Vec<(u32, &wgpu::Buffer)> = (0..).zip(buffers.iter().copied()).collect();
        Self::with(self.pipeline.clone(), self.name, device, over, &numbered)
    }

    fn with(
        pipeline: wgpu::ComputePipeline,
        name: &'static str,
        device: &Device,
        over: Over,
        buffers: &[(u32, &wgpu::Buffer)],
    ) -> Self {
        let entries: Vec<wgpu::BindGroupEntry<'_>> = buffers
            .iter()
            .map(|&(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let bound = device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(name),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        Self { name, pipeline, bound, over }
    }
}

/// The compute pipeline of one stage's entry point.
pub(super) fn pipeline(device: &Device, shader: &StageShader, entry: &str) -> wgpu::ComputePipeline {
    let module = device.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some(shader.name),
        source: wgpu::ShaderSource::Wgsl(shader.source.into()),
    });
    device.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(shader.name),
        layout: None,
        module: &module,
        entry_point: Some(entry),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    })
}

/// A read-only table on the device.
pub(super) fn table<T: Pod>(device: &Device, name: &str, rows: &[T]) -> wgpu::Buffer {
    let bytes: &[u8] = cast_slice(rows);
    let buffer = device.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(name),
        size: (bytes.len() as u64).max(16).next_multiple_of(16),
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    device.queue.write_buffer(&buffer, 0, bytes);
    buffer
}

/// Folds a row of groups into a rectangle, as no side may be longer than 65,535.
pub(super) fn groups(count: u32) -> (u32, u32) {
    const LONGEST: u32 = 65_535;
    let tall = count.div_ceil(LONGEST).max(1);
    (count.div_ceil(tall).max(1), tall)
}
