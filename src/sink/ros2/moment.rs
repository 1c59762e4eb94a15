//! What a frame gives, kept until its messages are made.

use crate::error::Error;
use crate::percept::{Column, Percepts};
use crate::signal::{Frame, Pose};
use crate::sink::Pressures;

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
    pub(super) touched: Vec<TouchedField>,
}

/// What markers show of a touched field. A whole percept is a kilobyte: filling one for each field took most of handing over.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct TouchedField {
    /// As [`crate::Percept::field`].
    pub(super) field: usize,
    /// Position (m) and normal, in the world or in the field's link.
    pub(super) position: Option<[f64; 3]>,
    pub(super) normal: Option<[f64; 3]>,
    pub(super) in_world: bool,
    pub(super) area_m2: Option<f64>,
}

impl TouchedField {
    pub(super) fn of(percepts: &Percepts, frame: usize, field: usize) -> Self {
        let value = |column| percepts.value(frame, field, column);
        Self {
            field,
            position: value(&Column::POSITION),
            normal: value(&Column::NORMAL),
            in_world: percepts.in_world(frame, field),
            area_m2: value(&Column::AREA).map(|[area_m2, ..]| area_m2),
        }
    }
}

/// Why percepts alone are refused.
pub(super) fn without_frames() -> Error {
    Error::failed("these percepts come without their frames, which messages of ROS 2 hold too")
}

impl Moment {
    /// Takes `frame`, whose messages are of the time `time_ns`.
    pub(super) fn read(&mut self, time_ns: u64, frame: &Frame, pressures: &Pressures<'_>) {
        self.time_ns = time_ns;
        self.t_s = frame.t_s;
        self.pose.clone_from(&frame.pose);
        self.has_stale_pose = frame.has_stale_pose;
        self.joints.clone_from(&frame.joints);
        pressures(frame, &mut self.pressures);
        self.touched.clear();
    }

    /// Takes the percepts of frame `frame` of `percepts`, which are its own.
    pub(super) fn feel(&mut self, percepts: &Percepts, frame: usize) {
        let touched = (0..percepts.fields()).filter(|&field| percepts.in_contact(frame, field));
        self.touched.clear();
        self.touched.extend(touched.map(|field| TouchedField::of(percepts, frame, field)));
    }
}
