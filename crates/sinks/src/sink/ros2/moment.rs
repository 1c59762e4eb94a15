//! What a frame gives, kept until its messages are made.

use crate::error::Error;
use crate::percept::{LinkShare, Percepts};
use crate::scene::{SensedTaxels, SensedValue};
use crate::signal::{Frame, Pose};
use crate::sink::InputFrames;
use crate::sink::touch_mark::TouchMark;

/// A frame and its percepts, as far as messages tell of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Moment {
    /// The time of its messages, ns.
    pub(super) time_ns: u64,
    /// The frame's own time, s.
    pub(super) t_s: f64,
    pub(super) pose: Vec<(String, Pose)>,
    pub(super) has_stale_pose: bool,
    pub(super) joints: Vec<(String, f64)>,
    /// By taxel id; those that are missing or rejected are left out.
    pub(super) pressures: Vec<(u32, f64)>,
    /// Of taxels of other kinds, and the tangential forces of those with three axes.
    pub(super) sensed: Vec<SensedValue>,
    /// Indices of the frame's values that did not come.
    pub(super) missing: Vec<usize>,
    /// The oldest first.
    pub(super) touches: Vec<FeltTouch>,
    /// What each of them presses on each link, one touch after the other.
    pub(super) presses: Vec<LinkShare>,
}

/// What markers show of a touch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct FeltTouch {
    pub(super) id: u64,
    /// Index of its link.
    pub(super) link: u32,
    /// Whether the mark is in the world, and not in that link.
    pub(super) in_world: bool,
    pub(super) mark: TouchMark,
}

/// Why percepts alone are refused.
pub(super) fn without_frames() -> Error {
    Error::failed("these percepts come without their frames, which messages of ROS 2 hold too")
}

impl Moment {
    /// Takes `frame` of `input`, whose messages are of the time `time_ns`; `taxels` are those of other kinds.
    pub(super) fn read(&mut self, time_ns: u64, frame: &Frame, input: &InputFrames<'_>, taxels: &SensedTaxels) {
        self.time_ns = time_ns;
        self.t_s = frame.t_s;
        self.pose.clone_from(&frame.pose);
        self.has_stale_pose = frame.has_stale_pose;
        self.joints.clone_from(&frame.joints);
        (input.pressures)(frame, &mut self.pressures);
        (input.sensed)(frame, taxels, &mut self.sensed);
        self.missing.clear();
        let values = frame.values.iter().enumerate();
        self.missing.extend(values.filter(|(_, value)| value.is_missing()).map(|(index, _)| index));
        self.touches.clear();
        self.presses.clear();
    }

    /// Takes the percepts of frame `frame` of `percepts`, which are its own.
    pub(super) fn feel(&mut self, percepts: &Percepts, frame: usize) {
        self.touches.clear();
        self.presses.clear();
        let Some(found) = percepts.touches(frame) else { return };
        for touch in &found.touches {
            let mark = TouchMark::from_touch(touch);
            self.touches.push(FeltTouch { id: touch.id, link: touch.link, in_world: touch.in_world, mark });
            self.presses.extend_from_slice(found.links(touch));
        }
    }
}
