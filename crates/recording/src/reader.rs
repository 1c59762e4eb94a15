//! Reads a recording: what is whole in the file, in its order. The rest is counted and reported.

use std::collections::HashMap;
use std::fs::File;
use std::path::Path;

use super::account::Account;
use super::bag_files::not_mcap;
use super::chunks::{Chunks, Refusal};
use super::entries::{Attached, Channel, Schema, channel, data_of, schema};
use super::frames::FrameMessage;
use super::head::Head;
use super::records::{Parts, Record, Records, op};
use super::summary::{Summary, Trust};
use super::{FRAMES, Z_UP, nanoseconds};
use crate::body::{WORLD_FROM_BODY, WORLD_FROM_BODY_ROTATION};
use crate::error::{Error, Result, failed};
use crate::signal::{Frame, Pose, RawValue};

/// A message as it lies in its chunk.
pub(super) struct Message {
    pub(super) channel: u16,
    pub(super) log_time: u64,
    /// Where its data are, in [`Reader::chunk`].
    data: std::ops::Range<usize>,
}

/// Reads a recording from its first frame to its last.
pub struct Reader {
    name: String,
    chunks: Chunks,
    taxels: Vec<u32>,
    attached: Vec<Attached>,
    /// Whether what is attached may be more than [`Reader::attached`].
    may_lack_attached: bool,
    pub(super) channels: HashMap<u16, Channel>,
    pub(super) schemas: HashMap<u16, Schema>,
    /// Whether the file's summary tells its channels.
    pub(super) has_summary: bool,
    chunk: Vec<u8>,
    /// What of the chunk is still to be read.
    left: std::ops::Range<usize>,
    /// How many messages of each channel there were, and how many of all made no sense.
    counts: HashMap<u16, u64>,
    unreadable: u64,
    ended: bool,
    /// What is given for values that are stale, and whether any was so far.
    stale: RawValue,
    seen_stale: bool,
    /// Whether its poses are in the world of older versions, whether there were any, and whether that was said.
    is_y_up: bool,
    seen_y_up: bool,
    said_y_up: bool,
    account: Account,
}

somatic_skin::debug_by_name!(Reader);

