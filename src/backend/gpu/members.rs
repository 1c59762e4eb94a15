//! A table of members on the device, in the form that a plan of that size and a device of that kind read best.

use bytemuck::cast_slice;

use super::adapter::Device;
use super::shaders::Members;
use super::stage::{table, table_as};
use super::{is_processor, pack};
use crate::stage::layout;

/// A share's members, field by field.
pub(super) enum MemberTable {
    Many(wgpu::Buffer),
    /// At most [`layout::FEW`].
    Few(wgpu::Buffer),
    Texture(wgpu::TextureView),
}

impl MemberTable {
    /// `members` on `device`.
    pub(super) fn new(device: &Device, members: &[layout::Member]) -> Self {
        if is_processor(device) {
            return Self::Texture(in_texture(device, members));
        }
        if members.len() > layout::FEW {
            return Self::Many(table(device, "members", members));
        }
        let all = (layout::FEW * size_of::<layout::Member>()) as u64;
        Self::Few(table_as(device, "members", members, wgpu::BufferUsages::UNIFORM, all))
    }

    /// What a program that reads it is told.
    pub(super) fn kind(&self) -> Members {
        match self {
            Self::Many(_) => Members::Many,
            Self::Few(_) => Members::Few,
            Self::Texture(_) => Members::Texture,
        }
    }

    /// What such a program binds.
    pub(super) fn binding(&self) -> wgpu::BindingResource<'_> {
        match self {
            Self::Many(buffer) | Self::Few(buffer) => buffer.as_entire_binding(),
            Self::Texture(view) => wgpu::BindingResource::TextureView(view),
        }
    }
}

fn in_texture(device: &Device, members: &[layout::Member]) -> wgpu::TextureView {
    let texel = size_of::<layout::Member>();
    let texture = pack::texture(device, "members", size_of_val(members) as u64, texel);
    let (row, size) = (pack::TEXELS * texel, texture.size());
    let mut bytes = cast_slice::<_, u8>(members).to_vec();
    bytes.resize(row * size.height as usize, 0);
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row as u32), rows_per_image: None };
    device.queue.write_texture(texture.as_image_copy(), &bytes, layout, size);
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
