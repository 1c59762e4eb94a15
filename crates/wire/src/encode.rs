//! Encodes packets into the caller's buffer, without allocation or `std`, so that firmware can use it too.
//!
//! Every function returns the number of bytes written, both delimiting zeros included, or `None` if `to` is too short
//! ([`MAX_ENCODED_BYTES`](super::format::MAX_ENCODED_BYTES) always suffices) or the values are out of range.

use cobs::CobsEncoder;

use super::format::{Answer, Bits, CHECKSUM, Command, Head, Identity, MAX_CHANNELS, MAX_FIRMWARE_BYTES, VERSION, kind};

/// A full frame: `values`, at most 256, one per channel in order, each within `bits`.
#[must_use]
pub fn frame(to: &mut [u8], head: &Head, bits: Bits, values: &[u16]) -> Option<usize> {
    if values.is_empty() || values.len() > MAX_CHANNELS {
        return None;
    }
    packet(to, |packet| {
        packet.put_head(kind::FRAME, head)?;
        packet.put(&[bits.count()])?;
        packet.put_values(bits, values.iter().copied())
    })
}

/// A partial frame: `values` has one entry per channel, at most 256; channels with `None` are left out.
#[must_use]
pub fn partial(to: &mut [u8], head: &Head, bits: Bits, values: &[Option<u16>]) -> Option<usize> {
    if values.len() > MAX_CHANNELS {
        return None;
    }
    // Channels after the last that is sent need no bit.
    let used = values.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
    packet(to, |packet| {
        packet.put_head(kind::PARTIAL, head)?;
        packet.put(&[bits.count(), used.div_ceil(8) as u8])?;
        for eight in values[..used].chunks(8) {
            let set = |byte: u8, (bit, value): (usize, &Option<u16>)| byte | u8::from(value.is_some()) << bit;
            packet.put(&[eight.iter().enumerate().fold(0, set)])?;
        }
        packet.put_values(bits, values.iter().flatten().copied())
    })
}

/// The board's identity.
#[must_use]
pub fn identity(to: &mut [u8], head: &Head, identity: &Identity<'_>) -> Option<usize> {
    let channels = usize::from(identity.channels);
    if channels == 0 || channels > MAX_CHANNELS || identity.firmware.len() > MAX_FIRMWARE_BYTES {
        return None;
    }
    packet(to, |packet| {
        packet.put_head(kind::IDENTITY, head)?;
        packet.put(&[identity.request, u8::from(identity.running)])?;
        packet.put(&identity.channels.to_le_bytes())?;
        packet.put(&[identity.bits.count()])?;
        packet.put(&identity.layout.to_le_bytes())?;
        packet.put(&identity.rate_mhz.to_le_bytes())?;
        packet.put(identity.firmware.as_bytes())
    })
}

/// The answer to a command.
#[must_use]
pub fn answer(to: &mut [u8], head: &Head, answer: &Answer) -> Option<usize> {
    packet(to, |packet| {
        packet.put_head(kind::ANSWER, head)?;
        packet.put(&[answer.request, answer.command, answer.status.byte()])?;
        packet.put(&answer.value.to_le_bytes())
    })
}

/// A command to `board`, numbered `request`, 1 to 255.
#[must_use]
pub fn command(to: &mut [u8], board: u16, request: u8, command: Command) -> Option<usize> {
    packet(to, |packet| {
        packet.put(&[VERSION, command.kind()])?;
        packet.put(&board.to_le_bytes())?;
        packet.put(&[request])?;
        match command {
            Command::Rate { rate_mhz } => packet.put(&rate_mhz.to_le_bytes()),
            Command::Wiper { channel, wiper } => {
                packet.put(&channel.to_le_bytes())?;
                packet.put(&[wiper])
            }
            Command::Identify | Command::Start | Command::Stop => Some(()),
        }
    })
}

/// A packet being written, COBS-encoded and checksummed on the fly.
struct Packet<'a> {
    cobs: CobsEncoder<'a>,
    digest: crc::Digest<'static, u32>,
}

/// Writes a zero, the packet that `fill` fills, its checksum, and the zero that ends it. The first zero keeps the packet
/// whole where the end of the one before did not arrive.
fn packet(to: &mut [u8], fill: impl FnOnce(&mut Packet<'_>) -> Option<()>) -> Option<usize> {
    let (first, to) = to.split_first_mut()?;
    *first = 0;
    let mut packet = Packet { cobs: CobsEncoder::new(&mut *to), digest: CHECKSUM.digest() };
    fill(&mut packet)?;
    let Packet { mut cobs, digest } = packet;
    cobs.push(&digest.finalize().to_le_bytes()).ok()?;
    // Where the last byte did not fit, neither does the zero.
    let length = cobs.finalize();
    *to.get_mut(length)? = 0;
    Some(length + 2)
}

impl Packet<'_> {
    fn put(&mut self, bytes: &[u8]) -> Option<()> {
        // The encoder would take an empty push for a byte.
        if bytes.is_empty() {
            return Some(());
        }
        self.digest.update(bytes);
        self.cobs.push(bytes).ok()
    }

    fn put_head(&mut self, kind: u8, head: &Head) -> Option<()> {
        self.put(&[VERSION, kind])?;
        self.put(&head.board.to_le_bytes())?;
        self.put(&[head.boot])?;
        self.put(&head.sequence.to_le_bytes())?;
        self.put(&head.time_us.to_le_bytes())
    }

    /// Values one after the other, each lowest bit first; what is left of the last byte is zero.
    fn put_values(&mut self, bits: Bits, values: impl Iterator<Item = u16>) -> Option<()> {
        let (mut waiting, mut count) = (0_u32, 0);
        for value in values {
            if value > bits.max() {
                return None;
            }
            waiting |= u32::from(value) << count;
            count += u32::from(bits.count());
            while count >= 8 {
                self.put(&[waiting as u8])?;
                waiting >>= 8;
                count -= 8;
            }
        }
        if count > 0 { self.put(&[waiting as u8]) } else { Some(()) }
    }
}
