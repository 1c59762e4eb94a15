//! What single records say: taxels, attachments, channels, schemas.

use std::collections::HashMap;

use super::records::{Parts, Record};
use super::{FRAMES, FRAMES_CHANNEL, TAXEL_IDS, WORLD, ids_of};

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
    /// The world that poses of the frames are in, as [`Preface::world`] has it.
    pub(super) world: Option<String>,
}

impl Channel {
    /// The channel of frames.
    pub(super) fn of_frames() -> Self {
        Self { schema: 0, topic: FRAMES.to_owned(), encoding: "protobuf".to_owned(), taxels: None, world: None }
    }
}

/// What precedes all else in a recording.
pub(super) struct Preface {
    /// The ids of a frame's values, in their order.
    pub(super) taxels: Vec<u32>,
    /// The channel of frames, which older recordings do not tell.
    pub(super) frames: Option<u16>,
    /// The world that poses are in, which older recordings do not tell.
    pub(super) world: Option<String>,
}

/// What the metadata in `body` tell, if they are a recording's own.
pub(super) fn preface(body: &[u8]) -> Option<Preface> {
    // The crate's own parser makes room for strings by lengths that damage can make 4 GiB.
    let mut parts = Parts(body);
    let name = parts.text()?;
    let length = parts.u32()?;
    let mut pairs = Parts(parts.bytes(length.into())?);
    let mut metadata: HashMap<&str, &str> = HashMap::new();
    while !pairs.0.is_empty() {
        metadata.insert(pairs.text()?, pairs.text()?);
    }
    let taxels = ids_of(metadata.get(TAXEL_IDS).filter(|_| name == super::METADATA)?)?;
    Some(Preface {
        taxels,
        frames: metadata.get(FRAMES_CHANNEL).and_then(|id| id.parse().ok()),
        world: metadata.get(WORLD).map(|&world| world.to_owned()),
    })
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
    let (mut taxels, mut world) = (None, None);
    while topic == FRAMES && !metadata.0.is_empty() {
        match (metadata.text()?, metadata.text()?) {
            (TAXEL_IDS, ids) => taxels = ids_of(ids),
            (WORLD, name) => world = Some(name.to_owned()),
            _ => {}
        }
    }
    Some((id, Channel { schema, topic, encoding, taxels, world }))
}

/// What a schema says.
#[derive(Clone, Debug, Default)]
pub(super) struct Schema {
    /// The type of messages.
    pub(super) name: String,
    /// The definition of that type and of those it is made of, as `ros2msg` has it.
    pub(super) definition: Option<String>,
}

/// The id of a schema, and what it says.
pub(super) fn schema(parts: &mut Parts<'_>) -> Option<(u16, Schema)> {
    let (id, name) = (parts.u16()?, parts.text()?.to_owned());
    // What follows may be damaged, and the name is still good.
    let definition = match parts.text() {
        Some("ros2msg") => parts.text().map(str::to_owned),
        _ => None,
    };
    Some((id, Schema { name, definition }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(text: &str) -> Vec<u8> {
        [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat()
    }

    #[test]
    fn a_preface_is_read_and_lengths_of_damaged_ones_take_no_memory() {
        let pairs = [text(TAXEL_IDS), text("0-2,5"), text(FRAMES_CHANNEL), text("3")].concat();
        let body = [text(super::super::METADATA), (pairs.len() as u32).to_le_bytes().to_vec(), pairs].concat();
        let read = preface(&body).unwrap();
        assert_eq!((read.taxels, read.frames), (vec![0, 1, 2, 5], Some(3)));
        for at in 0..body.len() - 3 {
            let mut damaged = body.clone();
            damaged[at..at + 4].copy_from_slice(&0xFFFF_FFF0_u32.to_le_bytes());
            let used = allocation_counter::measure(|| drop(preface(&damaged)));
            assert!(used.bytes_max < 1 << 20, "{at}: {} bytes", used.bytes_max);
            assert!(preface(&body[..at]).is_none());
        }
    }
}
