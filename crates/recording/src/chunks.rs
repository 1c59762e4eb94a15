//! The chunks of a file, one after the other: whatever lies between them is checked and passed over.

use std::fs::File;
use std::io;
use std::ops::Range;

use super::account::Account;
use super::records::{HEAD, Next, Parts, Record, Records, op};
use super::summary::{ListedChunk, Summary, Trust};
use super::unpack;

/// Why a file is not read.
pub(super) enum Refusal {
    Io(io::Error),
    Wrong(String),
}

impl From<io::Error> for Refusal {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// Reads the chunks of a file, and messages outside of any.
pub(super) struct Chunks {
    pub(super) records: Records<File>,
    pub(super) summary: Summary,
    /// Whether chunks without a checksum are read.
    pub(super) takes_unchecked: bool,
    /// Chunks that end before this are passed over, ns; whether any was.
    pub(super) from_ns: u64,
    pub(super) has_skipped: bool,
    /// Records of other programs.
    pub(super) strange: u64,
    /// Whether the end of the data has been passed.
    is_after_data: bool,
    has_read_chunk: bool,
}

/// What a chunk's record says before its records.
struct ChunkHead<'a> {
    size: u64,
    crc: u32,
    compression: &'a str,
    packed: &'a [u8],
}

impl<'a> ChunkHead<'a> {
    fn read(body: &'a [u8]) -> Option<Self> {
        let mut parts = Parts(body);
        let _times = (parts.u64()?, parts.u64()?);
        let (size, crc, compression, length) = (parts.u64()?, parts.u32()?, parts.text()?, parts.u64()?);
        (length == parts.0.len() as u64).then_some(Self { size, crc, compression, packed: parts.0 })
    }
}

impl Chunks {
    pub(super) fn new(records: Records<File>, summary: Summary) -> Self {
        Self {
            records,
            summary,
            takes_unchecked: false,
            from_ns: 0,
            has_skipped: false,
            strange: 0,
            is_after_data: false,
            has_read_chunk: false,
        }
    }

    /// Reads the next chunk that is whole, or a message outside of any, into `to`; gives where its records are there. `None`
    /// at the end.
    pub(super) fn next(&mut self, to: &mut Vec<u8>, account: &mut Account) -> Result<Option<Range<usize>>, Refusal> {
        loop {
            let start = self.records.at;
            if self.summary.has_end && start >= self.summary.data_end {
                return Ok(None);
            }
            let listed = self.listed_from(start).first().copied();
            let here = listed.filter(|chunk| chunk.at == start);
            // Where something whole comes next, whatever is said here.
            let limit = self.listed_from(start + 1).first().map_or(self.summary.data_end, |chunk| chunk.at);
            let record = match (self.records.next()?, here) {
                (Next::Record(record), Some(chunk)) if record.kind == op::CHUNK && record.end() == chunk.end() => {
                    record
                }
                (_, Some(chunk)) => {
                    // A head that is damaged: the summary has the same, and the chunk its own checksum.
                    account.damaged_from(start, start + HEAD);
                    let record = Record { kind: op::CHUNK, at: start + HEAD, length: chunk.length - HEAD };
                    self.records.go_to(record.at)?;
                    self.records.at = record.end();
                    record
                }
                (Next::Record(record), None) if record.end() <= limit => record,
                (Next::Cut, None) if !self.summary.has_end => {
                    account.cut(self.records.length - start, self.is_after_data);
                    return Ok(None);
                }
                _ => {
                    account.damaged_from(start, limit);
                    self.records.go_to(limit)?;
                    continue;
                }
            };
            if let Some(records) = self.read(record, start, to, account)? {
                return Ok(Some(records));
            }
        }
    }

    /// The chunks that the summary lists from `at` on.
    fn listed_from(&self, at: u64) -> &[ListedChunk] {
        let chunks = &self.summary.chunks;
        &chunks[chunks.partition_point(|chunk| chunk.at < at)..]
    }

