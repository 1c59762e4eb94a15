//! A sense of touch for whole robots: touch frames in, percepts out.
//!
//! A robot's skin is a set of **taxels**, sensors that sit on its surface. A **receptive field** is a named set of taxels;
//! fields overlap and nest. For every field and every frame `somatic` gives a **percept**: how hard the field is pressed
//! and where, how what presses it is oriented, how it moves. What is not defined is absent with a reason, never NaN and
//! never 0.
//!
//! # The way through
//!
//! 1. A [`Body`] is read from glTF: links, surfaces, taxels, and the outlines of fields. `docs/layout.md` specifies the
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
pub mod expected;
#[cfg(feature = "cli")]
pub mod figure;
#[cfg(feature = "cli")]
mod ink;
#[cfg(all(feature = "cli", feature = "gpu"))]
pub mod picture;
#[cfg(feature = "cli")]
pub mod plot;
#[cfg(feature = "cli")]
pub mod tradeoff;

pub use somatic_skin::{error, limits, plain, renamed};
// The same paths in this crate as if they were its own.
#[allow(unused_imports, reason = "which of them are used hangs on features")]
use somatic_skin::{colours, keys, length, parallel, random};

/// Authoring: taxels placed on a surface, fields of them, and what is wrong with a layout.
pub mod author {
    #[cfg(feature = "meshes")]
    #[doc(inline)]
    pub use somatic_author::mesh;
    #[allow(unused_imports, reason = "which of them are used hangs on features")]
    pub(crate) use somatic_author::*;
    #[doc(inline)]
    pub use somatic_author::{
        Authored, Coverage, DrawnPoses, Finding, FindingKind, GridOrder, Hole, LinkCoverage, LinkShare, PlaceReport,
        Placed, Progress, Recipe, Sheet, SheetCell, SheetGrid, SurfacePoint, author, author_csv_skin, author_icub,
        author_sheets, author_while, blend_skinning, cell_spread, coverage, group, heaviest_four, icub, lint,
        lint_in_poses, lint_with_progress, place_apart, place_by_density, place_evenly, recipe_values, refresh, sheets,
        widest_radius,
    };
}

/// Backends, which compute percepts, and what they run on.
pub mod backend {
    #[cfg(feature = "gpu")]
    #[doc(inline)]
    pub use somatic_engine::backend::gpu;
    #[allow(unused_imports, reason = "which of them are used hangs on features")]
    pub(crate) use somatic_engine::backend::*;
    #[doc(inline)]
    pub use somatic_engine::backend::{BackendKind, processor};
}

/// How much each sensor says of what it feels, from recorded touches.
pub mod gains {
    #[allow(unused_imports, reason = "which of them are used hangs on features")]
    pub(crate) use somatic_engine::gains::*;
    #[doc(inline)]
    pub use somatic_engine::gains::{GainsEstimate, GainsSurvey};
}

/// What a field reports for a frame, and a touch: quantities that are present or absent with a reason.
pub mod percept {
    #[allow(unused_imports, reason = "which of them are used hangs on features")]
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
    #[allow(unused_imports, reason = "which of them are used hangs on features")]
    pub(crate) use somatic_engine::scene::*;
    #[doc(inline)]
    pub use somatic_engine::scene::{
        Arithmetic, AskedOutputs, Cadence, Charts, Coordinates, Coverage, FilterBy, Knobs, MotionFilter, OrientationBy,
        Plan, PlannedStage, Scene, choose_fields,
    };
}

/// Touches of the whole body, found on its skin.
pub mod touch {
    #[allow(unused_imports, reason = "which of them are used hangs on features")]
    pub(crate) use somatic_engine::touch::*;
    #[doc(inline)]
    pub use somatic_engine::touch::{
        Input, Options, Reading, Skin, SkinParts, SkinTaxel, Splits, TouchState, Touches, Unrolled,
    };
}

