//! What single records say: taxels, attachments, channels.

use super::records::{Parts, Record};
use super::{TAXEL_IDS, ids_of};

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

/// A channel of messages.
#[derive(Clone, Debug)]
pub(super) struct Channel {
    pub(super) topic: String,
    pub(super) encoding: String,
}

/// The taxels that the metadata in `body` tell of.
pub(super) fn metadata(body: &[u8]) -> Option<Vec<u32>> {
    let mut parts = Parts(body);
    if parts.text()? != super::METADATA {
        return None;
    }
    let length = parts.u32()?;
    let mut pairs = Parts(parts.bytes(length.into())?);
    while !pairs.0.is_empty() {
        let (key, value) = (pairs.text()?, pairs.text()?);
        if key == TAXEL_IDS {
            return ids_of(value);
        }
    }
    None
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

/// A channel's id, and the channel.
pub(super) fn channel(parts: &mut Parts<'_>) -> Option<(u16, Channel)> {
    let (id, _schema) = (parts.u16()?, parts.u16()?);
    Some((id, Channel { topic: parts.text()?.to_owned(), encoding: parts.text()?.to_owned() }))
}
