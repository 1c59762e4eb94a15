//! Evidence that a taxel is pressed: its raw value has risen fast and not fallen fast since.
//!
//! Drift is slow, onsets and releases are fast. Changes between epochs of more than a quarter of the touch threshold are
//! summed; slower ones are followed as drift. The sum stays at the height of a press until its release.

/// Changes between epochs up to this share of the touch threshold are slow.
const SLOW_SHARE: f64 = 0.25;
/// Share of a slow change that is followed per epoch.
const FOLLOW_RATE: f64 = 0.25;
/// A rise above this share of the touch threshold is a press: slow parts of two edges may each have lost a quarter.
const PRESS_SHARE: f64 = 0.5;
/// A rise up to this share of its maximum is residual: sensors do not return exactly to their rest.
const RESIDUAL_SHARE: f64 = 1.0 / 16.0;

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PressEvidence {
    /// The raw value from which changes are measured.
    level: f64,
    /// Sum of fast changes towards a press, raw units.
    rise: f64,
    max_rise: f64,
}

/// A taxel's touch threshold and direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct TouchSense {
    /// Change of the raw value from the baseline that counts as a touch.
    pub(super) felt: f64,
    /// Sign of the change under pressure: 1 or −1.
    pub(super) direction: f64,
}

impl TouchSense {
    pub(super) fn is_slow(self, change: f64) -> bool {
        change.abs() <= SLOW_SHARE * self.felt
    }
}

impl PressEvidence {
    /// No evidence: the taxel is at rest at `baseline`.
    pub(super) fn none(baseline: f64) -> Self {
        Self { level: baseline, ..Self::default() }
    }

    /// Takes the raw value `now` of the next epoch, given the common `drift` and the `baseline`.
    pub(super) fn follow(&mut self, now: f64, drift: f64, baseline: f64, sense: TouchSense) {
        self.level += drift;
        let change = now - self.level;
        if sense.is_slow(change) {
            self.level += FOLLOW_RATE * change;
        } else {
            self.level = now;
            self.rise += sense.direction * change;
        }
        // A press is between 0 and the present value above the baseline.
        self.rise = self.rise.min(sense.direction * (now - baseline)).max(0.0);
        self.max_rise = self.max_rise.max(self.rise);
    }

    pub(super) fn is_press(&self, sense: TouchSense) -> bool {
        self.rise > (PRESS_SHARE * sense.felt).max(RESIDUAL_SHARE * self.max_rise)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SENSE: TouchSense = TouchSense { felt: 12.0, direction: -1.0 };

    /// Whether evidence shows a press after each of these raw values, from a baseline of 500.
    fn shown(values: &[f64]) -> Vec<bool> {
        let mut evidence = PressEvidence::none(500.0);
        let mut show = |&value: &f64| {
            evidence.follow(value, 0.0, 500.0, SENSE);
            evidence.is_press(SENSE)
        };
        values.iter().map(&mut show).collect()
    }

    #[test]
    fn a_press_is_shown_from_onset_to_release_whatever_drifts() {
        let mut values = vec![500.0, 300.0, 100.0];
        values.extend((0..300).map(|second| 100.0 - 0.3 * f64::from(second)));
        // It comes back to where 90 counts of drift have taken it.
        values.extend([200.0, 410.0, 410.0]);
        let shown = shown(&values);
        assert!(!shown[0] && shown[1..304].iter().all(|&shown| shown));
        assert_eq!(shown[304..], [false, false]);
    }

    #[test]
    fn a_light_touch_that_is_left_is_shown() {
        assert_eq!(shown(&[480.0, 480.0, 300.0, 484.0, 484.0]), [true; 5]);
        assert_eq!(shown(&[487.0, 487.0, 487.0]), [true; 3]);
        assert_eq!(shown(&[499.0, 502.0, 500.0]), [false; 3]);
    }
}
