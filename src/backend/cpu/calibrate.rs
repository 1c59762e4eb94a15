//! calibrate in f32 lanes; see [`crate::stage::calibrate`].

use crate::percept::Flags;
use crate::scene::Plan;
use crate::signal::RawValue;
use crate::stage::calibrate::{HUGE_BITS, SIZE_BITS, TINY_BITS, UNUSABLE};
use crate::stage::layout::{FIRST_CURVE, Knot, MASKED, Taxel};

/// Reads `count ≤ L` frames, each with its values side by side, into lanes by taxel.
pub(super) fn lanes<const L: usize>(
    plan: &Plan,
    raw: &[RawValue],
    count: usize,
    pressures: &mut [[f32; L]],
    statuses: &mut [[u32; L]],
) {
    let channels = plan.channels();
    for (slot, taxel) in plan.taxels[..plan.calibrated()].iter().enumerate() {
        let channel = plan.channel_of(slot);
        let (pressures, statuses) = (&mut pressures[slot], &mut statuses[slot]);
        if taxel.response < FIRST_CURVE {
            for lane in 0..count {
                let straight = |above| above * taxel.gain;
                (pressures[lane], statuses[lane]) = one(raw[lane * channels + channel], taxel, straight);
            }
        } else {
            let knots = plan.knots_of(slot);
            for lane in 0..count {
                (pressures[lane], statuses[lane]) = one(raw[lane * channels + channel], taxel, |x| on_curve(knots, x));
            }
        }
        // Lanes beyond the batch's end are empty frames.
        pressures[count..].fill(0.0);
        statuses[count..].fill(0);
    }
}

/// The pressure and status of one taxel in one frame.
pub(super) fn single(plan: &Plan, slot: usize, raw: RawValue) -> (f32, u32) {
    let taxel = &plan.taxels[slot];
    if taxel.response < FIRST_CURVE {
        one(raw, taxel, |above| above * taxel.gain)
    } else {
        one(raw, taxel, |x| on_curve(plan.knots_of(slot), x))
    }
}

fn one(raw: RawValue, taxel: &Taxel, response: impl Fn(f32) -> f32) -> (f32, u32) {
    let is_tiny = |size: u32| size != 0 && size < TINY_BITS;
    let bits = raw.to_bits();
    let size = bits & SIZE_BITS;
    if raw.is_missing() {
        return (0.0, Flags::INCOMPLETE.bits() | UNUSABLE);
    }
    let faulty = Flags::FAULTY_INPUT.bits();
    if size > HUGE_BITS || taxel.response == MASKED {
        return (0.0, faulty | UNUSABLE);
    }
    let value = f32::from_bits(bits);
    let beyond = value < taxel.raw_low || value > taxel.raw_high;
    let mut status = if beyond { Flags::OUT_OF_RANGE.bits() } else { 0 };
    let value = if is_tiny(size) { 0.0 } else { value };
    let pressure = response(value - taxel.baseline);
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

fn on_curve(knots: &[Knot], x: f32) -> f32 {
    let (first, last) = (knots[0], knots[knots.len() - 1]);
    if x <= first.raw {
        return first.p;
    }
    if x >= last.raw {
        return last.p;
    }
    let after = knots.partition_point(|knot| knot.raw <= x);
    let (from, to) = (knots[after - 1], knots[after]);
    (from.p + (x - from.raw) * from.slope).clamp(from.p.min(to.p), from.p.max(to.p))
}
