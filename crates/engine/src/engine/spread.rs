//! Positions of fields whose members lie on several links, which move against each other.
//!
//! Such a field's position in the world is Σ wP x / Σ wP over its pressed members, each at x, where its own link has it in this
//! frame. P is calibrated here, in f64 from the raw values, so that the position is the same bits on every backend; a
//! frame without poses does not come here, and neither does a field on one link.

use glam::{DAffine3, DVec3};

use super::links::{LinkPoses, Links};
use crate::backend::{RawBatch, Step};
use crate::percept::Flags;
use crate::scene::{Plan, PlanField};
use crate::signal::{Frame, RawValue};
use crate::stage::calibrate;
use crate::stage::change::{self, Heard};

/// The frames of a batch, whose raw values fields are placed by.
#[derive(Clone, Copy)]
pub(super) struct Frames<'a> {
    pub(super) plan: &'a Plan,
    pub(super) links: &'a Links,
    pub(super) frames: &'a [Frame],
    pub(super) raw: &'a RawBatch<'a>,
    /// Which frame of `raw` the first one is.
    pub(super) offset: usize,
    /// The raw values of the frame before the first of these, by channel; for letters of change.
    pub(super) before: &'a [RawValue],
}

/// What is known of one frame: found when the first field asks.
#[derive(Clone, Debug, Default)]
pub(super) struct Now {
    /// The frame of the poses, and that of the pressures.
    posed: Option<usize>,
    pressed: Option<usize>,
    poses: LinkPoses,
    /// By slot, P.
    pressures: Vec<f64>,
}

impl Now {
    /// Forgets the frame.
    pub(super) fn forget(&mut self) {
        (self.posed, self.pressed) = (None, None);
    }
}

impl Frames<'_> {
    /// The number of frame `frame` in the call.
    pub(super) fn number_of(&self, frame: usize) -> usize {
        self.raw.first + self.offset + frame
    }

    /// By link, where it is in frame `frame`.
    pub(super) fn poses<'n>(&self, frame: usize, now: &'n mut Now) -> &'n [Option<DAffine3>] {
        if now.posed != Some(frame) {
            now.posed = Some(frame);
            self.links.poses_into(self.number_of(frame), &self.frames[frame], &mut now.poses);
        }
        now.poses.as_slice()
    }

    /// Where `field` is touched in frame `frame`, m in the world, or why that is not known.
    #[inline(never)]
    pub(super) fn position(&self, field: &PlanField, frame: usize, now: &mut Now) -> Result<DVec3, Flags> {
        self.poses(frame, now);
        if now.pressed != Some(frame) {
            now.pressed = Some(frame);
            self.pressures_into(self.offset + frame, &mut now.pressures);
        }
        let members = self.plan.members_of(field);
        let (mut total, mut moment) = (0.0, DVec3::ZERO);
        for part in field.parts.iter() {
            let (mut pull, mut of_link) = (0.0, DVec3::ZERO);
            for &(member, place) in &part.members {
                let pressure = now.pressures[members[member as usize].slot as usize];
                if pressure > 0.0 {
                    let own = self.plan.weight(field, member as usize) * pressure;
                    pull += own;
                    of_link += own * place;
                }
            }
            if pull > 0.0 {
                let world_from_link = now.poses.as_slice()[part.link].ok_or(Flags::NO_POSE)?;
                total += pull;
                moment += world_from_link.transform_vector3(of_link) + pull * world_from_link.translation;
            }
        }
        // Nothing is pressed where single precision alone has a taxel over its dead band.
        if total > 0.0 { Ok(moment / total) } else { Err(Flags::NO_POSE) }
    }

    /// Puts P of each slot that a field on several links reads in frame `frame` of the raw batch into `pressures`.
    fn pressures_into(&self, frame: usize, pressures: &mut Vec<f64>) {
        let (plan, rows) = (self.plan, self.raw.rows);
        pressures.clear();
        pressures.resize(plan.slots(), 0.0);
        let heard = |raw: RawValue, slot: usize| {
            let calibration = &plan.calibrations[plan.channel_of(slot)];
            Heard { raw, pressure: calibrate::reference(raw, calibration, plan.curve_of(slot)) }
        };
        for &slot in &plan.spread_slots {
            let (slot, channel) = (slot as usize, plan.channel_of(slot as usize));
            let raw = rows.value(frame, channel);
            pressures[slot] = if slot < plan.calibrated() {
                calibrate::pressure(raw, &plan.calibrations[channel], plan.curve_of(slot)).unwrap_or(0.0)
            } else {
                let response = plan.taxels[slot].response as usize;
                let before = match frame.checked_sub(1) {
                    Some(before) => rows.value(before, channel),
                    None => self.before.get(channel).copied().unwrap_or_default(),
                };
                let Step { dt_s, flags } = self.raw.steps[frame];
                change::reference(heard(raw, response), heard(before, response), dt_s, flags, plan.change_dead_band)
                    .value
            };
        }
    }
}
