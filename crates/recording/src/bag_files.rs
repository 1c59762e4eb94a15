//! The files of a bag of ROS 2, in their order.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::bag::BAG_METADATA;
use super::stored::{SQLITE, ZSTD};
use super::yaml_list::{listed, value};
use crate::error::{Error, Result, failed};
use crate::limits::{self, MAX_METADATA_BYTES};

/// What a bag is made of MCAP by.
const CONVERTED: &str = "convert it: rosbags-convert --src BAG --dst OUT --dst-storage mcap";
/// What writes the metadata of a bag anew.
const REINDEXED: &str = "write it anew: ros2 bag reindex BAG";

/// What to say of a file that begins with `first`, which is not as MCAP does.
pub(super) fn not_mcap(first: &[u8]) -> String {
    if first.starts_with(SQLITE) {
        return "it is a ROS 2 bag in SQLite, which is named ros2-mcap:PATH".to_owned();
    }
    if first.starts_with(b"#ROSBAG V") {
        return format!("it is a ROS 1 bag, and bags of ROS 2 are read here; {CONVERTED}");
    }
    if first.starts_with(ZSTD) {
        return "it is compressed as a whole; unpack it: unzstd FILE".to_owned();
    }
    "this is not an MCAP file: its first bytes differ".to_owned()
}

/// The files of the bag at `path`: itself, or those of a folder in the order of its metadata, or, where a recorder was killed
/// before it wrote these, of their numbers.
///
/// # Errors
/// It is not there, or is not a bag in MCAP or SQLite.
pub(super) fn bag_files(path: &Path) -> Result<Vec<PathBuf>> {
    if !fs::metadata(path).map_err(|e| Error::io(path, &e))?.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let metadata = path.join(BAG_METADATA);
    match limits::read_to_string(&metadata, MAX_METADATA_BYTES) {
        Ok(text) => {
            let names = names_in(&text).map_err(|e| e.at(metadata.display()))?;
            Ok(names.iter().map(|name| path.join(name)).collect())
        }
        Err(e) if e.kind() == ErrorKind::NotFound => unlisted(path),
        Err(e) => Err(Error::io(&metadata, &e)),
    }
}

