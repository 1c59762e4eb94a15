//! What takes longer than a frame: why a percept is what it is, and the history of some outputs.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use somatic::page::{History, Replies, Request, Series, ViewerId};
use somatic::{Body, Engine, Options, Result};

use super::super::explanation::{explanation, no_explanation};
use super::checkpoints::Checkpoints;
use super::recording::{CHUNK, Recording};

/// A question of a viewer.
enum Question {
    Explain { field: usize, frame: usize },
    History(Request),
}

/// Answers on a thread of its own, with an engine of its own.
pub(super) struct Explainer(Sender<(ViewerId, Question)>);

impl Explainer {
    /// Starts the thread. It ends when the explainer is dropped.
    pub(super) fn start(
        body: &Arc<Body>,
        options: &Options,
        recording: &Arc<Recording>,
        checkpoints: &Arc<Checkpoints>,
        replies: &Replies,
    ) -> Self {
        let (sender, questions) = channel();
        let (body, options) = (Arc::clone(body), options.clone());
        let (recording, checkpoints) = (Arc::clone(recording), Arc::clone(checkpoints));
        let replies = replies.clone();
        std::thread::spawn(move || {
            let start = || Answering::new(&body, options.clone(), &recording, &checkpoints);
            answer(&questions, &replies, start);
        });
        Self(sender)
    }

    /// Asks why `field` is what it is in frame `frame`.
    pub(super) fn explain(&self, viewer: ViewerId, field: usize, frame: usize) {
        // The thread ends with this alone.
        let _ = self.0.send((viewer, Question::Explain { field, frame }));
    }

    /// Asks for a history.
    pub(super) fn history(&self, viewer: ViewerId, request: Request) {
        let _ = self.0.send((viewer, Question::History(request)));
    }
}

/// Answers `questions`; the engine is made with the first.
fn answer<'a>(
    questions: &Receiver<(ViewerId, Question)>,
    replies: &Replies,
    start: impl Fn() -> Result<Answering<'a>>,
) {
    let mut answering = None;
    while let Ok((viewer, question)) = questions.recv() {
        let started = match answering.take() {
            Some(started) => Ok(started),
            None => start(),
        };
        let field = if let Question::Explain { field, .. } = question { field } else { 0 };
        let outcome = started.and_then(|mut started| {
            match question {
                Question::Explain { field, frame } => replies.text(viewer, started.explain(field, frame)?),
                Question::History(Request::History { id, from_s, to_s, bins, series }) => {
                    let empty = History { id, from_s, to_s, bins, series: Vec::new() };
                    replies.binary(viewer, started.history(empty, &series)?.message());
                }
                Question::History(_) => {}
            }
            Ok(started)
        });
        match outcome {
            Ok(started) => answering = Some(started),
            Err(error) => {
                replies.text(viewer, no_explanation(field, &error.to_string()));
            }
        }
    }
}

/// An engine somewhere in the recording.
struct Answering<'a> {
    engine: Engine,
    /// By the body's taxels.
    ids: Vec<u32>,
    recording: &'a Recording,
    checkpoints: &'a Checkpoints,
    done: usize,
}

impl<'a> Answering<'a> {
    fn new(body: &Body, options: Options, recording: &'a Recording, checkpoints: &'a Checkpoints) -> Result<Self> {
        let mut engine = Engine::new(body, options)?;
        engine.set_channels(&recording.taxels)?;
        let ids = body.taxels.iter().map(|taxel| taxel.id).collect();
        Ok(Self { engine, ids, recording, checkpoints, done: 0 })
    }

    /// Brings the engine to before frame `frame`.
    fn go_to(&mut self, frame: usize) -> Result<()> {
        loop {
            self.done = self.checkpoints.advance(&mut self.engine, self.recording, self.done, frame)?;
            if self.done == frame {
                return Ok(());
            }
        }
    }

    /// The message that says how `field` came about in frame `frame`.
    fn explain(&mut self, field: usize, frame: usize) -> Result<String> {
        self.go_to(frame)?;
        let read = &self.recording.frames[frame..=frame];
        let explained = explanation(&mut self.engine, read, field, (&self.recording.taxels, &self.ids));
        self.done = frame + 1;
        explained
    }

    /// The least and most of each of `series` in each bin of `history`.
    fn history(&mut self, mut history: History, series: &[Series]) -> Result<History> {
        let History { from_s, to_s, bins, .. } = history;
        history.series = vec![[vec![f32::NAN; bins], vec![f32::NAN; bins]]; series.len()];
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
