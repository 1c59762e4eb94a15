//! Pictures: a lit surface and discs on it, drawn off-screen. It is here because this is where wgpu is.

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec3};

use super::adapter::{self, Device};
use super::stage::table_as;
use crate::error::{Error, Result};

const SOURCE: &str = somatic_shaders::picture::BODY;
/// What a pixel is: eight bits a channel, in sRGB; the device converts.
const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Samples a pixel, which every device has for these formats.
const SAMPLES: u32 = 4;
/// Where a texture is copied out, its rows start at multiples of this, bytes.
const ROW: u32 = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT;
/// Longest side of a picture, pixels, that every device can draw.
pub const LONGEST_SIDE: u32 = 8192;

/// A corner of a triangle.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Corner {
    /// In the world.
    pub position: [f32; 3],
    /// Outward unit normal, in the world.
    pub normal: [f32; 3],
}

/// A piece of a disc.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Slice {
    /// Middle of the disc, in the world.
    pub middle: [f32; 3],
    /// Of the disc, in the world's unit.
    pub radius: f32,
    /// Unit normal; a disc that looks away from the eye is not seen.
    pub normal: [f32; 3],
    /// How far it is moved towards the eye, in radii.
    pub lift: f32,
    /// Linear red, green and blue; the fourth is 1 where light falls on it and 0 where its colour is as it is.
    pub colour: [f32; 4],
    /// Where the piece starts and how far it goes round, rad; the others are ignored.
    pub span: [f32; 4],
}

/// From where, and into which part of the picture.
#[derive(Clone, Copy, Debug)]
pub struct Eye {
    /// Takes the world to the part's −1 to 1, depth to 0 to 1.
    pub clip_from_world: Mat4,
    /// Unit vectors in the world: to the right, up, and towards the eye.
    pub axes: [Vec3; 3],
    /// Left, top, width and height of the part, pixels.
    pub part: [u32; 4],
}

/// All that is drawn.
#[derive(Debug, Default)]
pub struct Drawing {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Linear red, green and blue where nothing is.
    pub background: [f64; 3],
    /// The corners of the body.
    pub corners: Vec<Corner>,
    /// Its triangles, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// What is drawn on it.
    pub slices: Vec<Slice>,
    /// Triangles that each slice is made of.
    pub fan: u32,
    /// The views, each in its part of the picture.
    pub eyes: Vec<Eye>,
}

/// The uniform block of a view, as `shaders/picture/body.wgsl` has it.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct View {
    clip_from_world: [[f32; 4]; 4],
    axes: [[f32; 4]; 3],
}

/// The pixels of `drawing`, three bytes each, row by row from the top left.
pub fn draw(drawing: &Drawing) -> Result<Vec<u8>> {
    let [width, height] = drawing.size;
    if !(1..=LONGEST_SIDE).contains(&width) || !(1..=LONGEST_SIDE).contains(&height) {
        return Err(Error::usage(format!(
            "a picture of {width} × {height} pixels cannot be drawn; its sides may be 1 to {LONGEST_SIDE} long"
        )));
    }
    let device = adapter::shared()?;
    let most = wgpu::Limits::default().max_buffer_size;
    let largest =
        [size_of_val(&drawing.corners[..]), size_of_val(&drawing.slices[..]), size_of_val(&drawing.triangles[..])];
    if largest.iter().any(|&bytes| bytes as u64 > most) {
        return Err(Error::failed("the mesh is larger than a device can hold; thin it out to draw it"));
    }
    let picture = texture(&device, drawing.size, FORMAT, 1);
    let samples = texture(&device, drawing.size, FORMAT, SAMPLES);
    let depths = texture(&device, drawing.size, DEPTH, SAMPLES);
    let padded = (4 * width).next_multiple_of(ROW);
    let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
    let readback = device.buffer("picture", u64::from(padded) * u64::from(height), usage);
    let mut encoder = device.encoder();
    draw_into(&device, &mut encoder, drawing, &samples, &depths, &picture);
    encoder.copy_texture_to_buffer(
        picture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &readback,
            layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None },
        },
        picture.size(),
    );
    device.queue.submit([encoder.finish()]);
    let (mapped_sender, outcome) = std::sync::mpsc::channel();
    readback.map_async(wgpu::MapMode::Read, .., move |result| {
        let _ = mapped_sender.send(result);
    });
    device.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| device.lost(&e))?;
    device.check()?;
    outcome.recv().map_err(|e| device.lost(&e))?.map_err(|e| device.lost(&e))?;
    let mapped = readback.get_mapped_range(..).map_err(|e| device.lost(&e))?;
    let mut pixels = Vec::with_capacity((3 * width * height) as usize);
    for row in mapped.chunks_exact(padded as usize) {
        row[..4 * width as usize].chunks_exact(4).for_each(|pixel| pixels.extend_from_slice(&pixel[..3]));
    }
    Ok(pixels)
}

