//! Where joint states come from, as people name it.

use std::path::Path;

use somatic::source::BagName;
use somatic::{Error, Result};

/// Where joint states come from.
pub(super) enum StatesFrom<'a> {
    /// A table, or lines.
    File(&'a Path),
    /// A topic of a bag of ROS 2.
    Bag(BagName),
    /// A live topic of ROS 2.
    Topic(&'a str),
}

impl<'a> StatesFrom<'a> {
    /// What `states` names.
    pub(super) fn named(states: &'a Path) -> Result<Self> {
        // A path that is no text has no such beginning.
        let text = states.to_str().unwrap_or_default();
        if let Some(topic) = text.strip_prefix("ros2:") {
            if !topic.starts_with('/') {
                return Err(Error::usage(format!("`{topic}` is no topic; it begins with /: ros2:/{topic}"))
                    .at("--joint-states"));
            }
            return Ok(Self::Topic(topic));
        }
        if let Some(name) = text.strip_prefix("ros2-mcap:") {
            return name.parse().map(Self::Bag).map_err(|e| Error::usage(e.to_string()).at("--joint-states"));
        }
        Ok(if BagName::is_bag(states) { Self::Bag(BagName::new(states)) } else { Self::File(states) })
    }
}
