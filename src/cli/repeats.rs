//! Messages that come again and again: told once, then with their count at growing intervals, and in the end.

use std::collections::BTreeMap;

/// What has come before is told again after so long at the earliest, s; after that, twice as long each time.
const FIRST_WAIT_S: f64 = 10.0;
/// The longest wait, s.
const LONGEST_WAIT_S: f64 = 640.0;

/// A message that has come.
struct Told {
    times: u64,
    /// The first so many of which have been told.
    told: u64,
    told_at_s: f64,
    wait_s: f64,
}

/// What has been told so far.
#[derive(Default)]
pub(super) struct Repeats {
    messages: BTreeMap<String, Told>,
}

impl Repeats {
    /// What is to be told now that `text` has come at `at_s`, if anything is.
    pub(super) fn tell(&mut self, at_s: f64, text: &str) -> Option<String> {
        let Some(told) = self.messages.get_mut(text) else {
            let first = Told { times: 1, told: 1, told_at_s: at_s, wait_s: FIRST_WAIT_S };
            self.messages.insert(text.to_owned(), first);
            return Some(timed(at_s, text));
        };
        told.times += 1;
        if at_s - told.told_at_s < told.wait_s {
            return None;
        }
        (told.told, told.told_at_s) = (told.times, at_s);
        told.wait_s = (2.0 * told.wait_s).min(LONGEST_WAIT_S);
        Some(format!("{} ({} times so far)", timed(at_s, text), told.times))
    }

    /// What has come more often than was told.
    pub(super) fn rest(&self) -> impl Iterator<Item = String> + '_ {
        let untold = self.messages.iter().filter(|(_, told)| told.times > told.told);
        untold.map(|(text, told)| format!("{text}: {} times in all", told.times))
    }
}

/// `text`, with when it came.
fn timed(at_s: f64, text: &str) -> String {
    format!("{at_s:.2} s: {text}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_is_a_few_lines_and_what_is_rare_is_always_told() {
        let mut repeats = Repeats::default();
        let told: Vec<String> = (0..1298).filter_map(|n| repeats.tell(f64::from(n) / 216.0, "again")).collect();
        assert_eq!(told, ["0.00 s: again"]);
        assert_eq!(repeats.rest().collect::<Vec<_>>(), ["again: 1298 times in all"]);
        assert_eq!(repeats.tell(700.0, "again").unwrap(), "700.00 s: again (1299 times so far)");
        assert_eq!(repeats.rest().count(), 0);
        assert_eq!(repeats.tell(701.0, "other").unwrap(), "701.00 s: other");
        let hours = (1..9).filter_map(|hour| repeats.tell(3600.0 * f64::from(hour), "other")).count();
        assert_eq!(hours, 8);
        let many = (0..36_000).filter_map(|n| repeats.tell(40_000.0 + 0.1 * f64::from(n), "third")).count();
        assert!((8..14).contains(&many), "{many} in an hour");
    }
}
