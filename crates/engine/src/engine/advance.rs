//! Engine → backend → post-processing: how a call's frames go through.

use std::collections::HashMap;
use std::ops::Range;
use std::time::{Duration, Instant};

use super::Engine;
use super::cadence::step;
use super::check::Check;
use super::dominated::orient_again;
use super::input::{GoOn, Input};
use super::letters::SensedValues;
use super::post::{Post, flag_noted, flag_stale_poses};
use super::touch_check::TouchCheck;
use crate::backend::{Delivered, FieldState, Picks, RawBatch, Rows};
use crate::error::{Error, Result, nearest};
use crate::scene::{SensedTaxels, SensedValue};
use crate::signal::{Axis, Channel, Frame, RawValue, Reading};

/// Frames until `go_on` is asked first.
const FIRST_PART: usize = 256;
/// About how long the engine computes until it is asked again.
const PART: Duration = Duration::from_millis(100);

impl Engine {
    /// Puts into `to`, in place of what it holds, what `sensed` read in `frame`, which must be the last one: to look at, as
    /// [`Engine::pressures`].
    pub fn sensed(&self, frame: &Frame, sensed: &SensedTaxels, to: &mut Vec<SensedValue>) {
        to.clear();
        if !sensed.channels().is_empty() {
            to.extend(sensed.read(&self.plan, &self.raw_in(frame), self.values_sensed()));
        }
    }

    /// The same of any frame, as far as a single frame can tell.
    pub fn sensed_alone(&self, frame: &Frame, sensed: &SensedTaxels, to: &mut Vec<SensedValue>) {
        to.clear();
        if !sensed.channels().is_empty() {
            let value = |(at, &channel): (&Option<u32>, &usize)| {
                let value = at.and_then(|at| frame.values.get(at as usize));
                value.map_or(RawValue::MISSING, |&value| self.intake.read(channel, value))
            };
            let own: Vec<RawValue> = self.sensed_at.iter().zip(&self.plan.senses.channels).map(value).collect();
            to.extend(sensed.read(&self.plan, &self.raw_in(frame), &own));
        }
    }

    /// The values of `frame` by the plan's channels.
    fn raw_in(&self, frame: &Frame) -> Vec<RawValue> {
        let mut raw = vec![RawValue::MISSING; self.plan.channels()];
        for (place, &taxel) in self.intake.taxel_of_value().iter().enumerate().take(frame.values.len()) {
            if let Some(channel) = self.channel_of_taxel[taxel] {
                raw[channel as usize] = self.intake.read_alone(place, &frame.values);
            }
        }
        raw
    }

    /// What was wrong in the last frame with values that are corrected by others, or with these, by taxel of the body, ascending: as fields
    /// and touches are flagged for it.
    #[doc(hidden)]
    pub fn values_noted(&self) -> &[(usize, Reading)] {
        self.intake.notes().last().map_or(&[], Vec::as_slice)
    }

    /// The values that the last frame's other letters were made of, by
    /// [`SensedTaxels::channels`](crate::scene::SensedTaxels::channels); empty before the first frame.
    #[must_use]
    pub fn values_sensed(&self) -> &[RawValue] {
        &self.sensed[self.sensed.len().saturating_sub(self.plan.senses.channels.len())..]
    }

    /// All of `input`, epoch by epoch where there is drift compensation; with `check`, on the reference too. `false` if `go_on` said so.
    pub(super) fn advance(
        &mut self,
        input: Input<'_>,
        check: Option<&mut Check>,
        go_on: Option<GoOn<'_>>,
    ) -> Result<bool> {
        self.gather(input)?;
        let is_whole = self.advance_gathered(input, check, go_on);
        if !matches!(is_whole, Ok(true)) {
            // Of a call that stopped half way there is nothing to look at: some of its frames have percepts, others values alone.
            self.percepts.reset(0);
            self.raw.clear();
            self.sensed.clear();
        }
        is_whole
    }

    fn advance_gathered(
        &mut self,
        input: Input<'_>,
        mut check: Option<&mut Check>,
        mut go_on: Option<GoOn<'_>>,
    ) -> Result<bool> {
        let frames = input.frames;
        self.percepts.reset(frames.len());
        self.percepts.first_frame = self.frames_done;
        if let Some(check) = check.as_deref_mut() {
            check.reset(frames.len(), self.frames_done);
        }
        if self.tare && !frames.is_empty() {
            self.tare = false;
            self.take_as_baselines(input, check.as_deref_mut());
        }
        let mut start = 0;
        for index in 0..frames.len() {
            if self.drift.as_ref().is_some_and(|state| state.compensation.is_due(frames[index].t_s)) {
                if !self.segments(input, start..index, check.as_deref_mut(), &mut go_on)? {
                    return Ok(false);
                }
                self.close_epoch(check.as_deref_mut());
                start = index;
            }
            if let Some(state) = &mut self.drift {
                let channels = self.plan.channels();
                for taxel in self.intake.at_ends().get(index).into_iter().flatten() {
                    if let Ok(channel) = self.plan.body_taxels.binary_search(taxel) {
                        state.compensation.note_at_end(channel);
                    }
                }
                state.compensation.observe(frames[index].t_s, &self.raw[index * channels..][..channels]);
            }
        }
        if !self.segments(input, start..frames.len(), check.as_deref_mut(), &mut go_on)? {
            return Ok(false);
        }
        for percepts in [Some(&mut self.percepts), check.map(|check| &mut check.right)].into_iter().flatten() {
            flag_noted(&self.plan, &self.intake, percepts);
            flag_stale_poses(&self.plan, &self.links, frames, percepts);
        }
        self.frames_done += frames.len() as u64;
        Ok(true)
    }

