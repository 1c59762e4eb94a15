//! How fast a value changes: the slope of the line of least squares through what it was over a window of time.

use std::collections::VecDeque;

/// Samples that are kept of a window: a denser series is thinned out to about these.
const SAMPLES: f64 = 128.0;
/// Share of the window that samples must span before there is a slope.
const SPANNED: f64 = 0.5;

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

    /// Takes `value` at `t_s`; gives the slope, per second, over the last `window_s`, where samples span enough of it.
    ///
    /// The last sample is the newest value, whatever the distance to the one before: that is replaced until it lies far enough
    /// from its own predecessor. So the slope is the same however frames are cut into calls.
    pub(crate) fn take(&mut self, t_s: f64, value: f64, window_s: f64) -> Option<f64> {
        if self.samples.back().is_some_and(|&[last, _]| t_s <= last) {
            self.samples.clear();
        }
        let count = self.samples.len();
        let is_near = count > 1 && self.samples[count - 1][0] - self.samples[count - 2][0] < window_s / SAMPLES;
        if is_near {
            self.samples.pop_back();
        }
        self.samples.push_back([t_s, value]);
        while self.samples.front().is_some_and(|&[first, _]| t_s - first > window_s * (1.0 + 1e-9)) {
            self.samples.pop_front();
        }
        let span_s = t_s - self.samples.front()?[0];
        (span_s >= SPANNED * window_s).then(|| self.slope())
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

#[cfg(test)]
mod tests {
    use super::*;

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
    fn noise_averages_out_and_time_that_goes_back_starts_anew() {
        let mut window = Window::default();
        let noise = |frame: u32| f64::from((frame * 7919) % 101) / 50.0 - 1.0;
        let last = (0..1000).filter_map(|frame| window.take(f64::from(frame) * 1e-3, noise(frame), 1.0)).last();
        assert!(last.unwrap().abs() < 0.5, "{last:?}");
        assert_eq!(window.take(0.5, 0.0, 1.0), None);
    }
}
