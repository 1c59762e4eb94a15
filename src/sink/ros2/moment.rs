//! What a frame gives, kept until its messages are made.

use crate::percept::{Percept, Percepts};
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
    pub(super) touched: Vec<Percept>,
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
        self.touched.clear();
        self.touched.extend(percepts.touched(frame));
    }
}