fn texture(device: &Device, [width, height]: [u32; 2], format: wgpu::TextureFormat, samples: u32) -> wgpu::Texture {
    device.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: samples,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

fn draw_into(
    device: &Device,
    encoder: &mut wgpu::CommandEncoder,
    drawing: &Drawing,
    samples: &wgpu::Texture,
    depths: &wgpu::Texture,
    picture: &wgpu::Texture,
) {
    let whole = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
    let (samples, depths, picture) = (whole(samples), whole(depths), whole(picture));
    let surface = pipeline(device, Of::Surface);
    let slices = pipeline(device, Of::Slices { triangles: drawing.fan });
    let corners = table_as(device, "corners", &drawing.corners, wgpu::BufferUsages::VERTEX, 16);
    let indices = table_as(device, "triangles", &drawing.triangles, wgpu::BufferUsages::INDEX, 16);
    let instances = table_as(device, "slices", &drawing.slices, wgpu::BufferUsages::VERTEX, 16);
    let [r, g, b] = drawing.background;
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("picture"),
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: &samples,
            depth_slice: None,
            resolve_target: Some(&picture),
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 }),
                store: wgpu::StoreOp::Discard,
            },
        })],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &depths,
            depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: wgpu::StoreOp::Discard }),
            stencil_ops: None,
        }),
        ..wgpu::RenderPassDescriptor::default()
    });
    for eye in &drawing.eyes {
        let view = View {
            clip_from_world: eye.clip_from_world.to_cols_array_2d(),
            axes: eye.axes.map(|axis| axis.extend(0.0).to_array()),
        };
        let uniform = table_as(device, "view", &[view], wgpu::BufferUsages::UNIFORM, 16);
        let bind = |pipeline: &wgpu::RenderPipeline| {
            device.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("view"),
                layout: &pipeline.get_bind_group_layout(0),
                entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }],
            })
        };
        let [left, top, width, height] = eye.part.map(|pixels| pixels as f32);
        pass.set_viewport(left, top, width, height, 0.0, 1.0);
        if !drawing.triangles.is_empty() {
            pass.set_pipeline(&surface);
            pass.set_bind_group(0, &bind(&surface), &[]);
            pass.set_vertex_buffer(0, corners.slice(..));
            pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..3 * drawing.triangles.len() as u32, 0, 0..1);
        }
        if !drawing.slices.is_empty() {
            pass.set_pipeline(&slices);
            pass.set_bind_group(0, &bind(&slices), &[]);
            pass.set_vertex_buffer(0, instances.slice(..));
            pass.draw(0..3 * drawing.fan, 0..drawing.slices.len() as u32);
        }
    }
}

/// What a pipeline draws.
#[derive(Clone, Copy)]
enum Of {
    Surface,
    Slices { triangles: u32 },
}

