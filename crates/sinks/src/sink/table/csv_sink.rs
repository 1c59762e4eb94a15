//! Writes percepts as CSV.
//!
//! Numbers have the fewest digits that read back to the same bits, as in NDJSON; what is absent is empty.

use std::io::{self, ErrorKind};

use csv::{QuoteStyle, Writer, WriterBuilder};
use serde::Serialize;

use super::row::{Row, TableColumn, TableType, ValueOf, Words};
use super::{
    output_columns, percept_columns, rows, self_contact_columns, self_contact_rows, touch_columns, touch_rows,
};
use crate::error::{Error, Result, failed};
use crate::output::{OutputFile, OutputPath};
use crate::percept::Percepts;
use crate::scene::receptor_of;
use crate::signal::Receptor;
use crate::sink::{FieldNames, Flow, Session, Sink};

/// Between the words of a list.
const BETWEEN_WORDS: &str = ";";

/// Writes percepts as CSV: a row per frame and field in contact, or one per frame.
pub struct CsvSink {
    percepts: Option<CsvFile>,
    touches: Option<CsvFile>,
    self_contacts: Option<CsvFile>,
    rows: Rows,
    words: Words,
    closed: bool,
}

somatic_skin::debug_by_name!(CsvSink);

enum Rows {
    /// One for each field in contact, or for each.
    PerField { all_fields: bool },
    /// One for each frame: by letter the columns of a field in it, and by field its letter.
    PerFrame { columns: Vec<Vec<TableColumn>>, letters: Vec<usize> },
}

/// A file and its columns.
struct CsvFile {
    name: String,
    writer: Writer<OutputFile>,
    columns: Vec<TableColumn>,
    text: Vec<u8>,
}

impl CsvSink {
    /// Writes percepts to `output`, where the file appears when the sink is finished, separate touches to `touches`, and self-contacts to
    /// `self_contacts`; each if it is given. With `wide` there is one row per frame, and every field has columns of its own.
    ///
    /// # Errors
    /// A file cannot be made.
    pub fn create(
        output: Option<OutputPath>,
        touches: Option<OutputPath>,
        self_contacts: Option<OutputPath>,
        wide: bool,
        session: &Session<'_>,
    ) -> Result<Self> {
        let mut sink = Self {
            percepts: output.map(|output| CsvFile::begin(output, percept_columns(session))).transpose()?,
            touches: touches.map(|output| CsvFile::begin(output, touch_columns(session))).transpose()?,
            self_contacts: self_contacts
                .map(|output| CsvFile::begin(output, self_contact_columns(session)))
                .transpose()?,
            rows: Rows::PerField { all_fields: session.all_fields },
            words: Words::new(session),
            closed: false,
        };
        let titles_of = |file: &CsvFile| file.columns.iter().map(TableColumn::title).collect::<Vec<_>>();
        if let Some(percepts) = sink.percepts.as_mut().filter(|_| wide) {
            let columns = wide_columns(session);
            let letter_of = |field: usize| session.plan.map_or(0, |plan| plan.letter_of(field));
            let letters: Vec<usize> = (0..sink.words.names.len()).map(letter_of).collect();
            // Which frame it is of; what follows is of each field.
            percepts
                .columns
                .retain(|column| matches!(column.value, ValueOf::Recording | ValueOf::Time | ValueOf::Frame));
            let titles = percepts.columns.iter().map(TableColumn::title);
            let of_field = |(name, &letter): (&FieldNames, &usize)| {
                let head = head_of(name);
                columns[letter].iter().map(|column| format!("{head} {}", column.title())).collect::<Vec<_>>()
            };
            let titles: Vec<String> = titles.chain(sink.words.names.iter().zip(&letters).flat_map(of_field)).collect();
            sink.rows = Rows::PerFrame { columns, letters };
            percepts.record(titles)?;
        } else if let Some(percepts) = &mut sink.percepts {
            percepts.record(titles_of(percepts))?;
        }
        for file in [&mut sink.touches, &mut sink.self_contacts].into_iter().flatten() {
            file.record(titles_of(file))?;
        }
        Ok(sink)
    }

