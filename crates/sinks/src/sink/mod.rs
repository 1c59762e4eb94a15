//! Sinks: where percepts go.
//!
//! A sink gets the fields' names once; only recordings use bodies and frames.

#[cfg(any(test, feature = "ros2", feature = "zenoh"))]
mod handover;
mod header;
mod json;
mod line;
mod ndjson;
#[cfg(feature = "page")]
mod page;
#[cfg(feature = "mcap")]
mod percept_schema;
#[cfg(feature = "mcap")]
mod recorded;
#[cfg(feature = "mcap")]
mod ros2;
mod ros_time;
mod spec;
mod table;
mod touch_line;
#[cfg(feature = "mcap")]
mod touch_mark;
#[cfg(feature = "mcap")]
mod view;
#[cfg(feature = "zenoh")]
mod zenoh_sink;

pub use crate::limb::LimbSends;
pub use ndjson::NdjsonSink;
#[cfg(feature = "page")]
pub use page::PageSink;
#[cfg(feature = "mcap")]
pub use recorded::RecordingSink;
pub use ros_time::RosTime;
#[cfg(feature = "mcap")]
pub use ros2::Ros2BagSink;
#[cfg(feature = "ros2")]
pub use ros2::Ros2Sink;
pub use spec::{SinkSpec, SinkTarget, TableName, TableWish};
#[cfg(feature = "parquet")]
pub use table::ParquetSink;
#[cfg(feature = "arrow")]
pub use table::{ArrowTable, TableKind};
pub use table::{CsvSink, TableColumn, TableType, percept_columns, self_contact_columns, touch_columns};
pub use touch_line::SkinNames;
#[cfg(feature = "zenoh")]
pub use zenoh_sink::{ZenohSink, limb_frame_bytes, limb_percept_bytes};

use std::str::FromStr;
use std::time::{Duration, Instant};

use crate::body::Body;
use crate::error::{Error, Result, nearest};
use crate::percept::{Outputs, Percepts};
use crate::scene::{Plan, PlannedField, SensedTaxels, SensedValue};
use crate::signal::{BoardHealth, Frame, RawValue, Reading, Wiring};

/// Something that takes percepts.
pub trait Sink {
    /// What people are to know before the first frame, a line each: what the output will not hold, and why.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }

    /// Takes the frames of the next percepts. Sinks of percepts ignore them.
    ///
    /// # Errors
    /// As [`Sink::write`].
    fn write_input(&mut self, _heard: &InputFrames<'_>) -> Result<Flow> {
        Ok(Flow::Open)
    }

    /// Takes all frames of `percepts`.
    ///
    /// # Errors
    /// They cannot be written; the message names the output.
    fn write(&mut self, percepts: &Percepts) -> Result<Flow>;

    /// Takes news of the source's boards. Sinks of percepts ignore it.
    ///
    /// # Errors
    /// As [`Sink::write`].
    fn write_news(&mut self, _news: &News) -> Result<Flow> {
        Ok(Flow::Open)
    }

    /// Takes percepts that limbs on other computers have computed, each a line of NDJSON without its end. Only NDJSON holds
    /// them; other sinks ignore them.
    ///
    /// # Errors
    /// As [`Sink::write`].
    fn write_percepts_of_limbs(&mut self, _lines: &[String]) -> Result<Flow> {
        Ok(Flow::Open)
    }

    /// The frames that follow are of another recording: that of the place `index` in [`Session::recordings`], the next one. Only tables
    /// hold several.
    ///
    /// # Errors
    /// As [`Sink::write`].
    fn begin_recording(&mut self, _index: usize) -> Result<Flow> {
        Ok(Flow::Open)
    }

    /// Percepts of the next frame that somebody behind the sink asks to have explained.
    fn questions(&mut self) -> Vec<Question> {
        Vec::new()
    }

    /// Writes buffered output: at once, or in a recording within half a second.
    ///
    /// # Errors
    /// As [`Sink::write`].
    fn flush(&mut self) -> Result<Flow>;

    /// Completes the output. A sink dropped without this leaves no file, except a partial recording.
    ///
    /// # Errors
    /// As [`Sink::write`].
    fn finish(self: Box<Self>) -> Result<()>;

    /// Ends the output before the recording has ended that it is made of. Streams keep what they have; files that appear when
    /// they are whole do not appear. Gives the name of a file that is not there for this reason.
    ///
    /// # Errors
    /// As [`Sink::write`].
    fn finish_early(self: Box<Self>) -> Result<Option<String>> {
        self.finish().map(|()| None)
    }
}

/// Whether the output is still open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use = "writing on after the reader has gone is wasted work"]
pub enum Flow {
    /// Go on.
    Open,
    /// The reader has closed the pipe, which is a normal end.
    Closed,
}

/// A percept to explain.
pub struct Question {
    /// Its field, as [`Percept::field`](somatic_engine::percept::Percept::field) counts.
    pub field: usize,
    /// Takes the answer: the message `explain` of `docs/reference/page.md`.
    pub answer: Box<dyn FnOnce(String) + Send>,
}

/// The names of a field in the output.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FieldNames {
    /// The field's name.
    pub field: String,
    /// The link in whose frame its position and normal are given: its anchor.
    pub link: String,
    /// The frame of those that are in the world: `world`, or the link that stands for it.
    pub world: String,
    /// Its letter, if the output names it, such as `sustained` or `temperature`.
    pub letter: Option<String>,
    /// Its signal, if the output names it: `raw` or `linear`.
    pub signal: Option<String>,
}

