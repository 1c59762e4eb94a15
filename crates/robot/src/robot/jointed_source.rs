//! A source whose frames get poses of links from joint states.

use glam::{DAffine3, DQuat};

use super::joint_remarks::JointRemarks;
use super::kinematics::Kinematics;
use super::matching::LinkMatches;
use crate::body::{Body, Up};
use crate::error::{Result, failed};
use crate::signal::{Frame, FrameTime, Pose};
use crate::source::{JointPosition, JointStates, Source};

/// How joint states are used.
#[derive(Clone, Debug)]
pub struct JointOptions {
    /// The axis that points up in the URDF.
    pub up: Up,
    /// Joint states in a recording of their own; without it, those that frames carry.
    pub states: Option<JointStates>,
    /// How much later the joints' clock stamps an instant than the frames' clock, s.
    pub delay_s: f64,
    /// The age of a joint's last state from which on it is too old, s.
    pub max_age_s: f64,
}

/// Names of joints that a message has at most.
const MOST_NAMED: usize = 8;
/// Messages on late states are at least so far apart, s.
const QUIET_S: f64 = 10.0;
/// How long joints are waited for until those that are still without a state are named, s.
const COMES_WITHIN_S: f64 = 1.0;
/// The default of [`JointOptions::max_age_s`].
const DEFAULT_MAX_AGE_S: f64 = 0.1;

impl JointOptions {
    /// Joint states that frames carry, for a URDF whose axis `up` points up.
    #[must_use]
    pub fn new(up: Up) -> Self {
        Self { up, states: None, delay_s: 0.0, max_age_s: DEFAULT_MAX_AGE_S }
    }
}

/// Frames of another source, with poses of links from joint states.
///
/// A frame's own pose of a link overrides the joints'. Links below it start from that pose: this gives a floating base. Where a
/// joint that moves a link with taxels has no state, or an old one, the frame has [`Frame::has_stale_pose`], and poses of those
/// links alone that such joints do not move.
///
/// With [`JointOptions::states`], a frame with poses has the positions that these are of as [`Frame::joints`].
pub struct JointedSource {
    source: Box<dyn Source + Send>,
    robot: Kinematics,
    matches: LinkMatches,
    world_from_root: DAffine3,
    options: JointOptions,
    /// By joint, its index in the recording of states.
    recorded: Vec<Option<usize>>,
    /// By joint, the last state that a frame has carried, with its time.
    carried: Vec<Option<(FrameTime, f64)>>,
    positions: Vec<Option<JointPosition>>,
    /// By joint that is needed, whether any frame had a state of it.
    has_come: Vec<bool>,
    poses: Vec<Option<DAffine3>>,
    was_stale: bool,
    /// Since when it is stale, s, until the joints that are late then are named.
    stale_since_s: Option<f64>,
    /// The joint that was named first.
    named: Option<usize>,
    /// Whether it reported the last time that it became stale, and when it last did, s.
    is_stale_reported: bool,
    reported_s: f64,
    counts: PoseCounts,
    remarks: JointRemarks,
}

somatic_skin::debug_by_name!(JointedSource);

/// Frames that were read, and those of them without a pose.
#[derive(Clone, Copy, Debug, Default)]
struct PoseCounts {
    frames: usize,
    without_pose: usize,
    /// Times of the first and the last, s.
    span_s: Option<[f64; 2]>,
}

impl PoseCounts {
    fn see(&mut self, frame: &Frame) {
        self.frames += 1;
        self.without_pose += usize::from(frame.has_stale_pose);
        let [first_s, _] = self.span_s.unwrap_or([frame.t_s; 2]);
        self.span_s = Some([first_s, frame.t_s]);
    }
}

impl JointedSource {
    /// Gives the frames of `source` poses of the links of `body`, as `robot` moves them.
    ///
    /// # Errors
    /// As [`LinkMatches::new`]; or a recording of states lacks a joint that moves a link with taxels.
    pub fn new(source: Box<dyn Source + Send>, robot: Kinematics, body: &Body, options: JointOptions) -> Result<Self> {
        let matches = LinkMatches::new(&robot, body, options.up)?;
        let index_in = |states: &JointStates| robot.joint_names().map(|name| states.joint_index(name)).collect();
        let recorded: Vec<Option<usize>> = options.states.as_ref().map_or_else(Vec::new, index_in);
        if let Some(states) = &options.states {
            let missing = matches.needed.iter().find(|(joint, _)| recorded[*joint].is_none());
            if let Some((joint, link)) = missing {
                let name = robot.joint_names().nth(*joint).unwrap_or_default();
                // What no joint of the robot is called may be meant.
                let known: Vec<&str> = robot.joint_names().collect();
                let strange = states.joint_names().iter().map(String::as_str).filter(|name| !known.contains(name));
                let hint = crate::error::nearest(name, strange.filter(|name| !robot.has_joint(name)));
                let others = || states.joint_names().iter().take(MOST_NAMED).map(|name| format!("`{name}`"));
                let add = || format!("add it to its {}", others().collect::<Vec<_>>().join(", "));
                let what_to_do = hint.map_or_else(add, |near| format!("is `{near}` meant?"));
                return Err(
                    failed!("no state has joint `{name}`, which moves `{link}`; {what_to_do}").at(states.name())
                );
            }
        }
        let joints = robot.joint_names().len();
        Ok(Self {
            source,
            world_from_root: options.up.world_from_root(),
            has_come: vec![false; matches.needed.len()],
            matches,
            options,
            recorded,
            carried: vec![None; joints],
            positions: vec![None; joints],
            poses: Vec::new(),
            was_stale: false,
            stale_since_s: None,
            named: None,
            is_stale_reported: false,
            reported_s: f64::NEG_INFINITY,
            counts: PoseCounts::default(),
            remarks: JointRemarks::default(),
            robot,
        })
    }

