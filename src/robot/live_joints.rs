//! Joint states from a topic of ROS 2, carried by the frames of another source.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use super::messages::{JointState, Message as _};
use super::told_positions::told_positions;
use crate::dds::{Delivery, Node, Reader};
use crate::error::{Error, Result, failed};
use crate::signal::Frame;
use crate::source::Source;

/// States that are kept until the next frame reads them.
const DEPTH: usize = 64;
/// How long the first state may take before that is told.
const COMES_WITHIN: Duration = Duration::from_secs(5);
/// The node's name.
const NODE: &str = "somatic_joints";

/// Frames of another source, each with the joint states that have come since the one before.
pub struct LiveJoints {
    source: Box<dyn Source + Send>,
    name: String,
    node: Node,
    topic: String,
    states: Reader<JointState>,
    /// When it began to wait for the first state; nothing once that has come.
    waits_since: Option<Instant>,
    /// Whether it was told that nothing comes.
    has_told: bool,
    /// Joints that have arrived since the last frame.
    arrived: BTreeMap<String, f64>,
}

impl LiveJoints {
    /// Reads `topic`, whose messages are `sensor_msgs/msg/JointState`, for the frames of `source`.
    ///
    /// # Errors
    /// There is no network, or the name is none of a topic.
    pub fn open(source: Box<dyn Source + Send>, topic: &str) -> Result<Self> {
        let name = format!("joint states `ros2:{topic}`");
        let at = |e: Error| e.at(&name);
        let mut node = Node::new("", NODE).map_err(at)?;
        let states = node.reader(topic, JointState::TYPE, Delivery::BestEffort { depth: DEPTH }).map_err(at)?;
        let waits_since = Some(Instant::now());
        let topic = topic.to_owned();
        Ok(Self { source, name, node, topic, states, waits_since, has_told: false, arrived: BTreeMap::new() })
    }

    fn read_states(&mut self) -> Result<()> {
        while let Some(state) = self.states.take()? {
            take_state(&state, &mut self.arrived)?;
            self.waits_since = None;
        }
        Ok(())
    }

    /// That no state has come so far, and where others send some.
    fn nothing_came(&self) -> Option<String> {
        let waited_s = self.waits_since?.elapsed().as_secs_f64();
        let mut others = self.node.topics();
        // A reader makes its own topic known, too.
        others.retain(|(topic, kind)| kind == JointState::TYPE && *topic != self.topic);
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

/// Adds the positions of `state` to `arrived`. A state without positions tells of none.
fn take_state(state: &JointState, arrived: &mut BTreeMap<String, f64>) -> Result<()> {
    for (joint, position) in told_positions(state)? {
        if !position.is_finite() {
            return Err(failed!("joint `{joint}` is at {position}; send finite numbers"));
        }
        arrived.insert(joint.clone(), position);
    }
    Ok(())
}

impl Source for LiveJoints {
    fn taxels(&self) -> &[u32] {
        self.source.taxels()
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        if !self.source.next_frame(frame)? {
            return Ok(false);
        }
        self.read_states().map_err(|e| e.at(&self.name))?;
        frame.joints.clear();
        frame.joints.extend(std::mem::take(&mut self.arrived));
        Ok(true)
    }

    fn progress(&self) -> Option<f64> {
        self.source.progress()
    }

    fn skip_to(&mut self, t_s: f64) {
        self.source.skip_to(t_s);
    }

    fn report_stale(&mut self) {
        self.source.report_stale();
    }

    fn has_stale(&self) -> bool {
        self.source.has_stale()
    }

    fn read_at(&mut self) -> Option<Instant> {
        self.source.read_at()
    }

    fn notices(&mut self) -> Vec<String> {
        let mut notices = self.source.notices();
        if !self.has_told && self.waits_since.is_some_and(|since| since.elapsed() > COMES_WITHIN) {
            self.has_told = true;
            notices.extend(self.nothing_came());
        }
        notices
    }

    fn closing(&self) -> Vec<String> {
        let mut closing = self.source.closing();
        if !self.has_told {
            closing.extend(self.nothing_came());
        }
        closing
    }

    fn losses(&self) -> Vec<String> {
        self.source.losses()
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
        take_state(&state(&["a", "b"], &[1.0, 2.0]), &mut arrived).unwrap();
        take_state(&state(&["b"], &[3.0]), &mut arrived).unwrap();
        take_state(&state(&["a"], &[]), &mut arrived).unwrap();
        assert_eq!(arrived.iter().map(|(name, at)| (name.as_str(), *at)).collect::<Vec<_>>(), [("a", 1.0), ("b", 3.0)]);
        let why = |state| take_state(&state, &mut BTreeMap::new()).unwrap_err().to_string();
        assert_eq!(why(state(&["a", "b"], &[1.0])), "a state has 2 names and 1 positions; send one for each");
        assert!(why(state(&["a"], &[f64::NAN])).contains("joint `a` is at NaN"));
    }
}
