//! A bag of ROS 2 being written: an MCAP of profile `ros2`, and the `metadata.yaml` that says what is in it.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::BufWriter;
use std::time::{Duration, Instant};

use mcap::McapError;
use mcap::records::MessageHeader;
use mcap::write::NoSeek;

use super::recorder::cannot_write;
use crate::error::{Result, failed};
use crate::output::{GrowingFile, OutputFile, OutputFolder, OutputPath};

/// The file in a bag's folder that says what is in it.
pub const BAG_METADATA: &str = "metadata.yaml";
/// The version of that file: that of ROS 2 Jazzy.
const METADATA_VERSION: u32 = 9;
const DISTRIBUTION: &str = "jazzy";
/// The longest that anything is held back.
const HELD_BACK: Duration = Duration::from_millis(500);
const CHUNK: u64 = 1 << 20;

/// The type of a topic's messages.
#[derive(Clone, Debug)]
pub struct BagType {
    /// Such as `sensor_msgs/msg/PointCloud2`.
    pub name: &'static str,
    /// RIHS01.
    pub hash: &'static str,
    /// All definitions, as schema `ros2msg`.
    pub definition: String,
}

/// A topic that has been added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BagTopic(usize);

struct Topic {
    name: String,
    kind: BagType,
    channel: u16,
    messages: u32,
}

/// Writes messages in the order of their times.
pub struct BagWriter {
    name: String,
    file_name: String,
    /// If its file grows under its own name.
    growing: Option<GrowingFile>,
    metadata: Option<OutputPath>,
    /// `None` once the end is written.
    writer: Option<Writer>,
    topics: Vec<Topic>,
    span_ns: Option<(u64, u64)>,
    flushed: Instant,
}

type Writer = mcap::Writer<NoSeek<BufWriter<OutputFile>>>;

impl BagWriter {
    /// Begins a bag in `folder`, whose MCAP is called `file_name`; `whole`, that file appears when the bag is finished, and before
    /// there is nothing.
    ///
    /// # Errors
    /// The folder or a file cannot be made.
    pub fn create(mut folder: OutputFolder, file_name: &str, whole: bool) -> Result<Self> {
        folder.make()?;
        let output = folder.take(file_name);
        let name = output.name().display().to_string();
        let (to, growing) = match whole {
            true => (output.begin()?, None),
            false => output.grow().map(|(to, growing)| (to, Some(growing)))?,
        };
        let options = mcap::WriteOptions::new()
            .compression(None)
            .profile("ros2")
            .library(concat!("somatic ", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK))
            .disable_seeking(true);
        let writer =
            options.create(NoSeek::new(BufWriter::with_capacity(1 << 16, to))).map_err(|e| cannot_write(&name, e))?;
        Ok(Self {
            name,
            file_name: file_name.to_owned(),
            growing,
            metadata: Some(folder.take(BAG_METADATA)),
            writer: Some(writer),
            topics: Vec::new(),
            span_ns: None,
            flushed: Instant::now(),
        })
    }

    /// The topic called `name`, added if it is new.
    ///
    /// # Errors
    /// It cannot be written, or its messages are of another type.
    pub fn topic(&mut self, name: &str, kind: &BagType) -> Result<BagTopic> {
        if let Some(index) = self.topics.iter().position(|topic| topic.name == name) {
            if self.topics[index].kind.name != kind.name {
                return Err(failed!("topic {name} cannot have {} and {}", self.topics[index].kind.name, kind.name)
                    .at(&self.name));
            }
            return Ok(BagTopic(index));
        }
        let metadata = BTreeMap::from([
            // The default of a player: reliable, and a history of ten.
            ("offered_qos_profiles".to_owned(), String::new()),
            ("topic_type_hash".to_owned(), kind.hash.to_owned()),
        ]);
        let channel = self.with(|writer| {
            let schema = writer.add_schema(kind.name, "ros2msg", kind.definition.as_bytes())?;
            writer.add_channel(schema, name, "cdr", &metadata)
        })?;
        self.topics.push(Topic { name: name.to_owned(), kind: kind.clone(), channel, messages: 0 });
        Ok(BagTopic(self.topics.len() - 1))
    }

