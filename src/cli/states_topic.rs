//! Joint states that are a topic of ROS 2 instead of a file.

use std::path::Path;

/// The topic of ROS 2 that joint states come from, if `states` is one.
pub(super) fn topic_of(states: &Path) -> Option<&str> {
    states.to_str()?.strip_prefix("ros2:")
}
