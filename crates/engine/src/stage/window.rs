//! How fast a value changes: the slope of the line of least squares through what it was over a window of time.
//!
//! Where the value is made of several members, only what members that are there before and after tell moves it: one that is
//! lost for a while would else look like motion.

use std::collections::VecDeque;

/// Samples that are kept of a window: a denser series is thinned out to about these.
const SAMPLES: f64 = 128.0;
/// Share of the window that samples must span before there is a slope.
const SPANNED: f64 = 0.5;
/// Windows without a frame that are a gap.
const GAP: f64 = 2.0;
/// How far a span of time may be off, as a share of the window.
const ROUNDING: f64 = 1e-9;

/// The samples of a value over a window that ends now.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Window {
    /// Time, s, and value.
    samples: VecDeque<[f64; 2]>,
}

impl Window {
    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        self.samples.clear();
    }

    /// Takes `value` at `t_s`; gives the slope, per second, over the last `window_s`, where samples span enough of it: from the last
    /// sample on that is as old, so that slow frames have a slope too. What is before a gap, of two windows in frames that were not
    /// slow, is forgotten.
    ///
    /// The last sample is the newest value, whatever the distance to the one before: that is replaced until it lies far enough
    /// from its own predecessor. So the slope is the same however frames are cut into calls.
    pub(crate) fn take(&mut self, t_s: f64, value: f64, window_s: f64) -> Option<f64> {
        // What a time of this size, and a difference of two, lose to rounding: of today's time 0.5 µs.
        let slack_s = ROUNDING * window_s + 2.0 * f64::EPSILON * t_s.abs();
        match self.samples.back() {
            // Of frames with one time the last counts: coarse clocks give many of them.
            Some(&[last, _]) if t_s == last => drop(self.samples.pop_back()),
            Some(&[last, _]) if t_s > last && !self.is_gap(t_s - last, window_s + slack_s) => {}
            _ => self.samples.clear(),
        }
        if !t_s.is_finite() {
            return None;
        }
        let count = self.samples.len();
        let is_near = count > 1 && self.samples[count - 1][0] - self.samples[count - 2][0] < window_s / SAMPLES;
        if is_near {
            self.samples.pop_back();
        }
        self.samples.push_back([t_s, value]);
        while self.samples.get(1).is_some_and(|&[second, _]| t_s - second >= window_s - slack_s) {
            self.samples.pop_front();
        }
        // A single frame before a gap does not say that it was one.
        if self.samples.len() > 2 && t_s - self.samples[0][0] > GAP * window_s + slack_s {
            self.samples.pop_front();
        }
        let span_s = t_s - self.samples.front()?[0];
        (span_s >= SPANNED * window_s - slack_s).then(|| self.slope())
    }

    /// Whether the next frame comes after a gap if it comes `after_s` after the last one.
    fn is_gap(&self, after_s: f64, window_s: f64) -> bool {
        let mut last = self.samples.iter().rev().map(|[t_s, _]| t_s);
        let are_slow = last.next().zip(last.next()).is_none_or(|(last, before)| last - before > window_s);
        !are_slow && after_s > GAP * window_s
    }

    /// Σ(t − t̄)(x − x̄) / Σ(t − t̄)².
    fn slope(&self) -> f64 {
        let count = self.samples.len() as f64;
        let origin = self.samples[0];
        let [sum_t, sum_x] = self
            .samples
            .iter()
            .fold([0.0; 2], |[t, x], sample| [t + (sample[0] - origin[0]), x + (sample[1] - origin[1])]);
        let [mean_t, mean_x] = [sum_t / count, sum_x / count];
        let [across, along] = self.samples.iter().fold([0.0; 2], |[across, along], sample| {
            let [t, x] = [sample[0] - origin[0] - mean_t, sample[1] - origin[1] - mean_x];
            [across + t * x, along + t * t]
        });
        across / along
    }
}

/// A value that is made of the values of several members, over a window.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Trend {
    window: Window,
    /// What the value would be now if all members had been there all the time, and by how much that is more than it is.
    level: f64,
    above: f64,
    /// What each member was when the value was known last, by ascending member.
    before: Vec<(usize, f64)>,
}

