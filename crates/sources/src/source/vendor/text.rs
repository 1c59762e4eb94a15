//! Lines of tables: their separators, numbers and words, as different countries' machines write them.

use std::borrow::Cow;
use std::fmt;

use encoding_rs::WINDOWS_1252;

/// The separator between the cells of a line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Separator {
    /// A comma, a semicolon or a tab. Where it is not a comma, a comma in a number is its decimal point.
    One(u8),
    /// Any number of spaces and tabs.
    #[default]
    Blanks,
}

impl Separator {
    /// The separator of a text that begins with `head`: the one in most of its lines with separators.
    pub(super) fn detect(head: &[u8]) -> Self {
        let lines_with = |mark: u8| head.split(|&byte| byte == b'\n').filter(|line| line.contains(&mark)).count();
        match [b';', b'\t', b','].into_iter().map(|mark| (lines_with(mark), mark)).max_by_key(|(lines, _)| *lines) {
            // A decimal comma is in every line that has a semicolon or a tab.
            Some((lines, b',')) if lines > 0 => {
                match [b';', b'\t'].into_iter().find(|&mark| 2 * lines_with(mark) > lines) {
                    Some(mark) => Self::One(mark),
                    None => Self::One(b','),
                }
            }
            Some((lines, mark)) if lines > 0 => Self::One(mark),
            _ => Self::Blanks,
        }
    }

    /// The cells of `line`, without surrounding blanks.
    pub(super) fn cells(self, line: &[u8]) -> Cells<'_> {
        Cells { rest: Some(line), separator: self }
    }

    fn decimal(self) -> u8 {
        if self == Self::One(b',') { b'.' } else { b',' }
    }
}

/// The cells of a line.
#[derive(Clone)]
pub(super) struct Cells<'a> {
    rest: Option<&'a [u8]>,
    separator: Separator,
}

impl Cells<'_> {
    /// The next cell, if it is a number of at most fifteen digits and a point, read in one pass. `None`, with nothing taken, if
    /// it is anything else.
    #[inline]
    pub(super) fn plain_number(&mut self) -> Option<f64> {
        let rest = self.rest?;
        let ends = |byte: u8| match self.separator {
            Separator::One(mark) => byte == mark,
            Separator::Blanks => byte == b' ' || byte == b'\t',
        };
        let blanks = rest.iter().take_while(|&&byte| byte == b' ').count();
        let (mut whole, mut digits, mut point) = (0_u64, 0_usize, None);
        let is_negative = rest.get(blanks) == Some(&b'-');
        let mut at = blanks + usize::from(is_negative);
        let decimal = self.separator.decimal();
        while let Some(&byte) = rest.get(at) {
            let digit = byte.wrapping_sub(b'0');
            if digit < 10 {
                // What overflows has too many digits.
                whole = whole.wrapping_mul(10).wrapping_add(u64::from(digit));
                digits += 1;
            } else if (byte == b'.' || byte == decimal) && point.is_none() {
                point = Some(digits);
            } else if ends(byte) {
                break;
            } else {
                return None;
            }
            at += 1;
        }
        if !(1..=15).contains(&digits) {
            return None;
        }
        self.rest = rest.get(at + 1..);
        let value = match point {
            None => whole as f64,
            Some(point) => whole as f64 / TENS[digits - point],
        };
        Some(if is_negative { -value } else { value })
    }
}

impl<'a> Cells<'a> {
    /// The next cell that is not empty.
    pub(super) fn next_filled(&mut self) -> Option<Word<'a>> {
        let is_blank = |byte: &u8| matches!(byte, b' ' | b'\t') || self.separator == Separator::One(*byte);
        // What many programs put after the last cell.
        if self.rest?.iter().all(is_blank) { None } else { self.find(|word| !word.is_empty()) }
    }
}

impl<'a> Iterator for Cells<'a> {
    type Item = Word<'a>;

    #[inline]
    fn next(&mut self) -> Option<Word<'a>> {
        let mut rest = self.rest?;
        let end = match self.separator {
            Separator::One(mark) => end_of_cell(rest, mark),
            Separator::Blanks => {
                rest = rest.trim_ascii_start();
                if rest.is_empty() {
                    self.rest = None;
                    return None;
                }
                rest.iter().position(u8::is_ascii_whitespace)
            }
        };
        let (cell, rest) = match end {
            Some(end) => (&rest[..end], Some(&rest[end + 1..])),
            None => (rest, None),
        };
        self.rest = rest;
        Some(match cell.trim_ascii() {
            // A comma within quotation marks does not separate.
            [b'"', inner @ .., b'"'] => Word { bytes: inner.trim_ascii(), decimal: b',' },
            bare => Word { bytes: bare, decimal: self.separator.decimal() },
        })
    }
}

