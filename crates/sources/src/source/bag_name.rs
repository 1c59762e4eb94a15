//! The names of topics in bags of ROS 2.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::error::{Error, Result, failed};

/// Topics of a bag of ROS 2 as people name them: `PATH[:/TOPIC[,/TOPIC]...][@TYPE]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BagName {
    /// A file in MCAP or SQLite, or a folder of such.
    pub path: PathBuf,
    /// The topics' names, from `/` on; without any, what fits is meant.
    pub topics: Vec<String>,
    /// The type of its messages, such as `sensor_msgs/msg/PointCloud2`.
    pub kind: Option<String>,
}

impl BagName {
    /// The bag at `path`, without a topic.
    #[must_use]
    pub fn new(path: impl Into<PathBuf>) -> Self {
        Self { path: path.into(), topics: Vec::new(), kind: None }
    }

    /// Whether `path` is the folder of a bag.
    #[must_use]
    pub fn is_folder(path: &Path) -> bool {
        path.join("metadata.yaml").is_file()
    }

    /// Whether `path` is a bag rather than another file: a folder, or a file with the ending of one, also of those that are
    /// not read.
    #[must_use]
    pub fn is_bag(path: &Path) -> bool {
        let has = |wanted: &str| path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case(wanted));
        path.is_dir() || ["mcap", "db3", "bag"].into_iter().any(has)
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
        let (path, topics) = match rest.rsplit_once(":/") {
            // `C:/` is the drive of Windows. Names of topics have no commas.
            Some((path, topics)) if path.len() > 1 && !topics.is_empty() => {
                (path, format!("/{topics}").split(',').map(str::to_owned).collect())
            }
            _ => (rest, Vec::new()),
        };
        if path.is_empty() {
            return Err(failed!("`{text}` names no bag; write ros2-mcap:PATH or ros2-mcap:PATH:/TOPIC"));
        }
        Ok(Self { path: path.into(), topics, kind })
    }
}

impl fmt::Display for BagName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        if !self.topics.is_empty() {
            write!(f, ":{}", self.topics.join(","))?;
        }
        self.kind.iter().try_for_each(|kind| write!(f, "@{kind}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_come_apart_and_together() {
        let cloud = "sensor_msgs/msg/PointCloud2";
        for (text, path, topics, kind) in [
            ("bag", "bag", &[][..], None),
            ("a/b.mcap", "a/b.mcap", &[], None),
            ("bag:/arm/skin", "bag", &["/arm/skin"], None),
            ("bag:/left/skin,/right/skin", "bag", &["/left/skin", "/right/skin"], None),
            ("bag:/skin@sensor_msgs/msg/PointCloud2", "bag", &["/skin"], Some(cloud)),
            ("bag@sensor_msgs/msg/PointCloud2", "bag", &[], Some(cloud)),
            ("C:/bag:/skin", "C:/bag", &["/skin"], None),
            ("C:/bag", "C:/bag", &[], None),
            ("me@home/bag:2", "me@home/bag:2", &[], None),
            ("/2026-01-01 12:30/b.mcap", "/2026-01-01 12:30/b.mcap", &[], None),
        ] {
            let name: BagName = text.parse().unwrap();
            assert_eq!((name.path.to_str(), name.kind.as_deref()), (Some(path), kind));
            assert_eq!(name.topics, topics);
            assert_eq!(name.to_string(), text);
        }
        let short: BagName = "bag:/skin@sensor_msgs/PointCloud2".parse().unwrap();
        assert_eq!(short.kind.as_deref(), Some(cloud));
        assert!("".parse::<BagName>().is_err());
        assert!(BagName::is_bag(Path::new("a.MCAP")) && BagName::is_bag(Path::new(".")));
        assert!(BagName::is_bag(Path::new("a.db3")) && !BagName::is_bag(Path::new("a.csv")));
    }
}
