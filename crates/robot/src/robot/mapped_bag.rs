//! Arrays within messages of a bag of ROS 2, of any type that the bag or a map defines.

use super::bag_source::time_of;
use super::defined::{MessageReading, Plan, is_usual, not_defined};
use crate::error::{Result, failed};
use crate::recording::{BagReader, DefinedTopic, WantedTopics};
use crate::signal::RawValue;
use crate::source::{ArrayMap, BagName, Came, MappedSource, Messages};

/// Messages of a topic of a bag, by a map.
struct MappedBag {
    /// The bag and the topic.
    name: String,
    kind: String,
    bag: BagReader,
    reading: MessageReading,
    /// Whether the bag could not be read any more.
    has_failed: bool,
}

/// Frames from arrays within the messages of `bag`, by `map`, which names the topic or its type. Where it names neither, it is the
/// only topic that has what the map says.
///
/// # Errors
/// The bag cannot be read, or has no such topic, or several; its messages are not defined, or have not what the map says.
pub fn mapped_bag(bag: &BagName, map: &ArrayMap, skip_bad: bool) -> Result<MappedSource> {
    let place = bag.path.display().to_string();
    let (topic, plan) = chosen(bag, map).map_err(|e| e.at(&place))?;
    let topics = [topic.name.clone()];
    let reader = BagReader::open(&bag.path, &WantedTopics { topics: &topics, kinds: &[&topic.kind], merged: None })?;
    let messages = MappedBag {
        name: format!("{place}: {}", topic.name),
        kind: topic.kind,
        bag: reader,
        reading: MessageReading::new(map, plan),
        has_failed: false,
    };
    MappedSource::new(Box::new(messages), map, skip_bad)
}

/// The topic of `bag` that `map` is for, and what is read of its messages.
fn chosen(bag: &BagName, map: &ArrayMap) -> Result<(DefinedTopic, Plan)> {
    let all = DefinedTopic::all_of(&bag.path)?;
    let listed = || match all.is_empty() {
        true => "it has no topic at all".to_owned(),
        false => {
            let words: Vec<String> = all.iter().map(|topic| format!("{} ({})", topic.name, topic.kind)).collect();
            format!("it has {}", words.join(", "))
        }
    };
    if let [_, second, ..] = &bag.topics[..] {
        return Err(failed!("a map is for one topic; leave out {second}"));
    }
    let named = bag.topics.first().or(map.message.as_ref());
    let kind = bag.kind.as_ref().or(map.kind.as_ref());
    let is_meant = |topic: &&DefinedTopic| {
        named.is_none_or(|name| topic.name == *name) && kind.is_none_or(|kind| topic.kind == *kind)
    };
    let meant: Vec<&DefinedTopic> = all.iter().filter(is_meant).collect();
    let asked = || match (named, kind) {
        (Some(name), Some(kind)) => format!("{name} of {kind}"),
        (Some(name), None) => name.clone(),
        (None, Some(kind)) => format!("of {kind}"),
        (None, None) => format!("with {}", map.paths()),
    };
    match &meant[..] {
        [] => Err(failed!("there is no topic {}: {}", asked(), listed())),
        [one] => Ok(((*one).clone(), plan(one, map)?)),
        several => {
            // Those that have what the map says.
            let mut fits: Vec<(&DefinedTopic, Plan)> =
                several.iter().filter_map(|topic| Some((*topic, plan(topic, map).ok()?))).collect();
            match (fits.pop(), fits.is_empty()) {
                (Some((one, plan)), true) => Ok((one.clone(), plan)),
                (None, _) => {
                    Err(failed!("no topic has {}: {}; name it in the map: message = \"/TOPIC\"", map.paths(), listed()))
                }
                (Some((last, _)), false) => {
                    let names: Vec<&str> = fits.iter().map(|(topic, _)| &*topic.name).chain([&*last.name]).collect();
                    let path = bag.path.display();
                    Err(failed!(
                        "several topics fit the map: {}; name one: ros2-mcap:{path}:{}",
                        names.join(", "),
                        names[0]
                    ))
                }
            }
        }
    }
}

/// What is read of messages of `topic`.
fn plan(topic: &DefinedTopic, map: &ArrayMap) -> Result<Plan> {
    if topic.encoding != "cdr" {
        return Err(failed!("its messages are in {}; CDR is read", topic.encoding).at(&topic.name));
    }
    let of_file = map.definition.as_deref().filter(|_| !ArrayMap::is_preset(&map.name));
    let own = match (of_file, topic.definition.as_deref()) {
        (Some(text), _) | (None, Some(text)) => Plan::new(map, &topic.kind, text, true),
        // A preset has those fields of a message that come first.
        (None, None) => match map.definition.as_deref() {
            Some(text) if map.kind.as_ref() == Some(&topic.kind) => Plan::new(map, &topic.kind, text, false),
            _ if is_usual(&topic.kind) => Plan::new(map, &topic.kind, "", true),
            _ => Err(not_defined("the bag does not define", &topic.kind)),
        },
    };
    own.map_err(|e| e.at(&topic.name))
}

