//! Recordings as CSV: a header `t,<taxel id>,<taxel id>,...`, then a row a frame.
//!
//! A blank cell is a missing value; `nan` and `inf` are faulty values. A pair of quotes around a cell is ignored; any other
//! quote is an error. Rows are read one at a time, so memory does not grow with the length of a recording.

use std::collections::HashMap;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use csv::{ByteRecord, ErrorKind};

use super::Source;
use crate::error::{Error, Result, failed};
use crate::signal::{Frame, RawValue};

/// Longest accepted row, so that a file that is no CSV does not fill the memory.
const MAX_ROW_BYTES: usize = 64 << 20;

/// A recording read from CSV.
pub struct CsvSource {
    name: String,
    reader: csv::Reader<LimitedReader>,
    total_bytes: Option<u64>,
    row: ByteRecord,
    taxels: Vec<u32>,
    time: Time,
    frames: u64,
    losses: Vec<String>,
}

#[derive(Clone, Copy)]
enum Time {
    /// The first column.
    Column,
    /// Frames come at this rate, the first at 0.
    Rate(f64),
}

impl Time {
    /// Columns before the first taxel's.
    fn columns(self) -> usize {
        match self {
            Self::Column => 1,
            Self::Rate(_) => 0,
        }
    }
}

impl CsvSource {
    /// Opens the recording at `path`. `rate_hz` gives the time where the file has no column `t`.
    ///
    /// # Errors
    /// The file cannot be read or has no valid header; a usage error if `rate_hz` is missing or not allowed.
    pub fn open(path: impl AsRef<Path>, rate_hz: Option<f64>) -> Result<Self> {
        let path = path.as_ref();
        let file = File::open(path).map_err(|e| Error::io(path, &e))?;
        let length = file.metadata().ok().filter(std::fs::Metadata::is_file).map(|m| m.len());
        Self::from_reader(path.display().to_string(), file, length, rate_hz)
    }

    /// Reads a recording from `reader`, called `name` in messages. `total_bytes` is for [`Source::progress`].
    ///
    /// # Errors
    /// As [`CsvSource::open`].
    pub fn from_reader(
        name: impl Into<String>,
        reader: impl Read + Send + 'static,
        total_bytes: Option<u64>,
        rate_hz: Option<f64>,
    ) -> Result<Self> {
        let name = name.into();
        let reader = csv::ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .quoting(false)
            // `\r` before it is trimmed with other blanks, so that line numbers stay right.
            .terminator(csv::Terminator::Any(b'\n'))
            .buffer_capacity(1 << 16)
            .from_reader(LimitedReader { inner: Box::new(reader), row_bytes: 0, last_byte: b'\n', ended: false });
        let mut source = Self {
            name,
            reader,
            total_bytes,
            row: ByteRecord::new(),
            taxels: Vec::new(),
            time: Time::Column,
            frames: 0,
            losses: Vec::new(),
        };
        source.read_header(rate_hz).map_err(|e| e.at(&source.name))?;
        Ok(source)
    }

    fn read_header(&mut self, rate_hz: Option<f64>) -> Result<()> {
        if !self.read_row()? {
            return Err(Error::failed("the file is empty; its first row should be `t,<taxel id>,<taxel id>,...`"));
        }
        let has_time = trimmed(self.row.get(0).unwrap_or_default()).eq_ignore_ascii_case(b"t");
        self.time = match (has_time, rate_hz) {
            (true, None) => Time::Column,
            (true, Some(_)) => {
                return Err(Error::usage("the recording has its own times in column `t`; leave out --rate"));
            }
            (false, Some(rate)) if rate.is_finite() && rate > 0.0 => Time::Rate(rate),
            (false, Some(rate)) => {
                return Err(Error::usage(format!("--rate {rate} is not a frame rate; give a positive number of Hz")));
            }
            (false, None) => Time::Column,
        };
        let mut columns = HashMap::new();
        for (index, cell) in self.row.iter().enumerate().skip(usize::from(has_time)) {
            let id = header_id(index + 1, cell)?;
            if let Some(first) = columns.insert(id, index + 1) {
                return Err(failed!("taxel {id} heads columns {first} and {}; give each taxel one column", index + 1));
            }
            self.taxels.push(id);
        }
        // Checked last, so that a file without any header gets the header's message.
        if !has_time && rate_hz.is_none() {
            return Err(Error::usage("the recording has no column `t`; give its frame rate with --rate HZ"));
        }
        if self.taxels.is_empty() {
            return Err(Error::failed("the header names no taxel; it should be `t,<taxel id>,<taxel id>,...`"));
        }
        Ok(())
    }

