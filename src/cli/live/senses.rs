//! What the live table says of fields that are not read as pressures.

use somatic::Percept;

use crate::cli::words::{millimetres, number};

/// What `percept` says in a letter of temperature, proximity or shear; `None` in one of pressure. Forces are times `factor` in `unit`.
pub(super) fn said(percept: &Percept, factor: f64, unit: &str) -> Option<String> {
    let parts = if let Some(celsius) = percept.temperature {
        let range = percept.coldest.zip(percept.warmest);
        vec![
            Some(format!("{celsius:.1} °C")),
            range.map(|(coldest, warmest)| format!("from {coldest:.1} to {warmest:.1}")),
            percept.temperature_rate.map(|rate| format!("{rate:+.2} K/s")),
        ]
    } else if let Some(nearest) = percept.nearest {
        vec![
            Some(format!("{} mm away", millimetres(nearest))),
            percept.covered.map(|covered| format!("{covered} in range")),
            percept.approach_speed.map(way),
        ]
    } else {
        let force = percept.shear_vector.map(|force| force.iter().map(|x| x * x).sum::<f64>().sqrt());
        vec![
            force.map(|force| format!("shear {} {unit}", number(force * factor)).trim_end().to_owned()),
            percept.shear_direction.map(|direction| format!("at {:.0}°", direction.to_degrees())),
            percept.friction.map(|friction| format!("friction {friction:.2}")),
            percept.slip_ratio.map(|ratio| format!("{:.0} % of slipping", 100.0 * ratio)),
        ]
    };
    let said: Vec<String> = parts.into_iter().flatten().collect();
    (!said.is_empty()).then(|| said.join("  "))
}

/// What something does that approaches at `speed`, m/s.
fn way(speed: f64) -> String {
    let mm_per_s = (speed * 1e3).round();
    let way = if mm_per_s < 0.0 { "going" } else { "coming" };
    if mm_per_s == 0.0 { "still".to_owned() } else { format!("{way} at {:.0} mm/s", mm_per_s.abs()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn something_comes_goes_or_is_still() {
        assert_eq!([0.1, -0.145, -4e-4].map(way), ["coming at 100 mm/s", "going at 145 mm/s", "still"]);
    }
}
