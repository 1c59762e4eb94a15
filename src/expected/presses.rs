//! Where a layout is pressed, and how.

use crate::random::Random;
use crate::source::GivenPress;

/// Standard deviation of the pressure, and length of a line, in spacings.
pub(super) const SIGMA_SPACINGS: f64 = 0.5;
const LINE_SPACINGS: f64 = 4.0;
/// Places that are tried for each touch at most: the others are on surface without taxels.
const MAX_TRIES: usize = 200;
const SEED: u64 = 46;

/// The presses that are tried, in their order, for touches of the size of `spacing_m`: the first ones that `is_at` takes, up to
/// `count`.
pub(super) fn presses(count: usize, spacing_m: f64, mut is_at: impl FnMut(&GivenPress) -> bool) -> Vec<GivenPress> {
    let mut random = Random::new(SEED);
    let mut next = |number: usize| GivenPress {
        chance: [random.unit(), random.unit(), random.unit()],
        turns: random.unit(),
        length_m: if number.is_multiple_of(2) { 0.0 } else { LINE_SPACINGS * spacing_m },
    };
    let tried = (0..count.saturating_mul(MAX_TRIES)).map(&mut next);
    tried.filter(|press| is_at(press)).take(count).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_press_that_is_left_out_changes_no_other() {
        let all = presses(20, 0.01, |_| true);
        let mut number = 0;
        let odd = presses(10, 0.01, |_| {
            number += 1;
            number % 2 == 0
        });
        assert_eq!(odd, all.into_iter().skip(1).step_by(2).collect::<Vec<_>>());
        assert!(odd.iter().all(|press| press.length_m == 0.04));
        assert!(presses(2, 0.01, |_| false).is_empty());
    }
}
