//! Reports the progress of a long call.

use pyo3::call::PyCallArgs;
use pyo3::prelude::*;
use pyo3::types::PyBool;

use crate::stream::in_python;

/// A function of the caller's, or a bar.
pub(crate) struct Progress {
    call: Py<PyAny>,
    is_bar: bool,
}

impl Progress {
    /// What `asked` is: None or False for nothing, True for a bar up to `total`, in `unit`, or a function.
    pub(crate) fn new(
        py: Python<'_>,
        asked: Option<Py<PyAny>>,
        total: Option<f64>,
        unit: &str,
    ) -> PyResult<Option<Self>> {
        let Some(asked) = asked else { return Ok(None) };
        Ok(match asked.bind(py).cast::<PyBool>() {
            Err(_) => Some(Self { call: asked, is_bar: false }),
            Ok(asked) if asked.is_true() => {
                let call = in_python(py, "_progress", "Bar", (total, unit))?.unbind();
                Some(Self { call, is_bar: true })
            }
            Ok(_) => None,
        })
    }

    /// Tells what is done.
    pub(crate) fn tell<'py>(&self, py: Python<'py>, done: impl PyCallArgs<'py>) -> PyResult<()> {
        self.call.call1(py, done).map(drop)
    }

    /// Fills a bar whose call has ended well: what is left of it took no time.
    pub(crate) fn fill<'py>(&self, py: Python<'py>, all: impl PyCallArgs<'py>) -> PyResult<()> {
        if self.is_bar { self.tell(py, all) } else { Ok(()) }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if self.is_bar {
            // A bar that was begun ends, whatever came of the call.
            Python::attach(|py| drop(self.call.call_method0(py, "close")));
        }
    }
}
