//! A recording being read: what is whole in the file, in its order; what is not is counted and told.

use std::collections::HashMap;
use std::fs::File;
use std::io;
use std::path::Path;

use super::account::Account;
use super::entries::{Attached, Channel, attached, channel, data_of, preface, schema};
use super::frames::FrameMessage;
use super::records::{MAX_RECORD_BYTES, Next, Parts, Record, Records, op};
use super::{FRAMES, nanoseconds, unpack};
use crate::error::{Error, Result, failed};
use crate::signal::{Frame, RawValue};

/// Bytes of an attachment's record that hold its name and kind; names are not longer.
const ATTACHMENT_HEAD: u64 = 4096;

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
    records: Records<File>,
    taxels: Vec<u32>,
    attached: Vec<Attached>,
    pub(super) channels: HashMap<u16, Channel>,
    /// The names of schemas.
    pub(super) schemas: HashMap<u16, String>,
    /// Whether the file's summary tells its channels.
    pub(super) has_summary: bool,
    /// Whether chunks without a checksum are read.
    takes_unchecked: bool,
    chunk: Vec<u8>,
    /// What of the chunk is still to be read.
    left: std::ops::Range<usize>,
    /// Chunks that end before this are passed over, ns.
    from: u64,
    has_end: bool,
    ended: bool,
    /// What is given for values that are stale, and whether any was so far.
    stale: RawValue,
    seen_stale: bool,
    account: Account,
}

