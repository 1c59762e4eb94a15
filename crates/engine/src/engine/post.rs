//! Post-processing, the same for every backend: places on the surface and in the world, forces, filtered motion.

use glam::DVec3;

use super::cadence::{self, OnChange};
use super::letters::{Cell, Room, SensedValues};
use super::links::Links;
use super::place;
use super::spread::{Frames, Now};
use crate::backend::{RawBatch, Step, sigma};
use crate::percept::{Flags, Host, Outputs, Percepts, Values};
use crate::scene::{Plan, PlanField, SensedMember};
use crate::signal::{Frame, Intake, Quantity, RawValue, Reading, Receptor};
use crate::stage::layout::Member;
use crate::stage::window::Trend;
use crate::stage::{calibrate, difference, filter, force, motion, world_motion};

/// What post-processing keeps from frame to frame.
#[derive(Clone, Debug)]
pub(super) struct PostState {
    pub(super) fields: Vec<PostFieldState>,
    /// The percepts of the last frame, where cadence `on-change` may keep some.
    pub(super) last: Option<Percepts>,
    /// The raw values of the last frame by channel, where changes say where fields on several links are touched.
    pub(super) raw_before: Vec<RawValue>,
    /// Room for what letters are made of that the host makes.
    pub(super) room: Room,
}

/// The same of one field.
#[derive(Clone, Debug, Default)]
pub(super) struct PostFieldState {
    pub(super) filter: filter::Memory,
    /// Where the centroid was, where motion is measured over a time.
    pub(super) difference: difference::Memory,
    /// Where it was touched in the world.
    pub(super) world_motion: world_motion::Memory,
    /// Whether the last frame was in contact, so that there is something to release.
    pub(super) contact: bool,
    /// What its letter measures, where the host makes it.
    pub(super) trend: Trend,
}

impl PostState {
    /// The state before the first frame.
    pub(super) fn initial(plan: &Plan) -> Self {
        Self {
            fields: vec![PostFieldState::default(); plan.fields.len()],
            last: None,
            raw_before: Vec::new(),
            room: Room::new(plan),
        }
    }
}

/// Completes the percepts of a backend.
pub(super) struct Post<'a> {
    pub(super) plan: &'a Plan,
    pub(super) links: &'a Links,
    /// Which fields changed, where the others keep their percepts.
    pub(super) cadence: Option<&'a OnChange>,
    /// By field, whether it was in contact before the batch, where time starts again with that.
    pub(super) kept: Option<&'a [bool]>,
    /// What letters are made of that the host makes.
    pub(super) sensed: SensedValues<'a>,
}

/// Flags every field that holds a taxel that `intake` has noted: stale, corrected in part, or out of range before it was corrected.
pub(super) fn flag_noted(plan: &Plan, intake: &Intake, percepts: &mut Percepts) {
    for (frame, stale) in intake.stale().iter().enumerate().filter(|(_, stale)| !stale.is_empty()) {
        flag_fields_of(plan, |channel| stale.binary_search(&channel).is_ok(), (frame, Flags::STALE), percepts);
    }
    for (frame, notes) in intake.notes().iter().enumerate().filter(|(_, notes)| !notes.is_empty()) {
        for flag in [Flags::INCOMPLETE, Flags::FAULTY_INPUT, Flags::OUT_OF_RANGE] {
            let is_noted = |channel: usize| {
                // They ascend, and there may be several of one channel.
                let own = &notes[notes.partition_point(|(noted, _)| *noted < channel)..];
                own.iter().take_while(|(noted, _)| *noted == channel).any(|(_, reading)| flag_of(*reading) == flag)
            };
            flag_fields_of(plan, is_noted, (frame, flag), percepts);
        }
    }
}

/// What a field is flagged with for a reading that is out of range or none.
fn flag_of(reading: Reading) -> Flags {
    match reading {
        Reading::Missing => Flags::INCOMPLETE,
        Reading::Faulty => Flags::FAULTY_INPUT,
        Reading::Value(..) => Flags::OUT_OF_RANGE,
    }
}

/// Flags every field that holds one of what `is_noted` in a frame, of the channels of the body.
fn flag_fields_of(
    plan: &Plan,
    is_noted: impl Fn(usize) -> bool,
    (frame, flag): (usize, Flags),
    percepts: &mut Percepts,
) {
    let fields = plan.fields.len();
    for (flags, field) in percepts.flags[frame * fields..][..fields].iter_mut().zip(plan.fields.iter()) {
        let is_pressed_one = |member: &Member| is_noted(plan.body_taxels[plan.channel_of(member.slot as usize)]);
        let is_sensed_one = |member: &SensedMember| {
            is_noted(member.taxel) || member.values.iter().any(|&value| is_noted(plan.senses.channels[value]))
        };
        if plan.members_of(field).iter().any(is_pressed_one) || field.sensed.iter().any(is_sensed_one) {
            *flags |= flag;
        }
    }
}

