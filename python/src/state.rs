//! `EngineState`: where an engine is.

use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::error::stays_here;

/// What an engine's next percepts depend on beside the next frames. It cannot be pickled.
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

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyDict>) -> Py<Self> {
        slf
    }

    fn __reduce__(&self) -> PyResult<()> {
        Err(stays_here(
            "an engine's state cannot be pickled: it holds what the backend has in memory; process the frames before it again, \
             or, in this process, `copy.copy` the engine",
        ))
    }
}
