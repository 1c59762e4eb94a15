//! Lines out of bytes, however these are cut.

/// The longest line, in bytes: sixty thousand values.
pub(super) const MAX_LIVE_LINE_BYTES: usize = 1 << 20;

/// A line that has ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Line<'a> {
    Text(&'a str),
    /// It is not UTF-8.
    Garbled,
    /// It is too long, and its bytes are gone.
    Long,
}

/// Puts lines together; they end with a line feed, a carriage return, or both.
#[derive(Debug, Default)]
pub(super) struct Splitter {
    part: Vec<u8>,
    is_long: bool,
    after_return: bool,
}

impl Splitter {
    /// Gives every line that ends in `bytes` to `each`.
    pub(super) fn push(&mut self, mut bytes: &[u8], each: &mut dyn FnMut(Line<'_>)) {
        while !bytes.is_empty() {
            if std::mem::replace(&mut self.after_return, false) && bytes[0] == b'\n' {
                bytes = &bytes[1..];
                continue;
            }
            let Some(end) = bytes.iter().position(|byte| matches!(byte, b'\n' | b'\r')) else {
                self.keep(bytes);
                return;
            };
            self.after_return = bytes[end] == b'\r';
            if self.part.is_empty() && !self.is_long && end <= MAX_LIVE_LINE_BYTES {
                each(line(&bytes[..end]));
            } else {
                self.keep(&bytes[..end]);
                self.flush(each);
            }
            bytes = &bytes[end + 1..];
        }
    }

    fn keep(&mut self, bytes: &[u8]) {
        if self.is_long || self.part.len() + bytes.len() > MAX_LIVE_LINE_BYTES {
            self.is_long = true;
            self.part.clear();
        } else {
            self.part.extend_from_slice(bytes);
        }
    }

    /// Gives what has come of a line to `each`, as if it had ended.
    pub(super) fn flush(&mut self, each: &mut dyn FnMut(Line<'_>)) {
        if std::mem::take(&mut self.is_long) {
            each(Line::Long);
        } else if !self.part.is_empty() {
            let part = std::mem::take(&mut self.part);
            each(line(&part));
            self.part = part;
            self.part.clear();
        }
    }

    /// Forgets what has come of a line. Whether anything had.
    pub(super) fn clear(&mut self) -> bool {
        let had = self.is_long || !self.part.is_empty();
        *self = Self::default();
        had
    }
}

fn line(bytes: &[u8]) -> Line<'_> {
    match std::str::from_utf8(bytes) {
        // Boards that are switched on send zeros.
        Ok(text) => Line::Text(text.trim_matches(|c: char| c.is_whitespace() || c == '\0' || c == '\u{feff}')),
        Err(_) => Line::Garbled,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(pieces: &[&[u8]]) -> Vec<String> {
        let (mut splitter, mut lines) = (Splitter::default(), Vec::new());
        let mut each = |line: Line<'_>| {
            lines.push(if let Line::Text(text) = line { text.to_owned() } else { format!("{line:?}") });
        };
        pieces.iter().for_each(|piece| splitter.push(piece, &mut each));
        splitter.flush(&mut each);
        lines
    }

    #[test]
    fn lines_are_the_same_however_their_bytes_come() {
        let text = b"1,2\r\n\r\n3 \n\n4\r5\n6";
        let wanted = ["1,2", "", "3", "", "4", "5", "6"];
        assert_eq!(lines(&[text]), wanted);
        for cut in 1..text.len() {
            assert_eq!(lines(&[&text[..cut], &text[cut..]]), wanted, "{cut}");
        }
        let bytes: Vec<&[u8]> = text.chunks(1).collect();
        assert_eq!(lines(&bytes), wanted);
    }

    #[test]
    fn what_is_no_text_and_what_has_no_end_is_found_out() {
        assert_eq!(lines(&[b"\xff\xfe1\n2\n"]), ["Garbled", "2"]);
        let long = vec![b'1'; MAX_LIVE_LINE_BYTES];
        assert_eq!(lines(&[&long, b"1\n2\n"]), ["Long", "2"]);
        assert_eq!(lines(&[&long, b"\n2\n"])[1], "2");
    }
}
