//! Where frames of coordinates are, from a bag of ROS 2: `/tf`, `/tf_static` and odometry.

use std::collections::BTreeMap;

use glam::{DAffine3, DQuat, DVec3};

use super::bag_source::time_of;
use super::messages::{Cdr as _, CdrReader, Header, Message as _, Pose, TfMessage, Time};
use crate::error::{Error, Result, failed};
use crate::recording::{BagReader, WantedTopics, topics_of_bag};
use crate::signal::FrameTime;
use crate::source::BagName;

/// The type of odometry, whose messages begin with a header, the child's name and its pose.
const ODOMETRY: &str = "nav_msgs/msg/Odometry";
/// What the names of topics end with whose transforms hold always.
const STATIC: &str = "tf_static";
/// Lengths that a quaternion may have to be taken for a rotation.
const QUATERNION_LENGTHS: std::ops::RangeInclusive<f64> = 1e-3..=1e3;

/// The frames of coordinates of a bag over time.
#[derive(Clone, Debug, Default)]
pub struct BagPoses {
    name: String,
    tracks: BTreeMap<String, Track>,
    losses: Vec<String>,
}

/// Where a frame is in its parent.
#[derive(Clone, Debug, Default)]
struct Track {
    parent: String,
    /// Whether the last of its transforms holds always.
    is_static: bool,
    /// By time.
    transforms: Vec<(FrameTime, DVec3, DQuat)>,
}

/// Reads `tf2_msgs/msg/TFMessage` and `nav_msgs/msg/Odometry` from the topics of a bag in MCAP or SQLite that are named, or from all of
/// these types. A frame that odometry and transforms tell of is where transforms have it.
///
/// # Errors
/// The bag cannot be read, or has no such topic; frames do not form trees.
pub fn poses_of_bag(bag: &BagName) -> Result<BagPoses> {
    let there = topics_of_bag(&bag.path)?;
    let at = |e: Error| e.at(bag.path.display());
    if let Some(missing) = bag.topics.iter().find(|name| !there.iter().any(|(topic, _)| topic == *name)) {
        return Err(at(failed!("there is no topic {missing}; somatic info lists them")));
    }
    let mut poses = BagPoses { name: bag.path.display().to_string(), ..BagPoses::default() };
    let (mut odometry, mut odd) = (BTreeMap::new(), 0_u64);
    let mut is_read = false;
    for kind in [TfMessage::TYPE, ODOMETRY] {
        let named =
            |(topic, of): &&(String, String)| of == kind && (bag.topics.is_empty() || bag.topics.contains(topic));
        let topics: Vec<String> = there.iter().filter(named).map(|(topic, _)| topic.clone()).collect();
        if topics.is_empty() {
            continue;
        }
        is_read = true;
        let mut reader =
            BagReader::open(&bag.path, &WantedTopics { topics: &topics, kinds: &[kind], merged: Some(kind) })?;
        while let Some(message) = reader.next_message()? {
            let (bytes, log_ns) = (message.data.len(), message.log_ns);
            let is_static = reader_topic(&topics, message.topic).ends_with(STATIC);
            let found = if kind == ODOMETRY { of_odometry(message.data) } else { of_tf(message.data) };
            let Some(found) = found else {
                reader.damaged(bytes);
                continue;
            };
            for Found { stamp, parent, child, translation, rotation } in found {
                let time = if stamp.nanoseconds() == 0 { time_of(log_ns) } else { stamp.frame_time() };
                reader.saw(time.s);
                if !translation.is_finite() || !QUATERNION_LENGTHS.contains(&rotation.length()) {
                    odd += 1;
                    continue;
                }
                let tracks = if kind == ODOMETRY { &mut odometry } else { &mut poses.tracks };
                let new = || Track { parent: parent.clone(), is_static, transforms: Vec::new() };
                let track: &mut Track = tracks.entry(child.clone()).or_insert_with(new);
                if track.parent != parent {
                    return Err(at(failed!(
                        "frame `{child}` is in `{}` and in `{parent}`; name the topics to read: ros2-mcap:PATH:/tf,/tf_static",
                        track.parent
                    )));
                }
                track.transforms.push((time, translation, rotation.normalize()));
            }
        }
        poses.losses.append(&mut reader.losses());
    }
    if !is_read {
        let what = failed!("it has no topic of {} or {ODOMETRY}, which poses are read from", TfMessage::TYPE);
        return Err(at(what));
    }
    for (child, track) in odometry {
        poses.tracks.entry(child).or_insert(track);
    }
    if odd > 0 {
        poses.losses.push(format!("{}: transforms that are not finite numbers: {odd}", poses.name));
    }
    poses.tracks.values_mut().for_each(|track| track.transforms.sort_by(|(a, ..), (b, ..)| a.total_cmp(b)));
    poses.check_trees().map_err(at)?;
    Ok(poses)
}

