//! The wire: how boards with sensors and this host speak over a serial line.
//!
//! Nothing here does I/O or looks at a clock. [`encode`] writes packets into memory that the caller brings and needs
//! neither allocation nor `std`; a [`Decoder`] turns bytes, however they come, into [`Event`]s; a [`Dialogue`] asks a
//! board for something until it answers; [`board`] is a board made of software, to try all this with.
//!
//! `docs/wire.md` specifies the format for those who write firmware, `examples/firmware/` has it in C.
//!
//! ```
//! use somatic::wire::{Bits, Decoder, Event, Head, encode};
//!
//! let head = Head { board: 3, boot: 1, sequence: 0, time_us: 1000 };
//! let mut line = [0; somatic::wire::MOST_ON_LINE];
//! let length = encode::frame(&mut line, &head, Bits::Ten, &[0, 512, 1023]).unwrap();
//!
//! let mut decoder = Decoder::new();
//! decoder.push(&line[..length], |event| {
//!     let Event::Frame { head, values, .. } = event else { panic!() };
//!     assert_eq!(head.board, 3);
//!     assert!(values.iter().eq([(0, 0), (1, 512), (2, 1023)]));
//! });
//! ```

pub mod board;
mod books;
mod decode;
mod dialogue;
pub mod encode;
mod format;

pub use books::{Account, Books, Placed};
pub use decode::{Corruption, Decoder, Event, Heard, Values};
pub use dialogue::{Dialogue, Ended, Outcome, Patience};
pub use format::{
    ANY_BOARD, Answer, Bits, CHECKSUM_BYTES, COMMAND_HEAD_BYTES, Command, HEAD_BYTES, Head, Identity, MOST_CHANNELS,
    MOST_ON_LINE, MOST_PACKET, MOST_TEXT, NO_LAYOUT, Status, VERSION, layout_hash,
};
