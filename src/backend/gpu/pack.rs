//! From frames to the upload buffer: raw values frame by frame where the device calibrates them, and where they are
//! pressures four frames of a taxel side by side, as fields read them.

use std::array;

use bytemuck::{bytes_of, cast_slice};

use super::{Gpu, HEADER, STEP};
use crate::backend::{RawBatch, Rows};
use crate::error::Result;
use crate::signal::RawValue;
use crate::stage::layout;

/// Quads whose vectors fill a cache line.
const IN_LINE: usize = 4;

impl Gpu {
    /// Bytes that the raw values of `frames` frames go up in.
    pub(super) fn raw_bytes(&self, frames: usize) -> usize {
        raw_bytes(self.plan.channels(), frames, self.direct)
    }

    /// Fills a set's upload buffer.
    pub(super) fn pack(&mut self, set: usize, raw: &RawBatch<'_>, header: &layout::Batch) -> Result<()> {
        self.packed_steps.clear();
        self.packed_steps.extend(raw.steps.iter().map(|s| layout::Step { dt_s: s.dt_s as f32, flags: s.flags.bits() }));
        let values = (HEADER + raw.frames as u64 * STEP) as usize;
        let end = values + self.raw_bytes(raw.frames);
        let mapped = self.ring[set].upload.get_mapped_range_mut(0..end as u64);
        let mut mapped = mapped.map_err(|e| self.device.lost(&e))?;
        let mut mapped = mapped.slice(..);
        mapped.slice(..HEADER as usize).copy_from_slice(bytes_of(header));
        mapped.slice(HEADER as usize..values).copy_from_slice(cast_slice(&self.packed_steps));
        let mapped = mapped.slice(values..);
        match self.direct {
            true => pack_quads(raw, self.plan.channels(), mapped),
            false => pack_rows(raw, self.plan.channels(), &mut self.packed_row, mapped),
        }
        Ok(())
    }
}

/// Bytes of `frames` frames in quads or in rows.
pub(super) fn raw_bytes(channels: usize, frames: usize, in_quads: bool) -> usize {
    match in_quads {
        true => layout::padded_quads(frames) * channels * 16,
        false => frames * layout::padded_channels(channels) * 4,
    }
}

fn pack_rows(raw: &RawBatch<'_>, channels: usize, row: &mut Vec<RawValue>, mut mapped: wgpu::WriteOnly<'_, [u8]>) {
    let padded = layout::padded_channels(channels);
    for frame in 0..raw.frames {
        row.clear();
        match raw.rows {
            Rows::Picked { frames, picks } => {
                let values = &frames[frame].values[..];
                row.extend(picks.places[..channels].iter().map(|&place| values[place as usize]));
            }
            Rows::Packed { values, channels } => row.extend_from_slice(&values[frame * channels..][..channels]),
        }
        row.resize(padded, RawValue::new(0.0));
        mapped.slice(frame * padded * 4..(frame + 1) * padded * 4).copy_from_slice(cast_slice(row));
    }
}

/// As `at` in `shaders/shared/layout.wgsl` says. A few quads at a time, so that whole lines of the cache are written.
fn pack_quads(raw: &RawBatch<'_>, channels: usize, mut mapped: wgpu::WriteOnly<'_, [u8]>) {
    let lanes = layout::lanes(raw.frames) as usize;
    let quads = lanes.min(IN_LINE);
    for first in (0..raw.frames).step_by(4 * quads) {
        let rows: [&[RawValue]; 4 * IN_LINE] = array::from_fn(|i| {
            let frame = (first + i).min(raw.frames - 1);
            match raw.rows {
                Rows::Packed { values, channels } => &values[frame * channels..][..channels],
                Rows::Picked { frames, .. } => &frames[frame].values[..],
            }
        });
        let (block, lane) = (first / 4 / lanes, first / 4 % lanes);
        let mut put = |slot: usize, place: usize| {
            let line: [RawValue; 4 * IN_LINE] = array::from_fn(|i| rows[i][place]);
            let at = ((block * channels + slot) * lanes + lane) * 16;
            mapped.slice(at..at + 16 * quads).copy_from_slice(cast_slice(&line[..4 * quads]));
        };
        match raw.rows {
            Rows::Packed { .. } => (0..channels).for_each(|slot| put(slot, slot)),
            Rows::Picked { picks, .. } => {
                picks.places[..channels].iter().enumerate().for_each(|(slot, &place)| put(slot, place as usize));
            }
        }
    }
}
