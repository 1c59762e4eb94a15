//! Where joint states come from, as people name it.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::source::BagName;

/// Where joint states come from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StatesSpec {
    /// A table, or lines.
    File(PathBuf),
    /// A topic of a bag of ROS 2.
    Bag(BagName),
    /// Live topics of ROS 2, each from `/` on, with commas between.
    Topic(String),
}

impl StatesSpec {
    /// What `states` names.
    ///
    /// # Errors
    /// A usage error if it is not a topic or a bag.
    pub fn named(states: &Path) -> Result<Self> {
        // A path that is not text has no such beginning.
        let text = states.to_str().unwrap_or_default();
        if let Some(topic) = text.strip_prefix("ros2:") {
            if let Some(topic) = topic.split(',').find(|topic| !topic.starts_with('/')) {
                return Err(Error::usage(format!(
                    "`{topic}` is not a topic; write one that begins with /: ros2:/{topic}"
                ))
                .at("`joint_states`"));
            }
            return Ok(Self::Topic(topic.to_owned()));
        }
        if let Some(name) = text.strip_prefix("ros2-mcap:") {
            return name.parse().map(Self::Bag).map_err(|e| Error::usage(e.to_string()).at("`joint_states`"));
        }
        Ok(if BagName::is_bag(states) { Self::Bag(BagName::new(states)) } else { Self::File(states.to_owned()) })
    }
}

/// The bag with poses that `poses` names.
///
/// # Errors
/// A usage error if it is none.
pub fn bag_of(poses: &Path) -> Result<BagName> {
    let at = |e: Error| Error::usage(e.to_string()).at("`poses`");
    match poses.to_str().unwrap_or_default().strip_prefix("ros2-mcap:") {
        Some(name) => name.parse().map_err(at),
        None if BagName::is_bag(poses) => Ok(BagName::new(poses)),
        None => Err(Error::usage("poses come from a ROS 2 bag: a .mcap, a .db3, a folder, or ros2-mcap:PATH:/TOPIC")
            .at("`poses`")),
    }
}
