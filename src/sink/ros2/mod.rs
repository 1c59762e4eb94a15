//! A bag of ROS 2 as a sink: taxels, touched fields, wrenches, links, joints and boards as messages.

mod clock;
mod places;
mod touches;
mod wrenches;

pub use clock::RosTime;

use std::collections::{HashMap, VecDeque};

use self::clock::RosClock;
use self::places::{Clouds, header, rest_poses, topic_part, transforms};
use self::touches::Touches;
use self::wrenches::{WrenchField, wrench_fields};
use super::{Flow, InputFrames, News, Session, Sink};
use crate::error::{Error, Result};
use crate::output::OutputFolder;
use crate::percept::Percepts;
use crate::recording::{BagTopic, BagType, BagWriter};
use crate::robot::messages::{
    Byte, DiagnosticArray, DiagnosticStatus, JointState, KeyValue, MarkerArray, Message, PointCloud2, TfMessage,
    WrenchStamped,
};
use crate::signal::{BoardHealth, Frame, Pose};

/// Period of the transforms of links at rest, s: a player that jumps needs them soon.
const LINKS_PERIOD_S: f64 = 1.0;
/// Levels of `diagnostic_msgs/DiagnosticStatus`.
const OK: Byte = Byte(0);
const WARN: Byte = Byte(1);
const STALE: Byte = Byte(3);

/// Messages of a frame, each with its topic.
type Messages = Vec<(BagTopic, Vec<u8>)>;

/// Writes percepts, and the frames that they are made of, as a bag.
pub struct Ros2BagSink {
    bag: BagWriter,
    clock: RosClock,
    clouds: Clouds,
    cloud_topics: Vec<BagTopic>,
    wrenches: Vec<(BagTopic, WrenchField)>,
    touches: Touches,
    touches_topic: BagTopic,
    links_topic: BagTopic,
    at_rest: Vec<(String, Pose)>,
    links_told_s: Option<f64>,
    joints_topic: Option<BagTopic>,
    boards_topic: Option<BagTopic>,
    pressures: Vec<(u32, f64)>,
    pressure_of: HashMap<u32, f64>,
    /// Messages of frames whose percepts are still to come, by frame with its time: a bag's times do not fall.
    waiting: VecDeque<(u64, Messages)>,
}

fn bag_type<M: Message>() -> BagType {
    BagType { name: M::TYPE, hash: M::HASH, definition: M::definition() }
}

impl Ros2BagSink {
    /// Begins a bag in `folder` whose MCAP is called `file_name`.
    ///
    /// # Errors
    /// It cannot be made, or the session has no body.
    pub fn create(folder: OutputFolder, file_name: &str, session: &Session<'_>) -> Result<Self> {
        let (Some(body), Some(plan)) = (session.body, session.plan) else {
            return Err(Error::failed("a bag needs the robot's body"));
        };
        let mut bag = BagWriter::create(folder, file_name)?;
        let links_topic = bag.topic("/tf", &bag_type::<TfMessage>())?;
        let touches_topic = bag.topic("/somatic/touches", &bag_type::<MarkerArray>())?;
        let clouds = Clouds::new(body);
        let cloud = bag_type::<PointCloud2>();
        let cloud_topic = |link: &String| bag.topic(&format!("/somatic/taxels/{}", topic_part(link)), &cloud);
        let cloud_topics = clouds.links().iter().map(cloud_topic).collect::<Result<_>>()?;
        let wrench = bag_type::<WrenchStamped>();
        let mut wrenches = Vec::new();
        for field in wrench_fields(body, plan) {
            let topic = bag.topic(&format!("/somatic/wrench/{}", topic_part(&field.name)), &wrench)?;
            wrenches.push((topic, field));
        }
        let names = session.names.iter().map(|names| {
            let marks = [&names.letter, &names.signal].into_iter().flatten();
            let name = marks.fold(names.field.clone(), |name, mark| format!("{name} ({mark})"));
            (name, names.link.clone())
        });
        Ok(Self {
            clock: RosClock::new(session.ros_time),
            clouds,
            cloud_topics,
            wrenches,
            touches: Touches::new(names.collect()),
            touches_topic,
            links_topic,
            at_rest: rest_poses(body),
            links_told_s: None,
            joints_topic: None,
            boards_topic: None,
            pressures: Vec::new(),
            pressure_of: HashMap::new(),
            waiting: VecDeque::new(),
            bag,
        })
    }

