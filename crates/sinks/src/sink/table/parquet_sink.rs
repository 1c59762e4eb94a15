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

#[cfg(test)]
mod tests {
    use arrow_array::cast::AsArray as _;
    use arrow_array::types::{Int32Type, UInt64Type};
    use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;

    use super::*;
    use crate::output::OutputPaths;
    use crate::percept::Outputs;
    use crate::sink::FieldNames;
    use crate::{Body, Engine, Options, RawValue};

    #[test]
    fn rows_of_several_recordings_say_which_they_are_of() {
        let body = Body::from_bytes("hand", crate::bundled::body("hand").unwrap()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("both.parquet");
        let recordings = ["a.csv".to_owned(), "b.csv".to_owned()];
        let engine = || Engine::new(&body, Options::default().backend(crate::BackendKind::Cpu)).unwrap();
        let first = engine();
        let session = Session {
            names: FieldNames::all_of(first.plan()),
            outputs: Outputs::TOTAL,
            recordings: &recordings,
            body: Some(&body),
            plan: Some(first.plan()),
            ..Session::default()
        };
        let mut outputs = OutputPaths::new(false, Vec::<std::path::PathBuf>::new());
        let output = outputs.add(&path).unwrap();
        let mut sink = ParquetSink::create(output, None, None, &session).unwrap();
        for recording in 0..2 {
            // From a state of its own.
            let mut engine = engine();
            if recording > 0 {
                assert_eq!(sink.begin_recording(recording).unwrap(), Flow::Open);
            }
            for time in 0..3 {
                let mut frame = engine.frame(f64::from(time));
                frame.values.fill(RawValue::new(5.0));
                assert_eq!(sink.write(engine.process_one(&frame).unwrap()).unwrap(), Flow::Open);
            }
        }
        Box::new(sink).finish().unwrap();
        let reader = ParquetRecordBatchReaderBuilder::try_new(std::fs::File::open(&path).unwrap()).unwrap();
        let (mut names, mut frames) = (Vec::new(), Vec::new());
        for batch in reader.build().unwrap().map(Result::unwrap) {
            assert_eq!(batch.schema().field(0).name(), "recording");
            let column = batch.column(0).as_dictionary::<Int32Type>();
            let words = column.values().as_string::<i32>();
            names.extend(column.keys().iter().map(|key| words.value(key.unwrap() as usize).to_owned()));
            frames.extend(batch.column(2).as_primitive::<UInt64Type>().values().iter().copied());
        }
        let half = names.len() / 2;
        assert!(half >= 9 && names[..half].iter().all(|name| name == "a.csv"), "{names:?}");
        assert!(names[half..].iter().all(|name| name == "b.csv"));
        assert_eq!((frames[0], frames[half], &frames[..half]), (0, 0, &frames[half..]));
    }
}