    /// Reads the next row that is not blank. `false` at the end.
    fn read_row(&mut self) -> Result<bool> {
        loop {
            self.reader.get_mut().row_bytes = 0;
            let read = self.reader.read_byte_record(&mut self.row).map_err(|e| match e.into_kind() {
                ErrorKind::Io(e) if e.kind() == io::ErrorKind::IsADirectory => {
                    Error::failed("this is a folder; name a file")
                }
                ErrorKind::Io(e) => Error::failed(e.to_string()),
                other => failed!("{other:?}"),
            })?;
            if !(read && self.row.len() == 1 && trimmed(&self.row[0]).is_empty()) {
                return Ok(read);
            }
        }
    }

    /// The line number of the row just read; the reader counts blank lines before it as part of the row.
    fn line(&self) -> u64 {
        let read = self.reader.get_ref();
        self.reader.position().line() - u64::from(!(read.ended && read.last_byte != b'\n'))
    }

    /// The error for the first cell of the current row with an unpaired quote.
    fn stray_quote(&self) -> Option<Error> {
        if !self.row.as_slice().contains(&b'"') {
            return None;
        }
        let (index, cell) = self.row.iter().enumerate().find(|(_, cell)| trimmed(cell).contains(&b'"'))?;
        let taxel = index.checked_sub(self.time.columns()).and_then(|index| self.taxels.get(index));
        let place = taxel.map_or(format!("column {}", index + 1), |id| format!("column {} (taxel {id})", index + 1));
        let word = shortened(&String::from_utf8_lossy(cell.trim_ascii()));
        Some(failed!("`{word}` has a quote; numbers stand without quotes: remove it").at(place))
    }

    fn read_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        if !self.read_row()? {
            return Ok(false);
        }
        let (found, wanted) = (self.row.len(), self.time.columns() + self.taxels.len());
        let line = self.line();
        let at_line = |e: Error| e.at(format!("line {line}"));
        let quote = self.stray_quote();
        if found != wanted {
            // Only the last row may be cut short: the recorder was stopped while writing it.
            if self.read_row()? {
                let ragged =
                    || failed!("{found} values where the header has {wanted} columns; complete or delete the row");
                return Err(at_line(quote.unwrap_or_else(ragged)));
            }
            let how = if found < wanted { "truncated" } else { "too long" };
            self.losses.push(format!("{}: line {line}: last row {how}: {found} of {wanted} values", self.name));
            return Ok(false);
        }
        if let Some(quote) = quote {
            return Err(at_line(quote));
        }
        frame.clear();
        frame.values.resize(self.taxels.len(), RawValue::MISSING);
        let mut cells = self.row.iter();
        frame.t_s = match self.time {
            Time::Column => parse_time(cells.next().unwrap_or_default()).map_err(at_line)?,
            Time::Rate(rate) => self.frames as f64 / rate,
        };
        for ((value, cell), id) in frame.values.iter_mut().zip(cells).zip(&self.taxels) {
            *value = parse_value(cell).map_err(|e| at_line(e.at(format!("taxel {id}"))))?;
        }
        self.frames += 1;
        Ok(true)
    }
}

impl Source for CsvSource {
    fn taxels(&self) -> &[u32] {
        &self.taxels
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        self.read_frame(frame).map_err(|e| e.at(&self.name))
    }

    fn progress(&self) -> Option<f64> {
        let total = self.total_bytes.filter(|&total| total > 0)?;
        Some((self.reader.position().byte() as f64 / total as f64).min(1.0))
    }

    fn losses(&self) -> Vec<String> {
        self.losses.clone()
    }
}