    /// All of its files, the one that names it first.
    fn files(&mut self) -> impl Iterator<Item = &mut CsvFile> {
        [&mut self.percepts, &mut self.touches, &mut self.self_contacts].into_iter().flatten()
    }

    fn flow(&mut self, written: io::Result<()>) -> Result<Flow> {
        let name = self.files().next().map_or_else(String::new, |file| file.name.clone());
        flow_of(written, &name).inspect(|flow| self.closed |= *flow == Flow::Closed)
    }

    fn write_all(&mut self, percepts: &Percepts) -> Result<(), csv::Error> {
        let Self { percepts: file, touches, self_contacts, rows: how, words, .. } = self;
        for frame in 0..percepts.frames() {
            match (how as &Rows, file.as_mut()) {
                (_, None) => {}
                (Rows::PerField { all_fields }, Some(file)) => {
                    for row in rows(percepts, frame, *all_fields) {
                        for column in 0..file.columns.len() {
                            file.field(&row, file.columns[column].kind, file.columns[column].value, words)?;
                        }
                        file.writer.write_record(None::<&[u8]>)?;
                    }
                }
                (Rows::PerFrame { columns, letters }, Some(file)) => {
                    let first = Row { percepts, frame, field: 0, on_skin: None, contact: None };
                    for column in 0..file.columns.len() {
                        file.field(&first, file.columns[column].kind, file.columns[column].value, words)?;
                    }
                    for row in rows(percepts, frame, true) {
                        for column in &columns[letters[row.field]] {
                            file.field(&row, column.kind, column.value, words)?;
                        }
                    }
                    file.writer.write_record(None::<&[u8]>)?;
                }
            }
            if let Some(touches) = touches {
                for row in touch_rows(percepts, frame) {
                    touches.row(&row, words)?;
                }
            }
            if let Some(self_contacts) = self_contacts {
                for row in self_contact_rows(percepts, frame) {
                    self_contacts.row(&row, words)?;
                }
            }
        }
        Ok(())
    }
}

/// By letter, the columns that a field in it has in a table with one row per frame: not those that only other letters give. Without a
/// plan, all.
fn wide_columns(session: &Session<'_>) -> Vec<Vec<TableColumn>> {
    let all = percept_columns(session);
    let column_of = |value: ValueOf| all.iter().find(|column| column.value == value).cloned();
    let outputs = output_columns(session);
    let of_letter = |receptor: Option<Receptor>| {
        let is_given = |column: &&TableColumn| match (column.value, receptor) {
            (ValueOf::Output(output, _), Some(receptor)) if receptor.is_of_pressure() => {
                receptor_of(output).is_of_pressure()
            }
            (ValueOf::Output(output, _), Some(receptor)) => receptor_of(output) == receptor,
            _ => true,
        };
        let own = outputs.iter().filter(is_given).cloned();
        column_of(ValueOf::Contact).into_iter().chain(own).chain(column_of(ValueOf::Flags)).collect()
    };
    match session.plan {
        Some(plan) => plan.letters().iter().map(|letter| of_letter(Some(letter.receptor))).collect(),
        None => vec![of_letter(None)],
    }
}

/// What the columns of a field begin with.
fn head_of(name: &FieldNames) -> String {
    [Some(&name.field), name.letter.as_ref(), name.signal.as_ref()]
        .into_iter()
        .flatten()
        .map(String::as_str)
        .collect::<Vec<_>>()
        .join(" ")
}

impl CsvFile {
    fn begin(output: OutputPath, columns: Vec<TableColumn>) -> Result<Self> {
        let name = output.name().display().to_string();
        let writer = WriterBuilder::new().quote_style(QuoteStyle::Necessary).from_writer(output.begin()?);
        Ok(Self { name, writer, columns, text: Vec::new() })
    }

