//! The summary at the end of a file: what it lists, and whether that can be believed.

use std::collections::HashMap;
use std::io::{self, Read, Seek};

use super::entries::{Attached, Channel, Schema, channel, schema};
use super::records::{Footer, HEAD, Parts, Records, op};
use super::unpack;
use crate::limits::MAX_CHUNK_BYTES;

/// Bytes of a record that says where a group of the summary begins, and how many groups there are at most.
const OFFSET_BYTES: u64 = HEAD + 17;
const MAX_GROUPS: u64 = 16;

/// How far a summary can be believed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trust {
    /// There is none.
    Absent,
    /// It is damaged, and nothing of it is used.
    Damaged,
    /// It has no checksum.
    Unchecked,
    /// Its checksum is right.
    Checked,
}

/// A chunk, as the summary lists it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ListedChunk {
    /// Where its record begins, and how long that is with its head.
    pub(super) at: u64,
    pub(super) length: u64,
    /// The times of its first and last message, ns.
    pub(super) span_ns: [u64; 2],
    /// Whether its compression is one that is read.
    pub(super) is_known: bool,
}

impl ListedChunk {
    pub(super) fn end(&self) -> u64 {
        self.at.saturating_add(self.length)
    }
}

/// What the summary counts.
#[derive(Clone, Debug, Default)]
pub(super) struct Statistics {
    pub(super) attachments: u32,
    /// Messages by channel.
    pub(super) messages: HashMap<u16, u64>,
}

/// The summary of a file.
#[derive(Clone, Debug)]
pub(super) struct Summary {
    pub(super) trust: Trust,
    /// Whether the file has its end.
    pub(super) has_end: bool,
    /// Where the data end: where the summary begins, or the footer, or the file ends.
    pub(super) data_end: u64,
    /// Its chunks, one after the other, where they are.
    pub(super) chunks: Vec<ListedChunk>,
    /// How many it lists that are not there, and from when to when these are, ns.
    pub(super) gone: usize,
    pub(super) gone_ns: Option<[u64; 2]>,
    /// How many bytes were put in before it, or cut out.
    pub(super) shift: i64,
    pub(super) statistics: Option<Statistics>,
    pub(super) channels: HashMap<u16, Channel>,
    pub(super) schemas: HashMap<u16, Schema>,
    /// All attachments, if it lists them all.
    pub(super) attached: Option<Vec<Attached>>,
}

impl Summary {
    /// Reads that of the file of `records`.
    pub(super) fn read<R: Read + Seek>(records: &mut Records<R>) -> io::Result<Self> {
        let footer = records.footer()?;
        let mut summary = Self {
            trust: Trust::Absent,
            has_end: footer.is_some(),
            data_end: footer.map_or(records.length, |footer| footer.at),
            chunks: Vec::new(),
            gone: 0,
            gone_ns: None,
            shift: 0,
            statistics: None,
            channels: HashMap::new(),
            schemas: HashMap::new(),
            attached: None,
        };
        let Some(footer) = footer.filter(|footer| footer.summary != 0) else { return Ok(summary) };
        summary.trust = Trust::Damaged;
        let Some((start, bytes)) = find(records, &footer)? else { return Ok(summary) };
        let Some(read) = Listed::read(&bytes) else { return Ok(summary) };
        summary.trust = if footer.crc == 0 { Trust::Unchecked } else { Trust::Checked };
        summary.data_end = start;
        summary.shift = start as i64 - footer.summary as i64;
        summary.attached = read.attached.filter(|_| summary.trust == Trust::Checked && summary.shift == 0);
        (summary.statistics, summary.channels, summary.schemas) = (read.statistics, read.channels, read.schemas);
        summary.place(records, read.chunks)?;
        Ok(summary)
    }

    /// Whether anything of it is used.
    pub(super) fn is_believed(&self) -> bool {
        matches!(self.trust, Trust::Unchecked | Trust::Checked)
    }

    /// Takes those of `chunks` that are there.
    fn place<R: Read + Seek>(&mut self, records: &mut Records<R>, mut chunks: Vec<ListedChunk>) -> io::Result<()> {
        chunks.sort_unstable_by_key(|chunk| chunk.at);
        let mut end = 8;
        for listed in chunks {
            let mut found = Some(listed);
            if self.trust != Trust::Checked || self.shift != 0 {
                let moved = ListedChunk { at: listed.at.saturating_add_signed(self.shift), ..listed };
                found = None;
                for chunk in [listed, moved] {
                    if found.is_none() && chunk.at >= end && records.has_chunk(chunk.at, chunk.length)? {
                        found = Some(chunk);
                    }
                }
            }
            // Each byte is in one chunk: so reading takes no longer than the file is.
            match found.filter(|chunk| chunk.at >= end && chunk.length > HEAD && chunk.end() <= self.data_end) {
                Some(chunk) => {
                    end = chunk.end();
                    self.chunks.push(chunk);
                }
                None => {
                    self.gone += 1;
                    let [first, last] = self.gone_ns.unwrap_or(listed.span_ns);
                    self.gone_ns = Some([first.min(listed.span_ns[0]), last.max(listed.span_ns[1])]);
                }
            }
        }
        Ok(())
    }
}

