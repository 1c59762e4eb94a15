//! Plays a recording: what viewers ask for, and the frames when they are due.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use serde_json::json;
use somatic::internal::page::{PageInput, Publisher, Request, ViewerId};
use somatic::{Engine, Result};

use super::super::stdio::say;
use super::answers::Explainer;
use super::clock::{Clock, State};
use super::recording::CHUNK;
use super::shared::Shared;
use super::timeline::Timeline;

/// The longest wait for a request, so that Ctrl-C is seen.
const MAX_WAIT: Duration = Duration::from_millis(50);
/// Times since the beginning of a recording are rounded by less, s.
const ROUNDING_S: f64 = 1e-6;
/// A call takes about so long at most, so that pictures follow each other also where frames take long.
const CALL_S: f64 = 0.05;
/// Requests that are answered before the next frame, and before a look at whether to end.
const REQUESTS_AT_ONCE: usize = 256;

/// A recording being played.
pub(super) struct Player {
    engine: Engine,
    shared: Shared,
    publisher: Publisher,
    explainer: Explainer,
    timeline: Arc<Timeline>,
    /// Frames that the engine has processed: the frame shown is the last of them.
    done: usize,
    /// The frame that is to be shown, if it takes more than a call.
    target: Option<usize>,
    clock: Clock,
    /// What the clock counted when it was last heeded: changes and jumps.
    heeded: [u64; 2],
    /// Smoothed time that a frame takes, s.
    frame_s: f64,
}

impl Player {
    pub(super) fn new(
        engine: Engine,
        shared: Shared,
        publisher: Publisher,
        explainer: Explainer,
        timeline: Arc<Timeline>,
        clock: Clock,
    ) -> Self {
        Self {
            engine,
            shared,
            publisher,
            explainer,
            timeline,
            done: 0,
            target: Some(0),
            clock,
            heeded: [0; 2],
            frame_s: 0.0,
        }
    }

