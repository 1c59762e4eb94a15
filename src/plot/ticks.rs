//! Ticks of axes: round numbers.

/// What an axis counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Numbers {
    Any,
    /// Counts and ids: nothing is between two of them.
    Whole,
    /// An angle, which ends at half a turn.
    Degrees,
}

impl Numbers {
    /// The step of about `count` ticks over `span`: 1, 2 or 5 times a power of ten, or a simple part of a turn.
    fn step(self, span: f64, count: usize) -> f64 {
        let rough = span / count.max(1) as f64;
        let reaches = |step: &f64| *step >= rough * 0.999;
        let power = 10_f64.powf(rough.log10().floor());
        let round = || [1.0, 2.0, 5.0, 10.0].into_iter().map(|by| by * power).find(reaches).unwrap_or(rough);
        match self {
            Self::Any => round(),
            Self::Whole => round().max(1.0),
            Self::Degrees if rough > 5.0 => [10.0, 15.0, 30.0, 45.0, 90.0].into_iter().find(reaches).unwrap_or(90.0),
            Self::Degrees => round(),
        }
    }

    /// About `count` round numbers from `low` to `high`.
    pub(super) fn ticks(self, [low, high]: [f64; 2], count: usize) -> Vec<f64> {
        let span = high - low;
        if !(span > 0.0 && span.is_finite()) {
            return vec![low];
        }
        let step = self.step(span, count);
        let first = (low / step - 1e-9).ceil() as i64;
        let last = (high / step + 1e-9).floor() as i64;
        (first..=last).map(|index| index as f64 * step).collect()
    }

    /// `[low, high]` widened to round numbers, with 0 if it is near. Rounding noise is no range: what is constant but for that is around
    /// the middle.
    pub(super) fn rounded(self, [low, high]: [f64; 2]) -> [f64; 2] {
        let is_constant = high - low <= RESOLUTION * low.abs().max(high.abs());
        let [low, high] = if is_constant { [(low + high) / 2.0; 2] } else { [low, high] };
        let low = if low > 0.0 && low < 0.5 * high { 0.0 } else { low };
        let high = if high < 0.0 && high > 0.5 * low { 0.0 } else { high };
        let [low, high] = if low == high {
            let half = if low == 0.0 || self == Self::Whole { 1.0 } else { low.abs() * 0.1 };
            [if low == 0.0 { 0.0 } else { low - half }, high + half]
        } else {
            let step = self.step(high - low, 8);
            [(low / step + 1e-9).floor() * step, (high / step - 1e-9).ceil() * step]
        };
        match self {
            Self::Any => [low, high],
            Self::Whole => [low.floor(), high.ceil()],
            Self::Degrees => [low.max(-180.0), high.min(180.0)],
        }
    }
}

/// About `count` round numbers from the first to the second of `range`, 1, 2 or 5 times a power of ten apart.
pub(super) fn ticks(range: [f64; 2], count: usize) -> Vec<f64> {
    Numbers::Any.ticks(range, count)
}

/// What differs by less than this share of its size is alike: values are in single precision, and quantities are made of several.
const RESOLUTION: f64 = 4e-6;

/// `value` with as many digits as a scale with steps of `step` needs.
pub(super) fn shown(value: f64, step: f64) -> String {
    let value = if value.abs() < step * 1e-6 { 0.0 } else { value };
    let text = if value != 0.0 && !(1e-3..1e6).contains(&step.max(value.abs() * 1e-3).max(1e-12)) && step < 1e-3 {
        format!("{value:.1e}")
    } else {
        let digits = (-step.log10()).ceil().clamp(0.0, 9.0) as usize;
        format!("{value:.digits$}")
    };
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rounded(range: [f64; 2]) -> [f64; 2] {
        Numbers::Any.rounded(range)
    }

    #[test]
    fn ids_have_whole_ticks_and_angles_end_at_half_a_turn() {
        let axis = |numbers: Numbers, range: [f64; 2]| {
            let range = numbers.rounded(range);
            (range, numbers.ticks(range, 4))
        };
        assert_eq!(axis(Numbers::Whole, [9.0, 9.0]), ([8.0, 10.0], vec![8.0, 9.0, 10.0]));
        assert_eq!(axis(Numbers::Whole, [205.0, 205.0]).1, [204.0, 205.0, 206.0]);
        assert_eq!(axis(Numbers::Whole, [8.0, 9.0]), ([8.0, 9.0], vec![8.0, 9.0]));
        assert_eq!(axis(Numbers::Whole, [200.0, 213.0]), ([200.0, 214.0], vec![200.0, 205.0, 210.0]));
        assert_eq!(axis(Numbers::Any, [9.0, 9.0]).1, [8.5, 9.0, 9.5], "what is not whole");
        let half_turns = vec![-180.0, -90.0, 0.0, 90.0, 180.0];
        assert_eq!(axis(Numbers::Degrees, [-179.5, 178.0]), ([-180.0, 180.0], half_turns));
        assert_eq!(axis(Numbers::Any, [-179.5, 178.0]).0, [-200.0, 200.0], "what is no angle");
        assert_eq!(axis(Numbers::Degrees, [2.0, 170.0]), ([0.0, 180.0], vec![0.0, 45.0, 90.0, 135.0, 180.0]));
        assert_eq!(axis(Numbers::Degrees, [180.0, 180.0]).0, [162.0, 180.0]);
        assert_eq!(axis(Numbers::Degrees, [20.0, 22.0]).1, [20.0, 20.5, 21.0, 21.5, 22.0]);
    }

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks([0.0, 9.7], 4), [0.0, 5.0]);
        assert_eq!(ticks([0.0, 9.7], 5), [0.0, 2.0, 4.0, 6.0, 8.0]);
        assert_eq!(ticks([-0.03, 0.04], 3).len(), 1);
        assert_eq!(ticks([5.0, 5.0], 3), [5.0]);
        assert_eq!(rounded([3.0, 97.0]), [0.0, 100.0]);
        assert_eq!(rounded([0.0, 0.0]), [0.0, 1.0]);
        // Noise is no range, and what is larger is one.
        for noise in [0.0, 1e-6, 3e-5] {
            let [low, high] = rounded([20.0 - noise, 20.0 + noise]);
            assert!((low - 18.0).abs() < 1e-3 && (high - 22.0).abs() < 1e-3, "{noise}: {low} to {high}");
        }
        let [low, high] = rounded([20.0, 20.001]);
        assert!((19.9..=20.0).contains(&low) && (20.001..20.1).contains(&high), "{low} to {high}");
        let [low, high] = rounded([-3.2, 7.1]);
        assert!(low <= -3.2 && (7.1..10.0).contains(&high));
    }

    #[test]
    fn numbers_have_the_digits_of_their_scale() {
        assert_eq!([shown(0.5, 0.5), shown(-20.0, 20.0), shown(0.0, 0.2)], ["0.5", "−20", "0.0"]);
        assert_eq!(shown(2000.0, 500.0), "2000");
    }
}
