//! Times of frames that are stamped on arrival.

/// Stamps frames. Several that come at once, as USB brings them, are spread over the time since the ones before.
#[derive(Debug, Default)]
pub(super) struct Stamps {
    before_s: Option<f64>,
    /// The usual time from one frame to the next, s.
    period_s: Option<f64>,
}

impl Stamps {
    /// The usual time from one frame to the next, s, once it is known.
    pub(super) fn period_s(&self) -> Option<f64> {
        self.period_s
    }

    /// Calls `stamp` with the time of each of `count` frames, which came at once at `now_s`.
    pub(super) fn stamp(&mut self, count: usize, now_s: f64, mut stamp: impl FnMut(usize, f64)) {
        if count == 0 {
            return;
        }
        let since_s = self.before_s.map(|before_s| (now_s - before_s).max(0.0));
        let share_s = since_s.map(|since_s| since_s / count as f64);
        // After a pause frames are as near to each other as they were before.
        let step_s = match (share_s, self.period_s) {
            (Some(share_s), Some(period_s)) => share_s.min(2.0 * period_s),
            (Some(share_s), None) => share_s,
            (None, _) => 1e-6,
        };
        for index in 0..count {
            let mut t_s = now_s - step_s * (count - 1 - index) as f64;
            if let Some(before_s) = self.before_s.filter(|before_s| t_s <= *before_s) {
                t_s = before_s + 1e-6;
            }
            stamp(index, t_s);
            self.before_s = Some(t_s);
        }
        if let Some(share_s) = share_s {
            let period_s = self.period_s.unwrap_or(share_s);
            // A pause is not a period.
            self.period_s = Some(period_s + 0.1 * (share_s.min(4.0 * period_s) - period_s));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_come_together_are_spread_and_time_goes_on() {
        let mut stamps = Stamps::default();
        let mut all = Vec::new();
        for burst in 0..40 {
            stamps.stamp(4, f64::from(burst) * 0.04, |_, t_s| all.push(t_s));
        }
        assert!(all.windows(2).all(|pair| pair[1] > pair[0]));
        assert!(all[8..].windows(2).all(|pair| (pair[1] - pair[0] - 0.01).abs() < 1e-9), "{all:?}");
        // After a pause of ten seconds the frames are near its end.
        let mut after = Vec::new();
        stamps.stamp(4, 11.6, |_, t_s| after.push(t_s));
        assert!(after[0] > 11.5 && after[3] == 11.6, "{after:?}");
        stamps.stamp(2, 11.6, |_, t_s| after.push(t_s));
        assert!(after[5] > after[4] && after[4] > after[3] && after[5] < 11.61);
    }
}
