//! Runs: frames go from a source through an engine to sinks, while somebody watches.
//!
//! From a frame's bytes to the engine it is three hops: a [`Source`](crate::source::Source) reads them into a [`Frame`](crate::Frame), a
//! a feed hands frames on from a thread of its own, and [`Run`] calls [`Engine::process`](crate::Engine::process). From percepts to bytes
//! it is three, too: [`Run`] hands them to each [`Sink`](crate::sink::Sink), a sink makes lines, rows or messages of them, and
//! [`output`](crate::output) writes these.

pub(crate) mod feed;
mod observer;
#[cfg(feature = "scenes")]
mod of_scene;
#[cfg(feature = "scenes")]
pub(crate) mod opened;
pub(crate) mod repeats;
pub(crate) mod running;
mod serve;
#[cfg(feature = "scenes")]
pub(crate) mod several;
mod unfit;

pub use self::feed::{Ending, FrameInfo};
pub use self::observer::{Observer, Remark};
pub use self::running::{Outcome, Run};
#[cfg(feature = "scenes")]
pub use crate::setup::Tell;