    /// Plays and answers `requests` until `is_ended`.
    ///
    /// # Errors
    /// The device was lost.
    pub(super) fn run(mut self, requests: &Receiver<(ViewerId, Request)>, is_ended: impl Fn() -> bool) -> Result<()> {
        while !is_ended() {
            match requests.recv_timeout(self.wait()) {
                Ok((viewer, request)) => {
                    self.answer(viewer, request);
                    // A slider sends many: the last one counts.
                    for (viewer, request) in requests.try_iter().take(REQUESTS_AT_ONCE) {
                        self.answer(viewer, request);
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
            self.heed();
            match self.target {
                Some(index) => self.approach(index)?,
                None => self.play()?,
            }
        }
        Ok(())
    }

    /// How long nothing is to be done.
    fn wait(&self) -> Duration {
        if self.target.is_some() {
            return Duration::ZERO;
        }
        let state = self.clock.state();
        let next = self.shared.recording.frames.get(self.done).filter(|_| state.playing);
        next.map_or(MAX_WAIT, |frame| {
            let left_s = (frame.t_s - self.start_s() - state.now_s()) / state.speed;
            Duration::try_from_secs_f64(left_s).unwrap_or_default().min(MAX_WAIT)
        })
    }

    fn start_s(&self) -> f64 {
        self.shared.recording.span_s()[0]
    }

    fn answer(&mut self, viewer: ViewerId, request: Request) {
        match request {
            Request::Joined => {
                self.shared.replies.text(viewer, self.timeline.message(0));
                if !self.clock.joined() {
                    self.shared.replies.text(viewer, self.status());
                }
            }
            Request::Explain { field } => self.explainer.explain(viewer, field, self.shown()),
            Request::History { .. } | Request::Peaks { .. } => self.explainer.ask(viewer, request),
            // At the end of all it begins again.
            Request::Play if self.is_at_end() && self.clock.state().is_at_end() => {
                self.clock.play(0.0);
                self.go_to(0);
            }
            Request::Play => self.clock.play(self.at_s()),
            Request::Pause => self.heeded[1] = self.clock.pause(self.at_s()),
            Request::Seek { t_s } => self.go_to(self.shared.recording.index_at(t_s)),
            Request::Step { frames } => {
                let from = self.target.unwrap_or(self.shown());
                self.clock.pause(self.at_s());
                self.go_to(from.saturating_add_signed(frames as isize).min(self.last()));
            }
            Request::Show { frame } => {
                self.clock.pause(self.at_s());
                self.go_to(usize::try_from(frame).map_or(self.last(), |frame| frame.min(self.last())));
            }
            Request::Speed { speed } => self.clock.speed(speed, self.at_s()),
            _ => {}
        }
    }

    /// Heeds what was asked of the clock, here or by another player's viewers, and tells viewers.
    fn heed(&mut self) {
        let state = self.clock.state();
        let [changes, jumps] = self.heeded;
        if state.changes == changes {
            return;
        }
        if state.jumps != jumps {
            let index = self.shared.recording.index_at(self.start_s() + state.now_s() + ROUNDING_S);
            self.target = (self.target.is_some() || index != self.shown()).then_some(index);
        }
        self.heeded = [state.changes, state.jumps];
        if self.target.is_none() {
            self.clock.at_end(self.is_at_end(), state.jumps);
        }
        self.shared.replies.all(self.status());
    }

    /// Shows frame `index` next, and has other players show what they have of its time.
    fn go_to(&mut self, index: usize) {
        self.target = Some(index);
        self.heeded[1] = self.clock.seek(self.shared.recording.frames[index].t_s - self.start_s());
    }

    fn last(&self) -> usize {
        self.shared.recording.frames.len() - 1
    }

    /// The time that is shown, s: that of the clock, but for frames that are late.
    fn at_s(&self) -> f64 {
        let frames = &self.shared.recording.frames;
        let of = |index: usize| frames[index].t_s - self.start_s();
        if let Some(target) = self.target {
            return of(target);
        }
        let shown_s = of(self.shown());
        let next_s = if self.is_at_end() { f64::INFINITY } else { of(self.done) };
        self.clock.state().now_s().min(next_s).max(shown_s)
    }

    /// The frame that is shown.
    fn shown(&self) -> usize {
        self.done.saturating_sub(1)
    }

    fn is_at_end(&self) -> bool {
        self.done == self.shared.recording.frames.len()
    }

    fn status(&self) -> String {
        let at_end = self.is_at_end() && self.target.is_none();
        let State { playing, speed, .. } = self.clock.state();
        json!({"type": "status", "playing": playing, "speed": speed, "at_end": at_end}).to_string()
    }

    /// Comes nearer to frame `index`, and shows it once it is there.
    fn approach(&mut self, index: usize) -> Result<()> {
        let started = Instant::now();
        let Self { engine, shared, publisher, .. } = self;
        let way = (self.done, index);
        self.done = shared.checkpoints.advance(engine, &shared.recording, way, |percepts| publisher.pass(percepts))?;
        if self.done < index {
            return Ok(());
        }
        self.publisher.jump();
        self.engine.process(&self.shared.recording.frames[index..=index])?;
        self.done = index + 1;
        self.target = None;
        self.publish(1, started);
        self.clock.is_late(self.at_s());
        self.clock.at_end(self.is_at_end(), self.heeded[1]);
        self.shared.replies.all(self.status());
        Ok(())
    }

    /// Shows what is due.
    fn play(&mut self) -> Result<()> {
        let state = self.clock.state();
        if !state.playing {
            return Ok(());
        }
        let now_s = self.start_s() + state.now_s();
        let rest = &self.shared.recording.frames[self.done..];
        let most = frames_at_once(self.frame_s);
        let count = rest.iter().take(most).take_while(|frame| frame.t_s <= now_s).count();
        if count > 0 {
            let started = Instant::now();
            self.engine.process(&rest[..count])?;
            self.done += count;
            self.publish(count, started);
            self.frame_s += 0.3 * (started.elapsed().as_secs_f64() / count as f64 - self.frame_s);
        }
        // Frames take longer to compute than to play: slower, not ever later.
        let now_s = self.start_s() + self.clock.state().now_s();
        let next = self.shared.recording.frames.get(self.done);
        if next.is_some_and(|next| now_s - next.t_s > 2.0 * CALL_S * state.speed) {
            self.clock.is_late(self.at_s());
        }
        self.clock.at_end(self.is_at_end(), self.heeded[1]);
        Ok(())
    }

    /// Hands over the last of `count` frames that the engine has processed since `started`.
    fn publish(&mut self, count: usize, started: Instant) {
        if let Some(notice) = self.engine.notice() {
            say(&notice);
        }
        let frame = &self.shared.recording.frames[self.done - 1];
        let call_us = started.elapsed().as_secs_f32() * 1e6 / count as f32;
        self.publisher.read(&PageInput {
            frame,
            values_read: self.engine.values_read(),
            values_noted: self.engine.values_noted(),
            values_sensed: self.engine.values_sensed(),
            plan: self.engine.plan(),
            arrived: Some(started),
            call_us,
            number: None,
        });
        self.publisher.publish(self.engine.percepts());
        self.publisher.flush();
    }
}

/// How many frames a call may have that take `frame_s` each.
fn frames_at_once(frame_s: f64) -> usize {
    ((CALL_S / frame_s.max(1e-9)) as usize).clamp(1, CHUNK)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_call_has_as_many_frames_as_its_time_allows() {
        assert_eq!(frames_at_once(0.0), CHUNK, "before anything is known");
        assert_eq!(frames_at_once(1e-6), CHUNK);
        assert_eq!(frames_at_once(0.004), 12);
        assert_eq!(frames_at_once(0.03), 1);
        assert_eq!(frames_at_once(10.0), 1, "at least one, or it would never go on");
    }
}