/// Where the first cell of `rest` ends, if others follow: at the first `mark` that is not within quotation marks.
#[inline]
fn end_of_cell(rest: &[u8], mark: u8) -> Option<usize> {
    let at = rest.iter().position(|&byte| byte == mark)?;
    let blanks = rest.iter().take_while(|&&byte| byte == b' ').count();
    if rest.get(blanks) != Some(&b'"') {
        return Some(at);
    }
    match rest[blanks + 1..].iter().position(|&byte| byte == b'"') {
        Some(closing) => {
            let after = blanks + 1 + closing;
            rest[after..].iter().position(|&byte| byte == mark).map(|at| after + at)
        }
        None => Some(at),
    }
}

/// One cell.
#[derive(Clone, Copy)]
pub(super) struct Word<'a> {
    bytes: &'a [u8],
    /// What may stand for the decimal point beside the point itself.
    decimal: u8,
}

impl<'a> Word<'a> {
    pub(super) fn is_empty(self) -> bool {
        self.bytes.is_empty()
    }

    pub(super) fn is(self, word: &str) -> bool {
        self.bytes.eq_ignore_ascii_case(word.as_bytes())
    }

    /// What follows `start`, in whatever case.
    pub(super) fn after(self, start: &str) -> Option<Cow<'a, str>> {
        let (head, rest) = self.bytes.split_at_checked(start.len())?;
        head.eq_ignore_ascii_case(start.as_bytes()).then(|| decoded(rest.trim_ascii()))
    }

    pub(super) fn text(self) -> Cow<'a, str> {
        decoded(self.bytes)
    }

    /// Its number; `nan` and `inf` in any case are numbers too.
    #[inline]
    pub(super) fn number(self) -> Option<f64> {
        number(self.bytes, self.decimal)
    }

    pub(super) fn whole(self) -> Option<u32> {
        std::str::from_utf8(self.bytes).ok()?.parse().ok()
    }
}

impl fmt::Display for Word<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&shortened(&self.text()))
    }
}

/// As much of `text` as fits in a message.
pub(super) fn shortened(text: &str) -> String {
    let short: String = text.chars().take(40).flat_map(char::escape_debug).collect();
    if text.chars().nth(40).is_some() { short + "…" } else { short }
}

/// Bytes that are UTF-8, or else of the Windows machines that such systems run on.
pub(super) fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => WINDOWS_1252.decode_without_bom_handling(bytes).0,
    }
}

/// Powers of ten that are exact in double precision, as far as a number of fifteen digits needs them.
const TENS: [f64; 16] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

/// The number in `word`, where `decimal` may stand for the point. Up to fifteen digits are a whole number over a power of ten,
/// both exact, so that one division rounds as the general parser does.
#[inline]
fn number(word: &[u8], decimal: u8) -> Option<f64> {
    let (negative, digits) = match word {
        [b'-', digits @ ..] => (true, digits),
        digits => (false, digits),
    };
    if (1..=16).contains(&digits.len()) {
        let (mut whole, mut count, mut point) = (0_u64, 0, None);
        for &byte in digits {
            let digit = byte.wrapping_sub(b'0');
            if digit < 10 {
                whole = whole * 10 + u64::from(digit);
                count += 1;
            } else if (byte == b'.' || byte == decimal) && point.is_none() {
                point = Some(count);
            } else {
                return in_general(word, decimal);
            }
        }
        if (1..=15).contains(&count) {
            let value = whole as f64 / TENS[point.map_or(0, |point| count - point)];
            return Some(if negative { -value } else { value });
        }
    }
    in_general(word, decimal)
}

#[cold]
fn in_general(word: &[u8], decimal: u8) -> Option<f64> {
    let text = std::str::from_utf8(word).ok()?;
    if text.contains(char::from(decimal)) && decimal != b'.' {
        return text.replacen(char::from(decimal), ".", 1).parse().ok();
    }
    text.parse().ok()
}

/// The first number in `text` and what follows it: `0.127 centimeters`.
pub(super) fn leading_number(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    let end = text.find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | ',' | '-' | '+'))).unwrap_or(text.len());
    let number = number(&text.as_bytes()[..end], b',')?;
    number.is_finite().then(|| (number, text[end..].trim()))
}

/// The metres to one of the unit of length at the start of `text`.
pub(super) fn metres(text: &str) -> Option<f64> {
    let word: String = text.trim().chars().take_while(char::is_ascii_alphabetic).collect();
    Some(match word.to_ascii_lowercase().as_str() {
        "m" | "meter" | "meters" | "metre" | "metres" => 1.0,
        "cm" | "centimeter" | "centimeters" | "centimetre" | "centimetres" => 1e-2,
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => 1e-3,
        "in" | "inch" | "inches" => 0.0254,
        _ => return None,
    })
}

