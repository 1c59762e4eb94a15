//! A sense of touch for whole robots: touch frames in, percepts out.
//!
//! A robot's skin is a set of **taxels**, sensors that sit on its surface. A **receptive field** is a named set of taxels;
//! fields overlap and nest. For every field and every frame `somatic` gives a **percept**: how hard the field is pressed
//! and where, how what presses it is oriented, how it moves. What is not defined is absent with a reason, never NaN and
//! never 0.
//!
//! # The way through
//!
//! 1. A [`Body`] is read from glTF: links, surfaces, taxels, and the outlines of fields. `docs/reference/layout.md` specifies the
//!    encoding; [`bundled`] has three bodies to try.
//! 2. A [`Scene`] says what is wanted of it: which fields, which [`Outputs`]. A [`Calibration`] says how one robot's sensors
//!    answer, and what of their input is not to be believed.
//! 3. An [`Engine`] makes a [`Plan`] of these, picks a backend, and turns [`Frame`]s into [`Percepts`].
//!
//! ```
//! use somatic::{Body, Engine, Options, bundled};
//!
//! # fn main() -> somatic::Result<()> {
//! let body = Body::from_bytes("hand", bundled::HAND)?;
//! let mut engine = Engine::new(&body, Options::default())?;
//!
//! // One frame: every value missing, then those that your driver has.
//! let mut frame = engine.frame(0.0);
//! for id in 0..9 {
//!     engine.set_value(&mut frame, id, 10.0 * id as f32)?;
//! }
//! let percepts = engine.process_one(&frame)?;
//! for percept in percepts.touched(0) {
//!     println!("{}: {:?} at {:?} m", percepts.field_name(percept.field), percept.total, percept.position);
//! }
//! # Ok(())
//! # }
//! ```
//!
//! # Three backends, one answer
//!
//! `reference` is double precision and reads like the equations. `cpu` is single precision in lanes on all cores, `gpu` is
//! WGSL through wgpu. Both are held to the reference by bounds derived from the arithmetic; [`Engine::process_and_compare`]
//! does it on your own input. However a recording is cut into calls, a backend's percepts are the same bits.
//!
//! # Features
//!
//! All of these are there by default: `cli` is the command and what only it needs, `gpu` the WGSL backend, `page` the page
//! that shows a run in a browser; `board`, `paper` and `tune` are commands that a robot in service does without. `serial` (boards
//! on serial lines) and `mcap` (recordings) come with `cli`; `ros2` (live topics of ROS 2) has to be asked for. A robot that embeds
//! the library on its CPU goes without all of them, and builds in a fraction of the time.

#![deny(missing_docs)]
#![warn(unreachable_pub)]

#[cfg(test)]
extern crate self as somatic;
// Its macros `setters!` and `words!`.
#[macro_use]
extern crate somatic_skin;

pub mod bundled;
#[cfg(feature = "cli")]
mod ink;
#[cfg(all(feature = "cli", feature = "gpu"))]
pub mod picture;
pub mod run;
mod scene_file;

// Rooms that only `internal` shows.
#[cfg(feature = "cli")]
#[doc(hidden)]
mod contents;
#[cfg(feature = "cli")]
#[doc(hidden)]
mod convert;
#[doc(hidden)]
mod expected;
#[cfg(feature = "cli")]
#[doc(hidden)]
mod figure;
#[cfg(feature = "cli")]
#[doc(hidden)]
mod plot;
#[cfg(feature = "scenes")]
#[doc(hidden)]
mod setup;
#[cfg(feature = "cli")]
#[doc(hidden)]
mod survey;
#[cfg(feature = "cli")]
#[doc(hidden)]
mod tradeoff;

// The same paths in this crate as if they were its own.
#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_skin::{colours, keys, length, limits, parallel, plain, random};

/// What the command, the Python package and the tests use beside the face of the library, by room of the house. It changes
/// without notice: a program that embeds the library does without.
#[doc(hidden)]
pub mod internal {
    pub use somatic_author as author;
    pub use somatic_engine::{backend, gains, percept, scene, shape, touch};
    #[cfg(feature = "page")]
    pub use somatic_page as page;
    #[cfg(feature = "mcap")]
    pub use somatic_recording as recording;
    pub use somatic_robot::robot;
    pub use somatic_sinks::sink;
    pub use somatic_skin::{body, colours, error, field, limits, output, parallel, plain, random, renamed, signal};
    pub use somatic_sources::{board, source};
    pub use somatic_wire as wire;

