//! Lines, rows and messages of files that are skipped on request, counted by what is wrong with them.

use crate::error::{Error, Result};

/// What of a file is skipped because something is wrong with it, where that is asked for; else it is an error.
#[derive(Clone, Debug, Default)]
pub struct SkippedBad {
    is_on: bool,
    kinds: Vec<Kind>,
    notices: Vec<String>,
}

#[derive(Clone, Debug)]
struct Kind {
    /// What is skipped, such as `row`, and what is wrong with it.
    thing: &'static str,
    wrong: &'static str,
    count: u64,
    first: String,
}

impl SkippedBad {
    /// Skips where `is_on`.
    #[must_use]
    pub fn new(is_on: bool) -> Self {
        Self { is_on, ..Self::default() }
    }

    /// Whether it skips.
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.is_on
    }

    /// Counts a `thing`, such as a `row`, of which `wrong` is wrong: `error` says where.
    ///
    /// # Errors
    /// `error` itself, if nothing is to be skipped, or if it is of what was asked for.
    pub fn skip(&mut self, thing: &'static str, wrong: &'static str, error: Error) -> Result<()> {
        if !self.is_on || error.is_usage() {
            return Err(error);
        }
        match self.kinds.iter_mut().find(|kind| (kind.thing, kind.wrong) == (thing, wrong)) {
            Some(kind) => kind.count += 1,
            None => {
                self.notices.push(format!("a {thing} is skipped: {error}; others like it are counted"));
                self.kinds.push(Kind { thing, wrong, count: 1, first: error.to_string() });
            }
        }
        Ok(())
    }

    /// What is new since the last call, a line each.
    pub fn take_notices(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notices)
    }

    /// All that was skipped, a line for each kind.
    #[must_use]
    pub fn losses(&self) -> Vec<String> {
        let line = |Kind { thing, wrong, count, first }: &Kind| match count {
            1 => format!("1 {thing} skipped, {wrong}: {first}"),
            _ => format!("{count} {thing}s skipped, {wrong}; the first one: {first}"),
        };
        self.kinds.iter().map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_skipped_is_counted_by_kind_and_the_first_is_shown() {
        let mut skipped = SkippedBad::new(true);
        let error = |line: u32| Error::failed("`x` is not a number").at(format!("line {line}"));
        for line in [3, 5] {
            skipped.skip("row", "a value that is not a number", error(line)).unwrap();
        }
        skipped.skip("row", "no time", Error::failed("t is blank")).unwrap();
        assert_eq!(skipped.take_notices().len(), 2);
        assert!(skipped.take_notices().is_empty());
        assert_eq!(
            skipped.losses(),
            [
                "2 rows skipped, a value that is not a number; the first one: line 3: `x` is not a number",
                "1 row skipped, no time: t is blank"
            ]
        );
        assert!(skipped.skip("row", "no time", Error::usage("--rate 0")).is_err(), "what was asked for is not skipped");
        assert!(SkippedBad::default().skip("row", "no time", error(1)).is_err());
    }
}
