//! Whether a column is the time, or a count.

use std::time::Duration;

use super::super::super::time_column::{TimeUnit, by_size};

/// Rows that are needed to tell.
const LEAST_ROWS: usize = 5;
/// Input that took so long to arrive came as it was made, s.
const LEAST_SPAN_S: f64 = 0.3;

/// What a column that nobody names is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rising {
    /// The time; and whether its unit is guessed.
    Time(TimeUnit, bool),
    /// It counts rows.
    Count,
    /// It rises like a time, in no unit that is known.
    Unknown,
    No,
}

/// What the column is that has `values`, which arrived `at` these times.
pub(super) fn rising(values: &[f64], at: &[Duration]) -> Rising {
    let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if values.len() < LEAST_ROWS || steps.iter().any(|step| step.is_nan() || *step <= 0.0) {
        return Rising::No;
    }
    let low = steps.iter().copied().fold(f64::INFINITY, f64::min);
    let high = steps.iter().copied().fold(0.0, f64::max);
    let (Some(first), Some(last)) = (values.first(), values.last()) else { return Rising::No };
    let took_s = match (at.first(), at.last()) {
        (Some(first), Some(last)) => (*last - *first).as_secs_f64(),
        _ => 0.0,
    };
    if took_s >= LEAST_SPAN_S {
        let per_second = (last - first) / took_s;
        let units = [TimeUnit::Seconds, TimeUnit::Milliseconds, TimeUnit::Microseconds, TimeUnit::Nanoseconds];
        if let Some(unit) = units.into_iter().find(|unit| (0.75..1.33).contains(&(per_second / unit.seconds()))) {
            return Rising::Time(unit, false);
        }
    }
    let by_size = by_size(*first);
    if by_size != TimeUnit::Seconds {
        return Rising::Time(by_size, false);
    }
    if high > 3.0 * low {
        return Rising::No;
    }
    if low == 1.0 && high == 1.0 {
        return Rising::Count;
    }
    if took_s >= LEAST_SPAN_S {
        return Rising::Unknown;
    }
    // A file that is played as fast as it can be read: whole numbers are what boards call millis().
    let is_whole = values.iter().all(|value| value.fract() == 0.0);
    Rising::Time(if is_whole { TimeUnit::Milliseconds } else { TimeUnit::Seconds }, true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_is_a_time_where_it_goes_with_the_clock() {
        let made = |first: f64, step: f64, every_ms: u64| {
            let values: Vec<f64> = (0..20).map(|row| first + step * f64::from(row)).collect();
            let at: Vec<Duration> = (0..20).map(|row| Duration::from_millis(row * every_ms)).collect();
            rising(&values, &at)
        };
        assert_eq!(made(5000.0, 20.0, 20), Rising::Time(TimeUnit::Milliseconds, false));
        assert_eq!(made(0.5, 0.02, 20), Rising::Time(TimeUnit::Seconds, false));
        assert_eq!(made(7e6, 20_000.0, 20), Rising::Time(TimeUnit::Microseconds, false));
        assert_eq!(made(1.0, 1.0, 20), Rising::Count);
        assert_eq!(made(1.0, 12.0, 20), Rising::Unknown);
        assert_eq!(made(40.0, 20.0, 0), Rising::Time(TimeUnit::Milliseconds, true));
        assert_eq!(made(0.0, 0.02, 0), Rising::Time(TimeUnit::Seconds, true));
        assert_eq!(made(1_768_494_979_568.0, 20.0, 0), Rising::Time(TimeUnit::Milliseconds, false));
        assert_eq!(made(9.0, 0.0, 20), Rising::No);
        assert_eq!(rising(&[1.0, 2.0], &[]), Rising::No);
        assert_eq!(rising(&[1.0, 2.0, 9.0, 10.0, 12.0], &[]), Rising::No);
    }
}
