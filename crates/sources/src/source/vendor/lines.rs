//! The lines of a file, in whatever encoding, one at a time.

use std::io::{self, Read};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use encoding_rs::{UTF_16BE, UTF_16LE};
use encoding_rs_io::{DecodeReaderBytes, DecodeReaderBytesBuilder};

use super::super::gzip;
use crate::error::{Error, Result};
use crate::limits::MAX_LINE_BYTES;

/// Bytes that are looked at to tell encoding and format.
pub(super) const HEAD_BYTES: usize = 1 << 16;
const BUFFER_BYTES: usize = 1 << 18;

/// Lines without their ends, as UTF-8 or in the one-byte encoding that the file is in.
pub(super) struct Lines {
    text: DecodeReaderBytes<Counted, Vec<u8>>,
    buffer: Vec<u8>,
    /// What of the buffer is still to be given.
    start: usize,
    end: usize,
    number: u64,
    /// The text has ended.
    ended: bool,
    /// The last line had an end of its own.
    whole: bool,
    read: Arc<AtomicU64>,
    total: Option<u64>,
}

/// A reader that counts its bytes.
struct Counted {
    inner: Box<dyn Read + Send>,
    read: Arc<AtomicU64>,
}

impl Read for Counted {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.inner.read(buffer)?;
        self.read.fetch_add(read as u64, Ordering::Relaxed);
        Ok(read)
    }
}

impl Lines {
    /// The lines of the file at `path`.
    pub(super) fn open(path: &Path) -> Result<Self> {
        let (text, total) = gzip::open(path).map_err(|e| Error::io(path, &e))?;
        Self::new(text, total).map_err(|e| e.at(path.display()))
    }

    /// The lines of what `reader` gives, which is `total` bytes long if that is known.
    pub(super) fn new(mut reader: Box<dyn Read + Send>, total: Option<u64>) -> Result<Self> {
        let mut head = Vec::new();
        reader.by_ref().take(4).read_to_end(&mut head).map_err(|e| failed_to_read(&e))?;
        // Without a mark at its beginning, UTF-16 is known by the zeros in what a table begins with.
        let encoding = match head[..] {
            [0xFF, 0xFE, ..] | [0xFE, 0xFF, ..] => None,
            [first, 0, second, 0] if first != 0 && second != 0 => Some(UTF_16LE),
            [0, first, 0, second] if first != 0 && second != 0 => Some(UTF_16BE),
            _ => None,
        };
        let read = Arc::new(AtomicU64::new(0));
        let inner: Box<dyn Read + Send> = Box::new(io::Cursor::new(head).chain(reader));
        let counted = Counted { inner, read: Arc::clone(&read) };
        let text = DecodeReaderBytesBuilder::new()
            .encoding(encoding)
            .bom_override(true)
            .strip_bom(true)
            .build_with_buffer(counted, vec![0; 1 << 16]);
        let text = text.map_err(|e| failed_to_read(&e))?;
        Ok(Self {
            text,
            buffer: vec![0; BUFFER_BYTES],
            start: 0,
            end: 0,
            number: 0,
            ended: false,
            whole: true,
            read,
            total,
        })
    }

    /// The first bytes of the text; they stay to be read.
    pub(super) fn head(&mut self) -> Result<&[u8]> {
        while self.end < HEAD_BYTES && !self.ended {
            self.fill()?;
        }
        Ok(&self.buffer[self.start..self.end])
    }

    /// The next line. `None` at the end.
    pub(super) fn next(&mut self) -> Result<Option<&[u8]>> {
        let mut searched = 0;
        loop {
            let rest = &self.buffer[self.start + searched..self.end];
            if let Some(at) = memchr::memchr(b'\n', rest) {
                let (start, stop) = (self.start, self.start + searched + at);
                self.start = stop + 1;
                self.number += 1;
                return Ok(Some(without_return(&self.buffer[start..stop])));
            }
            searched = self.end - self.start;
            if self.ended {
                if searched == 0 {
                    return Ok(None);
                }
                self.number += 1;
                self.whole = false;
                let start = std::mem::replace(&mut self.start, self.end);
                return Ok(Some(without_return(&self.buffer[start..self.end])));
            }
            if searched as u64 > MAX_LINE_BYTES {
                return Err(Error::failed(format!(
                    "a line of over {} MiB: not a table, or without ends of lines",
                    MAX_LINE_BYTES >> 20
                )));
            }
            self.fill()?;
        }
    }

