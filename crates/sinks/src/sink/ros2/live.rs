//! Live topics of ROS 2 as a sink.

use std::time::{Duration, Instant};

use super::clock::RosClock;
use super::messages::{BOARDS, Messages, Topic, TopicKind, of_boards};
use super::moment::{Moment, without_frames};
pub(super) use crate::dds::{Delivery, Node, Writer};
use crate::error::Result;
use crate::percept::Percepts;
use crate::robot::messages::{Message as _, PointCloud2};
use crate::scene::SensedTaxels;
use crate::signal::BoardHealth;
use crate::sink::handover::{Carrier, Handover, tell};
use crate::sink::{Flow, InputFrames, News, Session, Sink};

/// The node's name.
const NODE: &str = "somatic";
/// Frames that wait for the network: a quarter of a second at 250 Hz.
const ROOM: usize = 64;
/// How long the end waits for what waits to be sent.
const END_WITHIN: Duration = Duration::from_secs(2);
/// How long the node stays after its last message, as that is sent by another thread; and then at most for receipts of reliable
/// readers, and what they ask for again.
const LINGER: Duration = Duration::from_millis(300);
const RECEIPTS_WITHIN: Duration = Duration::from_secs(1);
/// Clouds that are kept: with the 5 of ROS 2's profile for sensor data, frames that come together after a pause were lost. And
/// messages of other topics.
const CLOUD_DEPTH: usize = ROOM;
const DEPTH: usize = 100;
/// Touches of a frame with many.
const MANY_TOUCHES: usize = 16;

/// Sends percepts, and the frames that they are made of, to nodes of ROS 2.
pub struct Ros2Sink {
    handover: Handover<Item>,
    clock: RosClock,
    /// Frames whose percepts are still to come, and others to fill again: `read` of them.
    moments: Vec<Moment>,
    read: usize,
    sensed: SensedTaxels,
    remarks: Vec<String>,
}

/// What the sending thread gets.
#[derive(Default)]
struct Item {
    moment: Moment,
    /// Instead of a frame: how boards are doing at the moment's time.
    boards: Option<Vec<BoardHealth>>,
}

impl Ros2Sink {
    /// Begins a node whose topics are in `namespace`, which is empty or begins with `/`.
    ///
    /// # Errors
    /// It cannot be made, or the session has no body.
    pub fn start(namespace: &str, session: &Session<'_>) -> Result<Self> {
        let name = format!("sink `ros2:{namespace}`");
        let at = |e: crate::error::Error| e.at(&name);
        let messages = Messages::new(session).map_err(at)?;
        let mut node = Node::new(namespace, NODE).map_err(at)?;
        let mut writers = Vec::new();
        for kind in messages.topics() {
            let topic = format!("{namespace}{}", live_name(&kind.name));
            writers.push(node.writer(&topic, kind.kind.name, delivery(kind)).map_err(at)?);
        }
        let remarks = messages.remarks().into_iter().map(|remark| format!("{name}: {remark}")).collect();
        let sensed = messages.sensed().clone();
        let sender = Sender { messages, writers, refused: 0, name: name.clone(), _node: node };
        let handover = Handover::start(&name, "frames", ROOM, sender)?;
        Ok(Self { handover, clock: RosClock::new(session.ros_time), moments: Vec::new(), read: 0, sensed, remarks })
    }
}

/// What the bag's topic `name` is called live: the robot's own `/joint_states` are not written to, as they may be what is read.
fn live_name(name: &str) -> &str {
    if name == "/joint_states" { "/somatic/joint_states" } else { name }
}

fn delivery(topic: &TopicKind) -> Delivery {
    if topic.kind.name == PointCloud2::TYPE {
        return Delivery::BestEffort { depth: CLOUD_DEPTH };
    }
    Delivery::Reliable { depth: if topic.has_several { DEPTH * MANY_TOUCHES } else { DEPTH } }
}

/// Makes messages and sends them, on a thread of its own.
struct Sender {
    messages: Messages,
    /// By [`Topic`].
    writers: Vec<Writer>,
    /// Messages that a reader without receipts kept from being sent.
    refused: u64,
    name: String,
    /// It goes last.
    _node: Node,
}

impl Carrier<Item> for Sender {
    fn carry(&mut self, item: &Item) -> Result<()> {
        let Self { messages, writers, refused, .. } = self;
        let mut send = |topic: Topic, message: Vec<u8>| {
            let is_sent = writers[topic.0].write(message)?;
            *refused += u64::from(!is_sent);
            Ok(is_sent)
        };
        match &item.boards {
            Some(boards) => send(BOARDS, of_boards(item.moment.time_ns, boards)).map(drop),
            None => messages.tell(&item.moment, &mut send),
        }
        .map_err(|e| e.at(&self.name))
    }

    fn end(&mut self) -> Result<()> {
        std::thread::sleep(LINGER);
        let until = Instant::now() + RECEIPTS_WITHIN;
        let left = || until.saturating_duration_since(Instant::now());
        let without_receipt: u64 = self.writers.iter().map(|writer| writer.without_receipt(left())).sum();
        if self.refused > 0 {
            let what = "reliable messages were not sent, as a reader gave no receipts";
            tell(&format!("{}: {} {what}", self.name, self.refused));
        }
        if without_receipt > 0 {
            let what = "reliable messages may not have arrived, as a reader gave no receipts";
            tell(&format!("{}: up to {without_receipt} {what}", self.name));
        }
        Ok(())
    }
}

impl Sink for Ros2Sink {
    fn remarks(&self) -> Vec<String> {
        self.remarks.clone()
    }

    fn write_input(&mut self, input: &InputFrames<'_>) -> Result<Flow> {
        self.moments.resize_with(self.moments.len().max(input.frames.len()), Moment::default);
        for (moment, frame) in self.moments.iter_mut().zip(input.frames) {
            moment.read(self.clock.time_ns(frame.time()), frame, input, &self.sensed);
        }
        self.read = input.frames.len();
        Ok(Flow::Open)
    }

    fn write(&mut self, percepts: &Percepts) -> Result<Flow> {
        let read = std::mem::take(&mut self.read);
        if read < percepts.frames() {
            return Err(without_frames());
        }
        for (frame, moment) in self.moments[..read.min(percepts.frames())].iter_mut().enumerate() {
            moment.feel(percepts, frame);
            self.handover.hand_over(|item| {
                item.boards = None;
                std::mem::swap(&mut item.moment, moment);
            })?;
        }
        Ok(Flow::Open)
    }

    fn write_news(&mut self, news: &News) -> Result<Flow> {
        let Some(boards) = &news.boards else { return Ok(Flow::Open) };
        let time_ns = self.clock.last_ns();
        self.handover.hand_over(|item| {
            item.moment.time_ns = time_ns;
            item.boards = Some(boards.clone());
        })?;
        Ok(Flow::Open)
    }

    fn flush(&mut self) -> Result<Flow> {
        Ok(Flow::Open)
    }

    fn finish(self: Box<Self>) -> Result<()> {
        self.handover.finish(END_WITHIN + LINGER + RECEIPTS_WITHIN).map(drop)
    }
}
