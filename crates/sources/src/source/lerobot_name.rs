//! The names of LeRobot datasets, and the files that they have.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use crate::error::{Error, Result, failed};

/// A LeRobot dataset as people name it: `DIR[:FEATURE][#EPISODE]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LeRobotName {
    /// Its folder, which has `meta` and `data`.
    pub path: PathBuf,
    /// The feature that is touch; without one, the only one that looks like it is meant.
    pub feature: Option<String>,
    /// One episode, from 0; without one, all are meant, one after the other.
    pub episode: Option<u64>,
}

impl LeRobotName {
    /// Whether `path` is the folder of a dataset.
    #[must_use]
    pub fn is_folder(path: &Path) -> bool {
        path.join("meta/info.json").is_file()
    }

    /// What it holds, as `meta/info.json` says it.
    #[must_use]
    pub fn info(&self) -> PathBuf {
        self.path.join("meta/info.json")
    }

    /// The tables of frames that it has, in their order.
    #[must_use]
    pub fn tables(&self) -> Vec<PathBuf> {
        let within =
            |folder: &Path| std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
        let is_table = |file: &PathBuf| file.extension().is_some_and(|ending| ending == "parquet");
        let chunks = within(&self.path.join("data"));
        let mut tables: Vec<PathBuf> =
            chunks.flat_map(|chunk| within(&chunk).collect::<Vec<_>>()).filter(is_table).collect();
        tables.sort_by_cached_key(|file| by_number(&file.to_string_lossy()));
        tables
    }
}

/// The words and numbers of `text`, so that `file-10` comes after `file-9`.
fn by_number(text: &str) -> Vec<(u64, String)> {
    let is_digit = |c: &char| c.is_ascii_digit();
    let mut parts = Vec::new();
    let mut rest = text.chars().peekable();
    while rest.peek().is_some() {
        let word: String = std::iter::from_fn(|| rest.next_if(|c| !is_digit(c))).collect();
        let digits: String = std::iter::from_fn(|| rest.next_if(is_digit)).collect();
        parts.push((digits.parse().unwrap_or(0), word));
    }
    parts
}

impl FromStr for LeRobotName {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let (rest, episode) = match text.rsplit_once('#').map(|(rest, number)| (rest, number.parse())) {
            Some((rest, Ok(episode))) => (rest, Some(episode)),
            _ => (text, None),
        };
        let is_feature = |word: &str| !word.is_empty() && !word.contains(['/', '\\']);
        let (path, feature) = match rest.rsplit_once(':') {
            // `C:data` is a folder of Windows. A folder that is there is meant, whatever its name.
            Some((path, feature)) if path.len() > 1 && is_feature(feature) && !Path::new(rest).is_dir() => {
                (path, Some(feature.to_owned()))
            }
            _ => (rest, None),
        };
        if path.is_empty() {
            return Err(failed!(
                "`{text}` names no folder; write lerobot:DIR, lerobot:DIR:FEATURE or lerobot:DIR#EPISODE"
            ));
        }
        Ok(Self { path: path.into(), feature, episode })
    }
}

impl fmt::Display for LeRobotName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        self.feature.iter().try_for_each(|feature| write!(f, ":{feature}"))?;
        self.episode.iter().try_for_each(|episode| write!(f, "#{episode}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_come_apart_and_together() {
        for (text, path, feature, episode) in [
            ("pick", "pick", None, None),
            ("a/pick#3", "a/pick", None, Some(3)),
            ("pick:observation.tactile", "pick", Some("observation.tactile"), None),
            ("pick:observation.tactile#12", "pick", Some("observation.tactile"), Some(12)),
            ("C:/pick", "C:/pick", None, None),
            ("C:/pick:touch#0", "C:/pick", Some("touch"), Some(0)),
            ("pick#first", "pick#first", None, None),
        ] {
            let name: LeRobotName = text.parse().unwrap();
            assert_eq!((name.path.to_str(), name.feature.as_deref(), name.episode), (Some(path), feature, episode));
            assert_eq!(name.to_string(), text);
        }
        assert!("#3".parse::<LeRobotName>().unwrap_err().to_string().contains("names no folder"));
    }

    #[test]
    fn tables_are_in_the_order_of_their_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let names = ["chunk-999/file-009.parquet", "chunk-999/file-1000.parquet", "chunk-1000/file-000.parquet"];
        for name in names.iter().chain(&["chunk-000/notes.txt"]) {
            let path = folder.path().join("data").join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, "").unwrap();
        }
        let name = LeRobotName { path: folder.path().to_owned(), feature: None, episode: None };
        assert_eq!(name.tables(), names.map(|name| folder.path().join("data").join(name)));
        assert!(!LeRobotName::is_folder(folder.path()));
    }
}
