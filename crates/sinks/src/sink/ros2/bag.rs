//! A bag of ROS 2 as a sink.

use std::collections::VecDeque;

use super::clock::RosClock;
use super::messages::{BOARDS, Messages, Topic, of_boards};
use super::moment::{Moment, without_frames};
use crate::error::Result;
use crate::output::OutputFolder;
use crate::percept::Percepts;
use crate::recording::{BagTopic, BagWriter};
use crate::sink::{Flow, InputFrames, News, Session, Sink};

/// Writes percepts, and the frames that they are made of, as a bag.
pub struct Ros2BagSink {
    messages: Messages,
    topics: Topics,
    clock: RosClock,
    /// Frames whose percepts are still to come: a bag's times do not fall.
    waiting: VecDeque<Moment>,
}

somatic_skin::debug_by_name!(Ros2BagSink);

/// The bag and those of its topics that are there, by [`Topic`].
struct Topics {
    bag: BagWriter,
    topics: Vec<Option<BagTopic>>,
}

impl Topics {
    fn write(&mut self, messages: &Messages, topic: Topic, time_ns: u64, message: &[u8]) -> Result<()> {
        let at = self.add(messages, topic)?;
        self.bag.write(at, time_ns, message)
    }

    fn add(&mut self, messages: &Messages, topic: Topic) -> Result<BagTopic> {
        if let Some(at) = self.topics[topic.0] {
            return Ok(at);
        }
        let kind = &messages.topics()[topic.0];
        Ok(*self.topics[topic.0].insert(self.bag.topic(&kind.name, &kind.kind)?))
    }
}

impl Ros2BagSink {
    /// Begins a bag in `folder` whose MCAP is called `file_name`.
    ///
    /// # Errors
    /// It cannot be made, or the session has no body.
    pub fn create(folder: OutputFolder, file_name: &str, session: &Session<'_>) -> Result<Self> {
        let messages = Messages::new(session)?;
        let topics = vec![None; messages.topics().len()];
        let mut topics = Topics { bag: BagWriter::create(folder, file_name, session.is_recorded)?, topics };
        for (index, kind) in messages.topics().iter().enumerate() {
            if !kind.is_optional {
                topics.add(&messages, Topic(index))?;
            }
        }
        Ok(Self { messages, topics, clock: RosClock::new(session.ros_time), waiting: VecDeque::new() })
    }
}

impl Sink for Ros2BagSink {
    fn remarks(&self) -> Vec<String> {
        self.messages.remarks().into_iter().map(|remark| format!("sink `ros2-mcap`: {remark}")).collect()
    }

    fn write_input(&mut self, input: &InputFrames<'_>) -> Result<Flow> {
        for frame in input.frames {
            let mut moment = Moment::default();
            moment.read(self.clock.time_ns(frame.time()), frame, input, self.messages.sensed());
            self.waiting.push_back(moment);
        }
        Ok(Flow::Open)
    }

    fn write(&mut self, percepts: &Percepts) -> Result<Flow> {
        let mut made = Vec::new();
        for frame in 0..percepts.frames() {
            let Some(mut moment) = self.waiting.pop_front() else { return Err(without_frames()) };
            moment.feel(percepts, frame);
            self.messages.tell(&moment, &mut |topic, message| {
                made.push((topic, message));
                Ok(true)
            })?;
            for (topic, message) in made.drain(..) {
                self.topics.write(&self.messages, topic, moment.time_ns, &message)?;
            }
        }
        self.topics.bag.tick()?;
        Ok(Flow::Open)
    }

    fn write_news(&mut self, news: &News) -> Result<Flow> {
        let Some(boards) = &news.boards else { return Ok(Flow::Open) };
        // Not after the frames whose percepts are still to come.
        let time_ns = self.waiting.front().map_or(self.clock.last_ns(), |moment| moment.time_ns);
        self.topics.write(&self.messages, BOARDS, time_ns, &of_boards(time_ns, boards))?;
        Ok(Flow::Open)
    }

    fn flush(&mut self) -> Result<Flow> {
        self.topics.bag.tick()?;
        Ok(Flow::Open)
    }

    fn finish(self: Box<Self>) -> Result<()> {
        self.topics.bag.finish()
    }

    fn finish_early(self: Box<Self>) -> Result<Option<String>> {
        self.topics.bag.finish_early()
    }
}
