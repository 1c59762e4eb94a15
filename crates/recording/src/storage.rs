//! Where the messages of a bag come from: a file of MCAP, or one of SQLite.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use super::entries::Schema;
use super::reader::{Message, Reader};
#[cfg(feature = "sqlite")]
use super::sqlite::SqliteFile;
use super::stored::{SQLITE, StoredMessage, StoredTopic, ZSTD, whole};
use super::unpack::unpacked_message;
use crate::error::{Error, Result};

/// A file of a bag, being read.
pub(super) struct Storage {
    kind: Kind,
    /// The last message without its compression, where it has one of its own.
    unpacked: Option<Vec<u8>>,
}

enum Kind {
    /// With the last message.
    Mcap(Box<Reader>, Option<Message>),
    #[cfg(feature = "sqlite")]
    Sqlite(Box<SqliteFile>),
}

impl Storage {
    /// Opens the file at `path` by its first bytes.
    ///
    /// # Errors
    /// It cannot be read, or is neither MCAP nor SQLite, or is damaged as a whole.
    pub(super) fn open(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|e| Error::io(path, &e))?;
        let mut first = Vec::new();
        // What cannot be read says so below.
        let is_read = file.take(SQLITE.len() as u64).read_to_end(&mut first).is_ok();
        let kind = if is_read && first == SQLITE {
            of_sqlite(path)?
        } else {
            Kind::Mcap(Box::new(Reader::open_any(path)?), None)
        };
        Ok(Self { kind, unpacked: None })
    }

    /// All topics of the file.
    ///
    /// # Errors
    /// It cannot be read, or nothing of it is whole.
    pub(super) fn topics(&mut self) -> Result<Vec<StoredTopic>> {
        match &mut self.kind {
            Kind::Mcap(reader, _) => {
                if !reader.has_summary {
                    // Channels are told where their first messages are.
                    while reader.next_message()?.is_some() {}
                }
                if reader.channels.is_empty() && !reader.has_end() {
                    return Err(Error::failed("it is cut off before its first whole chunk; nothing of it can be read"));
                }
                Ok(self.known_topics())
            }
            #[cfg(feature = "sqlite")]
            Kind::Sqlite(_) => Ok(self.known_topics()),
        }
    }

    /// The topics that are known so far: all, once the last message is read.
    pub(super) fn known_topics(&self) -> Vec<StoredTopic> {
        match &self.kind {
            Kind::Mcap(reader, _) => {
                let topic = |channel: &super::entries::Channel| StoredTopic {
                    name: channel.topic.clone(),
                    kind: whole(reader.schemas.get(&channel.schema).map_or("", |schema| &schema.name)),
                    encoding: channel.encoding.clone(),
                };
                reader.channels.values().map(topic).collect()
            }
            #[cfg(feature = "sqlite")]
            Kind::Sqlite(file) => file.topics().values().cloned().collect(),
        }
    }

    /// The definition of each type of messages that is known so far, as `ros2msg` has it.
    pub(super) fn definitions(&self) -> BTreeMap<String, String> {
        match &self.kind {
            Kind::Mcap(reader, _) => {
                let own = |schema: &Schema| Some((whole(&schema.name), schema.definition.clone()?));
                reader.schemas.values().filter_map(own).collect()
            }
            #[cfg(feature = "sqlite")]
            Kind::Sqlite(file) => file.definitions(),
        }
    }

    /// From now on only messages of `topics` are needed; those of others may come, too.
    pub(super) fn only(&mut self, topics: &[String]) {
        match &mut self.kind {
            // Its chunks hold all of them.
            Kind::Mcap(..) => {
                let _ = topics;
            }
            #[cfg(feature = "sqlite")]
            Kind::Sqlite(file) => file.only(topics),
        }
    }

    /// Goes on to the next message. `None` at the end.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn next_message(&mut self) -> Result<Option<StoredMessage>> {
        self.unpacked = None;
        let message = match &mut self.kind {
            Kind::Mcap(reader, last) => {
                *last = reader.next_message()?;
                last.as_ref()
                    .map(|message| StoredMessage { topic: i64::from(message.channel), log_ns: message.log_time })
            }
            #[cfg(feature = "sqlite")]
            Kind::Sqlite(file) => file.next_message()?,
        };
        if message.is_some() && self.data().starts_with(ZSTD) {
            self.unpacked = unpacked_message(self.data());
        }
        Ok(message)
    }

    /// The bytes of the last message; those of one that cannot be unpacked are as they are stored.
    pub(super) fn data(&self) -> &[u8] {
        match (&self.unpacked, &self.kind) {
            (Some(unpacked), _) => unpacked,
            (None, Kind::Mcap(reader, Some(message))) => reader.data(message),
            (None, Kind::Mcap(_, None)) => &[],
            #[cfg(feature = "sqlite")]
            (None, Kind::Sqlite(file)) => file.data(),
        }
    }

    /// The name of the topic with this number. `None` where the file has none.
    pub(super) fn topic_name(&self, topic: i64) -> Option<&str> {
        match &self.kind {
            Kind::Mcap(reader, _) => {
                let channel = u16::try_from(topic).ok().and_then(|id| reader.channels.get(&id))?;
                Some(&channel.topic)
            }
            #[cfg(feature = "sqlite")]
            Kind::Sqlite(file) => Some(&file.topics().get(&topic)?.name),
        }
    }

    /// The topic with this number. `None` where the file has none.
    pub(super) fn topic(&self, topic: i64) -> Option<StoredTopic> {
        match &self.kind {
            Kind::Mcap(reader, _) => {
                let channel = u16::try_from(topic).ok().and_then(|id| reader.channels.get(&id))?;
                let kind = whole(reader.schemas.get(&channel.schema).map_or("", |schema| &schema.name));
                Some(StoredTopic { name: channel.topic.clone(), kind, encoding: channel.encoding.clone() })
            }
            #[cfg(feature = "sqlite")]
            Kind::Sqlite(file) => file.topics().get(&topic).cloned(),
        }
    }

    /// Notes that the last message was whole, and of the time `t_s`.
    pub(super) fn saw(&mut self, t_s: f64) {
        match &mut self.kind {
            Kind::Mcap(reader, _) => reader.saw(t_s),
            #[cfg(feature = "sqlite")]
            Kind::Sqlite(file) => file.account.saw(t_s),
        }
    }

    /// Notes that the last message, of `bytes`, was not to be read.
    pub(super) fn damaged(&mut self, bytes: u64) {
        match &mut self.kind {
            Kind::Mcap(reader, _) => reader.damaged(bytes),
            #[cfg(feature = "sqlite")]
            Kind::Sqlite(file) => file.account.damaged(bytes),
        }
    }

    /// How much of the file has been read, in 0..=1.
    pub(super) fn progress(&self) -> f64 {
        match &self.kind {
            Kind::Mcap(reader, _) => reader.progress(),
            #[cfg(feature = "sqlite")]
            Kind::Sqlite(file) => file.progress(),
        }
    }

    /// What of the file was not read so far, in a line each.
    pub(super) fn losses(&self) -> Vec<String> {
        match &self.kind {
            Kind::Mcap(reader, _) => reader.losses(),
            #[cfg(feature = "sqlite")]
            Kind::Sqlite(file) => file.losses(),
        }
    }
}

#[cfg(feature = "sqlite")]
fn of_sqlite(path: &Path) -> Result<Kind> {
    SqliteFile::open(path).map(|file| Kind::Sqlite(Box::new(file))).map_err(|e| e.at(path.display()))
}

#[cfg(not(feature = "sqlite"))]
fn of_sqlite(path: &Path) -> Result<Kind> {
    let what = "its storage is sqlite3, and this build reads MCAP alone; build with feature `sqlite`";
    Err(Error::failed(what).at(path.display()))
}
