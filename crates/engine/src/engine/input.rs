//! What a call of the engine gets.

use crate::backend::Delivered;
use crate::signal::Frame;

/// What a call gets.
#[derive(Clone, Copy)]
pub(super) struct Input<'a> {
    /// Times and poses.
    pub(super) frames: &'a [Frame],
    /// Values, which frames in one slice have there.
    pub(super) values: Delivered<'a>,
}

impl<'a> Input<'a> {
    /// Frames that have their values.
    pub(super) fn from_frames(frames: &'a [Frame]) -> Self {
        Self { frames, values: Delivered::Frames(frames) }
    }
}

/// Asked between the parts of a long call, with the number of frames that are done: whether to go on.
pub(super) type GoOn<'a> = &'a mut dyn FnMut(usize) -> bool;
