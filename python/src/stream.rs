//! Tables through Arrow's C stream interface.

use std::sync::Arc;

use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::{RecordBatch, RecordBatchReader};
use arrow_schema::{ArrowError, SchemaRef};
use pyo3::prelude::*;
use pyo3::types::PyCapsule;
use somatic::Percepts;
use somatic::sink::{ArrowTable, TableKind};

use crate::session::Run;

/// Rows of a record batch, about.
const BATCH_ROWS: usize = 1 << 16;

/// Makes the record batches of percepts as they are asked for.
struct Reader {
    percepts: Arc<Percepts>,
    table: ArrowTable,
    frame: usize,
}

impl Iterator for Reader {
    type Item = Result<RecordBatch, ArrowError>;

    fn next(&mut self) -> Option<Self::Item> {
        while self.frame < self.percepts.frames() && self.table.rows() < BATCH_ROWS {
            self.table.push(&self.percepts, self.frame);
            self.frame += 1;
        }
        (self.table.rows() > 0).then(|| self.table.batch())
    }
}

impl RecordBatchReader for Reader {
    fn schema(&self) -> SchemaRef {
        self.table.schema()
    }
}

/// A capsule with the stream of a table of `percepts`.
pub(crate) fn stream<'py>(
    py: Python<'py>,
    percepts: &Arc<Percepts>,
    run: &Run,
    kind: TableKind,
) -> PyResult<Bound<'py, PyCapsule>> {
    let session = run.session("Python", kind == TableKind::AllFields, true);
    let reader = Reader { percepts: Arc::clone(percepts), table: ArrowTable::new(kind, &session), frame: 0 };
    PyCapsule::new_with_value(py, FFI_ArrowArrayStream::new(Box::new(reader)), c"arrow_array_stream")
}
