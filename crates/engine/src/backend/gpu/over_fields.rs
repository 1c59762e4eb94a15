//! The stages from contact to principal_axis on the device: a program over fields, one over wide ones, and three over their parts.

use wgpu::BindingResource;

use super::adapter::Device;
use super::columns::Columns;
use super::members::MemberTable;
use super::shaders::{self, Abreast, Shader, Values};
use super::shares::{Share, Shares};
use super::stage::{Over, Stage, table};
use crate::scene::Plan;
use crate::stage::layout;

/// Bytes that a part of a wide field leaves for the next program, for each quad: `by_parts` in
/// `shaders/shared/wide_fields.wgsl`.
pub(super) const BY_PART: usize = 3 * 9 * 16;

/// What the programs over fields know of a plan, on the device.
pub(super) struct OverFields {
    shares: Vec<Tables>,
    /// The first parts of fields that are in parts, and how many.
    firsts: (wgpu::Buffer, u32),
    /// What parts leave for the next program.
    by_parts: wgpu::Buffer,
    abreast: Abreast,
    overrides: Vec<(&'static str, f64)>,
    /// Whether there are lines to look for.
    lined: bool,
}

/// A share's.
struct Tables {
    members: MemberTable,
    depths: wgpu::Buffer,
    /// And how many.
    narrow: (wgpu::Buffer, u32),
    wide: (wgpu::Buffer, u32),
    parts: (wgpu::Buffer, u32),
}

/// The buffers that programs read and write besides, as they are bound.
pub(super) struct Bound<'a> {
    pub(super) batch: &'a wgpu::Buffer,
    pub(super) taxels: &'a wgpu::Buffer,
    pub(super) results: &'a wgpu::Buffer,
    /// Where they read what taxels say.
    pub(super) values: Values,
    /// That, and its statuses, where it has any apart.
    pub(super) at: (BindingResource<'a>, Option<BindingResource<'a>>),
}

pub(super) fn most_members(device: &Device) -> usize {
    device.device.limits().max_storage_buffer_binding_size as usize / size_of::<layout::Member>()
}

/// Members of a wide field's part on `device`, at most unless it has very many, however many frames a call has, as sums depend on it: many
/// parts keep a GPU's processors busy, few take less joining.
pub(super) fn of_part(device: &Device) -> usize {
    if device.is_processor() { 8 * layout::WIDE } else { layout::WIDE }
}

impl OverFields {
    /// The fields of `plan`, in `shares`, for submissions of `capacity` frames.
    pub(super) fn new(device: &Device, plan: &Plan, shares: &Shares, columns: &Columns, capacity: usize) -> Self {
        let depths: Vec<f32> = plan.fields.iter().flat_map(|field| field.depths.iter().copied()).collect();
        let tables = |share: &Share| Tables {
            members: MemberTable::new(device, &plan.members[share.members.clone()]),
            depths: table(device, "depths", &depths[share.members.clone()]),
            narrow: (table(device, "fields", &share.narrow), share.narrow.len() as u32),
            wide: (table(device, "wide fields", &share.wide), share.wide.len() as u32),
            parts: (table(device, "parts", &share.parts), share.parts.len() as u32),
        };
        let by_parts = (shares.parts * layout::padded_quads(capacity) * BY_PART).max(BY_PART) as u64;
        let by_parts = device.buffer("by parts", by_parts, wgpu::BufferUsages::STORAGE);
        let stages = plan.stages();
        Self {
            shares: shares.shares.iter().map(tables).collect(),
            firsts: (table(device, "first parts", &shares.firsts), shares.firsts.len() as u32),
            by_parts,
            abreast: if capacity == 1 { Abreast::One } else { Abreast::Four },
            overrides: columns.of_fields(plan),
            lined: stages.orientation || stages.principal_axis,
        }
    }

    pub(super) fn stages(&self, device: &Device, bound: &Bound<'_>) -> Vec<Stage> {
        let (at, statuses) = &bound.at;
        let by_parts = || (8, self.by_parts.as_entire_binding());
        // A program with the buffers that a pass over members reads, and `more`.
        let over_members = |share: &Tables, shader: &Shader, entry, over, rows: &wgpu::Buffer, more| {
            let buffers = [(0, bound.batch), (1, rows), (3, &share.depths), (4, bound.taxels)];
            let mut bindings: Vec<_> = buffers.map(|(binding, buffer)| (binding, buffer.as_entire_binding())).into();
            bindings.extend([(2, share.members.binding()), (5, at.clone()), more]);
            bindings.extend(statuses.iter().map(|statuses| (6, statuses.clone())));
            Stage::bound(device, shader, entry, over, &self.overrides, &bindings)
        };
        let results = || (7, bound.results.as_entire_binding());
        let wide_shader = |share: &Tables| shaders::wide_fields(self.abreast, bound.values, share.members.kind());
        let mut stages = Vec::new();
        for share in &self.shares {
            let (rows, count) = &share.narrow;
            if *count > 0 {
                let shader = shaders::narrow_fields(self.abreast, bound.values, share.members.kind());
                let over = if self.abreast == Abreast::One { Over::OneFrame(*count) } else { Over::Quads(*count) };
                stages.push(over_members(share, &shader, "main", over, rows, results()));
            }
            let (rows, count) = &share.wide;
            if *count > 0 {
                stages.push(over_members(share, &wide_shader(share), "whole", Over::Wide(*count), rows, results()));
            }
        }
        let in_parts = || self.shares.iter().filter(|share| share.parts.1 > 0);
        for share in in_parts() {
            let (rows, count) = &share.parts;
            stages.push(over_members(share, &wide_shader(share), "sums", Over::Wide(*count), rows, by_parts()));
        }
        for share in in_parts().filter(|_| self.lined) {
            let (rows, count) = &share.parts;
            let buffers = [(0, bound.batch.as_entire_binding()), (1, rows.as_entire_binding())];
            let bindings = [&buffers[..], &[(2, share.members.binding()), (5, at.clone()), by_parts()]].concat();
            let (shader, over) = (wide_shader(share), Over::Wide(*count));
            stages.push(Stage::bound(device, &shader, "lines", over, &self.overrides, &bindings));
        }
        if let Some(share) = in_parts().next() {
            let (rows, count) = &self.firsts;
            let buffers = [(0, bound.batch.as_entire_binding()), (1, rows.as_entire_binding())];
            let bindings = [&buffers[..], &[results(), by_parts()]].concat();
            stages.push(Stage::bound(
                device,
                &wide_shader(share),
                "ends",
                Over::Wide(*count),
                &self.overrides,
                &bindings,
            ));
        }
        stages
    }
}