    /// Checks `input`, and brings its values and times into the form that backends read.
    fn gather(&mut self, input: Input<'_>) -> Result<()> {
        let Input { frames, values } = input;
        self.links.forget();
        for (index, frame) in frames.iter().enumerate() {
            let at = |e: Error| e.at(format!("frame {}", self.frames_done + index as u64));
            let (got, want) = (values.row(index).len(), self.intake.width());
            if got != want {
                return Err(at(Error::failed(format!("it has {got} values for {want} channels; give one for each"))));
            }
            if let Err(name) = self.links.resolve(frame) {
                let near = nearest(name, self.links.index_of.keys().map(String::as_str));
                let hint = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
                return Err(at(Error::failed(format!("link `{name}` has a pose and is not in the body{hint}"))));
            }
            if let Some(why) = frame.pose.iter().find_map(|(name, pose)| pose.check(name).err()) {
                return Err(at(Error::failed(why)));
            }
        }
        self.raw.clear();
        self.sensed.clear();
        self.intake.forget_notes();
        for (index, frame) in frames.iter().enumerate() {
            let row = values.row(index);
            if self.picks.is_none() {
                self.intake.take(frame.t_s, row, &self.plan.body_taxels, &mut self.raw);
                self.intake.take_more(&self.plan.senses.channels, &mut self.sensed);
            } else {
                let value = |at: &Option<u32>| at.map_or(RawValue::MISSING, |at| row[at as usize]);
                self.sensed.extend(self.sensed_at.iter().map(value));
            }
        }
        self.steps.clear();
        for frame in frames {
            self.steps.push(step(self.last_time, frame.time(), self.max_gap_s));
            self.last_time = Some(frame.time());
        }
        Ok(())
    }

    /// Frames with the same calibration, in parts where `go_on` is to be asked between them: `false` if it said so.
    fn segments(
        &mut self,
        input: Input<'_>,
        range: Range<usize>,
        mut check: Option<&mut Check>,
        go_on: &mut Option<GoOn<'_>>,
    ) -> Result<bool> {
        let Some(go_on) = go_on else { return self.segment(input, range, check).map(|()| true) };
        let (mut start, mut size) = (range.start, FIRST_PART);
        while start < range.end {
            let end = range.end.min(start + size);
            let began = Instant::now();
            self.segment(input, start..end, check.as_deref_mut())?;
            start = end;
            if !go_on(start) {
                return Ok(false);
            }
            match began.elapsed() {
                took if took < PART / 4 => size *= 4,
                took if took > 2 * PART => size = (size / 2).max(1),
                _ => {}
            }
        }
        Ok(true)
    }

    /// Frames with the same calibration. Where thresholds keep a contact, it ends where time starts again.
    fn segment(&mut self, input: Input<'_>, range: Range<usize>, mut check: Option<&mut Check>) -> Result<()> {
        let (mut start, mut kept) = (range.start, None::<Vec<bool>>);
        if self.plan.stages().hysteresis {
            for index in range.clone() {
                if self.steps[index].restarts() {
                    self.run_without_restart(input, start..index, kept.as_deref(), check.as_deref_mut())?;
                    start = index;
                    kept = Some(self.end_contacts(check.as_deref_mut())?);
                }
            }
        }
        self.run_without_restart(input, start..range.end, kept.as_deref(), check)
    }

    /// Ends all contacts in the backend's state; which fields had one.
    fn end_contacts(&mut self, check: Option<&mut Check>) -> Result<Vec<bool>> {
        let mut state = self.backend.state()?;
        let kept = state.fields.iter().map(|field| field.contact).collect();
        state.fields.fill(FieldState::default());
        self.backend.restore(&state)?;
        if let Some(check) = check {
            (0..state.fields.len()).for_each(|field| check.reference.restore_field(field, FieldState::default()));
        }
        Ok(kept)
    }

