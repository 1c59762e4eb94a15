//! Topics of a bag of ROS 2 being read: a file, or several one after the other.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::bag_files::bag_files;
use super::storage::Storage;
use crate::error::{Error, Result, failed};

/// The encoding of messages that is read.
const CDR: &str = "cdr";

/// Which topics of a bag are read.
pub struct WantedTopics<'a> {
    /// Their names; without any, it is the only topic of these types, or all of type `merged`.
    pub topics: &'a [String],
    /// The types that their messages may have, such as `sensor_msgs/msg/JointState`.
    pub kinds: &'a [&'a str],
    /// The type whose topics are read together, if there are several; of other types one topic is read.
    pub merged: Option<&'a str>,
}

/// A message as it was recorded.
pub struct BagMessage<'a> {
    /// The place of its topic in [`BagReader::topics`].
    pub topic: usize,
    /// When it came, by the recorder's clock, ns.
    pub log_ns: u64,
    /// The message, in CDR.
    pub data: &'a [u8],
}

/// A topic of a bag, with what its messages are.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DefinedTopic {
    /// Its name.
    pub name: String,
    /// The type of its messages, such as `sensor_msgs/msg/JointState`.
    pub kind: String,
    /// The encoding of its messages: `cdr` in bags of ROS 2.
    pub encoding: String,
    /// The definition of that type and of those it is made of, as schema `ros2msg` has it, where the bag has it.
    pub definition: Option<String>,
}

impl DefinedTopic {
    /// All topics of the bag at `path`, a file in MCAP or SQLite, or a folder of such, by their names.
    ///
    /// # Errors
    /// It cannot be read, or is not a bag.
    pub fn all_of(path: &Path) -> Result<Vec<Self>> {
        let (mut topics, mut definitions) = (BTreeSet::new(), BTreeMap::new());
        for file in bag_files(path)? {
            let mut storage = Storage::open(&file)?;
            for topic in storage.topics().map_err(|e| e.at(file.display()))? {
                topics.insert((topic.name, topic.kind, topic.encoding));
            }
            definitions.extend(storage.definitions());
        }
        let with_definition = |(name, kind, encoding): (String, String, String)| {
            let definition = definitions.get(&kind).cloned();
            Self { name, kind, encoding, definition }
        };
        Ok(topics.into_iter().map(with_definition).collect())
    }
}

/// Reads the messages of topics, in the order of the files.
pub struct BagReader {
    files: Vec<PathBuf>,
    /// Their lengths, bytes.
    lengths: Vec<u64>,
    /// How many files have been opened.
    opened: usize,
    storage: Option<Storage>,
    topics: Vec<String>,
    kind: String,
    losses: Vec<String>,
}

/// By name, the types of a bag's topics, and the encodings of their messages.
type Topics = BTreeMap<String, BTreeSet<(String, String)>>;

impl BagReader {
    /// Opens the bag at `path`, a file in MCAP or SQLite, or a folder of such.
    ///
    /// # Errors
    /// It cannot be read, is not a bag, or has no such topics, or too many; their messages are not in CDR.
    pub fn open(path: &Path, wanted: &WantedTopics<'_>) -> Result<Self> {
        let files = bag_files(path)?;
        let (topics, kind) = choose(&topics_of(&files)?, wanted, path).map_err(|e| e.at(path.display()))?;
        let length = |file: &PathBuf| std::fs::metadata(file).map_or(0, |there| there.len());
        let mut reader = Self {
            lengths: files.iter().map(length).collect(),
            files,
            opened: 0,
            storage: None,
            topics,
            kind,
            losses: Vec::new(),
        };
        reader.open_next()?;
        Ok(reader)
    }

    /// Goes on with the next file, if there is one.
    fn open_next(&mut self) -> Result<()> {
        if let Some(storage) = self.storage.take() {
            self.losses.append(&mut storage.losses());
        }
        if let Some(file) = self.files.get(self.opened) {
            self.opened += 1;
            let mut storage = Storage::open(file)?;
            storage.only(&self.topics);
            self.storage = Some(storage);
        }
        Ok(())
    }

    /// The topics' names.
    pub fn topics(&self) -> &[String] {
        &self.topics
    }

    /// The type of their messages.
    pub fn kind(&self) -> &str {
        &self.kind
    }

