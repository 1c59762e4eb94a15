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
//! use somatic::{Body, Engine, Options, RawValue, bundled};
//!
//! # fn main() -> somatic::Result<()> {
//! let body = Body::from_bytes("hand", bundled::HAND)?;
//! let mut engine = Engine::new(&body, Options::default())?;
//!
//! // One frame: every value missing, then those that your driver has.
//! let mut frame = engine.frame(0.0);
//! for id in 0..9 {
//!     frame.values[engine.index_of_taxel(id).unwrap()] = RawValue::new(f64::from(10 * id));
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
//! that shows a run in a browser. `serial` (boards on serial lines) and `mcap` (recordings) come with `cli`; `ros2` (live topics
//! of ROS 2) has to be asked for. A robot that embeds the library on its CPU goes without all of them, and builds in a fraction
//! of the time.

#![deny(missing_docs)]
#![warn(unreachable_pub)]

#[cfg(test)]
extern crate self as somatic;
// Its macros `setters!` and `words!`.
#[macro_use]
extern crate somatic_skin;

pub mod bundled;
#[doc(hidden)]
pub mod expected;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod figure;
#[cfg(feature = "cli")]
mod ink;
#[cfg(all(feature = "cli", feature = "gpu"))]
pub mod picture;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod plot;
pub mod run;
mod scene_file;
#[cfg(feature = "scenes")]
#[doc(hidden)]
pub mod setup;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod survey;
#[cfg(feature = "cli")]
pub mod tradeoff;

pub use somatic_skin::error;
#[doc(hidden)]
pub use somatic_skin::{limits, plain, renamed};
// The same paths in this crate as if they were its own.
#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_skin::{colours, keys, length, parallel, random};

/// Authoring: taxels placed on a surface, fields of them, and what is wrong with a layout.
pub mod author {
    #[cfg(feature = "meshes")]
    #[doc(inline)]
    pub use somatic_author::mesh;
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_author::*;
    #[doc(inline)]
    pub use somatic_author::{
        Authored, Coverage, Finding, FindingKind, PlaceReport, Progress, Recipe, author, author_csv_skin, author_icub,
        coverage, lint, lint_in_poses,
    };
    #[doc(hidden)]
    pub use somatic_author::{
        DrawnPoses, GridOrder, Hole, LinkCoverage, LinkShare, Placed, Sheet, SheetCell, SheetGrid, SurfacePoint,
        author_sheets, author_while, blend_skinning, cell_spread, group, heaviest_four, icub, lint_with_progress,
        place_apart, place_by_density, place_evenly, recipe_values, refresh, sheets, widest_radius,
    };
}

/// Backends, which compute percepts, and what they run on.
pub mod backend {
    #[cfg(feature = "gpu")]
    #[doc(inline)]
    pub use somatic_engine::backend::gpu;
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_engine::backend::*;
    #[doc(inline)]
    pub use somatic_engine::backend::{BackendKind, processor};
}

/// How much each sensor says of what it feels, from recorded touches.
pub mod gains {
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_engine::gains::*;
    #[doc(hidden)]
    pub use somatic_engine::gains::{GainsEstimate, GainsSurvey};
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
        Arithmetic, Cadence, Charts, Coordinates, Coverage, FilterBy, Knobs, MotionFilter, OrientationBy, Plan, Scene,
    };
    #[doc(hidden)]
    pub use somatic_engine::scene::{AskedOutputs, PlannedStage, choose_fields};

    /// Scene files: all that a run is asked to do, as a person writes it down.
    pub mod file {
        #[doc(inline)]
        pub use crate::scene_file::{
            Accuracy, JointsDelay, LineKeys, SceneFile, StatesSpec, Target, TextKeys, TouchKeys, angle, hertz, length,
            metres, seconds, time,
        };
    }
}

/// Touches of the whole body, found on its skin.
pub mod touch {
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_engine::touch::*;
    #[doc(hidden)]
    pub use somatic_engine::touch::{Input, Reading, Skin, SkinParts, SkinTaxel, Splits, Touches, Unrolled};
    #[doc(inline)]
    pub use somatic_engine::touch::{Options, TouchState};
}

/// Recordings in MCAP, and bags of ROS 2.
#[cfg(feature = "mcap")]
pub mod recording {
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_recording::*;
    #[doc(hidden)]
    pub use somatic_recording::{
        Attached, BODY, BagSurvey, CALIBRATION, FIELDS, FRAMES, LINKS, PERCEPTS, Rhythm, SCENE, SURFACE, Survey,
        SurveyedTopic, TAXELS, TOUCHES, Topic,
    };
    #[doc(inline)]
    pub use somatic_recording::{Reader, Recorder};
}

