//! The messages of a run and their topics: made here, written to a bag or sent.

use super::moment::Moment;
use super::places::{Clouds, header, rest_poses, topic_part, transforms};
use super::readings::Readings;
use super::touches::Touches;
use super::wrenches::{LinkWrenches, of_touch};
use crate::error::{Error, Result};
use crate::percept::TouchOutputs;
use crate::recording::BagType;
use crate::robot::messages::{
    Byte, DiagnosticArray, DiagnosticStatus, JointState, KeyValue, MarkerArray, Message, PointCloud2, TfMessage,
    WrenchStamped,
};
use crate::scene::SensedTaxels;
use crate::signal::{BoardHealth, Pose};
use crate::sink::Session;

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
const JOINTS: Topic = Topic(1);
/// How boards are doing.
pub(super) const BOARDS: Topic = Topic(2);

/// What a topic is.
#[derive(Clone, Debug)]
pub(super) struct TopicKind {
    pub(super) name: String,
    pub(super) kind: BagType,
    /// Whether it is published only if there is something to report.
    pub(super) is_optional: bool,
    /// Whether a frame has several of its messages: one for each touch. Bags have room for all.
    #[cfg_attr(not(feature = "ros2"), allow(dead_code, reason = "live topics alone have a depth"))]
    pub(super) has_several: bool,
}

fn topic<M: Message>(name: impl Into<String>) -> TopicKind {
    let kind = BagType { name: M::TYPE, hash: M::HASH, definition: M::definition() };
    TopicKind { name: name.into(), kind, is_optional: false, has_several: false }
}

/// Makes the messages of each frame.
pub(super) struct Messages {
    topics: Vec<TopicKind>,
    clouds: Clouds,
    first_cloud: usize,
    wrenches: LinkWrenches,
    first_wrench: usize,
    /// Where touches are looked for.
    touches: Option<(Topic, Touches)>,
    /// Where the wrench of each touch is asked for; and the links' names.
    touch_wrenches: Option<(Topic, Vec<String>)>,
    at_rest: Vec<(String, Pose)>,
    links_sent_s: Option<f64>,
    readings: Readings,
    sensed: SensedTaxels,
}

impl Messages {
    /// # Errors
    /// The session has no body.
    pub(super) fn new(session: &Session<'_>) -> Result<Self> {
        let (Some(body), Some(plan)) = (session.body, session.plan) else {
            return Err(Error::failed("messages of ROS 2 need the robot's body"));
        };
        let sensed = SensedTaxels::with_wrenches(plan, body);
        let clouds = Clouds::new(body, &sensed);
        let wrenches = LinkWrenches::new(body, plan, session.taxels);
        let mut topics = vec![
            topic::<TfMessage>("/tf"),
            TopicKind { is_optional: true, ..topic::<JointState>("/joint_states") },
            TopicKind { is_optional: true, ..topic::<DiagnosticArray>("/diagnostics") },
        ];
        let mut add = |kind: TopicKind| {
            topics.push(kind);
            Topic(topics.len() - 1)
        };
        let skin = session.skin();
        let touch_wrenches = skin.as_ref().filter(|skin| skin.outputs.contains(TouchOutputs::WRENCH)).map(|skin| {
            (
                add(TopicKind { has_several: true, ..topic::<WrenchStamped>("/somatic/touch_wrenches") }),
                skin.links.clone(),
            )
        });
        let touches = skin.map(|skin| (add(topic::<MarkerArray>("/somatic/touches")), Touches::new(skin)));
        let first_cloud = topics.len();
        let of_link = |link: &str| topic::<PointCloud2>(format!("/somatic/taxels/{}", topic_part(link)));
        topics.extend(clouds.links().map(of_link));
        let first_wrench = topics.len();
        let of_link = |link: &str| topic::<WrenchStamped>(format!("/somatic/wrench/{}", topic_part(link)));
        topics.extend(wrenches.names().map(of_link));
        Ok(Self {
            topics,
            clouds,
            first_cloud,
            wrenches,
            first_wrench,
            touches,
            touch_wrenches,
            at_rest: rest_poses(body),
            links_sent_s: None,
            readings: Readings::new(body),
            sensed,
        })
    }

    /// What there are no messages of, and why, a line each.
    pub(super) fn remarks(&self) -> Vec<String> {
        let untouched = self.touches.is_none().then(|| "no markers of touches: add touches to --outputs".to_owned());
        untouched.into_iter().chain(self.wrenches.remarks().iter().cloned()).collect()
    }

    /// The taxels that read something else than pressure.
    pub(super) fn sensed(&self) -> &SensedTaxels {
        &self.sensed
    }

    /// All topics that there may be.
    pub(super) fn topics(&self) -> &[TopicKind] {
        &self.topics
    }

    /// Gives each message of `moment` to `send`, which says whether it could be sent.
    ///
    /// # Errors
    /// The errors of `send`.
    pub(super) fn tell(&mut self, moment: &Moment, send: &mut dyn FnMut(Topic, Vec<u8>) -> Result<bool>) -> Result<()> {
        let time_ns = moment.time_ns;
        // Poses of links are unknown while joints are late, and sent now and then while nothing moves.
        let is_due = self.links_sent_s.is_none_or(|sent_s| !(0.0..LINKS_PERIOD_S).contains(&(moment.t_s - sent_s)));
        if (is_due && !moment.has_stale_pose) || !moment.pose.is_empty() {
            self.links_sent_s = Some(moment.t_s);
            send(LINKS, transforms(time_ns, &self.at_rest, &moment.pose).to_cdr())?;
        }
        if !moment.joints.is_empty() {
            let (name, position) = moment.joints.iter().cloned().unzip();
            let state = JointState { header: header(time_ns, ""), name, position, ..JointState::default() };
            send(JOINTS, state.to_cdr())?;
        }
        self.readings.read(&moment.pressures, &moment.sensed);
        for (cloud, message) in self.clouds.messages(time_ns, &self.readings).enumerate() {
            send(Topic(self.first_cloud + cloud), message.to_cdr())?;
        }
        for (link, wrench) in self.wrenches.messages(time_ns, &self.readings, &moment.missing) {
            send(Topic(self.first_wrench + link), wrench.to_cdr())?;
        }
        if let Some((topic, links)) = &self.touch_wrenches {
            let known = moment.presses.iter().filter_map(|press| Some((press.link, press.wrench?)));
            for (link, wrench) in known {
                send(*topic, of_touch(time_ns, &links[link as usize], &wrench).to_cdr())?;
            }
        }
        if let Some((topic, touches)) = &mut self.touches
            && let Some(markers) = touches.message(time_ns, &moment.touches).map(Message::to_cdr)
            && !send(*topic, markers)?
        {
            touches.was_refused();
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
