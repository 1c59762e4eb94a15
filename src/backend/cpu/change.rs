//! change in f32 lanes; see [`crate::stage::change`].

use super::super::Step;
use super::calibrate;
use crate::percept::Flags;
use crate::scene::Plan;
use crate::signal::RawValue;
use crate::stage::calibrate::{HUGE_BITS, TINY_BITS, UNUSABLE};

/// Adds the changes to the pressures of `steps.len() ≤ L` frames; `before` is the frame before the first, as it came.
pub(super) fn lanes<const L: usize>(
    plan: &Plan,
    before: &[RawValue],
    steps: &[Step],
    pressures: &mut [[f32; L]],
    statuses: &mut [[u32; L]],
) {
    let (pressed, changes) = pressures.split_at_mut(plan.calibrated());
    let (pressed_statuses, change_statuses) = statuses.split_at_mut(plan.calibrated());
    let taxels = &plan.taxels[plan.calibrated()..];
    for (taxel, (changes, change_statuses)) in taxels.iter().zip(changes.iter_mut().zip(change_statuses)) {
        let slot = taxel.response as usize;
        let mut last = calibrate::single(plan, slot, before[plan.channel_of(slot)]);
        for (lane, step) in steps.iter().enumerate() {
            let now = (pressed[slot][lane], pressed_statuses[slot][lane]);
            (changes[lane], change_statuses[lane]) = one(now, last, step, taxel.dead_band);
            last = now;
        }
        changes[steps.len()..].fill(0.0);
        change_statuses[steps.len()..].fill(0);
    }
}

fn one((now, status): (f32, u32), (before, status_before): (f32, u32), step: &Step, dead_band: f32) -> (f32, u32) {
    if !step.flags.is_empty() {
        return (0.0, status | step.flags.bits() | UNUSABLE);
    }
    let status = status | status_before;
    if status & UNUSABLE != 0 {
        return (0.0, status);
    }
    let change = (now - before).abs() / step.dt_s as f32;
    if change.to_bits() > HUGE_BITS {
        return (0.0, Flags::FAULTY_INPUT.bits() | UNUSABLE);
    }
    if change.to_bits() < TINY_BITS || change <= dead_band {
        return (0.0, status);
    }
    (change, status)
}
