//! Which keys a taxel has by what it measures.

use super::keys::Keys;
use crate::body::Modality;
use crate::error::Result;
use crate::keys::Text;
use crate::signal::sense::{SenseCalibration, SenseResponse};

/// Refuses `keys` of the taxel `id` that taxels of this `kind` do not have; `temperature` has what holds for all of its kind.
pub(super) fn check(
    keys: &Keys,
    (id, kind): (u32, Modality),
    temperature: &SenseCalibration,
    text: Text<'_>,
) -> Result<()> {
    if kind == Modality::Temperature
        && matches!(temperature.all.response, SenseResponse::Ntc { .. })
        && let Some((key, at)) = keys.rival_of_ntc()
    {
        let what = format!("`{key}` does not go with `ntc` in [temperature]; remove it, or give taxel {id} a `curve`");
        return Err(text.wrong(at, what));
    }
    let name = kind.name();
    if matches!(kind, Modality::Temperature | Modality::Proximity) {
        let wrong = keys.of_pressure().into_iter().find_map(|(key, at)| Some((key, at?)));
        if let Some((key, at)) = wrong {
            let instead = if key == "unit" { format!("; [{name}] has its `unit`") } else { String::new() };
            let what = format!("`{key}` is for pressures, and taxel {id} measures {name}; remove it{instead}");
            return Err(text.wrong(at, what));
        }
    }
    if !matches!(kind, Modality::Force3 | Modality::Other(_))
        && let Some((key, at)) = keys.of_shear().into_iter().find_map(|(key, at)| Some((key, at?)))
    {
        let what = format!(
            "`{key}` is for taxels with three axes (modality force3), and taxel {id} measures {name}; remove it"
        );
        return Err(text.wrong(at, what));
    }
    Ok(())
}

