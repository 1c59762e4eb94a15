//! Frames in one slice, as arrays of other languages have them.

use super::{Pose, RawValue};

/// Frames whose values lie in one slice, one after the other.
///
/// [`RawValue`] has the bits of an `f32`, so that an array of these is one of raw values without a copy
/// (`bytemuck::cast_slice`): NaN and infinities are faulty, and [`RawValue::MISSING`] is a NaN that no arithmetic makes.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameBlock<'a> {
    /// By frame, its time, s.
    pub t_s: &'a [f64],
    /// Frame by frame, as many as the engine listens to.
    pub values: &'a [RawValue],
    /// By link, its name and its pose in each frame; empty where nothing moves.
    pub poses: &'a [(String, Vec<Pose>)],
}