impl Trend {
    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        self.window.clear();
        self.before.clear();
    }

    /// Whether a member that had a finite value when the value was known last has none `now`.
    pub(crate) fn misses_one(&self, now: &[(usize, f64)]) -> bool {
        let has_value = |member: usize| now.binary_search_by_key(&member, |of| of.0).is_ok();
        self.before.iter().any(|&(member, before)| before.is_finite() && !has_value(member))
    }

    /// Takes what the members are at `t_s` that have a value, by ascending member; `value_of` makes the value of some of them, if there is
    /// one. Gives its slope, per second, over the last `window_s`, where samples span enough of it.
    pub(crate) fn take(
        &mut self,
        t_s: f64,
        now: &[(usize, f64)],
        window_s: f64,
        value_of: impl Fn(&mut dyn Iterator<Item = (usize, f64)>) -> Option<f64>,
    ) -> Option<f64> {
        let Some(value) = value_of(&mut now.iter().copied()) else {
            self.window.clear();
            return None;
        };
        // As long as they are the same, nothing adds up from frame to frame, and no rounding stays.
        if !are_of_same_members(now, &self.before) {
            let was = value_of(&mut also_in(&self.before, now));
            let is = value_of(&mut also_in(now, &self.before));
            if let (Some(was), Some(is)) = (was, is) {
                self.above = self.level + (is - was) - value;
            } else {
                self.window.clear();
                self.above = 0.0;
            }
        }
        self.level = value + self.above;
        self.before.clear();
        self.before.extend_from_slice(now);
        self.window.take(t_s, self.level, window_s)
    }
}

fn are_of_same_members(one: &[(usize, f64)], other: &[(usize, f64)]) -> bool {
    let members = |of: &(usize, f64)| of.0;
    one.iter().map(members).eq(other.iter().map(members))
}

