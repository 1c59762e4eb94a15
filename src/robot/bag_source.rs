//! Frames from a bag of ROS 2, by the code that reads live topics.

use super::cloud_merge::{CloudMerge, TopicCloud};
use super::messages::{Float32MultiArray, Message as _, PointCloud2};
use super::places::{FRAME_TYPES, Places, not_read};
use crate::body::Body;
use crate::error::{Error, Result, failed};
use crate::recording::{BagMessage, BagReader, WantedTopics};
use crate::signal::Frame;
use crate::source::{BagName, Source};

/// What is read of a bag, where frames are.
pub(super) fn frames_of(bag: &BagName) -> Result<BagReader> {
    let named: Vec<&str> = bag.kind.as_deref().into_iter().collect();
    if let Some(kind) = named.iter().find(|kind| !FRAME_TYPES.contains(kind)) {
        return Err(not_read(kind).at(bag.path.display()));
    }
    let kinds = if named.is_empty() { &FRAME_TYPES[..] } else { &named };
    let wanted = WantedTopics { topics: &bag.topics, kinds, merged: Some(PointCloud2::TYPE) };
    BagReader::open(&bag.path, &wanted)
}

/// Frames from topics of a bag in MCAP, for the taxels of a body: clouds of points, or numbers in the body's order.
///
/// The time of a frame is its cloud's stamp. Where that is 0, and of numbers, which have none, it is when the message came, by
/// the recorder's clock. Clouds of several topics are merged as frames of several boards are: a topic whose last cloud is older
/// than three of its periods, and than 50 ms, leaves its taxels stale.
pub struct BagSource {
    path: String,
    bag: BagReader,
    /// Their names.
    topics: Vec<String>,
    places: Places,
    kind: Kind,
    notices: Vec<String>,
}

/// What is read.
enum Kind {
    Array,
    Cloud,
    /// Clouds of several topics.
    Clouds(Box<CloudMerge>),
}

impl BagSource {
    /// Opens the topics that are named; or the only one that frames are read from, or all where they are clouds.
    ///
    /// # Errors
    /// The bag cannot be read, or has no such topics, or some that are not read together.
    pub fn open(bag: &BagName, body: &Body) -> Result<Self> {
        let reader = frames_of(bag)?;
        let kind = match reader.topics().len() {
            1 if reader.kind() == PointCloud2::TYPE => Kind::Cloud,
            1 => Kind::Array,
            topics => Kind::Clouds(Box::new(CloudMerge::new(topics, body.taxels.len()))),
        };
        Ok(Self {
            path: bag.path.display().to_string(),
            topics: reader.topics().to_vec(),
            bag: reader,
            places: Places::new(body),
            kind,
            notices: Vec::new(),
        })
    }

    /// `error` of a message of topic `topic` that came at `log_s`.
    fn placed(&self, error: Error, topic: usize, log_s: f64) -> Error {
        let (path, name) = (&self.path, &self.topics[topic]);
        let others: Vec<&str> = self.topics.iter().filter(|other| *other != name).map(String::as_str).collect();
        let error = match others.is_empty() {
            true => error,
            false => failed!("{error}; or leave this topic out: ros2-mcap:{path}:{}", others.join(",")),
        };
        error.at(format!("{path}: {name}: the message of {log_s} s"))
    }

    /// Tells, at the end, which topics are not in all frames.
    fn tell_of_topics(&mut self) {
        let Kind::Clouds(merge) = &mut self.kind else { return };
        for (topic, told) in merge.summaries() {
            self.notices.push(format!("{}: {}: {told}", self.path, self.topics[topic]));
        }
    }
}

impl Kind {
    /// Reads `message` into `frame`, or to be merged; gives its time, s. `None` where it is damaged.
    fn read(
        &mut self,
        message: &BagMessage<'_>,
        places: &mut Places,
        topics: &[String],
        frame: &mut Frame,
    ) -> Option<Result<f64>> {
        let log_s = message.log_ns as f64 / 1e9;
        let time_s = |cloud: &PointCloud2| match cloud.header.stamp.nanoseconds() {
            0 => log_s,
            _ => cloud.header.stamp.seconds(),
        };
        Some(match self {
            Self::Array => {
                let array = Float32MultiArray::from_cdr(message.data)?;
                places.array(&array, log_s, frame).map(|()| log_s)
            }
            Self::Cloud => {
                let cloud = PointCloud2::from_cdr(message.data)?;
                places.cloud(&cloud, time_s(&cloud), frame).map(|()| frame.t_s)
            }
            Self::Clouds(merge) => {
                let cloud = PointCloud2::from_cdr(message.data)?;
                let t_s = time_s(&cloud);
                let mut values = Vec::new();
                places.points(&cloud, |index, value| values.push((index, value))).and_then(|()| {
                    let cloud = TopicCloud { topic: message.topic, t_s, log_s, values };
                    merge.push(cloud).map(|()| t_s).map_err(|(index, other)| {
                        let (taxel, other) = (places.ids()[index], &topics[other]);
                        failed!("taxel {taxel} is in clouds of {other}, too; record each taxel on one topic")
                    })
                })
            }
        })
    }
}

impl Source for BagSource {
    fn taxels(&self) -> &[u32] {
        self.places.ids()
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        loop {
            if let Kind::Clouds(merge) = &mut self.kind {
                if merge.next_frame(frame) {
                    return Ok(true);
                }
                if merge.has_ended() {
                    self.tell_of_topics();
                    return Ok(false);
                }
            }
            let Some(message) = self.bag.next()? else {
                let Kind::Clouds(merge) = &mut self.kind else { return Ok(false) };
                merge.end();
                continue;
            };
            let (topic, bytes, log_s) = (message.topic, message.data.len(), message.log_ns as f64 / 1e9);
            match self.kind.read(&message, &mut self.places, &self.topics, frame) {
                Some(Ok(t_s)) => self.bag.saw(t_s),
                Some(Err(e)) => return Err(self.placed(e, topic, log_s)),
                None => {
                    self.bag.damaged(bytes);
                    continue;
                }
            }
            if !matches!(self.kind, Kind::Clouds(_)) {
                return Ok(true);
            }
        }
    }

    fn progress(&self) -> Option<f64> {
        Some(self.bag.progress())
    }

    fn report_stale(&mut self) {
        if let Kind::Clouds(merge) = &mut self.kind {
            merge.report_stale();
        }
    }

    fn has_stale(&self) -> bool {
        matches!(&self.kind, Kind::Clouds(merge) if merge.has_stale())
    }

    fn notices(&mut self) -> Vec<String> {
        let of_places = std::mem::take(&mut self.places.notices);
        let mut notices: Vec<String> = of_places.into_iter().map(|what| format!("{}: {what}", self.path)).collect();
        notices.append(&mut self.notices);
        notices
    }

    fn losses(&self) -> Vec<String> {
        self.bag.losses().to_vec()
    }
}