    fn record(&mut self, cells: Vec<String>) -> Result<()> {
        self.writer.write_record(cells).map_err(|e| cannot_write(&io_error(e), &self.name))
    }

    /// Writes a row in all of its columns.
    fn row(&mut self, row: &Row<'_>, words: &Words) -> Result<(), csv::Error> {
        for column in 0..self.columns.len() {
            let TableColumn { kind, value, .. } = self.columns[column];
            self.field(row, kind, value, words)?;
        }
        self.writer.write_record(None::<&[u8]>)
    }

    /// Writes the value of a row in a column.
    fn field(&mut self, row: &Row<'_>, kind: TableType, value: ValueOf, words: &Words) -> Result<(), csv::Error> {
        let text = &mut self.text;
        text.clear();
        match (kind, value) {
            (TableType::F64, _) => print(text, row.float(value).as_ref()),
            (TableType::F32, _) => print(text, row.float(value).map(|number| number as f32).as_ref()),
            (TableType::U64 | TableType::U32, _) => print(text, row.whole(value).as_ref()),
            (_, ValueOf::Contact) => print(text, Some(&row.is_touched())),
            (TableType::Words, _) => {
                for (index, name) in row.list(value, words).iter().enumerate() {
                    text.extend_from_slice(if index == 0 { b"" } else { BETWEEN_WORDS.as_bytes() });
                    text.extend_from_slice(name.as_bytes());
                }
            }
            _ => return self.writer.write_field(row.word(value, words).unwrap_or_default()),
        }
        self.writer.write_field(&self.text)
    }

    fn finish(self) -> Result<OutputFile> {
        self.writer.into_inner().map_err(|e| cannot_write(e.error(), &self.name))
    }
}

fn print(text: &mut Vec<u8>, value: Option<&impl Serialize>) {
    if let Some(value) = value {
        serde_json::to_writer(text, value).expect("a number prints into memory");
    }
}

fn io_error(error: csv::Error) -> io::Error {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => error,
        _ => io::Error::other("a row has another number of cells"),
    }
}

fn cannot_write(error: &io::Error, name: &str) -> Error {
    failed!("cannot write: {error}").at(name)
}

/// Whether the output is still open: a closed pipe is a normal end.
fn flow_of(written: io::Result<()>, name: &str) -> Result<Flow> {
    match written {
        Ok(()) => Ok(Flow::Open),
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(Flow::Closed),
        Err(e) => Err(cannot_write(&e, name)),
    }
}

impl Sink for CsvSink {
    fn write(&mut self, percepts: &Percepts) -> Result<Flow> {
        assert_eq!(percepts.fields(), self.words.names.len(), "a sink has the name of every field");
        if self.closed {
            return Ok(Flow::Closed);
        }
        let written = self.write_all(percepts).map_err(io_error);
        self.flow(written)
    }

    fn begin_recording(&mut self, index: usize) -> Result<Flow> {
        self.words.recording = index;
        Ok(if self.closed { Flow::Closed } else { Flow::Open })
    }

    fn flush(&mut self) -> Result<Flow> {
        if self.closed {
            return Ok(Flow::Closed);
        }
        let flushed = self.files().try_for_each(|file| file.writer.flush());
        self.flow(flushed)
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        if self.flush()? == Flow::Closed {
            // The rest has no reader.
            return Ok(());
        }
        let files = [self.percepts, self.touches, self.self_contacts].into_iter().flatten();
        let mut files = files.map(CsvFile::finish).collect::<Result<Vec<_>>>()?.into_iter();
        files.next().map_or(Ok(()), |first| first.finish_with(files.collect()))
    }

    fn finish_early(mut self: Box<Self>) -> Result<Option<String>> {
        if self.flush()? == Flow::Closed {
            return Ok(None);
        }
        let Self { percepts, touches, self_contacts, .. } = *self;
        let Some(first) = percepts.or(touches).or(self_contacts) else { return Ok(None) };
        let name = first.name.clone();
        Ok(first.finish()?.appears_when_finished().then_some(name))
    }
}