impl Reader {
    /// Opens the recording at `path`.
    ///
    /// # Errors
    /// The file cannot be read, is no MCAP, or holds no frames of touch.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let name = path.display().to_string();
        let file = File::open(path).map_err(|e| Error::io(path, &e))?;
        Self::of(&name, file).map_err(|e| e.at(path))
    }

    fn of(name: &str, file: File) -> Result<Self, Opening> {
        let (mut reader, taxels) = Self::begin(name, file, "frame")?;
        reader.taxels = taxels.ok_or_else(|| {
            Opening::Wrong(
                "it holds no frames of touch, which `somatic run --sink mcap:FILE` and `somatic convert` write; a bag of ROS 2 is \
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
    /// The file cannot be read, or is no MCAP.
    pub(super) fn open_any(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|e| Error::io(path, &e))?;
        let (reader, _) = Self::begin(&path.display().to_string(), file, "message").map_err(|e| e.at(path))?;
        Ok(Self { takes_unchecked: true, ..reader })
    }

    /// Reads what comes before the first chunk; gives the taxels, too, if they are told. `thing` is what is read.
    fn begin(name: &str, file: File, thing: &'static str) -> Result<(Self, Option<Vec<u32>>), Opening> {
        let Some(mut records) = Records::of(file)? else {
            return Err(Opening::Wrong("this is not an MCAP file: its first bytes differ".to_owned()));
        };
        let has_end = records.has_end()?;
        let mut reader = Self {
            name: name.to_owned(),
            records,
            taxels: Vec::new(),
            attached: Vec::new(),
            channels: HashMap::new(),
            schemas: HashMap::new(),
            has_summary: false,
            takes_unchecked: false,
            chunk: Vec::new(),
            left: 0..0,
            from: 0,
            has_end,
            ended: false,
            stale: RawValue::MISSING,
            seen_stale: false,
            account: Account::new(name, thing),
        };
        // Each channel is told in the first chunk that has it; should that be damaged, others still make sense.
        for (kind, body) in reader.records.in_summary(&[op::CHANNEL, op::SCHEMA])? {
            reader.has_summary |= kind == op::CHANNEL;
            reader.learn(kind, &body);
        }
        let taxels = reader.read_head()?;
        Ok((reader, taxels))
    }

    /// Takes a channel, or the name of a schema.
    fn learn(&mut self, kind: u8, body: &[u8]) {
        match kind {
            op::CHANNEL => self.channels.extend(channel(&mut Parts(body))),
            op::SCHEMA => self.schemas.extend(schema(&mut Parts(body))),
            _ => {}
        }
    }

    fn read_head(&mut self) -> Result<Option<Vec<u32>>, Opening> {
        let mut taxels = None;
        let mut body = Vec::new();
        loop {
            let start = self.records.at;
            let Next::Record(record) = self.records.next()? else {
                self.records.go_to(start)?;
                return Ok(taxels);
            };
            match record.kind {
                op::METADATA => {
                    self.records.body(record, u64::MAX, &mut body)?;
                    if let Some(preface) = preface(&body).filter(|_| taxels.is_none()) {
                        let frames = Channel { schema: 0, topic: FRAMES.to_owned(), encoding: "protobuf".to_owned() };
                        self.channels.extend(preface.frames.map(|id| (id, frames)));
                        taxels = Some(preface.taxels);
                    }
                }
                op::CHANNEL | op::SCHEMA => {
                    self.records.body(record, MAX_RECORD_BYTES, &mut body)?;
                    self.learn(record.kind, &body);
                }
                op::ATTACHMENT => {
                    self.records.body(record, ATTACHMENT_HEAD, &mut body)?;
                    self.attached.extend(attached(&body, record));
                }
                op::CHUNK | op::MESSAGE | op::DATA_END | op::FOOTER => {
                    self.records.go_to(start)?;
                    return Ok(taxels);
                }
                _ => self.records.skip(record.length)?,
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

    /// The bytes of one of [`Reader::attached`].
    ///
    /// # Errors
    /// They cannot be read, or are damaged.
    pub fn bytes_of(&mut self, attached: &Attached) -> Result<Vec<u8>> {
        let back = self.records.at;
        let mut body = Vec::new();
        let record = Record { kind: op::ATTACHMENT, at: attached.at, length: attached.record };
        let read = self.records.go_to(record.at).and_then(|()| self.records.body(record, u64::MAX, &mut body));
        read.and_then(|()| self.records.go_to(back)).map_err(|e| Error::failed(e.to_string()).at(&self.name))?;
        data_of(&body).map(<[u8]>::to_vec).ok_or_else(|| {
            failed!("the attached `{}` is damaged; name the file with --body and --calibration", attached.name)
                .at(&self.name)
        })
    }

    /// Whether the file has its end, which one that was being written when its process was killed has not.
    #[must_use]
    pub fn has_end(&self) -> bool {
        self.has_end
    }

    /// Passes over what is before `t_s` as far as that can be done without reading it.
    pub fn skip_to(&mut self, t_s: f64) {
        self.from = nanoseconds(t_s);
    }

    /// From now on gives what is stale as [`RawValue::STALE`], for engines that track it
    /// ([`crate::Engine::track_stale`]); else it is missing.
    pub fn report_stale(&mut self) {
        self.stale = RawValue::STALE;
    }

    /// Whether any value so far is stale.
    #[must_use]
    pub fn has_stale(&self) -> bool {
        self.seen_stale
    }

    /// How much of the file has been read, in 0..=1.
    #[must_use]
    pub fn progress(&self) -> f64 {
        self.records.at as f64 / self.records.length.max(1) as f64
    }

    /// What of the file was not read, in a line each; complete once the last frame is.
    #[must_use]
    pub fn losses(&self) -> Vec<String> {
        self.account.losses().to_vec()
    }

    /// Reads the next frame into `frame`. `false` at the end.
    ///
    /// # Errors
    /// The file cannot be read, or is compressed.
    pub fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        loop {
            let Some(message) = self.next_message()? else { return Ok(false) };
            match self.channels.get(&message.channel) {
                Some(channel) if channel.topic == FRAMES => {}
                Some(_) => continue,
                None => {
                    self.damaged(message.data.len() as u64);
                    continue;
                }
            }
            let data = &self.chunk[message.data.clone()];
            let read = FrameMessage::read(data);
            if let Some(message) = read.filter(|it| it.put_into(frame, self.taxels.len(), self.stale).is_some()) {
                self.seen_stale |= message.has_stale();
                self.saw(frame.t_s);
                return Ok(true);
            }
            self.damaged(message.data.len() as u64);
        }
    }

    /// Notes that there was a whole frame, or message, at `t_s`.
    pub(super) fn saw(&mut self, t_s: f64) {
        self.account.saw(t_s);
    }

    /// The next message, whatever it says.
    pub(super) fn next_message(&mut self) -> Result<Option<Message>> {
        loop {
            if let Some(message) = self.message_in_chunk() {
                return Ok(Some(message));
            }
            if self.ended || !self.next_chunk()? {
                self.end();
                return Ok(None);
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
                self.damaged(bytes);
                return None;
            };
            let end = self.left.end - parts.0.len();
            self.left.start = end;
            let mut parts = Parts(body);
            match kind {
                op::CHANNEL => self.channels.extend(channel(&mut parts)),
                op::SCHEMA => self.schemas.extend(schema(&mut parts)),
                op::MESSAGE => {
                    let head = (|| Some((parts.u16()?, parts.u32()?, parts.u64()?, parts.u64()?)))();
                    if let Some((channel, _, log_time, _)) = head {
                        return Some(Message { channel, log_time, data: end - parts.0.len()..end });
                    }
                }
                _ => {}
            }
        }
        None
    }

    /// Reads the next chunk that is whole, or a message outside of any. `false` at the end.
    fn next_chunk(&mut self) -> Result<bool> {
        self.look_for_chunk().map_err(|e| match e {
            Opening::Io(e) => Error::failed(e.to_string()).at(&self.name),
            Opening::Wrong(what) => Error::failed(what).at(&self.name),
        })
    }

    fn look_for_chunk(&mut self) -> Result<bool, Opening> {
        loop {
            let start = self.records.at;
            let record = match self.records.next()? {
                Next::Record(record) => record,
                Next::Cut if !self.has_end => {
                    let bytes = self.records.length - start;
                    self.account.tell_cut(bytes);
                    return Ok(false);
                }
                Next::Cut | Next::Damaged => {
                    let found = self.records.resume_after(start)?;
                    let until = if found { self.records.at } else { self.records.length };
                    self.damaged(until - start);
                    if !found {
                        return Ok(false);
                    }
                    continue;
                }
            };
            match record.kind {
                op::CHUNK => {
                    if self.read_chunk(record)? {
                        return Ok(true);
                    }
                }
                op::CHANNEL | op::SCHEMA | op::MESSAGE => {
                    // Without a chunk around them, as other programs may write.
                    self.records.go_to(start)?;
                    let whole = Record { at: start, length: record.length + (record.at - start), ..record };
                    let mut chunk = std::mem::take(&mut self.chunk);
                    self.records.body(whole, u64::MAX, &mut chunk)?;
                    self.records.at = whole.at + whole.length;
                    self.left = 0..chunk.len();
                    self.chunk = chunk;
                    return Ok(true);
                }
                op::DATA_END | op::FOOTER => return Ok(false),
                _ => self.records.skip(record.length)?,
            }
        }
    }

    /// Reads the chunk whose record this is. `false` where it is passed over.
    fn read_chunk(&mut self, record: Record) -> Result<bool, Opening> {
        let mut chunk = std::mem::take(&mut self.chunk);
        // Two times first: a chunk before the time that is wanted is not read.
        if self.from > 0 && record.length >= 16 {
            let times = Record { length: 16, ..record };
            self.records.body(times, 16, &mut chunk)?;
            let mut parts = Parts(&chunk);
            let (_, end) = (parts.u64(), parts.u64());
            if end.is_some_and(|end| end < self.from) {
                self.chunk = chunk;
                self.records.skip(record.length - 16)?;
                return Ok(false);
            }
            let after = self.records.at;
            self.records.go_to(record.at)?;
            self.records.at = after;
        }
        let read = self.records.body(record, u64::MAX, &mut chunk);
        self.chunk = chunk;
        read?;
        let mut parts = Parts(&self.chunk);
        let head = (|| {
            let (_, _, size) = (parts.u64()?, parts.u64()?, parts.u64()?);
            Some((size, parts.u32()?, parts.text()?, parts.u64()?))
        })();
        let Some((size, crc, compression, _)) = head.filter(|(.., length)| *length == parts.0.len() as u64) else {
            self.damaged(record.length);
            return Ok(false);
        };
        if !unpack::KNOWN.contains(&compression) {
            return Err(Opening::Wrong(format!(
                "its chunks are compressed by `{}`, which is not read here; write it anew: mcap compress --compression zstd IN -o OUT",
                compression.chars().take(10).collect::<String>()
            )));
        }
        let packed = parts.0;
        let unpacked = (!compression.is_empty()).then(|| unpack::unpacked(compression, packed, size));
        let records = match &unpacked {
            None => (packed.len() as u64 == size).then_some(packed),
            Some(unpacked) => unpacked.as_deref(),
        };
        // The format lets a checksum be 0 for none; then nothing could be told from damage, and our own have one.
        let is_unchecked = crc == 0 && self.takes_unchecked;
        if records.is_none_or(|records| !is_unchecked && crc32fast::hash(records) != crc) {
            self.damaged(record.length);
            return Ok(false);
        }
        if let Some(unpacked) = unpacked.flatten() {
            self.chunk = unpacked;
        }
        self.left = self.chunk.len() - size as usize..self.chunk.len();
        Ok(true)
    }

    /// Notes that `bytes` were not read.
    pub(super) fn damaged(&mut self, bytes: u64) {
        self.account.damaged(bytes);
    }

    /// Says what is to be said when nothing more comes; once.
    fn end(&mut self) {
        if !std::mem::replace(&mut self.ended, true) {
            self.account.end();
        }
    }
}

/// Why a file is not read.
enum Opening {
    Io(io::Error),
    Wrong(String),
}

impl Opening {
    fn at(self, path: &Path) -> Error {
        match self {
            Self::Io(e) => Error::io(path, &e),
            Self::Wrong(what) => Error::failed(what).at(path.display()),
        }
    }
}

impl From<io::Error> for Opening {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}