/// The files in `folder`, by the numbers in their names: those of MCAP, or of SQLite where there are none.
fn unlisted(folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = |e: std::io::Error| Error::io(folder, &e);
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.extension().is_some_and(|ending| ending == "mcap" || ending == "db3") {
            files.push(path);
        }
    }
    let is_mcap = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "mcap");
    if files.iter().any(is_mcap) {
        files.retain(is_mcap);
    }
    if files.is_empty() {
        return Err(Error::failed(
            "there is no bag in this folder: it has neither metadata.yaml nor a file .mcap or .db3",
        )
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

/// The names of files in a bag's metadata.
fn names_in(text: &str) -> Result<Vec<String>> {
    let storage = value(text, "storage_identifier")?.unwrap_or_default();
    if !["mcap", "sqlite3", ""].contains(&storage.as_str()) {
        return Err(failed!("its storage is {storage}, and mcap and sqlite3 are read here; {CONVERTED}"));
    }
    let mode = value(text, "compression_mode")?.unwrap_or_default();
    if mode.eq_ignore_ascii_case("file") {
        return Err(failed!("each file is compressed by itself, and single messages may be; {CONVERTED}"));
    }
    let format = value(text, "compression_format")?.unwrap_or_default();
    if mode.eq_ignore_ascii_case("message") && format != "zstd" {
        return Err(failed!("its messages are compressed with `{format}`, and zstd is read here; {CONVERTED}"));
    }
    let list = listed(text, "relative_file_paths").map_err(|e| failed!("{e}; {REINDEXED}"))?;
    let mut names: Vec<String> = Vec::new();
    for path in list {
        // Older recorders put the folder before the name.
        let name = Path::new(&path).file_name().and_then(|name| name.to_str());
        let Some(name) = name else {
            return Err(failed!("`{path}` under relative_file_paths names no file; {REINDEXED}"));
        };
        if names.iter().any(|known| known == name) {
            return Err(failed!("it lists {name} twice under relative_file_paths; {REINDEXED}"));
        }
        names.push(name.to_owned());
    }
    if names.is_empty() {
        return Err(failed!("it lists no files under relative_file_paths; {REINDEXED}"));
    }
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::super::reader::Reader;
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
        for name in ["b_10.db3", "b_9.db3", "other.txt"] {
            fs::write(folder.path().join(name), "").unwrap();
        }
        assert_eq!(files(), Ok(inside(&["b_9.db3", "b_10.db3"])));
        for name in ["b_10.mcap", "b_9.mcap", "a.mcap"] {
            fs::write(folder.path().join(name), "").unwrap();
        }
        assert_eq!(files(), Ok(inside(&["a.mcap", "b_9.mcap", "b_10.mcap"])));
        for (list, expected) in [
            ("\n    - b_10.mcap\n    - \"b 1.mcap\"\n  duration:\n    - c", inside(&["b_10.mcap", "b 1.mcap"])),
            ("\n  - 'it''s.mcap'\n  - old/b.mcap\n", inside(&["it's.mcap", "b.mcap"])),
            (" [\"x.mcap\", y.mcap]\n", inside(&["x.mcap", "y.mcap"])),
            (" [ # both\n    'x, y.mcap',\n\n    y.mcap ] # of two\n", inside(&["x, y.mcap", "y.mcap"])),
            ("  # in order\n\n    # first\n    - x.mcap # here\n", inside(&["x.mcap"])),
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
            why("  storage_identifier: mine\n")
                .contains("its storage is mine, and mcap and sqlite3 are read here; convert it")
        );
        assert!(
            why("  compression_mode: MESSAGE\n  compression_format: lz5\n").contains("with `lz5`, and zstd is read")
        );
        assert!(
            why("  storage_identifier: mcap\n  compression_mode: FILE\n").contains("each file is compressed by itself")
        );
        assert!(why("  storage_identifier: mcap\n  relative_file_paths: []\n").contains("ros2 bag reindex"));
        assert!(why("").contains("relative_file_paths"));
        // What is not read is refused, and nothing is left out.
        for list in [
            " [..]",
            " [/]",
            " [a.mcap, ..]",
            " [a.mcap",
            " [a.mcap] b",
            " [[a.mcap]]",
            " [{a: b}]",
            " *files",
            " |\n    a.mcap",
            " a.mcap",
            "\n    - &x a.mcap",
            "\n    - [a.mcap]",
            "\n    -\n      a.mcap",
            "\n    - a: b",
            " ['a.mcap]",
            " [\"\\x\"]",
            " []\n  relative_file_paths: [a.mcap]",
            " [a.mcap, a.mcap]",
            "\n    - a.mcap\n    - b/a.mcap",
            " [a.mcap,, b.mcap]",
            " [~]",
            "\n    - a.mcap\n      b.mcap",
            " {}",
        ] {
            let why = why(&format!("  storage_identifier: mcap\n  relative_file_paths:{list}\n  ros_distro: x\n"));
            assert!(why.contains("relative_file_paths") && why.ends_with("ros2 bag reindex BAG"), "{list}: {why}");
        }
        let flow = "{rosbag2_bagfile_information: {storage_identifier: mcap, relative_file_paths: [a.mcap]}}";
        assert!(why(flow).contains("ros2 bag reindex"), "{}", why(flow));
    }

    #[test]
    fn bags_of_other_kinds_say_what_to_do() {
        let folder = tempfile::tempdir().unwrap();
        for (name, bytes, expected) in [
            (
                "a.db3",
                &b"SQLite format 3\0\x10\0\x01\x01"[..],
                "it is a ROS 2 bag in SQLite, which is named ros2-mcap:",
            ),
            ("a.bag", b"#ROSBAG V2.0\nE\0\0\0", "it is a ROS 1 bag, and bags of ROS 2 are read here; convert it"),
            ("a.mcap.zstd", b"\x28\xB5\x2F\xFD\0", "it is compressed as a whole; unpack it"),
            ("a.mcap", b"mine", "this is not an MCAP file"),
        ] {
            let path = folder.path().join(name);
            fs::write(&path, bytes).unwrap();
            for why in [Reader::open(&path).err(), Reader::open_any(&path).err()] {
                let why = why.unwrap().to_string();
                assert!(why.contains(&format!("{name}: {expected}")), "{why}");
            }
        }
    }
}
