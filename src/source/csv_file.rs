//! Frames written as a recording in CSV.

use std::fmt::Write as _;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::{Error, Result};
use crate::signal::{Frame, RawValue};
use crate::whole::beside;

/// A recording in CSV being written: there once it is finished, and not before.
pub struct CsvFile {
    path: PathBuf,
    file: BufWriter<NamedTempFile>,
    line: String,
    replace: bool,
}

impl CsvFile {
    /// Begins a recording of the taxels `ids` at `path`, where a file is replaced only with `replace`.
    ///
    /// # Errors
    /// A file is there, or none can be made.
    pub fn create(path: impl AsRef<Path>, ids: &[u32], replace: bool) -> Result<Self> {
        let path = path.as_ref();
        if path.exists() && !replace {
            return Err(there_already(path));
        }
        let file = BufWriter::with_capacity(1 << 16, beside(path)?);
        let mut file = Self { path: path.to_owned(), file, line: "t".to_owned(), replace };
        for id in ids {
            let _ = write!(file.line, ",{id}");
        }
        file.write_line()?;
        Ok(file)
    }

    /// Adds a frame; its poses have no place here.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn frame(&mut self, frame: &Frame) -> Result<()> {
        let _ = write!(self.line, "{}", frame.t_s);
        for &value in &frame.values {
            self.line.push(',');
            put_value(value, &mut self.line);
        }
        self.write_line()
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// It cannot be written, or one came up there meanwhile.
    pub fn finish(self) -> Result<()> {
        let Self { path, file, replace, .. } = self;
        let file = file.into_inner().map_err(|e| Error::io(&path, e.error()))?;
        let kept = if replace { file.persist(&path) } else { file.persist_noclobber(&path) };
        kept.map(drop).map_err(|e| match e.error.kind() {
            std::io::ErrorKind::AlreadyExists => there_already(&path),
            _ => Error::io(&path, &e.error),
        })
    }

    fn write_line(&mut self) -> Result<()> {
        self.line.push('\n');
        let written = self.file.write_all(self.line.as_bytes());
        self.line.clear();
        written.map_err(|e| Error::io(&self.path, &e))
    }
}

fn there_already(path: &Path) -> Error {
    Error::failed("it is there already; choose another name, or say --force").at(path.display())
}

/// Appends the shortest word that reads back as the same single-precision value; missing is none, faulty `nan`.
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
    use crate::source::{CsvSource, Source as _};

    proptest! {
        #[test]
        fn what_is_written_reads_back_bit_for_bit(t_s in -1e12..1e12_f64, values in prop::collection::vec(any::<f32>(), 1..40)) {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("a.csv");
            let ids: Vec<u32> = (0..values.len() as u32).collect();
            let mut values: Vec<RawValue> = values.into_iter().map(|value| RawValue::new(value.into())).collect();
            values[0] = RawValue::MISSING;
            let frame = Frame { t_s, values, pose: Vec::new() };
            let mut file = CsvFile::create(&path, &ids, false).unwrap();
            file.frame(&frame).unwrap();
            file.finish().unwrap();
            let mut back = Frame::missing(0.0, ids.len());
            prop_assert!(CsvSource::open(&path, None).unwrap().next_frame(&mut back).unwrap());
            prop_assert_eq!(back.t_s.to_bits(), t_s.to_bits());
            prop_assert_eq!(back.values, frame.values);
        }
    }

    #[test]
    fn a_file_that_is_there_stays_unless_told_otherwise() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        std::fs::write(&path, "mine").unwrap();
        assert!(CsvFile::create(&path, &[1], false).err().unwrap().to_string().contains("--force"));
        drop(CsvFile::create(&path, &[1], true).unwrap());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "mine", "not finished, not replaced");
        CsvFile::create(&path, &[1], true).unwrap().finish().unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "t,1\n");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
