//! The files of a bag of ROS 2, in their order.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::bag::BAG_METADATA;
use crate::error::{Error, Result, failed};
use crate::limits::{self, MAX_METADATA_BYTES};

/// What a bag is made of MCAP by.
const CONVERTED: &str = "convert it: rosbags-convert --src BAG --dst OUT --dst-storage mcap";

/// The MCAP files of the bag at `path`: itself, or those of a folder in the order of its metadata, or, where a recorder was killed
/// before it wrote these, of their numbers.
///
/// # Errors
/// It is not there, or is no bag in MCAP.
pub(super) fn bag_files(path: &Path) -> Result<Vec<PathBuf>> {
    if !fs::metadata(path).map_err(|e| Error::io(path, &e))?.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let metadata = path.join(BAG_METADATA);
    match limits::read_to_string(&metadata, MAX_METADATA_BYTES) {
        Ok(text) => {
            let names = names_in(&text).map_err(|e| e.at(metadata.display()))?;
            // Older recorders put the folder before the name.
            Ok(names.iter().filter_map(|name| Path::new(name).file_name()).map(|name| path.join(name)).collect())
        }
        Err(e) if e.kind() == ErrorKind::NotFound => unlisted(path),
        Err(e) => Err(Error::io(&metadata, &e)),
    }
}

/// The MCAP files in `folder`, by the numbers in their names.
fn unlisted(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = |e: std::io::Error| Error::io(folder, &e);
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.extension().is_some_and(|ending| ending == "mcap") {
            files.push(path);
        }
    }
    if files.is_empty() {
        return Err(Error::failed("there is no bag in this folder: it has neither metadata.yaml nor a file .mcap")
            .at(folder.display()));
    }
    // `bag_10` comes after `bag_9`.
    files.sort_by_cached_key(|path| {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let name = stem.trim_end_matches(|c: char| c.is_ascii_digit());
        (name.to_owned(), stem[name.len()..].parse::<u64>().unwrap_or(0), stem.clone())
    });
    Ok(files)
}

/// The names of files in a bag's metadata, as recorders write these: the YAML of one key to a line.
fn names_in(text: &str) -> Result<Vec<String>> {
    let value = |key: &str| {
        let mut values = text.lines().filter_map(|line| line.trim().strip_prefix(key)?.strip_prefix(':'));
        values.next().map(|value| unquoted(value.trim()))
    };
    let storage = value("storage_identifier").unwrap_or_default();
    if !["mcap", ""].contains(&storage.as_str()) {
        return Err(failed!("its storage is {storage}, and MCAP is read here; {CONVERTED}"));
    }
    let mode = value("compression_mode").unwrap_or_default();
    if ["file", "message"].iter().any(|other| mode.eq_ignore_ascii_case(other)) {
        return Err(failed!(
            "each {} is compressed by itself, and chunks of MCAP are read here; {CONVERTED}",
            mode.to_lowercase()
        ));
    }
    let list = value("relative_file_paths").unwrap_or_default();
    let names: Vec<String> = match list.strip_prefix('[').and_then(|list| list.strip_suffix(']')) {
        Some(list) => list.split(',').map(|name| unquoted(name.trim())).collect(),
        None => {
            let lines = text.lines().map(str::trim);
            let after = lines.skip_while(|line| !line.starts_with("relative_file_paths:")).skip(1);
            after.map_while(|line| line.strip_prefix("- ")).map(|name| unquoted(name.trim())).collect()
        }
    };
    if names.iter().all(String::is_empty) {
        return Err(Error::failed("it lists no files under relative_file_paths; write it anew: ros2 bag reindex BAG"));
    }
    Ok(names)
}

/// A text of YAML without its quotes.
fn unquoted(text: &str) -> String {
    match text.strip_prefix('\'').and_then(|text| text.strip_suffix('\'')) {
        Some(inner) => inner.replace("''", "'"),
        // A string of JSON is one of YAML.
        None => serde_json::from_str(text).unwrap_or_else(|_| text.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_in_the_order_of_the_metadata_or_of_their_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let files =
            || bag_files(folder.path()).map(|files| files.into_iter().map(|f| f.display().to_string()).collect());
        let inside = |names: &[&str]| -> Vec<String> {
            names.iter().map(|name| folder.path().join(name).display().to_string()).collect()
        };
        assert!(files().unwrap_err().to_string().contains("no bag in this folder"), "{:?}", files());
        for name in ["b_10.mcap", "b_9.mcap", "a.mcap", "other.txt"] {
            fs::write(folder.path().join(name), "").unwrap();
        }
        assert_eq!(files(), Ok(inside(&["a.mcap", "b_9.mcap", "b_10.mcap"])));
        for (list, expected) in [
            ("\n    - b_10.mcap\n    - \"b 1.mcap\"\n  duration:\n    - c", inside(&["b_10.mcap", "b 1.mcap"])),
            ("\n  - 'it''s.mcap'\n  - old/b.mcap\n", inside(&["it's.mcap", "b.mcap"])),
            (" [\"x.mcap\", y.mcap]\n", inside(&["x.mcap", "y.mcap"])),
        ] {
            let text =
                format!("bag:\n  storage_identifier: mcap\n  compression_mode: \"\"\n  relative_file_paths:{list}");
            fs::write(folder.path().join(BAG_METADATA), text).unwrap();
            assert_eq!(files(), Ok(expected), "{list}");
        }
    }

    #[test]
    fn bags_that_are_not_read_say_what_to_do() {
        let why = |text: &str| names_in(text).unwrap_err().to_string();
        assert!(
            why("  storage_identifier: sqlite3\n")
                .contains("its storage is sqlite3, and MCAP is read here; convert it")
        );
        assert!(
            why("  storage_identifier: mcap\n  compression_mode: FILE\n").contains("each file is compressed by itself")
        );
        assert!(why("  storage_identifier: mcap\n  relative_file_paths: []\n").contains("ros2 bag reindex"));
        assert!(why("").contains("relative_file_paths"));
    }
}