    /// Reads `record`, which begins at `start`. `None` where it holds no messages.
    fn read(
        &mut self,
        record: Record,
        start: u64,
        to: &mut Vec<u8>,
        account: &mut Account,
    ) -> Result<Option<Range<usize>>, Refusal> {
        let is_of_summary = matches!(
            record.kind,
            op::SCHEMA
                | op::CHANNEL
                | op::STATISTICS
                | op::CHUNK_INDEX
                | op::ATTACHMENT_INDEX
                | op::METADATA_INDEX
                | op::SUMMARY_OFFSET
                | op::FOOTER
        );
        if self.is_after_data {
            if is_of_summary {
                self.records.skip(record.length)?;
                return Ok(None);
            }
            // What looked like the end of the data was none.
            account.damaged(HEAD);
            self.is_after_data = false;
        }
        match record.kind {
            op::CHUNK => return self.chunk(record, start, to, account),
            op::SCHEMA | op::CHANNEL | op::MESSAGE if !self.has_only_chunks() => {
                if self.records.pass(record)? {
                    // Without a chunk around it, as other programs may write.
                    self.records.go_to(start)?;
                    let whole = Record { at: start, length: record.end() - start, ..record };
                    self.records.body(whole, u64::MAX, to)?;
                    self.records.at = record.end();
                    return Ok(Some(0..to.len()));
                }
                account.damaged_from(start, record.end());
            }
            op::DATA_END
                if record.length == 4 && (!self.summary.is_believed() || record.end() == self.summary.data_end) =>
            {
                self.is_after_data = true;
                self.records.skip(record.length)?;
            }
            kind => {
                let is_allowed = match kind {
                    op::HEADER => start == 8,
                    op::MESSAGE_INDEX | op::ATTACHMENT | op::METADATA | 0x80.. => true,
                    _ => false,
                };
                if self.records.pass(record)? && is_allowed {
                    self.strange += u64::from(kind >= 0x80);
                } else {
                    account.damaged_from(start, record.end());
                }
            }
        }
        Ok(None)
    }

    /// Whether messages lie in chunks: our own always do, and others do not mix.
    fn has_only_chunks(&self) -> bool {
        !self.takes_unchecked && (self.has_read_chunk || !self.summary.chunks.is_empty())
    }

    /// Reads the chunk of `record`, which begins at `start`. `None` where it is passed over.
    fn chunk(
        &mut self,
        record: Record,
        start: u64,
        to: &mut Vec<u8>,
        account: &mut Account,
    ) -> Result<Option<Range<usize>>, Refusal> {
        let listed = self.listed_from(start).first().filter(|chunk| chunk.at == start).copied();
        // The times in its own head have no checksum.
        if listed.is_some_and(|chunk| self.summary.trust == Trust::Checked && chunk.span_ns[1] < self.from_ns) {
            self.has_skipped = true;
            self.records.skip(record.length)?;
            return Ok(None);
        }
        self.records.body(record, u64::MAX, to)?;
        let head = ChunkHead::read(to);
        if let Some(ChunkHead { compression, .. }) = head.as_ref().filter(|it| !unpack::KNOWN.contains(&it.compression))
        {
            let is_damage = match listed {
                Some(chunk) if self.summary.trust == Trust::Checked => chunk.is_known,
                _ => self.has_read_chunk,
            };
            if !is_damage {
                return Err(Refusal::Wrong(format!(
                    "its chunks are compressed by `{}`, which is not read here; write it anew: mcap compress --compression zstd IN \
                     -o OUT",
                    compression.chars().take(10).collect::<String>()
                )));
            }
        }
        let read = head.and_then(|head| self.records_of(&head));
        let Some((size, unpacked)) = read else {
            account.damaged_from(record.at, record.end());
            return Ok(None);
        };
        if let Some(unpacked) = unpacked {
            *to = unpacked;
        }
        self.has_read_chunk = true;
        Ok(Some(to.len() - size..to.len()))
    }

    /// How many bytes the records of a chunk have, and they themselves where they are compressed; `None` where they are damaged.
    fn records_of(&self, head: &ChunkHead<'_>) -> Option<(usize, Option<Vec<u8>>)> {
        let &ChunkHead { size, crc, compression, packed } = head;
        let unpacked = match compression {
            "" => None,
            compression => Some(unpack::unpacked(compression, packed, size)?),
        };
        let records = unpacked.as_deref().unwrap_or(packed);
        // The format lets a checksum be 0 for none; then damage could not be detected, and our own files have one.
        let is_whole = crc == 0 && self.takes_unchecked || crc32fast::hash(records) == crc;
        (records.len() as u64 == size && is_whole).then_some((records.len(), unpacked))
    }
}
