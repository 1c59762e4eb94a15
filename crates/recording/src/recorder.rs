//! A recording being written.

use std::collections::BTreeMap;
use std::io::BufWriter;
use std::time::{Duration, Instant};

use mcap::McapError;
use mcap::records::MessageHeader;
use mcap::write::{Metadata, NoSeek};

use super::{
    FIELDS, FRAMES, FRAMES_CHANNEL, LINKS, METADATA, PERCEPTS, SURFACE, TAXEL_IDS, TAXELS, TOUCHES, WORLD, Z_UP,
    frames, nanoseconds, schemas, words_of,
};
use crate::error::{Error, Result, failed};
use crate::output::{GrowingFile, OutputFile, OutputPath};
use crate::signal::Frame;

/// The longest that anything is held back, so that a process that is killed loses less than a second.
const HELD_BACK: Duration = Duration::from_millis(500);
/// Bytes of messages after which a chunk is closed.
const CHUNK: u64 = 1 << 20;

/// The number of the channel that is added first.
const FIRST_CHANNEL: u16 = 1;

/// Writes frames, and messages about them: to a file that can be read however the writing ends, or to one that appears when it is
/// whole.
pub struct Recorder {
    name: String,
    /// If the file grows under its own name.
    growing: Option<GrowingFile>,
    /// `None` once the end is written.
    writer: Option<Writer>,
    /// By topic, in the order in which they came up.
    channels: Vec<(String, u16, u32)>,
    taxels: String,
    /// What the outputs of percepts are measured in: metadata of their channel.
    units: BTreeMap<String, String>,
    /// The JSON schema of percepts.
    schema_of_percepts: String,
    message: Vec<u8>,
    flushed: Instant,
    /// Whether anything waits to be flushed.
    pending: bool,
    /// Whether there is anything in the file that is worth keeping.
    worth_keeping: bool,
}

somatic_skin::debug_by_name!(Recorder);

type Writer = mcap::Writer<NoSeek<BufWriter<OutputFile>>>;

impl Recorder {
    /// Begins a recording at `output` of the taxels `ids`, in the order of a frame's values. It grows there from the first
    /// frame on.
    ///
    /// # Errors
    /// The file cannot be made.
    pub fn create(output: OutputPath, ids: &[u32]) -> Result<Self> {
        let name = output.name().display().to_string();
        let (to, growing) = output.grow()?;
        Self::begin(name, to, Some(growing), ids)
    }

    /// The same in a file that appears when the recording is finished; dropped before, it leaves nothing, and a file that is there
    /// stays.
    ///
    /// # Errors
    /// As [`Recorder::create`].
    pub fn create_whole(output: OutputPath, ids: &[u32]) -> Result<Self> {
        let name = output.name().display().to_string();
        Self::begin(name, output.begin()?, None, ids)
    }

    fn begin(name: String, to: OutputFile, growing: Option<GrowingFile>, ids: &[u32]) -> Result<Self> {
        let options = mcap::WriteOptions::new()
            .compression(None)
            .library(concat!("somatic ", env!("CARGO_PKG_VERSION")))
            .chunk_size(Some(CHUNK))
            // A chunk is put together in memory: on disk it is whole, or the last thing there.
            .disable_seeking(true)
            // Every chunk has its own.
            .calculate_data_section_crc(false);
        let to = NoSeek::new(BufWriter::with_capacity(1 << 16, to));
        let writer = options.create(to).map_err(|e| cannot_write(&name, e))?;
        let mut recorder = Self {
            name,
            growing,
            writer: Some(writer),
            channels: Vec::new(),
            taxels: words_of(ids),
            units: BTreeMap::new(),
            schema_of_percepts: r#"{"title":"somatic.Percepts","type":"object"}"#.to_owned(),
            message: Vec::new(),
            flushed: Instant::now(),
            pending: false,
            worth_keeping: false,
        };
        // Outside of any chunk and before all else: every frame depends on it.
        let preface = [
            (TAXEL_IDS, recorder.taxels.clone()),
            (FRAMES_CHANNEL, FIRST_CHANNEL.to_string()),
            (WORLD, Z_UP.to_owned()),
        ];
        let metadata = preface.map(|(key, value)| (key.to_owned(), value)).into();
        recorder.with(|writer| writer.write_metadata(&Metadata { name: METADATA.to_owned(), metadata }))?;
        Ok(recorder)
    }

    /// Says which keys a line of percepts may have, as a JSON schema, before the first of them.
    pub fn set_schema_of_percepts(&mut self, schema: String) {
        self.schema_of_percepts = schema;
    }

    /// Says what the percepts' outputs are measured in, each as the JSON of its unit, before the first of them.
    pub fn set_units(&mut self, units: impl IntoIterator<Item = (String, serde_json::Value)>) {
        let word = |unit: serde_json::Value| unit.as_str().map_or_else(|| unit.to_string(), str::to_owned);
        self.units = units.into_iter().map(|(output, unit)| (format!("unit_{output}"), word(unit))).collect();
    }

