//! Values for taxels that the body does not have: left out, named once, and counted.

use std::collections::BTreeSet;

/// Ids are remembered up to so many, so that garbage does not fill the memory.
const MAX_IDS: usize = 10_000;
/// Ids that a message names.
const SHOWN: usize = 12;

/// What a source was given for taxels that the body does not have.
#[derive(Default)]
pub(super) struct Unknown {
    /// Whether it is an error.
    pub(super) refused: bool,
    ids: BTreeSet<u32>,
    /// Of these, those that have not been named yet.
    unnamed: Vec<u32>,
    values: u64,
}

impl Unknown {
    /// Refuses taxel `id` where that is to be an error.
    pub(super) fn check(&self, id: u32) -> Result<(), String> {
        let what = || format!("the body has no taxel {id}; leave it out, or give the body that has it");
        if self.refused { Err(what()) } else { Ok(()) }
    }

    /// Counts a value that is left out.
    pub(super) fn leave_out(&mut self, id: u32) {
        self.values += 1;
        if self.ids.len() < MAX_IDS && self.ids.insert(id) {
            self.unnamed.push(id);
        }
    }

    /// Names the taxels that have not been named yet.
    pub(super) fn notice(&mut self) -> Option<String> {
        let ids = std::mem::take(&mut self.unnamed);
        let (what, whose) = match ids.len() {
            0 => return None,
            1 => ("taxel", "its"),
            _ => ("taxels", "their"),
        };
        let ids = named(ids.into_iter());
        Some(format!("the body has no {what} {ids}; {whose} values are left out (--strict stops instead)"))
    }

    /// How many values were left out, if any were.
    pub(super) fn loss(&self) -> Option<String> {
        let values = match self.values {
            0 => return None,
            1 => "1 value".to_owned(),
            many => format!("{many} values"),
        };
        Some(format!("{values} of taxels that the body does not have ({})", named(self.ids.iter().copied())))
    }
}

/// The first few of `ids`, and how many more there are.
fn named(ids: impl ExactSizeIterator<Item = u32>) -> String {
    let more = ids.len().saturating_sub(SHOWN);
    let names: Vec<String> = ids.take(SHOWN).map(|id| id.to_string()).collect();
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{more}", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_ids_fill_neither_the_memory_nor_a_line() {
        let mut unknown = Unknown::default();
        (0..20_000).for_each(|id| unknown.leave_out(id));
        assert_eq!(unknown.ids.len(), MAX_IDS);
        let named = "0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11 and 9988 more";
        assert!(unknown.notice().unwrap().contains(named) && unknown.notice().is_none());
        assert_eq!(unknown.loss().unwrap(), format!("20000 values of taxels that the body does not have ({named})"));
    }
}