fn reader_topic(topics: &[String], topic: usize) -> &str {
    topics.get(topic).map_or("", String::as_str)
}

/// A transform of a message.
struct Found {
    stamp: Time,
    parent: String,
    child: String,
    translation: DVec3,
    rotation: DQuat,
}

/// The name of a frame, which ROS 1 began with a slash.
fn plain(name: &str) -> String {
    name.trim_start_matches('/').to_owned()
}

fn of_tf(data: &[u8]) -> Option<Vec<Found>> {
    let found = TfMessage::from_cdr(data)?.transforms.into_iter().map(|one| {
        let (at, turn) = (one.transform.translation, one.transform.rotation);
        Found {
            stamp: one.header.stamp,
            parent: plain(&one.header.frame_id),
            child: plain(&one.child_frame_id),
            translation: DVec3::new(at.x, at.y, at.z),
            rotation: DQuat::from_xyzw(turn.x, turn.y, turn.z, turn.w),
        }
    });
    Some(found.collect())
}

fn of_odometry(data: &[u8]) -> Option<Vec<Found>> {
    let mut from = CdrReader::new(data)?;
    let header = Header::read(&mut from)?;
    let child = String::read(&mut from)?;
    // Its covariance and the velocities follow.
    let Pose { position: at, orientation: turn } = Pose::read(&mut from)?;
    Some(vec![Found {
        stamp: header.stamp,
        parent: plain(&header.frame_id),
        child: plain(&child),
        translation: DVec3::new(at.x, at.y, at.z),
        rotation: DQuat::from_xyzw(turn.x, turn.y, turn.z, turn.w),
    }])
}

impl Track {
    /// Where it is at `time`, if its last transform is not older than `max_age_s`.
    fn at(&self, time: FrameTime, max_age_s: f64) -> Option<DAffine3> {
        if self.is_static {
            let &(_, translation, rotation) = self.transforms.last()?;
            return Some(DAffine3::from_rotation_translation(rotation, translation));
        }
        let next = self.transforms.partition_point(|(of, ..)| of.since(time) <= 0.0);
        let &(before, translation, rotation) = self.transforms.get(next.checked_sub(1)?)?;
        let age_s = time.since(before);
        // Times are rounded: what is as old as the limit to a nanosecond is not older.
        if age_s > max_age_s + 1e-9 {
            return None;
        }
        let Some(&(after, to, turned)) = self.transforms.get(next).filter(|_| age_s > 0.0) else {
            return Some(DAffine3::from_rotation_translation(rotation, translation));
        };
        let share = age_s / after.since(before);
        Some(DAffine3::from_rotation_translation(rotation.slerp(turned, share), translation.lerp(to, share)))
    }
}

impl BagPoses {
    /// Refuses frames that are their own ancestors.
    fn check_trees(&self) -> Result<()> {
        for child in self.tracks.keys() {
            let mut at = child;
            for _ in 0..=self.tracks.len() {
                let Some(track) = self.tracks.get(at) else { break };
                at = &track.parent;
                if at == child {
                    return Err(failed!("frame `{child}` is its own ancestor; name the topics to read"));
                }
            }
        }
        Ok(())
    }

    /// Whether it tells of the frame `name`.
    pub(super) fn has(&self, name: &str) -> bool {
        self.tracks.contains_key(name)
    }

