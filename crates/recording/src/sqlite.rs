//! A file of a bag in SQLite, `.db3`, as rosbag2 writes it: schemas 1 to 4, which have the same columns of what is read here.
//!
//! This is the only user of the crate `rusqlite`. The file is opened as one that nobody changes, so that SQLite writes nothing
//! beside it; what is not yet in the file itself is therefore refused.

use std::collections::{BTreeMap, VecDeque};
use std::fmt::Write as _;
use std::path::Path;

use rusqlite::types::ValueRef;
use rusqlite::{Connection, ErrorCode, OpenFlags, OptionalExtension as _};

use super::account::Account;
use super::stored::{StoredMessage, StoredTopic, whole};
use crate::error::{Error, Result, failed};
use crate::limits::MAX_CHUNK_BYTES;

/// How many messages are put in order at once, and how many of these are held with their bytes.
const ORDERED: usize = 16_384;
const HELD: usize = 1024;
/// Bytes from which on no further messages are held.
const HELD_BYTES: usize = 4 << 20;

/// A message as it lies in the table.
struct Row {
    topic: i64,
    timestamp_ns: i64,
    /// `None` where these are too many, or none.
    data: Option<Vec<u8>>,
}

/// Reads the messages of a file in the order of their times.
pub(super) struct SqliteFile {
    name: String,
    database: Connection,
    topics: BTreeMap<i64, StoredTopic>,
    /// The numbers of topics that are passed over, between commas.
    unwanted: String,
    /// Times and rows of the next messages, and the last of those.
    order: VecDeque<(i64, i64)>,
    last: (i64, i64),
    held: VecDeque<Row>,
    current: Vec<u8>,
    /// Messages so far, and about how many there are.
    read: u64,
    total: u64,
    pub(super) account: Account,
    /// Why nothing more is read, once that is so.
    stopped: Option<String>,
    /// Messages whose time is no number.
    without_time: u64,
    has_ended: bool,
}

impl SqliteFile {
    /// Opens the file at `path`.
    ///
    /// # Errors
    /// It is damaged, is not a bag, or has a journal beside it.
    pub(super) fn open(path: &Path) -> Result<Self> {
        for (ending, advice) in
            [("-wal", "pragma wal_checkpoint(truncate)"), ("-journal", "select count(*) from messages")]
        {
            let mut beside = path.as_os_str().to_owned();
            beside.push(ending);
            if std::fs::metadata(&beside).is_ok_and(|there| there.len() > 0) {
                let (file, beside) = (path.display(), Path::new(&beside).display());
                return Err(failed!(
                    "{beside} has what is not in the file yet; stop the recorder, then put it in: sqlite3 {file} '{advice}'"
                ));
            }
        }
        let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI | OpenFlags::SQLITE_OPEN_NO_MUTEX;
        let database = Connection::open_with_flags(uri(path)?, flags).map_err(|e| refused(path, &e))?;
        let (topics, total) = opened(&database).map_err(|e| refused(path, &e))?;
        let Some(topics) = topics else {
            return Err(Error::failed("it is not a bag: it lacks the tables `topics` and `messages` of rosbag2"));
        };
        let name = path.display().to_string();
        Ok(Self {
            account: Account::without_summary(&name, "message"),
            name,
            database,
            topics,
            unwanted: String::new(),
            order: VecDeque::new(),
            last: (i64::MIN, i64::MIN),
            held: VecDeque::new(),
            current: Vec::new(),
            read: 0,
            total,
            stopped: None,
            without_time: 0,
            has_ended: false,
        })
    }

    /// Its topics, by their numbers.
    pub(super) fn topics(&self) -> &BTreeMap<i64, StoredTopic> {
        &self.topics
    }

