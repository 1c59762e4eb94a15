//! Times of frames, to the nanosecond also where they are counted since 1970.

use std::cmp::Ordering;
use std::fmt;

/// From here on a double does not hold every nanosecond, s: 97 days.
const COARSE_S: f64 = (1_u64 << 23) as f64;
/// Below this a time in nanoseconds fits 64 bits, s.
const LARGEST_S: f64 = 9e9;

/// A time in seconds, and what is left of it in nanoseconds where a double is too coarse: a clock since 1970 has steps of 238 ns
/// as one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameTime {
    /// The time, s: the double next to it.
    pub s: f64,
    /// What is left, ns: positive where the time is later than `s`.
    pub rest_ns: i64,
}

impl FrameTime {
    /// The time `ns` nanoseconds after 0.
    #[must_use]
    pub fn from_ns(ns: i64) -> Self {
        let s = if ns.unsigned_abs() < 1 << 53 {
            ns as f64 / 1e9
        } else {
            // Seconds and the rest by themselves: a double does not hold both before they are divided.
            ns.div_euclid(1_000_000_000) as f64 + ns.rem_euclid(1_000_000_000) as f64 / 1e9
        };
        Self { s, rest_ns: ns - whole_ns(s) }
    }

    /// The time in nanoseconds after 0; the least or the largest where it is beyond.
    #[must_use]
    pub fn ns(self) -> i64 {
        whole_ns(self.s).saturating_add(self.rest_ns)
    }

    /// How much later it is than `other`, s.
    #[must_use]
    pub fn since(self, other: Self) -> f64 {
        let is_whole = self.rest_ns == 0 && other.rest_ns == 0;
        if is_whole || self.s.abs() > LARGEST_S || other.s.abs() > LARGEST_S {
            return self.s - other.s;
        }
        (i128::from(self.ns()) - i128::from(other.ns())) as f64 / 1e9
    }

    /// The time `seconds` later.
    #[must_use]
    pub fn plus(self, seconds: f64) -> Self {
        let s = self.s + seconds;
        if self.s.abs() < COARSE_S || s.abs() > LARGEST_S {
            return Self { s, rest_ns: 0 };
        }
        Self::from_ns(self.ns().saturating_add((seconds * 1e9).round() as i64))
    }

    /// Which of two times is later.
    #[must_use]
    pub fn total_cmp(&self, other: &Self) -> Ordering {
        let by_rest = || self.rest_ns.cmp(&other.rest_ns);
        self.s.total_cmp(&other.s).then_with(by_rest)
    }
}

/// Seconds: to the nanosecond where something is left, else as the double is.
impl fmt::Display for FrameTime {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.rest_ns == 0 {
            return write!(f, "{}", self.s);
        }
        let ns = self.ns().unsigned_abs();
        let sign = if self.ns() < 0 { "-" } else { "" };
        write!(f, "{sign}{}.{:09}", ns / 1_000_000_000, ns % 1_000_000_000)
    }
}

impl From<f64> for FrameTime {
    fn from(s: f64) -> Self {
        Self { s, rest_ns: 0 }
    }
}

fn whole_ns(s: f64) -> i64 {
    let whole = s.floor();
    (whole as i64).saturating_mul(1_000_000_000).saturating_add(((s - whole) * 1e9).round() as i64)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn no_nanosecond_is_lost(ns in -2_000_000_000_000_000_000..4_000_000_000_000_000_000_i64, later in 0..9_000_000_000_i64) {
            let (time, after) = (FrameTime::from_ns(ns), FrameTime::from_ns(ns + later));
            prop_assert_eq!(time.ns(), ns);
            // Doubles alone are subtracted as they are; a short time has no more than a double's digits.
            let is_short = time.rest_ns == 0 && after.rest_ns == 0;
            let rounding_s = if is_short { time.s.abs().max(after.s.abs()) * f64::EPSILON } else { 0.0 };
            prop_assert!((after.since(time) - later as f64 / 1e9).abs() <= rounding_s, "{:?} {:?}", time, after);
            prop_assert!(time.rest_ns.abs() <= 256, "{:?}", time);
            prop_assert_eq!(time.total_cmp(&after), 0.cmp(&later));
            let off_ns = time.plus(later as f64 / 1e9).ns() - (ns + later);
            prop_assert!(off_ns.abs() <= i64::from(time.s.abs() < COARSE_S), "{}", off_ns);
        }

        #[test]
        fn a_short_time_is_the_double_alone(ns in 0..8_000_000_000_000_000_i64, digits in 0..15_u32) {
            // Of any size, and as a table has it.
            let ns = ns / 10_i64.pow(digits);
            let time = FrameTime::from_ns(ns);
            let written = format!("{}.{:09}", ns / 1_000_000_000, ns % 1_000_000_000);
            prop_assert_eq!((time.s, time.rest_ns), (written.parse().unwrap(), 0), "{}", written);
        }
    }

    #[test]
    fn what_is_no_time_of_a_clock_is_a_difference_of_doubles() {
        assert_eq!(FrameTime::from(1e300).since(FrameTime::from(-1e300)), 2e300);
        assert_eq!(FrameTime::from(0.3).since(FrameTime::from(0.1)), 0.3 - 0.1);
        assert_eq!(FrameTime { s: 1e300, rest_ns: 5 }.since(FrameTime::from(0.0)), 1e300);
    }
}