    /// The bag's files, in their order.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// The next message. `None` at the end.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn next_message(&mut self) -> Result<Option<BagMessage<'_>>> {
        let (topic, log_ns) = loop {
            let Some(storage) = &mut self.storage else { return Ok(None) };
            let Some(message) = storage.next_message()? else {
                self.open_next()?;
                continue;
            };
            match storage.topic_name(message.topic) {
                Some(name) => {
                    if let Some(topic) = self.topics.iter().position(|topic| topic == name) {
                        break (topic, message.log_ns);
                    }
                }
                None => {
                    let bytes = storage.data().len() as u64;
                    storage.damaged(bytes);
                }
            }
        };
        Ok(self.storage.as_ref().map(|storage| BagMessage { topic, log_ns, data: storage.data() }))
    }

    /// Notes that the last message was whole, and of the time `t_s`.
    pub fn saw(&mut self, t_s: f64) {
        if let Some(storage) = &mut self.storage {
            storage.saw(t_s);
        }
    }

    /// Notes that the last message, of `bytes`, was not to be read.
    pub fn damaged(&mut self, bytes: usize) {
        if let Some(storage) = &mut self.storage {
            storage.damaged(bytes as u64);
        }
    }

    /// How much of the bag has been read, in 0..=1.
    pub fn progress(&self) -> f64 {
        let own = self.storage.as_ref().zip(self.opened.checked_sub(1).and_then(|own| self.lengths.get(own)));
        let own = own.map_or(0.0, |(storage, length)| storage.progress() * *length as f64);
        let done = self.lengths.iter().take(self.opened - usize::from(self.storage.is_some())).sum::<u64>() as f64;
        ((done + own) / self.lengths.iter().sum::<u64>().max(1) as f64).min(1.0)
    }

    /// What of the bag was not read so far, in a line each; complete once the last message is.
    pub fn losses(&self) -> Vec<String> {
        let mut losses = self.losses.clone();
        losses.extend(self.storage.iter().flat_map(Storage::losses));
        losses
    }
}

/// The topics of the bag at `path`, with the types of their messages.
///
/// # Errors
/// It cannot be read, or is not a bag.
pub fn topics_of_bag(path: &Path) -> Result<Vec<(String, String)>> {
    let topics = topics_of(&bag_files(path)?)?;
    let kinds = |(name, all): (String, BTreeSet<(String, String)>)| {
        all.into_iter().map(move |(kind, _)| (name.clone(), kind)).collect::<Vec<_>>()
    };
    Ok(topics.into_iter().flat_map(kinds).collect())
}

/// The topics of all `files`.
fn topics_of(files: &[PathBuf]) -> Result<Topics> {
    let mut topics = Topics::new();
    for file in files {
        for topic in Storage::open(file)?.topics().map_err(|e| e.at(file.display()))? {
            topics.entry(topic.name).or_default().insert((topic.kind, topic.encoding));
        }
    }
    Ok(topics)
}

/// The topics that are `wanted` of the bag at `path`, and their type.
fn choose(topics: &Topics, wanted: &WantedTopics<'_>, path: &Path) -> Result<(Vec<String>, String)> {
    let names = if wanted.topics.is_empty() { fitting(topics, wanted, path)? } else { named(topics, wanted)? };
    let kinds = names.iter().map(|name| kind_of(topics, wanted, name)).collect::<Result<Vec<String>>>()?;
    let other = names.iter().zip(&kinds).find(|(_, kind)| Some(kind.as_str()) != wanted.merged);
    match (kinds.first(), other, wanted.merged) {
        (Some(_), Some((name, kind)), Some(merged)) if names.len() > 1 => {
            Err(failed!("its messages are {kind}; of several topics {merged} is read, so name it alone").at(name))
        }
        (Some(kind), ..) => Ok((names, kind.clone())),
        (None, ..) => Err(Error::failed("no topic is named")),
    }
}

/// The topics in words, with their types.
fn listed(topics: &Topics) -> String {
    if topics.is_empty() {
        return "it has no topic at all".to_owned();
    }
    let kind = |all: &BTreeSet<(String, String)>| all.first().map_or("", |(kind, _)| kind.as_str()).to_owned();
    let words: Vec<String> = topics.iter().map(|(name, all)| format!("{name} ({})", kind(all))).collect();
    format!("it has {}", words.join(", "))
}

