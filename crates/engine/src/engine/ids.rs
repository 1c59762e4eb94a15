//! Ids in words.

/// Ascending ids in few words: `0–35, 64–103`.
pub(super) fn ranges(ids: &[u32]) -> String {
    let mut words: Vec<String> = Vec::new();
    let mut start = 0;
    for end in 1..=ids.len() {
        if end == ids.len() || ids[end] != ids[end - 1] + 1 {
            let (first, last) = (ids[start], ids[end - 1]);
            words.push(if first == last { first.to_string() } else { format!("{first}–{last}") });
            start = end;
        }
    }
    if words.len() > 6 {
        words.truncate(5);
        words.push("…".into());
    }
    words.join(", ")
}
