//! Joint states from a topic of ROS 2, carried by the frames of another source.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::joint_positions::joint_positions;
use super::messages::{JointState, Message as _};
use super::stamped_states::StampedStates;
use crate::dds::{Delivery, Node, Reader};
use crate::error::{Error, Result, failed};
use crate::signal::Frame;
use crate::source::Source;

/// States that are kept until the next frame reads them.
const DEPTH: usize = 64;
/// How long the first state may take before a warning.
const COMES_WITHIN: Duration = Duration::from_secs(5);
/// How far stamps of one clock may be from the time of the frame that comes with them, s.
const ONE_CLOCK_S: f64 = 1.0;
/// The node's name.
const NODE: &str = "somatic_joints";

/// Which states belong to a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StatesTime {
    /// Those that have come since the frame before: the clocks have nothing in common.
    Arrival,
    /// Positions at its own time: between the positions of two stamps, or the last position if no later one has come.
    Stamp {
        /// How much later the joints' clock stamps an instant than the frames' clock, s.
        delay_s: f64,
    },
    /// [`StatesTime::Stamp`] without a delay where the first stamp is within a second of its frame's time, else
    /// [`StatesTime::Arrival`].
    Auto,
}

/// Frames of another source with the joint states of a topic.
pub struct LiveJoints {
    source: Box<dyn Source + Send>,
    name: String,
    node: Node,
    topics: Vec<String>,
    /// By topic.
    states: Vec<Reader<JointState>>,
    /// When it began to wait for the first state; nothing once that has come.
    waits_since: Option<Instant>,
    /// Whether it has reported that no state comes.
    has_reported: bool,
    time: StatesTime,
    /// Joints that have arrived since the last frame.
    arrived: BTreeMap<String, f64>,
    /// The states by their stamps.
    stamped: StampedStates,
    notice: Option<String>,
}

impl LiveJoints {
    /// Reads `topic`, whose messages are `sensor_msgs/msg/JointState`, for the frames of `source`; or several topics with commas between.
    ///
    /// # Errors
    /// There is no network, or the name is none of a topic.
    pub fn open(source: Box<dyn Source + Send>, topic: &str, time: StatesTime) -> Result<Self> {
        let name = format!("joint states `ros2:{topic}`");
        let at = |e: Error| e.at(&name);
        let mut node = Node::new("", NODE).map_err(at)?;
        let topics: Vec<String> = topic.split(',').map(str::to_owned).collect();
        let mut reader = |topic: &String| node.reader(topic, JointState::TYPE, Delivery::BestEffort { depth: DEPTH });
        let states = topics.iter().map(&mut reader).collect::<Result<_>>().map_err(at)?;
        Ok(Self {
            source,
            node,
            topics,
            states,
            waits_since: Some(Instant::now()),
            has_reported: false,
            time,
            arrived: BTreeMap::new(),
            stamped: StampedStates::default(),
            notice: None,
            name,
        })
    }

    fn read_states(&mut self) -> Result<()> {
        for states in &mut self.states {
            while let Some(state) = states.take()? {
                let stamp = state.header.stamp.frame_time();
                take_state(&state, |joint, position| {
                    if self.time != StatesTime::Arrival {
                        self.stamped.add(joint, stamp, position);
                    }
                    self.arrived.insert(joint.to_owned(), position);
                })?;
                self.waits_since = None;
            }
        }
        Ok(())
    }

    /// Finds out whether the stamps are of the clock of `frame`, once there are any.
    fn compare_clocks(&mut self, frame: &Frame) {
        let Some(apart_s) = self.stamped.newest().map(|newest| newest.since(frame.time())) else { return };
        if apart_s.abs() <= ONE_CLOCK_S {
            self.time = StatesTime::Stamp { delay_s: 0.0 };
            return;
        }
        self.time = StatesTime::Arrival;
        self.notice = Some(format!(
            "{}: its stamps are {apart_s:.3} s after the times of frames, as of another clock; a state holds from the frame after \
             it came, or by its stamp with --joints-delay S",
            self.name
        ));
    }

