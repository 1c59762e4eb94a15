//! Where frames of touch come from: files, recordings, boards, limbs on other computers, simulations.
//!
//! It is a part of `somatic`, which has it as `somatic::source`; a program uses that.
//!
//! * [`source`]: the trait, and every source. [`board`]: a simulated board. [`limb`]: what computers of one skin send each other.

#![deny(missing_docs)]
#![warn(unreachable_pub)]

pub mod board;
#[doc(hidden)]
pub mod limb;
pub mod source;

#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_bodies as bundled;
#[cfg(feature = "mcap")]
use somatic_recording as recording;
#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_skin::{body, error, field, keys, length, limits, output, plain, random, signal};
use somatic_wire as wire;
