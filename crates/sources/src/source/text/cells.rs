//! The cells of a line, in each of the ways that boards write them.

use serde_json::Value;

use super::super::csv_cells::trimmed;
use super::super::map::{ArrayPath, Decoder};

/// A cell of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Cell<'a> {
    Number(f64),
    Blank,
    Word(&'a str),
}

/// What is between the cells of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    /// One character; nothing between two of them is a missing value.
    One(char),
    /// The same, and numbers have a decimal comma.
    OneWithComma(char),
    /// Any of commas, semicolons, tabs, bars and spaces, as many as there are.
    Any,
}

/// What may be between cells, but spaces.
pub(super) const MARKS: [char; 4] = [';', ',', '\t', '|'];

/// The number that `word` is; `nan` and `inf` are numbers.
pub(super) fn number(word: &str) -> Option<f64> {
    // Most values are short counts, for which the general parser is slow.
    if (1..=7).contains(&word.len())
        && let Some(count) = word
            .bytes()
            .try_fold(0_u32, |count, byte| byte.is_ascii_digit().then(|| count * 10 + u32::from(byte - b'0')))
    {
        return Some(f64::from(count));
    }
    word.parse().ok()
}

impl Separator {
    /// The cells of `line`, into `cells`. One blank cell at the end stands for a separator at the end.
    pub(super) fn split<'a>(self, line: &'a str, cells: &mut Vec<Cell<'a>>) {
        cells.clear();
        let line = line.trim_matches(['[', ']', '(', ')', '{', '}', '<', '>', ' ', '\t'].as_slice());
        match self {
            // Blanks at the ends may be separators.
            Self::One(mark) => cells.extend(line.split(mark).map(|word| cell(word, false))),
            Self::OneWithComma(mark) => cells.extend(line.split(mark).map(|word| cell(word, true))),
            Self::Any => {
                let is_between = |c: char| c == ' ' || MARKS.contains(&c);
                cells.extend(line.split(is_between).filter(|word| !word.is_empty()).map(|word| cell(word, false)));
            }
        }
    }
}

fn cell(word: &str, has_comma: bool) -> Cell<'_> {
    let word = word.trim();
    let bare = std::str::from_utf8(trimmed(word.as_bytes())).unwrap_or(word);
    if bare.is_empty() {
        return Cell::Blank;
    }
    let found = match has_comma && bare.contains(',') {
        true => number(&bare.replacen(',', ".", 1)),
        false => number(bare),
    };
    found.map_or(Cell::Word(bare), Cell::Number)
}

/// Cells without the blank one at the end.
pub(super) fn count(cells: &[Cell<'_>]) -> usize {
    cells.len() - usize::from(cells.len() > 1 && cells.last() == Some(&Cell::Blank))
}

/// The pairs of a line such as `A0: 512, A1: 300` or `left=3 right=4`; `false` if it is anything else, as a message that ends in a colon.
pub(super) fn pairs<'a>(line: &'a str, each: &mut dyn FnMut(&'a str, Cell<'a>)) -> bool {
    let mut has_number = false;
    let each = &mut |name, cell| {
        has_number |= matches!(cell, Cell::Number(_));
        each(name, cell);
    };
    for piece in line.split([',', ';', '\t', '|']).map(str::trim).filter(|piece| !piece.is_empty()) {
        let signs = piece.matches([':', '=']).count();
        let is_good = match signs {
            0 => false,
            1 => {
                let (name, value) = piece.split_once([':', '=']).unwrap_or_default();
                // `A0: 512 A1 300` is anything else; `A0: 512 mV` is one pair.
                let mut words = value.split_whitespace();
                let (first, rest) = (words.next().unwrap_or_default(), words.next());
                let is_unit =
                    rest.is_none_or(|unit| unit.chars().all(|c| !c.is_ascii_digit()) && words.next().is_none());
                pair(name, first, each) && is_unit
            }
            _ => spaced_pairs(piece, each),
        };
        if !is_good {
            return false;
        }
    }
    has_number
}

/// Pairs with nothing but spaces between them.
fn spaced_pairs<'a>(piece: &'a str, each: &mut dyn FnMut(&'a str, Cell<'a>)) -> bool {
    let mut name: Option<&str> = None;
    let mut sign = false;
    for word in piece.split_whitespace() {
        let is_sign = matches!(word, ":" | "=");
        match (name, word.split_once([':', '='])) {
            (Some(_), _) if is_sign && !sign => sign = true,
            (Some(known), None) if sign => {
                if !pair(known, word, each) {
                    return false;
                }
                (name, sign) = (None, false);
            }
            (None, Some((known, ""))) if !is_sign => (name, sign) = (Some(known), true),
            (None, Some((known, value))) => {
                if !pair(known, value, each) {
                    return false;
                }
            }
            (None, None) => name = Some(word),
            _ => return false,
        }
    }
    name.is_none()
}

fn pair<'a>(name: &'a str, value: &'a str, each: &mut dyn FnMut(&'a str, Cell<'a>)) -> bool {
    let name = std::str::from_utf8(trimmed(name.as_bytes())).unwrap_or(name);
    let value = cell(value, false);
    if name.is_empty() || !name.contains(|c: char| c.is_alphanumeric()) || matches!(value, Cell::Word(_)) {
        return false;
    }
    each(name, value);
    true
}

/// Whether `line` may be JSON.
pub(super) fn may_be_json(line: &str) -> bool {
    line.starts_with(['{', '['])
}

/// How texts at some paths of JSON are numbers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Decoded {
    pub(super) decoder: Decoder,
    pub(super) paths: Vec<ArrayPath>,
}

