//! What packets hold, as types. Nothing here needs an allocator or `std`.
//!
//! `docs/wire.md` is the specification, byte by byte.

/// The version of the format that is written here.
pub const VERSION: u8 = 1;
/// Channels that one board has at most.
pub const MOST_CHANNELS: usize = 256;
/// Bytes of a packet's head from a board: version, kind, board, boot, sequence, time.
pub const HEAD_BYTES: usize = 13;
/// Bytes of a packet's head from the host: version, kind, board, request.
pub const COMMAND_HEAD_BYTES: usize = 5;
/// Bytes of the checksum that ends a packet.
pub const CHECKSUM_BYTES: usize = 4;
/// Bytes of the longest packet before COBS: a partial frame of 256 channels of 16 bits.
pub const MOST_PACKET: usize = HEAD_BYTES + 2 + MOST_CHANNELS / 8 + 2 * MOST_CHANNELS + CHECKSUM_BYTES;
/// Bytes of the longest packet on the line: COBS adds one for each 254 or part of them, and there is a zero at both ends.
pub const MOST_ON_LINE: usize = MOST_PACKET + MOST_PACKET.div_ceil(254) + 2;
/// Bytes of text that an identity has at most.
pub const MOST_TEXT: usize = 64;
/// A command to this board is for whichever board hears it.
pub const ANY_BOARD: u16 = 0xFFFF;
/// A layout hash of a board that does not know its layout.
pub const NO_LAYOUT: u32 = 0;

/// CRC-32 as Ethernet, zlib and PNG have it: polynomial 0x04C11DB7, bits reflected, starting from and ended with all ones.
pub(super) const CHECKSUM: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// The kinds of packets, a packet's second byte.
pub(super) mod kind {
    pub(crate) const FRAME: u8 = 0x01;
    pub(crate) const PARTIAL: u8 = 0x02;
    pub(crate) const IDENTITY: u8 = 0x03;
    pub(crate) const ANSWER: u8 = 0x04;
    pub(crate) const IDENTIFY: u8 = 0x10;
    pub(crate) const RATE: u8 = 0x11;
    pub(crate) const TAP: u8 = 0x12;
    pub(crate) const START: u8 = 0x13;
    pub(crate) const STOP: u8 = 0x14;
}

/// How many bits a value has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Bits {
    /// 0 to 255.
    Eight = 8,
    /// 0 to 1023.
    Ten = 10,
    /// 0 to 4095.
    Twelve = 12,
    /// 0 to 65535.
    Sixteen = 16,
}

impl Bits {
    /// So many bits, where a board may have so many.
    #[must_use]
    pub const fn new(bits: u8) -> Option<Self> {
        match bits {
            8 => Some(Self::Eight),
            10 => Some(Self::Ten),
            12 => Some(Self::Twelve),
            16 => Some(Self::Sixteen),
            _ => None,
        }
    }

    /// The number of bits.
    #[must_use]
    pub const fn count(self) -> u8 {
        self as u8
    }

    /// The highest value.
    #[must_use]
    pub const fn most(self) -> u16 {
        ((1_u32 << self.count()) - 1) as u16
    }

    /// The bytes that `values` values are packed into.
    #[must_use]
    pub const fn bytes(self, values: usize) -> usize {
        (values * self.count() as usize).div_ceil(8)
    }

    /// How many values are packed into `bytes` bytes. The bits left over are fewer than a value has: there is one answer.
    pub(super) const fn values(self, bytes: usize) -> usize {
        bytes * 8 / self.count() as usize
    }
}

/// What every packet from a board begins with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head {
    /// Who sends, 0 to 65534.
    pub board: u16,
    /// Another number after each start of the board, so that a sequence that begins anew is known for one.
    pub boot: u8,
    /// Of a frame, its number since the board started; of other packets, the number that the next frame will have.
    pub sequence: u32,
    /// The board's clock when it read the first channel (of other packets: when it sent), µs, modulo 2³².
    pub time_us: u32,
}

/// What a board says of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity<'a> {
    /// The request that this answers; 0 when nobody asked.
    pub request: u8,
    /// Whether it sends frames.
    pub running: bool,
    /// Channels that a full frame has, 1 to 256.
    pub channels: u16,
    /// Bits of a value.
    pub bits: Bits,
    /// [`layout_hash`] of the taxels it is made for; [`NO_LAYOUT`] when it does not know.
    pub layout: u32,
    /// Frames a second, in thousandths of a hertz; 0 is as many as the line takes.
    pub rate_mhz: u32,
    /// Name and version of the firmware, UTF-8, at most [`MOST_TEXT`] bytes. What is no UTF-8 is read as empty.
    pub firmware: &'a str,
}

/// What the host asks of a board. Each may be repeated: the second time changes nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Say who you are.
    Identify,
    /// Send so many frames a second, in thousandths of a hertz; 0 is as many as the line takes.
    Rate {
        /// 1 Hz is 1000.
        rate_mhz: u32,
    },
    /// Set a channel's potentiometer.
    Tap {
        /// From 0.
        channel: u16,
        /// The tap.
        tap: u8,
    },
    /// Send frames.
    Start,
    /// Send no more frames.
    Stop,
}

impl Command {
    /// The kind of its packet, which its answer repeats.
    #[must_use]
    pub const fn kind(self) -> u8 {
        match self {
            Self::Identify => kind::IDENTIFY,
            Self::Rate { .. } => kind::RATE,
            Self::Tap { .. } => kind::TAP,
            Self::Start => kind::START,
            Self::Stop => kind::STOP,
        }
    }
}

/// How a board answers what is no [`Command::Identify`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// The request that this answers.
    pub request: u8,
    /// The kind of the command's packet.
    pub command: u8,
    /// Whether it was done.
    pub status: Status,
    /// What is set now: the rate in thousandths of a hertz, the tap; else 0.
    pub value: u32,
}

/// What became of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// It was done.
    Done,
    /// The board does not know it.
    Unknown,
    /// There is no such channel, or the value cannot be set.
    Bad,
    /// The board failed to do it.
    Failed,
    /// Something of a later version.
    Other(u8),
}

impl Status {
    pub(super) const fn byte(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Unknown => 1,
            Self::Bad => 2,
            Self::Failed => 3,
            Self::Other(byte) => byte,
        }
    }

    pub(super) const fn of(byte: u8) -> Self {
        match byte {
            0 => Self::Done,
            1 => Self::Unknown,
            2 => Self::Bad,
            3 => Self::Failed,
            other => Self::Other(other),
        }
    }
}

/// The hash of a board's layout: the CRC-32 of its channels' taxel ids in order, each four bytes, lowest first, and
/// `FF FF FF FF` for a channel without a taxel. A hash that happens to be [`NO_LAYOUT`] becomes 1.
pub fn layout_hash(taxels: impl IntoIterator<Item = Option<u32>>) -> u32 {
    let mut digest = CHECKSUM.digest();
    for taxel in taxels {
        digest.update(&taxel.unwrap_or(u32::MAX).to_le_bytes());
    }
    match digest.finalize() {
        NO_LAYOUT => 1,
        hash => hash,
    }
}