/// Flags the touched fields of `frames` whose places in the world are not known because joints are late, where poses are heeded.
pub(super) fn flag_stale_poses(plan: &Plan, links: &Links, frames: &[Frame], percepts: &mut Percepts) {
    for (index, frame) in frames.iter().enumerate().filter(|(_, frame)| links.posed && frame.has_stale_pose) {
        let cells = &mut percepts.flags[index * plan.fields.len()..];
        for (flags, field) in cells.iter_mut().zip(plan.fields.iter()) {
            let is_placed = match field.parts.is_empty() {
                true => links.world_from_anchor(field, index, frame).is_some() && !flags.contains(Flags::NO_POSE),
                false => !flags.contains(Flags::NO_POSE),
            };
            if !flags.contains(Flags::NO_CONTACT) && !is_placed {
                *flags |= Flags::STALE_POSE;
            }
        }
    }
}

impl Post<'_> {
    /// Says of frame `offset`, where time starts again with it, why a contact that was there before has no motion.
    pub(super) fn flag_restart(&self, raw: &RawBatch<'_>, offset: usize, percepts: &mut Percepts) {
        let Some(kept) = self.kept.filter(|_| offset == 0 && self.plan.stages().motion) else { return };
        let cells = &mut percepts.flags[raw.first * kept.len()..][..kept.len()];
        for (flags, _) in cells.iter_mut().zip(kept).filter(|(_, kept)| **kept) {
            if flags.contains(Flags::NO_PREVIOUS) && !flags.contains(Flags::NO_CONTACT) {
                *flags = (*flags - Flags::NO_PREVIOUS) | Flags::BAD_DT;
            }
        }
    }

    /// Puts the centroids of `frames`, which begin at frame `offset` of `raw`, on the skin, where that is wanted.
    pub(super) fn place(
        &self,
        frames: &[Frame],
        raw: &RawBatch<'_>,
        offset: usize,
        percepts: &mut Percepts,
        state: &mut PostState,
    ) {
        if self.plan.stages().position {
            let frames = self.frames(frames, raw, offset, &state.raw_before);
            place::all_frames(frames, percepts, &mut state.room.now);
        }
    }

    fn frames<'f>(
        &'f self,
        frames: &'f [Frame],
        raw: &'f RawBatch<'f>,
        offset: usize,
        before: &'f [RawValue],
    ) -> Frames<'f> {
        Frames { plan: self.plan, links: self.links, frames, raw, offset, before }
    }

    /// Completes frame `offset` of `raw`, which is `frame`, but for positions and normals.
    pub(super) fn frame(
        &self,
        offset: usize,
        frame: &Frame,
        raw: &RawBatch<'_>,
        percepts: &mut Percepts,
        state: &mut PostState,
    ) {
        let (stages, step, index) = (self.plan.stages(), &raw.steps[offset], raw.first + offset);
        percepts.t_s[index] = frame.t_s;
        let own = stages.force || stages.filter || stages.world_motion || stages.sigma || stages.senses;
        if !own && self.cadence.is_none() {
            return;
        }
        let alone = std::slice::from_ref(frame);
        state.room.forget();
        for (number, field) in self.plan.fields.iter().enumerate() {
            let cell = index * self.plan.fields.len() + number;
            if !field.sensed.is_empty() {
                let frames = self.frames(alone, raw, offset, &state.raw_before);
                let of = Cell { plan: self.plan, field, number, frames, frame: index, step, sensed: self.sensed };
                of.make(cell, percepts, &mut state.room, &mut state.fields[number].trend);
                continue;
            }
            if let Some(cadence) = self.cadence {
                match cadence.since(offset, number) {
                    Some(since) => cadence::rates(percepts, cell, step, since),
                    None => {
                        self.keep(number, index, state.last.as_ref(), percepts);
                        continue;
                    }
                }
            }
            if stages.force {
                self.force(field, (raw, offset), cell, percepts);
            }
            let contact = percepts.in_contact(index, number);
            let before = &mut state.fields[number];
            if !contact && !before.contact {
                // Most of a skin, most of the time.
                continue;
            }
            before.contact = contact;
            if stages.filter && field.charted {
                self.filter(field, step, cell, percepts, before);
            }
            if stages.world_motion {
                let own_frame = self.frames(alone, raw, offset, &state.raw_before);
                let now = &mut state.room.now;
                self.world_motion(field, (own_frame, now), step, cell, percepts, &mut before.world_motion);
            }
            if stages.sigma && contact {
                self.sigmas(field, raw, offset, cell, percepts);
            }
        }
    }

    /// Keeps what the next call may need of `raw` and of its percepts.
    pub(super) fn finish(&self, raw: &RawBatch<'_>, percepts: &mut Percepts, state: &mut PostState) {
        if let Some(last) = raw.frames.checked_sub(1).filter(|_| self.plan.has_spread_changes()) {
            state.raw_before.clear();
            state.raw_before.extend(raw.rows.row(last));
        }
        if self.cadence.is_some() && raw.frames > 0 {
            let last = state.last.get_or_insert_with(|| percepts.clone());
            last.take_frame(percepts, raw.first + raw.frames - 1);
        }
    }

    /// Keeps the percept of a field in frame `index` as it was in the frame before, which is in `last` where it was of
    /// another call.
    fn keep(&self, field: usize, index: usize, last: Option<&Percepts>, percepts: &mut Percepts) {
        let (of, from) = if index > 0 { (None, index - 1) } else { (last, 0) };
        percepts.keep(of, from, index, field);
    }

    /// Filters a cell's motion.
    fn filter(
        &self,
        field: &PlanField,
        step: &Step,
        cell: usize,
        percepts: &mut Percepts,
        memory: &mut PostFieldState,
    ) {
        if percepts.flags[cell].contains(Flags::NO_CONTACT) {
            memory.filter.release();
            memory.difference.release();
            return;
        }
        let clock = filter::Clock::new(step.dt_s, step.flags);
        let touched = motion::Centroid { place: centroid(percepts, cell).truncate(), pressed: percepts.active[cell] };
        let found = match field.filter.over_s {
            Some(over_s) => memory.difference.follow(&field.filter, over_s, clock, touched),
            None => memory.filter.follow(&field.filter, clock, touched),
        };
        percepts.flags[cell] |= found.flags;
        percepts.add_present(cell, found.present & self.plan.outputs);
        for (host, components) in found.outputs() {
            percepts.set_host(host, cell, &components[..host.column().components]);
        }
    }

    /// Finds how fast a cell's position moves in the world.
    fn world_motion(
        &self,
        field: &PlanField,
        (of, now): (Frames<'_>, &mut Now),
        step: &Step,
        cell: usize,
        percepts: &mut Percepts,
        memory: &mut world_motion::Memory,
    ) {
        if percepts.flags[cell].contains(Flags::NO_CONTACT) {
            memory.release();
            return;
        }
        let position_in_anchor = || place::on_skin(field, centroid(percepts, cell)).0;
        let position_in_world = if field.parts.is_empty() {
            let world = self.links.world_from_anchor(field, of.number_of(0), &of.frames[0]);
            world.map(|world| world.transform_point3(position_in_anchor()))
        } else if self.links.are_posed(&of.frames[0]) {
            of.position(field, 0, now).ok()
        } else {
            None
        };
        match memory.follow(step.dt_s, step.flags, position_in_world) {
            Ok(speed) => {
                percepts.add_present(cell, Outputs::SPEED_IN_WORLD);
                percepts.set_host(Host::SpeedInWorld, cell, &[speed]);
            }
            Err(why) => percepts.flags[cell] |= why,
        }
    }

    /// Adds up a cell's force. Where no member has a value there is none: nobody knows that nothing presses.
    fn force(&self, field: &PlanField, (raw, offset): (&RawBatch<'_>, usize), cell: usize, percepts: &mut Percepts) {
        // Of a change there is none.
        let is_change = self.plan.letters()[field.letter].receptor == Receptor::Change;
        let quantity = if is_change { Quantity::Count } else { field.quantity };
        let has_value = |member: &Member| {
            let (slot, channel) = (member.slot as usize, self.plan.channel_of(member.slot as usize));
            let (value, calibration) = (raw.rows.value(offset, channel), &self.plan.calibrations[channel]);
            calibrate::pressure(value, calibration, self.plan.curve_of(slot)).is_some()
        };
        let may_lack = percepts.flags[cell].intersects(Flags::INCOMPLETE | Flags::FAULTY_INPUT);
        if quantity != Quantity::Count && may_lack && !self.plan.members_of(field).iter().any(has_value) {
            return;
        }
        let pressures = &percepts.pressures[(raw.first + offset) * self.plan.slots()..][..self.plan.slots()];
        let pressure_and_area = |member: &Member| {
            let slot = member.slot as usize;
            (pressures[slot], self.plan.areas[self.plan.channel_of(slot)])
        };
        match force::reference(quantity, self.plan.members_of(field).iter().map(pressure_and_area)) {
            Some(newtons) => {
                percepts.add_present(cell, Outputs::FORCE);
                percepts.set_host(Host::Force, cell, &[newtons]);
            }
            None => percepts.flags[cell] |= Flags::NO_UNIT,
        }
    }

    /// Says how sure a cell's percept is.
    fn sigmas(&self, field: &PlanField, raw: &RawBatch<'_>, frame: usize, cell: usize, percepts: &mut Percepts) {
        let sigmas = sigma::of_field(self.plan, field, raw, frame);
        percepts.flags[cell] |= sigmas.flags;
        for (host, (output, components)) in sigmas.outputs() {
            let Some(components) = components else { continue };
            percepts.add_present(cell, output & self.plan.outputs);
            percepts.set_host(host, cell, &components[..host.column().components]);
        }
    }
}

/// A cell's centroid as the backend has it, m.
fn centroid(percepts: &Percepts, cell: usize) -> DVec3 {
    match &percepts.values {
        Values::F32(columns) => DVec3::from_array(columns.centroid(cell)),
        Values::F64(columns) => DVec3::from_array(columns.centroid(cell)),
    }
}