/// The topics that `wanted` names.
fn named(topics: &Topics, wanted: &WantedTopics<'_>) -> Result<Vec<String>> {
    for (index, name) in wanted.topics.iter().enumerate() {
        if !topics.contains_key(name) {
            let near = crate::error::nearest(name, topics.keys().map(String::as_str));
            let hint = near.map_or(String::new(), |near| format!("; did you mean {near}?"));
            return Err(failed!("there is no topic {name}: {}{hint}", listed(topics)));
        }
        if wanted.topics[..index].contains(name) {
            return Err(failed!("topic {name} is named twice; name it once"));
        }
    }
    match wanted.topics {
        [_, second, ..] if wanted.merged.is_none() => {
            Err(failed!("one topic of {} is read; leave out {second}", wanted.kinds.join(" or ")))
        }
        names => Ok(names.to_vec()),
    }
}

/// Without a name, the only topic of the types that are `wanted` of the bag at `path`, or all where they are merged.
fn fitting(topics: &Topics, wanted: &WantedTopics<'_>, path: &Path) -> Result<Vec<String>> {
    let kinds = wanted.kinds.join(" or ");
    let fits = |(kind, _): &&(String, String)| wanted.kinds.contains(&kind.as_str());
    let fit = topics.iter().filter(|(_, all)| all.iter().any(|of| fits(&of)));
    let names: Vec<String> = fit.clone().map(|(name, _)| name.clone()).collect();
    let is_merged = |kind: &str| wanted.merged == Some(kind);
    match &names[..] {
        [_] => Ok(names),
        [] => {
            let other = topics.values().flatten().find(|(_, encoding)| encoding != CDR);
            let why = other.map_or(String::new(), |(_, encoding)| format!("; {}", not_cdr(encoding)));
            Err(failed!("there is no topic of {kinds}: {}{why}", listed(topics)))
        }
        _ if fit.clone().all(|(_, all)| all.iter().all(|(kind, _)| is_merged(kind))) => Ok(names),
        [first, ..] => {
            let path = path.display();
            let merged = fit.flat_map(|(_, all)| all).find(|(kind, _)| is_merged(kind));
            let or_all =
                merged.map_or(String::new(), |(kind, _)| format!(", or all of {kind}: ros2-mcap:{path}@{kind}"));
            Err(failed!(
                "there are several topics of {kinds}: {}; name one: ros2-mcap:{path}:{first}{or_all}",
                names.join(", ")
            ))
        }
    }
}

/// The type of the messages of topic `name`, where it can be read.
fn kind_of(topics: &Topics, wanted: &WantedTopics<'_>, name: &str) -> Result<String> {
    let all: Vec<&(String, String)> = topics.get(name).into_iter().flatten().collect();
    let place = |e: Error| e.at(name);
    match &all[..] {
        [(_, encoding)] if encoding != CDR => Err(place(Error::failed(not_cdr(encoding)))),
        [(kind, _)] if !wanted.kinds.contains(&kind.as_str()) => {
            Err(place(failed!("its messages are {kind}; {} is read", wanted.kinds.join(" or "))))
        }
        [(kind, _)] => Ok(kind.clone()),
        _ => {
            let kinds: Vec<String> = all.iter().map(|(kind, encoding)| format!("{kind} in {encoding}")).collect();
            Err(place(failed!(
                "it has messages of several types, {}; record them anew, on a topic each",
                kinds.join(", ")
            )))
        }
    }
}

fn not_cdr(encoding: &str) -> String {
    let encoding: String = encoding.chars().take(20).collect();
    format!(
        "messages are in `{encoding}`, and CDR is read here, as `ros2 bag record` writes it; convert or record \
         them so"
    )
}

#[cfg(test)]
mod tests {
    use super::super::stored::whole;
    use super::*;

    fn topics(all: &[(&str, &str, &str)]) -> Topics {
        let mut topics = Topics::new();
        for (name, kind, encoding) in all {
            topics.entry((*name).to_owned()).or_default().insert((whole(kind), (*encoding).to_owned()));
        }
        topics
    }

    fn chosen(all: &[(&str, &str, &str)], topic: Option<&str>) -> Result<String, String> {
        let named: Vec<String> = topic.into_iter().map(str::to_owned).collect();
        let wanted = WantedTopics { topics: &named, kinds: &["sensor_msgs/msg/JointState"], merged: None };
        choose(&topics(all), &wanted, Path::new("bag")).map(|(names, _)| names.concat()).map_err(|e| e.to_string())
    }

