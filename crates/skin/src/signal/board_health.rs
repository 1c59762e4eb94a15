//! How the boards of a robot are doing.

use serde::Serialize;

/// How a board is doing.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BoardHealth {
    /// What people call it.
    pub name: String,
    /// Its state in a word, such as `speaking` or `unplugged`.
    pub state: String,
    /// Frames a second, Hz, once known.
    pub rate_hz: Option<f64>,
    /// Frames received intact.
    pub frames: u64,
    /// Frames lost.
    pub lost: u64,
    /// Time since the last frame, s, once there was one.
    pub age_s: Option<f64>,
}
