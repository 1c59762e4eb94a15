//! What an engine is made of, and how.

use std::sync::{Arc, Mutex};

use pyo3::prelude::*;
use somatic::{BackendKind, Engine, Error};

use super::PyEngine;
use super::inner::Inner;
use crate::body::PyBody;
use crate::calibration::PyCalibration;
use crate::channels::Channels;
use crate::error::OrRaise;
use crate::scene::PyScene;
use crate::session::Run;
use crate::threads::free;

/// What an engine was made of.
#[derive(Clone)]
pub(super) struct Wish {
    pub(super) body: PyBody,
    pub(super) scene: String,
    pub(super) calibration: Option<PyCalibration>,
    pub(super) backend: Option<String>,
    pub(super) taxels: Option<Vec<u32>>,
    pub(super) batch: usize,
}

impl Wish {
    /// An engine of it.
    pub(super) fn make(self, py: Python<'_>) -> PyResult<PyEngine> {
        let scene = PyScene::of_text(py, &self.scene)?;
        let Self { body, calibration, backend, taxels, batch, .. } = &self;
        let backend = backend.as_deref().map(str::parse::<BackendKind>).transpose().or_raise(py)?;
        let made = free(py, || {
            let options = scene.options(calibration.as_ref().map(|calibration| &calibration.inner), backend, *batch)?;
            let mut engine = Engine::new(&body.inner, options)?;
            if let Some(taxels) = taxels {
                engine.set_channels(taxels).map_err(|e| e.at("taxels"))?;
            }
            Ok::<_, Error>(engine)
        });
        let engine = made.or_raise(py)?;
        let text = calibration.as_ref().map(|calibration| calibration.text.as_str());
        let run = Arc::new(Run::new(&engine, &body.inner, &body.bytes, &self.scene, text));
        let channels = Channels::new(taxels.clone().unwrap_or_else(|| body.channels()));
        let inner = Mutex::new(Inner { engine, lent: Vec::new(), page: None });
        Ok(PyEngine { inner, run, channels, wish: self })
    }
}