    #[test]
    fn the_only_topic_of_a_type_is_chosen_else_it_is_named() {
        let (joint, other) = ("sensor_msgs/msg/JointState", "std_msgs/msg/String");
        let one = [("/a", joint, "cdr"), ("/b", other, "cdr")];
        assert_eq!(chosen(&one, None).as_deref(), Ok("/a"));
        assert_eq!(chosen(&one, Some("/a")).as_deref(), Ok("/a"));
        assert_eq!(
            chosen(&one, Some("/b")).unwrap_err(),
            "/b: its messages are std_msgs/msg/String; sensor_msgs/msg/JointState is read"
        );
        let why = chosen(&one, Some("/aa")).unwrap_err();
        assert!(why.contains("there is no topic /aa: it has /a (sensor_msgs/msg/JointState), /b (std_msgs"), "{why}");
        let two = [("/a", joint, "cdr"), ("/b", joint, "cdr")];
        assert!(chosen(&two, None).unwrap_err().ends_with("/a, /b; name one: ros2-mcap:bag:/a"));
        assert_eq!(chosen(&two, Some("/b")).as_deref(), Ok("/b"));
        assert!(chosen(&[], None).unwrap_err().contains("it has no topic at all"));
        assert!(chosen(&[("/a", joint, "cdr"), ("/a", other, "cdr")], None).unwrap_err().contains("several types"));
    }

    #[test]
    fn all_topics_of_the_merged_type_are_chosen_where_there_are_no_others() {
        let (cloud, array) = ("sensor_msgs/msg/PointCloud2", "std_msgs/msg/Float32MultiArray");
        let chosen = |all: &[(&str, &str, &str)], named: &[&str]| {
            let named: Vec<String> = named.iter().map(|&name| name.to_owned()).collect();
            let wanted = WantedTopics { topics: &named, kinds: &[cloud, array], merged: Some(cloud) };
            let found = choose(&topics(all), &wanted, Path::new("bag"));
            found.map(|(names, kind)| (names.join(","), kind)).map_err(|e| e.to_string())
        };
        let two = [("/b", cloud, "cdr"), ("/a", cloud, "cdr"), ("/joints", "sensor_msgs/msg/JointState", "cdr")];
        assert_eq!(chosen(&two, &[]), Ok(("/a,/b".to_owned(), cloud.to_owned())));
        assert_eq!(chosen(&two, &["/b"]), Ok(("/b".to_owned(), cloud.to_owned())));
        assert_eq!(chosen(&two, &["/b", "/a"]), Ok(("/b,/a".to_owned(), cloud.to_owned())));
        assert_eq!(chosen(&two, &["/b", "/b"]).unwrap_err(), "topic /b is named twice; name it once");
        let mixed = [("/a", cloud, "cdr"), ("/b", array, "cdr")];
        let why = chosen(&mixed, &[]).unwrap_err();
        assert!(why.ends_with("; name one: ros2-mcap:bag:/a, or all of sensor_msgs/msg/PointCloud2: ros2-mcap:bag@sensor_msgs/msg/PointCloud2"), "{why}");
        let why = chosen(&mixed, &["/a", "/b"]).unwrap_err();
        assert!(why.starts_with("/b: its messages are std_msgs/msg/Float32MultiArray; of several topics"), "{why}");
        let arrays = [("/a", array, "cdr"), ("/b", array, "cdr")];
        assert!(chosen(&arrays, &[]).unwrap_err().ends_with("/a, /b; name one: ros2-mcap:bag:/a"));
    }

    #[test]
    fn other_encodings_are_refused_with_what_to_do() {
        for (kind, encoding) in [("sensor_msgs/JointState", "ros1"), ("sensor_msgs/msg/JointState", "json")] {
            for topic in [None, Some("/a")] {
                let why = chosen(&[("/a", kind, encoding)], topic).unwrap_err();
                assert!(why.starts_with(&format!("/a: messages are in `{encoding}`, and CDR is read here")), "{why}");
            }
        }
        let why = chosen(&[("/a", "foxglove.JointStates", "protobuf")], None).unwrap_err();
        assert!(why.contains("`protobuf`") && why.contains("convert or record them so"), "{why}");
    }
}
