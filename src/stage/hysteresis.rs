//! **hysteresis**: when a field counts as touched.
//!
//! Contact begins when S rises over `on` and ends when it falls to `off` or below: contact(t) = S > on, or S > off and
//! contact(t − 1). Both thresholds are 0 unless the calibration gives them, and then contact is S > 0.
//!
//! A field that is pressed and not in contact keeps its sums, and loses what needs a touch.
//!
//! **Bound.** S carries the bound of its sum. A decision whose margin is below that is in doubt, and so is every later
//! one that hangs on it: until S leaves the band between the thresholds.

/// The sums at which a field's contact begins and ends, in the unit of S.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Thresholds {
    pub(crate) on: f32,
    pub(crate) off: f32,
}

/// Contact, and whether single precision might see it otherwise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ContactState {
    pub(crate) contact: bool,
    pub(crate) in_doubt: bool,
}

/// What is right, in f64: contact given S, and whether there was contact before.
pub(crate) fn reference(total: f64, thresholds: Thresholds, before: bool) -> bool {
    total > f64::from(thresholds.on) || (before && total > f64::from(thresholds.off))
}

/// The next state, with the doubt that a sum off by up to `bound` leaves.
pub(crate) fn doubt(total: f64, bound: f64, thresholds: Thresholds, before: ContactState) -> ContactState {
    let contact = reference(total, thresholds, before.contact);
    let near = |threshold: f32| threshold > 0.0 && (total - f64::from(threshold)).abs() <= bound;
    let between = total > f64::from(thresholds.off) && total <= f64::from(thresholds.on);
    let in_doubt = near(thresholds.on) || near(thresholds.off) || (between && before.in_doubt);
    ContactState { contact, in_doubt }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contact_ends_lower_than_it_begins() {
        let thresholds = Thresholds { on: 10.0, off: 4.0 };
        let mut state = ContactState::default();
        let mut seen = Vec::new();
        for total in [0.0, 9.0, 10.0, 11.0, 7.0, 5.0, 4.0, 5.0, 0.0] {
            state = doubt(total, 0.0, thresholds, state);
            seen.push(state.contact);
        }
        assert_eq!(seen, [false, false, false, true, true, true, false, false, false]);
    }

    #[test]
    fn doubt_lasts_until_the_sum_leaves_the_band() {
        let thresholds = Thresholds { on: 10.0, off: 4.0 };
        let mut state = ContactState::default();
        let mut seen = Vec::new();
        for total in [10.1, 7.0, 7.0, 12.0, 7.0, 3.0] {
            state = doubt(total, 0.2, thresholds, state);
            seen.push(state.in_doubt);
        }
        assert_eq!(seen, [true, true, true, false, false, false]);
    }
}
