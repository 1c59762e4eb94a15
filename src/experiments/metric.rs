//! Errors of percepts.

use std::f64::consts::PI;

/// The angle between two lines, rad in [0, π/2]: a line's angle counts modulo π.
pub(super) fn between_lines(a: f64, b: f64) -> f64 {
    let turned = (a - b).rem_euclid(PI);
    turned.min(PI - turned)
}

/// The component of `error` across a line at `angle`, in the error's unit.
///
/// Sensors cannot measure the motion of a long rod along itself.
pub(super) fn across(error: [f64; 2], angle: f64) -> f64 {
    (error[1] * libm::cos(angle) - error[0] * libm::sin(angle)).abs()
}

/// Root mean square and worst of many errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Errors {
    count: u64,
    squares: f64,
    worst: f64,
}

impl Errors {
    pub(super) fn add(&mut self, error: f64) {
        self.count += 1;
        self.squares += error * error;
        self.worst = self.worst.max(error.abs());
    }

    pub(super) fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.squares += other.squares;
        self.worst = self.worst.max(other.worst);
    }

    /// RMS and worst, if there was anything to compare.
    pub(super) fn summary(&self) -> Option<[f64; 2]> {
        (self.count > 0).then(|| [(self.squares / self.count as f64).sqrt(), self.worst])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_compared_across_the_seam() {
        let degrees = |a: f64, b: f64| between_lines(a.to_radians(), b.to_radians()).to_degrees();
        for (a, b, apart) in [(1.0, 179.0, 2.0), (0.0, 180.0, 0.0), (10.0, 100.0, 90.0), (170.0, 40.0, 50.0)] {
            assert!((degrees(a, b) - apart).abs() < 1e-9 && (degrees(b, a) - apart).abs() < 1e-9, "{a} {b}");
        }
        assert!((degrees(-350.0, 5.0) - 5.0).abs() < 1e-9);
    }

    #[test]
    fn an_error_along_a_rod_is_none() {
        let along = [2.0_f64.sqrt(), 2.0_f64.sqrt()];
        assert!(across(along, PI / 4.0) < 1e-12);
        assert!((across(along, 3.0 * PI / 4.0) - 2.0).abs() < 1e-12);
        assert_eq!(across([0.0, -3.0], 0.0), 3.0);
    }

    #[test]
    fn errors_add_up_however_they_are_grouped() {
        let mut all = Errors::default();
        assert_eq!(all.summary(), None);
        let mut rest = Errors::default();
        all.add(-3.0);
        rest.add(4.0);
        rest.add(0.0);
        all.merge(&rest);
        assert_eq!(all.summary(), Some([(25.0_f64 / 3.0).sqrt(), 4.0]));
    }
}
