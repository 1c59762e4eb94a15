//! Tables through Arrow's C stream interface.

use std::ops::Range;
use std::sync::Arc;

use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::{BooleanArray, RecordBatch, RecordBatchReader};
use arrow_schema::{ArrowError, SchemaRef};
use arrow_select::filter::filter_record_batch;
use pyo3::call::PyCallArgs;
use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use somatic::Percepts;
use somatic::sink::{ArrowTable, TableKind};

use crate::session::Run;

/// Rows of a record batch, about.
const BATCH_ROWS: usize = 1 << 16;

/// The part of some percepts that a table is of.
#[derive(Clone)]
pub(crate) struct Part {
    pub(crate) percepts: Arc<Percepts>,
    pub(crate) frames: Range<usize>,
    /// Fields by their index; all where there is none.
    pub(crate) fields: Option<Arc<[usize]>>,
}

/// Makes the record batches of percepts as they are asked for.
struct Reader {
    part: Part,
    table: ArrowTable,
    kind: TableKind,
    /// By field, whether it is in the table; empty where all are.
    chosen: Vec<bool>,
}

impl Iterator for Reader {
    type Item = Result<RecordBatch, ArrowError>;

    fn next(&mut self) -> Option<Self::Item> {
        let mut kept = Vec::new();
        while self.table.rows() < BATCH_ROWS {
            let Some(frame) = self.part.frames.next() else { break };
            let percepts = &self.part.percepts;
            self.table.push(percepts, frame);
            let is_all = self.kind == TableKind::AllFields;
            let fields = self.chosen.iter().enumerate();
            kept.extend(
                fields.filter(|(field, _)| is_all || percepts.in_contact(frame, *field)).map(|(_, kept)| *kept),
            );
        }
        if self.table.rows() == 0 {
            return None;
        }
        let batch = self.table.batch();
        if self.chosen.is_empty() {
            return Some(batch);
        }
        Some(batch.and_then(|batch| filter_record_batch(&batch, &BooleanArray::from(kept))))
    }
}

impl RecordBatchReader for Reader {
    fn schema(&self) -> SchemaRef {
        self.table.schema()
    }
}

/// A capsule with the stream of a table of `part`.
pub(crate) fn stream<'py>(py: Python<'py>, part: &Part, run: &Run, kind: TableKind) -> PyResult<Bound<'py, PyCapsule>> {
    let session = run.session("Python", kind == TableKind::AllFields, true);
    let mut chosen = Vec::new();
    if let Some(fields) = part.fields.as_ref().filter(|_| matches!(kind, TableKind::Touched | TableKind::AllFields)) {
        chosen.resize(part.percepts.fields(), false);
        fields.iter().for_each(|&field| chosen[field] = true);
    }
    let reader = Reader { part: part.clone(), table: ArrowTable::new(kind, &session), kind, chosen };
    PyCapsule::new_with_value(py, FFI_ArrowArrayStream::new(Box::new(reader)), c"arrow_array_stream")
}

/// The table that `any` streams, as a `pyarrow.Table`.
pub(crate) fn to_arrow<'py>(any: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    any.py().import("pyarrow")?.call_method1("table", (any,))
}

/// The same as a `pandas.DataFrame`.
pub(crate) fn to_pandas<'py>(any: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    to_arrow(any)?.call_method0("to_pandas")
}

/// The same as a `polars.DataFrame`.
pub(crate) fn to_polars<'py>(any: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    any.py().import("polars")?.call_method1("DataFrame", (any,))
}

/// What the package's function `name` of `module` makes of `arguments`.
pub(crate) fn in_python<'py>(
    py: Python<'py>,
    module: &str,
    name: &str,
    arguments: impl PyCallArgs<'py>,
) -> PyResult<Bound<'py, PyAny>> {
    py.import(format!("somatic_touch.{module}"))?.getattr(name)?.call1(arguments)
}
