//! Sources: where frames come from.
//!
//! A source knows the taxel ids it delivers and nothing of engines; of bodies only the simulated one does.

mod csv;
mod csv_file;
mod ndjson;
#[cfg(feature = "cli")]
mod ports;
#[cfg(feature = "mcap")]
mod recorded;
mod replay;
#[cfg(feature = "cli")]
mod serial;
mod simulated;
mod spec;
mod unknown;

pub use self::csv::CsvSource;
pub use csv_file::CsvFile;
pub use ndjson::NdjsonSource;
#[cfg(feature = "cli")]
pub use ports::{PortSummary, serial_ports};
pub use replay::{Cut, Replay};
#[cfg(feature = "cli")]
pub use serial::{BoardAccount, BoardState, ChannelTap, Lines, Notice, SerialOptions, SerialSource, TapTrouble};
pub use simulated::{SimulatedSource, Truth, write_recording};
pub use spec::SourceSpec;

use std::time::Instant;

use crate::error::Result;
use crate::signal::Frame;

/// Something that delivers frames.
pub trait Source {
    /// The taxel ids whose values its frames hold, in the order of [`Frame::values`].
    fn taxels(&self) -> &[u32];

    /// Reads the next frame into `frame`, whose `values` already have the right length. `false` at the end.
    ///
    /// # Errors
    /// What arrived cannot be understood; the message names the place.
    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool>;

    /// How much of the whole has been read, in 0..=1, where that is known.
    fn progress(&self) -> Option<f64> {
        None
    }

    /// Says that nothing before `t_s` is wanted: a source that can pass over it without reading it does so.
    fn skip_to(&mut self, _t_s: f64) {}

    /// From now on gives what is known to be stale as [`crate::RawValue::STALE`], not as missing: for engines that heed it.
    fn tell_stale(&mut self) {}

    /// Whether any value so far is stale, which an engine has to heed then.
    fn has_stale(&self) -> bool {
        false
    }

    /// When the last byte of the last frame was read, where that is known; asked for once a frame.
    fn read_at(&mut self) -> Option<Instant> {
        None
    }

    /// What is to be said of the frames since the last call, a line each.
    fn notices(&mut self) -> Vec<String> {
        Vec::new()
    }

    /// What arrived and was never processed, such as a truncated last row; told to the user, exit code 3.
    fn losses(&self) -> Vec<String> {
        Vec::new()
    }
}
