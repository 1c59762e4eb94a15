//! Sources: where frames come from.
//!
//! A source knows the ids of the taxels it delivers; only the simulated one knows a body.

mod bag_name;
#[cfg(any(feature = "serial", feature = "zenoh"))]
mod boards;
mod column_names;
mod csv;
mod csv_cells;
mod csv_file;
mod csv_header;
mod csv_named;
mod gzip;
mod joint_states;
#[cfg(feature = "parquet")]
mod lerobot;
mod lerobot_name;
#[cfg(feature = "zenoh")]
mod limbs;
mod map;
mod ndjson;
#[cfg(feature = "serial")]
mod ports;
#[cfg(feature = "mcap")]
mod recorded;
mod refused;
mod replay;
#[cfg(any(feature = "serial", feature = "zenoh", feature = "mcap"))]
pub mod send_rate;
#[cfg(feature = "serial")]
mod serial;
mod simulated;
mod sizes;
mod skipped_bad;
mod spec;
mod text;
mod time_column;
mod unknown_taxels;
mod vendor;

pub use self::bag_name::BagName;
pub use self::csv::CsvSource;
#[cfg(feature = "parquet")]
pub use self::lerobot::LeRobotSource;
pub use self::lerobot_name::LeRobotName;
#[cfg(any(feature = "serial", feature = "zenoh"))]
pub use boards::{BoardAccount, BoardState, ChannelWiper, LimbPercepts, Lines, Notice, WiperTrouble};
pub use csv_file::CsvFile;
pub use joint_states::{JointPosition, JointStates, position_between};
#[cfg(feature = "zenoh")]
pub use limbs::{LimbOptions, LimbSource};
pub use map::{
    ArrayMap, ArrayPath, Came, Decoder, Dimension, JsonLines, Lies, MapTime, MappedSource, Messages, Step,
    named_sensors, order,
};
pub use ndjson::NdjsonSource;
#[cfg(feature = "serial")]
pub use ports::{PortSummary, serial_ports};
pub use replay::{Cut, Replay};
#[cfg(feature = "serial")]
pub use serial::{SerialOptions, SerialSource};
pub use simulated::{GivenPress, GivenPresses, GivenTruth, NoisySensors};
pub use simulated::{SimulatedSource, Truth, write_recording, write_recording_with_progress};
pub use skipped_bad::SkippedBad;
pub use spec::SourceSpec;
pub use text::{FrameEnd, TextColumns, TextIds, TextOptions, TextPlace, TextSource, TextTime, TimeColumnName};
pub use vendor::{Cell, Layout, Panel, VendorFormat, VendorOptions, VendorSource};

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use crate::error::Result;
use crate::signal::Frame;

/// Something that delivers frames.
pub trait Source {
    /// The ids of the frames' taxels, in the order of [`Frame::values`].
    fn taxels(&self) -> &[u32];

    /// Reads the next frame into `frame`, whose `values` already have the right length. `false` at the end.
    ///
    /// # Errors
    /// The input is invalid; the message names the place.
    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool>;

    /// The source that this one changes, if it is one around another: what it does not do itself is done by that.
    fn wrapped(&self) -> Option<&dyn Source> {
        None
    }

    /// As [`wrapped`](Self::wrapped); both or neither.
    fn wrapped_mut(&mut self) -> Option<&mut dyn Source> {
        None
    }

    /// Has a read that waits for frames end once `stopped` is set, from any thread, as if there were no other one: nobody reads them then.
    /// What reads to an end by itself does not heed it.
    fn stop_by(&mut self, stopped: &Arc<AtomicBool>) {
        if let Some(source) = self.wrapped_mut() {
            source.stop_by(stopped);
        }
    }

    /// The share of the input that has been read, 0..=1, if known.
    fn progress(&self) -> Option<f64> {
        self.wrapped()?.progress()
    }

    /// Lets the source skip frames before `t_s`, if it can do so without reading them.
    fn skip_to(&mut self, t_s: f64) {
        if let Some(source) = self.wrapped_mut() {
            source.skip_to(t_s);
        }
    }

    /// From now on delivers stale values as [`RawValue::STALE`](somatic_skin::signal::RawValue::STALE) instead of as missing, for engines
    /// that track them.
    fn report_stale(&mut self) {
        if let Some(source) = self.wrapped_mut() {
            source.report_stale();
        }
    }

    /// Whether any value so far was stale.
    fn has_stale(&self) -> bool {
        self.wrapped().is_some_and(Source::has_stale)
    }

    /// When the last byte of the last frame was read, if known; call it once per frame.
    fn read_at(&mut self) -> Option<Instant> {
        self.wrapped_mut()?.read_at()
    }

    /// Messages about the frames since the last call, a line each.
    fn notices(&mut self) -> Vec<String> {
        self.wrapped_mut().map_or_else(Vec::new, Source::notices)
    }

    /// What is to be said if no further frame is read, a line each.
    fn closing(&self) -> Vec<String> {
        self.wrapped().map_or_else(Vec::new, Source::closing)
    }

    /// Input that was never processed, such as a truncated last row; reported to the user, exit code 3.
    fn losses(&self) -> Vec<String> {
        self.wrapped().map_or_else(Vec::new, Source::losses)
    }
}