    /// Adds a message, not before those that are there.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&mut self, topic: BagTopic, time_ns: u64, message: &[u8]) -> Result<()> {
        let topic = &mut self.topics[topic.0];
        let (channel_id, sequence) = (topic.channel, topic.messages);
        topic.messages += 1;
        let (first_ns, last_ns) = self.span_ns.unwrap_or((time_ns, time_ns));
        assert!(last_ns <= time_ns, "a bag's times do not fall");
        self.span_ns = Some((first_ns, time_ns));
        let header = MessageHeader { channel_id, sequence, log_time: time_ns, publish_time: time_ns };
        self.with(|writer| writer.write_to_known_channel(&header, message))
    }

    /// Hands to the system what has been held back, where that was for half a second.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn tick(&mut self) -> Result<()> {
        if self.flushed.elapsed() < HELD_BACK {
            return Ok(());
        }
        self.flushed = Instant::now();
        self.with(mcap::Writer::flush)
    }

    /// Writes the end of the MCAP, then the metadata.
    ///
    /// # Errors
    /// They cannot be written.
    pub fn finish(mut self) -> Result<()> {
        self.with(|writer| writer.finish().map(drop))?;
        if let Some(writer) = self.writer.take() {
            let file = writer.into_inner().into_inner().into_inner();
            file.map_err(|e| cannot_write(&self.name, e.into_error().into()))?.finish()?;
        }
        let text = self.metadata_text();
        self.metadata.take().map_or(Ok(()), |metadata| metadata.write(text.as_bytes()))
    }

    /// Ends it before all is there, as [`super::Recorder::finish_early`].
    ///
    /// # Errors
    /// They cannot be written.
    pub fn finish_early(self) -> Result<Option<String>> {
        if self.growing.is_none() {
            return Ok(Some(self.name.clone()));
        }
        self.finish().map(|()| None)
    }

    fn metadata_text(&self) -> String {
        let (first_ns, last_ns) = self.span_ns.unwrap_or_default();
        let duration_ns = last_ns - first_ns;
        let messages: u64 = self.topics.iter().map(|topic| u64::from(topic.messages)).sum();
        // A string of JSON is one of YAML.
        let quoted = |text: &str| serde_json::Value::from(text).to_string();
        let file = quoted(&self.file_name);
        let mut text = format!(
            "rosbag2_bagfile_information:\n  version: {METADATA_VERSION}\n  storage_identifier: mcap\n  duration:\n    \
             nanoseconds: {duration_ns}\n  starting_time:\n    nanoseconds_since_epoch: {first_ns}\n  message_count: {messages}\n  \
             topics_with_message_count:"
        );
        for Topic { name, kind, messages, .. } in &self.topics {
            let _ = write!(
                text,
                "\n    - topic_metadata:\n        name: {}\n        type: {}\n        serialization_format: cdr\n        \
                 offered_qos_profiles: []\n        type_description_hash: {}\n      message_count: {messages}",
                quoted(name),
                kind.name,
                kind.hash
            );
        }
        if self.topics.is_empty() {
            text += " []";
        }
        let _ = write!(
            text,
            "\n  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - {file}\n  files:\n    - path: \
             {file}\n      starting_time:\n        nanoseconds_since_epoch: {first_ns}\n      duration:\n        nanoseconds: \
             {duration_ns}\n      message_count: {messages}\n  custom_data: ~\n  ros_distro: {DISTRIBUTION}\n"
        );
        text
    }

    fn with<T>(&mut self, something: impl FnOnce(&mut Writer) -> Result<T, McapError>) -> Result<T> {
        let writer = self.writer.as_mut().expect("it is there until the bag is finished");
        something(writer).map_err(|e| cannot_write(&self.name, e))
    }
}

impl Drop for BagWriter {
    fn drop(&mut self) {
        // The writer ends the file on its own, as well as it still can.
        self.writer = None;
        if let Some(growing) = &self.growing
            && self.span_ns.is_none()
            && self.metadata.is_some()
        {
            growing.remove();
        }
    }
}