    /// Which links the joints move, in a line.
    #[must_use]
    pub fn summary(&self) -> String {
        self.matches.summary()
    }

    /// Fills in where each joint is at the time of `frame`.
    fn find_positions(&mut self, frame: &Frame) {
        for (name, position) in &frame.joints {
            match self.robot.joint_names().position(|known| known == name) {
                Some(joint) => self.carried[joint] = Some((frame.time(), *position)),
                // One that mimics another, or is fixed, adds nothing.
                None if self.robot.has_joint(name) => {}
                None => self.remarks.strange_joint(&self.robot, name, frame.t_s),
            }
        }
        for joint in 0..self.positions.len() {
            self.positions[joint] = match &self.options.states {
                Some(states) => self.recorded[joint].and_then(|recorded| {
                    states.at(recorded, frame.time().plus(self.options.delay_s), self.robot.is_continuous(joint))
                }),
                None => self.carried[joint]
                    .map(|(time, position)| JointPosition { position, age_s: frame.time().since(time) }),
            };
        }
    }

    /// How many frames have no pose so far, if any.
    fn frames_without_pose(&self) -> Option<String> {
        let PoseCounts { frames, without_pose, span_s } = self.counts;
        let [first_s, last_s] = span_s.filter(|_| without_pose > 0)?;
        let mut line = format!(
            "{without_pose} of {frames} frames lack poses of links: states of joints were missing, or older than --joints-max-age {}",
            self.options.max_age_s
        );
        let silent: Vec<usize> = (0..self.matches.needed.len()).filter(|&at| !self.has_come[at]).collect();
        if !silent.is_empty() {
            line += &format!("; no frame has a state of {}", self.named_joints(&silent));
        }
        if let Some([from_s, to_s]) = self.options.states.as_ref().and_then(JointStates::span_s) {
            // In whole nanoseconds: a difference of doubles has digits that mean nothing.
            let delay_ns = (self.options.delay_s * 1e9).round() as i64;
            let [from_s, to_s] =
                [from_s, to_s].map(|s| FrameTime::from_ns(FrameTime::from(s).ns().saturating_sub(delay_ns)).s);
            line += &format!(
                "; states are of {from_s} to {to_s} s on the frames' clock, frames of {first_s} to {last_s} s"
            );
            if from_s > last_s || to_s < first_s {
                line += "; where these are two clocks, give --joints-delay";
            }
        }
        Some(line)
    }

    /// Puts the positions of joints that are not older than allowed into `frame`; their names go where those of an earlier
    /// frame in `names` were.
    fn put_joints(
        &self,
        known: impl Fn(usize) -> Option<JointPosition>,
        mut names: Vec<(String, f64)>,
        frame: &mut Frame,
    ) {
        let mut count = 0;
        for (joint, name) in self.robot.joint_names().enumerate() {
            let Some(JointPosition { position, .. }) = known(joint) else { continue };
            match names.get_mut(count) {
                Some(own) => {
                    name.clone_into(&mut own.0);
                    own.1 = position;
                }
                None => names.push((name.to_owned(), position)),
            }
            count += 1;
        }
        names.truncate(count);
        frame.joints = names;
    }

