//! From the device's columns to the percepts'.

use bytemuck::cast_slice;

use super::{Gpu, What};
use crate::percept::{CellsMut, Flags, Outputs};
use crate::stage::layout;

/// The bit of a cell's status from which on it says which quantities are present.
pub(super) const PRESENT: u32 = 16;

impl Gpu {
    /// From the device's order (field by field) to the percepts' (frame by frame), lengths in metres.
    pub(super) fn unpack(&self, what: What, bytes: &[u8], frames: usize, cells: &mut CellsMut<'_>) {
        let fields = self.plan.fields.len();
        let unit_of = |field: usize| self.plan.fields[field].unit_m;
        let each = |f: &mut dyn FnMut(usize, usize, usize)| {
            for field in 0..fields {
                for frame in 0..frames {
                    f(field, field * frames + frame, frame * fields + field);
                }
            }
        };
        let wants = |output| self.plan.outputs.contains(output);
        match what {
            What::Cells => {
                let statuses: &[u32] = cast_slice(bytes);
                let (outputs, flag_bits) = (self.plan.outputs.bits(), (1 << PRESENT) - 1);
                each(&mut |_, from, to| {
                    cells.set_status(to, statuses[from] & flag_bits, (statuses[from] >> PRESENT) & outputs);
                });
            }
            What::Contacts => {
                let contacts: &[[f32; 4]] = cast_slice(bytes);
                let scalar = |output, column: &mut [f32], part: usize| {
                    if wants(output) {
                        each(&mut |_, from, to| column[to] = contacts[from][part]);
                    }
                };
                scalar(Outputs::TOTAL, cells.total, 0);
                scalar(Outputs::PEAK, cells.peak, 1);
                scalar(Outputs::AREA, cells.area, 2);
                if wants(Outputs::ACTIVE) {
                    each(&mut |_, from, to| cells.active[to] = contacts[from][3].to_bits());
                }
            }
            What::Centroids => {
                let centroids: &[[f32; 4]] = cast_slice(bytes);
                each(&mut |field, from, to| {
                    let [u, v, depth, _] = centroids[from];
                    let unit_m = unit_of(field);
                    (cells.centroid_u[to], cells.centroid_v[to]) = (u * unit_m, v * unit_m);
                    if let Some(kept) = cells.centroid_depth.get_mut(to) {
                        *kept = depth * unit_m;
                    }
                });
            }
            What::Orientations => {
                let angles: &[f32] = cast_slice(bytes);
                each(&mut |_, from, to| cells.orientation[to] = angles[from]);
            }
            What::Motions => {
                let motions: &[layout::Motion] = cast_slice(bytes);
                each(&mut |field, from, to| {
                    let (motion, unit_m) = (&motions[from], unit_of(field));
                    cells.flags[to] |= Flags::from_bits_truncate(motion.status & ((1 << PRESENT) - 1));
                    cells.present[to] |= motion_outputs(motion.status >> PRESENT) & self.plan.outputs;
                    let write = |column: &mut [f32], value: f32| {
                        if let Some(place) = column.get_mut(to) {
                            *place = value;
                        }
                    };
                    write(cells.direction, motion.direction);
                    write(cells.distance, motion.distance * unit_m);
                    write(cells.radial_distance, motion.radial_distance * unit_m);
                    write(cells.speed, motion.speed * unit_m);
                    write(cells.radial_speed, motion.radial_speed * unit_m);
                    if let Some(displacement) = cells.displacement.get_mut(to) {
                        *displacement = motion.displacement.map(|x| x * unit_m);
                    }
                });
            }
            What::Pressures => {
                let pressures: &[f32] = cast_slice(bytes);
                let slots = self.plan.slots();
                for slot in 0..slots {
                    for frame in 0..frames {
                        cells.pressures[frame * slots + slot] = pressures[slot * frames + frame].into();
                    }
                }
            }
            What::Axes => {
                let axes: &[[f32; 2]] = cast_slice(bytes);
                if wants(Outputs::AXIS) {
                    each(&mut |_, from, to| cells.axis[to] = axes[from][0]);
                }
                if wants(Outputs::ANISOTROPY) {
                    each(&mut |_, from, to| cells.anisotropy[to] = axes[from][1]);
                }
            }
        }
    }
}

/// What the bits of a motion's status stand for: the device has one for each thing that can be absent by itself.
fn motion_outputs(bits: u32) -> Outputs {
    let mut outputs = Outputs::from_bits_truncate(bits) & (Outputs::DISPLACEMENT | Outputs::DIRECTION);
    if outputs.contains(Outputs::DISPLACEMENT) {
        outputs |= Outputs::MOTION - Outputs::DIRECTION;
    }
    outputs
}
