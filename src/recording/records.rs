//! A file of records, one after the other: the framing of MCAP, read so that damage is found and memory is bounded.

use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};

pub(super) use mcap::records::op;

/// What begins and ends a file.
const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
/// A record's kind and length.
const HEAD: u64 = 9;
/// Magic, and the footer's record.
const END: u64 = HEAD + 20 + 8;

/// Bytes of a record that says a word or two; a longer one is damaged.
pub(super) const MAX_RECORD_BYTES: u64 = 1 << 16;

/// A record whose body is still to be read, or passed over.
#[derive(Clone, Copy, Debug)]
pub(super) struct Record {
    pub(super) kind: u8,
    /// Where its body begins, and how long that is.
    pub(super) at: u64,
    pub(super) length: u64,
}

/// What comes next.
pub(super) enum Next {
    Record(Record),
    /// The file ends here, before its end was written.
    Cut,
    /// From here on nothing makes sense.
    Damaged,
}

pub(super) struct Records<R> {
    file: BufReader<R>,
    pub(super) length: u64,
    /// Where the next record begins.
    pub(super) at: u64,
}

impl Records<File> {
    /// The file's records; `None` where it does not begin as MCAP does.
    pub(super) fn of(file: File) -> io::Result<Option<Self>> {
        let length = file.metadata()?.len();
        Self::new(file, length)
    }
}

impl<R: Read + Seek> Records<R> {
    pub(super) fn new(file: R, length: u64) -> io::Result<Option<Self>> {
        let mut file = BufReader::with_capacity(1 << 16, file);
        let mut magic = [0; 8];
        if length < 8 {
            return Ok(None);
        }
        file.read_exact(&mut magic)?;
        Ok((magic == MAGIC).then_some(Self { file, length, at: 8 }))
    }

    pub(super) fn next(&mut self) -> io::Result<Next> {
        let left = self.length.saturating_sub(self.at);
        if left < HEAD {
            return Ok(Next::Cut);
        }
        let mut head = [0; HEAD as usize];
        self.file.read_exact(&mut head)?;
        let kind = head[0];
        let length = u64::from_le_bytes(head[1..].try_into().expect("eight bytes"));
        if !matches!(kind, 0x01..=0x0F | 0x80..) {
            return Ok(Next::Damaged);
        }
        if length > left - HEAD {
            // Damage makes lengths of any size; what was cut has the length of a record.
            return Ok(if length < 1 << 32 { Next::Cut } else { Next::Damaged });
        }
        let record = Record { kind, at: self.at + HEAD, length };
        self.at = record.at + length;
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

    /// Whether the file has its end.
    pub(super) fn has_end(&mut self) -> io::Result<bool> {
        self.summary_start().map(|start| start.is_some())
    }

    /// Where the summary begins, which is 0 where there is none; `None` where the file has no end.
    fn summary_start(&mut self) -> io::Result<Option<u64>> {
        let Some(end) = self.length.checked_sub(END).filter(|&end| end >= 8) else { return Ok(None) };
        let back = self.at;
        let mut bytes = [0; END as usize];
        self.file.seek(SeekFrom::Start(end))?;
        self.file.read_exact(&mut bytes)?;
        self.go_to(back)?;
        let start = u64::from_le_bytes(bytes[9..17].try_into().expect("eight bytes"));
        Ok((bytes[0] == op::FOOTER && bytes[END as usize - 8..] == MAGIC).then_some(start))
    }

    /// The summary's records of these kinds: the kind of each, and its body.
    pub(super) fn in_summary(&mut self, kinds: &[u8]) -> io::Result<Vec<(u8, Vec<u8>)>> {
        let back = self.at;
        let mut bodies = Vec::new();
        if let Some(start) = self.summary_start()?.filter(|&start| start > 0 && start < self.length) {
            self.go_to(start)?;
            while let Next::Record(record) = self.next()? {
                if kinds.contains(&record.kind) {
                    let mut body = Vec::new();
                    self.body(record, MAX_RECORD_BYTES, &mut body)?;
                    bodies.push((record.kind, body));
                } else {
                    self.skip(record.length)?;
                }
            }
        }
        self.go_to(back)?;
        Ok(bodies)
    }

    /// Goes to the first chunk after `at` that the file's own index knows; `false` where there is none.
    pub(super) fn resume_after(&mut self, at: u64) -> io::Result<bool> {
        let Some(start) = self.summary_start()?.filter(|&start| start > at && start < self.length) else {
            return Ok(false);
        };
        self.go_to(start)?;
        let mut found: Option<u64> = None;
        let mut body = Vec::new();
        while let Next::Record(record) = self.next()? {
            if record.kind == op::CHUNK_INDEX {
                self.body(record, 24, &mut body)?;
                let chunk = body.get(16..24).map(|bytes| u64::from_le_bytes(bytes.try_into().expect("eight bytes")));
                if let Some(chunk) = chunk.filter(|&chunk| chunk > at && chunk < start) {
                    found = Some(found.map_or(chunk, |known| known.min(chunk)));
                }
            } else {
                self.skip(record.length)?;
            }
        }
        if let Some(chunk) = found {
            self.go_to(chunk)?;
        }
        Ok(found.is_some())
    }
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

    /// A record within a chunk: its kind and its body.
    pub(super) fn record(&mut self) -> Option<(u8, &'a [u8])> {
        let kind = self.bytes(1)?[0];
        let length = self.u64()?;
        Some((kind, self.bytes(length)?))
    }
}