/// The content of the first pair of parentheses.
pub(super) fn in_parentheses(text: &str) -> Option<&str> {
    let (_, after) = text.split_once('(')?;
    Some(after.split_once(')')?.0)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn words(separator: Separator, line: &str) -> Vec<String> {
        separator.cells(line.as_bytes()).map(|word| word.to_string()).collect()
    }

    #[test]
    fn cells_stand_between_separators() {
        assert_eq!(words(Separator::One(b','), "a, b ,,\"c\""), ["a", "b", "", "c"]);
        assert_eq!(words(Separator::Blanks, "  a\t b  "), ["a", "b"]);
        assert_eq!(words(Separator::One(b','), "\"a, b\", \"c\",\"d"), ["a, b", "c", "\"d"]);
        assert_eq!(words(Separator::One(b';'), "\"\";\"a;b\"x;c"), ["", "\"a;b\"x", "c"]);
        assert_eq!(words(Separator::Blanks, "   "), [""; 0]);
        assert_eq!(words(Separator::One(b';'), ""), [""]);
    }

    #[test]
    fn what_stands_after_separators_alone_is_seen() {
        let after_one = |line: &'static str| {
            let mut cells = Separator::One(b',').cells(line.as_bytes());
            cells.next();
            cells.next_filled().map(|word| word.to_string())
        };
        assert_eq!([after_one("1"), after_one("1, ,,"), after_one("1,,\"\",")], [const { None }; 3]);
        assert_eq!(after_one("1,, x,2"), Some("x".to_owned()));
        assert_eq!(Separator::Blanks.cells(b" \t ").next_filled().map(|word| word.to_string()), None);
    }

    #[test]
    fn a_separator_is_what_most_lines_have() {
        assert_eq!(Separator::detect(b"File:,a\n1,2\n3,4\n"), Separator::One(b','));
        assert_eq!(Separator::detect(b"File:;a\n1,5;2,5\n3;4\n"), Separator::One(b';'));
        assert_eq!(Separator::detect(b"a\tb\n1,5\t2,5\n"), Separator::One(b'\t'));
        assert_eq!(Separator::detect(b"left insole: 1,2\n  0.1 0.2\n 0.3  0.4\n"), Separator::One(b','));
        assert_eq!(Separator::detect(b"  0.1 0.2\n"), Separator::Blanks);
    }

    #[test]
    fn a_decimal_comma_is_one_where_commas_do_not_separate() {
        let number = |separator: Separator, line: &'static str| separator.cells(line.as_bytes()).next()?.number();
        assert_eq!(number(Separator::One(b';'), "1,5;"), Some(1.5));
        assert_eq!(number(Separator::Blanks, " 1,5 "), Some(1.5));
        assert_eq!(number(Separator::One(b','), "1,5"), Some(1.0));
        assert_eq!(number(Separator::One(b','), "\"1,5\",\"2,5\""), Some(1.5));
        assert_eq!(number(Separator::One(b';'), "1.234,5"), None, "which of them separates thousands is unknown");
        assert!(number(Separator::Blanks, "NaN").unwrap().is_nan());
    }

    #[test]
    fn sizes_have_units() {
        assert_eq!(leading_number("0.127 centimeters"), Some((0.127, "centimeters")));
        assert_eq!(leading_number("0,5x0,5 cm"), Some((0.5, "x0,5 cm")));
        assert_eq!((metres("centimeters"), metres("mm)"), metres("furlong")), (Some(0.01), Some(1e-3), None));
        assert_eq!(in_parentheses("Sensel Width (cm)"), Some("cm"));
        assert_eq!(decoded(b"cm\xB2"), "cm²");
    }

    proptest! {
        #[test]
        fn a_plain_number_is_what_the_cell_has(text in "[-+ 0-9.,;xe\"]{0,24}", mark in 0..4_usize) {
            let separator = [Separator::One(b','), Separator::One(b';'), Separator::One(b'\t'), Separator::Blanks][mark];
            let (mut fast, mut slow) = (separator.cells(text.as_bytes()), separator.cells(text.as_bytes()));
            // As many cells as there are, and in each the same number, whichever way it is read.
            for _ in 0..30 {
                let (plain, word) = (fast.plain_number(), slow.next());
                if let Some(plain) = plain {
                    prop_assert_eq!(word.and_then(Word::number).map(f64::to_bits), Some(plain.to_bits()), "{}", text);
                } else {
                    prop_assert_eq!(fast.next().map(|word| word.bytes), word.map(|word| word.bytes), "{}", text);
                }
            }
        }

        #[test]
        fn numbers_are_as_the_general_parser_has_them(text in "-?[0-9]{0,9}[.]?[0-9]{0,9}") {
            let right = text.parse::<f64>().ok();
            prop_assert_eq!(number(text.as_bytes(), b'.').map(f64::to_bits), right.map(f64::to_bits), "{}", text);
            let comma = text.replace('.', ",");
            prop_assert_eq!(number(comma.as_bytes(), b',').map(f64::to_bits), right.map(f64::to_bits), "{}", comma);
        }
    }
}
