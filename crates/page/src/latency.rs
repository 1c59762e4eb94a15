//! How long frames take from their arrival to a viewer's screen.

use std::time::Duration;

/// Frames that count.
const WINDOW: usize = 256;

/// The latest frames' latencies.
#[derive(Debug)]
pub(super) struct Latencies {
    millis: Vec<f32>,
    next: usize,
}

impl Latencies {
    pub(super) fn new() -> Self {
        Self { millis: Vec::with_capacity(WINDOW), next: 0 }
    }

    pub(super) fn add(&mut self, latency: Duration) {
        let millis = latency.as_secs_f32() * 1e3;
        if self.millis.len() < WINDOW {
            self.millis.push(millis);
        } else {
            self.millis[self.next] = millis;
            self.next = (self.next + 1) % WINDOW;
        }
    }

    /// Median and 99th percentile, ms; NaN before there are any.
    pub(super) fn percentiles_ms(&self) -> [f32; 2] {
        let mut sorted = [0.0; WINDOW];
        let sorted = &mut sorted[..self.millis.len()];
        sorted.copy_from_slice(&self.millis);
        sorted.sort_by(f32::total_cmp);
        let Some(last) = sorted.len().checked_sub(1) else { return [f32::NAN; 2] };
        [50, 99].map(|percent| sorted[(last * percent).div_ceil(100)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_latest_count() {
        let mut latencies = Latencies::new();
        assert!(latencies.percentiles_ms()[0].is_nan());
        latencies.add(Duration::from_millis(7));
        assert_eq!(latencies.percentiles_ms(), [7.0, 7.0]);
        for _ in 0..10_000 {
            latencies.add(Duration::from_secs(1));
        }
        for millis in 1..=256 {
            latencies.add(Duration::from_millis(millis));
        }
        assert_eq!(latencies.percentiles_ms().map(f32::round), [129.0, 254.0]);
        assert_eq!(latencies.millis.len(), WINDOW);
    }
}