/// The taxel id that heads column `column`, counted from 1.
fn header_id(column: usize, cell: &[u8]) -> Result<u32> {
    let word = String::from_utf8_lossy(trimmed(cell));
    if let Ok(id) = word.parse() {
        return Ok(id);
    }
    let remedy = if cell.starts_with(b"\xFF\xFE") || cell.starts_with(b"\xFE\xFF") {
        "the file is UTF-16; save it as UTF-8"
    } else if word.contains('"') {
        "ids stand without quotes: remove the quote"
    } else if word.contains([';', '\t']) {
        "columns are separated by commas"
    } else if word.contains('\r') {
        "lines should end with a newline"
    } else if word.eq_ignore_ascii_case("t") {
        "t is the first column, and there is one"
    } else if word.parse::<f64>().is_ok() {
        "the first row should be the header `t,<taxel id>,<taxel id>,...`"
    } else {
        "the header is `t,<taxel id>,<taxel id>,...`, and ids are whole numbers"
    };
    Err(failed!("column {column} is headed `{}`, which is not a taxel id; {remedy}", shortened(&word)))
}

/// Whether `line` looks like CSV: `t`, numbers and blanks, separated by commas.
pub(super) fn is_csv_row(line: &[u8]) -> bool {
    let is_cell = |cell: &[u8]| matches!(trimmed(cell), b"" | b"t") || number(trimmed(cell)).is_some();
    line.contains(&b',') && line.split(|&byte| byte == b',').all(is_cell)
}

fn parse_time(cell: &[u8]) -> Result<f64> {
    let word = trimmed(cell);
    match number(word) {
        Some(t) if t.is_finite() => Ok(t),
        _ if word.is_empty() => Err(Error::failed("t is blank; every row needs its time in seconds")),
        _ => Err(failed!(
            "t is `{}`; it should be a finite number of seconds",
            shortened(&String::from_utf8_lossy(word))
        )),
    }
}

fn parse_value(cell: &[u8]) -> Result<RawValue> {
    if let Some(count) = short_count(cell) {
        return Ok(RawValue::new(count.into()));
    }
    let word = trimmed(cell);
    if word.is_empty() {
        return Ok(RawValue::MISSING);
    }
    number(word).map(RawValue::new).ok_or_else(|| {
        failed!(
            "`{}` is no number; leave a missing value blank, and write `nan` for a faulty one",
            shortened(&String::from_utf8_lossy(word))
        )
    })
}

/// Parses up to seven digits: most sensor values, three times as fast as the general parser.
fn short_count(cell: &[u8]) -> Option<u32> {
    if !(1..=7).contains(&cell.len()) {
        return None;
    }
    cell.iter().try_fold(0, |count, byte| byte.is_ascii_digit().then(|| count * 10 + u32::from(byte - b'0')))
}

/// Parses a number; `nan`, `inf` and `-inf` in any case are accepted.
fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// `cell` without surrounding blanks and a pair of quotes.
fn trimmed(cell: &[u8]) -> &[u8] {
    match cell.trim_ascii() {
        [b'"', inner @ .., b'"'] => inner.trim_ascii(),
        bare => bare,
    }
}

/// As much of `word` as fits in a message.
fn shortened(word: &str) -> String {
    let short: String = word.chars().take(40).flat_map(char::escape_debug).collect();
    let mut short = short.replace("\\\"", "\"");
    if word.chars().nth(40).is_some() {
        short.push('…');
    }
    short
}

/// A reader that limits the length of rows and knows whether the file ends with a newline.
struct LimitedReader {
    inner: Box<dyn Read + Send>,
    row_bytes: usize,
    last_byte: u8,
    ended: bool,
}