/// Where the summary begins, and its bytes, if they are whole.
fn find<R: Read + Seek>(records: &mut Records<R>, footer: &Footer) -> io::Result<Option<(u64, Vec<u8>)>> {
    // If bytes were cut out or put in, it is elsewhere: before its offsets, which are few.
    let before_offsets = footer.offsets.checked_sub(footer.summary);
    let moved = (1..=MAX_GROUPS).filter_map(|groups| {
        footer.at.checked_sub(groups * OFFSET_BYTES).and_then(|offsets| offsets.checked_sub(before_offsets?))
    });
    for start in [footer.summary].into_iter().chain(moved) {
        if !(8..=footer.at).contains(&start) || footer.at - start > MAX_CHUNK_BYTES {
            continue;
        }
        let mut bytes = records.bytes(start, footer.checked_end())?;
        let is_whole = footer.crc == 0 || crc32fast::hash(&bytes) == footer.crc;
        bytes.truncate((footer.at - start) as usize);
        if is_whole && (footer.crc != 0 || Listed::read(&bytes).is_some()) {
            return Ok(Some((start, bytes)));
        }
    }
    Ok(None)
}

/// What a summary lists, as written.
#[derive(Default)]
struct Listed {
    chunks: Vec<ListedChunk>,
    statistics: Option<Statistics>,
    channels: HashMap<u16, Channel>,
    schemas: HashMap<u16, Schema>,
    attached: Option<Vec<Attached>>,
}

impl Listed {
    /// `None` where these are not the records of a summary.
    fn read(bytes: &[u8]) -> Option<Self> {
        let mut listed = Self::default();
        let mut attached = Vec::new();
        let mut records = Parts(bytes);
        while !records.0.is_empty() {
            let (kind, body) = records.record()?;
            let mut parts = Parts(body);
            match kind {
                op::SCHEMA => listed.schemas.extend([schema(&mut parts)?]),
                op::CHANNEL => listed.channels.extend([channel(&mut parts)?]),
                op::CHUNK_INDEX => listed.chunks.push(chunk_index(&mut parts)?),
                op::STATISTICS => listed.statistics = Some(statistics(&mut parts)?),
                op::ATTACHMENT_INDEX => attached.push(attachment_index(&mut parts)?),
                // Kinds that are not known yet among them.
                op::METADATA_INDEX | op::SUMMARY_OFFSET | 0x10.. => {}
                _ => return None,
            }
        }
        let is_complete = |counted: &Statistics| counted.attachments as usize == attached.len();
        listed.attached = listed.statistics.as_ref().is_some_and(is_complete).then_some(attached);
        Some(listed)
    }
}

fn chunk_index(parts: &mut Parts<'_>) -> Option<ListedChunk> {
    let span_ns = [parts.u64()?, parts.u64()?];
    let (at, length) = (parts.u64()?, parts.u64()?);
    let _indexes = (parts.map()?, parts.u64()?);
    Some(ListedChunk { at, length, span_ns, is_known: unpack::KNOWN.contains(&parts.text()?) })
}

fn statistics(parts: &mut Parts<'_>) -> Option<Statistics> {
    let _counts = (parts.u64()?, parts.u16()?, parts.u32()?);
    let attachments = parts.u32()?;
    let _counts = (parts.u32()?, parts.u32()?, parts.u64()?, parts.u64()?);
    let mut counts = parts.map()?;
    let mut messages = HashMap::new();
    while !counts.0.is_empty() {
        messages.insert(counts.u16()?, counts.u64()?);
    }
    Some(Statistics { attachments, messages })
}

fn attachment_index(parts: &mut Parts<'_>) -> Option<Attached> {
    let (at, length) = (parts.u64()?.checked_add(HEAD)?, parts.u64()?.checked_sub(HEAD)?);
    let _times = (parts.u64()?, parts.u64()?);
    let bytes = parts.u64()?;
    let (name, media_type) = (parts.text()?.to_owned(), parts.text()?.to_owned());
    Some(Attached { name, media_type, bytes, at, record: length })
}
