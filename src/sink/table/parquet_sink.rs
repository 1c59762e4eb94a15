//! Writes percepts as Parquet, row groups by time.
//!
//! A file appears when it is finished. Its schema has the units of columns, and in its metadata what was run.

use std::collections::HashMap;
use std::sync::Arc;

use arrow_array::builder::{
    BooleanBuilder, Float32Builder, Float64Builder, Int32Builder, ListBuilder, StringBuilder, UInt32Builder,
    UInt64Builder,
};
use arrow_array::types::Int32Type;
use arrow_array::{ArrayRef, DictionaryArray, RecordBatch, StringArray};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, Encoding, GzipLevel};
use parquet::file::properties::WriterProperties;
use parquet::schema::types::ColumnPath;
use sha2::{Digest as _, Sha256};

use super::{Row, TableColumn, TableType, ValueOf, percept_columns, rows, touch_columns, touch_rows};
use crate::error::{Error, Result, failed};
use crate::output::{OutputFile, OutputPath};
use crate::percept::{Flags, Percepts};
use crate::sink::{FieldNames, Flow, Session, Sink};

/// Rows that are turned into columns at once.
const BATCH_ROWS: usize = 1 << 14;

/// Rows of a row group, which are in memory until it is written.
const GROUP_ROWS: usize = 1 << 17;

/// Writes percepts as Parquet: a row per frame and field in contact.
pub struct ParquetSink {
    percepts: ParquetFile,
    touches: Option<ParquetFile>,
    all_fields: bool,
    words: Words,
}

/// The words of the columns of words, and of flags.
struct Words {
    names: Vec<FieldNames>,
    flags: Vec<(Flags, String)>,
}

struct ParquetFile {
    name: String,
    writer: ArrowWriter<OutputFile>,
    schema: SchemaRef,
    columns: Vec<(TableColumn, Builder)>,
    rows: usize,
}

/// The values of a column, of which no batch is made yet.
enum Builder {
    F64(Float64Builder),
    F32(Float32Builder),
    U64(UInt64Builder),
    U32(UInt32Builder),
    Bool(BooleanBuilder),
    Word { keys: Int32Builder, words: Arc<StringArray>, key_of: HashMap<String, i32> },
    Words(ListBuilder<StringBuilder>),
}

impl ParquetSink {
    /// Writes to `output`, where the file appears when the sink is finished, and separate touches to `touches`.
    ///
    /// # Errors
    /// A file cannot be made.
    pub fn create(output: OutputPath, touches: Option<OutputPath>, session: &Session<'_>) -> Result<Self> {
        let flags = Flags::all().iter_names().map(|(name, flag)| (flag, name.to_lowercase())).collect();
        let words = Words { names: session.names.clone(), flags };
        Ok(Self {
            percepts: ParquetFile::begin(output, percept_columns(session), session)?,
            touches: touches.map(|output| ParquetFile::begin(output, touch_columns(session), session)).transpose()?,
            all_fields: session.all_fields,
            words,
        })
    }
}