    /// That no state has come so far, and where others send some.
    fn nothing_came(&self) -> Option<String> {
        let waited_s = self.waits_since?.elapsed().as_secs_f64();
        let mut others = self.node.topics();
        // A reader makes its own topic known, too.
        others.retain(|(topic, kind)| kind == JointState::TYPE && !self.topics.contains(topic));
        let others: Vec<String> = others.into_iter().map(|(topic, _)| topic).collect();
        let there = if others.is_empty() {
            "no other topic has any".to_owned()
        } else {
            format!("there is {}", others.join(", "))
        };
        Some(format!(
            "{}: no state has come in {waited_s:.1} s in domain {} (ROS_DOMAIN_ID); {there}",
            self.name,
            self.node.domain()
        ))
    }
}

/// Gives `put` each joint of `state` and its position. A state without positions tells of none.
fn take_state(state: &JointState, mut put: impl FnMut(&str, f64)) -> Result<()> {
    for (joint, position) in joint_positions(state)? {
        if !position.is_finite() {
            return Err(failed!("joint `{joint}` is at {position}; send finite numbers"));
        }
        put(joint, position);
    }
    Ok(())
}

impl Source for LiveJoints {
    fn taxels(&self) -> &[u32] {
        self.source.taxels()
    }

    fn wrapped(&self) -> Option<&dyn Source> {
        Some(&*self.source)
    }

    fn wrapped_mut(&mut self) -> Option<&mut dyn Source> {
        Some(&mut *self.source)
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        if !self.source.next_frame(frame)? {
            return Ok(false);
        }
        self.read_states().map_err(|e| e.at(&self.name))?;
        if self.time == StatesTime::Auto {
            self.compare_clocks(frame);
        }
        frame.joints.clear();
        if let StatesTime::Stamp { delay_s } = self.time {
            self.arrived.clear();
            self.stamped
                .at(frame.time().plus(delay_s), |joint, position| frame.joints.push((joint.to_owned(), position)));
        } else {
            frame.joints.extend(std::mem::take(&mut self.arrived));
        }
        Ok(true)
    }

    fn notices(&mut self) -> Vec<String> {
        let mut notices = self.source.notices();
        notices.extend(self.notice.take());
        if !self.has_reported && self.waits_since.is_some_and(|since| since.elapsed() > COMES_WITHIN) {
            self.has_reported = true;
            notices.extend(self.nothing_came());
        }
        notices
    }

    fn closing(&self) -> Vec<String> {
        let mut closing = self.source.closing();
        if !self.has_reported {
            closing.extend(self.nothing_came());
        }
        closing
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_position_of_each_joint_stays() {
        let mut arrived = BTreeMap::new();
        let state = |names: &[&str], position: &[f64]| JointState {
            name: names.iter().map(|name| (*name).to_owned()).collect(),
            position: position.to_vec(),
            ..JointState::default()
        };
        let mut take = |state: &JointState| {
            take_state(state, |joint, position| {
                arrived.insert(joint.to_owned(), position);
            })
        };
        take(&state(&["a", "b"], &[1.0, 2.0])).unwrap();
        take(&state(&["b"], &[3.0])).unwrap();
        take(&state(&["a"], &[])).unwrap();
        assert_eq!(arrived.iter().map(|(name, at)| (name.as_str(), *at)).collect::<Vec<_>>(), [("a", 1.0), ("b", 3.0)]);
        let why = |state| take_state(&state, |_, _| {}).unwrap_err().to_string();
        assert_eq!(why(state(&["a", "b"], &[1.0])), "a state has 2 names and 1 positions; send one for each");
        assert!(why(state(&["a"], &[f64::NAN])).contains("joint `a` is at NaN"));
    }
}
