//! Live frames from a topic of ROS 2: a cloud of points, or numbers in the order of the body's taxels.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use super::messages::{Float32MultiArray, Message, PointCloud2};
use super::places::{Places, not_read};
use crate::body::Body;
use crate::dds::{Delivery, Node, Reader};
use crate::error::{Error, Result, failed};
use crate::signal::{Frame, FrameTime};
use crate::source::Source;

/// How long a topic whose type is not named is looked for.
const FOUND_WITHIN: Duration = Duration::from_secs(10);
/// How long one wait for a message lasts.
const WAIT: Duration = Duration::from_secs(1);
/// Messages that are kept until they are read: a quarter of a second at 250 Hz.
const DEPTH: usize = 64;
/// The node's name.
const NODE: &str = "somatic_source";

/// Frames from a topic, for the taxels of a body.
pub struct Ros2Source {
    name: String,
    /// It stays as long as what reads from it.
    _node: Node,
    topic: Topic,
    places: Places,
    stopped: Arc<AtomicBool>,
    /// The system's time of the last message.
    read_at: Option<Instant>,
}

enum Topic {
    Clouds(Reader<PointCloud2>),
    Arrays(Reader<Float32MultiArray>),
}

impl Ros2Source {
    /// Reads `topic`, whose messages are of the type `kind`, or of the type that other nodes have there.
    ///
    /// # Errors
    /// Nobody has the topic within 10 s, or it is of another type; there is no network.
    pub fn open(topic: &str, kind: Option<&str>, body: &Body) -> Result<Self> {
        let name = format!("source `ros2:{topic}`");
        Self::begin(topic, kind, body, name.clone()).map_err(|e| e.at(name))
    }

    fn begin(topic: &str, kind: Option<&str>, body: &Body, name: String) -> Result<Self> {
        if topic.contains(',') {
            return Err(Error::usage("one topic is read live; clouds of several are merged of a bag"));
        }
        let mut node = Node::new("", NODE)?;
        let kind = match kind {
            Some(kind) => kind.to_owned(),
            None => found(&node, topic)?,
        };
        let delivery = Delivery::BestEffort { depth: DEPTH };
        let topic = match kind.as_str() {
            PointCloud2::TYPE => Topic::Clouds(node.reader(topic, &kind, delivery)?),
            Float32MultiArray::TYPE => Topic::Arrays(node.reader(topic, &kind, delivery)?),
            _ => return Err(not_read(&kind)),
        };
        Ok(Self { name, _node: node, topic, places: Places::new(body), stopped: Arc::default(), read_at: None })
    }
}

/// The type of `topic`, as other nodes have it.
pub(super) fn found(node: &Node, topic: &str) -> Result<String> {
    let kinds = node.types_at(topic, FOUND_WITHIN);
    match &kinds[..] {
        [kind] => Ok(kind.clone()),
        [] => {
            let others: Vec<String> =
                node.topics().into_iter().map(|(name, kind)| format!("{name} ({kind})")).collect();
            let others = if others.is_empty() { "no topic at all".to_owned() } else { others.join(", ") };
            Err(failed!(
                "no node has it within {} s in domain {} (ROS_DOMAIN_ID); there is {others}; start its node first, or name its \
                 type: ros2:{topic}@{}",
                FOUND_WITHIN.as_secs(),
                node.domain(),
                PointCloud2::TYPE
            ))
        }
        kinds => Err(failed!("it has several types, {}; name one: ros2:{topic}@TYPE", kinds.join(", "))),
    }
}

impl Source for Ros2Source {
    fn taxels(&self) -> &[u32] {
        self.places.ids()
    }

    fn stop_by(&mut self, stopped: &Arc<AtomicBool>) {
        self.stopped = Arc::clone(stopped);
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        while !self.stopped.load(Ordering::Relaxed) {
            let read = match &mut self.topic {
                Topic::Clouds(reader) => {
                    reader.next(WAIT)?.map(|cloud| self.places.cloud(&cloud, cloud.header.stamp.frame_time(), frame))
                }
                Topic::Arrays(reader) => reader.next(WAIT)?.map(|array| {
                    // It has no stamp: its time is when it came.
                    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
                    self.places.array(
                        &array,
                        FrameTime::from_ns(i64::try_from(now.as_nanos()).unwrap_or(i64::MAX)),
                        frame,
                    )
                }),
            };
            if let Some(read) = read {
                self.read_at = Some(Instant::now());
                return read.map(|()| true).map_err(|e| e.at(&self.name));
            }
        }
        Ok(false)
    }

    fn read_at(&mut self) -> Option<Instant> {
        self.read_at.take()
    }

    fn notices(&mut self) -> Vec<String> {
        let of_places = std::mem::take(&mut self.places.notices);
        of_places.into_iter().map(|what| format!("{}: {what}", self.name)).collect()
    }
}
