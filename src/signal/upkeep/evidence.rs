//! What shows that a taxel is pressed: that its raw value went up at once, and has not come back at once.
//!
//! Drift is slow, onsets and releases are fast. Changes of more than a quarter of what is felt between epochs are added
//! up; slower ones are followed and not counted. A press so leaves evidence as high as it rose, for as long as it lasts,
//! whatever drifts meanwhile, and its release takes it away again.

/// Changes between epochs up to this share of what is felt are slow.
const SLOW: f64 = 0.25;
/// How much of a slow change is followed in an epoch.
const FOLLOWED: f64 = 0.25;
/// Evidence over this share of what is felt shows a press: two edges may each have lost a quarter to slowness.
const SHOWN: f64 = 0.5;
/// What remains of a press after its release is no press: sensors come back to their rest only about.
const REMAINS: f64 = 1.0 / 16.0;

/// The evidence of one taxel.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Evidence {
    /// The raw value that it is measured from.
    level: f64,
    /// How far it has risen at once, raw units.
    risen: f64,
    /// The most that has been, since it was at rest.
    most: f64,
}

/// What evidence is told by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sense {
    /// How far the raw value must go from the baseline for the taxel to be felt.
    pub(super) felt: f64,
    /// Which way it goes when pressed: 1 or −1.
    pub(super) direction: f64,
}

impl Sense {
    /// Whether values that differ so are at rest.
    pub(super) fn is_slow(self, change: f64) -> bool {
        change.abs() <= SLOW * self.felt
    }
}

impl Evidence {
    /// None: the taxel is at rest at `baseline`.
    pub(super) fn none(baseline: f64) -> Self {
        Self { level: baseline, ..Self::default() }
    }

    /// The next epoch has the raw value `now`; `drift` is what all have drifted, and `baseline` what is at rest.
    pub(super) fn follow(&mut self, now: f64, drift: f64, baseline: f64, sense: Sense) {
        self.level += drift;
        let change = now - self.level;
        if sense.is_slow(change) {
            self.level += FOLLOWED * change;
        } else {
            self.level = now;
            self.risen += sense.direction * change;
        }
        // Nothing is pressed by more than it stands over its rest, nor by less than nothing.
        self.risen = self.risen.min(sense.direction * (now - baseline)).max(0.0);
        self.most = self.most.max(self.risen);
    }

    /// Whether it shows a press.
    pub(super) fn shows(&self, sense: Sense) -> bool {
        self.risen > (SHOWN * sense.felt).max(REMAINS * self.most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SENSE: Sense = Sense { felt: 12.0, direction: -1.0 };

    /// Whether evidence shows a press after each of these raw values, from a baseline of 500.
    fn shown(values: &[f64]) -> Vec<bool> {
        let mut evidence = Evidence::none(500.0);
        let mut show = |&value: &f64| {
            evidence.follow(value, 0.0, 500.0, SENSE);
            evidence.shows(SENSE)
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