/// Recordings in MCAP, and bags of ROS 2.
#[cfg(feature = "mcap")]
pub mod recording {
    #[allow(unused_imports, reason = "which of them are used hangs on features")]
    pub(crate) use somatic_recording::*;
    #[doc(inline)]
    pub use somatic_recording::{
        Attached, BODY, BagSurvey, CALIBRATION, FIELDS, FRAMES, LINKS, PERCEPTS, Reader, Recorder, Rhythm, SCENE,
        SURFACE, Survey, SurveyedTopic, TAXELS, TOUCHES, Topic,
    };
}

/// Where frames come from.
pub mod source {
    #[allow(unused_imports, reason = "which of them are used hangs on features")]
    pub(crate) use somatic_sources::source::*;
    #[doc(inline)]
    pub use somatic_sources::source::{
        BagName, Cell, CsvFile, CsvSource, Cut, FrameEnd, JointPosition, JointStates, Layout, NdjsonSource, Panel,
        Replay, SimulatedSource, Source, SourceSpec, TextColumns, TextIds, TextOptions, TextPlace, TextSource,
        TextTime, TimeColumnName, Truth, VendorFormat, VendorOptions, VendorSource, write_recording,
        write_recording_with_progress,
    };
    #[cfg(any(feature = "serial", feature = "zenoh"))]
    #[doc(inline)]
    pub use somatic_sources::source::{
        BoardAccount, BoardState, ChannelWiper, LimbPercepts, Lines, Notice, WiperTrouble,
    };
    #[cfg(feature = "zenoh")]
    #[doc(inline)]
    pub use somatic_sources::source::{LimbOptions, LimbSource};
    #[cfg(feature = "serial")]
    #[doc(inline)]
    pub use somatic_sources::source::{PortSummary, SerialOptions, SerialSource, serial_ports};
}

/// The serial protocol between sensor boards and the host.
pub mod wire {
    #[doc(inline)]
    pub use somatic_sources::board;
    #[doc(inline)]
    pub use somatic_wire::encode;
    #[allow(unused_imports, reason = "which of them are used hangs on features")]
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
    #[allow(unused_imports, reason = "which of them are used hangs on features")]
    pub(crate) use somatic_page::*;
    #[doc(inline)]
    pub use somatic_page::{
        EventKind, History, Listen, Mode, PageInfo, PageInput, PageScene, Publisher, Replies, Request, Series, Server,
        ViewerId,
    };
}

/// Robots: where their links are, and their topics in ROS 2.
pub mod robot {
    #[doc(inline)]
    pub use somatic_robot::robot::messages;
    #[allow(unused_imports, reason = "which of them are used hangs on features")]
    pub(crate) use somatic_robot::robot::*;
    #[cfg(feature = "mcap")]
    #[doc(inline)]
    pub use somatic_robot::robot::{BagSource, DelayEstimate, Transport, joint_states_of_bag};
    #[cfg(feature = "meshes")]
    #[doc(inline)]
    pub use somatic_robot::robot::{
        JointOptions, JointedSource, Kinematics, LinkMatches, MAX_REST_ANGLE_RAD, MAX_REST_DISTANCE_M, drawn_poses,
    };
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
    #[allow(unused_imports, reason = "which of them are used hangs on features")]
    pub(crate) use somatic_sinks::sink::*;
    #[cfg(feature = "arrow")]
    #[doc(inline)]
    pub use somatic_sinks::sink::{ArrowTable, TableKind};
    #[doc(inline)]
    pub use somatic_sinks::sink::{
        CsvSink, FieldNames, Flow, InputFrames, LimbSends, NdjsonSink, News, Pressures, Question, RecordPart, Session,
        Sink, SinkSpec, SinkTarget, SkinNames, TableColumn, TableName, TableType, TableWish, percept_columns,
        self_contact_columns, touch_columns,
    };
    #[cfg(feature = "mcap")]
    #[doc(inline)]
    pub use somatic_sinks::sink::{RecordingSink, Ros2BagSink, RosTime};
    #[cfg(feature = "zenoh")]
    #[doc(inline)]
    pub use somatic_sinks::sink::{ZenohSink, limb_frame_bytes, limb_percept_bytes};
}

