//! **hysteresis**: when a field counts as touched.
//!
//! Contact begins when S rises over `on` and ends when it falls to `off` or below: contact(t) = S > on, or S > off and
//! contact(t − 1). Both thresholds are 0 unless the calibration gives them, and then contact is S > 0.
//!
//! A field that is pressed and not in contact keeps its sums, and loses what needs a touch.
//!
//! **Bound.** S carries the bound of its sum, and the threshold its rounding to single precision. A decision whose margin
//! is below these is in doubt. What depends on it in the next frame is compared from the backend's state.

/// The sums at which a field's contact begins and ends, in the unit of S.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Thresholds {
    pub(crate) on: f64,
    pub(crate) off: f64,
}

impl Thresholds {
    /// On and off, as single precision has them.
    pub(crate) fn rounded(self) -> [f32; 2] {
        [self.on as f32, self.off as f32]
    }
}

/// What is right, in f64: contact given S, and whether there was contact before.
pub(crate) fn reference(total: f64, thresholds: Thresholds, before: bool) -> bool {
    total > thresholds.on || (before && total > thresholds.off)
}

/// Whether single precision may see contact otherwise, given a sum that is off by up to `bound` and contact before.
pub(crate) fn in_doubt(total: f64, bound: f64, thresholds: Thresholds, before: bool) -> bool {
    let near = |threshold: f64| {
        let apart = bound + (f64::from(threshold as f32) - threshold).abs();
        threshold > 0.0 && (total - threshold).abs() <= apart
    };
    near(if before { thresholds.off } else { thresholds.on })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_threshold_that_counts_is_in_doubt() {
        let thresholds = Thresholds { on: 10.0, off: 4.0 };
        let doubts = |total, before| in_doubt(total, 0.2, thresholds, before);
        assert_eq!([9.7, 9.9, 10.2, 4.1].map(|total| doubts(total, false)), [false, true, true, false]);
        assert_eq!([9.9, 4.3, 4.1, 3.9].map(|total| doubts(total, true)), [false, false, true, true]);
        // A threshold that single precision has not: what lies between the two is over one of them.
        let third = Thresholds { on: 1.0 / 3.0, off: 0.0 };
        assert!(in_doubt((1.0_f32 / 3.0).into(), 0.0, third, false) && !in_doubt(0.333, 0.0, third, false));
        // Without thresholds contact is that a taxel is pressed.
        assert!(!in_doubt(0.0, 1.0, Thresholds::default(), false));
    }
}
