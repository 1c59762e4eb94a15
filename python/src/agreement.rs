//! What `Engine.verify` found, as a dict.

use pyo3::prelude::*;
use pyo3::types::PyDict;
use somatic::Agreement;

/// The dict that `Engine.verify` gives.
pub(crate) fn agreement_dict<'py>(py: Python<'py>, sum: &Agreement) -> PyResult<Bound<'py, PyDict>> {
    let quantities = PyDict::new(py);
    for (name, of) in &sum.quantities {
        let made = PyDict::new(py);
        made.set_item("compared", of.compared)?;
        made.set_item("agreeing", of.agreeing)?;
        made.set_item("too_close", of.too_close)?;
        made.set_item("worst_error", of.worst_error)?;
        made.set_item("worst_share", of.worst_share)?;
        quantities.set_item(name, made)?;
    }
    let found = PyDict::new(py);
    found.set_item("agrees", sum.holds())?;
    found.set_item("percepts", sum.percepts)?;
    found.set_item("touches", sum.touches)?;
    found.set_item("failed", sum.failed)?;
    found.set_item("failures", &sum.failures)?;
    found.set_item("quantities", quantities)?;
    Ok(found)
}
