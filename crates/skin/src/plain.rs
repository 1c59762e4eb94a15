//! Text for people, without what a terminal would obey.
//!
//! Names of links, fields and files, keys of TOML and JSON, answers of boards: all of it comes from elsewhere, and may hold
//! sequences that set a terminal's title, write into its clipboard, or turn the direction of what follows. So all that is
//! printed goes through here. What is escaped is written as in JSON, `\u001b`: JSON that is printed stays the same JSON.

use std::borrow::Cow;
use std::fmt::Write as _;
use std::io::{self, Write as _};

/// Whether a terminal, or who reads it, takes `c` for something else than a letter, or does not see it.
fn is_hidden(c: char) -> bool {
    let turns = matches!(c, '\u{61C}' | '\u{200E}' | '\u{200F}' | '\u{202A}'..='\u{202E}' | '\u{2066}'..='\u{2069}');
    c.is_control() || turns || matches!(c, '\u{2028}' | '\u{2029}' | '\u{FEFF}' | '\u{FFF9}'..='\u{FFFB}')
}

/// The same in text of several lines, which may have columns.
fn is_hidden_in_text(c: char) -> bool {
    !matches!(c, '\n' | '\t') && is_hidden(c)
}

/// `text` on one line: control characters, line ends too, and marks that turn its direction are escaped.
#[must_use]
pub fn line(text: &str) -> Cow<'_, str> {
    escape(text, is_hidden, |_| None)
}

/// As [`line()`], but for line ends and tabs, which stay.
#[must_use]
pub fn lines(text: &str) -> Cow<'_, str> {
    escape(text, is_hidden_in_text, |_| None)
}

/// As [`line()`], but for `\x1b[…m` with the colours and weights of a command's own text, which stay.
#[must_use]
pub fn coloured_line(text: &str) -> Cow<'_, str> {
    escape(text, is_hidden, colour)
}

/// As [`coloured_line`], but for line ends and tabs, which stay.
#[must_use]
pub fn coloured_lines(text: &str) -> Cow<'_, str> {
    escape(text, is_hidden_in_text, colour)
}

/// A time in seconds in few digits: to a microsecond, and in powers of ten where it is huge.
#[must_use]
pub fn seconds(t_s: f64) -> String {
    let rounded = (t_s * 1e6).round() / 1e6;
    if rounded.abs() < 1e15 { rounded.to_string() } else { format!("{t_s:e}") }
}

/// `text` without the colours that [`coloured_line`] keeps.
#[must_use]
pub fn without_colours(text: &str) -> String {
    let (mut left, mut rest) = (String::new(), text);
    while let Some(at) = rest.find('\x1b') {
        let length = colour(&rest[at..]);
        left += &rest[..at + usize::from(length.is_none())];
        rest = &rest[at + length.unwrap_or(1)..];
    }
    left + rest
}

/// Without what XML 1.0 cannot hold in any way: such characters are escaped as in [`line()`].
#[must_use]
pub fn xml(text: &str) -> Cow<'_, str> {
    escape(text, |c| !is_xml(c), |_| None)
}

/// Whether XML 1.0 can hold `c`.
#[must_use]
pub fn is_xml(c: char) -> bool {
    matches!(c, '\t' | '\n' | '\r' | ' '..='\u{D7FF}' | '\u{E000}'..='\u{FFFD}' | '\u{10000}'..)
}

/// Says `text` on standard error, as a line of this program. A closed standard error is not a reason to stop.
pub fn say(text: &str) {
    let _ = writeln!(io::stderr(), "somatic: {}", line(text));
}

/// Writes `text` of some lines to standard error. A closed standard error is not a reason to stop.
pub fn announce(text: &str) {
    let _ = io::stderr().write_all(lines(text).as_bytes());
}

