//! What single records say: taxels, attachments, channels, schemas.

use super::records::{Parts, Record, op};
use super::{FRAMES, FRAMES_CHANNEL, TAXEL_IDS, ids_of};

/// A file that lies beside the frames.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attached {
    /// Its name.
    pub name: String,
    /// What it is, such as [`super::BODY`].
    pub media_type: String,
    /// Its length.
    pub bytes: u64,
    pub(super) at: u64,
    pub(super) record: u64,
}

#[derive(Clone, Debug)]
pub(super) struct Channel {
    /// The id of its messages' schema.
    pub(super) schema: u16,
    pub(super) topic: String,
    pub(super) encoding: String,
    /// The ids of a frame's values, in their order, if this is the channel of frames.
    pub(super) taxels: Option<Vec<u32>>,
}

impl Channel {
    /// That of frames.
    pub(super) fn of_frames() -> Self {
        Self { schema: 0, topic: FRAMES.to_owned(), encoding: "protobuf".to_owned(), taxels: None }
    }
}

/// What stands before all else in a recording.
pub(super) struct Preface {
    /// The ids of a frame's values, in their order.
    pub(super) taxels: Vec<u32>,
    /// The channel of frames, which older recordings do not tell.
    pub(super) frames: Option<u16>,
}

/// What the metadata in `body` tell, if they are a recording's own.
pub(super) fn preface(body: &[u8]) -> Option<Preface> {
    let Ok(mcap::records::Record::Metadata(own)) = mcap::parse_record(op::METADATA, body) else { return None };
    let taxels = ids_of(own.metadata.get(TAXEL_IDS).filter(|_| own.name == super::METADATA)?)?;
    Some(Preface { taxels, frames: own.metadata.get(FRAMES_CHANNEL).and_then(|id| id.parse().ok()) })
}

/// The attachment whose record begins with `head`.
pub(super) fn attached(head: &[u8], record: Record) -> Option<Attached> {
    let mut parts = Parts(head);
    let _times = (parts.u64()?, parts.u64()?);
    let (name, media_type) = (parts.text()?.to_owned(), parts.text()?.to_owned());
    Some(Attached { name, media_type, bytes: parts.u64()?, at: record.at, record: record.length })
}

/// The data of a whole attachment's record, if its checksum is right.
pub(super) fn data_of(body: &[u8]) -> Option<&[u8]> {
    let (checked, crc) = body.split_at_checked(body.len().checked_sub(4)?)?;
    let crc = u32::from_le_bytes(crc.try_into().ok()?);
    let mut parts = Parts(checked);
    let _times = (parts.u64()?, parts.u64()?);
    let _names = (parts.text()?, parts.text()?);
    let length = parts.u64()?;
    let data = parts.bytes(length)?;
    (crc32fast::hash(checked) == crc).then_some(data)
}

pub(super) fn channel(parts: &mut Parts<'_>) -> Option<(u16, Channel)> {
    let (id, schema) = (parts.u16()?, parts.u16()?);
    let (topic, encoding) = (parts.text()?.to_owned(), parts.text()?.to_owned());
    let mut metadata = parts.map()?;
    let mut taxels = None;
    while topic == FRAMES && !metadata.0.is_empty() {
        let (key, value) = (metadata.text()?, metadata.text()?);
        taxels = taxels.or(ids_of(value).filter(|_| key == TAXEL_IDS));
    }
    Some((id, Channel { schema, topic, encoding, taxels }))
}

/// The id of a schema, and its name.
pub(super) fn schema(parts: &mut Parts<'_>) -> Option<(u16, String)> {
    Some((parts.u16()?, parts.text()?.to_owned()))
}
