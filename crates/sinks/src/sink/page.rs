//! The sink that shows a run in browsers.

use std::sync::mpsc::Receiver;

use super::{Flow, InputFrames, News, Question, Session, Sink};
use crate::error::{Error, Result};
use crate::page::{EventKind, Listen, Mode, PageInfo, PageInput, PageScene, Publisher, Request, Server, ViewerId};
use crate::percept::Percepts;
use crate::plain;

/// Shows a run on a page.
#[derive(Debug)]
pub struct PageSink {
    // In this order: what is published last is sent before the server ends.
    publisher: Publisher,
    server: Server,
    /// Percepts that viewers ask to have explained, from the first call of `questions` on; before it the server refuses.
    questions: Option<Receiver<(ViewerId, Request)>>,
}

impl PageSink {
    /// Starts a server, and says its address on standard error.
    ///
    /// # Errors
    /// The address is taken; the session says neither body nor plan.
    pub fn start(listen: &Listen, session: &Session<'_>) -> Result<Self> {
        let (Some(body), Some(plan)) = (session.body, session.plan) else {
            return Err(Error::failed("a page shows a body and a plan; the session has none").at("sink `page`"));
        };
        let info = PageInfo {
            source: session.source,
            mode: Mode::Live,
            backend: session.backend,
            taxels: session.taxels,
            wiring: session.wiring,
            recorded_max: None,
            recorded_senses: Default::default(),
        };
        let (server, publisher) = Server::start(listen, PageScene::new(body, plan, &info))?;
        plain::announce(&server.announcement());
        Ok(Self { publisher, server, questions: None })
    }

    /// Its server.
    #[must_use]
    pub fn server(&self) -> &Server {
        &self.server
    }
}

impl Sink for PageSink {
    fn write_input(&mut self, input: &InputFrames<'_>) -> Result<Flow> {
        if let Some(frame) = input.frames.last() {
            self.publisher.read(&PageInput {
                frame,
                values_read: input.values_read,
                values_noted: input.values_noted,
                values_sensed: input.values_sensed,
                plan: input.plan,
                arrived: input.arrived,
                call_us: input.call.as_secs_f32() * 1e6 / input.frames.len() as f32,
                number: None,
            });
        }
        Ok(Flow::Open)
    }

    fn write(&mut self, percepts: &Percepts) -> Result<Flow> {
        self.publisher.publish(percepts);
        Ok(Flow::Open)
    }

    fn write_news(&mut self, news: &News) -> Result<Flow> {
        for (t_s, text) in &news.notices {
            self.publisher.event(EventKind::Board, *t_s, None, text.clone());
        }
        for (t_s, text) in &news.taxels {
            self.publisher.event(EventKind::Notice, *t_s, None, text.clone());
        }
        if let Some(boards) = &news.boards {
            self.publisher.boards(boards.clone());
        }
        self.publisher.flush();
        Ok(Flow::Open)
    }

    fn questions(&mut self) -> Vec<Question> {
        if self.questions.is_none() {
            self.questions = self.server.explanations();
        }
        let asked = self.questions.iter().flat_map(Receiver::try_iter);
        let question = |(viewer, request)| {
            let Request::Explain { field } = request else { return None };
            let replies = self.server.replies();
            Some(Question { field, answer: Box::new(move |message| replies.text(viewer, message)) })
        };
        asked.filter_map(question).collect()
    }

    fn flush(&mut self) -> Result<Flow> {
        self.publisher.try_flush();
        Ok(Flow::Open)
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        self.publisher.ended("The source has ended; this is its last frame.");
        Ok(())
    }
}
