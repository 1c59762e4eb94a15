//! A table of members on the device, in the form that a plan of that size and a device of that kind read best.

use super::adapter::Device;
use super::shaders::Members;
use super::stage::{table, table_as};
use crate::stage::layout;

/// A share's members, field by field.
pub(super) enum MemberTable {
    Many(wgpu::Buffer),
    /// At most [`layout::FEW`].
    Few(wgpu::Buffer),
}

impl MemberTable {
    pub(super) fn new(device: &Device, members: &[layout::Member]) -> Self {
        if members.len() > layout::FEW {
            return Self::Many(table(device, "members", members));
        }
        let all = (layout::FEW * size_of::<layout::Member>()) as u64;
        Self::Few(table_as(device, "members", members, wgpu::BufferUsages::UNIFORM, all))
    }

    pub(super) fn kind(&self) -> Members {
        match self {
            Self::Many(_) => Members::Many,
            Self::Few(_) => Members::Few,
        }
    }

    pub(super) fn binding(&self) -> wgpu::BindingResource<'_> {
        let (Self::Many(buffer) | Self::Few(buffer)) = self;
        buffer.as_entire_binding()
    }
}
