//! Engine → backend → post-processing: how a call's frames go through.

use std::ops::Range;

use super::Engine;
use super::cadence::step;
use super::check::Check;
use super::post::{Post, flag_stale};
use crate::backend::{FieldState, Picks, RawBatch, Rows};
use crate::error::{Error, Result, nearest};
use crate::signal::{Frame, RawValue};

impl Engine {
    /// All of `frames`, epoch by epoch where there is upkeep; with `check`, on the reference too.
    pub(super) fn advance(&mut self, frames: &[Frame], mut check: Option<&mut Check>) -> Result<()> {
        self.gather(frames)?;
        self.percepts.reset(frames.len());
        self.percepts.first_frame = self.frames_done;
        if let Some(check) = check.as_deref_mut() {
            check.reset(frames.len(), self.frames_done);
        }
        if self.tare && !frames.is_empty() {
            self.tare = false;
            self.take_as_baselines(&frames[0], check.as_deref_mut());
        }
        let mut start = 0;
        for index in 0..frames.len() {
            if self.upkeep.as_ref().is_some_and(|state| state.upkeep.is_due(frames[index].t_s)) {
                self.segment(frames, start..index, check.as_deref_mut())?;
                self.close_epoch(check.as_deref_mut());
                start = index;
            }
            if let Some(state) = &mut self.upkeep {
                let channels = self.plan.channels();
                state.upkeep.observe(frames[index].t_s, &self.raw[index * channels..][..channels]);
            }
        }
        self.segment(frames, start..frames.len(), check.as_deref_mut())?;
        for percepts in [Some(&mut self.percepts), check.map(|check| &mut check.right)].into_iter().flatten() {
            flag_stale(&self.plan, self.intake.stale(), percepts);
        }
        self.frames_done += frames.len() as u64;
        Ok(())
    }

    /// Checks `frames`, and brings their values and times into the form that backends read.
    fn gather(&mut self, frames: &[Frame]) -> Result<()> {
        for (index, frame) in frames.iter().enumerate() {
            let at = |e: Error| e.at(format!("frame {}", self.frames_done + index as u64));
            if frame.values.len() != self.intake.width() {
                let (got, want) = (frame.values.len(), self.intake.width());
                return Err(at(Error::failed(format!("it has {got} values, and {want} are expected"))));
            }
            if let Some((name, _)) = frame.pose.iter().find(|(name, _)| !self.links.index_of.contains_key(name)) {
                let near = nearest(name, self.links.index_of.keys().map(String::as_str));
                let hint = near.map_or(String::new(), |near| format!("; did you mean `{near}`?"));
                return Err(at(Error::failed(format!("it poses link `{name}`, which the body does not have{hint}"))));
            }
        }
        self.raw.clear();
        self.intake.forget_stale();
        if self.picks.is_none() {
            for frame in frames {
                self.intake.take(frame, &self.plan.body_taxels, &mut self.raw);
            }
        }
        self.steps.clear();
        for frame in frames {
            self.steps.push(step(self.last_t_s, frame.t_s, self.max_gap_s));
            self.last_t_s = Some(frame.t_s);
        }
        Ok(())
    }

    /// Frames with the same calibration: through the backend, then through post-processing.
    fn segment(&mut self, frames: &[Frame], range: Range<usize>, mut check: Option<&mut Check>) -> Result<()> {
        if range.is_empty() {
            return Ok(());
        }
        let channels = self.plan.channels();
        let raw = RawBatch {
            first: range.start,
            frames: range.len(),
            rows: rows(self.picks.as_ref(), &self.raw, frames, channels).part(range.clone()),
            steps: &self.steps[range.clone()],
        };
        let frames = &frames[range.clone()];
        if let Some(cadence) = &mut self.cadence {
            cadence.look(&raw, frames);
        }
        self.backend.run(&raw, &mut self.percepts)?;
        let post = Post { plan: &self.plan, links: &self.links, cadence: self.cadence.as_ref() };
        let first_bound = check.as_ref().map_or(0, |check| check.bounds.len());
        post.place(frames, raw.first, &mut self.percepts);
        for (offset, frame) in frames.iter().enumerate() {
            // As the backend left them: post-processing may put the last frame's percepts in their place.
            let left = check.is_some().then(|| FieldState::after(&self.plan, &self.percepts, raw.first + offset));
            post.frame(offset, frame, &raw, &mut self.percepts, &mut self.post);
            if let (Some(check), Some(left)) = (&mut check, left) {
                check.frame(&post, (offset, frame), &raw, &left, &self.post);
            }
        }
        post.finish(&raw, &mut self.percepts, &mut self.post);
        if let Some(check) = &mut check {
            check.finish(&post, &raw, first_bound);
        }
        if let Some(upkeep) = &mut self.upkeep {
            let cells = range.start * self.plan.fields.len()..range.end * self.plan.fields.len();
            upkeep.note_contact(&self.percepts.flags[cells.clone()]);
            upkeep.flag_unknown_drift(&mut self.percepts.flags[cells.clone()]);
            check.into_iter().for_each(|check| upkeep.flag_unknown_drift(&mut check.right.flags[cells.clone()]));
        }
        Ok(())
    }

    /// Calibrates from now on with the first gathered frame as the baselines; where it has no number, the file's stays.
    fn take_as_baselines(&mut self, first: &Frame, check: Option<&mut Check>) {
        let made = self.plan.taxels.clone();
        let channels = self.plan.channels();
        let first = rows(self.picks.as_ref(), &self.raw, std::slice::from_ref(first), channels);
        for (channel, value) in first.row(0).enumerate() {
            if let Some(value) = value.number() {
                self.plan.keep_up(channel, value as f32, false, &made);
            }
        }
        if let Some(upkeep) = &mut self.upkeep {
            upkeep.restart(&self.plan);
        }
        self.recalibrate(check);
    }

    /// Ends an epoch of upkeep, and calibrates from now on with its outcome.
    fn close_epoch(&mut self, check: Option<&mut Check>) {
        if self.upkeep.as_mut().is_some_and(|upkeep| upkeep.close(&mut self.plan)) {
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

/// Where the values of `frames` lie: where `picks` says, or gathered in `raw`.
fn rows<'a>(picks: Option<&'a Picks>, raw: &'a [RawValue], frames: &'a [Frame], channels: usize) -> Rows<'a> {
    match picks {
        Some(picks) => Rows::Picked { frames, picks },
        None => Rows::Packed { values: raw, channels },
    }
}
