//! Recordings as CSV: a header `t,<taxel id>,<taxel id>,...`, then a row a frame. The unit of `t` is seconds unless its head says
//! another, as `t [ms]` does, or the first time is one of our days in another unit or of the calendar.
//!
//! A blank cell is a missing value; `nan` and `inf` are faulty values. A pair of quotes around a cell is ignored; any other
//! quote is an error. Rows are read one at a time, so memory does not grow with the length of a recording.

use std::collections::VecDeque;
use std::io::{self, Read};
use std::path::Path;

use csv::{ByteRecord, ErrorKind};

use super::Source;
use super::csv_cells::{number, shortened, trimmed};
use super::csv_header::{self, Header};
use super::csv_named;
use super::gzip;
use super::skipped_bad::SkippedBad;
use super::text::TextOptions;
use super::time_column::TimeColumn;
use super::vendor::VendorOptions;
use crate::error::{Error, Result, failed};
use crate::limits::MAX_LINE_BYTES;
use crate::signal::{Channel, Frame, RawValue};

/// What is wrong with rows of words or quotes.
const NO_NUMBER: &str = "a value that is not a number";

/// A recording read from CSV.
pub struct CsvSource {
    name: String,
    reader: csv::Reader<LimitedReader>,
    total_bytes: Option<u64>,
    row: ByteRecord,
    /// The number of the row's line.
    line: u64,
    /// Rows that were looked at before their turn, with the numbers of their lines.
    ahead: VecDeque<(ByteRecord, u64)>,
    taxels: Vec<u32>,
    /// Columns that are not a sensor, from 0, ascending.
    left_out: Vec<usize>,
    time: Time,
    /// The column of the time, from 0, if there is one, and how many there are.
    time_at: usize,
    width: usize,
    frames: u64,
    notices: Vec<String>,
    losses: Vec<String>,
    skipped: SkippedBad,
}

somatic_skin::debug_by_name!(CsvSource);

enum Time {
    /// A column.
    Column(TimeColumn),
    /// Frames come at this rate, the first at 0.
    Rate(f64),
}

impl CsvSource {
    /// Opens the recording at `path`. `rate_hz` gives the time where the file has no column `t`.
    ///
    /// # Errors
    /// The file cannot be read or has no valid header; a usage error if `rate_hz` is missing or not allowed.
    pub fn open(path: impl AsRef<Path>, rate_hz: Option<f64>) -> Result<Self> {
        let path = path.as_ref();
        let (text, length) = gzip::open(path).map_err(|e| Error::io(path, &e))?;
        Self::from_reader(path.display().to_string(), text, length, rate_hz)
    }

    /// The same with columns that are named instead of found out, if [`VendorOptions::text`] names any: for a body with the taxels
    /// `ids`.
    ///
    /// # Errors
    /// As [`CsvSource::open`]; a usage error if there are no such columns, or not as many as taxels.
    pub fn open_for(path: impl AsRef<Path>, options: &VendorOptions, ids: &[u32]) -> Result<Self> {
        let path = path.as_ref();
        let (text, length) = gzip::open(path).map_err(|e| Error::io(path, &e))?;
        Self::from_reader_for(path.display().to_string(), text, length, options, ids)
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
        let options = VendorOptions { rate_hz, ..VendorOptions::default() };
        Self::from_reader_for(name, reader, total_bytes, &options, &[])
    }

