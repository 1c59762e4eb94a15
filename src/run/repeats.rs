//! Repeated messages: shown once, then with their count at growing intervals, and at the end.

use std::collections::BTreeMap;

/// Time until a message is shown again, s; doubles each time.
const FIRST_WAIT_S: f64 = 10.0;
/// Maximum of that time, s.
const LONGEST_WAIT_S: f64 = 640.0;

/// A message, and how often it came and was shown.
#[derive(Debug)]
struct Repeated {
    times: u64,
    /// How many of these the user knows of.
    reported: u64,
    reported_at_s: f64,
    wait_s: f64,
}

/// The messages so far.
#[derive(Debug, Default)]
pub struct Repeats {
    messages: BTreeMap<String, Repeated>,
}

impl Repeats {
    /// The line to show now that `text` came at `at_s`, if any.
    pub fn tell(&mut self, at_s: f64, text: &str) -> Option<String> {
        let Some(repeated) = self.messages.get_mut(text) else {
            let first = Repeated { times: 1, reported: 1, reported_at_s: at_s, wait_s: FIRST_WAIT_S };
            self.messages.insert(text.to_owned(), first);
            return Some(timed(at_s, text));
        };
        repeated.times += 1;
        if at_s - repeated.reported_at_s < repeated.wait_s {
            return None;
        }
        (repeated.reported, repeated.reported_at_s) = (repeated.times, at_s);
        repeated.wait_s = (2.0 * repeated.wait_s).min(LONGEST_WAIT_S);
        Some(format!("{} ({} times so far)", timed(at_s, text), repeated.times))
    }

    /// The final counts of messages that came more often than was shown.
    pub fn rest(&self) -> impl Iterator<Item = String> + '_ {
        let unreported = self.messages.iter().filter(|(_, repeated)| repeated.times > repeated.reported);
        unreported.map(|(text, repeated)| format!("{text}: {} times in all", repeated.times))
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
    fn a_flood_is_a_few_lines_and_what_is_rare_is_always_reported() {
        let mut repeats = Repeats::default();
        let shown: Vec<String> = (0..1298).filter_map(|n| repeats.tell(f64::from(n) / 216.0, "again")).collect();
        assert_eq!(shown, ["0.00 s: again"]);
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
