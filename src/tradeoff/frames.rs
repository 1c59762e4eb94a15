//! Frames to measure on.

use crate::signal::Frame;
use crate::source::Truth;

/// Frames, and their truth if known.
#[derive(Clone, Debug, Default)]
pub struct TestFrames {
    /// Their source, for display.
    pub source: String,
    /// The ids of their taxels.
    pub taxels: Vec<u32>,
    /// The frames.
    pub frames: Vec<Frame>,
    /// Per frame; empty if unknown.
    pub truth: Vec<Vec<Truth>>,
}
