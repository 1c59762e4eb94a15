//! Decodes packets from bytes, in pieces of any size.
//!
//! Bytes that are not a packet give an [`Event::Corrupt`], and the next zero byte starts a new packet: zeros only delimit
//! packets. Memory is bounded by one packet and a few numbers per board.

use super::format::{
    Answer, Bits, CHECKSUM, CHECKSUM_BYTES, COMMAND_HEAD_BYTES, Command, HEAD_BYTES, Head, Identity, MAX_CHANNELS,
    MAX_ENCODED_BYTES, Status, VERSION, kind,
};
use super::frame_counts::{FrameCounts, PacketOrder};

/// A decoded packet, or corrupt bytes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event<'a> {
    /// Values of a board's channels.
    Frame {
        /// Who sent it, and when.
        head: Head,
        /// Unwrapped board time and frames lost before it.
        order: PacketOrder,
        /// The values.
        values: Values<'a>,
    },
    /// A board's identity.
    Identity {
        /// Who sent it, and when.
        head: Head,
        /// As for a frame.
        order: PacketOrder,
        /// Its description of itself.
        identity: Identity<'a>,
    },
    /// A board answers a command.
    Answer {
        /// Who sent it, and when.
        head: Head,
        /// As for a frame.
        order: PacketOrder,
        /// The answer.
        answer: Answer,
    },
    /// A command, as boards hear it.
    Command {
        /// The addressed board; [`ANY_BOARD`](super::ANY_BOARD) is every board.
        board: u16,
        /// The request's number.
        request: u8,
        /// The command.
        command: Command,
    },
    /// Bytes that are not a packet.
    Corrupt {
        /// What is wrong with them.
        why: Corruption,
        /// Their number, with the final zero.
        bytes: usize,
    },
}

/// Why bytes are not a packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Corruption {
    /// The first bytes since the line was opened, possibly the end of a valid packet.
    Joined,
    /// Fewer bytes than the shortest packet has.
    Short,
    /// No zero within the bytes that the longest packet has.
    Long,
    /// The COBS code is broken.
    Code,
    /// The checksum does not agree.
    Checksum,
    /// A valid packet of another format version.
    Version(u8),
    /// A valid packet of an unknown kind.
    Kind(u8),
    /// A valid packet whose contents do not fit its kind.
    Contents,
}

impl std::fmt::Display for Corruption {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Joined => f.write_str("the end of a packet"),
            Self::Short => f.write_str("too short for a packet"),
            Self::Long => f.write_str("too long for a packet"),
            Self::Code => f.write_str("a broken code"),
            Self::Checksum => f.write_str("a wrong checksum"),
            Self::Version(version) => write!(f, "a packet of version {version}; this one reads version {VERSION}"),
            Self::Kind(kind) => write!(f, "a packet of the unknown kind {kind:#04x}"),
            Self::Contents => f.write_str("a packet whose contents do not fit its kind"),
        }
    }
}

/// The values of a frame, as they are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Values<'a> {
    bits: Bits,
    /// Which channels have a value, a bit each; `None` is all.
    channels: Option<&'a [u8]>,
    packed: &'a [u8],
}

impl<'a> Values<'a> {
    /// The bits of a value.
    #[must_use]
    pub fn bits(&self) -> Bits {
        self.bits
    }

    /// Whether only some channels have a value; the others have kept theirs from the frame before.
    #[must_use]
    pub fn is_partial(&self) -> bool {
        self.channels.is_some()
    }

    /// How many values there are.
    #[must_use]
    pub fn len(&self) -> usize {
        match self.channels {
            None => self.bits.values(self.packed.len()),
            Some(channels) => channels.iter().map(|byte| byte.count_ones() as usize).sum(),
        }
    }

    /// Whether there are none: nothing changed.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// One more than the highest channel with a value.
    #[must_use]
    pub fn channel_count(&self) -> usize {
        self.iter().last().map_or(0, |(channel, _)| usize::from(channel) + 1)
    }

    /// Channels, in order, with their values.
    pub fn iter(&self) -> impl Iterator<Item = (u16, u16)> + use<'a> {
        let (width, channels, packed) = (usize::from(self.bits.count()), self.channels, self.packed);
        let is_set =
            |set: &[u8], channel: u16| set.get(usize::from(channel / 8)).is_some_and(|b| b >> (channel % 8) & 1 == 1);
        let has_value = move |&channel: &u16| channels.is_none_or(|set| is_set(set, channel));
        let sent = (0..self.len()).zip((0..=u16::MAX).filter(has_value));
        sent.map(move |(index, channel)| (channel, value(packed, index * width, width)))
    }
}

