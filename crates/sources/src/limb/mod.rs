//! Limbs: parts of a robot on computers of their own, whose frames or percepts go over Zenoh.
//!
//! `docs/reference/limbs.md` specifies what goes over the network, byte by byte.

mod key;
#[cfg(feature = "zenoh")]
mod network;
#[cfg(feature = "zenoh")]
mod packet;
#[cfg(feature = "zenoh")]
mod qualified;
mod sends;

pub use key::checked_key;
#[cfg(feature = "zenoh")]
pub use network::{Network, Publication, Side};
#[cfg(feature = "zenoh")]
pub use packet::{
    FRAME_BYTES, Packet, PerceptHead, end_packet, frame_packet, hash, layout_packet, open, percepts_begin, raw_value,
};
#[cfg(feature = "zenoh")]
pub(crate) use qualified::qualified;
pub use sends::LimbSends;
