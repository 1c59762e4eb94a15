//! Lines that are skipped, counted by what is wrong with them.

use super::form::short;

/// What is wrong with a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Wrong {
    Torn,
    Words,
    Few,
    Many,
    Word,
    Json,
    Time,
    Rows,
    Names,
    Garbled,
    Long,
    /// A message of something else, which is no loss.
    Other,
}

/// Each kind with its message.
const KINDS: [(Wrong, &str); 11] = [
    (Wrong::Torn, "torn where the connection began or ended"),
    (Wrong::Words, "words where numbers belong, as boards send when they start"),
    (Wrong::Few, "too few values"),
    (Wrong::Many, "too many values"),
    (Wrong::Word, "a word in the place of a number"),
    (Wrong::Json, "not JSON"),
    (Wrong::Time, "no time in the column of times"),
    (Wrong::Rows, "rows of a frame that is not whole"),
    (Wrong::Names, "names that the lines before did not have"),
    (Wrong::Garbled, "bytes that are not text"),
    (Wrong::Long, "over 1 MiB without a line end"),
];

#[derive(Clone, Debug, Default)]
struct Kind {
    count: u64,
    first: String,
}

/// Counts by kind, and the first line of each.
#[derive(Clone, Debug, Default)]
pub(super) struct Skipped {
    kinds: [Kind; KINDS.len()],
    has_others: bool,
    notices: Vec<String>,
}

impl Skipped {
    /// Counts `line`, which has the fault `wrong`.
    pub(super) fn add(&mut self, wrong: Wrong, line: &str) {
        let Some(index) = KINDS.iter().position(|(kind, _)| *kind == wrong) else { return };
        let kind = &mut self.kinds[index];
        kind.count += 1;
        if kind.count == 1 {
            kind.first = short(line);
            self.notices.push(format!(
                "a line is skipped, {}{}; others like it are counted",
                KINDS[index].1,
                kind.shown()
            ));
        }
    }

    /// Says of `line`, the first that has nothing of what the map names, that it is not used.
    pub(super) fn other(&mut self, line: &str) {
        if !std::mem::replace(&mut self.has_others, true) {
            let what = format!(
                "a message has nothing that the map names, and is left out as are others like it: `{}`",
                short(line)
            );
            self.notices.push(what);
        }
    }

    /// Says that `line`, the first one, is not used although it looks whole.
    pub(super) fn leave_out(&mut self, line: &str) {
        self.notices.push(format!("the first line may be the end of a longer one and is left out: `{}`", short(line)));
    }

    /// What is new since the last call.
    pub(super) fn take_notices(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notices)
    }

    /// All of it, a line a kind.
    pub(super) fn losses(&self) -> Vec<String> {
        let counted = self.kinds.iter().zip(KINDS).filter(|(kind, _)| kind.count > 0);
        counted
            .map(|(kind, (_, what))| {
                let lines = if kind.count == 1 { "1 line".to_owned() } else { format!("{} lines", kind.count) };
                format!("{lines} skipped, {what}{}", kind.shown_as_first())
            })
            .collect()
    }
}

impl Kind {
    fn shown(&self) -> String {
        if self.first.is_empty() { String::new() } else { format!(": `{}`", self.first) }
    }

    fn shown_as_first(&self) -> String {
        match (self.first.is_empty(), self.count) {
            (true, _) => String::new(),
            (_, 1) => self.shown(),
            _ => format!("; the first one was `{}`", self.first),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_counted_by_kind_and_the_first_one_is_shown() {
        let mut skipped = Skipped::default();
        for line in ["512,3", "1", "2"] {
            skipped.add(Wrong::Few, line);
        }
        skipped.add(Wrong::Garbled, "");
        assert_eq!(skipped.take_notices().len(), 2);
        assert_eq!(
            skipped.losses(),
            ["3 lines skipped, too few values; the first one was `512,3`", "1 line skipped, bytes that are not text"]
        );
    }
}
