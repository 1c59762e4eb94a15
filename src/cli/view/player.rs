//! Plays a recording: what viewers ask for, and the frames when they are due.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use serde_json::json;
use somatic::internal::page::{PageInput, Publisher, Request, ViewerId};
use somatic::{Engine, Result};

use super::super::stdio::say;
use super::explain::Explainer;
use super::recording::CHUNK;
use super::shared::Shared;
use super::timeline::Timeline;

/// The longest wait for a request, so that Ctrl-C is seen.
const MAX_WAIT: Duration = Duration::from_millis(50);
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
    playing: bool,
    /// Whether it begins to play with the first viewer.
    waits: bool,
    /// Whether it begins again at its end.
    loops: bool,
    speed: f64,
    /// A moment, and the recorded time that is due then, s.
    due: (Instant, f64),
}

impl Player {
    pub(super) fn new(
        engine: Engine,
        shared: Shared,
        publisher: Publisher,
        explainer: Explainer,
        timeline: Arc<Timeline>,
    ) -> Self {
        let due = (Instant::now(), shared.recording.span_s()[0]);
        Self {
            engine,
            shared,
            publisher,
            explainer,
            timeline,
            done: 0,
            target: Some(0),
            playing: false,
            waits: true,
            loops: false,
            speed: 1.0,
            due,
        }
    }

    /// At `speed` times the recorded speed.
    pub(super) fn speed(mut self, speed: f64) -> Self {
        self.speed = speed;
        self
    }

    /// Begins again at its end if `loops`.
    pub(super) fn loops(mut self, loops: bool) -> Self {
        self.loops = loops;
        self
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
        let next = self.shared.recording.frames.get(self.done).filter(|_| self.playing);
        next.map_or(MAX_WAIT, |frame| {
            let (since, due_s) = self.due;
            let left = Duration::try_from_secs_f64((frame.t_s - due_s) / self.speed).unwrap_or_default();
            left.saturating_sub(since.elapsed()).min(MAX_WAIT)
        })
    }

    fn answer(&mut self, viewer: ViewerId, request: Request) {
        match request {
            Request::Joined => {
                self.shared.replies.text(viewer, self.timeline.message(0));
                if !std::mem::take(&mut self.waits) {
                    self.shared.replies.text(viewer, self.status());
                    return;
                }
                self.playing = true;
            }
            Request::Explain { field } => return self.explainer.explain(viewer, field, self.shown()),
            Request::History { .. } | Request::Peaks { .. } => return self.explainer.ask(viewer, request),
            Request::Play => {
                if self.is_at_end() {
                    self.target = Some(0);
                }
                self.playing = true;
            }
            Request::Pause => self.playing = false,
            Request::Seek { t_s } => self.target = Some(self.shared.recording.index_at(t_s)),
            Request::Step { frames } => {
                self.playing = false;
                let last = self.shared.recording.frames.len() - 1;
                let from = self.target.unwrap_or(self.shown());
                self.target = Some(from.saturating_add_signed(frames as isize).min(last));
            }
            Request::Show { frame } => {
                self.playing = false;
                let last = self.shared.recording.frames.len() - 1;
                self.target = Some(usize::try_from(frame).map_or(last, |frame| frame.min(last)));
            }
            Request::Speed { speed } => self.speed = speed,
            _ => return,
        }
        self.restart_clock();
        self.shared.replies.all(self.status());
    }

    /// The frame that is shown.
    fn shown(&self) -> usize {
        self.done.saturating_sub(1)
    }

    fn is_at_end(&self) -> bool {
        self.done == self.shared.recording.frames.len()
    }

    /// Recorded time goes on from the frame that is shown.
    fn restart_clock(&mut self) {
        self.due = (Instant::now(), self.shared.recording.frames[self.target.unwrap_or(self.shown())].t_s);
    }

    fn status(&self) -> String {
        let at_end = self.is_at_end() && self.target.is_none();
        json!({"type": "status", "playing": self.playing, "speed": self.speed, "at_end": at_end}).to_string()
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
        self.restart_clock();
        self.shared.replies.all(self.status());
        Ok(())
    }

    /// Shows what is due.
    fn play(&mut self) -> Result<()> {
        if !self.playing {
            return Ok(());
        }
        let (since, due_s) = self.due;
        let now_s = due_s + since.elapsed().as_secs_f64() * self.speed;
        let rest = &self.shared.recording.frames[self.done..];
        let count = rest.iter().take(CHUNK).take_while(|frame| frame.t_s <= now_s).count();
        if count > 0 {
            let started = Instant::now();
            self.engine.process(&rest[..count])?;
            self.done += count;
            self.publish(count, started);
        }
        if count == CHUNK {
            // So fast that frames are late: slower, not ever later.
            self.restart_clock();
        }
        if self.is_at_end() {
            if self.loops {
                self.target = Some(0);
            } else {
                self.playing = false;
            }
            self.shared.replies.all(self.status());
        }
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
            values_read: None,
            plan: self.engine.plan(),
            arrived: Some(started),
            call_us,
            number: None,
        });
        self.publisher.publish(self.engine.percepts());
        self.publisher.flush();
    }
}