    /// The definition of each type of messages, which bags since ROS 2 Iron have.
    pub(super) fn definitions(&self) -> BTreeMap<String, String> {
        let read = || -> rusqlite::Result<BTreeMap<String, String>> {
            let mut listed = self.database.prepare(
                "SELECT topic_type, encoded_message_definition FROM message_definitions WHERE encoding = 'ros2msg' \
                 AND length(encoded_message_definition) > 0",
            )?;
            let own = listed.query_map((), |row| Ok((whole(&row.get::<_, String>(0)?), row.get(1)?)))?;
            own.collect()
        };
        // Older ones lack the table.
        read().unwrap_or_default()
    }

    /// Passes over messages of other topics than `wanted`, whose bytes are then not read.
    pub(super) fn only(&mut self, wanted: &[String]) {
        let unwanted = self.topics.iter().filter(|(_, topic)| !wanted.contains(&topic.name));
        self.unwanted = unwanted.map(|(id, _)| id.to_string()).collect::<Vec<_>>().join(",");
    }

    /// Goes on to the next message. `None` at the end, and where the file is damaged so that nothing more can be read.
    pub(super) fn next_message(&mut self) -> Result<Option<StoredMessage>> {
        while !self.has_ended {
            if let Some(row) = self.held.pop_front() {
                self.read += 1;
                // One that has no bytes is no message of any type, and is told where it is read.
                self.current = row.data.unwrap_or_default();
                let log_ns = u64::try_from(row.timestamp_ns).unwrap_or(0);
                return Ok(Some(StoredMessage { topic: row.topic, log_ns }));
            }
            if let Err(e) = self.go_on() {
                self.stopped = Some(words(&e));
                self.has_ended = true;
            }
        }
        self.current.clear();
        Ok(None)
    }

    /// Reads the next rows.
    fn go_on(&mut self) -> rusqlite::Result<()> {
        if self.order.is_empty() {
            if self.stopped.is_some() {
                self.has_ended = true;
                return Ok(());
            }
            // By the index of times that rosbag2 makes, which has the rows, too.
            let mut ordered = self.database.prepare(
                "SELECT timestamp, rowid FROM messages WHERE (timestamp, rowid) > (?1, ?2) AND typeof(timestamp) = 'integer' \
                 ORDER BY timestamp, rowid LIMIT ?3",
            )?;
            let mut rows = ordered.query((self.last.0, self.last.1, ORDERED as i64))?;
            let mut before = self.last;
            while let Some(row) = rows.next()? {
                let next = (row.get(0)?, row.get(1)?);
                if next <= before {
                    // It would go on without end.
                    self.stopped = Some("its index of times is damaged".to_owned());
                    break;
                }
                before = next;
                self.order.push_back(next);
            }
            let Some(last) = self.order.back() else {
                if self.stopped.is_some() {
                    self.has_ended = true;
                    return Ok(());
                }
                // Null comes before all numbers, and other types after them.
                let count = "SELECT count(*) FROM messages WHERE ";
                for other in ["timestamp IS NULL", "timestamp > 9223372036854775807"] {
                    let other: i64 = self.database.query_row(&format!("{count}{other}"), (), |row| row.get(0))?;
                    self.without_time += u64::try_from(other).unwrap_or(0);
                }
                self.has_ended = true;
                return Ok(());
            };
            self.last = *last;
        }
        let unwanted = &self.unwanted;
        let mut one = self.database.prepare(&format!(
            "SELECT topic_id, topic_id IN ({unwanted}), iif(topic_id IN ({unwanted}) OR length(data) > {MAX_CHUNK_BYTES}, \
             NULL, data) FROM messages WHERE rowid = ?1"
        ))?;
        let mut bytes = 0;
        while self.held.len() < HELD
            && bytes < HELD_BYTES
            && let Some((timestamp_ns, id)) = self.order.pop_front()
        {
            let found = one.query_row([id], |row| {
                let data = match row.get_ref(2)? {
                    ValueRef::Blob(data) | ValueRef::Text(data) => Some(data.to_vec()),
                    _ => None,
                };
                Ok((row.get::<_, Option<i64>>(0)?, row.get::<_, Option<bool>>(1)?, data))
            });
            match found.optional()? {
                Some((_, Some(true), _)) => self.read += 1,
                found => {
                    let (topic, data) = found.map_or((None, None), |(topic, _, data)| (topic, data));
                    bytes += data.as_ref().map_or(0, Vec::len);
                    // No topic has the least number, as rosbag2 counts from 1.
                    self.held.push_back(Row { topic: topic.unwrap_or(i64::MIN), timestamp_ns, data });
                }
            }
        }
        Ok(())
    }

