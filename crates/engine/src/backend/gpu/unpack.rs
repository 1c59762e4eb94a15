//! From the device's columns to the percepts', which both go frame by frame, lengths in metres.

use bytemuck::cast_slice;

use super::Gpu;
use super::columns::Column;
use crate::percept::{CellsMut, Flags, Outputs};
use crate::stage::layout::{self, PRESENT};

const FLAG_BITS: u32 = (1 << PRESENT) - 1;

impl Gpu {
    /// Takes over what came back for `frames` frames: the columns that are read, then pressures if those are.
    pub(super) fn unpack(&self, bytes: &[u8], frames: usize, cells: &mut CellsMut<'_>) {
        let fields = self.plan.fields.len();
        let (columns, rest) = bytes.split_at(frames * fields * 4 * self.columns.read().len());
        for (&column, bytes) in self.columns.read().iter().zip(columns.chunks_exact(frames * fields * 4)) {
            self.unpack_column(column, bytes, cells);
        }
        if !rest.is_empty() {
            self.unpack_pressures(cast_slice(rest), frames, cells.pressures);
        }
    }

    fn unpack_column(&self, column: Column, bytes: &[u8], cells: &mut CellsMut<'_>) {
        let statuses: &[u32] = cast_slice(bytes);
        match column {
            Column::Status => {
                let outputs = self.plan.outputs.low();
                for (cell, status) in statuses.iter().enumerate() {
                    cells.set_status(cell, status & FLAG_BITS, (status >> PRESENT) & outputs);
                }
            }
            Column::Motion => {
                for ((flags, present), status) in cells.flags.iter_mut().zip(&mut *cells.present).zip(statuses) {
                    *flags |= Flags::from_bits_truncate(status & FLAG_BITS);
                    *present |= (motion_outputs(status >> PRESENT) & self.plan.outputs).low();
                }
            }
            Column::Active => cells.active.copy_from_slice(statuses),
            Column::Component(part) => {
                let (from, to): (&[f32], _) = (cast_slice(bytes), &mut cells[part]);
                if part.is_length() {
                    let units_m = self.units_m.iter().cycle();
                    to.iter_mut().zip(from).zip(units_m).for_each(|((to, from), unit_m)| *to = from * unit_m);
                } else {
                    to.copy_from_slice(from);
                }
            }
        }
    }

    /// From blocks of quads, in each slot by slot, to frames. A sign says only that there is a status.
    fn unpack_pressures(&self, quads: &[[f32; 4]], frames: usize, pressures: &mut [f64]) {
        let slots = self.plan.slots();
        let lanes = layout::lanes(frames) as usize;
        for (block, quads) in quads.chunks_exact(slots * lanes).enumerate() {
            for (slot, quads) in quads.chunks_exact(lanes).enumerate() {
                let frames = block * lanes * 4..frames.min((block + 1) * lanes * 4);
                for (frame, &pressure) in frames.zip(quads.as_flattened()) {
                    pressures[frame * slots + slot] = pressure.abs().into();
                }
            }
        }
    }
}

/// What the bits of a motion's status stand for: the device has one for each thing that can be absent by itself.
fn motion_outputs(bits: u32) -> Outputs {
    let mut outputs = Outputs::from_bits_truncate(bits.into()) & (Outputs::DISPLACEMENT | Outputs::DIRECTION);
    if outputs.contains(Outputs::DISPLACEMENT) {
        outputs |= Outputs::MOTION - Outputs::DIRECTION;
    }
    outputs
}
