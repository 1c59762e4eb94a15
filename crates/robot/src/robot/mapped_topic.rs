//! Arrays within live messages of a topic of ROS 2, of any type that a map defines.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use super::defined::{MessageReading, Plan, is_usual, not_defined};
use super::ros2_source::found;
use crate::dds::{BytesReader, Delivery, Node};
use crate::error::{Error, Result, failed};
use crate::signal::{FrameTime, RawValue};
use crate::source::{ArrayMap, Came, MappedSource, Messages};

/// How long the first message is waited for, which says how many values there are.
const FIRST_WITHIN: Duration = Duration::from_secs(10);
/// How long one wait for a message lasts.
const WAIT: Duration = Duration::from_secs(1);
/// Messages that are kept until they are read: a quarter of a second at 250 Hz.
const DEPTH: usize = 64;
/// The node's name.
const NODE: &str = "somatic_source";

/// Live messages of a topic, by a map.
struct MappedTopic {
    name: String,
    kind: String,
    node: Node,
    reader: BytesReader,
    reading: MessageReading,
    has_come: bool,
    damaged: u64,
    /// Whether no message came, or the network is gone.
    has_failed: bool,
    stopped: Arc<AtomicBool>,
    read_at: Option<Instant>,
}

/// Frames from arrays within the messages of `topic`, by `map`. They are of the type `kind`, of that of the map, or of the one that other
/// nodes have there. Messages that are wrong are skipped with `skip_bad`.
///
/// # Errors
/// There is no network; the topic is not there, or no message comes, within 10 s; nothing defines its type; messages have not what the map
/// says.
pub fn mapped_topic(topic: &str, kind: Option<&str>, map: &ArrayMap, skip_bad: bool) -> Result<MappedSource> {
    let name = format!("source `ros2:{topic}`");
    let begun = MappedTopic::begin(topic, kind.or(map.kind.as_deref()), map, &name).map_err(|e| e.at(&name))?;
    MappedSource::new(Box::new(begun), map, skip_bad)
}

impl MappedTopic {
    fn begin(topic: &str, kind: Option<&str>, map: &ArrayMap, name: &str) -> Result<Self> {
        if topic.contains(',') {
            return Err(Error::usage("a map is for one topic"));
        }
        let mut node = Node::new("", NODE)?;
        let kind = match kind {
            Some(kind) => kind.to_owned(),
            None => found(&node, topic)?,
        };
        let plan = plan(&kind, map)?;
        let reader = node.bytes_reader(topic, &kind, Delivery::BestEffort { depth: DEPTH })?;
        let reading = MessageReading::new(map, plan);
        Ok(Self {
            name: name.to_owned(),
            kind,
            node,
            reader,
            reading,
            has_come: false,
            damaged: 0,
            has_failed: false,
            stopped: Arc::default(),
            read_at: None,
        })
    }

    /// The bytes of the next message; `None` where nobody waits for one any more.
    fn wait(&mut self) -> Result<Option<Vec<u8>>> {
        let since = Instant::now();
        while !self.stopped.load(Ordering::Relaxed) {
            if let Some(message) = self.reader.next(WAIT)? {
                self.has_come = true;
                return Ok(Some(message.0));
            }
            if !self.has_come && since.elapsed() >= FIRST_WITHIN {
                return Err(failed!(
                    "no message of {} came within {} s in domain {} (ROS_DOMAIN_ID); start its node first, or name its type: @TYPE",
                    self.kind,
                    FIRST_WITHIN.as_secs(),
                    self.node.domain()
                ));
            }
        }
        Ok(None)
    }
}

/// What is read of messages of `kind`, which only a map or this program can define: live messages do not bring their definitions.
fn plan(kind: &str, map: &ArrayMap) -> Result<Plan> {
    match map.definition.as_deref() {
        Some(text) if !ArrayMap::is_preset(&map.name) => Plan::new(map, kind, text, true),
        // A preset has those fields of a message that come first.
        Some(text) if map.kind.as_deref() == Some(kind) => Plan::new(map, kind, text, false),
        _ if is_usual(kind) => Plan::new(map, kind, "", true),
        _ => Err(not_defined("live messages do not define", kind)),
    }
}

impl Messages for MappedTopic {
    fn next(&mut self, values: &mut Vec<RawValue>) -> Result<Came> {
        self.has_failed = true;
        let message = self.wait().map_err(|e| e.at(&self.name))?;
        self.has_failed = false;
        let Some(message) = message else { return Ok(Came::End) };
        self.read_at = Some(Instant::now());
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let came = FrameTime::from_ns(i64::try_from(now.as_nanos()).unwrap_or(i64::MAX));
        match self.reading.read(&message, came, values).map_err(|e| e.at(&self.name))? {
            Some(time) => Ok(Came::Message(time)),
            None => {
                self.damaged += 1;
                Ok(Came::Damaged)
            }
        }
    }

    fn stop_by(&mut self, stopped: &Arc<AtomicBool>) {
        self.stopped = Arc::clone(stopped);
    }

    fn has_failed(&self) -> bool {
        self.has_failed
    }

    fn named(&self) -> &[(String, usize)] {
        self.reading.named()
    }

    fn name(&self) -> String {
        self.name.clone()
    }

    fn taken(&self) -> String {
        format!("{} ({}): {}", self.name, self.kind, self.reading.taken("time is when a message comes"))
    }

    fn losses(&self) -> Vec<String> {
        let messages = if self.damaged == 1 { "message was" } else { "messages were" };
        let what =
            format!("{}: {} {messages} not as long as the definition of {} says", self.name, self.damaged, self.kind);
        if self.damaged > 0 { vec![what] } else { Vec::new() }
    }

    fn read_at(&mut self) -> Option<Instant> {
        self.read_at.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_type_is_defined_by_the_map_or_known() {
        let array = ArrayMap::parse("values = 'data'").unwrap();
        assert!(plan("std_msgs/msg/Int16MultiArray", &array).is_ok());
        let why = plan("maker/msg/Pads", &array).err().unwrap().to_string();
        assert!(why.contains("live messages do not define maker/msg/Pads; give its .msg in the map"), "{why}");
        let mut own = array;
        own.definition = Some("float32[] data".to_owned());
        assert!(plan("maker/msg/Pads", &own).unwrap().read(&[0, 1, 0, 0, 0, 0, 0, 0], &mut Default::default()).is_ok());
        let hand = ArrayMap::named("dex3").unwrap();
        assert!(plan("unitree_hg/msg/HandState", &hand).is_ok());
        assert!(plan("other/msg/HandState", &hand).is_err());
    }
}
