//! The cells of a CSV: their blanks, quotes and numbers.

/// Parses a number; `nan`, `inf` and `-inf` in any case are accepted.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// `cell` without surrounding blanks and a pair of quotes.
pub(super) fn trimmed(cell: &[u8]) -> &[u8] {
    match cell.trim_ascii() {
        [b'"', inner @ .., b'"'] => inner.trim_ascii(),
        bare => bare,
    }
}

/// As much of `word` as fits in a message.
pub(super) fn shortened(word: &str) -> String {
    let short: String = word.chars().take(40).flat_map(char::escape_debug).collect();
    let mut short = short.replace("\\\"", "\"");
    if word.chars().nth(40).is_some() {
        short.push('…');
    }
    short
}
