//! The names of topics in bags of ROS 2.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::error::{Error, Result, failed};

/// A topic of a bag of ROS 2 as people name it: `PATH[:/TOPIC][@TYPE]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BagName {
    /// An MCAP file, or a folder of such.
    pub path: PathBuf,
    /// The topic's name, from `/` on; without one, the only topic that fits is meant.
    pub topic: Option<String>,
    /// The type of its messages, such as `sensor_msgs/msg/PointCloud2`.
    pub kind: Option<String>,
}

impl BagName {
    /// The bag at `path`, without a topic.
    #[must_use]
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into(), topic: None, kind: None }
    }

    /// Whether `path` is a bag rather than another file: a folder, or a file with the ending of MCAP.
    #[must_use]
    pub fn is_bag(path: &Path) -> bool {
        path.is_dir() || path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"))
    }
}

/// A type in ROS 2's own spelling, where `text` is one in that of ROS 1 or 2.
pub(super) fn type_of(text: &str) -> Option<String> {
    let is_word = |word: &str| !word.is_empty() && word.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    let (package, name) = match text.split('/').collect::<Vec<_>>()[..] {
        [package, "msg", name] | [package, name] => (package, name),
        _ => return None,
    };
    let fits = is_word(package) && is_word(name) && name.starts_with(|c: char| c.is_ascii_uppercase());
    fits.then(|| format!("{package}/msg/{name}"))
}

impl FromStr for BagName {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        // Paths have signs of any kind; what follows one counts only where it is a type, or begins as topics do.
        let (rest, kind) = match text.rsplit_once('@').map(|(rest, kind)| (rest, type_of(kind))) {
            Some((rest, Some(kind))) => (rest, Some(kind)),
            _ => (text, None),
        };
        let (path, topic) = match rest.rsplit_once(":/") {
            // `C:/` is the drive of Windows.
            Some((path, topic)) if path.len() > 1 && !topic.is_empty() => (path, Some(format!("/{topic}"))),
            _ => (rest, None),
        };
        if path.is_empty() {
            return Err(failed!("`{text}` names no bag; write ros2-mcap:PATH or ros2-mcap:PATH:/TOPIC"));
        }
        Ok(Self { path: path.into(), topic, kind })
    }
}

impl fmt::Display for BagName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        self.topic.iter().try_for_each(|topic| write!(f, ":{topic}"))?;
        self.kind.iter().try_for_each(|kind| write!(f, "@{kind}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_come_apart_and_together() {
        let cloud = "sensor_msgs/msg/PointCloud2";
        for (text, path, topic, kind) in [
            ("bag", "bag", None, None),
            ("a/b.mcap", "a/b.mcap", None, None),
            ("bag:/arm/skin", "bag", Some("/arm/skin"), None),
            ("bag:/skin@sensor_msgs/msg/PointCloud2", "bag", Some("/skin"), Some(cloud)),
            ("bag@sensor_msgs/msg/PointCloud2", "bag", None, Some(cloud)),
            ("C:/bag:/skin", "C:/bag", Some("/skin"), None),
            ("C:/bag", "C:/bag", None, None),
            ("me@home/bag:2", "me@home/bag:2", None, None),
            ("/2026-01-01 12:30/b.mcap", "/2026-01-01 12:30/b.mcap", None, None),
        ] {
            let name: BagName = text.parse().unwrap();
            assert_eq!((name.path.to_str(), name.topic.as_deref(), name.kind.as_deref()), (Some(path), topic, kind));
            assert_eq!(name.to_string(), text);
        }
        let short: BagName = "bag:/skin@sensor_msgs/PointCloud2".parse().unwrap();
        assert_eq!(short.kind.as_deref(), Some(cloud));
        assert!("".parse::<BagName>().is_err());
        assert!(BagName::is_bag(Path::new("a.MCAP")) && BagName::is_bag(Path::new(".")));
        assert!(!BagName::is_bag(Path::new("a.csv")));
    }
}
