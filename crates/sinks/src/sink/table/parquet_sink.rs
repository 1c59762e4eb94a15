//! Writes percepts as Parquet, row groups by time.
//!
//! A file appears when it is finished. Its schema has the units of columns, and in its metadata what was run.

use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, Encoding, GzipLevel};
use parquet::file::properties::WriterProperties;
use parquet::schema::types::ColumnPath;

use super::row::{TableType, ValueOf};
use super::{ArrowTable, TableKind};
use crate::error::{Error, Result, failed};
use crate::output::{OutputFile, OutputPath};
use crate::percept::Percepts;
use crate::sink::{Flow, Session, Sink};

/// Rows that are turned into columns at once.
const BATCH_ROWS: usize = 1 << 14;

/// Rows of a row group, which are in memory until it is written.
const GROUP_ROWS: usize = 1 << 17;

/// Writes percepts as Parquet: a row per frame and field in contact.
pub struct ParquetSink {
    percepts: ParquetFile,
    touches: Option<ParquetFile>,
    self_contacts: Option<ParquetFile>,
}

struct ParquetFile {
    name: String,
    writer: ArrowWriter<OutputFile>,
    table: ArrowTable,
}

impl ParquetSink {
    /// Writes to `output`, where the file appears when the sink is finished, separate touches to `touches`, and
    /// self-contacts to `self_contacts`.
    ///
    /// # Errors
    /// A file cannot be made.
    pub fn create(
        output: OutputPath,
        touches: Option<OutputPath>,
        self_contacts: Option<OutputPath>,
        session: &Session<'_>,
    ) -> Result<Self> {
        let kind = if session.all_fields { TableKind::AllFields } else { TableKind::Touched };
        let beside = |output: Option<OutputPath>, kind| {
            output.map(|output| ParquetFile::begin(output, ArrowTable::new(kind, session))).transpose()
        };
        Ok(Self {
            percepts: ParquetFile::begin(output, ArrowTable::new(kind, session))?,
            touches: beside(touches, TableKind::Touches)?,
            self_contacts: beside(self_contacts, TableKind::SelfContacts)?,
        })
    }
}

impl ParquetFile {
    fn begin(output: OutputPath, table: ArrowTable) -> Result<Self> {
        let name = output.name().display().to_string();
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::GZIP(GzipLevel::try_new(4).unwrap_or_default()))
            .set_max_row_group_row_count(Some(GROUP_ROWS))
            .set_created_by(concat!("somatic ", env!("CARGO_PKG_VERSION")).to_owned());
        // The bytes of measured numbers compress when those of one significance stand together.
        for column in table.columns() {
            let path = ColumnPath::from(column.name.as_str());
            let encoding = match (column.kind, column.value) {
                (_, ValueOf::Time) => continue,
                (TableType::F64 | TableType::F32, _) => Encoding::BYTE_STREAM_SPLIT,
                (TableType::U64 | TableType::U32, _) => Encoding::DELTA_BINARY_PACKED,
                _ => continue,
            };
            properties =
                properties.set_column_dictionary_enabled(path.clone(), false).set_column_encoding(path, encoding);
        }
        let writer = ArrowWriter::try_new(output.begin()?, table.schema(), Some(properties.build()));
        let writer = writer.map_err(|e| failed!("cannot write: {e}").at(&name))?;
        Ok(Self { name, writer, table })
    }

    fn push(&mut self, percepts: &Percepts, frame: usize) -> Result<()> {
        self.table.push(percepts, frame);
        if self.table.rows() >= BATCH_ROWS { self.write() } else { Ok(()) }
    }

    /// Writes the rows that are not written yet.
    fn write(&mut self) -> Result<()> {
        if self.table.rows() == 0 {
            return Ok(());
        }
        let batch = self.table.batch().map_err(|e| failed!("cannot write: {e}").at(&self.name))?;
        self.writer.write(&batch).map_err(|e| self.cannot_write(&e))
    }

    fn finish(mut self) -> Result<OutputFile> {
        self.write()?;
        let name = std::mem::take(&mut self.name);
        self.writer.into_inner().map_err(|e| failed!("cannot write: {e}").at(name))
    }

    fn cannot_write(&self, error: &parquet::errors::ParquetError) -> Error {
        failed!("cannot write: {error}").at(&self.name)
    }
}

impl Sink for ParquetSink {
    fn write(&mut self, percepts: &Percepts) -> Result<Flow> {
        for frame in 0..percepts.frames() {
            self.percepts.push(percepts, frame)?;
            for file in [&mut self.touches, &mut self.self_contacts].into_iter().flatten() {
                file.push(percepts, frame)?;
            }
        }
        Ok(Flow::Open)
    }

    fn begin_recording(&mut self, index: usize) -> Result<Flow> {
        self.percepts.table.begin_recording(index);
        for file in [&mut self.touches, &mut self.self_contacts].into_iter().flatten() {
            file.table.begin_recording(index);
        }
        Ok(Flow::Open)
    }

    fn flush(&mut self) -> Result<Flow> {
        // A file without its end cannot be read: it is written as a whole.
        Ok(Flow::Open)
    }

    fn finish(self: Box<Self>) -> Result<()> {
        let percepts = self.percepts.finish()?;
        let beside = [self.touches, self.self_contacts].into_iter().flatten();
        percepts.finish_with(beside.map(ParquetFile::finish).collect::<Result<_>>()?)
    }

    fn finish_early(self: Box<Self>) -> Result<Option<String>> {
        let name = self.percepts.name.clone();
        // Where it is a stream it gets an end, as it cannot be read without.
        Ok(self.percepts.finish()?.appears_when_finished().then_some(name))
    }
}