    /// The messages about `frame` alone.
    fn of_frame(&mut self, time_ns: u64, frame: &Frame) -> Result<Messages> {
        let mut messages = Vec::new();
        // Where links are is not known while joints are late, and told now and then while nothing moves.
        let is_due = self.links_told_s.is_none_or(|told_s| !(0.0..LINKS_PERIOD_S).contains(&(frame.t_s - told_s)));
        if !frame.has_stale_pose && (is_due || !frame.pose.is_empty()) {
            self.links_told_s = Some(frame.t_s);
            messages.push((self.links_topic, transforms(time_ns, &self.at_rest, frame).to_cdr()));
        }
        if !frame.joints.is_empty() {
            let topic = match self.joints_topic {
                Some(topic) => topic,
                None => *self.joints_topic.insert(self.bag.topic("/joint_states", &bag_type::<JointState>())?),
            };
            let (name, position) = frame.joints.iter().cloned().unzip();
            let state = JointState { header: header(time_ns, ""), name, position, ..JointState::default() };
            messages.push((topic, state.to_cdr()));
        }
        let clouds = self.clouds.messages(time_ns, &self.pressures);
        messages.extend(self.cloud_topics.iter().zip(clouds).map(|(topic, cloud)| (*topic, cloud.to_cdr())));
        if !self.wrenches.is_empty() {
            self.pressure_of.clear();
            self.pressure_of.extend(self.pressures.iter().copied());
            for (topic, field) in &self.wrenches {
                messages.extend(field.message(time_ns, &self.pressure_of).map(|wrench| (*topic, wrench.to_cdr())));
            }
        }
        Ok(messages)
    }
}

impl Sink for Ros2BagSink {
    fn write_input(&mut self, input: &InputFrames<'_>) -> Result<Flow> {
        for frame in input.frames {
            (input.pressures)(frame, &mut self.pressures);
            let time_ns = self.clock.time_ns(frame.t_s);
            let messages = self.of_frame(time_ns, frame)?;
            self.waiting.push_back((time_ns, messages));
        }
        Ok(Flow::Open)
    }

    fn write(&mut self, percepts: &Percepts) -> Result<Flow> {
        for frame in 0..percepts.frames() {
            let Some((time_ns, messages)) = self.waiting.pop_front() else { break };
            for (topic, message) in messages {
                self.bag.write(topic, time_ns, &message)?;
            }
            if let Some(markers) = self.touches.message(time_ns, percepts, frame) {
                self.bag.write(self.touches_topic, time_ns, &markers.to_cdr())?;
            }
        }
        self.bag.tick()?;
        Ok(Flow::Open)
    }

    fn write_news(&mut self, news: &News) -> Result<Flow> {
        let Some(boards) = &news.boards else { return Ok(Flow::Open) };
        let topic = match self.boards_topic {
            Some(topic) => topic,
            None => *self.boards_topic.insert(self.bag.topic("/diagnostics", &bag_type::<DiagnosticArray>())?),
        };
        // Not after the frames whose percepts are still to come.
        let time_ns = self.waiting.front().map_or(self.clock.last_ns(), |(time_ns, _)| *time_ns);
        let message = DiagnosticArray { header: header(time_ns, ""), status: boards.iter().map(status).collect() };
        self.bag.write(topic, time_ns, &message.to_cdr())?;
        Ok(Flow::Open)
    }

    fn flush(&mut self) -> Result<Flow> {
        self.bag.tick()?;
        Ok(Flow::Open)
    }

    fn finish(self: Box<Self>) -> Result<()> {
        self.bag.finish()
    }
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