impl Reader {
    /// Opens the recording at `path`.
    ///
    /// # Errors
    /// The file cannot be read, is not an MCAP, or holds no frames of touch.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let name = path.display().to_string();
        let file = File::open(path).map_err(|e| Error::io(path, &e))?;
        Self::from_file(&name, file).map_err(|e| e.at(path))
    }

    fn from_file(name: &str, file: File) -> Result<Self, Refusal> {
        let (mut reader, head) = Self::begin(name, file, "frame")?;
        if reader.chunks.summary.trust != Trust::Checked {
            // The records before the chunks have no checksum, and the first chunk repeats them.
            reader.left = reader.chunks.next(&mut reader.chunk, &mut reader.account)?.unwrap_or_default();
            reader.learn_chunk();
        }
        if let Some(id) = head.frames_channel.filter(|_| reader.channels.values().all(|known| known.topic != FRAMES)) {
            reader.channels.insert(id, Channel::of_frames());
        }
        let frames = reader.channels.values().find(|known| known.topic == FRAMES);
        let (taxels, world) = match frames {
            Some(Channel { taxels: Some(taxels), world, .. }) => (Some(taxels.clone()), world.clone()),
            _ => (head.taxels, head.world),
        };
        if let Some(world) = world.as_ref().filter(|world| *world != Z_UP) {
            let what = format!("its poses are in a world that this version does not know, `{world}`; update somatic");
            return Err(Refusal::Wrong(what));
        }
        reader.is_y_up = world.is_none();
        reader.taxels = taxels.ok_or_else(|| {
            Refusal::Wrong(
                "it holds no frames of touch, which `somatic run --sink mcap:FILE` and `somatic convert` write; a ROS 2 bag is \
                 named ros2-mcap:PATH"
                    .to_owned(),
            )
        })?;
        Ok(reader)
    }

    /// Opens the MCAP of other programs at `path`, whose messages [`Reader::next_message`] gives.
    ///
    /// Chunks without a checksum are read, too: recorders of ROS 2 leave it out for speed.
    ///
    /// # Errors
    /// The file cannot be read, or is not an MCAP.
    pub(super) fn open_any(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|e| Error::io(path, &e))?;
        let (mut reader, _) = Self::begin(&path.display().to_string(), file, "message").map_err(|e| e.at(path))?;
        reader.chunks.takes_unchecked = true;
        Ok(reader)
    }

    /// Reads the summary, and what comes before the first chunk. `thing` is what is read.
    fn begin(name: &str, file: File, thing: &'static str) -> Result<(Self, Head), Refusal> {
        let mut records = Records::from_file(file)?.map_err(|first| Refusal::Wrong(not_mcap(&first)))?;
        let mut summary = Summary::read(&mut records)?;
        let mut head = Head::read(&mut records, &summary)?;
        records.go_to(8)?;
        // The first chunk that uses a channel describes it; if that is damaged, the others still make sense.
        let (channels, schemas) = (std::mem::take(&mut summary.channels), std::mem::take(&mut summary.schemas));
        let listed = summary.attached.take();
        let counted = summary.statistics.as_ref().map_or(0, |statistics| statistics.attachments as usize);
        let lacks_attached = head.is_damaged || head.attached.len() < counted;
        let reader = Self {
            account: Account::new(name, thing, &summary),
            name: name.to_owned(),
            taxels: Vec::new(),
            may_lack_attached: listed.is_none() && lacks_attached,
            attached: listed.unwrap_or_else(|| std::mem::take(&mut head.attached)),
            has_summary: !channels.is_empty(),
            channels,
            schemas,
            chunks: Chunks::new(records, summary),
            chunk: Vec::new(),
            left: 0..0,
            counts: HashMap::new(),
            unreadable: 0,
            ended: false,
            stale: RawValue::MISSING,
            seen_stale: false,
            is_y_up: false,
            seen_y_up: false,
            said_y_up: false,
        };
        Ok((reader, head))
    }

    /// Takes the channels and schemas of the chunk, before its messages are read.
    fn learn_chunk(&mut self) {
        let mut records = Parts(&self.chunk[self.left.clone()]);
        while let Some((kind, body)) = records.record() {
            match kind {
                op::CHANNEL => self.channels.extend(channel(&mut Parts(body))),
                op::SCHEMA => self.schemas.extend(schema(&mut Parts(body))),
                _ => {}
            }
        }
    }

    /// The taxel ids of a frame's values, in their order.
    #[must_use]
    pub fn taxels(&self) -> &[u32] {
        &self.taxels
    }

    /// The files beside the frames.
    #[must_use]
    pub fn attached(&self) -> &[Attached] {
        &self.attached
    }

    /// The first of [`Reader::attached`] that is `wanted`, and its bytes. `None` where there is none.
    ///
    /// # Errors
    /// It cannot be read, or is damaged; or it is not there, and something attached is too damaged to tell what it is.
    pub fn find_attached(&mut self, wanted: impl Fn(&Attached) -> bool) -> Result<Option<(Attached, Vec<u8>)>> {
        match self.attached.iter().find(|attached| wanted(attached)).cloned() {
            Some(found) => self.bytes_of(&found).map(|bytes| Some((found, bytes))),
            None if self.may_lack_attached => Err(Error::failed(
                "its beginning is damaged, where files are attached; name these with --body and --calibration",
            )
            .at(&self.name)),
            None => Ok(None),
        }
    }

    /// The bytes of one of [`Reader::attached`].
    ///
    /// # Errors
    /// They cannot be read, or are damaged.
    pub fn bytes_of(&mut self, attached: &Attached) -> Result<Vec<u8>> {
        let records = &mut self.chunks.records;
        let back = records.at;
        let mut body = Vec::new();
        let record = Record { kind: op::ATTACHMENT, at: attached.at, length: attached.record };
        let read = records.go_to(record.at).and_then(|()| records.body(record, u64::MAX, &mut body));
        read.and_then(|()| records.go_to(back)).map_err(|e| Error::failed(e.to_string()).at(&self.name))?;
        data_of(&body).map(<[u8]>::to_vec).ok_or_else(|| {
            failed!("the attached `{}` is damaged; name the file with --body and --calibration", attached.name)
                .at(&self.name)
        })
    }

    /// Whether the file has its end, which one that was being written when its process was killed has not.
    #[must_use]
    pub fn has_end(&self) -> bool {
        self.chunks.summary.has_end
    }

    /// Passes over what is before `t_s`, as far as the file's summary says where that is.
    pub fn skip_to(&mut self, t_s: f64) {
        self.chunks.from_ns = nanoseconds(t_s);
    }

    /// From now on gives what is stale as [`RawValue::STALE`], for engines that track it
    /// (`Engine::track_stale`); else it is missing.
    pub fn report_stale(&mut self) {
        self.stale = RawValue::STALE;
    }

    /// Whether any value so far is stale.
    #[must_use]
    pub fn has_stale(&self) -> bool {
        self.seen_stale
    }

    /// Whether it is of an older version, whose world had the axes of a body: y up. Its frames' poses are turned to z up; its
    /// percepts are as they were.
    #[must_use]
    pub fn is_y_up(&self) -> bool {
        self.is_y_up
    }

    /// What is to be said of the frames since the last call, a line each.
    pub fn notices(&mut self) -> Vec<String> {
        if self.said_y_up || !self.seen_y_up {
            return Vec::new();
        }
        self.said_y_up = true;
        let what =
            "its poses are of an older version, whose world was y up: they are turned to z up, (x, y, z) to (z, x, y)";
        vec![format!("{}: {what}", self.name)]
    }

    /// How much of the file has been read, in 0..=1.
    #[must_use]
    pub fn progress(&self) -> f64 {
        self.chunks.records.at as f64 / self.chunks.records.length.max(1) as f64
    }

    /// What of the file was not read so far, in a line each; complete once the last frame is.
    #[must_use]
    pub fn losses(&self) -> Vec<String> {
        self.account.losses()
    }

    /// Reads the next frame into `frame`. `false` at the end.
    ///
    /// # Errors
    /// The file cannot be read, or is compressed.
    pub fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        while let Some(message) = self.next_message()? {
            if self.frame_of(&message, frame) == Some(true) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Reads `message` into `frame`. `None` where it is on another topic, `false` where it is damaged.
    pub(super) fn frame_of(&mut self, message: &Message, frame: &mut Frame) -> Option<bool> {
        let is_frame = self.channels.get(&message.channel).map(|channel| channel.topic == FRAMES);
        if is_frame == Some(false) {
            return None;
        }
        let read = is_frame.and_then(|_| FrameMessage::read(self.data(message)));
        let read = read.filter(|it| it.put_into(frame, self.taxels.len(), self.stale).is_some());
        match &read {
            Some(read) => {
                self.seen_stale |= read.has_stale();
                if self.is_y_up && !frame.pose.is_empty() {
                    frame.pose.iter_mut().for_each(|(_, pose)| *pose = turned_up(*pose));
                    self.seen_y_up = true;
                }
                self.saw(frame.t_s);
            }
            None => self.damaged(message.data.len() as u64),
        }
        Some(read.is_some())
    }

    /// Notes that there was a whole frame, or message, at `t_s`.
    pub fn saw(&mut self, t_s: f64) {
        self.account.saw(t_s);
    }

    /// Notes that a message of `bytes` was not to be read.
    pub fn damaged(&mut self, bytes: u64) {
        self.unreadable += 1;
        self.account.damaged(bytes);
    }

    /// The next message, whatever it says.
    pub(super) fn next_message(&mut self) -> Result<Option<Message>> {
        loop {
            if let Some(message) = self.message_in_chunk() {
                return Ok(Some(message));
            }
            let next = match self.ended {
                true => None,
                false => self.chunks.next(&mut self.chunk, &mut self.account).map_err(|e| match e {
                    Refusal::Io(e) => Error::failed(e.to_string()).at(&self.name),
                    Refusal::Wrong(what) => Error::failed(what).at(&self.name),
                })?,
            };
            match next {
                Some(records) => self.left = records,
                None => {
                    self.end();
                    return Ok(None);
                }
            }
        }
    }

    pub(super) fn data(&self, message: &Message) -> &[u8] {
        &self.chunk[message.data.clone()]
    }

    fn message_in_chunk(&mut self) -> Option<Message> {
        while !self.left.is_empty() {
            let mut parts = Parts(&self.chunk[self.left.clone()]);
            let Some((kind, body)) = parts.record() else {
                let bytes = self.left.len() as u64;
                self.left = 0..0;
                self.account.damaged(bytes);
                return None;
            };
            let bytes = body.len() as u64;
            let end = self.left.end - parts.0.len();
            self.left.start = end;
            let mut parts = Parts(body);
            let is_whole = match kind {
                op::CHANNEL => channel(&mut parts).map(|known| self.channels.extend([known])).is_some(),
                op::SCHEMA => schema(&mut parts).map(|known| self.schemas.extend([known])).is_some(),
                op::MESSAGE => {
                    let head = (|| Some((parts.u16()?, parts.u32()?, parts.u64()?, parts.u64()?)))();
                    if let Some((channel, _, log_time, _)) = head {
                        *self.counts.entry(channel).or_default() += 1;
                        return Some(Message { channel, log_time, data: end - parts.0.len()..end });
                    }
                    false
                }
                0x80.. => true,
                _ => false,
            };
            if !is_whole {
                self.account.damaged(bytes);
            }
        }
        None
    }

    /// Says what is to be said when nothing more comes; once.
    fn end(&mut self) {
        if std::mem::replace(&mut self.ended, true) {
            return;
        }
        let summary = &self.chunks.summary;
        let statistics = summary.statistics.as_ref().filter(|_| !self.chunks.has_skipped);
        let is_of_frames = self.account.thing() == "frame";
        let counts = statistics.map(|statistics| {
            let is_frame = |id: &u16| self.channels.get(id).is_some_and(|channel| channel.topic == FRAMES);
            let sum = |counts: &HashMap<u16, u64>| {
                let counted = counts.iter().filter(|(id, _)| !is_of_frames || is_frame(id));
                counted.map(|(_, count)| *count).fold(0, u64::saturating_add)
            };
            [sum(&statistics.messages), sum(&self.counts).saturating_sub(self.unreadable)]
        });
        let strange = if summary.statistics.is_none() { self.chunks.strange } else { 0 };
        self.account.end(counts, strange);
    }
}

