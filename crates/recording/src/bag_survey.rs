//! What is in a bag of ROS 2.

use std::collections::BTreeMap;
use std::path::Path;

use super::bag_files::bag_files;
use super::storage::Storage;
use crate::error::Result;

/// What is in a bag of ROS 2: all of it, whether it is read as touch or not.
#[derive(Clone, Debug, Default)]
pub struct BagSurvey {
    /// How many files it has, and their bytes.
    pub files: usize,
    /// The bytes of all its files.
    pub bytes: u64,
    /// Its topics, by their names.
    pub topics: Vec<SurveyedTopic>,
    /// What could not be read, a line each.
    pub losses: Vec<String>,
}

/// A topic of a bag, with the messages of one type.
#[derive(Clone, Debug, Default)]
pub struct SurveyedTopic {
    /// Its name.
    pub name: String,
    /// The type of its messages, such as `sensor_msgs/msg/JointState`.
    pub kind: String,
    /// The encoding of its messages: `cdr` in bags of ROS 2.
    pub encoding: String,
    /// How many messages there are.
    pub messages: u64,
    /// Their bytes.
    pub bytes: u64,
    /// When the first and the last message came, by the recorder's clock, ns.
    pub span_ns: Option<[u64; 2]>,
}

impl SurveyedTopic {
    /// Messages a second, where there are two at least.
    #[must_use]
    pub fn rate_hz(&self) -> Option<f64> {
        let [first_ns, last_ns] = self.span_ns?;
        (self.messages > 1 && last_ns > first_ns)
            .then(|| (self.messages - 1) as f64 / ((last_ns - first_ns) as f64 / 1e9))
    }
}

impl BagSurvey {
    /// Reads the bag at `path`, a file in MCAP or SQLite or a folder of such, to its end; `progress` gets the share that has been read.
    ///
    /// # Errors
    /// It cannot be read, or is not a bag.
    pub fn read(path: &Path, mut progress: impl FnMut(f64)) -> Result<Self> {
        let files = bag_files(path)?;
        let mut survey = Self { files: files.len(), ..Self::default() };
        let mut topics: BTreeMap<(String, String), SurveyedTopic> = BTreeMap::new();
        for (index, file) in files.iter().enumerate() {
            let mut storage = Storage::open(file)?;
            survey.bytes += std::fs::metadata(file).map_or(0, |there| there.len());
            let mut count = 0_u64;
            while let Some(message) = storage.next_message()? {
                let bytes = storage.data().len() as u64;
                let Some(stored) = storage.topic(message.topic) else {
                    storage.damaged(bytes);
                    continue;
                };
                let topic = topics.entry((stored.name, stored.kind)).or_default();
                topic.encoding = stored.encoding;
                topic.messages += 1;
                topic.bytes += bytes;
                let log_ns = message.log_ns;
                let [first_ns, last_ns] = topic.span_ns.unwrap_or([log_ns; 2]);
                topic.span_ns = Some([first_ns.min(log_ns), last_ns.max(log_ns)]);
                storage.saw(log_ns as f64 / 1e9);
                count += 1;
                if count.is_multiple_of(1024) {
                    progress((index as f64 + storage.progress()) / files.len() as f64);
                }
            }
            // Topics that have no message yet.
            for stored in storage.known_topics() {
                topics.entry((stored.name, stored.kind)).or_default().encoding = stored.encoding;
            }
            survey.losses.extend(storage.losses());
        }
        survey.topics = topics.into_iter().map(|((name, kind), topic)| SurveyedTopic { name, kind, ..topic }).collect();
        Ok(survey)
    }
}
