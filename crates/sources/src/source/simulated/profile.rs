//! A piecewise linear function of time: force, or an indenter's angle.

/// Points (t in s, value) with times that increase.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Profile {
    points: Vec<(f64, f64)>,
}

/// Linear pieces of a tap's bell.
const BELL_PIECES: u32 = 16;

impl Profile {
    /// `points` is not empty and its times increase.
    pub(super) fn new(points: Vec<(f64, f64)>) -> Self {
        Self { points }
    }

    pub(super) fn constant(value: f64) -> Self {
        Self { points: vec![(0.0, value)] }
    }

    /// A bell (a raised cosine) of height `peak` and length `lasts_s` at each of `starts_s`, which increase without overlap;
    /// 0 in between.
    pub(super) fn bells(starts_s: &[f64], peak: f64, lasts_s: f64) -> Self {
        let mut points: Vec<(f64, f64)> = Vec::new();
        for &start in starts_s {
            for piece in 0..=BELL_PIECES {
                let share = f64::from(piece) / f64::from(BELL_PIECES);
                let height = match piece {
                    0 | BELL_PIECES => 0.0,
                    _ => (1.0 - libm::cos(std::f64::consts::TAU * share)) / 2.0,
                };
                let t_s = start + share * lasts_s;
                if points.last().is_none_or(|&(before, _)| t_s > before) {
                    points.push((t_s, peak * height));
                }
            }
        }
        Self { points }
    }

    /// The value at `t_s`, if it lies within the points.
    pub(super) fn within(&self, t_s: f64) -> Option<f64> {
        let (first, last) = (self.points[0], self.points[self.points.len() - 1]);
        if !(first.0..=last.0).contains(&t_s) {
            return None;
        }
        let next = self.points.partition_point(|&(t, _)| t <= t_s);
        let (t0, v0) = self.points[next - 1];
        Some(match self.points.get(next) {
            None => v0,
            Some(&(t1, v1)) => v0 + (v1 - v0) * ((t_s - t0) / (t1 - t0)),
        })
    }

    /// The value at `t_s`, the first before its points and the last after them.
    pub(super) fn held(&self, t_s: f64) -> f64 {
        let (first, last) = (self.points[0], self.points[self.points.len() - 1]);
        self.within(t_s).unwrap_or(if t_s < first.0 { first.1 } else { last.1 })
    }

    pub(super) fn times(&self) -> impl Iterator<Item = f64> + '_ {
        self.points.iter().map(|&(t_s, _)| t_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_linear_between_its_points() {
        let profile = Profile::new(vec![(1.0, 2.0), (2.0, 4.0), (4.0, 0.0)]);
        assert_eq!([1.0, 1.5, 2.0, 3.0, 4.0].map(|t| profile.within(t)), [2.0, 3.0, 4.0, 2.0, 0.0].map(Some));
        assert_eq!([0.9, 4.1, f64::NAN].map(|t| profile.within(t)), [None; 3]);
        assert_eq!((profile.held(0.0), profile.held(9.0)), (2.0, 0.0));
        assert_eq!(Profile::constant(3.0).held(7.0), 3.0);
    }

    #[test]
    fn bells_rise_and_fall_and_touch_nothing_between() {
        let bells = Profile::bells(&[1.0, 1.5, 3.0], 8.0, 0.5);
        assert_eq!(bells.within(1.25), Some(8.0));
        assert_eq!([1.0, 1.5, 2.0, 2.5, 3.0].map(|t| bells.within(t)), [Some(0.0); 5]);
        assert!(bells.times().zip(bells.times().skip(1)).all(|(a, b)| a < b));
    }
}
