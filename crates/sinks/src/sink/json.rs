//! Pieces of a line of JSON.

use serde::Serialize;

/// Appends `,"name":`.
pub(super) fn key(line: &mut Vec<u8>, name: &str) {
    line.extend_from_slice(b",\"");
    line.extend_from_slice(name.as_bytes());
    line.extend_from_slice(b"\":");
}

/// Appends a value; numbers have the fewest digits that read back to the same bits.
pub(super) fn print(line: &mut Vec<u8>, value: &impl Serialize) {
    serde_json::to_writer(line, value).expect("plain data prints into memory");
}
