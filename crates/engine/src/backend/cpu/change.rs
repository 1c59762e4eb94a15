//! change in single precision; see [`crate::stage::change`].

use super::super::Step;
use crate::percept::Flags;
use crate::scene::Plan;
use crate::stage::calibrate::{HUGE_BITS, TINY_BITS, UNUSABLE};

/// A taxel's pressure and status.
type Heard = (f32, u32);

/// The changes of `steps.len() ≤ L` frames abreast, whose pressures stand before them; `before` are those of the frame
/// before. Whether any status says anything.
pub(super) fn frames<const L: usize>(
    plan: &Plan,
    steps: &[Step],
    before: (&[f32], &[u32]),
    pressures: &mut [[f32; L]],
    statuses: &mut [[u32; L]],
) -> bool {
    let (pressed, changes) = pressures.split_at_mut(plan.calibrated());
    let (pressed_statuses, change_statuses) = statuses.split_at_mut(plan.calibrated());
    let taxels = &plan.taxels[plan.calibrated()..];
    let mut any = 0;
    for (taxel, (change, status)) in taxels.iter().zip(changes.iter_mut().zip(change_statuses)) {
        let slot = taxel.response as usize;
        let mut last = (before.0[slot], before.1[slot]);
        for (lane, step) in steps.iter().enumerate() {
            let now = (pressed[slot][lane], pressed_statuses[slot][lane]);
            (change[lane], status[lane]) = one(now, last, step, taxel.dead_band);
            any |= status[lane];
            last = now;
        }
    }
    any != 0
}

fn one((now, status): Heard, (before, status_before): Heard, step: &Step, dead_band: f32) -> Heard {
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