    /// The bytes of the last message.
    pub(super) fn data(&self) -> &[u8] {
        &self.current
    }

    /// How much of the file has been read, in 0..=1.
    pub(super) fn progress(&self) -> f64 {
        (self.read as f64 / self.total.max(1) as f64).min(1.0)
    }

    /// What of the file was not read so far, in a line each.
    pub(super) fn losses(&self) -> Vec<String> {
        let name = &self.name;
        let mut losses = self.account.losses();
        losses.extend(
            self.stopped.iter().map(|why| {
                format!("{name}: {} messages are read, the rest is not: {why}; {}", self.read, recovery(name))
            }),
        );
        if self.without_time > 0 {
            losses.push(format!("{name}: {} messages are not read, as their time is no integer", self.without_time));
        }
        losses
    }
}

/// The topics in `database`, if it is a bag, and about how many messages it has.
fn opened(database: &Connection) -> rusqlite::Result<(Option<BTreeMap<i64, StoredTopic>>, u64)> {
    let of_bag = "SELECT count(*) FROM sqlite_schema WHERE type = 'table' AND name IN ('topics', 'messages')";
    if database.query_row(of_bag, (), |row| row.get::<_, i64>(0))? != 2 {
        return Ok((None, 0));
    }
    let mut listed = database.prepare("SELECT id, name, type, serialization_format FROM topics")?;
    let topics = listed.query_map((), |row| {
        let kind: String = row.get(2)?;
        Ok((row.get(0)?, StoredTopic { name: row.get(1)?, kind: whole(&kind), encoding: row.get(3)? }))
    })?;
    let topics = topics.collect::<rusqlite::Result<_>>()?;
    // Rows are numbered from 1: nothing need be counted.
    let total: Option<i64> = database.query_row("SELECT max(rowid) FROM messages", (), |row| row.get(0))?;
    Ok((Some(topics), total.and_then(|total| u64::try_from(total).ok()).unwrap_or(0)))
}

/// The address of the file at `path` for SQLite, as one that nobody changes.
fn uri(path: &Path) -> Result<String> {
    let absolute = std::path::absolute(path).map_err(|e| Error::io(path, &e))?;
    let text = absolute.as_os_str().as_encoded_bytes();
    let mut uri = "file://".to_owned();
    if !text.starts_with(b"/") {
        // `C:\` of Windows.
        uri.push('/');
    }
    for &byte in text {
        match byte {
            b'\\' if cfg!(windows) => uri.push('/'),
            b'/' | b'.' | b'-' | b'_' | b':' => uri.push(char::from(byte)),
            _ if byte.is_ascii_alphanumeric() => uri.push(char::from(byte)),
            _ => write!(uri, "%{byte:02X}").unwrap_or_default(),
        }
    }
    Ok(uri + "?immutable=1")
}

/// What SQLite says, in a line.
fn words(error: &rusqlite::Error) -> String {
    match error.sqlite_error_code() {
        Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase) => "it is damaged".to_owned(),
        _ => error.to_string().split_whitespace().collect::<Vec<_>>().join(" "),
    }
}

/// What people get the rest of `file` with.
fn recovery(file: &str) -> String {
    format!("to get what is whole: sqlite3 {file} .recover | sqlite3 WHOLE.db3")
}

