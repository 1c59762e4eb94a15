//! Converts a board's time to the host's time.
//!
//! A frame read at board time x arrives at host time y ≥ (1 + b)·x + a, as delays are never negative. The best line below
//! all points (x, y) is the edge of their lower hull under the mean of x (Moon, Skelly and Towsley, *Estimation and
//! removal of clock skew from network delay measurements*, 1999); it gives the board's clock up to the shortest delay.
//! The points are the earliest arrivals of each half second of the last two minutes.

use std::collections::VecDeque;

/// Length of a bucket, s of board time. The earliest arrival in it counts.
const BUCKET_S: f64 = 0.5;
const BUCKETS: usize = 240;
/// The drift is assumed to be 0 for less data than this, s.
const FIT_DRIFT_S: f64 = 1.0;
/// The drift is reported from this much data on, s.
const REPORT_DRIFT_S: f64 = 30.0;
/// A larger offset means that the board's clock was set; it is then estimated anew, s.
const JUMP_S: f64 = 2.0;
/// A network may hold frames up for longer, s.
#[cfg(any(test, feature = "zenoh"))]
const NETWORK_LATE_S: f64 = 60.0;
/// The largest drift that is believed of a board's clock, and of a computer's. Without a limit, frames that a network held back
/// would pass for a clock that runs slow.
const MAX_BOARD_DRIFT: f64 = 0.05;
#[cfg(any(test, feature = "zenoh"))]
const MAX_COMPUTER_DRIFT: f64 = 1e-3;

#[derive(Clone, Debug)]
pub(in crate::source) struct Clock {
    first_us: Option<u64>,
    /// Earliest arrivals: board time x since the first frame, s, and y − x, s.
    buckets: VecDeque<(f64, f64)>,
    offset_s: f64,
    /// b: relative rate of the host's clock against the board's.
    slope: f64,
    /// The last frame's board time and host time, s.
    last: Option<(f64, f64)>,
    /// A frame that arrives later than this is of a clock that was set back, s.
    latest_s: f64,
    /// The largest of `slope`, either way.
    max_drift: f64,
}

impl Default for Clock {
    fn default() -> Self {
        let buckets = VecDeque::new();
        Self {
            first_us: None,
            buckets,
            offset_s: 0.0,
            slope: 0.0,
            last: None,
            latest_s: JUMP_S,
            max_drift: MAX_BOARD_DRIFT,
        }
    }
}

impl Clock {
    /// Of a limb, whose network may hold frames up.
    #[cfg(any(test, feature = "zenoh"))]
    pub(in crate::source) fn of_limb() -> Self {
        Self { latest_s: NETWORK_LATE_S, max_drift: MAX_COMPUTER_DRIFT, ..Self::default() }
    }

    /// Begins anew.
    pub(in crate::source) fn restart(&mut self) {
        *self = Self { latest_s: self.latest_s, max_drift: self.max_drift, ..Self::default() };
    }

    /// The host time, s, of a frame read at board time `board_us` that arrived at `arrived_s`. Never before earlier frames,
    /// nor after its arrival.
    pub(in crate::source) fn host_time_s(&mut self, board_us: u64, arrived_s: f64) -> f64 {
        let x = self.since_first_s(board_us);
        let y = arrived_s - x;
        let known = self.offset_s + self.slope * x;
        let jumps = known - y > JUMP_S || y - known > self.latest_s;
        if self.last.is_some_and(|(last_x, _)| x < last_x || jumps) {
            self.restart();
            return self.host_time_s(board_us, arrived_s);
        }
        let lower = match self.buckets.back_mut() {
            Some((at, least)) if (*at / BUCKET_S).floor() == (x / BUCKET_S).floor() => {
                let lower = y < *least;
                if lower {
                    (*at, *least) = (x, y);
                }
                lower
            }
            _ => {
                self.buckets.push_back((x, y));
                true
            }
        };
        if self.buckets.len() > BUCKETS {
            self.buckets.pop_front();
        }
        if lower {
            self.fit();
        }
        let mut host_s = x + (self.offset_s + self.slope * x).min(y);
        // A new fit must not reorder frames, nor shrink the time between them to 0.
        if let Some((last_x, last_s)) = self.last {
            host_s = host_s.max(last_s + 0.5 * (x - last_x)).min(arrived_s.max(last_s));
        }
        self.last = Some((x, host_s));
        host_s
    }

    /// Relative error of the board's clock, positive if fast, once known.
    pub(in crate::source) fn drift(&self) -> Option<f64> {
        let (first, last) = (self.buckets.front()?.0, self.buckets.back()?.0);
        (last - first >= REPORT_DRIFT_S).then(|| (1.0 + self.slope).recip() - 1.0)
    }

    fn since_first_s(&mut self, board_us: u64) -> f64 {
        let first = *self.first_us.get_or_insert(board_us);
        board_us.wrapping_sub(first) as i64 as f64 * 1e-6
    }

