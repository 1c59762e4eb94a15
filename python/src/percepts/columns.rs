//! Columns as arrays, made once, and the parts of them that a part has.

use std::sync::PoisonError;

use pyo3::prelude::*;
use pyo3::types::PySlice;
use somatic::internal::error::unknown;
use somatic::internal::renamed::new_name;
use somatic::internal::scene::AskedOutputs;
use somatic::percept::ColumnValues;
use somatic::{COLUMNS, Column};

use super::PyPercepts;
use crate::arrays::array;
use crate::error::unknown_name;
use crate::threads::free;

impl PyPercepts {
    /// The column called `name`, if it was asked for.
    pub(super) fn column(&self, py: Python<'_>, name: &str) -> PyResult<&'static Column> {
        let outputs = self.inner.outputs();
        if let Some(column) = outputs.columns().find(|column| column.name == name) {
            return Ok(column);
        }
        Err(unknown_name(
            py,
            match name {
                "touches" | "self_contacts" => format!("{name} are not a column; see `.{name}`"),
                _ if COLUMNS.iter().any(|column| column.name == name) => {
                    format!("`{name}` was not asked for; add it to the scene's outputs")
                }
                _ => {
                    let names: Vec<String> =
                        AskedOutputs::names().filter(|name| name.starts_with("touches.")).collect();
                    match new_name(name, names.iter().map(String::as_str)) {
                        Some(new) => format!("`{name}` is `{new}` now; see `.touches`"),
                        None => unknown("output", name, outputs.columns().map(|column| column.name)),
                    }
                }
            },
        ))
    }

    /// The column called `name`, as an array.
    pub(super) fn named(&self, py: Python<'_>, name: &str) -> PyResult<Py<PyAny>> {
        let column = self.column(py, name)?;
        self.once(py, name, || {
            let [frames, fields] = self.shape();
            let shape = [frames, fields, column.components];
            let shape = if column.components == 1 { &shape[..2] } else { &shape[..] };
            match free(py, || self.inner.column(column)) {
                Some(ColumnValues::F32(values)) => array(py, values, shape),
                Some(ColumnValues::F64(values)) => array(py, values, shape),
                Some(ColumnValues::U32(values)) => array(py, values, shape),
                None => Err(unknown_name(py, format!("`{name}` was not asked for; add it to the scene's outputs"))),
            }
        })
    }

    /// The array called `name`, made once.
    pub(super) fn once(
        &self,
        py: Python<'_>,
        name: &str,
        make: impl FnOnce() -> PyResult<Py<PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        let made =
            |of: &Self| of.made.lock().unwrap_or_else(PoisonError::into_inner).get(name).map(|it| it.clone_ref(py));
        if let Some(array) = made(self) {
            return Ok(array);
        }
        // Made without the lock, which a thread that waits for Python must not hold.
        let whole = match &self.whole {
            Some(whole) => whole.get().once(py, name, make)?,
            None => make()?,
        };
        let array = self.cut(py, whole)?;
        self.made.lock().unwrap_or_else(PoisonError::into_inner).insert(name.to_owned(), array.clone_ref(py));
        Ok(array)
    }

    /// The part of `array`, of all frames and fields, that it has.
    fn cut(&self, py: Python<'_>, array: Py<PyAny>) -> PyResult<Py<PyAny>> {
        if self.is_whole() {
            return Ok(array);
        }
        let mut part = array.into_bound(py);
        part = part.get_item(PySlice::new(py, self.frames.start as isize, self.frames.end as isize, 1))?;
        if let Some(fields) =
            self.fields.as_ref().filter(|_| part.getattr("ndim").is_ok_and(|ndim| ndim.gt(1).unwrap_or(false)))
        {
            part = part.call_method1("take", (fields.to_vec(), 1))?;
            part.call_method1("setflags", (false,))?;
        }
        Ok(part.unbind())
    }

    /// The frames and the fields of the whole batch.
    pub(super) fn shape(&self) -> [usize; 2] {
        [self.inner.frames(), self.inner.fields()]
    }
}