fn pipeline(device: &Device, of: Of) -> wgpu::RenderPipeline {
    let module = device.shader("body", SOURCE.to_owned());
    let attributes: &[wgpu::VertexAttribute] = match of {
        Of::Surface => &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3],
        Of::Slices { .. } => &wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x4, 2 => Float32x4, 3 => Float32x4],
    };
    let (vertex, fragment, stride, step_mode) = match of {
        Of::Surface => ("surface", "surface_colour", size_of::<Corner>(), wgpu::VertexStepMode::Vertex),
        Of::Slices { .. } => ("slice", "slice_colour", size_of::<Slice>(), wgpu::VertexStepMode::Instance),
    };
    let constants: &[(&str, f64)] = match of {
        Of::Surface => &[],
        Of::Slices { triangles } => &[("TRIANGLES", f64::from(triangles))],
    };
    let options = wgpu::PipelineCompilationOptions { constants, ..wgpu::PipelineCompilationOptions::default() };
    device.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(vertex),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(vertex),
            compilation_options: options.clone(),
            buffers: &[Some(wgpu::VertexBufferLayout { array_stride: stride as u64, step_mode, attributes })],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::LessEqual),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState { count: SAMPLES, ..wgpu::MultisampleState::default() },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(fragment),
            compilation_options: options,
            targets: &[Some(FORMAT.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}

#[cfg(test)]
mod tests {
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    use super::*;
    use somatic_testing::skip;

    #[test]
    fn the_shader_validates_and_its_pipelines_build_without_any_driver() {
        let module = naga::front::wgsl::parse_str(SOURCE).unwrap();
        let validated = Validator::new(ValidationFlags::all(), Capabilities::empty()).validate(&module);
        assert!(validated.is_ok(), "{:?}", validated.err());
        let device = adapter::open(wgpu::Backends::NOOP).expect("noop is always there");
        for of in [Of::Surface, Of::Slices { triangles: 9 }] {
            assert!(format!("{:?}", pipeline(&device, of)).contains("RenderPipeline"));
        }
        device.check().unwrap();
    }

    #[test]
    fn what_is_drawn_lies_where_the_eye_sees_it() {
        let Ok(_) = adapter::shared() else { return skip("GPU", "no adapter answers") };
        // A white slice of the upper half of a disc in the right half of the picture, and nothing else.
        let slice = Slice {
            middle: [0.5, 0.0, 0.0],
            radius: 0.4,
            normal: [0.0, 0.0, 1.0],
            lift: 0.0,
            colour: [1.0; 4],
            span: [0.0, std::f32::consts::PI, 0.0, 0.0],
        };
        let eye = Eye {
            clip_from_world: Mat4::from_diagonal(glam::Vec4::new(1.0, 1.0, -0.25, 1.0))
                + Mat4::from_cols(glam::Vec4::ZERO, glam::Vec4::ZERO, glam::Vec4::ZERO, glam::Vec4::Z * 0.5),
            axes: [Vec3::X, Vec3::Y, Vec3::Z],
            part: [0, 0, 100, 100],
        };
        let away = Slice { normal: [0.0, 0.0, -1.0], middle: [-0.5, 0.0, 0.0], ..slice };
        let drawing =
            Drawing { size: [100, 100], slices: vec![slice, away], fan: 24, eyes: vec![eye], ..Drawing::default() };
        let pixels = draw(&drawing).unwrap();
        let lit = |x: usize, y: usize| pixels[3 * (100 * y + x)] > 100;
        assert!(lit(75, 40) && lit(60, 45) && lit(90, 45));
        assert!(!lit(75, 60) && !lit(25, 40) && !lit(75, 20) && !lit(50, 45));
        let count = pixels.chunks_exact(3).filter(|pixel| pixel[0] > 100).count() as f64;
        // Half a disc of 20 pixels' radius, less what 24 chords cut off, and half a pixel around it.
        assert!((count - std::f64::consts::PI * 200.0).abs() < 0.5 * 103.0, "{count}");
        assert!(draw(&Drawing { size: [0, 9], ..Drawing::default() }).unwrap_err().is_usage());
    }
}
