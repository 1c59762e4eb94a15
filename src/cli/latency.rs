//! How long frames take from the last byte read to the percept written.

use std::time::Duration;

use hdrhistogram::Histogram;
use serde_json::{Value, json};

/// The longest latency that is counted, µs: a day. Longer ones count as this.
const MOST_US: u64 = 86_400_000_000;
/// Digits that a figure has: it is at most 1 % too high.
const DIGITS: u8 = 2;

/// A count of latencies, whose memory does not grow.
pub(super) struct Latency {
    us: Histogram<u64>,
    worst: Duration,
}

impl Default for Latency {
    fn default() -> Self {
        let us = Histogram::new_with_max(MOST_US, DIGITS).expect("the bounds are a histogram's");
        Self { us, worst: Duration::ZERO }
    }
}

impl Latency {
    pub(super) fn see(&mut self, took: Duration) {
        self.us.saturating_record(took.as_micros() as u64);
        self.worst = self.worst.max(took);
    }

    pub(super) fn is_empty(&self) -> bool {
        self.us.is_empty()
    }

    fn quantile(&self, share: f64) -> Duration {
        Duration::from_micros(self.us.value_at_quantile(share)).min(self.worst)
    }

    /// p50, p99 and the worst, in words.
    pub(super) fn words(&self) -> String {
        let [p50, p99, worst] = [self.quantile(0.5), self.quantile(0.99), self.worst].map(in_words);
        format!("p50 {p50}, p99 {p99}, worst {worst}")
    }

    pub(super) fn json(&self) -> Value {
        let us = |span: Duration| span.as_micros() as u64;
        json!({"frames": self.us.len(), "p50_us": us(self.quantile(0.5)), "p99_us": us(self.quantile(0.99)),
            "worst_us": us(self.worst)})
    }
}

fn in_words(span: Duration) -> String {
    match span.as_micros() {
        us if us < 1000 => format!("{us} µs"),
        us if us < 1_000_000 => format!("{:.1} ms", us as f64 * 1e-3),
        us => format!("{:.1} s", us as f64 * 1e-6),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_found_within_a_percent_and_no_length_is_lost() {
        let mut latency = Latency::default();
        assert!(latency.is_empty());
        (1..=1000).for_each(|us| latency.see(Duration::from_micros(us)));
        for (share, right) in [(0.5, 500.0), (0.99, 990.0), (0.01, 10.0)] {
            let found = latency.quantile(share).as_micros() as f64;
            assert!(found >= right && found <= right * 1.01, "{share}: {found}");
        }
        assert_eq!(latency.quantile(1.0), Duration::from_millis(1));
        assert_eq!(latency.words(), "p50 501 µs, p99 991 µs, worst 1.0 ms");
        latency.see(Duration::ZERO);
        latency.see(Duration::from_secs(1 << 40));
        assert_eq!(latency.json()["frames"], 1002);
        assert_eq!(latency.quantile(1.0), Duration::from_micros(latency.us.max()));
    }
}
