//! Values of taxels that the body does not have: skipped, named once and counted.

use std::collections::BTreeSet;

use crate::signal::Channel;

/// Maximum number of ids to remember, so that invalid input does not fill the memory.
const MAX_IDS: usize = 10_000;
/// Maximum number of ids listed in a message.
const MAX_LISTED_IDS: usize = 12;

/// Values that a source received for taxels that the body does not have.
#[derive(Default)]
pub(super) struct UnknownTaxels {
    /// Whether an unknown taxel is an error.
    pub(super) refused: bool,
    ids: BTreeSet<u32>,
    /// The ids that no notice has named yet.
    unnamed: Vec<u32>,
    values: u64,
}

impl UnknownTaxels {
    /// An error for the unknown taxel `id`, if it is to be one.
    pub(super) fn check(&self, id: u32) -> Result<(), String> {
        let what = || format!("the body has no taxel {}; leave it out, or give the body that has it", Channel(id));
        if self.refused { Err(what()) } else { Ok(()) }
    }

    pub(super) fn leave_out(&mut self, id: u32) {
        self.values += 1;
        if self.ids.len() < MAX_IDS && self.ids.insert(id) {
            self.unnamed.push(id);
        }
    }

    /// A notice of the ids that no notice has named yet.
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

    /// The number of skipped values in words, if any.
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
    let more = ids.len().saturating_sub(MAX_LISTED_IDS);
    let names: Vec<String> = ids.take(MAX_LISTED_IDS).map(|id| Channel(id).to_string()).collect();
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{more}", names.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_ids_fill_neither_the_memory_nor_a_line() {
        let mut unknown = UnknownTaxels::default();
        (0..20_000).for_each(|id| unknown.leave_out(id));
        assert_eq!(unknown.ids.len(), MAX_IDS);
        let named = "0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11 and 9988 more";
        assert!(unknown.notice().unwrap().contains(named) && unknown.notice().is_none());
        assert_eq!(unknown.loss().unwrap(), format!("20000 values of taxels that the body does not have ({named})"));
    }
}
