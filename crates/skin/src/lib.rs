//! The skin of a robot: links, surfaces and taxels of a body, receptive fields on it, and what sensors say.
//!
//! It is the ground floor of `somatic`, which has all of it under its own name; a program uses that.
//!
//! * [`body`]: bodies in glTF, read and written.
//! * [`field`]: distances, charts, cells and neighbours of taxels on the surface.
//! * [`signal`]: frames of raw values, calibrations, wirings, drift.
//! * [`output`]: the only code that writes files. [`limits`]: how much a file may ask for. [`error`]: errors of one line.

#![deny(missing_docs)]
#![warn(unreachable_pub)]

mod debug;
#[macro_use]
mod setters;
#[macro_use]
mod words;

pub mod body;
#[doc(hidden)]
pub mod colours;
pub mod error;
pub mod field;
#[doc(hidden)]
pub mod keys;
#[doc(hidden)]
pub mod length;
pub mod limits;
pub mod output;
#[doc(hidden)]
pub mod parallel;
pub mod plain;
#[doc(hidden)]
pub mod random;
pub mod renamed;
pub mod signal;

pub use error::{Error, ErrorKind, Result};
