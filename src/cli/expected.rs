//! Errors that are to be expected on a layout, in words.

use somatic::internal::expected::{LayoutErrors, Percentiles, TestTouches, expected_and_ideal_errors};
use somatic::{Body, Result};

/// The errors of usual touches on `body`, and on an ideal skin that is as dense.
pub(super) fn of_body(body: &Body) -> Result<[LayoutErrors; 2]> {
    expected_and_ideal_errors(body, &TestTouches::default())
}

/// Lines on a layout's errors and on those of an ideal skin, each with its name.
pub(super) fn lines([layout, ideal]: &[LayoutErrors; 2]) -> [(&'static str, String); 2] {
    let all = layout.touches.len();
    let counted = match all - layout.counted().count() {
        0 => format!("{all} touches"),
        few => format!("{} of {all} touches, as fewer than 3 taxels feel the others", all - few),
    };
    [
        ("errors", format!("{}: median and 95th percentile of {counted}", words(layout))),
        ("ideal", format!("{}: the same on a flat sheet of regular hexagons as dense", words(ideal))),
    ]
}

fn words(errors: &LayoutErrors) -> String {
    let phrase = |what: &str, unit: &str, percentiles: Option<[String; 2]>| {
        percentiles.map_or_else(|| format!("{what} –"), |[median, p95]| format!("{what} {median}, {p95}{unit}"))
    };
    format!(
        "{}, {}, {}",
        phrase("place", " mm", place(errors)),
        phrase("axis", "°", axis(errors)),
        phrase("force", " %", force(errors))
    )
}

/// Median and 95th percentile of the errors of places, mm.
pub(super) fn place(errors: &LayoutErrors) -> Option<[String; 2]> {
    shown(errors.place_m(), 1e3)
}

/// The same of axes, degrees.
pub(super) fn axis(errors: &LayoutErrors) -> Option<[String; 2]> {
    shown(errors.axis_rad(), 1_f64.to_degrees())
}

/// The same of forces, per cent.
pub(super) fn force(errors: &LayoutErrors) -> Option<[String; 2]> {
    shown(errors.force(), 100.0)
}

fn shown(percentiles: Option<Percentiles>, factor: f64) -> Option<[String; 2]> {
    percentiles.map(|Percentiles { median, p95, .. }| [median, p95].map(|value| short(factor * value)))
}

/// An error with three digits or fewer.
fn short(value: f64) -> String {
    match value {
        value if value < 9.995 => format!("{value:.2}"),
        value if value < 99.95 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

#[cfg(test)]
mod tests {
    use somatic::internal::expected::TouchError;

    use super::*;

    fn errors(touches: Vec<Option<TouchError>>) -> LayoutErrors {
        LayoutErrors { taxels: 9, spacing_m: 0.0162, touch_spacing_m: 0.0162, touches }
    }

    #[test]
    fn errors_are_reported_in_short_words() {
        let touch = |place_m: f64, axis_rad: Option<f64>| Some(TouchError { place_m, axis_rad, force: -0.25 });
        let layout = errors(vec![touch(5.23e-4, None), touch(0.0125, Some(0.05)), None]);
        let [line, ideal] = lines(&[layout, errors(vec![None])]);
        assert_eq!(
            line.1,
            "place 0.52, 12.5 mm, axis 2.86, 2.86°, force 25.0, 25.0 %: median and 95th percentile of 2 of 3 touches, as fewer than 3 taxels feel the others"
        );
        assert_eq!(ideal.1, "place –, axis –, force –: the same on a flat sheet of regular hexagons as dense");
        assert!(errors(vec![None]).as_json()["place"].is_null());
        assert_eq!([0.0, 9.996, 123.4].map(short), ["0.00", "10.0", "123"]);
    }
}