impl Messages for MappedBag {
    fn next(&mut self, values: &mut Vec<RawValue>) -> Result<Came> {
        self.has_failed = true;
        let message = self.bag.next_message()?;
        self.has_failed = false;
        let Some(message) = message else { return Ok(Came::End) };
        let (bytes, log) = (message.data.len(), time_of(message.log_ns));
        let read = self.reading.read(message.data, log, values);
        match read.map_err(|e| e.at(format!("{}: the message of {} s", self.name, log.s)))? {
            Some(time) => {
                self.bag.saw(time.s);
                Ok(Came::Message(time))
            }
            None => {
                self.bag.damaged(bytes);
                Ok(Came::Damaged)
            }
        }
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
        format!("{} ({}): {}", self.name, self.kind, self.reading.taken("time is when a message came to the recorder"))
    }

    fn progress(&self) -> Option<f64> {
        Some(self.bag.progress())
    }

    fn losses(&self) -> Vec<String> {
        self.bag.losses()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::messages::{Float32MultiArray, Header, JointState, Message, MultiArrayLayout, Time};
    use super::*;
    use crate::output::OutputPaths;
    use crate::recording::{BAG_METADATA, BagType, BagWriter};
    use crate::signal::Frame;
    use crate::source::Source as _;

    fn kind_of<M: Message>() -> BagType {
        BagType { name: M::TYPE, hash: M::HASH, definition: M::definition() }
    }

    /// A bag at `path` with three states on /hand, with stamps from `stamp_s` on, and three arrays on /array.
    fn write(path: &Path, stamp_s: i32) {
        let none: [&str; 0] = [];
        let output = OutputPaths::new(false, none).add_folder(path, ["a.mcap", BAG_METADATA]).unwrap();
        let mut bag = BagWriter::create(output, "a.mcap", true).unwrap();
        let hand = bag.topic("/hand", &kind_of::<JointState>()).unwrap();
        let array = bag.topic("/array", &kind_of::<Float32MultiArray>()).unwrap();
        for at in 0..3 {
            let ns = 1_000_000_000 * (10 + at as u64);
            let stamp = Time { sec: if stamp_s == 0 { 0 } else { stamp_s + at }, nanosec: 0 };
            let header = Header { stamp, frame_id: String::new() };
            let position = vec![f64::from(at), 30_000.0];
            let name = vec!["a".to_owned(), "b".to_owned()];
            let state = JointState { header, name, position, ..JointState::default() };
            bag.write(hand, ns, &state.to_cdr()).unwrap();
            let data = vec![7.0; 4];
            bag.write(array, ns, &Float32MultiArray { layout: MultiArrayLayout::default(), data }.to_cdr()).unwrap();
        }
        bag.finish().unwrap();
    }

    /// Times in s, and values.
    type Frames = Vec<(f64, Vec<Option<f64>>)>;

    fn read(bag: &BagName, map: &str) -> Result<(Frames, Vec<String>)> {
        let mut source = mapped_bag(bag, &ArrayMap::parse(map)?, false)?;
        let (mut frame, mut all) = (Frame::default(), Vec::new());
        while source.next_frame(&mut frame)? {
            all.push((frame.t_s, frame.values.iter().map(|value| value.number()).collect()));
        }
        assert!(source.losses().is_empty());
        Ok((all, source.notices()))
    }

    #[test]
    fn a_topic_is_found_by_name_by_type_or_by_what_it_has() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag");
        write(&path, 5);
        let bag = BagName::new(&path);
        let expected: Frames = (0..3).map(|at| (5.0 + f64::from(at), vec![Some(2.0 * f64::from(at)), None])).collect();
        for which in ["", "message = '/hand'\n", "type = 'sensor_msgs/JointState'\n"] {
            let map = format!("{which}values = 'position'\nmissing = [30000]\nscale = 2");
            let (frames, notices) = read(&bag, &map).unwrap();
            assert_eq!(frames, expected, "{which}");
            let says = "/hand (sensor_msgs/msg/JointState): position; time is header.stamp: 2 values a message; 30000 counts as missing";
            assert!(notices[0].contains(says), "{notices:?}");
        }
        assert_eq!(read(&bag, "values = 'data'").unwrap().0[2], (12.0, vec![Some(7.0); 4]));
        let topic = BagName { topics: vec!["/array".to_owned()], ..bag.clone() };
        assert_eq!(read(&topic, "values = 'data[1:3]'").unwrap().0[0], (10.0, vec![Some(7.0); 2]));
        // The recorder's clock, without a stamp.
        let other = folder.path().join("other");
        write(&other, 0);
        let (frames, notices) = read(&BagName::new(&other), "values = 'position'").unwrap();
        assert_eq!(frames[0].0, 10.0);
        assert!(notices[0].contains("time is when a message came to the recorder"), "{notices:?}");
    }

    #[test]
    fn what_a_bag_does_not_have_is_said_in_a_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag");
        write(&path, 5);
        let bag = BagName::new(&path);
        for (map, says) in [
            (
                "message = '/hand'\nvalues = 'positon'",
                "sensor_msgs/JointState has no `positon`; did you mean `position`?",
            ),
            (
                "message = '/no'\nvalues = 'a'",
                "there is no topic /no: it has /array (std_msgs/msg/Float32MultiArray), /hand",
            ),
            ("type = 'a/B'\nvalues = 'a'", "there is no topic of a/msg/B: it has /array"),
            ("values = 'nothing'", "no topic has nothing: it has /array"),
            ("values = 'position'\nids = '0-8'", "ids names 9 taxels, and a message has 2 values"),
        ] {
            let why = read(&bag, map).unwrap_err().to_string();
            assert!(why.contains(says) && why.lines().count() == 1, "{map}: {why}");
        }
    }
}
