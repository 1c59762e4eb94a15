//! Requested accuracy and time, and the combination that meets them.

use super::{CallMode, Measurement, Report, Target};

/// The selected combination.
#[derive(Clone, Debug)]
pub struct Pick<'a> {
    /// Its measurement.
    pub row: &'a Measurement,
    /// Missed requirements in words; empty if all are met.
    pub missed: Vec<String>,
}

impl Target {
    /// Ratios of `row`'s values to the limits.
    fn misses(&self, row: &Measurement) -> [f64; 3] {
        let [centroid, orientation] = row.judged();
        let over = |value: f64, limit: Option<f64>| limit.map_or(0.0, |limit| value / limit);
        // Without a comparison no tolerance is met.
        let p95 = |errors: &super::Errors| if errors.compared > 0 { errors.p95 } else { f64::INFINITY };
        [
            over(if self.centroid_m.is_some() { p95(centroid) * 1e-3 } else { 0.0 }, self.centroid_m),
            over(
                if self.orientation_rad.is_some() { p95(orientation).to_radians() } else { 0.0 },
                self.orientation_rad,
            ),
            over(row.p50_us * 1e-6, self.budget_s),
        ]
    }

    /// The fastest combination of `report` for `way` that meets it; for a budget alone the most accurate one. If none meets
    /// it, the nearest one.
    #[must_use]
    pub fn pick<'a>(&self, report: &'a Report, way: CallMode) -> Option<Pick<'a>> {
        let mut rows = report.measurements(way);
        rows.retain(|row| report.truth || row.words.orientation_by == report.asked_by);
        let granted = |row: &&&Measurement| self.misses(row).iter().all(|times| *times <= 1.0);
        let tolerant = self.centroid_m.is_some() || self.orientation_rad.is_some();
        let picked = if tolerant || self.is_empty() {
            rows.iter().find(granted)
        } else {
            rows.iter().filter(granted).min_by(|a, b| a.off().total_cmp(&b.off()))
        };
        if let Some(row) = picked {
            return Some(Pick { row, missed: Vec::new() });
        }
        let worst = |row: &Measurement| self.misses(row).into_iter().fold(0.0, f64::max);
        let row = rows.iter().min_by(|a, b| worst(a).total_cmp(&worst(b)))?;
        Some(Pick { row, missed: self.missed(row) })
    }

    /// Requirements that `row` misses, in words.
    fn missed(&self, row: &Measurement) -> Vec<String> {
        let [centroid, orientation] = row.judged();
        let texts = [
            format!("centroid {:.3} mm", centroid.p95),
            format!("orientation {:.3}°", orientation.p95),
            format!("{:.2} µs a frame", row.p50_us),
        ];
        let limits = [
            Self { centroid_m: self.centroid_m, ..Self::default() },
            Self { orientation_rad: self.orientation_rad, ..Self::default() },
            Self { budget_s: self.budget_s, ..Self::default() },
        ];
        let misses = self.misses(row);
        let over = |(((times, text), limit), never): (((f64, String), Self), bool)| {
            let limit = limit.words();
            match (times > 1.0, never) {
                (false, _) => None,
                (true, true) => Some(format!("nothing to compare with {limit}")),
                (true, false) => Some(format!("{text}, {times:.3} times {limit}")),
            }
        };
        let never = [centroid.compared == 0, orientation.compared == 0, false];
        misses.into_iter().zip(texts).zip(limits).zip(never).filter_map(over).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{report, row};
    use super::*;

    #[test]
    fn the_pick_is_the_fastest_within_a_tolerance_and_the_truest_within_a_budget() {
        let report = report(vec![
            row("cpu", 1.0, 3.0, 3.0),
            row("gpu", 2.0, 1.0, 4.0),
            row("cpu", 3.0, 3.0, 1.0),
            row("reference", 9.0, 0.0, 0.0),
        ]);
        let pick = |target: Target| target.pick(&report, CallMode::Live).unwrap();
        let within = |text: &str| Target::within(text).unwrap();
        assert_eq!(pick(within("3 mm")).row.p50_us, 1.0);
        assert_eq!(pick(within("2 mm")).row.p50_us, 2.0);
        assert_eq!(pick(within("2 mm, 2 deg")).row.p50_us, 9.0);
        let budget = |us: f64| Target { budget_s: Some(us * 1e-6), ..Target::default() };
        assert_eq!(pick(budget(10.0)).row.p50_us, 9.0);
        assert_eq!(pick(budget(3.5)).row.p50_us, 3.0);
        assert!(pick(budget(3.5)).missed.is_empty());
        // What nothing grants is missed by so much.
        let none = pick(within("2 mm, 2 deg").or(budget(5.0)));
        assert!(!none.missed.is_empty() && none.missed[0].contains("times"), "{:?}", none.missed);
        assert_eq!(pick(budget(0.5)).missed, ["1.00 µs a frame, 2.000 times 0.5 us"]);
        assert!(Target::default().pick(&report, CallMode::Batch).is_none());
    }
}
