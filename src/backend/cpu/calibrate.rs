//! calibrate in f32 lanes; see [`crate::stage::calibrate`].

use crate::percept::Flags;
use crate::signal::RawValue;
use crate::stage::calibrate::{HUGE_BITS, SIZE_BITS, TINY_BITS, UNUSABLE};
use crate::stage::layout::Taxel;

/// Reads `count ≤ L` frames, each with its values side by side, into lanes by taxel.
pub(super) fn lanes<const L: usize>(
    taxels: &[Taxel],
    raw: &[RawValue],
    count: usize,
    pressures: &mut [[f32; L]],
    statuses: &mut [[u32; L]],
) {
    for (slot, taxel) in taxels.iter().enumerate() {
        let (pressures, statuses) = (&mut pressures[slot], &mut statuses[slot]);
        for lane in 0..count {
            (pressures[lane], statuses[lane]) = one(raw[lane * taxels.len() + slot], taxel);
        }
        // Lanes beyond the batch's end are empty frames.
        pressures[count..].fill(0.0);
        statuses[count..].fill(0);
    }
}

fn one(raw: RawValue, taxel: &Taxel) -> (f32, u32) {
    let is_tiny = |size: u32| size != 0 && size < TINY_BITS;
    let bits = raw.to_bits();
    let size = bits & SIZE_BITS;
    if raw.is_missing() {
        return (0.0, Flags::INCOMPLETE.bits() | UNUSABLE);
    }
    let faulty = Flags::FAULTY_INPUT.bits();
    if size > HUGE_BITS || taxel.masked != 0 {
        return (0.0, faulty | UNUSABLE);
    }
    let value = f32::from_bits(bits);
    let beyond = value < taxel.raw_low || value > taxel.raw_high;
    let mut status = if beyond { Flags::OUT_OF_RANGE.bits() } else { 0 };
    let value = if is_tiny(size) { 0.0 } else { value };
    let pressure = (value - taxel.baseline) * taxel.gain;
    let pressure_size = pressure.to_bits() & SIZE_BITS;
    if pressure_size > HUGE_BITS {
        return (0.0, faulty | UNUSABLE);
    }
    if is_tiny(size) || is_tiny(pressure_size) {
        status |= faulty;
    }
    if is_tiny(pressure_size) || pressure <= taxel.dead_band {
        return (0.0, status);
    }
    if pressure > taxel.p_max {
        status |= Flags::SATURATED.bits();
    }
    (pressure, status)
}
