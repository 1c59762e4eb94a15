//! Errors of the library as Python's exceptions.

use std::ffi::CString;
use std::path::Path;

use pyo3::exceptions::{PyKeyboardInterrupt, PyTypeError, PyUserWarning};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use somatic::ErrorKind;

/// A class of `somatic_touch._errors`.
struct Class {
    name: &'static str,
    imported: PyOnceLock<Py<PyType>>,
}

impl Class {
    const fn new(name: &'static str) -> Self {
        Self { name, imported: PyOnceLock::new() }
    }

    fn error(&self, py: Python<'_>, message: String, file: Option<String>, place: Option<String>) -> PyErr {
        let message = in_keywords(py, message);
        match self.imported.import(py, "somatic_touch._errors", self.name) {
            Ok(class) => match class.call1((message, file, place)) {
                Ok(error) => PyErr::from_value(error),
                Err(error) => error,
            },
            Err(error) => error,
        }
    }
}

/// `text` with keyword arguments in the place of the command's flags.
fn in_keywords(py: Python<'_>, text: String) -> String {
    static WORDS: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
    if !text.contains("--") {
        return text;
    }
    let words = WORDS.import(py, "somatic_touch._words", "in_keywords");
    words.and_then(|words| words.call1((&text,))?.extract()).unwrap_or(text)
}

static USAGE: Class = Class::new("UsageError");
static UNKNOWN: Class = Class::new("UnknownNameError");
static INPUT: Class = Class::new("InputError");
static FAILED: Class = Class::new("SomaticError");

/// The exception for a request that makes no sense.
pub(crate) fn usage(py: Python<'_>, message: impl Into<String>) -> PyErr {
    USAGE.error(py, message.into(), None, None)
}

/// The exception for an unknown name.
pub(crate) fn unknown_name(py: Python<'_>, message: impl Into<String>) -> PyErr {
    UNKNOWN.error(py, message.into(), None, None)
}

/// The exception of `pickle` for what stays in its process; `what` says what to send instead.
pub(crate) fn stays_here(what: &str) -> PyErr {
    PyTypeError::new_err(what.to_owned())
}

/// The exception for what this wheel or this machine cannot do.
#[cfg(not(feature = "gpu"))]
pub(crate) fn failed(py: Python<'_>, message: impl Into<String>) -> PyErr {
    FAILED.error(py, message.into(), None, None)
}

/// The exception for `error`, which is about the file `file` if there is one.
pub(crate) fn raised(py: Python<'_>, error: &somatic::Error, file: Option<&Path>) -> PyErr {
    let file = file.map(|file| file.display().to_string());
    // Of the places the file is the outermost.
    let place = error.place().and_then(|place| match &file {
        Some(file) => place.strip_prefix(file.as_str()).and_then(|rest| rest.strip_prefix(": ")),
        None => Some(place),
    });
    let class = match () {
        () if error.is_usage() => &USAGE,
        () if matches!(error.kind(), ErrorKind::NoAdapter | ErrorKind::DeviceLost) => &FAILED,
        () => &INPUT,
    };
    let raised = class.error(py, error.to_string(), file, place.map(str::to_owned));
    let cause = std::error::Error::source(error).and_then(|cause| cause.downcast_ref::<std::io::Error>());
    if let Some(cause) = cause {
        let cause = cause.raw_os_error().map_or_else(|| cause.kind().into(), std::io::Error::from_raw_os_error);
        raised.set_cause(py, Some(cause.into()));
    }
    raised
}

/// Raises what the library says.
pub(crate) trait OrRaise<T> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T>;
    fn or_raise_of(self, py: Python<'_>, file: &Path) -> PyResult<T>;
}

impl<T> OrRaise<T> for somatic::Result<T> {
    fn or_raise(self, py: Python<'_>) -> PyResult<T> {
        self.map_err(|error| raised(py, &error, None))
    }

    fn or_raise_of(self, py: Python<'_>, file: &Path) -> PyResult<T> {
        self.map_err(|error| raised(py, &error, Some(file)))
    }
}

/// Gives each of `lines` as a Python warning.
pub(crate) fn warn(py: Python<'_>, lines: impl IntoIterator<Item = String>) -> PyResult<()> {
    for line in lines {
        let line = CString::new(in_keywords(py, line)).map_err(|e| PyErr::from(std::io::Error::other(e)))?;
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &line, 1)?;
    }
    Ok(())
}

/// What Python raised between the parts of a long call: Ctrl-C, unless a handler raised something else.
pub(crate) fn interrupted(raised: Option<PyErr>) -> PyErr {
    raised.unwrap_or_else(|| PyKeyboardInterrupt::new_err(()))
}