/// Those `of` whose members `other` has, too.
fn also_in(of: &[(usize, f64)], other: &[(usize, f64)]) -> impl Iterator<Item = (usize, f64)> {
    let mut others = other.iter().map(|(member, _)| *member).peekable();
    of.iter().copied().filter(move |(member, _)| {
        while others.next_if(|other| other < member).is_some() {}
        others.peek() == Some(member)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Those of `now` that have a value.
    fn there(now: &[Option<f64>]) -> Vec<(usize, f64)> {
        now.iter().enumerate().filter_map(|(member, now)| Some((member, (*now)?))).collect()
    }

    fn mean(members: &mut dyn Iterator<Item = (usize, f64)>) -> Option<f64> {
        let [sum, count] = members.fold([0.0; 2], |[sum, count], (_, value)| [sum + value, count + 1.0]);
        (count > 0.0).then(|| sum / count)
    }

    #[test]
    fn a_member_that_is_lost_for_a_while_does_not_move_the_value() {
        let mut trend = Trend::default();
        for frame in 0..199 {
            let t_s = 0.01 * f64::from(frame);
            // One of them is 30 K warmer, and lost now and then.
            let warm = (frame % 7 != 3).then_some(50.0 + 2.0 * t_s);
            let slope = trend.take(t_s, &there(&[Some(20.0 + 2.0 * t_s), warm]), 0.5, mean);
            assert!(
                slope.is_none_or(|slope| (slope - 2.0).abs() < 1e-9) && slope.is_some() == (frame >= 25),
                "{slope:?}"
            );
        }
        // Where no member stays, nothing is known of what was before.
        assert!(trend.take(1.99, &there(&[None, Some(54.0)]), 0.5, mean).is_some());
        assert_eq!(trend.take(2.0, &there(&[Some(24.0), None]), 0.5, mean), None);
    }

    #[test]
    fn a_wild_reading_leaves_nothing_behind() {
        let mut trend = Trend::default();
        for frame in 0..3000 {
            // It comes after a sample that stays, and the next frame takes its place.
            let wild = if frame == 1001 { 1e17 } else { 20.3 };
            let slope = trend.take(1e-3 * f64::from(frame), &there(&[Some(wild), Some(20.1)]), 1.0, mean);
            assert!(frame == 1001 || slope.is_none_or(|slope| slope.abs() < 1e-9), "{frame}: {slope:?}");
        }
        // What is equal in time is one sample, the last.
        let mut window = Window::default();
        let slopes = (0..600).map(|frame| {
            let t_s = 0.01 * f64::from(frame / 3);
            (t_s, window.take(t_s, 7.0 - 4.0 * t_s + f64::from(frame % 3 - 2), 0.5))
        });
        for (t_s, slope) in slopes.skip(2).step_by(3) {
            assert!(t_s < 0.25 || (slope.unwrap() + 4.0).abs() < 1e-9, "{t_s}: {slope:?}");
        }
        assert!(window.samples.len() < 60);
        // No time is none, and does not stay.
        for wrong in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(window.take(wrong, 1.0, 0.5), None);
            let last = (0..100).filter_map(|frame| window.take(3.0 + 0.01 * f64::from(frame), 1.0, 0.5)).last();
            assert_eq!(last, Some(0.0));
        }
    }

    #[test]
    fn slow_frames_have_the_slope_from_one_to_the_next() {
        let mut window = Window::default();
        assert_eq!(window.take(0.0, 1.0, 0.1), None);
        assert!((window.take(0.2, 2.0, 0.1).unwrap() - 5.0).abs() < 1e-12);
        assert_eq!(window.take(0.4, 2.0, 0.1), Some(0.0));
    }

    #[test]
    fn a_line_has_its_slope_once_half_the_window_is_there() {
        let mut window = Window::default();
        for frame in 0..400 {
            let t_s = 100.0 + 0.005 * f64::from(frame);
            let slope = window.take(t_s, 3.0 - 2.0 * t_s, 1.0);
            assert_eq!(slope.is_some(), frame >= 100, "{frame}");
            assert!(slope.is_none_or(|slope| (slope + 2.0).abs() < 1e-9), "{slope:?}");
        }
        assert!(window.samples.len() <= SAMPLES as usize + 2, "{}", window.samples.len());
    }

    #[test]
    fn a_time_of_day_changes_no_slope() {
        for begin_s in [0.0, 5.0, 1_764_453_600.0] {
            let mut window = Window::default();
            // Toward and away in turns: a sample more or less would show.
            for frame in 0..400 {
                let t_s = begin_s + 0.05 * f64::from(frame);
                let slope = window.take(t_s, f64::from(frame % 2), 0.1);
                let is_right = frame < 2 || slope.is_some_and(|slope| slope.abs() < 1e-3);
                assert!(is_right && slope.is_some() == (frame > 0), "{begin_s} s, frame {frame}: {slope:?}");
            }
        }
    }

    #[test]
    fn what_is_older_than_the_window_does_not_count() {
        let mut window = Window::default();
        for frame in 0..100 {
            window.take(f64::from(frame) * 0.01, 50.0, 0.5);
        }
        let slopes = (100..200).map(|frame| {
            let t_s = f64::from(frame) * 0.01;
            window.take(t_s, 50.0 + 4.0 * (t_s - 0.99), 0.5).unwrap()
        });
        let slopes: Vec<f64> = slopes.collect();
        assert!(slopes[5] > 0.1 && slopes[5] < 3.0 && (slopes[60] - 4.0).abs() < 1e-9, "{slopes:?}");
    }

    #[test]
    fn what_was_before_a_gap_does_not_count() {
        for before in [1, 2, 300] {
            let mut window = Window::default();
            for frame in 0..before {
                window.take(f64::from(frame) * 0.01, 50.0, 0.5);
            }
            let after = |frame: u32| (10.0 + f64::from(frame) * 0.01, 50.0 + 0.04 * f64::from(frame));
            // One frame alone may be a slow one.
            let first = window.take(after(0).0, after(0).1, 0.5);
            assert_eq!(first.is_some(), before == 1, "{first:?}");
            for frame in 1..100 {
                let (t_s, value) = after(frame);
                let slope = window.take(t_s, value, 0.5);
                assert_eq!(slope.is_some(), frame >= 50 / 2, "{frame}");
                assert!(slope.is_none_or(|slope| (slope - 4.0).abs() < 1e-9), "{slope:?}");
            }
        }
        // Frames that are always slow have none.
        let mut window = Window::default();
        let slopes: Vec<_> = (0..5).map(|second| window.take(f64::from(second), f64::from(second), 0.1)).collect();
        assert!(slopes[0].is_none() && slopes[1..].iter().all(|slope| slope.is_some_and(|slope| slope == 1.0)));
    }

    #[test]
    fn noise_averages_out_and_time_that_goes_back_starts_anew() {
        let mut window = Window::default();
        let noise = |frame: u32| f64::from((frame * 7919) % 101) / 50.0 - 1.0;
        let last = (0..1000).filter_map(|frame| window.take(f64::from(frame) * 1e-3, noise(frame), 1.0)).last();
        assert!(last.unwrap().abs() < 0.5, "{last:?}");
        assert_eq!(window.take(0.5, 0.0, 1.0), None);
    }
}