    /// The same with columns that are named, as [`CsvSource::open_for`] has them.
    ///
    /// # Errors
    /// As [`CsvSource::open_for`].
    pub fn from_reader_for(
        name: impl Into<String>,
        reader: impl Read + Send + 'static,
        total_bytes: Option<u64>,
        options: &VendorOptions,
        ids: &[u32],
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
            line: 0,
            ahead: VecDeque::new(),
            taxels: Vec::new(),
            left_out: Vec::new(),
            time: Time::Rate(1.0),
            time_at: 0,
            width: 0,
            frames: 0,
            notices: Vec::new(),
            losses: Vec::new(),
            skipped: SkippedBad::new(options.skip_bad),
        };
        source.read_header(options.rate_hz, &options.text, ids).map_err(|e| e.at(&source.name))?;
        Ok(source)
    }

    fn read_header(&mut self, rate_hz: Option<f64>, asked: &TextOptions, ids: &[u32]) -> Result<()> {
        if !self.read_row()? {
            return Err(Error::failed("the file is empty; its first row should be `t,<taxel id>,<taxel id>,...`"));
        }
        let row = self.row.clone();
        let is_named = asked.given().is_some();
        if !is_named && csv_header::is_doubtful(&row) {
            while self.ahead.len() < csv_header::ROWS_BELOW && self.read_row_anew()? {
                self.ahead.push_back((self.row.clone(), self.line));
            }
        }
        let below: Vec<ByteRecord> = self.ahead.iter().map(|(row, _)| row.clone()).collect();
        let header = match is_named {
            true => csv_named::header_of(&row, asked, ids, rate_hz.is_some()),
            false => csv_header::read(&row, &below, rate_hz.is_some()),
        };
        let Header { time, time_at, taxels, left_out, notes } = header?;
        (self.time_at, self.width) = (time_at, left_out.len() + taxels.len() + usize::from(time.is_some()));
        self.time = match (time, rate_hz) {
            (Some(column), _) => Time::Column(column),
            (None, Some(rate)) if rate.is_finite() && rate > 0.0 => Time::Rate(rate),
            (None, rate) => {
                let rate = rate.unwrap_or_default();
                return Err(Error::usage(format!("--rate {rate} is not a frame rate; give a positive number of Hz")));
            }
        };
        (self.taxels, self.left_out) = (taxels, left_out);
        self.notices = notes;
        Ok(())
    }

    /// Reads the next row that is not blank. `false` at the end.
    fn read_row(&mut self) -> Result<bool> {
        if let Some((row, line)) = self.ahead.pop_front() {
            (self.row, self.line) = (row, line);
            return Ok(true);
        }
        self.read_row_anew()
    }

    /// The same from the file.
    fn read_row_anew(&mut self) -> Result<bool> {
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
                self.line = self.line_just_read();
                return Ok(read);
            }
        }
    }

    /// The line number of the row just read; the reader counts blank lines before it as part of the row.
    fn line_just_read(&self) -> u64 {
        let read = self.reader.get_ref();
        self.reader.position().line() - u64::from(!(read.ended && read.last_byte != b'\n'))
    }

    /// The error for the first cell of the current row with an unpaired quote.
    fn stray_quote(&self) -> Option<Error> {
        if !self.row.as_slice().contains(&b'"') {
            return None;
        }
        let (index, cell) = self.row.iter().enumerate().find(|(_, cell)| trimmed(cell).contains(&b'"'))?;
        let before = (0..index).filter(|&index| !self.is_sensor(index)).count();
        let taxel = self.is_sensor(index).then(|| self.taxels.get(index - before)).flatten();
        let place = taxel
            .map_or(format!("column {}", index + 1), |id| format!("column {} (taxel {})", index + 1, Channel(*id)));
        let word = shortened(&String::from_utf8_lossy(cell.trim_ascii()));
        Some(failed!("`{word}` has a quote; numbers have no quotes: remove it").at(place))
    }

    /// Whether the column at `index` is a sensor's.
    fn is_sensor(&self, index: usize) -> bool {
        let is_time = matches!(self.time, Time::Column(_)) && index == self.time_at;
        !is_time && self.left_out.binary_search(&index).is_err()
    }

    fn read_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        while self.read_row()? {
            match self.frame_of_row(frame)? {
                Ok(has_frame) => return Ok(has_frame),
                Err((wrong, error)) => self.skipped.skip("row", wrong, error)?,
            }
            if let Time::Rate(_) = self.time {
                // It was measured, too: those after it keep their times.
                self.frames += 1;
            }
        }
        Ok(false)
    }

    /// Reads the current row; or says what is wrong with it, in short and in full. `false` where it is the last and cut short.
    fn frame_of_row(&mut self, frame: &mut Frame) -> Result<Result<bool, (&'static str, Error)>> {
        let wanted = self.width;
        // Many programs end a row with a comma.
        if self.row.len() > wanted && self.row.iter().skip(wanted).all(|cell| trimmed(cell).is_empty()) {
            self.row.truncate(wanted);
        }
        let (found, line) = (self.row.len(), self.line);
        let at_line = |e: Error| e.at(format!("line {line}"));
        let quote = self.stray_quote();
        if found != wanted {
            // Only the last row may be cut short: the recorder was stopped while writing it.
            if self.read_row()? {
                self.ahead.push_front((std::mem::take(&mut self.row), self.line));
                let ragged =
                    || failed!("{found} values where the header has {wanted} columns; complete or delete the row");
                let wrong = if quote.is_some() { NO_NUMBER } else { "more or fewer values than columns" };
                return Ok(Err((wrong, at_line(quote.unwrap_or_else(ragged)))));
            }
            let how = if found < wanted { "truncated" } else { "too long" };
            self.losses.push(format!("{}: line {line}: last row {how}: {found} of {wanted} values", self.name));
            return Ok(Ok(false));
        }
        if let Some(quote) = quote {
            return Ok(Err((NO_NUMBER, at_line(quote))));
        }
        frame.clear();
        frame.values.resize(self.taxels.len(), RawValue::MISSING);
        frame.t_s = match &mut self.time {
            Time::Column(column) => {
                let word = trimmed(self.row.get(self.time_at).unwrap_or_default());
                match column.read(&String::from_utf8_lossy(word), number(word)) {
                    Ok(t_s) => t_s,
                    Err(e) => return Ok(Err(("no time", at_line(e)))),
                }
            }
            Time::Rate(rate) => self.frames as f64 / *rate,
        };
        let set = |value: &mut RawValue, cell: &[u8], id: &u32| -> Result<()> {
            *value = parse_value(cell).map_err(|e| at_line(e.at(format!("taxel {}", Channel(*id)))))?;
            Ok(())
        };
        let values = frame.values.iter_mut().zip(&self.taxels);
        let first = usize::from(matches!(self.time, Time::Column(_)));
        let read = if self.left_out.is_empty() && self.time_at == 0 {
            values.zip(self.row.iter().skip(first)).try_for_each(|((value, id), cell)| set(value, cell, id))
        } else {
            let cells = self.row.iter().enumerate().filter(|(index, _)| self.is_sensor(*index));
            values.zip(cells).try_for_each(|((value, id), (_, cell))| set(value, cell, id))
        };
        if let Err(e) = read {
            return Ok(Err((NO_NUMBER, e)));
        }
        if let Time::Column(column) = &mut self.time {
            if self.frames == 0
                && let Some(unit) = column.found_out()
            {
                self.notices.push(format!(
                    "column {} is read as times in {}, by the first one",
                    self.time_at + 1,
                    unit.symbol()
                ));
            }
            self.notices.extend(column.doubt());
        }
        self.frames += 1;
        Ok(Ok(true))
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

    fn notices(&mut self) -> Vec<String> {
        self.notices.extend(self.skipped.take_notices());
        self.notices.drain(..).map(|what| format!("{}: {what}", self.name)).collect()
    }

    fn losses(&self) -> Vec<String> {
        let skipped = self.skipped.losses().into_iter().map(|what| format!("{}: {what}", self.name));
        self.losses.iter().cloned().chain(skipped).collect()
    }
}