impl Read for LimitedReader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.row_bytes > MAX_ROW_BYTES {
            return Err(io::Error::other(format!(
                "a row of over {} MiB: no CSV, or its lines have no end",
                MAX_ROW_BYTES >> 20
            )));
        }
        let read = self.inner.read(buffer)?;
        self.row_bytes += read;
        match buffer[..read].last() {
            Some(&last) => self.last_byte = last,
            None => self.ended = true,
        }
        Ok(read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(text: &str, rate: Option<f64>) -> Result<CsvSource> {
        let bytes = text.as_bytes().to_vec();
        CsvSource::from_reader("a.csv", io::Cursor::new(bytes), Some(text.len() as u64), rate)
    }

    /// A frame's time and its values in words.
    type Row = (f64, String);

    /// All frames, and the losses.
    fn read(text: &str, rate: Option<f64>) -> Result<(Vec<Row>, Vec<String>)> {
        let mut source = open(text, rate)?;
        let mut frame = Frame::missing(0.0, source.taxels().len());
        let mut frames = Vec::new();
        while source.next_frame(&mut frame)? {
            frames.push((frame.t_s, format!("{:?}", frame.values)));
        }
        assert!(!source.next_frame(&mut frame)?, "the end stays the end");
        Ok((frames, source.losses()))
    }

    fn why(text: &str, rate: Option<f64>) -> String {
        read(text, rate).unwrap_err().to_string()
    }

    #[test]
    fn cells_are_numbers_missing_or_faulty() {
        let (frames, losses) = read("t,4,7\n0,1.5,\n0.1,NaN,-INF\n0.05,\" 3 \",1e39\n9,-0,inf\n", None).unwrap();
        assert_eq!(
            frames,
            [
                (0.0, "[1.5, missing]".into()),
                (0.1, "[faulty, faulty]".into()),
                (0.05, "[3, faulty]".into()),
                (9.0, "[-0, faulty]".into())
            ]
        );
        assert!(losses.is_empty());
    }

    #[test]
    fn line_ends_marks_and_quotes_make_no_difference() {
        let wanted = read("t,4,7\n0,1,2\n1,3,4\n", None).unwrap();
        for text in [
            "t,4,7\r\n0,1,2\r\n1,3,4\r\n",
            "\u{feff}t,4,7\n0,1,2\n1,3,4",
            "\u{feff}\"t\",\"4\",\"7\"\r\n\"0\",\"1\",\"2\"\r\n1,3,4",
            "\n\nt, 4 ,7\n\n 0,1, 2\n1,3,4\n\n\n",
            "t,4,7\r\n\r\n0,1,2\r\n1,3,\"4\"\r\n\r\n",
        ] {
            assert_eq!(read(text, None).unwrap(), wanted, "{text:?}");
        }
    }

    #[test]
    fn a_rate_stands_in_for_t() {
        let (frames, _) = read("4,7\n1,2\n3,4\n", Some(20.0)).unwrap();
        assert_eq!(frames, [(0.0, "[1, 2]".into()), (0.05, "[3, 4]".into())]);
        let usage = |text, rate| {
            let error = read(text, rate).unwrap_err();
            assert!(error.is_usage(), "{error}");
            error.to_string()
        };
        assert!(usage("4,7\n1,2\n", None).contains("--rate"));
        assert!(usage("t,7\n1,2\n", Some(10.0)).contains("--rate"));
        assert!(usage("4,7\n1,2\n", Some(0.0)).contains("positive"));
        assert!(usage("4,7\n1,2\n", Some(f64::NAN)).contains("positive"));
    }

    #[test]
    fn a_ragged_last_row_is_a_loss_and_any_other_an_error() {
        for text in ["t,4,7\n0,1,2\n1,3", "t,4,7\n0,1,2\n1,3\n", "t,4,7\n0,1,2\n1,\"3"] {
            let (frames, losses) = read(text, None).unwrap();
            assert_eq!(frames.len(), 1);
            assert_eq!(losses, ["a.csv: line 3: last row truncated: 2 of 3 values"], "{text:?}");
        }
        let (_, losses) = read("t,4\n0,1\n1,3,5,6\n", None).unwrap();
        assert_eq!(losses, ["a.csv: line 3: last row too long: 4 of 2 values"]);
        assert_eq!(
            why("t,4,7\n0,1\n1,3,4\n", None),
            "a.csv: line 2: 2 values where the header has 3 columns; complete or delete the row"
        );
    }

    #[test]
    fn errors_name_line_taxel_and_word() {
        for end in ["\n", "\r\n"] {
            let text = ["t,4,7", "0,1,2", "1,3,abc", "2,5,6", ""].join(end);
            assert!(why(&text, None).starts_with("a.csv: line 3: taxel 7: `abc` is no number"), "{}", why(&text, None));
            let text = ["t,4,7", "0,1,2", "", "1,3,NA", "2,5,6", ""].join(end);
            assert!(why(&text, None).starts_with("a.csv: line 4: taxel 7: `NA` is"), "{}", why(&text, None));
        }
        assert!(why("t,4\n,1\n", None).starts_with("a.csv: line 2: t is blank"));
        assert!(why("t,4\nnan,1\n", None).starts_with("a.csv: line 2: t is `nan`"));
        assert!(why("t,4\n1e999,1\n", None).starts_with("a.csv: line 2: t is `1e999`"));
        assert!(why("t,4\nnow,1\n", None).contains("t is `now`"));
    }

    #[test]
    fn a_header_that_is_none_says_what_to_do() {
        assert!(why("", None).contains("empty"));
        assert!(why("\n\n", None).contains("empty"));
        assert!(why("t\n0\n", None).contains("no taxel"));
        assert!(why("t,4,4\n", None).contains("taxel 4 heads columns 2 and 3"));
        assert!(why("t,4,04\n", None).contains("taxel 4 heads"));
        assert!(why("t,4,\n", None).contains("column 3 is headed ``"));
        assert!(why("t,palm\n", None).contains("`palm`"));
        assert!(why("t,-1\n", None).contains("`-1`"));
        assert!(why("t,4,t\n", None).contains("first column"));
        assert!(why("t;4;7\n", None).contains("commas"));
        assert!(why("t,4\r0,1\r", None).contains("newline"));
        assert!(why("0.0,1.5,2\n0.1,1,2\n", None).contains("first row should be the header"));
        let error = CsvSource::from_reader("a.csv", &b"\xFF\xFEt\0,\x004\0\n\0"[..], None, None);
        assert!(error.err().unwrap().to_string().contains("UTF-16"));
    }

    #[test]
    fn a_stray_quote_is_an_error_in_its_own_row() {
        let mut text = "t,4,7\n".to_owned();
        for row in 0..2000 {
            text += &format!("{row},1,{}2\n", if row == 9 { "\"" } else { "" });
        }
        let mut source = open(&text, None).unwrap();
        let mut frame = Frame::missing(0.0, 2);
        for _ in 0..9 {
            assert!(source.next_frame(&mut frame).unwrap());
        }
        assert_eq!(
            source.next_frame(&mut frame).unwrap_err().to_string(),
            "a.csv: line 11: column 3 (taxel 7): `\"2` has a quote; numbers stand without quotes: remove it"
        );
        assert!(why("t,4\n\"0,1\n1,2\n", None).starts_with("a.csv: line 2: column 1: `\"0` has a quote"));
        assert!(why("t,4\n0,1\"\"2\n", None).starts_with("a.csv: line 2: column 2 (taxel 4): `1\"\"2` has a quote"));
        // A comma for the decimal point, as some spreadsheets write it.
        assert!(why("t,4\n0,\"1,5\"\n1,2\n", None).starts_with("a.csv: line 2: column 2 (taxel 4): `\"1` has"));
        assert!(why("t,\"4\n0,1\n", None).contains("column 2 is headed `\"4`, which is not a taxel id; ids stand"));
    }

    #[test]
    fn a_row_without_end_does_not_fill_the_memory() {
        let text = &b"t,4\n0,1\n"[..];
        let mut source = CsvSource::from_reader("a.csv", text.chain(io::repeat(b'1')), None, None).unwrap();
        assert!(source.next_frame(&mut Frame::missing(0.0, 1)).unwrap());
        let error = source.next_frame(&mut Frame::missing(0.0, 1)).unwrap_err();
        assert!(error.to_string().contains("over 64 MiB"), "{error}");
    }

    #[test]
    fn progress_runs_from_nothing_to_all() {
        let mut source = open("t,4\n0,1\n1,2\n", None).unwrap();
        assert!(source.progress().unwrap() < 0.5);
        let mut frame = Frame::missing(0.0, 1);
        while source.next_frame(&mut frame).unwrap() {}
        assert_eq!(source.progress(), Some(1.0));
    }

    #[test]
    fn a_file_that_is_not_there_is_not_found() {
        assert!(CsvSource::open("no/such.csv", None).err().unwrap().is_not_found());
        assert!(CsvSource::open(".", None).err().unwrap().to_string().contains("folder"));
    }
}