impl Decoded {
    /// The numbers in `word`, which is at `path`, as `path[0]` and so on; `false` where it has none.
    fn give(&self, word: &str, path: &str, each: &mut dyn FnMut(&str, Cell<'_>)) -> bool {
        let mut numbers = Vec::new();
        if !self.paths.iter().any(|own| own.leads_to(path))
            || self.decoder.text(word, |number| numbers.push(number)).is_err()
        {
            return false;
        }
        for (index, number) in numbers.into_iter().enumerate() {
            each(&format!("{path}[{index}]"), Cell::Number(number));
        }
        true
    }
}

/// The numbers within `line`, a line of JSON, each with its path such as `values.4` or `rows[0][3]`, also those in texts that are
/// `decoded`. Words that are not numbers are given too; what is true or false is left out.
///
/// # Errors
/// It is not JSON.
pub(super) fn json(
    line: &str,
    decoded: Option<&Decoded>,
    each: &mut dyn FnMut(&str, Cell<'_>),
) -> Result<(), serde_json::Error> {
    let value: Value = serde_json::from_str(line)?;
    let mut path = String::new();
    walk(&value, &mut path, decoded, each);
    Ok(())
}

fn walk(value: &Value, path: &mut String, decoded: Option<&Decoded>, each: &mut dyn FnMut(&str, Cell<'_>)) {
    use std::fmt::Write as _;
    let length = path.len();
    match value {
        Value::Null => each(path, Cell::Blank),
        Value::Bool(_) => {}
        Value::Number(number) => each(path, number.as_f64().map_or(Cell::Blank, Cell::Number)),
        Value::String(word) if decoded.is_some_and(|decoded| decoded.give(word, path, each)) => {}
        Value::String(word) => each(path, cell(word, false)),
        Value::Array(values) => {
            for (index, value) in values.iter().enumerate() {
                // Writing to a string does not fail.
                let _ = write!(path, "[{index}]");
                walk(value, path, decoded, each);
                path.truncate(length);
            }
        }
        Value::Object(fields) => {
            for (key, value) in fields {
                if length > 0 {
                    path.push('.');
                }
                path.push_str(key);
                walk(value, path, decoded, each);
                path.truncate(length);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(separator: Separator, line: &str) -> Vec<Cell<'_>> {
        let mut cells = Vec::new();
        separator.split(line, &mut cells);
        cells
    }

    #[test]
    fn a_line_is_split_at_whatever_is_between_its_numbers() {
        use Cell::{Blank, Number, Word};
        let all = [Number(512.0), Number(-3.5), Number(7.0)];
        for line in ["512,-3.5,7", "512; -3.5;7", "512 -3.5   7", "512\t-3.5\t7", "[512, -3.5, 7]", "512 | -3.5 | 7"] {
            assert_eq!(cells(Separator::Any, line), all, "{line}");
        }
        assert_eq!(cells(Separator::One(','), "1,,x,\"4\","), [Number(1.0), Blank, Word("x"), Number(4.0), Blank]);
        assert_eq!(cells(Separator::OneWithComma(';'), "1,5;2"), [Number(1.5), Number(2.0)]);
        assert!(matches!(cells(Separator::Any, "nan")[..], [Number(nan)] if nan.is_nan()));
        assert_eq!(count(&cells(Separator::One(','), "1,2,")), 2);
    }

    #[test]
    fn pairs_are_found_and_other_lines_are_none() {
        let found = |line: &'static str| {
            let mut found = Vec::new();
            pairs(line, &mut |name, value| found.push((name.to_owned(), value))).then_some(found)
        };
        let (a, b) = (("A0".to_owned(), Cell::Number(512.0)), ("A1".to_owned(), Cell::Number(-3.0)));
        for line in [
            "A0:512,A1:-3",
            "A0: 512\tA1: -3",
            "A0=512 A1=-3",
            "A0 = 512 A1 = -3",
            "A0: 512 mV, A1: -3 mV",
            "A0: 512 A1: -3",
        ] {
            assert_eq!(found(line), Some(vec![a.clone(), b.clone()]), "{line}");
        }
        assert_eq!(found("Sensor 1: 512"), Some(vec![("Sensor 1".to_owned(), Cell::Number(512.0))]));
        for other in
            ["512,300", "hello", "", "12:30:05 x", "rst:0x1 (POWERON)", "a:", ":3", "A0: 512 A1 300", "a: b: 3"]
        {
            assert_eq!(found(other), None, "{other}");
        }
    }

    #[test]
    fn numbers_in_json_have_their_paths() {
        let mut found = Vec::new();
        json(r#"{"t":3,"v":{"4":1.5,"5":null},"m":[[1,2],["nan",4]],"ok":true}"#, None, &mut |path, cell| {
            found.push(format!("{path}={cell:?}"));
        })
        .unwrap();
        found.sort();
        let wanted = [
            "m[0][0]=Number(1.0)",
            "m[0][1]=Number(2.0)",
            "m[1][0]=Number(NaN)",
            "m[1][1]=Number(4.0)",
            "t=Number(3.0)",
            "v.4=Number(1.5)",
            "v.5=Blank",
        ];
        assert_eq!(found, wanted);
        assert!(json("{", None, &mut |_, _| {}).is_err());
        let decoded = Decoded { decoder: "hex16".parse().unwrap(), paths: vec!["1.data".parse().unwrap()] };
        let mut found = Vec::new();
        let line = r#"{"1":{"model":"ABCD","data":"7FFF,8001"}}"#;
        json(line, Some(&decoded), &mut |path, cell| found.push(format!("{path}={cell:?}"))).unwrap();
        found.sort();
        assert_eq!(found, ["1.data[0]=Number(32767.0)", "1.data[1]=Number(32769.0)", "1.model=Word(\"ABCD\")"]);
    }
}
