//! Gains and a layer that were found from touches, written into a calibration.

use toml_edit::{DocumentMut, Item, Table, value};

use crate::body::Modality;
use crate::error::{Error, Result};
use somatic_engine::gains::GainsEstimate;

/// The layer's own σ where all touches were by the flat end of a stamp: an even disc has a variance of R²/4 each way.
///
/// # Errors
/// The touches are narrower than such a stamp makes them.
pub fn layer_under(radius_m: f64, width_m: f64) -> Result<f64> {
    let variance = width_m * width_m - radius_m * radius_m / 4.0;
    if variance <= 0.0 {
        return Err(Error::failed(format!(
            "the touches are {:.2} mm wide, less than a stamp with a radius of {:.2} mm makes them; is it the radius, and flat?",
            width_m * 1e3,
            radius_m * 1e3
        )));
    }
    Ok(variance.sqrt())
}

/// The calibration `text` with the gains and the layer of `estimate`, for `taxels`: ids and what they measure; those that feel no
/// pressure have no gain. What is counted in P goes with the gain.
///
/// # Errors
/// It is not the text of a calibration.
pub fn with_gains(text: &str, taxels: &[(u32, Modality)], estimate: &GainsEstimate) -> Result<String> {
    let mut document: DocumentMut = text.parse().map_err(|e| Error::failed(format!("{e}")))?;
    let number =
        |item: Option<&Item>| item.and_then(|item| item.as_float().or_else(|| item.as_integer().map(|n| n as f64)));
    let without_gain = spread_without_gain(estimate);
    let pressed = taxels.iter().zip(&estimate.gains).filter(|((_, kind), _)| kind.is_pressed());
    for ((id, _), gain) in pressed {
        let id = id.to_string();
        let number_at = |document: &DocumentMut, key: &str| {
            let own = document.get("taxel").and_then(|taxels| taxels.get(&id)).and_then(|taxel| taxel.get(key));
            number(own).or_else(|| number(document.get("all").and_then(|all| all.get(key))))
        };
        let new = match gain {
            Some(gain) => [
                ("gain", Some(number_at(&document, "gain").unwrap_or(1.0) / gain)),
                ("dead_band", number_at(&document, "dead_band").map(|band| band / gain)),
                ("p_max", number_at(&document, "p_max").map(|most| most / gain)),
                ("gain_spread", None),
            ],
            None => [("gain", None), ("dead_band", None), ("p_max", None), ("gain_spread", Some(without_gain))],
        };
        let taxels = document.entry("taxel").or_insert_with(|| {
            let mut table = Table::new();
            table.set_implicit(true);
            Item::Table(table)
        });
        let Some(taxels) = taxels.as_table_like_mut() else { return Err(Error::failed("`taxel` is not a table")) };
        let taxel = taxels.entry(&id).or_insert_with(|| Item::Table(Table::new()));
        let Some(taxel) = taxel.as_table_like_mut() else {
            return Err(Error::failed(format!("`taxel.{id}` is not a table")));
        };
        for (key, number) in new {
            match number {
                Some(number) => _ = taxel.insert(key, value(rounded(number))),
                // A taxel with a gain now has the layer's spread.
                None if key == "gain_spread" => _ = taxel.remove(key),
                None => {}
            }
        }
    }
    let layer = document.entry("layer").or_insert_with(|| Item::Table(Table::new()));
    let Some(layer) = layer.as_table_like_mut() else { return Err(Error::failed("`layer` is not a table")) };
    layer.insert("sigma_m", value(rounded(estimate.sigma_m)));
    layer.insert("gain_spread", value(rounded(estimate.gain_spread)));
    Ok(document.to_string())
}

/// By what share the gains differ: the root mean square of their logarithms.
#[must_use]
pub fn spread(estimate: &GainsEstimate) -> f64 {
    let logarithms = || estimate.gains.iter().flatten().map(|gain| gain.ln());
    (logarithms().map(|x| x * x).sum::<f64>() / logarithms().count().max(1) as f64).sqrt()
}

/// The relative error of gains that no touch measured: as large as the spread of the others.
#[must_use]
pub fn spread_without_gain(estimate: &GainsEstimate) -> f64 {
    spread(estimate).max(estimate.gain_spread)
}

