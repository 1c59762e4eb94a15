//! What a file of a bag has, whatever its storage is.

/// What a file of SQLite begins with.
pub(super) const SQLITE: &[u8] = b"SQLite format 3\0";
/// What zstd begins with; no message in CDR does.
pub(super) const ZSTD: &[u8] = &[0x28, 0xB5, 0x2F, 0xFD];

/// A topic of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct StoredTopic {
    pub(super) name: String,
    /// The type of its messages, as ROS 2 spells it.
    pub(super) kind: String,
    pub(super) encoding: String,
}

/// A message of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct StoredMessage {
    /// The number of its topic in the file.
    pub(super) topic: i64,
    /// When it came, by the recorder's clock, ns.
    pub(super) log_ns: u64,
}

/// A type as ROS 2 spells it; ROS 1 has no `msg` in it.
pub(super) fn whole(kind: &str) -> String {
    match kind.split('/').count() {
        2 => kind.replacen('/', "/msg/", 1),
        _ => kind.to_owned(),
    }
}
