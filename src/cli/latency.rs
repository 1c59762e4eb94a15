//! How long frames take from the last byte read to the percept written.

use std::time::Duration;

use serde_json::{Value, json};

/// Steps within each doubling: a figure is at most so much too high, 1/32.
const STEPS: u64 = 32;
/// Doublings beyond the first steps, which are a microsecond each: up to 2³⁶ µs, 19 hours.
const DOUBLINGS: u64 = 32;

/// A count of latencies, as memory does not grow with.
pub(super) struct Latency {
    counts: Vec<u64>,
    total: u64,
    worst: Duration,
}

impl Default for Latency {
    fn default() -> Self {
        let counts = vec![0; (STEPS * (DOUBLINGS + 1)) as usize];
        Self { counts, total: 0, worst: Duration::ZERO }
    }
}

/// The step that `us` microseconds fall into.
fn step(us: u64) -> usize {
    // Numbers below STEPS stand for themselves; above, their highest log₂(STEPS) + 1 bits count.
    let above = |us: u64| {
        let doubling = u64::from(us.ilog2() - STEPS.ilog2()) + 1;
        doubling * STEPS + (us >> (doubling - 1)) - STEPS
    };
    let steps = if us < STEPS { us } else { above(us) };
    steps.min(STEPS * (DOUBLINGS + 1) - 1) as usize
}

/// The most microseconds that fall into a step.
fn most_us(step: usize) -> u64 {
    let (doubling, rest) = (step as u64 / STEPS, step as u64 % STEPS);
    if doubling == 0 { rest } else { ((STEPS + rest + 1) << (doubling - 1)) - 1 }
}

impl Latency {
    pub(super) fn see(&mut self, took: Duration) {
        self.counts[step(took.as_micros() as u64)] += 1;
        self.total += 1;
        self.worst = self.worst.max(took);
    }

    pub(super) fn is_empty(&self) -> bool {
        self.total == 0
    }

    fn quantile(&self, share: f64) -> Duration {
        let wanted = ((self.total as f64 * share).ceil() as u64).max(1);
        let mut seen = 0;
        let reaches = |count: &u64| {
            seen += count;
            seen >= wanted
        };
        let step = self.counts.iter().position(reaches).unwrap_or(0);
        Duration::from_micros(most_us(step)).min(self.worst)
    }

    /// p50, p99 and the worst, in words.
    pub(super) fn words(&self) -> String {
        let [p50, p99, worst] = [self.quantile(0.5), self.quantile(0.99), self.worst].map(in_words);
        format!("p50 {p50}, p99 {p99}, worst {worst}")
    }

    pub(super) fn json(&self) -> Value {
        let us = |span: Duration| span.as_micros() as u64;
        json!({"frames": self.total, "p50_us": us(self.quantile(0.5)), "p99_us": us(self.quantile(0.99)),
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
    fn quantiles_are_found_within_a_step() {
        let mut latency = Latency::default();
        (1..=1000).for_each(|us| latency.see(Duration::from_micros(us)));
        for (share, right) in [(0.5, 500.0), (0.99, 990.0), (0.01, 10.0)] {
            let found = latency.quantile(share).as_micros() as f64;
            assert!(found >= right && found <= right * (1.0 + 1.0 / 32.0), "{share}: {found}");
        }
        assert_eq!(latency.quantile(1.0), Duration::from_millis(1));
        assert_eq!(latency.words(), "p50 503 µs, p99 991 µs, worst 1.0 ms");
        latency.see(Duration::from_secs(1 << 40));
        assert_eq!(latency.json()["frames"], 1001);
    }

    #[test]
    fn every_length_has_one_step_in_order() {
        let mut before = 0;
        for us in (0..5000).chain([1 << 20, (1 << 20) + 40_000, u64::MAX]) {
            let step = step(us);
            assert!(step >= before && step <= before + 700, "{us}");
            assert!(us == u64::MAX || (us <= most_us(step) && (step == 0 || us > most_us(step - 1))), "{us}");
            before = step;
        }
    }
}
