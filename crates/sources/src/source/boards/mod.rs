//! Merges whatever numbers its frames and stamps them with a clock of its own: boards on serial lines, limbs on a network.
//!
//! Readers deliver to [`Shared`]; [`Merged`] makes frames of the skin of it, by clock and age.

mod clock;
mod lines;
mod merge;
mod merged;
mod wipers;

#[cfg(feature = "zenoh")]
pub(super) use clock::Clock;
pub use lines::{BoardAccount, BoardState, LimbPercepts, Lines, Notice};
pub(super) use lines::{Shared, Verdict};
pub(super) use merge::{BoardFrame, Merge, Pace};
pub(super) use merged::Merged;
pub use wipers::{ChannelWiper, WiperTrouble};