    /// Whether nothing but blank lines follows.
    pub(super) fn is_at_end(&mut self) -> Result<bool> {
        loop {
            if !self.buffer[self.start..self.end].iter().all(u8::is_ascii_whitespace) {
                return Ok(false);
            }
            if self.ended {
                return Ok(true);
            }
            self.fill()?;
        }
    }

    /// The number of the last line given, from 1.
    pub(super) fn number(&self) -> u64 {
        self.number
    }

    /// Whether the last line given had an end, rather than ending with the file.
    pub(super) fn is_whole(&self) -> bool {
        self.whole
    }

    /// The share of the file that has been read, if its length is known.
    pub(super) fn progress(&self) -> Option<f64> {
        let total = self.total.filter(|&total| total > 0)?;
        Some((self.read.load(Ordering::Relaxed) as f64 / total as f64).min(1.0))
    }

    /// Reads on.
    fn fill(&mut self) -> Result<()> {
        if self.start > 0 {
            self.buffer.copy_within(self.start..self.end, 0);
            (self.start, self.end) = (0, self.end - self.start);
        }
        if self.end == self.buffer.len() {
            self.buffer.resize(2 * self.buffer.len(), 0);
        }
        let read = self.text.read(&mut self.buffer[self.end..]).map_err(|e| failed_to_read(&e))?;
        self.end += read;
        self.ended = read == 0;
        Ok(())
    }
}

fn failed_to_read(error: &io::Error) -> Error {
    match error.kind() {
        io::ErrorKind::IsADirectory => Error::failed("this is a folder; name a file"),
        _ => Error::failed(error.to_string()),
    }
}

fn without_return(line: &[u8]) -> &[u8] {
    line.strip_suffix(b"\r").unwrap_or(line)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(bytes: Vec<u8>) -> Vec<String> {
        let mut lines = Lines::new(Box::new(io::Cursor::new(bytes)), None).unwrap();
        let mut all = Vec::new();
        while let Some(line) = lines.next().unwrap() {
            all.push(super::super::text::decoded(line).into_owned());
        }
        assert_eq!(lines.number(), all.len() as u64);
        all
    }

    #[test]
    fn lines_are_the_same_in_every_encoding() {
        let text = "File: a\r\ncm², 1\n\nlast";
        let right = ["File: a", "cm², 1", "", "last"];
        let utf_16 = |bytes: fn(u16) -> [u8; 2]| -> Vec<u8> { text.encode_utf16().flat_map(bytes).collect() };
        let with = |mark: &[u8], bytes: Vec<u8>| [mark, &bytes[..]].concat();
        let latin_1: Vec<u8> = text.chars().map(|c| c as u8).collect();
        for bytes in [
            text.as_bytes().to_vec(),
            with(b"\xEF\xBB\xBF", text.as_bytes().to_vec()),
            utf_16(u16::to_le_bytes),
            utf_16(u16::to_be_bytes),
            with(b"\xFF\xFE", utf_16(u16::to_le_bytes)),
            with(b"\xFE\xFF", utf_16(u16::to_be_bytes)),
            latin_1,
        ] {
            assert_eq!(lines(bytes.clone()), right, "{bytes:?}");
        }
        assert_eq!(lines(Vec::new()), [""; 0]);
    }

    #[test]
    fn a_line_is_whole_whatever_the_buffer_holds() {
        let long = "x".repeat(3 * BUFFER_BYTES);
        let text = format!("{long}\n{long}\n1\n");
        assert_eq!(lines(text.into_bytes()), [long.as_str(), long.as_str(), "1"]);
    }

    #[test]
    fn the_head_is_not_taken_and_the_end_is_seen() {
        let mut lines = Lines::new(Box::new(io::Cursor::new(b"a\nb\n\n \n".to_vec())), Some(7)).unwrap();
        assert_eq!(lines.head().unwrap(), b"a\nb\n\n \n");
        assert_eq!(lines.next().unwrap().unwrap(), b"a");
        assert!(!lines.is_at_end().unwrap());
        assert_eq!(lines.next().unwrap().unwrap(), b"b");
        assert!(lines.is_at_end().unwrap() && lines.is_whole());
        assert_eq!(lines.progress(), Some(1.0));
    }
}
