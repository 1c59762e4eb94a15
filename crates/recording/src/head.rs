//! What comes before the first chunk of a file: taxels, and attachments.

use std::io::{self, Read, Seek};

use super::entries::{Attached, attached, data_of, preface};
use super::records::{Next, Records, op};
use super::summary::Summary;

/// What comes before the first chunk.
#[derive(Default)]
pub(super) struct Head {
    /// The ids of a frame's values, in their order, if these are frames of touch.
    pub(super) taxels: Option<Vec<u32>>,
    /// The channel of frames, which older recordings do not tell.
    pub(super) frames_channel: Option<u16>,
    /// The world that poses are in, which older recordings do not tell.
    pub(super) world: Option<String>,
    pub(super) attached: Vec<Attached>,
    /// Whether something there is not what it says.
    pub(super) is_damaged: bool,
}

impl Head {
    /// Reads it from `records`, of a file with `summary`.
    pub(super) fn read<R: Read + Seek>(records: &mut Records<R>, summary: &Summary) -> io::Result<Self> {
        let end = summary.chunks.first().map_or(summary.data_end, |chunk| chunk.at);
        let mut head = Self::default();
        let mut body = Vec::new();
        let mut is_after_data = false;
        while records.at < end {
            let record = match records.next()? {
                Next::Record(record) if record.end() <= end => record,
                _ => {
                    head.is_damaged = true;
                    break;
                }
            };
            // What looked like the end of the data was none.
            head.is_damaged |= is_after_data && [op::METADATA, op::ATTACHMENT].contains(&record.kind);
            match record.kind {
                op::METADATA => {
                    records.body(record, u64::MAX, &mut body)?;
                    if let Some(preface) = preface(&body).filter(|_| head.taxels.is_none()) {
                        (head.taxels, head.frames_channel) = (Some(preface.taxels), preface.frames);
                        head.world = preface.world;
                    }
                }
                // What the summary lists is checked when it is read.
                op::ATTACHMENT if summary.attached.is_none() => {
                    records.body(record, u64::MAX, &mut body)?;
                    match attached(&body, record).filter(|_| data_of(&body).is_some()) {
                        Some(attached) => head.attached.push(attached),
                        None => head.is_damaged = true,
                    }
                }
                op::CHUNK | op::MESSAGE => break,
                op::DATA_END | op::FOOTER => {
                    is_after_data = true;
                    records.skip(record.length)?;
                }
                _ if is_after_data => records.skip(record.length)?,
                _ => head.is_damaged |= !records.pass(record)?,
            }
        }
        Ok(head)
    }
}
