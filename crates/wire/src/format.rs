//! The contents of packets as types. Nothing here needs an allocator or `std`.
//!
//! `docs/reference/wire.md` is the specification, byte by byte.

/// The version of the packet format.
pub const VERSION: u8 = 1;
/// Maximum channels of one board.
pub const MAX_CHANNELS: usize = 256;
/// Bytes of a packet's head from a board: version, kind, board, boot, sequence, time.
pub const HEAD_BYTES: usize = 13;
/// Bytes of a packet's head from the host: version, kind, board, request.
pub const COMMAND_HEAD_BYTES: usize = 5;
/// Bytes of the checksum that ends a packet.
pub const CHECKSUM_BYTES: usize = 4;
/// Bytes of the longest packet before COBS: a partial frame of 256 channels of 16 bits.
pub const MAX_PACKET_BYTES: usize = HEAD_BYTES + 2 + MAX_CHANNELS / 8 + 2 * MAX_CHANNELS + CHECKSUM_BYTES;
/// Bytes of the longest packet on the line: COBS adds one for each 254 or part of them, and there is a zero at both ends.
pub const MAX_ENCODED_BYTES: usize = MAX_PACKET_BYTES + MAX_PACKET_BYTES.div_ceil(254) + 2;
/// Maximum bytes of the firmware text of an identity.
pub const MAX_FIRMWARE_BYTES: usize = 64;
/// The broadcast board id.
pub const ANY_BOARD: u16 = 0xFFFF;
/// The layout hash of a board that does not know its layout.
pub const NO_LAYOUT: u32 = 0;

/// CRC-32 as Ethernet, zlib and PNG have it: polynomial 0x04C11DB7, bits reflected, starting from and ended with all ones.
pub(super) static CHECKSUM: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// The kinds of packets, a packet's second byte.
pub(super) mod kind {
    pub(crate) const FRAME: u8 = 0x01;
    pub(crate) const PARTIAL: u8 = 0x02;
    pub(crate) const IDENTITY: u8 = 0x03;
    pub(crate) const ANSWER: u8 = 0x04;
    pub(crate) const IDENTIFY: u8 = 0x10;
    pub(crate) const RATE: u8 = 0x11;
    pub(crate) const WIPER: u8 = 0x12;
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
    /// The variant with `bits` bits; `None` if boards may not have that many.
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
    pub const fn max(self) -> u16 {
        ((1_u32 << self.count()) - 1) as u16
    }

    /// Bytes that `values` values occupy when packed.
    #[must_use]
    pub const fn bytes(self, values: usize) -> usize {
        (values * self.count() as usize).div_ceil(8)
    }

    /// Number of values packed into `bytes` bytes; fewer bits than a value are left over.
    pub(super) const fn values(self, bytes: usize) -> usize {
        bytes * 8 / self.count() as usize
    }
}

/// What every packet from a board begins with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Head {
    /// Who sends, 0 to 65534.
    pub board: u16,
    /// Changes with every start of the board, so that a restarted sequence is recognised.
    pub boot: u8,
    /// For a frame its number since the start; for other packets the number of the next frame.
    pub sequence: u32,
    /// The board's clock when it read the first channel (of other packets: when it sent), µs, modulo 2³².
    pub time_us: u32,
}

/// A board's description of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity<'a> {
    /// The request that this answers; 0 if unrequested.
    pub request: u8,
    /// Whether it sends frames.
    pub running: bool,
    /// Channels that a full frame has, 1 to 256.
    pub channels: u16,
    /// Bits of a value.
    pub bits: Bits,
    /// [`layout_hash`] of its taxels; [`NO_LAYOUT`] if unknown.
    pub layout: u32,
    /// Frames a second, in thousandths of a hertz; 0 is as many as the line takes.
    pub rate_mhz: u32,
    /// Name and version of the firmware, at most [`MAX_FIRMWARE_BYTES`] bytes; invalid UTF-8 is read as empty.
    pub firmware: &'a str,
}

/// Commands from the host. All are idempotent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// Send your identity.
    Identify,
    /// Set the frame rate; 0 is as fast as the line allows.
    Rate {
        /// Frame rate, mHz.
        rate_mhz: u32,
    },
    /// Set a channel's potentiometer.
    Wiper {
        /// From 0.
        channel: u16,
        /// The wiper.
        wiper: u8,
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
            Self::Wiper { .. } => kind::WIPER,
            Self::Start => kind::START,
            Self::Stop => kind::STOP,
        }
    }
}

/// A board's answer to any command but [`Command::Identify`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// The request that this answers.
    pub request: u8,
    /// The kind of the command's packet.
    pub command: u8,
    /// Whether it was done.
    pub status: Status,
    /// What is set now: the rate in thousandths of a hertz, the wiper; else 0.
    pub value: u32,
}

/// The result of a command.
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
    /// A status of a later protocol version.
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

    pub(super) const fn from_byte(byte: u8) -> Self {
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
