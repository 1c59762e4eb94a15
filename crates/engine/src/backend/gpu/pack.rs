//! From frames to the upload buffer: raw values frame by frame where the device calibrates them, and where they are
//! pressures four frames of a taxel side by side, as fields read them.

use bytemuck::{bytes_of, cast_slice, cast_slice_mut};

use crate::backend::cpu::read;
use crate::backend::{RawBatch, Rows};
use crate::scene::Plan;
use crate::signal::RawValue;
use crate::stage::layout;

/// Bytes before the raw values in the upload buffer: the batch's uniform block.
pub(super) const HEADER: u64 = size_of::<layout::Batch>() as u64;
/// Bytes of a frame's step, which follow.
pub(super) const STEP: u64 = size_of::<layout::Step>() as u64;

/// How raw values go up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Form {
    /// Frame by frame, as calibrate reads them.
    Rows,
    /// As fields read what are pressures: four frames of a taxel side by side.
    Quads,
    /// The same where there is never more than one frame.
    One,
}

impl Form {
    pub(super) fn bytes(self, channels: usize, frames: usize) -> usize {
        match self {
            Self::Rows | Self::One => frames * layout::padded_channels(channels) * 4,
            Self::Quads => layout::padded_quads(frames) * channels * 16,
        }
    }
}

/// Packs frames; it keeps its memory, so that a call allocates nothing.
pub(super) struct Packer {
    pub(super) form: Form,
    channels: usize,
    steps: Vec<layout::Step>,
    row: Vec<RawValue>,
}

impl Packer {
    pub(super) fn new(form: Form, channels: usize, frames: usize) -> Self {
        Self { form, channels, steps: Vec::with_capacity(frames), row: Vec::new() }
    }

    pub(super) fn bytes(&self, frames: usize) -> usize {
        self.form.bytes(self.channels, frames)
    }

    /// Fills an upload buffer; `mapped` is the part that `raw` takes.
    pub(super) fn pack(&mut self, raw: &RawBatch<'_>, header: &layout::Batch, mut mapped: wgpu::WriteOnly<'_, [u8]>) {
        self.steps.clear();
        self.steps.extend(raw.steps.iter().map(|s| layout::Step { dt_s: s.dt_s as f32, flags: s.flags.bits() }));
        let steps = HEADER as usize + cast_slice::<_, u8>(&self.steps).len();
        mapped.slice(..HEADER as usize).copy_from_slice(bytes_of(header));
        mapped.slice(HEADER as usize..steps).copy_from_slice(cast_slice(&self.steps));
        let mapped = mapped.slice(values_at(raw.frames) as usize..);
        match self.form {
            Form::Quads => pack_quads(raw, self.channels, &mut self.row, mapped),
            Form::Rows | Form::One => pack_rows(raw, self.channels, &mut self.row, mapped),
        }
    }
}

/// Where in the upload buffer the raw values of `frames` frames begin: where a texel may.
pub(super) fn values_at(frames: usize) -> u64 {
    (HEADER + frames as u64 * STEP).next_multiple_of(16)
}

fn pack_rows(raw: &RawBatch<'_>, channels: usize, row: &mut Vec<RawValue>, mut mapped: wgpu::WriteOnly<'_, [u8]>) {
    let padded = layout::padded_channels(channels);
    for frame in 0..raw.frames {
        row.clear();
        match raw.rows {
            Rows::Picked { frames, picks } => {
                let values = frames.row(frame);
                row.extend(picks.places[..channels].iter().map(|&place| values[place as usize]));
            }
            Rows::Packed { values, channels } => row.extend_from_slice(&values[frame * channels..][..channels]),
        }
        row.resize(padded, RawValue::new(0.0));
        mapped.slice(frame * padded * 4..(frame + 1) * padded * 4).copy_from_slice(cast_slice(row));
    }
}

/// As `at` in `shaders/shared/layout.wgsl` says, a block at a time: frames are read through, what is written scattered stays
/// in caches, and goes to the device's memory in order.
fn pack_quads(raw: &RawBatch<'_>, channels: usize, scratch: &mut Vec<RawValue>, mut mapped: wgpu::WriteOnly<'_, [u8]>) {
    let block = 4 * layout::lanes(raw.frames) as usize;
    scratch.resize(block * channels, RawValue::new(0.0));
    for (index, start) in (0..raw.frames).step_by(block).enumerate() {
        let end = raw.frames.min(start + block);
        for first in (start..end).step_by(read::FRAMES) {
            let frames = first..end.min(first + read::FRAMES);
            read::side_by_side(raw.rows, frames, channels, cast_slice_mut(scratch), first - start);
        }
        let bytes = block * channels * 4;
        mapped.slice(index * bytes..(index + 1) * bytes).copy_from_slice(cast_slice(scratch));
    }
}

/// What a dispatch over `frames` frames reads about the plan.
pub(super) fn header(plan: &Plan, frames: u32) -> layout::Batch {
    layout::Batch {
        frames,
        channels: plan.channels() as u32,
        calibrated: plan.calibrated() as u32,
        changes: (plan.slots() - plan.calibrated()) as u32,
        fields: plan.fields.len() as u32,
        lanes_log2: layout::lanes(frames as usize).ilog2(),
    }
}
