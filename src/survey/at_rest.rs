//! Values of a sensor that nothing touches: its baseline, its noise, and how far it moved.

/// Minimum travel of a press, in dead bands.
pub(super) const MIN_TRAVEL_BANDS: f64 = 3.0;
/// Share of rest values that may exceed the noise.
const EXCEEDING_SHARE: f64 = 1e-3;

/// A sensor's baseline and noise from its values at rest, whose steps are `unit`.
///
/// The baseline is the mean of the values within three standard deviations of the median, as the median deviation tells them: a median of
/// whole numbers is off by a third of a step, and a mean of all by single wrong values. At an end of the raw range it is the median.
pub(super) fn rest_of(kept: &[f32], unit: f64) -> Option<(f64, f64)> {
    /// The standard deviation of normal values over their median deviation.
    const SIGMAS: f64 = 1.482_6;
    /// More values than this on one side alone are not strays.
    const CUT_SHARE: f64 = 0.05;
    /// Of whole numbers, means are given with two decimals: what is left of noise after a minute of frames.
    const DECIMALS: f64 = 100.0;
    let mut values: Vec<f64> = kept.iter().map(|&value| value.into()).collect();
    let middle = median(&mut values)?;
    let mut deviations: Vec<f64> = values.iter().map(|value| (value - middle).abs()).collect();
    let within = (3.0 * SIGMAS * median(&mut deviations)?).max(1.5 * unit);
    let near = || values.iter().filter(|value| (**value - middle).abs() <= within);
    // Nothing on one side and many farther than rounding takes them on the other: the end of the range cuts noise off.
    let share_beyond = |by: f64, side: f64| {
        values.iter().filter(|value| side * (**value - middle) > by).count() as f64 / values.len() as f64
    };
    let is_cut = |side: f64| share_beyond(0.0, side) <= EXCEEDING_SHARE && share_beyond(1.5 * unit, -side) > CUT_SHARE;
    if is_cut(1.0) || is_cut(-1.0) {
        return Some((middle, noise_of(values.into_iter(), middle)));
    }
    // From the middle, so that large raw values lose no digits.
    let mean = middle + near().map(|value| value - middle).sum::<f64>() / near().count() as f64;
    let baseline = if unit > 0.0 { (mean * DECIMALS).round() / DECIMALS } else { rounded_beside(mean, within) };
    Some((baseline, noise_of(values.into_iter(), baseline)))
}

/// `value` with four digits of the part of it that is as large as `within`.
pub(super) fn rounded_beside(value: f64, within: f64) -> f64 {
    if within <= 0.0 {
        return value;
    }
    let digit = libm::pow(10.0, within.log10().floor() - 3.0);
    (value / digit).round() * digit
}

/// How far from `baseline` all `values` stay but for the share that noise may exceed; 0 where there are none.
pub(super) fn noise_of(values: impl Iterator<Item = f64>, baseline: f64) -> f64 {
    let mut strays: Vec<f64> = values.map(|value| (value - baseline).abs()).collect();
    strays.sort_by(f64::total_cmp);
    let rank = ((1.0 - EXCEEDING_SHARE) * strays.len() as f64).ceil() as usize;
    strays.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
}

/// How far a sensor moved at rest: its noise without single wrong values.
pub(super) fn movement_of(kept: &[f32], baseline: f64) -> f64 {
    noise_of(kept.windows(3).map(|three| middle(three[0], three[1], three[2]).into()), baseline)
}

pub(super) fn middle(a: f32, b: f32, c: f32) -> f32 {
    a.max(b).min(a.min(b).max(c))
}

/// The standard deviation of a sensor's values at rest as the steps between them tell it, and at least that of rounding to
/// whole multiples of `unit`.
pub(super) fn chance_of(kept: &[f32], unit: f64) -> f64 {
    /// The median of the size of the difference of two normal values, in their standard deviation: √2 · 0.6745.
    const MEDIAN_STEP: f64 = 0.953_87;
    let mut steps: Vec<f64> = kept.windows(2).map(|pair| (f64::from(pair[1]) - f64::from(pair[0])).abs()).collect();
    (median(&mut steps).unwrap_or(0.0) / MEDIAN_STEP).max(unit / 12.0_f64.sqrt())
}

/// The standard deviation of a raw value, from the differences of values in succession, so that a slow drift adds nothing,
/// and without the farthest hundredth of them, so that single wrong values add nothing. At least that of rounding to whole
/// multiples of `unit`: a value that never changes may lie anywhere within its step.
pub(super) fn sigma_of(kept: &[f32], unit: f64) -> f64 {
    /// The mean square of normal values without the farthest hundredth, over that of all.
    const KEPT_SHARE: f64 = 0.924_76;
    let mut squares: Vec<f64> = kept.windows(2).map(|pair| (f64::from(pair[1]) - f64::from(pair[0])).powi(2)).collect();
    squares.sort_by(f64::total_cmp);
    let left_out = squares.len() / 100;
    squares.truncate(squares.len() - left_out);
    let mean = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    let share = if left_out > 0 { KEPT_SHARE } else { 1.0 };
    (mean / (2.0 * share)).sqrt().max(unit / 12.0_f64.sqrt())
}

/// The middle value, the lower of two; sorts them.
pub(super) fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len().checked_sub(1)? / 2).copied()
}
