//! `Engine.view`: the page that shows in a browser what an engine computes.

use std::process;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use pyo3::prelude::*;
use somatic::internal::page::{Mode, PageInfo, PageInput, PageScene, Publisher};
use somatic::internal::signal::FrameBlock;
use somatic::page::{Listen, Server};
use somatic::{Body, Engine, Frame};

/// A page that is served.
struct Open {
    // In this order: what is published last is sent before the server ends.
    publisher: Publisher,
    server: Server,
}

/// A page, until it is closed.
pub(crate) struct Page {
    open: Mutex<Option<Open>>,
    /// The process whose threads serve it; a fork has none of them.
    process: u32,
}

impl Page {
    /// Serves a page of `engine`, which has `body` and frames with the values of `channels`.
    pub(crate) fn start(listen: &Listen, engine: &Engine, body: &Body, channels: &[u32]) -> somatic::Result<Self> {
        let chosen = engine.backend();
        let info = PageInfo {
            source: "Python",
            mode: Mode::Live,
            backend: [chosen.name, &chosen.device, chosen.reason],
            taxels: channels,
            wiring: None,
            recorded_max: None,
            recorded_senses: Default::default(),
        };
        let (server, publisher) = Server::start(listen, PageScene::new(body, engine.plan(), &info))?;
        Ok(Self { open: Mutex::new(Some(Open { publisher, server })), process: process::id() })
    }

    fn lock(&self) -> MutexGuard<'_, Option<Open>> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_served(&self) -> bool {
        self.process == process::id()
    }

    pub(crate) fn is_open(&self) -> bool {
        self.is_served() && self.lock().is_some()
    }

    /// Shows the last frame of `block`, which `engine` has just computed in a call that began at `began`.
    pub(crate) fn show(&self, engine: &Engine, block: &FrameBlock<'_>, began: Instant) {
        if !self.is_served() {
            return;
        }
        let mut open = self.lock();
        let (Some(Open { publisher, .. }), Some(&t_s)) = (open.as_mut(), block.t_s.last()) else { return };
        let frames = block.t_s.len();
        let width = block.values.len() / frames;
        let last = |(link, poses): &(String, Vec<somatic::Pose>)| Some((link.clone(), *poses.last()?));
        let frame = Frame {
            t_s,
            values: block.values[block.values.len() - width..].to_vec(),
            pose: block.poses.iter().filter_map(last).collect(),
            ..Frame::default()
        };
        publisher.read(&PageInput {
            frame: &frame,
            values_read: engine.values_read(),
            values_noted: engine.values_noted(),
            values_sensed: engine.values_sensed(),
            plan: engine.plan(),
            arrived: Some(began),
            call_us: began.elapsed().as_secs_f32() * 1e6 / frames as f32,
            number: None,
        });
        publisher.publish(engine.percepts());
        publisher.try_flush();
    }

    fn close(&self) {
        if !self.is_served() {
            // To end it is to wait for a thread that is not there.
            std::mem::forget(self.lock().take());
        } else if let Some(mut open) = self.lock().take() {
            open.publisher.ended("The view was closed; this is its last frame.");
        }
    }
}

/// A page in a browser that shows what an engine computes, from `Engine.view`; it is served until it is closed.
///
/// Use it in a `with` block, or call `close`.
#[pyclass(module = "somatic_touch", name = "View", frozen)]
pub(crate) struct PyView {
    page: Arc<Page>,
    url: String,
}

impl PyView {
    pub(crate) fn new(page: Arc<Page>) -> Self {
        let url = page.lock().as_ref().map_or(String::new(), |open| open.server.url());
        Self { page, url }
    }
}

#[pymethods]
impl PyView {
    /// The page's address, with the token that lets a browser in: whoever has it may look.
    #[getter]
    fn url(&self) -> &str {
        &self.url
    }

    /// How many browsers show it.
    #[getter]
    fn viewers(&self) -> usize {
        self.page.lock().as_ref().map_or(0, |open| open.publisher.viewers())
    }

    /// Ends the page; browsers keep its last frame.
    fn close(&self, py: Python<'_>) {
        py.detach(|| self.page.close());
    }

    fn __enter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __exit__(
        &self,
        py: Python<'_>,
        _kind: &Bound<'_, PyAny>,
        _raised: &Bound<'_, PyAny>,
        _traceback: &Bound<'_, PyAny>,
    ) {
        self.close(py);
    }

    fn __repr__(&self) -> String {
        match self.page.is_open() {
            true => format!("<View at {}>", self.url),
            false => "<View, closed>".to_owned(),
        }
    }
}

impl Drop for PyView {
    fn drop(&mut self) {
        self.page.close();
    }
}