/// Refuses keys of single taxels under [all] that have a table of their own.
pub(super) fn check_all(keys: &Keys, text: Text<'_>) -> Result<()> {
    match keys.of_shear().into_iter().find_map(|(key, at)| Some((key, at?))) {
        Some((key, at)) => {
            let own = key.trim_start_matches("shear_");
            Err(text.wrong(at, format!("`{key}` is a key of [taxel.N]; for all of them give [shear] its `{own}`")))
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use crate::body::Modality;
    use crate::keys::without_column;
    use crate::signal::{Calibration, RawValue, Reading};

    const TAXELS: [(u32, Modality); 4] =
        [(0, Modality::Pressure), (100, Modality::Force3), (200, Modality::Temperature), (301, Modality::Proximity)];

    fn read(text: &str) -> Result<Calibration, String> {
        Calibration::parse_for(text, &TAXELS).map_err(|e| without_column(&e.to_string()))
    }

    #[test]
    fn temperatures_and_distances_fall_with_raw_values_where_they_are_inverted() {
        let read_all = read(
            "[all]\np_max = 50\n[taxel.200]\ninvert = true\nbaseline = 100\n[taxel.301]\ninvert = true\nbaseline = 100\ngain = 2\n",
        )
        .unwrap();
        let value = |reading| match reading {
            Reading::Value(value, true) => value,
            other => panic!("{other:?}"),
        };
        assert_eq!(value(read_all.temperature.of_taxel(2).read(RawValue::new(24.0))), 76.0);
        assert!((value(read_all.proximity.of_taxel(3).read(RawValue::new(10.0))) - 0.18).abs() < 1e-15);
        // A thermistor at the reference voltage, above its resistor.
        let above = read(
            "[temperature]\nntc = { ohm_at_25 = 10e3, b_k = 3950, series_ohm = 10e3, full_raw = 1023 }\n[taxel.200]\ninvert = true\n",
        );
        let above = above.unwrap().temperature;
        let [colder, warmer] = [400.0, 600.0].map(|raw| value(above.of_taxel(2).read(RawValue::new(raw))));
        assert!(colder < 25.0 && warmer > 25.0, "{colder} {warmer}");
        // All of a kind at once, and one that is the other way.
        let all = read(
            "[temperature]\nntc = { ohm_at_25 = 10e3, b_k = 3950, series_ohm = 10e3, full_raw = 1023 }\ninvert = true\n\
             [proximity]\ninvert = true\nbaseline = 100\n",
        )
        .unwrap();
        assert_eq!(value(all.temperature.of_taxel(2).read(RawValue::new(400.0))), colder);
        assert!((value(all.proximity.of_taxel(3).read(RawValue::new(10.0))) - 0.09).abs() < 1e-15);
        let one_below = read(
            "[temperature]\nntc = { ohm_at_25 = 10e3, b_k = 3950, series_ohm = 10e3, full_raw = 1023 }\ninvert = true\n\
             [taxel.200]\ninvert = false\n",
        );
        let below = one_below.unwrap().temperature;
        assert!((value(below.of_taxel(2).read(RawValue::new(623.0))) - colder).abs() < 1e-9);
        assert_eq!(value(below.all.read(RawValue::new(400.0))), colder);
    }

    #[test]
    fn what_a_taxel_has_of_its_own_is_of_its_kind_alone() {
        let keys = "baseline = 3\ngain = 2\nraw_range = [0, 255]\n";
        let all: String = TAXELS.iter().map(|(id, _)| format!("[taxel.{id}]\n{keys}")).collect();
        let read = read(&all).unwrap();
        let own = [&read.temperature, &read.proximity].map(|sense| sense.own.keys().copied().collect::<Vec<_>>());
        assert_eq!(own, [[2], [3]]);
    }

    #[test]
    fn keys_of_pressures_are_refused_for_what_feels_none() {
        for key in [
            "dead_band = 1",
            "p_max = 9",
            "noise = 1",
            "sensor = \"fsr\"",
            "onset = \"soft\"",
            "gain_spread = 0.1",
            "wiper = 3",
        ] {
            let name = key.split(' ').next().unwrap();
            assert_eq!(
                read(&format!("[taxel.301]\nmask = true\n{key}")).unwrap_err(),
                format!("line 3: `{name}` is for pressures, and taxel 301 measures proximity; remove it")
            );
        }
        assert_eq!(
            read("[taxel.200]\nunit = \"kPa\"").unwrap_err(),
            "line 2: `unit` is for pressures, and taxel 200 measures temperature; remove it; [temperature] has its `unit`"
        );
        let all = "[taxel.200]\nbaseline = 1\ngain = 2\ninvert = false\nraw_range = [0, 9]\nmissing = [3]\nmask = true";
        assert!(read(all).is_ok());
        assert!(read("[taxel.100]\ndead_band = 1\nnoise = 2\n[taxel.0]\nunit = \"kPa\"").is_ok());
        // Without a body nothing is known of them.
        assert!(Calibration::parse("[taxel.200]\ndead_band = 1\nshear_gain = 2", &TAXELS.map(|(id, _)| id)).is_ok());
    }

    #[test]
    fn keys_of_shear_are_refused_for_what_has_one_axis() {
        for (id, kind) in [(0, "pressure"), (200, "temperature"), (301, "proximity")] {
            for key in ["shear_gain = 3", "shear_baseline = [1, 1]", "shear_raw_range = [0, 1]", "shear_noise = 1"] {
                let name = key.split(' ').next().unwrap();
                assert_eq!(
                    read(&format!("[taxel.{id}]\n{key}")).unwrap_err(),
                    format!(
                        "line 2: `{name}` is for taxels with three axes (modality force3), and taxel {id} measures {kind}; remove it"
                    )
                );
            }
        }
        assert!(read("[taxel.100]\nshear_gain = 3\nshear_baseline = [1, 1]\nshear_noise = 1").is_ok());
        assert_eq!(
            read("[all]\nshear_gain = 3").unwrap_err(),
            "line 2: `shear_gain` is a key of [taxel.N]; for all of them give [shear] its `gain`"
        );
    }
}