    /// `names` are the joints of an earlier frame.
    fn put_poses(&mut self, names: Vec<(String, f64)>, frame: &mut Frame) {
        self.find_positions(frame);
        if let Some(states) = self.options.states.as_ref().filter(|_| !frame.joints.is_empty()) {
            self.remarks.carried(states.name(), frame.t_s);
        }
        let position_of = |joint: usize| self.positions[joint].map(|found| found.position);
        self.remarks.units(&self.robot, position_of, frame.t_s);
        let max_age_s = self.options.max_age_s;
        // Times are rounded: what is as old as the limit to a nanosecond is not older.
        let allowed_s = 0.0..=max_age_s + 1e-9;
        let known = |joint: usize| self.positions[joint].filter(|found| allowed_s.contains(&found.age_s));
        let needed = self.matches.needed.iter();
        let late: Vec<usize> =
            needed.enumerate().filter(|(_, (joint, _))| known(*joint).is_none()).map(|(at, _)| at).collect();
        self.has_come.iter_mut().enumerate().for_each(|(at, has_come)| *has_come |= !late.contains(&at));
        frame.has_stale_pose = !late.is_empty();
        if self.options.states.is_some() {
            self.put_joints(known, names, frame);
        }
        let links: Vec<&str> = self.robot.link_names().collect();
        let given = |link: usize| {
            let own = frame.pose.iter().find(|(name, _)| name == links[link]);
            own.map(|(_, pose)| Some(DAffine3::from_rotation_translation(pose.rotation, pose.translation)))
        };
        let position_of = |joint: usize| known(joint).map(|found| found.position);
        self.robot.poses_into(position_of, given, &self.world_from_root, &mut self.poses);
        // What the URDF does not know goes on to the engine, which knows the body's links.
        frame.pose.retain(|(name, _)| !links.contains(&name.as_str()));
        for (link, name) in &self.matches.matched {
            if let Some(world_from_link) = self.poses[*link] {
                let rotation = DQuat::from_mat3(&world_from_link.matrix3).normalize();
                frame.pose.push((name.clone(), Pose { translation: world_from_link.translation, rotation }));
            }
        }
        if frame.has_stale_pose {
            self.matches.put_carried(&mut frame.pose);
        }
        self.note_late(&late, frame.t_s);
    }

    /// Says which joints are late: the first of them at once, those that are still late a second later, and when none is.
    fn note_late(&mut self, late: &[usize], t_s: f64) {
        let is_stale = !late.is_empty();
        if is_stale && !self.was_stale {
            // States that keep coming too late are reported now and then, and counted at the end.
            self.is_stale_reported = t_s - self.reported_s >= QUIET_S;
            self.reported_s = if self.is_stale_reported { t_s } else { self.reported_s };
            self.stale_since_s = self.is_stale_reported.then_some(t_s);
            self.named = late.first().copied();
        }
        if is_stale != self.was_stale && self.is_stale_reported {
            self.remarks.notices.push(match late.first() {
                Some(&first) => {
                    let (joint, link) = &self.matches.needed[first];
                    let name = self.robot.joint_names().nth(*joint).unwrap_or_default();
                    let age = self.positions[*joint].map_or("no state so far".to_owned(), |found| {
                        format!("its last state is {:.3} s old", found.age_s)
                    });
                    format!(
                        "at {t_s} s: joint `{name}`, which moves `{link}`: {age}; positions on links that late joints move are in \
                         those links from here on"
                    )
                }
                None => format!("at {t_s} s: every joint has a state; positions are in the world from here on"),
            });
        }
        self.was_stale = is_stale;
        if !is_stale {
            self.stale_since_s = None;
        } else if self.stale_since_s.is_some_and(|since_s| t_s - since_s >= COMES_WITHIN_S) {
            self.stale_since_s = None;
            // Who is late alone has been named.
            if late.len() > 1 || late.first() != self.named.as_ref() {
                let joints = self.named_joints(late);
                self.remarks.notices.push(format!(
                    "at {t_s} s: still without a state, or with one that is too old: {joints}; links that these move have no pose"
                ));
            }
        }
    }

    /// Joints among those that are needed, each with a link that it moves.
    fn named_joints(&self, needed: &[usize]) -> String {
        let name = |&at: &usize| {
            let (joint, link) = &self.matches.needed[at];
            format!("`{}`, which moves `{link}`", self.robot.joint_names().nth(*joint).unwrap_or_default())
        };
        let mut names = needed.iter().take(MOST_NAMED).map(name).collect::<Vec<_>>().join("; ");
        if needed.len() > MOST_NAMED {
            names += &format!("; and {} more", needed.len() - MOST_NAMED);
        }
        names
    }
}

impl Source for JointedSource {
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
        // Sources empty their frames, and names would be allocated for each.
        let names = if self.options.states.is_some() { std::mem::take(&mut frame.joints) } else { Vec::new() };
        if !self.source.next_frame(frame)? {
            return Ok(false);
        }
        self.put_poses(names, frame);
        self.counts.see(frame);
        Ok(true)
    }

    fn notices(&mut self) -> Vec<String> {
        let mut notices = self.source.notices();
        notices.append(&mut self.remarks.notices);
        notices
    }

    fn closing(&self) -> Vec<String> {
        let mut closing = self.source.closing();
        closing.extend(self.frames_without_pose());
        closing
    }

    fn losses(&self) -> Vec<String> {
        let mut losses = self.source.losses();
        losses.extend(self.options.states.iter().flat_map(|states| states.losses().iter().cloned()));
        losses
    }
}