fn refused(path: &Path, error: &rusqlite::Error) -> Error {
    match error.sqlite_error_code() {
        Some(ErrorCode::DatabaseCorrupt | ErrorCode::NotADatabase) => {
            let size = "it is damaged or cut off, and SQLite reads nothing of it";
            failed!("{size}; {}", recovery(&path.display().to_string()))
        }
        _ => failed!("SQLite does not read it: {}", words(error)),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use somatic_testing::{damage, numbers};

    use super::super::bag_reader::{BagReader, WantedTopics};
    use super::super::bag_survey::BagSurvey;
    use super::super::storage::Storage;
    use super::*;

    const STATES: &str = "sensor_msgs/msg/JointState";

    /// The tables of rosbag2's schema `version`.
    fn tables(version: u32) -> String {
        let mut topics =
            "id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL"
                .to_owned();
        let mut others = String::new();
        if version >= 2 {
            topics += ", offered_qos_profiles TEXT NOT NULL DEFAULT ''";
        }
        if version >= 3 {
            others += "CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
                CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);";
            others += &format!("INSERT INTO schema VALUES ({version}, 'humble');");
        }
        if version >= 4 {
            topics += ", type_description_hash TEXT NOT NULL DEFAULT ''";
            others += "CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,
                encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);";
        }
        format!(
            "{others} CREATE TABLE topics({topics}); CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, \
             timestamp INTEGER NOT NULL, data BLOB NOT NULL); CREATE INDEX timestamp_idx ON messages (timestamp ASC);"
        )
    }

    /// Writes a bag of schema `version` with the topics /joints and /camera, and with messages: topic, time and bytes.
    fn write(path: &Path, version: u32, messages: impl IntoIterator<Item = (i64, i64, Vec<u8>)>) -> Connection {
        let database = Connection::open(path).unwrap();
        database.execute_batch(&format!("BEGIN; {}", tables(version))).unwrap();
        for (id, name, kind) in [(1, "/joints", STATES), (2, "/camera", "sensor_msgs/Image")] {
            let add = "INSERT INTO topics(id, name, type, serialization_format) VALUES (?1, ?2, ?3, 'cdr')";
            database.execute(add, (id, name, kind)).unwrap();
        }
        let mut add = database.prepare("INSERT INTO messages(topic_id, timestamp, data) VALUES (?1, ?2, ?3)").unwrap();
        for message in messages {
            add.execute(message).unwrap();
        }
        drop(add);
        database.execute_batch("COMMIT").unwrap();
        database
    }

    /// A message's topic, log time in ns, and bytes.
    type ReadMessage = (String, u64, Vec<u8>);

    /// What is read of `path`: topics, times and bytes; and what is lost.
    fn read(path: &Path, only: &[&str]) -> Result<(Vec<ReadMessage>, Vec<String>)> {
        let mut storage = Storage::open(path)?;
        if !only.is_empty() {
            storage.only(&only.iter().map(|&name| name.to_owned()).collect::<Vec<_>>());
        }
        let mut found = Vec::new();
        while let Some(message) = storage.next_message()? {
            match storage.topic(message.topic) {
                Some(topic) => found.push((topic.name, message.log_ns, storage.data().to_vec())),
                None => storage.damaged(storage.data().len() as u64),
            }
        }
        Ok((found, storage.losses()))
    }

    fn small() -> Vec<(i64, i64, Vec<u8>)> {
        (0..200).map(|at| (1 + at % 2, 1_700_000_000_000_000_000 + (at ^ 1) * 7, vec![0, 1, 0, 0, at as u8])).collect()
    }

    #[test]
    fn every_schema_is_read_in_the_order_of_times() {
        let folder = tempfile::tempdir().unwrap();
        for version in 1..=4 {
            let path = folder.path().join(format!("a {version}?#%41é.db3"));
            drop(write(&path, version, small()));
            let (found, losses) = read(&path, &[]).unwrap();
            assert_eq!((found.len(), losses), (200, Vec::new()), "{version}");
            for (at, (topic, log_ns, data)) in found.iter().enumerate() {
                let written = at ^ 1;
                assert_eq!(topic, ["/joints", "/camera"][written % 2]);
                assert_eq!((*log_ns, data[4]), (1_700_000_000_000_000_000 + at as u64 * 7, written as u8));
            }
            let (joints, _) = read(&path, &["/joints"]).unwrap();
            let expected: Vec<_> = found.into_iter().filter(|(topic, ..)| topic == "/joints").collect();
            assert!(joints == expected, "{version}");
            assert_eq!(Storage::open(&path).unwrap().topics().unwrap()[1].kind, "sensor_msgs/msg/Image");
        }
        // Nothing was written beside them.
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4);
    }

    #[test]
    fn many_messages_of_one_time_and_large_ones_are_read_in_parts() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.db3");
        let count = ORDERED as i64 * 2 + 7;
        drop(write(&path, 3, (0..count).map(|at| (1, at / 40_000, at.to_le_bytes().to_vec()))));
        let (found, losses) = read(&path, &[]).unwrap();
        assert_eq!((found.len() as i64, losses), (count, Vec::new()));
        assert!(found.iter().zip(0_i64..).all(|((_, _, data), at)| data[..] == at.to_le_bytes()));
        let large = folder.path().join("large.db3");
        drop(write(&large, 3, (0..5).map(|at| (1, at, vec![at as u8; HELD_BYTES / 2 + 1]))));
        let mut storage = Storage::open(&large).unwrap();
        while storage.next_message().unwrap().is_some() {
            assert_eq!(storage.data().len(), HELD_BYTES / 2 + 1);
        }
        assert_eq!(storage.progress(), 1.0);
    }

    #[test]
    fn files_of_a_folder_follow_each_other_and_messages_may_be_compressed() {
        let folder = tempfile::tempdir().unwrap();
        let level = ruzstd::encoding::CompressionLevel::Fastest;
        let packed = |at: i64| ruzstd::encoding::compress_to_vec(&[0, 1, 0, 0, at as u8][..], level);
        for (part, name) in [(0, "b_0.db3"), (1, "b_1.db3")] {
            let times = part * 10..part * 10 + 10;
            drop(write(&folder.path().join(name), 4, times.map(|at| (1, at, packed(at)))));
        }
        let metadata = "a:\n  storage_identifier: sqlite3\n  compression_format: zstd\n  compression_mode: MESSAGE\n  \
            relative_file_paths:\n    - b_0.db3\n    - b_1.db3\n";
        for metadata in [Some(metadata), None] {
            if let Some(text) = metadata {
                fs::write(folder.path().join("metadata.yaml"), text).unwrap();
            } else {
                fs::remove_file(folder.path().join("metadata.yaml")).unwrap();
            }
            let wanted = WantedTopics { topics: &[], kinds: &[STATES], merged: None };
            let mut bag = BagReader::open(folder.path(), &wanted).unwrap();
            assert_eq!((bag.topics().to_vec(), bag.kind()), (vec!["/joints".to_owned()], STATES));
            for at in 0..20 {
                let message = bag.next_message().unwrap().unwrap();
                assert_eq!((message.topic, message.log_ns, message.data), (0, at, &[0, 1, 0, 0, at as u8][..]));
            }
            assert!(bag.next_message().unwrap().is_none() && bag.losses().is_empty() && bag.progress() == 1.0);
        }
        let survey = BagSurvey::read(folder.path(), |_| {}).unwrap();
        let told: Vec<_> =
            survey.topics.iter().map(|topic| (topic.name.as_str(), topic.messages, topic.bytes)).collect();
        assert_eq!((survey.files, told), (2, vec![("/camera", 0, 0), ("/joints", 20, 100)]));
        assert_eq!(survey.topics[1].span_ns, Some([0, 19]));
    }

    #[test]
    fn what_is_not_in_the_file_yet_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.db3");
        let database = write(&path, 3, small());
        database.query_row("PRAGMA journal_mode = wal", (), |_| Ok(())).unwrap();
        database.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (1, 9, x'00')", ()).unwrap();
        let why = read(&path, &[]).unwrap_err().to_string();
        assert!(why.contains("a.db3-wal has what is not in the file yet") && why.contains("wal_checkpoint"), "{why}");
        assert_eq!(why.lines().count(), 1);
        database.query_row("PRAGMA wal_checkpoint(truncate)", (), |_| Ok(())).unwrap();
        assert_eq!(read(&path, &[]).unwrap().0.len(), 201);
        drop(database);
        fs::write(folder.path().join("a.db3-journal"), "x").unwrap();
        let why = read(&path, &[]).unwrap_err().to_string();
        assert!(why.contains("a.db3-journal has what is not in the file yet"), "{why}");
    }

    #[test]
    fn damaged_files_and_other_databases_say_so_in_a_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.db3");
        let database = write(&path, 4, (0..400).map(|at| (1, at, vec![at as u8; 500])));
        drop(database);
        let whole = fs::read(&path).unwrap();
        fs::write(&path, &whole[..whole.len() / 2]).unwrap();
        let why = read(&path, &[]).unwrap_err().to_string();
        assert!(why.contains("damaged or cut off") && why.contains("a.db3 .recover | sqlite3"), "{why}");
        // Every page by itself: what is before it is read, and something is said.
        let mut told = 0;
        for page in 1..whole.len() / 4096 {
            let mut bytes = whole.clone();
            bytes[page * 4096..][..4096].fill(0xA5);
            fs::write(&path, bytes).unwrap();
            match read(&path, &[]) {
                Ok((found, losses)) => {
                    assert!(found.len() == 400 || !losses.is_empty(), "page {page}: {} messages", found.len());
                    assert!(losses.iter().all(|loss| loss.lines().count() == 1), "{losses:?}");
                    told += usize::from(losses.iter().any(|loss| loss.contains("the rest is not: it is damaged")));
                }
                Err(e) => assert_eq!(e.to_string().lines().count(), 1, "{e}"),
            }
        }
        assert!(told > 10, "{told}");
        let mut chance = numbers(5);
        for _ in 0..300 {
            let mut bytes = whole.clone();
            damage(&mut bytes, &mut chance);
            fs::write(&path, bytes).unwrap();
            let lines = match read(&path, &[]) {
                Ok((_, losses)) => losses,
                Err(e) => vec![e.to_string()],
            };
            assert!(lines.iter().all(|line| line.lines().count() == 1), "{lines:?}");
        }
        fs::remove_file(&path).unwrap();
        Connection::open(&path).unwrap().execute_batch("CREATE TABLE mine(a)").unwrap();
        let why = read(&path, &[]).unwrap_err().to_string();
        assert!(why.contains("a.db3: it is not a bag: it lacks the tables `topics` and `messages`"), "{why}");
    }

    #[test]
    fn messages_without_topic_time_or_bytes_are_reported() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.db3");
        let database = write(&path, 3, small());
        let odd = "INSERT INTO messages(topic_id, timestamp, data) VALUES (7, 1, x'00'), (1, 'noon', x'00')";
        database.execute(odd, ()).unwrap();
        drop(database);
        for only in [&[][..], &["/joints"]] {
            let (found, losses) = read(&path, only).unwrap();
            assert_eq!(found.len(), if only.is_empty() { 200 } else { 100 });
            assert_eq!(losses.len(), 2, "{losses:?}");
            assert!(
                losses[0].contains("damaged in one place before any message") || losses[0].contains("1 bytes not read")
            );
            assert!(losses[1].contains("1 messages are not read, as their time is no integer"), "{losses:?}");
        }
    }
}
