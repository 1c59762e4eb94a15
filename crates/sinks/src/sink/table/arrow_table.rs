//! Percepts as Arrow's record batches: schemas with units, and builders of their columns.

use std::collections::HashMap;
use std::sync::Arc;

use arrow_array::builder::{
    BooleanBuilder, Float32Builder, Float64Builder, Int32Builder, ListBuilder, StringBuilder, UInt32Builder,
    UInt64Builder,
};
use arrow_array::types::Int32Type;
use arrow_array::{ArrayRef, DictionaryArray, RecordBatch, StringArray};
use arrow_schema::{ArrowError, DataType, Field, Schema, SchemaRef};
use sha2::{Digest as _, Sha256};

use super::row::{OfTouch, Row, TableColumn, TableType, ValueOf, Words};
use super::{percept_columns, rows, self_contact_columns, self_contact_rows, touch_columns, touch_rows};
use crate::percept::{ContactKind, Percepts};
use crate::sink::{FieldNames, Session};

/// Makes record batches of percepts: a row per frame and field in contact, or per separate touch.
pub struct ArrowTable {
    schema: SchemaRef,
    columns: Vec<(TableColumn, Builder)>,
    words: Words,
    kind: TableKind,
    rows: usize,
}

/// Of what a table has a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableKind {
    /// Each frame and field in contact.
    Touched,
    /// Each frame and field.
    AllFields,
    /// Each separate touch of each frame.
    Touches,
    /// Each contact of each frame.
    SelfContacts,
}

/// The values of a column that are in no batch yet.
enum Builder {
    F64(Float64Builder),
    F32(Float32Builder),
    U64(UInt64Builder),
    U32(UInt32Builder),
    Bool(BooleanBuilder),
    Word { keys: Int32Builder, words: Arc<StringArray>, key_of: HashMap<String, i32> },
    Words(ListBuilder<StringBuilder>),
}

impl ArrowTable {
    /// A table of the percepts of `session`, whose schema has the units of columns, and in its metadata what was run.
    #[must_use]
    pub fn new(kind: TableKind, session: &Session<'_>) -> Self {
        let columns = match kind {
            TableKind::Touches => touch_columns(session),
            TableKind::SelfContacts => self_contact_columns(session),
            TableKind::Touched | TableKind::AllFields => percept_columns(session),
        };
        let words = Words::new(session);
        let field = |column: &TableColumn| {
            let about =
                HashMap::from([("unit".to_owned(), column.unit.clone()), ("help".to_owned(), column.help.clone())]);
            Field::new(&column.name, arrow_type(column.kind), column.is_nullable).with_metadata(about)
        };
        let fields: Vec<Field> = columns.iter().map(field).collect();
        let columns = columns.into_iter().map(|column| {
            let builder = Builder::new(&column, &words);
            (column, builder)
        });
        Self {
            schema: Arc::new(Schema::new_with_metadata(fields, metadata(session))),
            columns: columns.collect(),
            words,
            kind,
            rows: 0,
        }
    }

    /// Its schema.
    #[must_use]
    pub fn schema(&self) -> SchemaRef {
        Arc::clone(&self.schema)
    }

    /// Its columns.
    pub(super) fn columns(&self) -> impl Iterator<Item = &TableColumn> {
        self.columns.iter().map(|(column, _)| column)
    }

    /// Number of rows that are in no batch yet.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Appends the rows of frame `frame` of `percepts`.
    ///
    /// # Panics
    /// The percepts have another number of fields than the session.
    pub fn push(&mut self, percepts: &Percepts, frame: usize) {
        assert_eq!(percepts.fields(), self.words.names.len(), "a table has the name of every field");
        match self.kind {
            TableKind::Touches => touch_rows(percepts, frame).for_each(|row| self.push_row(&row)),
            TableKind::SelfContacts => self_contact_rows(percepts, frame).for_each(|row| self.push_row(&row)),
            kind => rows(percepts, frame, kind == TableKind::AllFields).for_each(|row| self.push_row(&row)),
        }
    }

    /// The rows that follow are of the recording of the place `index` in [`Session::recordings`].
    pub(super) fn begin_recording(&mut self, index: usize) {
        self.words.recording = index;
    }

    fn push_row(&mut self, row: &Row<'_>) {
        for (column, builder) in &mut self.columns {
            builder.push(row, column.value, &self.words);
        }
        self.rows += 1;
    }

    /// The rows since the last call.
    ///
    /// # Errors
    /// Arrow's own, which would be a defect here.
    pub fn batch(&mut self) -> Result<RecordBatch, ArrowError> {
        self.rows = 0;
        let arrays: Result<Vec<ArrayRef>, _> = self.columns.iter_mut().map(|(_, builder)| builder.finish()).collect();
        RecordBatch::try_new(Arc::clone(&self.schema), arrays?)
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

impl Builder {
    fn new(column: &TableColumn, words_of: &Words) -> Self {
        let names = &words_of.names;
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
                    ValueOf::Signal => name.signal.clone(),
                    _ => None,
                };
                let skin = words_of.skin.as_ref();
                let others: Vec<&str> = match column.value {
                    ValueOf::Recording => words_of.recordings.iter().map(String::as_str).collect(),
                    ValueOf::OnSkin(OfTouch::Kind) => ContactKind::ALL.map(ContactKind::name).to_vec(),
                    ValueOf::OnSkin(of) => {
                        let links = skin.into_iter().flat_map(|skin| skin.links.iter().map(String::as_str));
                        let world = skin.filter(|_| of == OfTouch::In).map(|skin| skin.world.as_str());
                        links.chain(world).collect()
                    }
                    ValueOf::SideLink(_) => {
                        skin.into_iter().flat_map(|skin| skin.links.iter().map(String::as_str)).collect()
                    }
                    ValueOf::Link => names.first().map(|name| name.world.as_str()).into_iter().collect(),
                    _ => Vec::new(),
                };
                let (mut words, mut key_of) = (Vec::new(), HashMap::new());
                for word in names.iter().filter_map(word).chain(others.into_iter().map(str::to_owned)) {
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
                let word = row.word(value, words);
                keys.append_option(word.and_then(|word| key_of.get(word).copied()));
            }
            Self::Words(lists) => {
                for name in row.list(value, words) {
                    lists.values().append_value(name);
                }
                lists.append(true);
            }
        }
    }

    fn finish(&mut self) -> Result<ArrayRef, ArrowError> {
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
