//! Writes frames as a CSV recording.

use std::fmt::Write as _;
use std::io::{BufWriter, Write as _};

use crate::error::{Error, Result};
use crate::output::{OutputFile, OutputPath};
use crate::signal::{Channel, Frame, RawValue};

/// Writes a CSV recording; the file appears when it is finished.
pub struct CsvFile {
    file: BufWriter<OutputFile>,
    line: String,
}

impl CsvFile {
    /// Begins a recording of the taxels `ids` at `output`.
    ///
    /// # Errors
    /// No file can be made.
    pub fn create(output: OutputPath, ids: &[u32]) -> Result<Self> {
        let file = BufWriter::with_capacity(1 << 16, output.begin()?);
        let mut file = Self { file, line: "t".to_owned() };
        for id in ids {
            let _ = write!(file.line, ",{}", Channel(*id));
        }
        file.write_line()?;
        Ok(file)
    }

    /// Writes a frame without its poses.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn frame(&mut self, frame: &Frame) -> Result<()> {
        let _ = write!(self.line, "{}", frame.time());
        for &value in &frame.values {
            self.line.push(',');
            put_value(value, &mut self.line);
        }
        self.write_line()
    }

    /// Moves the finished file into place.
    ///
    /// # Errors
    /// It cannot be written, or another file has been created there meanwhile.
    pub fn finish(self) -> Result<()> {
        let name = self.file.get_ref().name().to_owned();
        self.file.into_inner().map_err(|e| Error::io(name, e.error()))?.finish()
    }

    /// Ends it before all is there: on standard output with what has been written, else without a file, whose name is given.
    ///
    /// # Errors
    /// As [`CsvFile::finish`].
    pub fn finish_early(self) -> Result<Option<String>> {
        let name = self.file.get_ref().name().to_owned();
        let file = self.file.into_inner().map_err(|e| Error::io(&name, e.error()))?;
        Ok(file.appears_when_finished().then(|| name.display().to_string()))
    }

    fn write_line(&mut self) -> Result<()> {
        self.line.push('\n');
        let written = self.file.write_all(self.line.as_bytes());
        self.line.clear();
        written.map_err(|e| Error::io(self.file.get_ref().name(), &e))
    }
}

/// Appends the shortest number that reads back as the same f32; nothing for a missing value, `nan` for a faulty one.
pub(super) fn put_value(value: RawValue, to: &mut String) {
    let _ = match value.number() {
        Some(number) => write!(to, "{}", number as f32),
        None if value.is_missing() => Ok(()),
        None => write!(to, "nan"),
    };
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::signal::FrameTime;
    use crate::source::{CsvSource, Source as _};

    proptest! {
        #[test]
        fn what_is_written_reads_back_bit_for_bit(t_s in -9e11..9e11_f64, values in prop::collection::vec(any::<f32>(), 1..40)) {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("a.csv");
            let ids: Vec<u32> = (0..values.len() as u32).collect();
            let mut values: Vec<RawValue> = values.into_iter().map(|value| RawValue::new(value.into())).collect();
            values[0] = RawValue::MISSING;
            let frame = Frame { t_s, values, ..Frame::default() };
            let mut file = CsvFile::create(OutputPath::new(&path, false, &[]).unwrap(), &ids).unwrap();
            file.frame(&frame).unwrap();
            file.finish().unwrap();
            let mut back = Frame::missing(0.0, ids.len());
            prop_assert!(CsvSource::open(&path, None).unwrap().next_frame(&mut back).unwrap());
            prop_assert_eq!(back.t_s.to_bits(), t_s.to_bits());
            prop_assert_eq!(back.values, frame.values);
        }

        #[test]
        fn a_time_to_the_nanosecond_reads_back_as_the_double_next_to_it(ns in -9_000_000_000_000_000_000..9_000_000_000_000_000_000_i64) {
            let time = FrameTime::from_ns(ns);
            let text = time.to_string();
            prop_assert!((text.parse::<f64>().unwrap() - time.s).abs() <= f64::EPSILON * time.s.abs(), "{}", text);
            if time.rest_ns != 0 {
                prop_assert_eq!(text.replace('.', "").parse::<i64>().unwrap(), ns);
            }
        }
    }
}