/// Five digits: gains are known to a few per cent.
fn rounded(number: f64) -> f64 {
    format!("{number:.4e}").parse().unwrap_or(number)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::Calibration;

    fn pads(ids: [u32; 3]) -> [(u32, Modality); 3] {
        ids.map(|id| (id, Modality::Pressure))
    }

    #[test]
    fn what_feels_no_pressure_has_no_gain() {
        let taxels = [(3, Modality::Force3), (7, Modality::Temperature), (9, Modality::Proximity)];
        let written = with_gains("", &taxels, &estimate(&[Some(0.8), None, None])).unwrap();
        assert!(
            written.contains("[taxel.3]") && !written.contains("taxel.7") && !written.contains("taxel.9"),
            "{written}"
        );
        Calibration::parse_for(&written, &taxels).unwrap();
    }

    #[test]
    fn gains_keep_what_a_calibration_has_along_the_skin() {
        let text = "[all]\ngain = 2\n[shear]\ngain = [0.5, 0.25]\nraw_range = [-9, 9]\ncross_axis = [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]\n\
                    [taxel.9]\nshear_gain = 3\nshear_raw_range = [0, 7]\n[temperature]\ninvert = true\n";
        let taxels = [(3, Modality::Force3), (7, Modality::Temperature), (9, Modality::Force3)];
        let written = with_gains(text, &taxels, &estimate(&[Some(0.8), None, Some(1.25)])).unwrap();
        let [before, after] = [text, &written].map(|text| Calibration::parse_for(text, &taxels).unwrap());
        assert_eq!((after.taxels[0].gain, after.taxels[2].gain), (2.5, 1.6));
        assert_eq!((after.shear, after.temperature), (before.shear, before.temperature));
    }

    fn estimate(gains: &[Option<f64>]) -> GainsEstimate {
        let mut estimate = GainsEstimate::default();
        (estimate.gains, estimate.sigma_m) = (gains.to_vec(), 0.002_345_67);
        estimate
    }

    #[test]
    fn gains_go_into_a_calibration_with_what_is_counted_in_p() {
        let text =
            "# Mine.\n[all]\nbaseline = 12\ndead_band = 3 # counts\ngain = 2\n\n[taxel.7]\ngain = 4.0\np_max = 800\n";
        let written = with_gains(text, &pads([3, 7, 9]), &estimate(&[Some(0.8), Some(1.25), None])).unwrap();
        assert!(written.contains("# Mine.") && written.contains("dead_band = 3 # counts"), "{written}");
        let [before, after] = [text, &written].map(|text| Calibration::parse(text, &[3, 7, 9]).unwrap());
        for (index, factor) in [0.8, 1.25, 1.0].into_iter().enumerate() {
            let [before, after] = [&before, &after].map(|calibration| &calibration.taxels[index]);
            assert!((after.gain * factor / before.gain - 1.0).abs() < 1e-4, "{index}");
            assert!((after.dead_band * factor / before.dead_band - 1.0).abs() < 1e-4, "{index}");
        }
        assert_eq!(after.taxels[1].p_max, 640.0);
        assert_eq!(after.layer.unwrap().sigma_m, 0.002_345_7);
        // A gain that no touch measured may be off as much as the others were; one that is measured later, no more than they.
        let own_spread = after.taxels.iter().map(|taxel| taxel.gain_spread.is_some());
        assert_eq!(own_spread.collect::<Vec<_>>(), [false, false, true]);
        assert!((after.taxels[2].gain_spread.unwrap() / 0.223 - 1.0).abs() < 1e-2, "{:?}", after.taxels[2]);
        // Again with other gains: a layer that was there is replaced.
        let again = with_gains(&written, &pads([3, 7, 9]), &estimate(&[Some(1.0); 3])).unwrap();
        let again = Calibration::parse(&again, &[3, 7, 9]).unwrap();
        assert_eq!((again.layer, again.taxels[2].gain_spread), (after.layer, None));
    }

    #[test]
    fn a_stamp_tells_the_layer_apart_from_itself() {
        assert!((layer_under(0.006, 0.005).unwrap() - 0.004).abs() < 1e-12);
        assert!(layer_under(0.02, 0.005).unwrap_err().to_string().contains("is it the radius"));
    }
}
