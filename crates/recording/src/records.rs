//! A file of records, one after the other: the framing of MCAP, read so that damage is found and memory is bounded.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};

pub(super) use mcap::records::op;

use super::unpack;

/// What begins and ends a file.
const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
/// A record's kind and length.
pub(super) const HEAD: u64 = 9;
/// The footer's record, and magic.
const END: u64 = HEAD + FOOTER + 8;
/// The footer's body.
const FOOTER: u64 = 20;

/// Bytes of a record that tell whether it is what its kind says; names are shorter.
const PROBED: u64 = 4096;

/// A record whose body is still to be read, or passed over.
#[derive(Clone, Copy, Debug)]
pub(super) struct Record {
    pub(super) kind: u8,
    /// Where its body begins, and how long that is.
    pub(super) at: u64,
    pub(super) length: u64,
}

impl Record {
    /// Where the next record begins.
    pub(super) fn end(&self) -> u64 {
        self.at + self.length
    }
}

/// What comes next.
pub(super) enum Next {
    Record(Record),
    /// The file ends here, before its end was written.
    Cut,
    /// From here on nothing makes sense.
    Damaged,
}

/// The end of a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Footer {
    /// Where its record begins.
    pub(super) at: u64,
    /// Where the summary begins, and its offsets; 0 where there are none.
    pub(super) summary: u64,
    pub(super) offsets: u64,
    /// The checksum of the summary and of the footer up to here; 0 where there is none.
    pub(super) crc: u32,
}

impl Footer {
    /// Where the bytes end that its checksum is of.
    pub(super) fn checked_end(&self) -> u64 {
        self.at + HEAD + 16
    }
}

pub(super) struct Records<R> {
    file: BufReader<R>,
    pub(super) length: u64,
    /// Where the next record begins.
    pub(super) at: u64,
}

impl Records<File> {
    /// The file's records; what it begins with where that is not as MCAP does.
    pub(super) fn from_file(file: File) -> io::Result<Result<Self, Vec<u8>>> {
        let length = file.metadata()?.len();
        Self::new(file, length)
    }
}

impl<R: Read + Seek> Records<R> {
    pub(super) fn new(file: R, length: u64) -> io::Result<Result<Self, Vec<u8>>> {
        let mut file = BufReader::with_capacity(1 << 16, file);
        let mut first = Vec::new();
        (&mut file).take(16).read_to_end(&mut first)?;
        if !first.starts_with(&MAGIC) {
            return Ok(Err(first));
        }
        let mut records = Self { file, length, at: 8 };
        records.go_to(8)?;
        Ok(Ok(records))
    }

    pub(super) fn next(&mut self) -> io::Result<Next> {
        let left = self.length.saturating_sub(self.at);
        if left < HEAD {
            return Ok(Next::Cut);
        }
        let mut head = [0; HEAD as usize];
        self.file.read_exact(&mut head)?;
        let length = u64::from_le_bytes(head[1..].try_into().expect("eight bytes"));
        if length > left - HEAD {
            // Damage makes lengths of any size; what was cut has the length of a record.
            return Ok(if length < 1 << 32 { Next::Cut } else { Next::Damaged });
        }
        let record = Record { kind: head[0], at: self.at + HEAD, length };
        self.at = record.end();
        Ok(Next::Record(record))
    }

