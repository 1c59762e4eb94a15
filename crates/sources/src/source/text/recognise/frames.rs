//! How many lines make a frame, and what is between two frames.

use std::collections::HashMap;

use super::super::form::{End, shape};
use super::super::options::FrameEnd;

/// A line: a row of numbers, or what it is instead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Item<'a> {
    Row,
    Other(&'a str),
}

/// Lines of a frame, and what ends it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Frames {
    pub(super) rows: usize,
    pub(super) end: Option<End>,
}

/// The number of rows between ends of a frame that most of them have between them, and how many those are.
fn usual_gap(items: &[Item<'_>], is_end: impl Fn(&str) -> bool) -> Option<(usize, usize, usize)> {
    let mut gaps = Vec::new();
    let (mut rows, mut has_begun) = (0, false);
    for item in items {
        match item {
            Item::Row => rows += 1,
            Item::Other(line) if is_end(line) => {
                if has_begun && rows > 0 {
                    gaps.push(rows);
                }
                (rows, has_begun) = (0, true);
            }
            Item::Other(_) => {}
        }
    }
    let mut counts: HashMap<usize, usize> = HashMap::new();
    gaps.iter().for_each(|&gap| *counts.entry(gap).or_default() += 1);
    let (gap, count) = counts.into_iter().max_by_key(|&(gap, count)| (count, gap))?;
    Some((gap, count, gaps.len()))
}

/// What ends frames, by what is between the rows, or by `asked`.
pub(super) fn frames(items: &[Item<'_>], asked: Option<&FrameEnd>) -> Frames {
    let asked = asked.map(|end| match end {
        FrameEnd::Blank => End::Blank,
        FrameEnd::Begins(start) => End::Begins(start.clone()),
    });
    if let Some(end) = asked {
        let rows = usual_gap(items, |line| end.is(line)).map_or(0, |(gap, ..)| gap);
        return Frames { rows, end: Some(end) };
    }
    let mut shapes: Vec<(String, &str, usize)> = Vec::new();
    for line in items.iter().filter_map(|item| if let Item::Other(line) = item { Some(*line) } else { None }) {
        let own = shape(line);
        if let Some((.., count)) = shapes.iter_mut().find(|(known, ..)| *known == own) {
            *count += 1;
        } else if shapes.len() < 100 {
            // What comes a hundred ways ends nothing.
            shapes.push((own, line, 1));
        }
    }
    let candidates = shapes.into_iter().filter(|(.., count)| *count > 1).map(|(shape, line, _)| match line {
        "" => End::Blank,
        line => End::Shape(shape, line.to_owned()),
    });
    let regular = candidates.filter_map(|end| {
        let (rows, count, of) = usual_gap(items, |line| end.is(line))?;
        (5 * count >= 3 * of).then_some((rows, count, end))
    });
    // Blank lines also stand around lines that say which frame it is.
    match regular.max_by_key(|(_, count, end)| (*count, *end == End::Blank)) {
        Some((rows, _, end)) => Frames { rows, end: Some(end) },
        None => Frames { rows: 1, end: None },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn items(text: &str) -> Vec<Item<'_>> {
        text.lines().map(|line| if line.contains(',') { Item::Row } else { Item::Other(line) }).collect()
    }

    #[test]
    fn frames_end_where_the_lines_between_rows_are_regular() {
        let found = |text: &str| frames(&items(text), None);
        assert_eq!(found("1,2\n3,4\n5,6\n"), Frames { rows: 1, end: None });
        assert_eq!(found("1,2\n3,4\n\n1,2\n3,4\n\n1,2\n3,4\n\n"), Frames { rows: 2, end: Some(End::Blank) });
        assert_eq!(found("4,4\n\n1,2\n3,4\nboot\n\n1,2\n3,4\n\n1,2"), Frames { rows: 2, end: Some(End::Blank) });
        let marked = found("F 1\n1,2\n3,4\n5,6\nF 2\n1,2\n3,4\n5,6\nF 3\n");
        assert!(matches!(marked, Frames { rows: 3, end: Some(End::Shape(_, _)) }), "{marked:?}");
        assert_eq!(found("1,2\n\n3,4\n\n5,6\n\n"), Frames { rows: 1, end: Some(End::Blank) });
        let asked = FrameEnd::Begins("F".to_owned());
        assert_eq!(frames(&items("F 1\n1,2\nx\n3,4\nF 2\n"), Some(&asked)).rows, 2);
    }
}