/// The length of the colour sequence that `text` begins with: those that neither hide text nor reach beyond it.
fn colour(text: &str) -> Option<usize> {
    const KNOWN: [&str; 13] = ["", "0", "1", "2", "3", "4", "22", "31", "32", "33", "34", "35", "36"];
    let rest = text.strip_prefix("\x1b[")?;
    let end = rest.find('m')?;
    rest[..end].split(';').all(|code| KNOWN.contains(&code)).then_some(2 + end + 1)
}

/// `text` with what `is_wrong` escaped, but for what `keeps` gives the length of.
fn escape(text: &str, is_wrong: impl Fn(char) -> bool, keeps: impl Fn(&str) -> Option<usize>) -> Cow<'_, str> {
    let Some(first) = text.find(&is_wrong) else { return Cow::Borrowed(text) };
    let (before, mut rest) = text.split_at(first);
    let mut escaped = before.to_owned();
    while let Some(c) = rest.chars().next() {
        let length = keeps(rest);
        let (now, after) = rest.split_at(length.unwrap_or(c.len_utf8()));
        match c {
            _ if length.is_some() || !is_wrong(c) => escaped += now,
            '\n' => escaped += "\\n",
            '\r' => escaped += "\\r",
            '\t' => escaped += "\\t",
            c => {
                // All of them have four digits.
                let _ = write!(escaped, "\\u{:04x}", u32::from(c));
            }
        }
        rest = after;
    }
    Cow::Owned(escaped)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_short() {
        let told = [0.0, 3.760_000_000_000_000_2, -1.5, 1_764_453_600.25, 1e300, f64::INFINITY].map(seconds);
        assert_eq!(told, ["0", "3.76", "-1.5", "1764453600.25", "1e300", "inf"]);
    }

    #[test]
    fn what_a_terminal_obeys_is_escaped_and_all_else_stays() {
        let title = "\x1b]0;P\x07";
        assert_eq!(line(title), "\\u001b]0;P\\u0007");
        assert_eq!(line("a\0b\x7F\u{9B}31m"), "a\\u0000b\\u007f\\u009b31m");
        assert_eq!(line("one\ntwo\r\t"), "one\\ntwo\\r\\t");
        assert_eq!(line("\u{202E}txt.exe\u{2066}\u{2028}"), "\\u202etxt.exe\\u2066\\u2028");
        let plain = "hand/Zeigefinger „ü“ 掌 👋🏽 a\\b";
        assert!(matches!(line(plain), Cow::Borrowed(same) if same == plain));
        assert_eq!(lines("a\nb\r"), "a\nb\\r");
    }

    #[test]
    fn colours_stay_where_they_are_asked_for() {
        let text = "\x1b[1mbold\x1b[0m \x1b[31;1mred\x1b[0m";
        assert_eq!(coloured_line(text), text);
        assert_eq!(line(text).matches('\x1b').count(), 0);
        assert_eq!(without_colours(&format!("{text}\x1b[2J")), "bold red\x1b[2J");
        for hostile in ["\x1b[8mhidden", "\x1b[2J", "\x1b]52;c;aGk=\x07", "\x1b[", "\x1b[1", "\x1bc", "\x1b[30;40m"] {
            assert!(!coloured_lines(hostile).contains('\x1b'), "{hostile:?}");
        }
    }

    #[test]
    fn json_that_is_printed_stays_the_same_json() {
        let value = serde_json::json!({"a\u{9B}\x1b\u{202E}\n": "\u{2028}\0 \\u"});
        for text in [value.to_string(), format!("{value:#}\n")] {
            let printed = lines(&text);
            assert!(!printed.contains(['\u{9B}', '\u{202E}']), "{printed}");
            assert_eq!(serde_json::from_str::<serde_json::Value>(&printed).unwrap(), value);
        }
    }

    #[test]
    fn xml_holds_what_it_can() {
        assert_eq!(xml("a\0\x1b\u{9B}\n\u{FFFE}"), "a\\u0000\\u001b\u{9B}\n\\ufffe");
    }
}