    #[cfg(feature = "cli")]
    pub mod contents {
        pub use crate::contents::*;
    }
    #[cfg(feature = "cli")]
    pub mod convert {
        pub use crate::convert::*;
    }
    #[cfg(feature = "cli")]
    pub mod figure {
        pub use crate::figure::*;
    }
    #[cfg(feature = "cli")]
    pub mod plot {
        pub use crate::plot::*;
    }
    #[cfg(feature = "cli")]
    pub mod survey {
        pub use crate::survey::*;
    }
    #[cfg(feature = "cli")]
    pub mod tradeoff {
        pub use crate::tradeoff::*;
    }
    #[cfg(feature = "scenes")]
    pub mod setup {
        pub use crate::setup::*;
    }
    pub mod expected {
        pub use crate::expected::*;
    }
    pub mod scene_file {
        pub use crate::scene_file::*;
    }
    pub mod run {
        pub use crate::run::feed::{Arrival, Feed, ReadMode};
        #[cfg(feature = "scenes")]
        pub use crate::run::opened::{Opened, Pace};
        pub use crate::run::repeats::Repeats;
        pub use crate::run::running::{RunOptions, left_out};
        #[cfg(feature = "scenes")]
        pub use crate::run::several::Several;
        pub use crate::run::*;
    }
}

/// Errors: what is wrong, where, and what to do, in one line.
pub mod error {
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_skin::error::*;
    #[doc(inline)]
    pub use somatic_skin::error::{Error, ErrorKind, Result};
}

/// Authoring: taxels placed on a surface, fields of them, and what is wrong with a layout.
pub mod author {
    /// Skins on meshes in STL, OBJ, COLLADA and PLY, and on robots in URDF and MJCF.
    #[cfg(feature = "meshes")]
    pub mod mesh {
        #[allow(unused_imports, reason = "which of them are used depends on features")]
        pub(crate) use somatic_author::mesh::*;
        #[doc(inline)]
        pub use somatic_author::mesh::{Geometry, MeshOptions, author_mjcf_skin, author_urdf_skin, open};
    }
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_author::*;
    #[doc(inline)]
    pub use somatic_author::{
        Authored, Coverage, Finding, FindingKind, PlaceReport, Recipe, author, author_csv_skin, author_icub, coverage,
        lint, lint_in_poses,
    };
}

/// Backends, which compute percepts, and what they run on.
pub mod backend {
    #[doc(inline)]
    pub use somatic_engine::backend::BackendKind;
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_engine::backend::*;
}

/// What a field reports for a frame, and a touch: quantities that are present or absent with a reason.
pub mod percept {
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_engine::percept::*;
    #[doc(inline)]
    pub use somatic_engine::percept::{
        COLUMNS, Column, ColumnValues, ContactKind, FieldShare, FitSigma, Flags, LinkShare, Measure, Outputs, Percept,
        Percepts, Precision, SelfContact, SelfContactSide, TOUCH_COLUMNS, Touch, TouchColumn, TouchFit, TouchFlags,
        TouchFrame, TouchOutputs, Unit, Wrench,
    };
}

/// What is asked for, and the plan that an engine makes of it.
pub mod scene {
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_engine::scene::*;
    #[doc(inline)]
    pub use somatic_engine::scene::{
        Arithmetic, Cadence, Charts, Coordinates, Coverage, FilterBy, Knobs, MotionFilter, OrientationBy, Plan,
        PlannedField, Scene,
    };

    /// Scene files: all that a run is asked to do, as a person writes it down.
    pub mod file {
        #[doc(inline)]
        pub use crate::scene_file::{Accuracy, JointsDelay, LineKeys, SceneFile, TextKeys, TouchKeys};
    }
}

/// Touches of the whole body, found on its skin.
pub mod touch {
    #[doc(inline)]
    pub use somatic_engine::touch::Options;
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_engine::touch::*;
}

/// Recordings in MCAP, and bags of ROS 2.
#[cfg(feature = "mcap")]
pub mod recording {
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_recording::*;
    #[doc(inline)]
    pub use somatic_recording::{Reader, Recorder};
}

