//! The serial protocol between sensor boards and the host.
//!
//! Nothing here does I/O or reads a clock. [`encode`] writes packets into a buffer without allocation or `std`; a
//! [`Decoder`] turns bytes into [`Event`]s; a [`Dialogue`] sends commands with retries; a simulated board is in `somatic::wire::board`.
//!
//! `docs/reference/wire.md` specifies the format; `examples/firmware/` implements it in C.
//!
//! ```
//! use somatic_wire::{Bits, Decoder, Event, Head, encode};
//!
//! let head = Head { board: 3, boot: 1, sequence: 0, time_us: 1000 };
//! let mut line = [0; somatic_wire::MAX_ENCODED_BYTES];
//! let length = encode::frame(&mut line, &head, Bits::Ten, &[0, 512, 1023]).unwrap();
//!
//! let mut decoder = Decoder::new();
//! decoder.push(&line[..length], |event| {
//!     let Event::Frame { head, values, .. } = event else { panic!() };
//!     assert_eq!(head.board, 3);
//!     assert!(values.iter().eq([(0, 0), (1, 512), (2, 1023)]));
//! });
//! ```

#![deny(missing_docs)]
#![warn(unreachable_pub)]

mod decode;
mod dialogue;
pub mod encode;
mod format;
mod frame_counts;

pub use decode::{Corruption, Decoder, DecoderCounts, Event, Values};
pub use dialogue::{Dialogue, Ended, Outcome, RetryPolicy};
pub use format::{
    ANY_BOARD, Answer, Bits, CHECKSUM_BYTES, COMMAND_HEAD_BYTES, Command, HEAD_BYTES, Head, Identity, MAX_CHANNELS,
    MAX_ENCODED_BYTES, MAX_FIRMWARE_BYTES, MAX_PACKET_BYTES, NO_LAYOUT, Status, VERSION, layout_hash,
};
pub use frame_counts::{BoardCounts, FrameCounts, PacketOrder};
