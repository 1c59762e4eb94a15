//! How alike the cells of taxels are.

/// The 5th and the 95th percentile of `areas_m2` over their median, of those that are known; `None` if none is.
#[must_use]
pub fn cell_spread(areas_m2: impl IntoIterator<Item = f64>) -> Option<[f64; 2]> {
    let mut areas: Vec<f64> = areas_m2.into_iter().filter(|area| *area > 0.0).collect();
    areas.sort_by(f64::total_cmp);
    let last = areas.len().checked_sub(1)?;
    // Between two of them, in proportion.
    let at = |share: f64| {
        let place = share * last as f64;
        let below = place.floor() as usize;
        areas[below] + (areas[(below + 1).min(last)] - areas[below]) * place.fract()
    };
    let median = at(0.5);
    Some([at(0.05) / median, at(0.95) / median])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_over_the_median() {
        let areas = (0..=100).map(|i| 100.0 + f64::from(i * 7 % 101));
        let [low, high] = cell_spread(areas).unwrap();
        assert!((low - 105.0 / 150.0).abs() < 1e-12 && (high - 195.0 / 150.0).abs() < 1e-12);
        assert_eq!(cell_spread([0.0, 3.0, f64::NAN]), Some([1.0, 1.0]));
        assert_eq!(cell_spread([0.0]), None);
    }
}