/// Whether `line` looks like CSV: `t`, numbers and blanks, separated by commas.
pub(super) fn is_csv_row(line: &[u8]) -> bool {
    let is_cell = |cell: &[u8]| matches!(trimmed(cell), b"" | b"t") || number(trimmed(cell)).is_some();
    line.contains(&b',') && line.split(|&byte| byte == b',').all(is_cell)
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
            "`{}` is not a number; leave a missing value blank, and write `nan` for a faulty one",
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

/// A reader that limits the length of rows and knows whether the file ends with a newline.
struct LimitedReader {
    inner: Box<dyn Read + Send>,
    row_bytes: usize,
    last_byte: u8,
    ended: bool,
}

impl Read for LimitedReader {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.row_bytes as u64 > MAX_LINE_BYTES {
            return Err(io::Error::other(format!(
                "a row of over {} MiB: not a CSV, or without ends of lines",
                MAX_LINE_BYTES >> 20
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

    fn skipping(text: &str, rate_hz: Option<f64>) -> CsvSource {
        let options = VendorOptions { rate_hz, skip_bad: true, ..VendorOptions::default() };
        CsvSource::from_reader_for("a.csv", io::Cursor::new(text.as_bytes().to_vec()), None, &options, &[]).unwrap()
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
    fn a_frame_where_the_header_should_be_is_found_out() {
        let usage = |text: &str, rate: Option<f64>| {
            let error = read(text, rate).unwrap_err();
            assert!(error.is_usage(), "{error}");
            error.to_string()
        };
        let frame = "a.csv: row 1 is a frame of";
        for rate in [None, Some(10.0)] {
            assert!(usage("512,300,10,7\n500,310,12,6\n490,311,13,5\n", rate).starts_with(frame));
            assert!(
                usage("0.0,1.5,2\n0.1,1,2\n0.2,1,3\n", rate)
                    .contains("add --grid 1x2, which reads column 1 as the time and 2 sensors")
            );
            assert!(usage("5,5,0,0\n5,5,0,1\n", rate).contains("add --grid 2x2, which reads 4 sensors"));
            assert!(
                usage("5,5,0,walk\n5,5,1,walk\n", rate)
                    .contains("--grid 1x3, which reads 3 sensors and leaves the words")
            );
            assert!(usage("2024-02-29T12:30:15Z,5,6\n", rate).contains("--grid 1x2, which reads column 1 as the time"));
        }
        assert!(usage("0.5,1,2\n", None).contains("give --rate HZ, and add"));
        let eighty_one = vec!["7"; 81].join(",");
        assert!(usage(&format!("{eighty_one}\n{eighty_one}\n"), None).contains("--grid 9x9"));
        // A first row of ids is read as ids, and a notice says so.
        for ids in ["4,7\n", "7,4\n"] {
            let mut source = open(&format!("{ids}1,2\n3,4\n"), Some(20.0)).unwrap();
            let said = source.notices();
            assert!(
                said.len() == 1
                    && said[0].ends_with("is read as the taxels' ids; if it is a frame, --grid 1x2 reads it as one")
            );
            assert_eq!((source.taxels().len(), source.notices().len()), (2, 0));
        }
        assert!(open("t,4,7\n1,2,3\n", None).unwrap().notices().is_empty());
    }

    #[test]
    fn columns_beside_the_sensors_and_commas_at_the_end_of_rows_are_no_values() {
        let mut source = open("t,4,label,7,total\n0,1,walk,2,3\n1,3,,4,7,\n", None).unwrap();
        assert_eq!(source.taxels(), [4, 7]);
        let said = source.notices();
        assert!(said[0].contains("column 3 (`label`) is not a taxel and is left out") && said.len() == 2, "{said:?}");
        let mut frame = Frame::missing(0.0, 2);
        for values in ["[1, 2]", "[3, 4]"] {
            assert!(source.next_frame(&mut frame).unwrap());
            assert_eq!(format!("{:?}", frame.values), values);
        }
        assert!(
            why("t,4,label,7\n0,1,a,x\n1,2,b,3\n", None).starts_with("a.csv: line 2: taxel 7: `x` is not a number")
        );
        assert!(why("t,4,label,7\n0,1,a,2\"\n", None).starts_with("a.csv: line 2: column 4 (taxel 7)"));
    }

    #[test]
    fn columns_are_named_instead_of_found_out() {
        let text = "frame,pressure_0,temperature,pressure_1,timestamp_ms,9\n1,5,20,6,1000,7\n2,7,20,8,1500,9\n";
        let open = |columns: Option<&str>, time: Option<&str>, ids: Option<&str>, rate_hz: Option<f64>| {
            let text_options = TextOptions {
                columns: columns.map(|word| word.parse().unwrap()),
                time: time.map(|word| word.parse().unwrap()),
                ids: ids.map(|word| word.parse().unwrap()),
                ..TextOptions::default()
            };
            let options = VendorOptions { rate_hz, text: text_options, ..VendorOptions::default() };
            CsvSource::from_reader_for("a.csv", io::Cursor::new(text.as_bytes().to_vec()), None, &options, &[12, 4])
        };
        let read = |source: Result<CsvSource>| {
            let mut source = source.unwrap();
            let (mut frame, mut rows) = (Frame::missing(0.0, source.taxels().len()), Vec::new());
            while source.next_frame(&mut frame).unwrap() {
                rows.push(format!("{} {:?}", frame.t_s, frame.values));
            }
            (source.taxels().to_vec(), rows.join("; "), source.notices().join("; "))
        };
        let (taxels, rows, said) = read(open(Some("pressure_*"), Some("timestamp_ms"), None, None));
        assert_eq!((taxels, rows.as_str()), (vec![4, 12], "1 [5, 6]; 1.5 [7, 8]"));
        assert_eq!(
            said,
            "a.csv: 2 of 6 columns are sensors: column 2, column 4; column 5 (`timestamp_ms`) is the time"
        );
        let (taxels, rows, _) = read(open(Some("2-4"), Some("1:s"), Some("7,1,3"), None));
        assert_eq!((taxels, rows.as_str()), (vec![7, 1, 3], "1 [5, 20, 6]; 2 [7, 20, 8]"));
        let (taxels, rows, _) = read(open(Some("6"), None, None, Some(10.0)));
        assert_eq!((taxels, rows.as_str()), (vec![9], "0 [7]; 0.1 [9]"));
        let why = |columns, time, ids, rate| {
            let error = open(columns, time, ids, rate).err().unwrap();
            assert!(error.is_usage(), "{error}");
            error.to_string()
        };
        assert!(
            why(Some("force_*"), Some("5"), None, None)
                .contains("--columns force_*: there is no such column; the header has frame, ")
        );
        assert!(why(None, Some("stamp"), None, None).contains("--time stamp: there is no such column"));
        assert!(why(Some("2-4"), Some("5"), None, None).contains("3 columns are sensors, and the body has 2 taxels; "));
        for (columns, ids, says) in [
            ("2-4", "0", "3 columns are sensors, and --ids has 1 taxel; give each column one id, as 4,4.u,4.v for"),
            ("2", "0,1", "1 column is a sensor, and --ids has 2 taxels; give each column one id"),
        ] {
            let why = why(Some(columns), Some("5"), Some(ids), None);
            assert!(why.contains(says), "{why}");
        }
        assert!(why(Some("2,4"), None, None, None).contains("column 1 is not the time; name the column"));
        assert!(why(Some("2,4"), Some("5"), None, Some(1.0)).contains("give one of them"));
        assert!(why(Some("2,4"), Some("arrival"), None, None).contains("--time arrival is for lines as they come"));
        assert!(why(Some("2,4"), Some("5"), Some("names"), None).contains("called by a number"));
    }

    #[test]
    fn times_are_in_the_unit_of_their_head_or_of_their_size() {
        let times = |text: &str| {
            let mut source = open(text, None).unwrap();
            let mut frame = Frame::missing(0.0, source.taxels().len());
            let mut times = Vec::new();
            while source.next_frame(&mut frame).unwrap() {
                times.push(frame.t_s);
            }
            (times, source.notices().len())
        };
        assert_eq!(times("t [ms],4\n1000,1\n1050,1\n"), (vec![1.0, 1.05], 0));
        assert_eq!(times("millis,4\n1000,1\n1050,1\n"), (vec![1.0, 1.05], 0));
        assert_eq!(times("time,4\n0.5,1\n0.6,1\n"), (vec![0.5, 0.6], 0));
        // A guessed unit is reported.
        assert_eq!(times("t,4\n1768494979568,1\n1768494979584,1\n"), (vec![1_768_494_979.568, 1_768_494_979.584], 1));
        assert_eq!(times("timestamp,4\n1970-01-01T00:00:01Z,1\n1970-01-01T00:00:01.5Z,1\n"), (vec![1.0, 1.5], 1));
        assert_eq!(times("t,4\n1000,1\n1050,1\n1100,1\n"), (vec![1000.0, 1050.0, 1100.0], 1));
        assert!(why("t [min],4\n1,1\n", None).contains("column 1: `t [min]` has no unit"));
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
    fn wrong_rows_are_skipped_on_request_and_counted_by_kind() {
        let text = "t,4,7\n0,1,2\n1,3\n2,x,4\n,5,6\n4,7,8\n5,1,2,3\n6,\"9,9\n7,9,y\n8,9\n";
        assert!(why(text, None).starts_with("a.csv: line 3: 2 values"));
        let mut source = skipping(text, None);
        let mut frame = Frame::missing(0.0, 2);
        let mut times = Vec::new();
        while source.next_frame(&mut frame).unwrap() {
            times.push(frame.t_s);
        }
        assert_eq!(times, [0.0, 4.0]);
        let said = source.notices();
        assert_eq!(said.len(), 3, "{said:?}");
        assert_eq!(
            said[0],
            "a.csv: a row is skipped: line 3: 2 values where the header has 3 columns; complete or delete the row; others like it \
             are counted"
        );
        let losses = source.losses();
        assert_eq!(losses[0], "a.csv: line 10: last row truncated: 2 of 3 values");
        assert!(
            losses[1].starts_with("a.csv: 2 rows skipped, more or fewer values than columns; the first one: line 3")
        );
        assert!(
            losses[2].starts_with(
                "a.csv: 3 rows skipped, a value that is not a number; the first one: line 4: taxel 4: `x`"
            )
        );
        assert_eq!(losses[3], "a.csv: 1 row skipped, no time: line 5: t is blank; every row needs its time");
        // By a rate, frames keep the times at which they were measured.
        let mut source = skipping("4,7\n1,2\n3\n5,6\n", Some(10.0));
        let mut times = Vec::new();
        while source.next_frame(&mut frame).unwrap() {
            times.push(frame.t_s);
        }
        assert_eq!(times, [0.0, 0.2]);
    }

    #[test]
    fn errors_name_line_taxel_and_word() {
        for end in ["\n", "\r\n"] {
            let text = ["t,4,7", "0,1,2", "1,3,abc", "2,5,6", ""].join(end);
            assert!(
                why(&text, None).starts_with("a.csv: line 3: taxel 7: `abc` is not a number"),
                "{}",
                why(&text, None)
            );
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
        let elsewhere = why("0.v,t,0.u,0\n1,2,3,4\n", None);
        assert!(elsewhere.contains("column 2 is headed `t`") && elsewhere.contains("--time 2 says so"), "{elsewhere}");
        assert!(why("t,4,time\n0,1,2\n", None).contains("which is not a taxel id; column 1 has the time already"));
        assert!(why("t,4,04\n", None).contains("taxel 4 heads"));
        assert!(why("t,4,\n", None).contains("column 3 is headed ``"));
        assert!(why("t,palm\n", None).contains("`palm`"));
        assert!(why("t,-1\n", None).contains("`-1`"));
        assert!(why("t,4,t\n", None).contains("column 1 has the time already; remove one of the two"));
        assert!(why("t;4;7\n", None).contains("commas"));
        assert!(why("t,4\r0,1\r", None).contains("newline"));
        assert!(
            why("t,4,a b\n0,1,2\n", None)
                .ends_with("and remove the other columns; if they all are sensors, add --grid 1x2")
        );
        assert!(
            why("File:,a\nUnits:,b\n1,2\n", None)
                .contains("the header is `t,<taxel id>,<taxel id>,...`: head each sensor")
        );
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
            "a.csv: line 11: column 3 (taxel 7): `\"2` has a quote; numbers have no quotes: remove it"
        );
        assert!(why("t,4\n\"0,1\n1,2\n", None).starts_with("a.csv: line 2: column 1: `\"0` has a quote"));
        assert!(why("t,4\n0,1\"\"2\n", None).starts_with("a.csv: line 2: column 2 (taxel 4): `1\"\"2` has a quote"));
        // A comma for the decimal point, as some spreadsheets write it.
        assert!(why("t,4\n0,\"1,5\"\n1,2\n", None).starts_with("a.csv: line 2: column 2 (taxel 4): `\"1` has"));
        assert!(why("t,\"4\n0,1\n", None).contains("column 2 is headed `\"4`, which is not a taxel id; ids have"));
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
        assert!(CsvSource::open("no/such.csv", None).err().unwrap().kind() == crate::error::ErrorKind::NotFound);
        assert!(CsvSource::open(".", None).err().unwrap().to_string().contains("folder"));
    }
}