/// `bits` bits of `packed` from bit `start` on.
fn value(packed: &[u8], start: usize, bits: usize) -> u16 {
    let first = start / 8;
    let bytes = [0, 1, 2].map(|more| packed.get(first + more).copied().unwrap_or(0));
    let three = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], 0]);
    ((three >> (start % 8)) & ((1 << bits) - 1)) as u16
}

/// What has come so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DecoderCounts {
    /// All bytes.
    pub bytes: u64,
    /// Valid packets of this format version.
    pub packets: u64,
    /// Times that bytes were no packet, [`Corruption::Joined`] left out.
    pub corrupt: u64,
}

/// Turns bytes into [`Event`]s.
#[derive(Clone, Debug)]
pub struct Decoder {
    waiting: Vec<u8>,
    /// Bytes skipped of a packet that is too long.
    skipped: usize,
    /// Whether no packet has ended since the line was opened.
    joined: bool,
    counts: DecoderCounts,
    frame_counts: FrameCounts,
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Decoder {
    /// A decoder that may start in the middle of a packet.
    #[must_use]
    pub fn new() -> Self {
        let waiting = Vec::with_capacity(MAX_ENCODED_BYTES);
        Self {
            waiting,
            skipped: 0,
            joined: true,
            counts: DecoderCounts::default(),
            frame_counts: FrameCounts::default(),
        }
    }

    /// Drops a partial packet, as after a line was closed; the counts stay.
    pub fn rejoin(&mut self) {
        self.waiting.clear();
        self.skipped = 0;
        self.joined = true;
    }

    /// Counts since the decoder was made.
    #[must_use]
    pub fn counts(&self) -> DecoderCounts {
        self.counts
    }

    /// Received and lost frames by board.
    #[must_use]
    pub fn frame_counts(&self) -> &FrameCounts {
        &self.frame_counts
    }

    /// Decodes the next bytes and calls `on` with each event in order.
    pub fn push(&mut self, bytes: &[u8], mut on: impl FnMut(Event<'_>)) {
        self.counts.bytes += bytes.len() as u64;
        let mut rest = bytes;
        while let Some(end) = rest.iter().position(|&byte| byte == 0) {
            self.take(&rest[..end]);
            rest = &rest[end + 1..];
            self.finish(&mut on);
        }
        self.take(rest);
    }

    /// Buffers `bytes`, up to the length of a packet.
    fn take(&mut self, bytes: &[u8]) {
        // The longest packet's last byte is the zero.
        if self.skipped > 0 || self.waiting.len() + bytes.len() >= MAX_ENCODED_BYTES {
            self.skipped += self.waiting.len() + bytes.len();
            self.waiting.clear();
        } else {
            self.waiting.extend_from_slice(bytes);
        }
    }

    /// Handles the zero that ends a packet.
    fn finish(&mut self, on: &mut impl FnMut(Event<'_>)) {
        let length = self.waiting.len() + self.skipped;
        let joined = std::mem::take(&mut self.joined);
        let long = std::mem::take(&mut self.skipped) > 0;
        // Repeated zeros hold no packet.
        if length == 0 {
            return;
        }
        let parsed = if long { Err(Corruption::Long) } else { parse(&mut self.waiting) };
        match parsed {
            Ok(mut packet) => {
                self.counts.packets += 1;
                match &mut packet {
                    Event::Frame { head, order, .. } => *order = self.frame_counts.count(head, true),
                    Event::Identity { head, order, .. } | Event::Answer { head, order, .. } => {
                        *order = self.frame_counts.count(head, false);
                    }
                    Event::Command { .. } | Event::Corrupt { .. } => {}
                }
                on(packet);
            }
            Err(why) => {
                let is_valid = matches!(why, Corruption::Version(_) | Corruption::Kind(_) | Corruption::Contents);
                let why = if joined && !is_valid { Corruption::Joined } else { why };
                self.counts.corrupt += u64::from(why != Corruption::Joined);
                on(Event::Corrupt { why, bytes: length + 1 });
            }
        }
        self.waiting.clear();
    }
}

fn parse(coded: &mut [u8]) -> Result<Event<'_>, Corruption> {
    let length = cobs::decode_in_place(coded).map_err(|_| Corruption::Code)?;
    if length < COMMAND_HEAD_BYTES + CHECKSUM_BYTES {
        return Err(Corruption::Short);
    }
    let (packet, checksum) = coded[..length].split_at(length - CHECKSUM_BYTES);
    if CHECKSUM.checksum(packet).to_le_bytes() != checksum {
        return Err(Corruption::Checksum);
    }
    if packet[0] != VERSION {
        return Err(Corruption::Version(packet[0]));
    }
    match packet[1] {
        kind::IDENTIFY..=kind::STOP => command(packet).ok_or(Corruption::Contents),
        kind::FRAME..=kind::ANSWER => from_board(packet).ok_or(Corruption::Contents),
        other => Err(Corruption::Kind(other)),
    }
}

fn command(packet: &[u8]) -> Option<Event<'_>> {
    let (head, body) = packet.split_first_chunk::<COMMAND_HEAD_BYTES>()?;
    let command = match (head[1], body) {
        (kind::IDENTIFY, []) => Command::Identify,
        (kind::RATE, &[a, b, c, d]) => Command::Rate { rate_mhz: u32::from_le_bytes([a, b, c, d]) },
        (kind::WIPER, &[a, b, wiper]) => Command::Wiper { channel: u16::from_le_bytes([a, b]), wiper },
        (kind::START, []) => Command::Start,
        (kind::STOP, []) => Command::Stop,
        _ => return None,
    };
    Some(Event::Command { board: u16::from_le_bytes([head[2], head[3]]), request: head[4], command })
}

fn from_board(packet: &[u8]) -> Option<Event<'_>> {
    let (bytes, body) = packet.split_first_chunk::<HEAD_BYTES>()?;
    let &[_, kind, b0, b1, boot, s0, s1, s2, s3, t0, t1, t2, t3] = bytes;
    let head = Head {
        board: u16::from_le_bytes([b0, b1]),
        boot,
        sequence: u32::from_le_bytes([s0, s1, s2, s3]),
        time_us: u32::from_le_bytes([t0, t1, t2, t3]),
    };
    let order = PacketOrder::default();
    match kind {
        kind::FRAME | kind::PARTIAL => Some(Event::Frame { head, order, values: values(kind, body)? }),
        kind::IDENTITY => {
            let (bytes, text) = body.split_first_chunk::<13>()?;
            let &[request, running, c0, c1, bits, l0, l1, l2, l3, r0, r1, r2, r3] = bytes;
            let identity = Identity {
                request,
                running: running & 1 == 1,
                channels: u16::from_le_bytes([c0, c1]),
                bits: Bits::new(bits)?,
                layout: u32::from_le_bytes([l0, l1, l2, l3]),
                rate_mhz: u32::from_le_bytes([r0, r1, r2, r3]),
                firmware: std::str::from_utf8(text).unwrap_or(""),
            };
            let fits = (1..=MAX_CHANNELS).contains(&usize::from(identity.channels));
            fits.then_some(Event::Identity { head, order, identity })
        }
        _ => {
            let &[request, command, status, v0, v1, v2, v3] = body else { return None };
            let status = Status::from_byte(status);
            let answer = Answer { request, command, status, value: u32::from_le_bytes([v0, v1, v2, v3]) };
            Some(Event::Answer { head, order, answer })
        }
    }
}

/// The values in a frame's body, if it is as long as they say.
fn values(kind: u8, body: &[u8]) -> Option<Values<'_>> {
    let (&bits, rest) = body.split_first()?;
    let bits = Bits::new(bits)?;
    let (channels, packed) = if kind == kind::FRAME {
        (None, rest)
    } else {
        let (&bytes, rest) = rest.split_first()?;
        let (channels, packed) = rest.split_at_checked(bytes.into())?;
        (Some(channels), packed)
    };
    let values = Values { bits, channels, packed };
    let count = values.len();
    let some = channels.is_some() || count > 0;
    let few = count <= MAX_CHANNELS && channels.is_none_or(|set| set.len() <= MAX_CHANNELS / 8);
    let spare = bits.bytes(count) * 8 - count * usize::from(bits.count());
    let padded = packed.last().is_none_or(|last| u32::from(*last) >> (8 - spare) == 0);
    (some && few && packed.len() == bits.bytes(count) && padded).then_some(values)
}