    /// Puts a file beside the frames.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn attach(&mut self, name: &str, media_type: &str, bytes: &[u8]) -> Result<()> {
        let (name, media_type) = (name.to_owned(), media_type.to_owned());
        let attachment = mcap::Attachment { log_time: 0, create_time: 0, name, media_type, data: bytes.into() };
        self.with(|writer| writer.attach(&attachment))
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn frame(&mut self, frame: &Frame) -> Result<()> {
        let mut message = std::mem::take(&mut self.message);
        frames::encode(frame, &mut message);
        let written = self.write(FRAMES, frame.t_s, &message);
        self.message = message;
        written
    }

    /// Adds a message on one of the topics of a recording.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&mut self, topic: &str, t_s: f64, message: &[u8]) -> Result<()> {
        let index = match self.channels.iter().position(|(known, ..)| known == topic) {
            Some(index) => index,
            None => {
                // The first one is that of frames, as the preface says.
                let first = Some(FRAMES).filter(|_| self.channels.is_empty() && topic != FRAMES);
                for topic in first.into_iter().chain([topic]) {
                    let id = self.add_channel(topic)?;
                    self.channels.push((topic.to_owned(), id, 0));
                }
                self.channels.len() - 1
            }
        };
        let (_, channel_id, sequence) = &mut self.channels[index];
        let log_time = nanoseconds(t_s);
        let header = MessageHeader { channel_id: *channel_id, sequence: *sequence, log_time, publish_time: log_time };
        *sequence = sequence.wrapping_add(1);
        self.pending = true;
        self.worth_keeping = true;
        self.with(|writer| writer.write_to_known_channel(&header, message))
    }

    fn add_channel(&mut self, topic: &str) -> Result<u16> {
        let (schema, encoding, message_encoding, data) = match topic {
            FRAMES => ("somatic.Frame", "protobuf", "protobuf", schemas::somatic()),
            PERCEPTS => ("somatic.Percepts", "jsonschema", "json", self.schema_of_percepts.clone().into_bytes()),
            TAXELS => ("foxglove.PointCloud", "protobuf", "protobuf", schemas::foxglove()),
            SURFACE | TOUCHES => ("foxglove.SceneUpdate", "protobuf", "protobuf", schemas::foxglove()),
            LINKS => ("foxglove.FrameTransforms", "protobuf", "protobuf", schemas::foxglove()),
            topic if topic.starts_with(FIELDS) => ("somatic.Field", "protobuf", "protobuf", schemas::somatic()),
            _ => unreachable!("a recording has no topic {topic}"),
        };
        let metadata = match topic {
            FRAMES => {
                BTreeMap::from([(TAXEL_IDS.to_owned(), self.taxels.clone()), (WORLD.to_owned(), Z_UP.to_owned())])
            }
            PERCEPTS => self.units.clone(),
            _ => BTreeMap::new(),
        };
        self.with(|writer| {
            let schema = writer.add_schema(schema, encoding, &data)?;
            writer.add_channel(schema, topic, message_encoding, &metadata)
        })
    }

    /// Hands to the system what has been held back, where that was for half a second.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn tick(&mut self) -> Result<()> {
        if !self.pending || self.flushed.elapsed() < HELD_BACK {
            return Ok(());
        }
        self.pending = false;
        let flushed = self.with(mcap::Writer::flush);
        self.flushed = Instant::now();
        flushed
    }

    /// Closes the chunk, for tests of small files.
    #[cfg(test)]
    pub(super) fn end_chunk(&mut self) {
        self.with(mcap::Writer::flush).unwrap();
    }

    /// Writes the end: indexes that let readers jump.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish(mut self) -> Result<()> {
        self.worth_keeping = true;
        self.with(|writer| writer.finish().map(drop))?;
        let Some(writer) = self.writer.take() else { return Ok(()) };
        let file = writer.into_inner().into_inner().into_inner();
        file.map_err(|e| cannot_write(&self.name, e.into_error().into()))?.finish()
    }

    /// Ends it before all is there: a file that grows under its own name gets its end, one that appears when it is whole does not
    /// appear. Gives the name of a file that is not there for this reason.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn finish_early(self) -> Result<Option<String>> {
        if self.growing.is_none() {
            return Ok(Some(self.name.clone()));
        }
        self.finish().map(|()| None)
    }

    /// Does something with the writer.
    fn with<T>(&mut self, something: impl FnOnce(&mut Writer) -> Result<T, McapError>) -> Result<T> {
        let writer = self.writer.as_mut().expect("it is there until the recording is finished");
        something(writer).map_err(|e| cannot_write(&self.name, e))
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        // The writer ends the file on its own, as well as it still can.
        self.writer = None;
        if let Some(growing) = self.growing.as_ref().filter(|_| !self.worth_keeping) {
            growing.remove();
        }
    }
}

/// What to say of an MCAP called `name` that cannot be written.
pub(super) fn cannot_write(name: &str, error: McapError) -> Error {
    let what = match error {
        McapError::Io(e) => e.to_string(),
        other => other.to_string(),
    };
    failed!("cannot write: {what}").at(name)
}
