//! Where joints are at a frame's time, by the stamps of states that come live. No I/O.

use std::collections::{BTreeMap, VecDeque};

use crate::signal::FrameTime;
use crate::source::position_between;

/// How long states are kept, s: frames that are later than that on their way are not matched with states.
const KEPT_S: f64 = 2.0;

/// The states that have come, by joint.
#[derive(Debug, Default)]
pub(super) struct StampedStates {
    joints: BTreeMap<String, Track>,
}

/// The states of a joint.
#[derive(Debug, Default)]
struct Track {
    /// Stamps and positions, in the order of the stamps.
    states: VecDeque<(FrameTime, f64)>,
    /// Whether the newest has been given to no frame.
    is_new: bool,
}

impl StampedStates {
    /// Adds a state.
    pub(super) fn add(&mut self, joint: &str, stamp: FrameTime, position: f64) {
        if !self.joints.contains_key(joint) {
            self.joints.insert(joint.to_owned(), Track::default());
        }
        let Some(track) = self.joints.get_mut(joint) else { return };
        match track.states.back().map(|newest| stamp.since(newest.0)) {
            // The clock was set back, as a simulation's that starts anew.
            Some(later_s) if later_s < -KEPT_S => track.states.clear(),
            // Of two publishers one may be late; what is between is known already.
            Some(later_s) if later_s <= 0.0 => return,
            _ => {}
        }
        track.states.push_back((stamp, position));
        track.is_new = true;
        while track.states.front().is_some_and(|state| stamp.since(state.0) > KEPT_S) {
            track.states.pop_front();
        }
    }

    /// The stamp of the newest state.
    pub(super) fn newest(&self) -> Option<FrameTime> {
        let newest = self.joints.values().filter_map(|track| track.states.back());
        newest.map(|state| state.0).max_by(FrameTime::total_cmp)
    }

    /// Gives `put` each joint whose position at `time` is known: between two states, or the newest, which holds on, once.
    pub(super) fn at(&mut self, time: FrameTime, mut put: impl FnMut(&str, f64)) {
        for (joint, track) in &mut self.joints {
            let later = track.states.partition_point(|state| state.0.since(time) < 0.0);
            let position = match (later.checked_sub(1).map(|earlier| track.states[earlier]), track.states.get(later)) {
                (_, Some(&(stamp, position))) if stamp == time => position,
                // No joint turns half a turn from one state to the next; those without end jump there.
                (Some(earlier), Some(&later)) => position_between(earlier, later, time, true),
                (Some((_, newest)), None) if track.is_new => newest,
                _ => continue,
            };
            track.is_new = track.is_new && later < track.states.len();
            put(joint, position);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(states: &mut StampedStates, t_s: f64) -> Vec<(String, f64)> {
        let mut found = Vec::new();
        states.at(t_s.into(), |joint, position| found.push((joint.to_owned(), position)));
        found
    }

    #[test]
    fn a_position_is_between_two_states_and_the_newest_is_given_once() {
        let mut states = StampedStates::default();
        for at in 0..5 {
            states.add("a", f64::from(at).into(), f64::from(at) * 0.5);
        }
        states.add("b", 1.0.into(), 7.0);
        let a = |position: f64| ("a".to_owned(), position);
        assert_eq!(found(&mut states, 0.0), []);
        assert_eq!(states.newest(), Some(4.0.into()));
        // The first two are too old to be kept.
        assert_eq!(found(&mut states, 2.25), [a(1.125), ("b".to_owned(), 7.0)]);
        assert_eq!(found(&mut states, 3.0), [a(1.5)]);
        assert_eq!(found(&mut states, 4.5), [a(2.0)]);
        assert_eq!(found(&mut states, 4.6), []);
        states.add("a", 5.0.into(), 2.5);
        // Late and repeated states change nothing.
        states.add("a", 4.9.into(), 0.0);
        states.add("a", 5.0.into(), 0.0);
        assert_eq!(found(&mut states, 4.75), [a(2.375)]);
        assert_eq!(found(&mut states, 5.5), [a(2.5)]);
        // A clock that starts anew.
        states.add("a", 0.0.into(), 1.0);
        states.add("a", 1.0.into(), 2.0);
        assert_eq!(found(&mut states, 0.5), [a(1.5)]);
    }

    #[test]
    fn a_joint_without_end_goes_the_short_way_over_half_a_turn() {
        let mut states = StampedStates::default();
        states.add("a", 0.0.into(), 3.0);
        states.add("a", 1.0.into(), -3.0);
        let expected = 3.0 + (std::f64::consts::TAU - 6.0) * 0.5;
        assert!((found(&mut states, 0.5)[0].1 - expected).abs() < 1e-15);
    }

    #[test]
    fn stamps_since_1970_are_distinguished_to_the_nanosecond() {
        let at = |ns: i64| FrameTime::from_ns(1_700_000_000_123_456_789 + ns);
        let mut states = StampedStates::default();
        states.add("a", at(0), 0.0);
        states.add("a", at(100), 1.0);
        let mut found = Vec::new();
        states.at(at(25), |_, position| found.push(position));
        states.at(at(99), |_, position| found.push(position));
        assert_eq!(found, [0.25, 0.99]);
        assert_eq!(states.newest(), Some(at(100)));
    }
}
