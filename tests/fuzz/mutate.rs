//! Damage to an input, by chance that repeats.

/// Numbers that parsers get wrong.
const NUMBERS: &[&str] = &[
    "0",
    "-0",
    "-1",
    "1",
    "2.9",
    "255",
    "256",
    "65535",
    "65536",
    "2147483647",
    "2147483648",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "18446744073709551616",
    "-2147483649",
    "1000000",
    "1e308",
    "1e400",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
    "-inf",
    "NaN",
    "0x10",
    "1_000",
    "1.",
    ".5",
    "+1",
    "",
    " ",
    "1e",
    "99999999999999999999999999",
];

/// Pieces of the formats, and what breaks out of them.
const WORDS: &[&str] = &[
    "\"",
    "'",
    "\\",
    "\n",
    "\r\n",
    "\r",
    "\t",
    ",",
    ";",
    ":",
    "/",
    "..",
    "=",
    "[",
    "]",
    "{",
    "}",
    "<",
    ">",
    "</",
    "/>",
    "<!--",
    "]]>",
    "&#0;",
    "&amp;",
    "%s",
    "%00",
    "\0",
    "\u{1b}[31m",
    "\u{7}",
    "\u{feff}",
    "é",
    "\u{202e}",
    "null",
    "true",
    "false",
    "[[",
    "]]",
    "\"\"\"",
    "0..=4294967295",
    "1000000x1000000",
    "t,",
    "null,",
    "\u{fffd}",
];

/// Whole numbers in binary, as counts and offsets.
const COUNTS: &[u64] = &[
    0,
    1,
    2,
    0x7F,
    0x80,
    0xFF,
    0x100,
    0x7FFF,
    0xFFFF,
    0x10000,
    0x7FFF_FFFF,
    0x8000_0000,
    0xFFFF_FFFF,
    1 << 32,
    u64::MAX >> 1,
    u64::MAX,
];

/// Bytes that an input may have more than the sound one.
const MAX_GROWTH: usize = 1 << 17;

/// SplitMix64, as the library's.
pub(crate) struct Mutator(u64);

impl Mutator {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.next() % count.max(1) as u64) as usize
    }

    /// A part of `bytes`: mostly short.
    fn part(&mut self, bytes: &[u8]) -> std::ops::Range<usize> {
        let from = self.below(bytes.len() + 1);
        let reach = match self.below(4) {
            0 => bytes.len(),
            1 => 256,
            _ => 16,
        };
        from..(from + 1 + self.below(reach)).min(bytes.len())
    }

    /// A line of `bytes`, its end included.
    fn line(&mut self, bytes: &[u8]) -> std::ops::Range<usize> {
        let at = self.below(bytes.len());
        let from = bytes[..at].iter().rposition(|&b| b == b'\n').map_or(0, |end| end + 1);
        let to = bytes[at..].iter().position(|&b| b == b'\n').map_or(bytes.len(), |end| at + end + 1);
        from..to.max(from)
    }

    /// A number written in digits, if there is one behind a place.
    fn digits(&mut self, bytes: &[u8]) -> Option<std::ops::Range<usize>> {
        let is_digit = |b: &u8| b.is_ascii_digit() || *b == b'.' || *b == b'-';
        let at = self.below(bytes.len());
        let from = at + bytes[at..].iter().position(u8::is_ascii_digit)?;
        let from = bytes[..from].iter().rposition(|b| !is_digit(b)).map_or(0, |end| end + 1);
        let to = bytes[from..].iter().position(|b| !is_digit(b)).map_or(bytes.len(), |end| from + end);
        Some(from..to)
    }

    /// `sound` with one to five changes; `others` are inputs to take parts of.
    pub(crate) fn damaged(&mut self, sound: &[u8], others: &[Vec<u8>]) -> Vec<u8> {
        let mut bytes = sound.to_vec();
        let changes = 1 + self.below(5) * self.below(2);
        for _ in 0..changes {
            self.change(&mut bytes, others);
            bytes.truncate(sound.len() + MAX_GROWTH);
        }
        bytes
    }

    fn change(&mut self, bytes: &mut Vec<u8>, others: &[Vec<u8>]) {
        if bytes.is_empty() {
            bytes.push(self.next() as u8);
            return;
        }
        let at = self.below(bytes.len());
        match self.below(15) {
            0 => bytes[at] ^= 1 << self.below(8),
            1 => bytes[at] = self.next() as u8,
            2 => bytes.truncate(at),
            3 => {
                let part = self.part(bytes);
                bytes.drain(part);
            }
            4 => {
                let part = self.part(bytes);
                let copy = bytes[part].to_vec();
                bytes.splice(at..at, copy);
            }
            5 => {
                // Nesting and long lists.
                let part = self.part(bytes);
                let copy = bytes[part.clone()].to_vec();
                let times = [2, 10, 300, 5000][self.below(4)].min(MAX_GROWTH / copy.len().max(1));
                bytes.splice(part.end..part.end, copy.repeat(times));
            }
            6 | 7 => {
                if let Some(digits) = self.digits(bytes) {
                    let number = NUMBERS[self.below(NUMBERS.len())];
                    bytes.splice(digits, number.bytes());
                }
            }
            8 => {
                let word = WORDS[self.below(WORDS.len())];
                let until = if self.below(2) == 0 { at } else { at + 1 };
                bytes.splice(at..until, word.bytes());
            }
            9 => {
                let count = COUNTS[self.below(COUNTS.len())];
                let width = [1, 2, 4, 8][self.below(4)].min(bytes.len() - at);
                bytes[at..at + width].copy_from_slice(&count.to_le_bytes()[..width]);
            }
            10 => {
                let other = &others[self.below(others.len())];
                let part = self.part(other);
                bytes.splice(at..at, other[part].iter().copied());
            }
            11 => {
                let line = self.line(bytes);
                bytes.drain(line);
            }
            12 => {
                let line = self.line(bytes);
                let copy = bytes[line.clone()].to_vec();
                bytes.drain(line);
                let to = self.below(bytes.len() + 1);
                let to = bytes[..to].iter().rposition(|&b| b == b'\n').map_or(0, |end| end + 1);
                bytes.splice(to..to, copy);
            }
            13 => {
                let line = self.line(bytes);
                let copy = bytes[line.clone()].to_vec();
                bytes.splice(line.end..line.end, copy);
            }
            _ => {
                let part = self.part(bytes);
                bytes[part].reverse();
            }
        }
    }
}
