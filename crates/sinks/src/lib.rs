//! Where percepts go: lines, tables, recordings, ROS 2, other computers, a page.
//!
//! It is a part of `somatic`, which has it as `somatic::sink`; a program uses that.

#![deny(missing_docs)]
#![warn(unreachable_pub)]

// Its macros `setters!` and `words!`.
#[macro_use]
extern crate somatic_skin;

pub mod sink;

#[cfg(test)]
#[allow(unused_imports, reason = "which of them are used depends on features")]
use self::{
    body::Body,
    scene::Scene,
    signal::{Calibration, Frame, RawValue},
};
#[cfg(test)]
#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_bodies as bundled;
#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_engine::{BackendKind, Engine, Options, backend, percept, scene, touch};
#[cfg(feature = "page")]
use somatic_page as page;
#[cfg(feature = "mcap")]
use somatic_recording as recording;
#[cfg(feature = "ros2")]
use somatic_robot::dds;
#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_robot::robot;
#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_skin::{body, error, limits, output, plain, signal};
use somatic_sources::limb;
