//! Runs: frames go from a source through an engine to sinks, while somebody watches.
//!
//! From a frame's bytes to the engine it is three hops: a [`Source`](crate::source::Source) reads them into a [`Frame`](crate::Frame), a
//! [`Feed`] hands frames on from a thread of its own, and [`Run`] calls [`Engine::process`](crate::Engine::process). From percepts to bytes it is three,
//! too: [`Run`] hands them to each [`Sink`](crate::sink::Sink), a sink makes lines, rows or messages of them, and [`output`](crate::output) writes these.

mod feed;
mod observer;
#[cfg(feature = "scenes")]
mod opened;
mod repeats;
mod running;
mod serve;
mod unfit;

#[doc(hidden)]
pub use self::feed::{Arrival, Feed, ReadMode};
pub use self::feed::{Ending, FrameInfo};
pub use self::observer::{Observer, Remark};
#[cfg(feature = "scenes")]
#[doc(hidden)]
pub use self::opened::{Opened, Pace};
#[doc(hidden)]
pub use self::repeats::Repeats;
pub use self::running::{Outcome, Run};
#[doc(hidden)]
pub use self::running::{RunOptions, left_out};
#[cfg(feature = "scenes")]
pub use crate::setup::Tell;