/// Where frames come from.
pub mod source {
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_sources::source::*;
    #[doc(hidden)]
    pub use somatic_sources::source::{
        BagName, Cell, CsvFile, FrameEnd, Layout, Panel, TextColumns, TextIds, TextTime, TimeColumnName,
        write_recording_with_progress,
    };
    #[cfg(any(feature = "serial", feature = "zenoh"))]
    #[doc(hidden)]
    pub use somatic_sources::source::{BoardAccount, BoardState, ChannelWiper, LimbPercepts, WiperTrouble};
    #[doc(inline)]
    pub use somatic_sources::source::{
        CsvSource, Cut, JointPosition, JointStates, NdjsonSource, Replay, SimulatedSource, Source, SourceSpec,
        TextOptions, TextPlace, TextSource, Truth, VendorFormat, VendorOptions, VendorSource, write_recording,
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

/// The serial protocol between sensor boards and the host.
#[doc(hidden)]
pub mod wire {
    #[doc(inline)]
    pub use somatic_sources::board;
    #[doc(inline)]
    pub use somatic_wire::encode;
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_wire::*;
    #[doc(inline)]
    pub use somatic_wire::{
        ANY_BOARD, Answer, Bits, BoardCounts, CHECKSUM_BYTES, COMMAND_HEAD_BYTES, Command, Corruption, Decoder,
        DecoderCounts, Dialogue, Ended, Event, FrameCounts, HEAD_BYTES, Head, Identity, MAX_CHANNELS,
        MAX_ENCODED_BYTES, MAX_FIRMWARE_BYTES, MAX_PACKET_BYTES, NO_LAYOUT, Outcome, PacketOrder, RetryPolicy, Status,
        VERSION, Values, layout_hash,
    };
}

/// The page that shows a run in a browser, and its server.
#[cfg(feature = "page")]
pub mod page {
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_page::*;
    #[doc(hidden)]
    pub use somatic_page::{
        EventKind, History, Mode, PageInfo, PageInput, PageScene, Publisher, RecordingEvents, Replies, Request, Series,
        ViewerId,
    };
    #[doc(inline)]
    pub use somatic_page::{Listen, Server};
}

/// Robots: where their links are, and their topics in ROS 2.
pub mod robot {
    #[doc(inline)]
    pub use somatic_robot::robot::messages;
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_robot::robot::*;
    #[cfg(feature = "mcap")]
    #[doc(inline)]
    pub use somatic_robot::robot::{BagSource, joint_states_of_bag};
    #[cfg(feature = "mcap")]
    #[doc(hidden)]
    pub use somatic_robot::robot::{DelayEstimate, Transport};
    #[cfg(feature = "meshes")]
    #[doc(inline)]
    pub use somatic_robot::robot::{JointOptions, JointedSource, Kinematics};
    #[cfg(feature = "meshes")]
    #[doc(hidden)]
    pub use somatic_robot::robot::{LinkMatches, MAX_REST_ANGLE_RAD, MAX_REST_DISTANCE_M, drawn_poses};
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
    #[doc(hidden)]
    pub use somatic_sinks::sink::{
        LimbSends, News, Pressures, Question, RecordPart, SkinNames, TableColumn, TableName, TableType, TableWish,
        percept_columns, self_contact_columns, touch_columns,
    };
    #[cfg(feature = "mcap")]
    #[doc(inline)]
    pub use somatic_sinks::sink::{RecordingSink, Ros2BagSink};
    #[cfg(feature = "zenoh")]
    #[doc(hidden)]
    pub use somatic_sinks::sink::{limb_frame_bytes, limb_percept_bytes};
}

/// Bodies: links, surfaces and taxels, read from glTF and written to it.
pub mod body {
    #[doc(hidden)]
    pub use somatic_skin::body::{
        BODY_FROM_WORLD, Details, EdgeRow, Flaws, Glb, Hit, Home, LinkMimic, LinkMotion, Mark, MeshData, NONE,
        Original, Paint, Part, Sheet, SheetCell, Skinning, StoredEdges, SurfaceIndex, TaxelRow, TaxelSource, Topology,
        WORLD_FROM_BODY, WORLD_FROM_BODY_ROTATION, blend_skinning, heaviest_four, read_taxel_table, sheets,
        taxel_table,
    };
    #[doc(inline)]
    pub use somatic_skin::body::{
        Body, ChartKind, ChartSpec, FieldSpec, Link, LinkJoint, MAX_TAXEL_ID, MemberSpec, Modality, Surface, Taxel, Up,
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
    pub use somatic_skin::field::{Chart, Field, FieldSet, Member, NoChart, TaxelGraph, WORLD};
    #[doc(hidden)]
    pub use somatic_skin::field::{
        ContactTolerance, Distortion, Lattice, Lift, RestOverlap, Unroller, geodesic, mean_normals, neighbours,
        rest_overlaps, unions,
    };
}

/// What sensors say: frames of raw values, calibrations, wirings and drift.
pub mod signal {
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_skin::signal::*;
    #[doc(hidden)]
    pub use somatic_skin::signal::{
        BoardHealth, Checks, ContactThresholds, DriftKeys, FARTHEST_POSE_M, FrameBlock, LaidOver, Mark, Onset, UnitOfP,
    };
    #[doc(inline)]
    pub use somatic_skin::signal::{
        Calibration, ChangeCalibration, Curve, Frame, FrameTime, FsrCircuit, FsrResponse, FsrSignal, LayerResponse,
        Letter, Pose, Quantity, RawValue, Receptor, Response, Sensors, TaxelCalibration, Unfit, WiredBoard, Wiring,
    };
}

/// Outputs: the only code that writes files, and the checks of where it may write.
pub mod output {
    #[cfg(unix)]
    #[doc(hidden)]
    pub use somatic_skin::output::OutputLink;
    #[allow(unused_imports, reason = "which of them are used depends on features")]
    pub(crate) use somatic_skin::output::*;
    #[doc(hidden)]
    pub use somatic_skin::output::{GrowingFile, OutputFolder, PrivateFile, abandon_outputs, refuse_standard_output};
    #[doc(inline)]
    pub use somatic_skin::output::{OutputFile, OutputPath, OutputPaths};
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
pub use somatic_engine::{Agreement, ComparedColumn, Comparison, Engine, EngineState, Options, Verdict};
#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_engine::{engine, stage};
#[allow(unused_imports, reason = "which of them are used depends on features")]
use somatic_sources::limb;
