//! The columns of the tables of an engine's percepts.

use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use somatic::Outputs;
use somatic::internal::error::suggestion;
use somatic::internal::sink::{TableColumn, percept_columns, self_contact_columns, touch_columns};

use crate::error::{unknown_name, usage};
use crate::session::Run;
use crate::stream::in_python;

/// Those of the table called `name`.
pub(super) fn table<'py>(py: Python<'py>, run: &Run, name: &str) -> PyResult<Bound<'py, PyAny>> {
    let session = run.session("Python", false, false);
    let is_there = match name {
        "fields" => true,
        "touches" => session.skin().is_some(),
        "self_contacts" => session.outputs.contains(Outputs::SELF_CONTACTS),
        _ => {
            let near = suggestion(name, ["fields", "touches", "self_contacts"]);
            return Err(unknown_name(py, format!("there is no table `{name}`; {near}")));
        }
    };
    if !is_there {
        return Err(usage(py, format!("`{name}` were not asked for; add them to the scene's outputs")));
    }
    let columns: Vec<TableColumn> = match name {
        "touches" => touch_columns(&session),
        "self_contacts" => self_contact_columns(&session),
        _ => percept_columns(&session),
    };
    let rows = PyList::empty(py);
    for column in columns {
        let row = PyDict::new(py);
        row.set_item("name", column.name)?;
        row.set_item("unit", column.unit)?;
        row.set_item("type", column.kind.name())?;
        row.set_item("absent", column.is_nullable)?;
        row.set_item("what", column.help)?;
        rows.append(row)?;
    }
    in_python(py, "_columns", "Table", (rows,))
}