    /// Takes frames that have the same calibration, and in which contacts go on, through the backend, then through post-processing.
    /// `kept` are the fields in contact before the first, if time starts again there.
    fn run_without_restart(
        &mut self,
        input: Input<'_>,
        range: Range<usize>,
        kept: Option<&[bool]>,
        mut check: Option<&mut Check>,
    ) -> Result<()> {
        if range.is_empty() {
            return Ok(());
        }
        let frames = input.frames;
        let channels = self.plan.channels();
        let raw = RawBatch {
            first: range.start,
            frames: range.len(),
            rows: rows(self.picks.as_ref(), &self.raw, input.values, channels).part(range.clone()),
            steps: &self.steps[range.clone()],
        };
        let frames = &frames[range.clone()];
        if let Some(cadence) = &mut self.cadence {
            cadence.look(&raw, frames);
        }
        self.backend.run(&raw, &mut self.percepts)?;
        let sensed = SensedValues { values: &self.sensed, width: self.plan.senses.channels.len() };
        let post = Post { plan: &self.plan, links: &self.links, cadence: self.cadence.as_ref(), kept, sensed };
        post.flag_restart(&raw, 0, &mut self.percepts);
        orient_again(&self.plan, &raw, &mut self.percepts, &mut self.pressed);
        let first_bound = check.as_ref().map_or(0, |check| check.bounds.len());
        post.place(frames, &raw, 0, &mut self.percepts, &mut self.post);
        for (offset, frame) in frames.iter().enumerate() {
            // As the backend left them: post-processing may put the last frame's percepts in their place.
            let left = check.is_some().then(|| FieldState::after(&self.plan, &self.percepts, raw.first + offset));
            post.frame(offset, frame, &raw, &mut self.percepts, &mut self.post);
            if let (Some(check), Some(left)) = (&mut check, left) {
                check.frame(&post, (offset, frame), &raw, &left, &self.post);
            }
        }
        post.finish(&raw, &mut self.percepts, &mut self.post);
        if let Some(on_skin) = &mut self.on_skin {
            let of_touches = check.as_deref_mut().and_then(|check| check.touches.as_mut());
            let about = (&self.plan, &self.links);
            let beside = (&self.intake, sensed);
            on_skin.find(about, frames, &raw, beside, &mut self.percepts, of_touches);
            if let Some(check) = &mut check {
                check.take_several(&raw, &self.percepts);
                check.touches.iter_mut().for_each(TouchCheck::end_of_run);
            }
        }
        if let Some(check) = &mut check {
            check.finish(&post, &raw, first_bound);
        }
        if let Some(drift) = &mut self.drift {
            let cells = range.start * self.plan.fields.len()..range.end * self.plan.fields.len();
            drift.note_contact(&self.percepts.flags[cells.clone()]);
            if let Some(first) = self.plan.touched_from {
                let slots = self.plan.slots();
                for index in range.clone() {
                    drift.note_pressed(&self.percepts.pressures[index * slots..][first..][..channels]);
                }
            }
            drift.flag_unknown_drift(&mut self.percepts.flags[cells.clone()]);
            check.into_iter().for_each(|check| drift.flag_unknown_drift(&mut check.right.flags[cells.clone()]));
        }
        Ok(())
    }

    /// Calibrates from now on with the first gathered frame as the baselines; where it has no number, the file's stays.
    fn take_as_baselines(&mut self, input: Input<'_>, check: Option<&mut Check>) {
        let made = self.plan.taxels.clone();
        let channels = self.plan.channels();
        let first = rows(self.picks.as_ref(), &self.raw, input.values, channels);
        for (channel, value) in first.row(0).enumerate() {
            if let Some(value) = value.number() {
                self.plan.keep_up(channel, value as f32, false, &made);
            }
        }
        self.take_as_tangential_baselines();
        if let Some(drift) = &mut self.drift {
            drift.restart(&self.plan);
        }
        self.recalibrate(check);
    }

    /// The same of tangential values: of taxels that have both.
    fn take_as_tangential_baselines(&mut self) {
        let Some(mut shear) = self.plan.senses.shear.take() else { return };
        let channels = &self.plan.senses.channels;
        let row = self.sensed.get(..channels.len()).unwrap_or_default();
        let number_of: HashMap<Channel, f64> = channels
            .iter()
            .zip(row)
            .filter_map(|(&channel, value)| Some((Channel(self.ids[channel]), value.number()?)))
            .collect();
        for (taxel, &id) in self.taxel_ids().iter().enumerate() {
            let along = |axis| number_of.get(&Channel::of_taxel(id, axis)).copied();
            if let (Some(u), Some(v)) = (along(Axis::U), along(Axis::V)) {
                shear.own_baselines.insert(taxel, [u, v]);
            }
        }
        self.plan.senses.shear = Some(shear);
        self.plan.calibration_changes += 1;
    }

    /// Ends an epoch of drift compensation, and calibrates from now on with its outcome.
    fn close_epoch(&mut self, check: Option<&mut Check>) {
        if self.drift.as_mut().is_some_and(|drift| drift.close(&mut self.plan)) {
            self.recalibrate(check);
        }
    }

    /// Calibrates from now on as the plan does.
    pub(super) fn recalibrate(&mut self, check: Option<&mut Check>) {
        self.backend.recalibrate(&self.plan);
        if let Some(cadence) = &mut self.cadence {
            cadence.forget();
        }
        if let Some(check) = check {
            check.reference.recalibrate(&self.plan);
        }
    }
}

/// Where frames' values lie: in `values` where `picks` says, or gathered in `raw`.
fn rows<'a>(picks: Option<&'a Picks>, raw: &'a [RawValue], values: Delivered<'a>, channels: usize) -> Rows<'a> {
    match picks {
        Some(picks) => Rows::Picked { frames: values, picks },
        None => Rows::Packed { values: raw, channels },
    }
}
