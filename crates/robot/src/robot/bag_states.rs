//! Joint states from a bag of ROS 2.

use std::collections::BTreeMap;

use super::bag_source::time_of;
use super::joint_positions::joint_positions;
use super::messages::{JointState, Message as _};
use crate::error::{Error, Result, failed};
use crate::recording::{BagReader, WantedTopics};
use crate::source::{BagName, JointStates, SkippedBad};

/// What is read of a bag, where joint states are.
pub(super) fn states_of(bag: &BagName) -> Result<BagReader> {
    if let Some(kind) = bag.kind.as_deref().filter(|kind| *kind != JointState::TYPE) {
        return Err(
            failed!("joint states are {}, not {kind}; leave @{kind} out", JointState::TYPE).at(bag.path.display())
        );
    }
    BagReader::open(
        &bag.path,
        &WantedTopics { topics: &bag.topics, kinds: &[JointState::TYPE], merged: Some(JointState::TYPE) },
    )
}

/// Reads `sensor_msgs/msg/JointState` from a bag in MCAP or SQLite: from the topics that are named, or all of that type. Each joint is in
/// one of them.
///
/// The time of a state is its stamp; that of one whose stamp is 0 is when it came, by the recorder's clock. Several
/// publishers may each tell of some joints. A position that is not a finite number tells nothing, and is among
/// [`JointStates::losses`], as is what is damaged or cut off; and with `skip_bad`, a state that has not as many positions as names.
///
/// # Errors
/// The bag cannot be read, or has no such topic, or two of them have one joint; no state has positions, or one has not as many as names.
pub fn joint_states_of_bag(bag: &BagName, skip_bad: bool) -> Result<JointStates> {
    let mut skipped = SkippedBad::new(skip_bad);
    let mut reader = states_of(bag)?;
    let name = format!("{}: {}", bag.path.display(), reader.topics().join(", "));
    let mut states = JointStates::named(name.clone());
    let mut odd: Option<(u64, String)> = None;
    let topics = reader.topics().to_vec();
    let mut topic_of: BTreeMap<String, usize> = BTreeMap::new();
    while let Some(message) = reader.next_message()? {
        let (bytes, topic) = (message.data.len(), message.topic);
        let log_ns = message.log_ns;
        let Some(state) = JointState::from_cdr(message.data) else {
            reader.damaged(bytes);
            continue;
        };
        let stamp = &state.header.stamp;
        let time = if stamp.nanoseconds() == 0 { time_of(log_ns) } else { stamp.frame_time() };
        let t_s = time.s;
        reader.saw(t_s);
        let positions = match joint_positions(&state) {
            Ok(positions) => positions,
            Err(e) => {
                skipped.skip(
                    "message",
                    "another number of positions than of names",
                    e.at(format!("{name}: at {t_s} s")),
                )?;
                continue;
            }
        };
        for (joint, position) in positions {
            let of = *topic_of.get(joint).unwrap_or(&topic);
            if of != topic {
                return Err(failed!(
                    "joint `{joint}` is in {0} and in {1}; name the topics to read, such as ros2-mcap:{2}:{0}",
                    topics[of],
                    topics[topic],
                    bag.path.display()
                )
                .at(bag.path.display()));
            }
            if topics.len() > 1 && !topic_of.contains_key(joint) {
                topic_of.insert(joint.to_owned(), topic);
            }
            if position.is_finite() {
                states.add(joint, time, position);
            } else {
                let first = || (0, format!("the first of joint `{joint}` at {t_s} s: {position}"));
                odd.get_or_insert_with(first).0 += 1;
            }
        }
    }
    let mut losses = reader.losses();
    losses.extend(odd.map(|(count, first)| format!("{name}: positions that are not finite numbers: {count}, {first}")));
    losses.extend(skipped.losses());
    states.sort(losses);
    if states.joint_names().is_empty() {
        return Err(
            Error::failed("no state in it has positions; name the topic that has: ros2-mcap:PATH:/TOPIC").at(name)
        );
    }
    Ok(states)
}
