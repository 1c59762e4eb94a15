//! What takes longer than a frame: why a percept is what it is, the history of some outputs, and the highest pressures of a part.

use std::sync::mpsc::{Receiver, Sender, channel};

use somatic::internal::page::{History, PeakMap, Request, Series, ViewerId};
use somatic::{Engine, Error, Result};

use super::super::explanation::{explanation, no_explanation};
use super::checkpoints::Checkpoints;
use super::peaks::Peaks;
use super::recorded::Differences;
use super::recording::{CHUNK, Recording};
use super::shared::Shared;

/// A question of a viewer.
enum Question {
    Explain { field: usize, frame: usize },
    Other(Request),
}

/// Answers on a thread of its own, with an engine of its own.
pub(super) struct Explainer(Sender<(ViewerId, Question)>);

impl Explainer {
    /// Starts the thread. It ends when the explainer is dropped.
    pub(super) fn start(shared: Shared) -> Self {
        let (sender, questions) = channel();
        std::thread::spawn(move || answer(&questions, &shared));
        Self(sender)
    }

    /// Asks why `field` is what it is in frame `frame`.
    pub(super) fn explain(&self, viewer: ViewerId, field: usize, frame: usize) {
        // The thread ends with this alone.
        let _ = self.0.send((viewer, Question::Explain { field, frame }));
    }

    /// Asks for a history or highest pressures.
    pub(super) fn ask(&self, viewer: ViewerId, request: Request) {
        let _ = self.0.send((viewer, Question::Other(request)));
    }
}

/// Answers `questions`; the engine is made with the first, and again after an error.
fn answer(questions: &Receiver<(ViewerId, Question)>, shared: &Shared) {
    let mut answering: Option<Answering<'_>> = None;
    while let Ok((viewer, question)) = questions.recv() {
        let mut started = answering.take().map_or_else(|| Answering::new(shared), Ok);
        match question {
            Question::Explain { field, frame } => {
                let explained = with(&mut started, |answering| answering.explain(field, frame));
                let failed = |e: Error| no_explanation(field, &e.to_string());
                shared.replies.text(viewer, explained.unwrap_or_else(failed));
            }
            Question::Other(Request::History { id, from_s, to_s, bins, series }) => {
                let nothing = vec![[vec![f32::NAN; bins], vec![f32::NAN; bins]]; series.len()];
                let empty = History { id, from_s, to_s, bins, series: nothing };
                let history = with(&mut started, |answering| answering.history(empty.clone(), &series));
                shared.replies.binary(viewer, history.unwrap_or(empty).message());
            }
            Question::Other(Request::Peaks { id, from_s, to_s }) => {
                let peaks = with(&mut started, |answering| answering.peaks(from_s, to_s));
                let nothing = |_| vec![f32::NAN; shared.body.taxels.len()];
                let map = PeakMap { id, from_s, to_s, peaks: peaks.unwrap_or_else(nothing) };
                shared.replies.binary(viewer, map.message());
            }
            Question::Other(_) => {}
        }
        answering = started.ok();
    }
}

/// Does something with the engine, which is given up where that fails.
fn with<'a, T>(
    started: &mut Result<Answering<'a>>,
    something: impl FnOnce(&mut Answering<'a>) -> Result<T>,
) -> Result<T> {
    let done = started.as_mut().map_err(|e| e.clone()).and_then(something);
    if let Err(error) = &done {
        *started = Err(error.clone());
    }
    done
}

/// An engine somewhere in the recording.
struct Answering<'a> {
    engine: Engine,
    /// By the body's taxels.
    ids: Vec<u32>,
    recording: &'a Recording,
    differences: &'a Differences,
    checkpoints: &'a Checkpoints,
    peaks: &'a Peaks,
    done: usize,
}

impl<'a> Answering<'a> {
    fn new(shared: &'a Shared) -> Result<Self> {
        let ids = shared.body.taxels.iter().map(|taxel| taxel.id).collect();
        let Shared { recording, checkpoints, differences, peaks, .. } = shared;
        Ok(Self { engine: shared.engine()?, ids, recording, differences, checkpoints, peaks, done: 0 })
    }

    /// Brings the engine to before frame `frame`.
    fn go_to(&mut self, frame: usize) -> Result<()> {
        loop {
            self.done = self.checkpoints.advance(&mut self.engine, self.recording, (self.done, frame), |_| {})?;
            if self.done == frame {
                return Ok(());
            }
        }
    }

    /// The message that says how `field` came about in frame `frame`.
    fn explain(&mut self, field: usize, frame: usize) -> Result<String> {
        self.go_to(frame)?;
        let read = &self.recording.frames[frame..=frame];
        let recorded = self.differences.in_field(frame, field);
        let recorded: Vec<_> = recorded.into_iter().map(|other| (other.column, other.recorded)).collect();
        let explained = explanation(&mut self.engine, read, field, (&self.recording.taxels, &self.ids), &recorded);
        self.done = frame + 1;
        explained
    }

    /// By the body's taxels, the highest pressure in the frames that are shown from `from_s` to `to_s`.
    fn peaks(&mut self, from_s: f64, to_s: f64) -> Result<Vec<f32>> {
        let mut most = vec![f32::NAN; self.ids.len()];
        let shown = self.recording.index_at(from_s)..self.recording.index_at(to_s) + 1;
        let known = self.peaks.of_whole_parts(shown.clone(), &mut most);
        for rest in [shown.start..known.start, known.end..shown.end] {
            if rest.is_empty() {
                continue;
            }
            self.go_to(rest.start)?;
            while self.done < rest.end {
                let next = rest.end.min(self.done + CHUNK);
                let frames = &self.recording.frames[self.done..next];
                self.engine.process(frames)?;
                self.peaks.add(&self.engine, frames, &mut most);
                self.done = next;
            }
        }
        Ok(most)
    }

    /// `history`, in which nothing is known yet, with the least and most of each of `series` in each bin.
    fn history(&mut self, mut history: History, series: &[Series]) -> Result<History> {
        let History { from_s, to_s, bins, .. } = history;
        let first = self.recording.index_at(from_s);
        let end = self.recording.index_at(to_s) + 1;
        self.go_to(first)?;
        while self.done < end {
            let next = end.min(self.done + CHUNK);
            let frames = &self.recording.frames[self.done..next];
            let percepts = self.engine.process(frames)?;
            for (frame, _) in frames.iter().enumerate().filter(|(_, of)| (from_s..=to_s).contains(&of.t_s)) {
                let shown = self.recording.bins(self.done + frame, from_s, (to_s - from_s) / bins as f64, bins);
                for (series, [least, most]) in series.iter().zip(&mut history.series) {
                    let value = series.value(percepts, frame);
                    least[shown.clone()].iter_mut().for_each(|least| *least = least.min(value));
                    most[shown.clone()].iter_mut().for_each(|most| *most = most.max(value));
                }
            }
            self.done = next;
        }
        Ok(history)
    }
}