    fn fit(&mut self) {
        let (first, last) = (self.buckets[0].0, self.buckets[self.buckets.len() - 1].0);
        if last - first < FIT_DRIFT_S {
            let least = self.buckets.iter().map(|&(_, y)| y).fold(f64::INFINITY, f64::min);
            (self.offset_s, self.slope) = (least, 0.0);
            return;
        }
        let mean = self.buckets.iter().map(|&(x, _)| x).sum::<f64>() / self.buckets.len() as f64;
        // Andrew's monotone chain, the lower half.
        let mut hull: Vec<(f64, f64)> = Vec::with_capacity(self.buckets.len());
        for &point in &self.buckets {
            while let [.., a, b] = hull[..]
                && (b.0 - a.0) * (point.1 - a.1) <= (b.1 - a.1) * (point.0 - a.0)
            {
                hull.pop();
            }
            hull.push(point);
        }
        let right = hull.partition_point(|&(x, _)| x <= mean).clamp(1, hull.len() - 1);
        let ((x0, y0), (x1, y1)) = (hull[right - 1], hull[right]);
        self.slope = (y1 - y0) / (x1 - x0);
        self.offset_s = y0 - self.slope * x0;
        if self.slope.abs() > self.max_drift {
            self.slope = self.max_drift.copysign(self.slope);
            self.offset_s = self.buckets.iter().map(|&(x, y)| y - self.slope * x).fold(f64::INFINITY, f64::min);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    /// The largest error of placing, s, after `from_s`, and the drift found, of a clock with this `drift` whose frames come
    /// every 20 ms with delays of 3 ms and up to `jitter_s` more, now and then 50 ms more.
    fn followed(drift: f64, jitter_s: f64, from_s: f64) -> (f64, f64) {
        let (mut clock, mut random, mut worst) = (Clock::default(), Random::new(7), 0.0_f64);
        for frame in 0..6000 {
            let read_s = 5.0 + 0.02 * f64::from(frame);
            let late = if random.unit() < 0.05 { 0.05 } else { 0.0 };
            let arrived_s = read_s + 0.003 + jitter_s * random.unit() + late;
            let host_s = clock.host_time_s((read_s * (1.0 + drift) * 1e6) as u64, arrived_s);
            assert!(host_s <= arrived_s);
            if read_s > from_s {
                worst = worst.max((host_s - read_s - 0.003).abs());
            }
        }
        (worst, clock.drift().unwrap())
    }

    #[test]
    fn clocks_that_run_apart_are_followed() {
        for drift in [-100e-6, 0.0, 100e-6, 0.01] {
            // The least of 25 delays, each even over the jitter, is over half of it with a chance of 2⁻²⁵: the line stays
            // within half of the jitter of the truth where it is drawn, and twice that far at its end.
            let (worst, found) = followed(drift, 0.002, 15.0);
            assert!(worst < 0.002, "{drift}: {worst}");
            // Half the jitter at both ends of the window's two minutes.
            assert!((found - drift).abs() < 0.002 / 119.0, "{drift}: {found}");
        }
        // Without jitter, to the microsecond that the board's clock counts in.
        let (worst, found) = followed(100e-6, 0.0, 6.0);
        assert!(worst < 5e-6 && (found - 100e-6).abs() < 2e-6 / 119.0 + 1e-9, "{worst} {found}");
        // The same frames, taken to be from a clock that runs as ours, would be off by 12 ms in the end.
        assert!((100e-6_f64 * 120.0 - 0.012).abs() < 1e-9);
    }

    #[test]
    fn a_clock_that_was_set_is_learnt_anew() {
        let mut clock = Clock::default();
        for frame in 0..100_u32 {
            clock.host_time_s(u64::from(frame) * 20_000, 1.0 + 0.02 * f64::from(frame));
        }
        assert_eq!(clock.host_time_s(90_000_000, 3.02), 3.02, "ahead");
        assert_eq!(clock.host_time_s(5, 3.04), 3.04, "back");
        assert!((clock.host_time_s(20_005, 3.07) - 3.06).abs() < 1e-9, "late, and known to be");
    }

    #[test]
    fn frames_that_a_network_held_back_keep_the_times_at_which_they_were_read() {
        // A second as it should be; then the network holds back two seconds of frames, and brings them all at once.
        let worst_of = |max_drift: f64| {
            let mut clock = Clock { max_drift, ..Clock::of_limb() };
            let mut worst = 0.0_f64;
            for frame in 0..200_u32 {
                let read_s = 0.02 * f64::from(frame);
                let arrived_s = if (60..160).contains(&frame) { 3.22 } else { read_s + 0.02 };
                let host_s = clock.host_time_s((read_s * 1e6).round() as u64, arrived_s);
                worst = worst.max((host_s - read_s - 0.02).abs());
            }
            worst
        };
        // A thousandth of the four seconds.
        assert!(worst_of(MAX_COMPUTER_DRIFT) <= 0.004, "{}", worst_of(MAX_COMPUTER_DRIFT));
        // Without the limit they are dated as new.
        assert!(worst_of(f64::INFINITY) > 0.5, "{}", worst_of(f64::INFINITY));
    }

    #[test]
    fn time_goes_on_when_a_delay_gets_shorter() {
        let mut clock = Clock::default();
        let mut last = f64::NEG_INFINITY;
        // A shorter delay bends the line until most of what is remembered is later than it.
        for frame in 0..1000_u32 {
            let delay = if frame < 200 { 0.1 } else { 0.001 };
            let at = clock.host_time_s(u64::from(frame) * 20_000, 0.02 * f64::from(frame) + delay);
            assert!(at >= last, "{frame}: {at} {last}");
            last = at;
        }
        assert!((last - 999.0 * 0.02 - 0.001).abs() < 1e-9, "{last}");
    }
}
