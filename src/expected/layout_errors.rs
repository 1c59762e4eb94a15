//! Errors of touches on a layout, and what touches they are of.

/// What is simulated.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct TestTouches {
    /// Number of touches.
    pub count: usize,
    /// The spacing by which the touches are sized, m; `None` is the layout's own.
    pub spacing_m: Option<f64>,
}

setters!(TestTouches { count: usize, spacing_m: impl Into<Option<f64>> });

impl Default for TestTouches {
    fn default() -> Self {
        Self { count: 400, spacing_m: None }
    }
}

/// What is found of a touch, against the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchError {
    /// Distance of its position from that of the truth, m.
    pub place_m: f64,
    /// Of a line: the angle between the principal axes, rad. Absent of one that is wrapped around a limb, or has an anisotropy under 0.4.
    pub axis_rad: Option<f64>,
    /// Its force over the true one, less 1.
    pub force: f64,
}

/// Two percentiles of errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Percentiles {
    /// Number of errors.
    pub count: usize,
    /// The middle one.
    pub median: f64,
    /// The 95th percentile.
    pub p95: f64,
}

/// The errors to expect on a layout.
#[derive(Clone, Debug, PartialEq)]
pub struct LayoutErrors {
    /// Number of pressure taxels.
    pub taxels: usize,
    /// The root of the mean cell, m.
    pub spacing_m: f64,
    /// The spacing by which the touches were sized, m.
    pub touch_spacing_m: f64,
    /// What was found of each touch; `None` of those that fewer than three taxels feel.
    pub touches: Vec<Option<TouchError>>,
}

impl Percentiles {
    /// The percentiles of `errors`, if there are any.
    fn from_errors(errors: impl Iterator<Item = f64>) -> Option<Self> {
        let mut errors: Vec<f64> = errors.collect();
        errors.sort_by(f64::total_cmp);
        let rank = |share: f64| {
            let rank = (share * errors.len() as f64).ceil() as usize;
            errors.get(rank.max(1) - 1).copied()
        };
        Some(Self { count: errors.len(), median: rank(0.5)?, p95: rank(0.95)? })
    }
}

impl LayoutErrors {
    /// The touches that count.
    pub fn counted(&self) -> impl Iterator<Item = &TouchError> {
        self.touches.iter().flatten()
    }

    /// Errors of the position, m; `None` if no touch counts.
    #[must_use]
    pub fn place_m(&self) -> Option<Percentiles> {
        Percentiles::from_errors(self.counted().map(|touch| touch.place_m))
    }

    /// Errors of the principal axes of lines, rad; `None` if none has one.
    #[must_use]
    pub fn axis_rad(&self) -> Option<Percentiles> {
        Percentiles::from_errors(self.counted().filter_map(|touch| touch.axis_rad))
    }

    /// Errors of the force, whatever their sign, as shares of it; `None` if no touch counts.
    #[must_use]
    pub fn force(&self) -> Option<Percentiles> {
        Percentiles::from_errors(self.counted().map(|touch| touch.force.abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_of_what_is_there() {
        let percentiles = Percentiles::from_errors((1..=200).rev().map(f64::from)).unwrap();
        assert_eq!(percentiles, Percentiles { count: 200, median: 100.0, p95: 190.0 });
        assert_eq!(Percentiles::from_errors([3.0].into_iter()), Some(Percentiles { count: 1, median: 3.0, p95: 3.0 }));
        assert_eq!(Percentiles::from_errors(std::iter::empty()), None);
    }
}
