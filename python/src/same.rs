//! Whether two objects are the same.

use std::hash::{DefaultHasher, Hash, Hasher};

use pyo3::prelude::*;
use pyo3::{PyClass, PyTypeInfo};

/// What `==` gives: whether `other` is of the same class and `is_same`.
pub(crate) fn same<T: PyClass<Frozen = pyo3::pyclass::boolean_struct::True> + PyTypeInfo + Sync>(
    py: Python<'_>,
    other: &Bound<'_, PyAny>,
    is_same: impl FnOnce(&T) -> bool,
) -> PyResult<Py<PyAny>> {
    match other.cast::<T>() {
        Ok(other) => Ok(is_same(other.get()).into_pyobject(py)?.to_owned().into_any().unbind()),
        Err(_) => Ok(py.NotImplemented()),
    }
}

/// A hash of `value`.
pub(crate) fn hash_of(value: &impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    value.hash(&mut hasher);
    hasher.finish()
}
