//! `EngineState`: where an engine is.

use pyo3::prelude::*;

/// What an engine's next percepts depend on beside the next frames.
#[pyclass(module = "somatic_touch", name = "EngineState", frozen)]
pub(crate) struct PyState {
    pub(crate) inner: somatic::EngineState,
}

#[pymethods]
impl PyState {
    /// The number of frames that were processed before it.
    #[getter]
    fn frames(&self) -> u64 {
        self.inner.frames()
    }
}
