//! What a person at a terminal sees of a run: remarks, a table, messages of boards.

use std::time::Instant;

#[cfg(feature = "page")]
use somatic::EngineState;
use somatic::internal::sink::News;
#[cfg(feature = "page")]
use somatic::internal::sink::Question;
use somatic::run::{Ending, FrameInfo, Observer, Remark};
use somatic::{Engine, Frame, Plan, Result};

use super::order::OrderReport;
use crate::cli::doubts::Doubts;
#[cfg(feature = "page")]
use crate::cli::explanation::LiveExplainer;
use crate::cli::lines::LineReport;
use crate::cli::live::View;
use crate::cli::stdio::say;

/// Who watches a run at a terminal.
pub(super) struct Console {
    pub(super) view: View,
    /// The serial lines or limbs, if they are read.
    pub(super) live: Option<LineReport>,
    /// What is looked for in the first frames.
    pub(super) doubts: Option<Doubts>,
    /// What is pressed, where that is asked for.
    pub(super) order: Option<OrderReport>,
    /// With a page.
    #[cfg(feature = "page")]
    pub(super) explainer: Option<LiveExplainer>,
}

impl Observer for Console {
    fn is_watching(&self) -> bool {
        self.view.is_table()
    }

    fn remark(&mut self, kind: Remark, text: &str) {
        if kind == Remark::Warning || !self.view.is_table() {
            say(text);
        }
    }

    #[cfg(feature = "page")]
    fn asked(&mut self, questions: Vec<Question>, state: EngineState, frames: &[Frame]) {
        if let Some(explainer) = &self.explainer {
            explainer.explain(questions, state, frames);
        }
    }

    fn computed(&mut self, engine: &Engine, frames: &[Frame], info: &FrameInfo) {
        let has_seen_enough = self.doubts.as_mut().is_some_and(|doubts| doubts.see(frames));
        if has_seen_enough && !self.view.is_table() {
            self.tell_doubts(engine.plan());
        }
        self.view.see(engine.percepts(), info.progress);
        if let Some(Err(error)) = self.order.as_mut().map(|order| order.see(engine, frames)) {
            self.order = None;
            say(&error.to_string());
        }
    }

    fn began(&mut self, name: &str, engine: &Engine, taxels: &[u32]) {
        let is_table = self.view.is_table();
        let Some(doubts) = &mut self.doubts else { return };
        let told = doubts.restart(name, taxels, engine.plan());
        // Under a table they wait for its end.
        if is_table { doubts.hold(told) } else { told.iter().for_each(|doubt| say(doubt)) }
    }

    fn written(&mut self, read_at: &[Instant]) {
        if let Some(live) = &mut self.live {
            live.see(read_at);
        }
    }

    fn percepts_of_limbs(&mut self) -> Option<(Vec<String>, Vec<Instant>)> {
        self.live.as_ref()?.percepts()
    }

    fn news(&mut self) -> Option<News> {
        let live = self.live.as_mut()?;
        live.tell(self.view.is_table());
        self.view.set_footer(|| live.rows());
        live.news()
    }

    fn turned(&mut self) {
        self.view.draw();
    }
}

impl Console {
    /// Says, the first time, what is doubtful in the frames so far.
    fn tell_doubts(&mut self, plan: &Plan) {
        self.doubts.iter_mut().flat_map(|doubts| doubts.told(plan)).for_each(|doubt| say(&doubt));
    }

    /// Removes the table, and closes the lines, whose losses are those of the run. The doubts are not reported yet.
    ///
    /// # Errors
    /// No board was heard.
    pub(super) fn close(self, ending: &mut Ending) -> Result<Option<Doubts>> {
        self.view.finish();
        self.order.map_or(Ok(()), OrderReport::finish)?;
        if let Some(live) = self.live {
            ending.losses = live.finish()?;
        }
        Ok(self.doubts)
    }

    /// After an error: prints the messages about the lines, which say why.
    pub(super) fn leave(self) {
        let Self { view, live, .. } = self;
        drop(view);
        live.into_iter().for_each(|mut live| live.tell(false));
    }
}