/// What was run, for people who find the file.
fn metadata(session: &Session<'_>) -> HashMap<String, String> {
    let mut metadata = HashMap::from([
        ("somatic.version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ("somatic.backend".to_owned(), session.backend.join("; ")),
        ("somatic.source".to_owned(), session.source.to_owned()),
    ]);
    for (name, media_type, bytes) in &session.attached {
        let sum: String = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        let part = match name.strip_suffix(".toml") {
            Some(part) if media_type == "application/toml" => part,
            _ => "body",
        };
        metadata.insert(format!("somatic.{part}.sha256"), sum);
        if part == "body" {
            metadata.insert("somatic.body".to_owned(), name.clone());
        }
        if part == "scene" {
            metadata.insert("somatic.scene".to_owned(), String::from_utf8_lossy(bytes).into_owned());
        }
    }
    metadata
}

fn arrow_type(kind: TableType) -> DataType {
    match kind {
        TableType::F64 => DataType::Float64,
        TableType::F32 => DataType::Float32,
        TableType::U64 => DataType::UInt64,
        TableType::U32 => DataType::UInt32,
        TableType::Bool => DataType::Boolean,
        TableType::Word => DataType::Dictionary(Box::new(DataType::Int32), Box::new(DataType::Utf8)),
        TableType::Words => DataType::List(Arc::new(Field::new_list_field(DataType::Utf8, true))),
    }
}

impl ParquetFile {
    fn begin(output: OutputPath, columns: Vec<TableColumn>, session: &Session<'_>) -> Result<Self> {
        let name = output.name().display().to_string();
        let field = |column: &TableColumn| {
            let about =
                HashMap::from([("unit".to_owned(), column.unit.clone()), ("help".to_owned(), column.help.clone())]);
            Field::new(&column.name, arrow_type(column.kind), column.is_nullable).with_metadata(about)
        };
        let fields: Vec<Field> = columns.iter().map(field).collect();
        let schema = Arc::new(Schema::new_with_metadata(fields, metadata(session)));
        let mut properties = WriterProperties::builder()
            .set_compression(Compression::GZIP(GzipLevel::try_new(4).unwrap_or_default()))
            .set_max_row_group_row_count(Some(GROUP_ROWS))
            .set_created_by(concat!("somatic ", env!("CARGO_PKG_VERSION")).to_owned());
        // The bytes of measured numbers compress when those of one significance stand together.
        for column in &columns {
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
        let file = output.begin()?;
        let writer = ArrowWriter::try_new(file, Arc::clone(&schema), Some(properties.build()));
        let writer = writer.map_err(|e| failed!("cannot write: {e}").at(&name))?;
        let columns = columns.into_iter().map(|column| {
            let builder = Builder::new(&column, &session.names);
            (column, builder)
        });
        Ok(Self { name, writer, schema, columns: columns.collect(), rows: 0 })
    }

    fn push(&mut self, row: &Row<'_>, words: &Words) -> Result<()> {
        for (column, builder) in &mut self.columns {
            builder.push(row, column.value, words);
        }
        self.rows += 1;
        if self.rows == BATCH_ROWS { self.write() } else { Ok(()) }
    }

    /// Writes the rows that are not written yet.
    fn write(&mut self) -> Result<()> {
        if self.rows == 0 {
            return Ok(());
        }
        self.rows = 0;
        let arrays: Result<Vec<ArrayRef>, _> = self.columns.iter_mut().map(|(_, builder)| builder.finish()).collect();
        let batch = arrays.and_then(|arrays| RecordBatch::try_new(Arc::clone(&self.schema), arrays));
        let batch = batch.map_err(|e| failed!("cannot write: {e}").at(&self.name))?;
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

impl Builder {
    fn new(column: &TableColumn, names: &[FieldNames]) -> Self {
        match column.kind {
            TableType::F64 => Self::F64(Float64Builder::new()),
            TableType::F32 => Self::F32(Float32Builder::new()),
            TableType::U64 => Self::U64(UInt64Builder::new()),
            TableType::U32 => Self::U32(UInt32Builder::new()),
            TableType::Bool => Self::Bool(BooleanBuilder::new()),
            TableType::Words => Self::Words(ListBuilder::new(StringBuilder::new())),
            TableType::Word => {
                let word = |name: &FieldNames| match column.value {
                    ValueOf::Field => Some(name.field.clone()),
                    ValueOf::Link => Some(name.link.clone()),
                    ValueOf::Letter => name.letter.clone(),
                    _ => name.signal.clone(),
                };
                let world = (column.value == ValueOf::Link).then(|| "world".to_owned());
                let (mut words, mut key_of) = (Vec::new(), HashMap::new());
                for word in names.iter().filter_map(word).chain(world) {
                    key_of.entry(word.clone()).or_insert_with(|| {
                        words.push(word);
                        words.len() as i32 - 1
                    });
                }
                Self::Word { keys: Int32Builder::new(), words: Arc::new(StringArray::from(words)), key_of }
            }
        }
    }

    fn push(&mut self, row: &Row<'_>, value: ValueOf, words: &Words) {
        match self {
            Self::F64(values) => values.append_option(row.float(value)),
            Self::F32(values) => values.append_option(row.float(value).map(|number| number as f32)),
            Self::U64(values) => values.append_option(row.whole(value)),
            Self::U32(values) => values.append_option(row.whole(value).map(|number| number as u32)),
            Self::Bool(values) => values.append_value(row.is_touched()),
            Self::Word { keys, key_of, .. } => {
                let name = &words.names[row.field];
                let word = match value {
                    ValueOf::Field => Some(name.field.as_str()),
                    ValueOf::Link => Some(row.link(&words.names)),
                    ValueOf::Letter => name.letter.as_deref(),
                    _ => name.signal.as_deref(),
                };
                keys.append_option(word.and_then(|word| key_of.get(word).copied()));
            }
            Self::Words(lists) => {
                let own = row.percepts.flags(row.frame, row.field);
                for (_, name) in words.flags.iter().filter(|(flag, _)| own.contains(*flag)) {
                    lists.values().append_value(name);
                }
                lists.append(true);
            }
        }
    }

    fn finish(&mut self) -> std::result::Result<ArrayRef, arrow_schema::ArrowError> {
        Ok(match self {
            Self::F64(values) => Arc::new(values.finish()),
            Self::F32(values) => Arc::new(values.finish()),
            Self::U64(values) => Arc::new(values.finish()),
            Self::U32(values) => Arc::new(values.finish()),
            Self::Bool(values) => Arc::new(values.finish()),
            Self::Word { keys, words, .. } => {
                Arc::new(DictionaryArray::<Int32Type>::try_new(keys.finish(), Arc::clone(words) as ArrayRef)?)
            }
            Self::Words(lists) => Arc::new(lists.finish()),
        })
    }
}

impl Sink for ParquetSink {
    fn write(&mut self, percepts: &Percepts) -> Result<Flow> {
        assert_eq!(percepts.fields(), self.words.names.len(), "a sink is told the name of every field");
        for frame in 0..percepts.frames() {
            for row in rows(percepts, frame, self.all_fields) {
                self.percepts.push(&row, &self.words)?;
            }
            if let Some(touches) = &mut self.touches {
                for row in touch_rows(percepts, frame) {
                    touches.push(&row, &self.words)?;
                }
            }
        }
        Ok(Flow::Open)
    }

    fn flush(&mut self) -> Result<Flow> {
        // A file without its end cannot be read: it is written as a whole.
        Ok(Flow::Open)
    }

    fn finish(self: Box<Self>) -> Result<()> {
        let percepts = self.percepts.finish()?;
        match self.touches {
            Some(touches) => percepts.finish_with(touches.finish()?),
            None => percepts.finish(),
        }
    }
}