    /// Reads up to `most` bytes of the body of `record`, which was next, and passes over the rest.
    pub(super) fn body(&mut self, record: Record, most: u64, to: &mut Vec<u8>) -> io::Result<()> {
        let wanted = record.length.min(most);
        to.clear();
        (&mut self.file).take(wanted).read_to_end(to)?;
        if to.len() as u64 != wanted {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        self.skip(record.length - wanted)
    }

    /// Passes over the body of `record`, which was next. `false` where it is not what its kind says.
    pub(super) fn pass(&mut self, record: Record) -> io::Result<bool> {
        let mut beginning = Vec::new();
        self.body(record, PROBED, &mut beginning)?;
        Ok(is_plausible(record, &beginning))
    }

    /// Passes over `count` bytes.
    pub(super) fn skip(&mut self, count: u64) -> io::Result<()> {
        self.file.seek_relative(i64::try_from(count).map_err(io::Error::other)?)
    }

    /// Goes on with the record at `at`.
    pub(super) fn go_to(&mut self, at: u64) -> io::Result<()> {
        // What has been read ahead stays, where it can: a step back to the head of a record is a short one.
        let now = self.file.stream_position()?;
        match i64::try_from(i128::from(at) - i128::from(now)) {
            Ok(step) => self.file.seek_relative(step)?,
            Err(_) => self.file.seek(SeekFrom::Start(at)).map(drop)?,
        }
        self.at = at;
        Ok(())
    }

    /// The bytes from `from` up to `to`, as many of them as there are; then goes on where it was.
    pub(super) fn bytes(&mut self, from: u64, to: u64) -> io::Result<Vec<u8>> {
        let back = self.at;
        let mut bytes = Vec::new();
        self.go_to(from)?;
        (&mut self.file).take(to.saturating_sub(from)).read_to_end(&mut bytes)?;
        self.go_to(back)?;
        Ok(bytes)
    }

    /// Whether a chunk's record begins at `at` that has `length` bytes with its head.
    pub(super) fn has_chunk(&mut self, at: u64, length: u64) -> io::Result<bool> {
        let bytes = self.bytes(at, at.saturating_add(HEAD))?;
        let Some((&kind, rest)) = bytes.split_first() else { return Ok(false) };
        let stated = rest.try_into().map(u64::from_le_bytes);
        Ok(kind == op::CHUNK && length >= HEAD && stated.is_ok_and(|stated| stated == length - HEAD))
    }

    /// The end of the file; `None` where it has none.
    pub(super) fn footer(&mut self) -> io::Result<Option<Footer>> {
        let Some(at) = self.length.checked_sub(END).filter(|&at| at >= 8) else { return Ok(None) };
        let bytes = self.bytes(at, self.length)?;
        let mut parts = Parts(&bytes);
        let read = (|| {
            let (kind, length) = (parts.bytes(1)?[0], parts.u64()?);
            let footer = Footer { at, summary: parts.u64()?, offsets: parts.u64()?, crc: parts.u32()? };
            (kind == op::FOOTER && length == FOOTER && parts.0 == MAGIC).then_some(footer)
        })();
        Ok(read)
    }
}

/// Whether `beginning`, the first bytes of `record`, has the parts of its kind, and these fit its length.
fn is_plausible(record: Record, beginning: &[u8]) -> bool {
    let mut parts = Parts(beginning);
    let rest = |parts: &Parts<'_>| record.length - (beginning.len() - parts.0.len()) as u64;
    let fits = (|| {
        Some(match record.kind {
            op::HEADER => {
                let _names = (parts.text()?, parts.text()?);
                rest(&parts) == 0
            }
            op::SCHEMA => {
                let _names = (parts.u16()?, parts.text()?, parts.text()?);
                u64::from(parts.u32()?) == rest(&parts)
            }
            op::CHANNEL => {
                let _names = (parts.u16()?, parts.u16()?, parts.text()?, parts.text()?);
                u64::from(parts.u32()?) == rest(&parts)
            }
            op::MESSAGE => record.length >= 22,
            op::CHUNK => {
                let _sizes = (parts.u64()?, parts.u64()?, parts.u64()?, parts.u32()?);
                unpack::KNOWN.contains(&parts.text()?) && parts.u64()? == rest(&parts)
            }
            op::MESSAGE_INDEX => {
                let (_, bytes) = (parts.u16()?, parts.u32()?);
                bytes.is_multiple_of(16) && u64::from(bytes) == rest(&parts)
            }
            op::ATTACHMENT => {
                let _names = (parts.u64()?, parts.u64()?, parts.text()?, parts.text()?);
                parts.u64()?.checked_add(4) == Some(rest(&parts))
            }
            op::METADATA => {
                parts.text()?;
                u64::from(parts.u32()?) == rest(&parts)
            }
            op::DATA_END => record.length == 4,
            // One of another program, if it is not a chunk whose kind is damaged.
            0x80.. => !is_plausible(Record { kind: op::CHUNK, ..record }, beginning),
            _ => false,
        })
    })();
    fits.unwrap_or(false)
}

/// Takes bytes off the front of a record's body.
pub(super) struct Parts<'a>(pub(super) &'a [u8]);

impl<'a> Parts<'a> {
    pub(super) fn bytes(&mut self, count: u64) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(usize::try_from(count).ok()?)?;
        self.0 = rest;
        Some(taken)
    }

    pub(super) fn u16(&mut self) -> Option<u16> {
        Some(u16::from_le_bytes(self.bytes(2)?.try_into().ok()?))
    }

    pub(super) fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.bytes(4)?.try_into().ok()?))
    }

    pub(super) fn u64(&mut self) -> Option<u64> {
        Some(u64::from_le_bytes(self.bytes(8)?.try_into().ok()?))
    }

    pub(super) fn text(&mut self) -> Option<&'a str> {
        let count = self.u32()?;
        std::str::from_utf8(self.bytes(count.into())?).ok()
    }

    /// A map of as many bytes as come first.
    pub(super) fn map(&mut self) -> Option<Parts<'a>> {
        let count = self.u32()?;
        Some(Parts(self.bytes(count.into())?))
    }

    /// A record within a chunk: its kind and its body.
    pub(super) fn record(&mut self) -> Option<(u8, &'a [u8])> {
        let kind = self.bytes(1)?[0];
        let length = self.u64()?;
        Some((kind, self.bytes(length)?))
    }
}