/// `pose`, which is in the axes of a body, in the world.
fn turned_up(Pose { translation, rotation }: Pose) -> Pose {
    Pose { translation: WORLD_FROM_BODY.transform_point3(translation), rotation: WORLD_FROM_BODY_ROTATION * rotation }
}

impl Refusal {
    fn at(self, path: &Path) -> Error {
        match self {
            Self::Io(e) => Error::io(path, &e),
            Self::Wrong(what) => Error::failed(what).at(path.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use glam::{DQuat, DVec3};
    use mcap::records::MessageHeader;

    use super::super::{METADATA, TAXEL_IDS, WORLD, frames, schemas};
    use super::*;

    /// A recording of two frames in which a link is posed, whose metadata say this world.
    fn recording(world: Option<&str>) -> Vec<u8> {
        let mut metadata = BTreeMap::from([(TAXEL_IDS.to_owned(), "4".to_owned())]);
        metadata.extend(world.map(|world| (WORLD.to_owned(), world.to_owned())));
        let options = mcap::WriteOptions::new().compression(None);
        let mut writer = options.create(std::io::Cursor::new(Vec::new())).unwrap();
        writer
            .write_metadata(&mcap::records::Metadata { name: METADATA.to_owned(), metadata: metadata.clone() })
            .unwrap();
        let schema = writer.add_schema("somatic.Frame", "protobuf", &schemas::somatic()).unwrap();
        let channel_id = writer.add_channel(schema, FRAMES, "protobuf", &metadata).unwrap();
        for index in 0..2 {
            let pose = Pose { translation: DVec3::new(0.1, 0.2, 0.3), rotation: DQuat::IDENTITY };
            let mut frame = Frame::missing(f64::from(index), 1);
            frame.pose.push(("hand".to_owned(), pose));
            let mut message = Vec::new();
            frames::encode(&frame, &mut message);
            let header = MessageHeader { channel_id, sequence: index, log_time: 0, publish_time: 0 };
            writer.write_to_known_channel(&header, &message).unwrap();
        }
        writer.finish().unwrap();
        writer.into_inner().into_inner()
    }

    #[test]
    fn poses_of_an_older_recording_are_turned_and_that_is_reported_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("old.mcap");
        let read = |world: Option<&str>| {
            std::fs::write(&path, recording(world)).unwrap();
            let mut reader = Reader::open(&path)?;
            let (mut frame, mut said, mut poses) = (Frame::default(), Vec::new(), Vec::new());
            while reader.next_frame(&mut frame)? {
                said.extend(reader.notices());
                poses.push(frame.pose[0].1);
            }
            assert_eq!((poses.len(), poses[0]), (2, poses[1]));
            Ok::<_, Error>((poses[0], said))
        };
        let (old, said) = read(None).unwrap();
        assert_eq!(old.translation, DVec3::new(0.3, 0.1, 0.2));
        assert_eq!(old.rotation * DVec3::Y, DVec3::Z);
        assert!(said.len() == 1 && said[0].ends_with("they are turned to z up, (x, y, z) to (z, x, y)"), "{said:?}");
        let (new, said) = read(Some(Z_UP)).unwrap();
        assert_eq!((new.translation, said.len()), (DVec3::new(0.1, 0.2, 0.3), 0));
        let why = read(Some("z down")).unwrap_err().to_string();
        assert!(why.contains("old.mcap: its poses are in a world that this version does not know, `z down`"), "{why}");
    }
}
