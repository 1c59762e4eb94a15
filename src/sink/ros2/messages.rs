//! The messages of a run and their topics: made here, written to a bag or sent.

use super::moment::Moment;
use super::places::{Clouds, header, rest_poses, topic_part, transforms};
use super::readings::Readings;
use super::touches::Touches;
use super::wrenches::{WrenchField, wrench_fields};
use crate::error::{Error, Result};
use crate::recording::BagType;
use crate::robot::messages::{
    Byte, DiagnosticArray, DiagnosticStatus, JointState, KeyValue, MarkerArray, Message, PointCloud2, TfMessage,
    WrenchStamped,
};
use crate::signal::{BoardHealth, Pose};
use crate::sink::{FieldNames, Session};

/// Period of the transforms of links at rest, s: a player that jumps needs them soon.
const LINKS_PERIOD_S: f64 = 1.0;
/// Levels of `diagnostic_msgs/DiagnosticStatus`.
const OK: Byte = Byte(0);
const WARN: Byte = Byte(1);
const STALE: Byte = Byte(3);

/// A topic, by its place in [`Messages::topics`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Topic(pub(super) usize);

const LINKS: Topic = Topic(0);
const TOUCHES: Topic = Topic(1);
const JOINTS: Topic = Topic(2);
/// How boards are doing.
pub(super) const BOARDS: Topic = Topic(3);

/// What a topic is.
#[derive(Clone, Debug)]
pub(super) struct TopicKind {
    pub(super) name: String,
    pub(super) kind: BagType,
    /// Whether it is only there where something is told.
    pub(super) is_optional: bool,
}

fn topic<M: Message>(name: impl Into<String>) -> TopicKind {
    let kind = BagType { name: M::TYPE, hash: M::HASH, definition: M::definition() };
    TopicKind { name: name.into(), kind, is_optional: false }
}

/// Makes the messages of each frame.
pub(super) struct Messages {
    topics: Vec<TopicKind>,
    clouds: Clouds,
    first_cloud: usize,
    wrenches: Vec<WrenchField>,
    first_wrench: usize,
    touches: Touches,
    at_rest: Vec<(String, Pose)>,
    links_told_s: Option<f64>,
    readings: Readings,
}

impl Messages {
    /// # Errors
    /// The session has no body.
    pub(super) fn new(session: &Session<'_>) -> Result<Self> {
        let (Some(body), Some(plan)) = (session.body, session.plan) else {
            return Err(Error::failed("messages of ROS 2 need the robot's body"));
        };
        let clouds = Clouds::new(body);
        let wrenches = wrench_fields(body, plan);
        let mut topics = vec![
            topic::<TfMessage>("/tf"),
            topic::<MarkerArray>("/somatic/touches"),
            TopicKind { is_optional: true, ..topic::<JointState>("/joint_states") },
            TopicKind { is_optional: true, ..topic::<DiagnosticArray>("/diagnostics") },
        ];
        let first_cloud = topics.len();
        let of_link = |link: &str| topic::<PointCloud2>(format!("/somatic/taxels/{}", topic_part(link)));
        topics.extend(clouds.links().map(of_link));
        let first_wrench = topics.len();
        let of_field =
            |field: &WrenchField| topic::<WrenchStamped>(format!("/somatic/wrench/{}", topic_part(&field.name)));
        topics.extend(wrenches.iter().map(of_field));
        Ok(Self {
            topics,
            clouds,
            first_cloud,
            wrenches,
            first_wrench,
            touches: Touches::new(session.names.iter().map(FieldNames::told_apart).collect()),
            at_rest: rest_poses(body),
            links_told_s: None,
            readings: Readings::new(body),
        })
    }

    /// All topics that there may be.
    pub(super) fn topics(&self) -> &[TopicKind] {
        &self.topics
    }

    /// Gives each message of `moment` to `send`, which says whether it could be sent.
    ///
    /// # Errors
    /// Those of `send`.
    pub(super) fn tell(&mut self, moment: &Moment, send: &mut dyn FnMut(Topic, Vec<u8>) -> Result<bool>) -> Result<()> {
        let time_ns = moment.time_ns;
        // Where links are is not known while joints are late, and told now and then while nothing moves.
        let is_due = self.links_told_s.is_none_or(|told_s| !(0.0..LINKS_PERIOD_S).contains(&(moment.t_s - told_s)));
        if (is_due && !moment.has_stale_pose) || !moment.pose.is_empty() {
            self.links_told_s = Some(moment.t_s);
            send(LINKS, transforms(time_ns, &self.at_rest, &moment.pose).to_cdr())?;
        }
        if !moment.joints.is_empty() {
            let (name, position) = moment.joints.iter().cloned().unzip();
            let state = JointState { header: header(time_ns, ""), name, position, ..JointState::default() };
            send(JOINTS, state.to_cdr())?;
        }
        self.readings.read(&moment.pressures);
        for (cloud, message) in self.clouds.messages(time_ns, &self.readings).enumerate() {
            send(Topic(self.first_cloud + cloud), message.to_cdr())?;
        }
        for (index, field) in self.wrenches.iter().enumerate() {
            if let Some(wrench) = field.message(time_ns, &self.readings) {
                send(Topic(self.first_wrench + index), wrench.to_cdr())?;
            }
        }
        if let Some(markers) = self.touches.message(time_ns, &moment.touched).map(Message::to_cdr)
            && !send(TOUCHES, markers)?
        {
            self.touches.was_refused();
        }
        Ok(())
    }
}

/// How `boards` are doing at `time_ns`.
pub(super) fn of_boards(time_ns: u64, boards: &[BoardHealth]) -> Vec<u8> {
    DiagnosticArray { header: header(time_ns, ""), status: boards.iter().map(status).collect() }.to_cdr()
}

/// How a board is doing, as ROS's tools show it.
fn status(board: &BoardHealth) -> DiagnosticStatus {
    let value = |key: &str, value: String| KeyValue { key: key.to_owned(), value };
    let mut values = vec![value("frames", board.frames.to_string()), value("lost", board.lost.to_string())];
    values.extend(board.rate_hz.map(|rate_hz| value("rate [Hz]", format!("{rate_hz:.3}"))));
    values.extend(board.age_s.map(|age_s| value("age [s]", format!("{age_s:.3}"))));
    let level = match board.state.as_str() {
        "speaking" if board.lost == 0 => OK,
        "speaking" => WARN,
        _ => STALE,
    };
    DiagnosticStatus {
        level,
        name: format!("somatic: {}", board.name),
        message: board.state.clone(),
        hardware_id: board.name.clone(),
        values,
    }
}