    /// The names of its frames.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.tracks.keys().map(String::as_str)
    }

    /// The frame that has no parent, above `name`.
    pub(super) fn root_of<'a>(&'a self, name: &'a str) -> &'a str {
        let mut at = name;
        while let Some(track) = self.tracks.get(at) {
            at = &track.parent;
        }
        at
    }

    /// Where the frame `name` is in its root at `time`, if no transform on the way is older than `max_age_s`.
    pub(super) fn at(&self, name: &str, time: FrameTime, max_age_s: f64) -> Option<DAffine3> {
        let (mut at, mut pose) = (name, DAffine3::IDENTITY);
        while let Some(track) = self.tracks.get(at) {
            pose = track.at(time, max_age_s)? * pose;
            at = &track.parent;
        }
        Some(pose)
    }

    /// What people call the bag.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// What of the bag was not read, in a line each.
    pub(super) fn losses(&self) -> &[String] {
        &self.losses
    }
}

#[cfg(test)]
mod tests {
    use super::super::messages::{Quaternion, Transform, TransformStamped, Vector3};
    use super::*;

    fn track(parent: &str, is_static: bool, transforms: &[(f64, DVec3, DQuat)]) -> Track {
        let transforms = transforms.iter().map(|&(t, at, turn)| (FrameTime::from(t), at, turn)).collect();
        Track { parent: parent.to_owned(), is_static, transforms }
    }

    #[test]
    fn a_pose_is_between_two_transforms_and_along_the_tree() {
        let quarter = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let mut poses = BagPoses::default();
        let moving = [(1.0, DVec3::ZERO, DQuat::IDENTITY), (1.05, DVec3::X, quarter)];
        poses.tracks.insert("base".to_owned(), track("odom", false, &moving));
        poses.tracks.insert("hand".to_owned(), track("base", true, &[(0.0, DVec3::X, DQuat::IDENTITY)]));
        assert_eq!(poses.root_of("hand"), "odom");
        let at = |t: f64| poses.at("hand", t.into(), 0.1).map(|pose| pose.translation);
        assert_eq!((at(0.9), at(1.0)), (None, Some(DVec3::X)));
        let half = std::f64::consts::FRAC_1_SQRT_2;
        assert!(at(1.025).unwrap().distance(DVec3::new(0.5 + half, half, 0.0)) < 1e-12);
        // The last one holds for a while.
        assert!(at(1.15).unwrap().distance(DVec3::new(1.0, 1.0, 0.0)) < 1e-12);
        assert_eq!(at(1.16), None);
        assert!(poses.check_trees().is_ok());
        poses.tracks.insert("odom".to_owned(), track("hand", true, &[(0.0, DVec3::X, DQuat::IDENTITY)]));
        assert!(poses.check_trees().unwrap_err().to_string().contains("its own ancestor"));
    }

    #[test]
    fn transforms_and_odometry_are_read_from_their_bytes() {
        let header = Header { stamp: Time { sec: 3, nanosec: 4 }, frame_id: "/odom".to_owned() };
        let transform = Transform {
            translation: Vector3 { x: 1.0, y: 2.0, z: 3.0 },
            rotation: Quaternion { w: 1.0, ..Quaternion::default() },
        };
        let one = TransformStamped { header: header.clone(), child_frame_id: "base".to_owned(), transform };
        let bytes = TfMessage { transforms: vec![one] }.to_cdr();
        // The same as odometry: strings have lengths and ends, numbers are at multiples of their sizes.
        let numbers = [1.0_f64, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0];
        // The covariance, and what follows.
        let numbers = numbers.into_iter().chain([0.5; 36 + 6 + 36]).flat_map(f64::to_le_bytes);
        let odometry =
            [&[0, 1, 0, 0, 3, 0, 0, 0, 4, 0, 0, 0, 6, 0, 0, 0][..], b"/odom\0\0\0", &[5, 0, 0, 0], b"base\0\0\0\0"]
                .concat();
        let odometry: Vec<u8> = odometry.into_iter().chain(numbers).collect();
        for found in [of_tf(&bytes).unwrap(), of_odometry(&odometry).unwrap()] {
            let [Found { parent, child, translation, rotation, stamp }] = &found[..] else { panic!("one was written") };
            assert_eq!((parent.as_str(), child.as_str(), stamp.nanosec), ("odom", "base", 4));
            assert_eq!((*translation, *rotation), (DVec3::new(1.0, 2.0, 3.0), DQuat::IDENTITY));
        }
        assert!(of_tf(&bytes[..20]).is_none() && of_odometry(&bytes[..6]).is_none());
    }
}