/// Bodies: links, surfaces and taxels, read from glTF and written to it.
pub mod body {
    #[doc(inline)]
    pub use somatic_skin::body::{
        BODY_FROM_WORLD, Body, ChartKind, ChartSpec, Details, EdgeRow, FieldSpec, Flaws, Glb, Hit, Home, Link,
        LinkJoint, LinkMimic, LinkMotion, MAX_TAXEL_ID, Mark, MemberSpec, MeshData, Modality, NONE, Original, Paint,
        Part, Sheet, SheetCell, Skinning, StoredEdges, Surface, SurfaceIndex, Taxel, TaxelRow, TaxelSource, Topology,
        Up, WORLD_FROM_BODY, WORLD_FROM_BODY_ROTATION, blend_skinning, heaviest_four, read_taxel_table, sheets,
        taxel_table,
    };
    // For this crate alone.
    #[allow(unused_imports, reason = "which of them are used hangs on features")]
    pub(crate) use somatic_skin::body::*;
}

/// Receptive fields on a body's surface: distances, charts, cells and neighbours of taxels.
pub mod field {
    #[allow(unused_imports, reason = "which of them are used hangs on features")]
    pub(crate) use somatic_skin::field::*;
    #[doc(inline)]
    pub use somatic_skin::field::{
        Chart, ContactTolerance, Distortion, Field, FieldSet, Lift, Member, NoChart, RestOverlap, TaxelGraph, Unroller,
        WORLD, geodesic, mean_normals, neighbours, rest_overlaps, unions,
    };
}

/// What sensors say: frames of raw values, calibrations, wirings and drift.
pub mod signal {
    #[allow(unused_imports, reason = "which of them are used hangs on features")]
    pub(crate) use somatic_skin::signal::*;
    #[doc(inline)]
    pub use somatic_skin::signal::{
        BoardHealth, Calibration, ChangeCalibration, Checks, ContactThresholds, Curve, DriftKeys, FARTHEST_POSE_M,
        Frame, FrameBlock, FrameTime, FsrCircuit, FsrResponse, FsrSignal, LaidOver, LayerResponse, Letter, Mark, Onset,
        Pose, Quantity, RawValue, Receptor, Response, Sensors, TaxelCalibration, Unfit, UnitOfP, WiredBoard, Wiring,
    };
}

/// Outputs: the only code that writes files, and the checks of where it may write.
pub mod output {
    #[cfg(unix)]
    #[doc(inline)]
    pub use somatic_skin::output::OutputLink;
    #[allow(unused_imports, reason = "which of them are used hangs on features")]
    pub(crate) use somatic_skin::output::*;
    #[doc(inline)]
    pub use somatic_skin::output::{
        GrowingFile, OutputFile, OutputFolder, OutputPath, OutputPaths, PrivateFile, abandon_outputs,
        refuse_standard_output,
    };
}

pub use backend::BackendKind;
pub use body::Body;
pub use error::{Error, Result};
pub use output::OutputPath;
pub use percept::{
    COLUMNS, Column, ContactKind, FitSigma, Flags, Outputs, Percept, Percepts, Precision, SelfContact, SelfContactSide,
    TOUCH_COLUMNS, Touch, TouchColumn, TouchFit, TouchFlags, TouchFrame, TouchOutputs,
};
pub use scene::{Plan, Scene};
pub use signal::{Calibration, Frame, FrameTime, Letter, Pose, RawValue, Receptor};
pub use somatic_engine::{Agreement, ComparedColumn, Comparison, Engine, EngineState, Options, Verdict};
#[allow(unused_imports, reason = "which of them are used hangs on features")]
use somatic_engine::{engine, stage};
#[allow(unused_imports, reason = "which of them are used hangs on features")]
use somatic_sources::limb;