/// Where frames come from.
pub mod source {
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_sources::source::*;
    #[doc(inline)]
    pub use somatic_sources::source::{
        CsvSource, Cut, NdjsonSource, Replay, SimulatedSource, Source, SourceSpec, TextOptions, TextPlace, TextSource,
        Truth, VendorFormat, VendorOptions, VendorSource, write_recording,
    };
    #[cfg(feature = "zenoh")]
    #[doc(inline)]
    pub use somatic_sources::source::{LimbOptions, LimbSource};
    #[cfg(any(feature = "serial", feature = "zenoh"))]
    #[doc(inline)]
    pub use somatic_sources::source::{Lines, Notice};
    #[cfg(feature = "serial")]
    #[doc(inline)]
    pub use somatic_sources::source::{PortSummary, SerialOptions, SerialSource, serial_ports};
}

/// The page that shows a run in a browser, and its server.
#[cfg(feature = "page")]
pub mod page {
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_page::*;
    #[doc(inline)]
    pub use somatic_page::{Listen, Server};
}

/// Robots: where their links are, and their topics in ROS 2.
pub mod robot {
    #[cfg(feature = "meshes")]
    #[doc(inline)]
    pub use somatic_robot::robot::Kinematics;
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_robot::robot::*;
    #[cfg(feature = "ros2")]
    #[doc(inline)]
    pub use somatic_robot::robot::{LiveJoints, Ros2Source, StatesTime};
}

/// Where percepts go.
pub mod sink {
    #[cfg(feature = "page")]
    #[doc(inline)]
    pub use somatic_sinks::sink::PageSink;
    #[cfg(feature = "parquet")]
    #[doc(inline)]
    pub use somatic_sinks::sink::ParquetSink;
    #[cfg(feature = "ros2")]
    #[doc(inline)]
    pub use somatic_sinks::sink::Ros2Sink;
    #[cfg(feature = "zenoh")]
    #[doc(inline)]
    pub use somatic_sinks::sink::ZenohSink;
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_sinks::sink::*;
    #[cfg(feature = "arrow")]
    #[doc(inline)]
    pub use somatic_sinks::sink::{ArrowTable, TableKind};
    #[doc(inline)]
    pub use somatic_sinks::sink::{
        CsvSink, FieldNames, Flow, InputFrames, NdjsonSink, RosTime, Session, Sink, SinkSpec, SinkTarget,
    };
    #[cfg(feature = "mcap")]
    #[doc(inline)]
    pub use somatic_sinks::sink::{RecordingSink, Ros2BagSink};
}

/// Bodies: links, surfaces and taxels, read from glTF and written to it.
pub mod body {
    #[doc(inline)]
    pub use somatic_skin::body::{
        Body, ChartKind, ChartSpec, FieldSpec, Glb, Link, LinkJoint, MAX_TAXEL_ID, MemberSpec, Modality, Original,
        Surface, Taxel, Up,
    };
    // For this crate alone.
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_skin::body::*;
}

/// Receptive fields on a body's surface: distances, charts, cells and neighbours of taxels.
pub mod field {
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_skin::field::*;
    #[doc(inline)]
    pub use somatic_skin::field::{Chart, Field, FieldSet, Member, NoChart, WORLD};
}

/// What sensors say: frames of raw values, calibrations, wirings and drift.
pub mod signal {
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_skin::signal::*;
    #[doc(inline)]
    pub use somatic_skin::signal::{
        Calibration, ChangeCalibration, Curve, Frame, FrameTime, FsrCircuit, FsrResponse, FsrSignal, LayerResponse,
        Letter, Pose, Quantity, RawValue, Receptor, Response, Sensors, TaxelCalibration, Unfit, WiredBoard, Wiring,
    };
}

/// Outputs: the only code that writes files, and the checks of where it may write.
pub mod output {
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_skin::output::*;
    #[doc(inline)]
    pub use somatic_skin::output::{OutputPath, OutputPaths};
}

pub use backend::BackendKind;
pub use body::Body;
pub use error::{Error, ErrorKind, Result};
pub use output::OutputPath;
pub use percept::{
    COLUMNS, Column, ContactKind, FitSigma, Flags, Outputs, Percept, Percepts, Precision, SelfContact, SelfContactSide,
    TOUCH_COLUMNS, Touch, TouchColumn, TouchFit, TouchFlags, TouchFrame, TouchOutputs,
};
pub use scene::{Plan, Scene};
pub use signal::{Calibration, Frame, FrameTime, Letter, Pose, RawValue, Receptor};
pub use somatic_engine::{Agreement, ChosenBackend, ComparedColumn, Comparison, Engine, EngineState, Options, Verdict};
#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_engine::{engine, stage};
#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_sources::limb;