impl FieldNames {
    /// The names of the fields of `plan`, in their order.
    #[must_use]
    pub fn all_of(plan: &Plan) -> Vec<Self> {
        let name = |(index, field): (usize, PlannedField<'_>)| {
            let mark = plan.mark(index);
            Self {
                field: field.name.into(),
                link: field.link.into(),
                world: plan.world().into(),
                letter: mark.receptor.map(|receptor| receptor.to_string()),
                signal: mark.signal.map(|signal| signal.to_string()),
            }
        };
        plan.fields().enumerate().map(name).collect()
    }

    /// The same with a field's letter and signal, if there are any, as a part of its name.
    #[cfg(feature = "mcap")]
    fn with_marks(&self) -> Self {
        let marks = [&self.letter, &self.signal].into_iter().flatten();
        Self { field: marks.fold(self.field.clone(), |name, mark| format!("{name} ({mark})")), ..self.clone() }
    }
}

/// Frames, and access to their forces.
pub struct InputFrames<'a> {
    /// The frames.
    pub frames: &'a [Frame],
    /// Replaces a list by the taxel ids and pressures of one of the frames.
    pub pressures: &'a Pressures<'a>,
    /// Replaces a list by what taxels of other kinds read in one of the frames, by itself.
    pub sensed: &'a dyn Fn(&Frame, &SensedTaxels, &mut Vec<SensedValue>),
    /// The plan that they went through, as it is after the last one.
    pub plan: &'a Plan,
    /// The values that the last frame's percepts are made of ([`Engine::values_read`](somatic_engine::Engine::values_read)).
    pub values_read: Option<&'a [RawValue]>,
    /// What is wrong with values that were corrected ([`Engine::values_noted`](somatic_engine::Engine::values_noted)).
    pub values_noted: &'a [(usize, Reading)],
    /// The values that its letters beside pressure are made of ([`Engine::values_sensed`](somatic_engine::Engine::values_sensed)).
    pub values_sensed: &'a [RawValue],
    /// When the last frame arrived, if known.
    pub arrived: Option<Instant>,
    /// How long the engine's call took.
    pub call: Duration,
}

somatic_skin::debug_by_name!(InputFrames<'_>);

/// Writes taxel ids and pressures, or other forces, of a frame into a list.
pub type Pressures<'a, Force = f64> = dyn Fn(&Frame, &mut Vec<(u32, Force)>) + 'a;

/// How boards are doing, and messages: time (s) and text.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct News {
    /// How each board is doing, if it is time to tell.
    pub boards: Option<Vec<BoardHealth>>,
    /// Messages about boards since the last news.
    pub notices: Vec<(f64, String)>,
    /// Messages about taxels that are left out, or used again.
    pub taxels: Vec<(f64, String)>,
}

/// What sinks get before the first frame.
#[derive(Clone, Debug, Default)]
pub struct Session<'a> {
    /// The names of the fields.
    pub names: Vec<FieldNames>,
    /// Whether fields without contact are listed.
    pub all_fields: bool,
    /// The outputs of the percepts.
    pub outputs: Outputs,
    /// Whether the percepts are in double precision.
    pub is_double: bool,
    /// What pressures are measured in; empty where it is unknown.
    pub p_unit: &'a str,
    /// Whether NDJSON begins with a line that says units and body.
    pub header: bool,
    /// The ids of a frame's values, in their order.
    pub taxels: &'a [u32],
    /// The robot.
    pub body: Option<&'a Body>,
    /// Files that say what is run, for recordings and tables: name, media type, bytes.
    pub attached: Vec<(String, String, Vec<u8>)>,
    /// The parts that recordings hold; empty for all.
    pub parts: Vec<RecordPart>,
    /// What is run.
    pub plan: Option<&'a Plan>,
    /// What people call the source.
    pub source: &'a str,
    /// What people call each recording, if there are several, one after the other; empty for any other source.
    pub recordings: &'a [String],
    /// The backend: its name, what it runs on, and why it was chosen.
    pub backend: [&'a str; 3],
    /// Whether the frames are those of a recording, which ends: a recording or bag that is made of them appears when it is whole.
    /// Else it grows under its own name, as what is live can be had only once.
    pub is_recorded: bool,
    /// The map from channels of boards to taxels.
    pub wiring: Option<&'a Wiring>,
    /// Zenoh's own configuration, a file; without one limbs send to this computer alone.
    pub zenoh_config: Option<&'a std::path::Path>,
    /// Which times messages of ROS have.
    pub ros_time: RosTime,
}

impl Session<'_> {
    /// The names that touches of the whole body refer to; `None` if none are looked for.
    #[must_use]
    pub fn skin(&self) -> Option<SkinNames> {
        SkinNames::for_plan(self.body?, self.plan?)
    }
}

/// A part of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordPart {
    /// Raw frames.
    Frames,
    /// Percepts, as in NDJSON.
    Percepts,
    /// What viewers show: taxels with pressures, touches, links.
    View,
}

impl FromStr for RecordPart {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let all = [("frames", Self::Frames), ("percepts", Self::Percepts), ("view", Self::View)];
        if let Some((_, part)) = all.iter().find(|(known, _)| *known == name) {
            return Ok(*part);
        }
        let near = nearest(name, all.map(|(name, _)| name)).map(|near| format!("; did you mean `{near}`?"));
        let hint = near.unwrap_or_else(|| "; choose of frames, percepts and view".to_owned());
        Err(Error::usage(format!("a recording has no `{name}`{hint}")))
    }
}
