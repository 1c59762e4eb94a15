//! Robots: where their links are, from states of joints; their topics in ROS 2, in bags and live.
//!
//! It is a part of `somatic`, which has it as `somatic::robot`; a program uses that.

#![deny(missing_docs)]
#![warn(unreachable_pub)]

#[cfg(feature = "ros2")]
#[doc(hidden)]
pub mod dds;
pub mod robot;

#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_author as author;
#[cfg(test)]
#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_bodies as bundled;
#[cfg(feature = "mcap")]
use somatic_recording as recording;
#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_skin::{body, error, output, signal};
#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_sources::source;
