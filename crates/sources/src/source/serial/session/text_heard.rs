//! Whether a board sends text, which another source reads.

/// Bytes that are kept to tell.
const SAMPLE_BYTES: usize = 512;

/// What was heard of a line, and the first whole line of text with numbers in it.
#[derive(Debug, Default)]
pub(super) struct TextHeard {
    sample: Vec<u8>,
    baud: u32,
    line: Option<String>,
}

impl TextHeard {
    /// Takes `bytes`, which came at `baud`.
    pub(super) fn hear(&mut self, bytes: &[u8], baud: u32) {
        if self.line.is_some() {
            return;
        }
        if baud != self.baud {
            (self.baud, self.sample) = (baud, Vec::new());
        }
        self.sample.extend_from_slice(bytes);
        let is_text = |byte: &u8| byte.is_ascii_graphic() || byte.is_ascii_whitespace();
        let text = self.sample.iter().filter(|byte| is_text(byte)).count();
        if 10 * text >= 9 * self.sample.len() {
            // What is before the first line end may be torn.
            let mut ended = self.sample.split(|byte| *byte == b'\n').skip(1);
            let lines = self.sample.iter().filter(|byte| **byte == b'\n').count().saturating_sub(1);
            let is_good = |line: &&[u8]| line.iter().all(is_text) && line.iter().any(u8::is_ascii_digit);
            let line = ended.by_ref().take(lines).find(is_good);
            self.line = line.map(|line| String::from_utf8_lossy(line.trim_ascii()).chars().take(40).collect());
        }
        if self.sample.len() > SAMPLE_BYTES {
            self.sample.drain(..self.sample.len() - SAMPLE_BYTES);
        }
    }

    pub(super) fn is_heard(&self) -> bool {
        self.line.is_some()
    }

    /// What is to be said of text on the line `port`, if it is.
    pub(super) fn words(&self, port: &str) -> Option<String> {
        let line = self.line.as_ref()?;
        Some(format!("this board sends text, such as `{line}`: use text:{port}@{}", self.baud))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_heard_and_packets_are_not() {
        let mut heard = TextHeard::default();
        heard.hear(b"2,300,7\r\n512,30", 9600);
        assert!(!heard.is_heard());
        heard.hear(b"0,7\r\n5", 9600);
        let what = "this board sends text, such as `512,300,7`: use text:/dev/ttyUSB0@9600";
        assert_eq!(heard.words("/dev/ttyUSB0").as_deref(), Some(what));
        let mut other = TextHeard::default();
        (0..9).for_each(|_| other.hear(b"\x05\x81\n\xf0\x0112\n\x90\x00", 57_600));
        assert_eq!(other.words("a"), None);
        // At another speed it is another line.
        other.hear(b"1\n", 9600);
        other.hear(b"1\n2", 115_200);
        assert!(!other.is_heard());
    }
}
