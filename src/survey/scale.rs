//! One scale for all gains that were found before, from presses with known forces.

use toml_edit::{DocumentMut, Item, Table, TableLike, value};

use crate::error::{Error, Result};
use crate::percept::Outputs;
use crate::signal::Quantity;
use crate::{BackendKind, Body, Calibration, Engine, Frame, Options, Scene};

use super::at_rest::middle;
use super::known::{KnownForces, clear, scale_of};
use super::presses::{Divider, Part};
use super::rounded;

/// Follows presses on a skin that has a calibration.
pub struct ScaleSurvey {
    engine: Engine,
    quantity: Quantity,
    divider: Divider,
    last: [f32; 2],
    most: f64,
    wholes: Vec<f64>,
}

/// What presses with known forces say.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaleEstimate {
    /// What all gains are to be multiplied by.
    pub scale: f64,
    /// Presses that it was found from.
    pub presses: usize,
    /// How well they agree, in words.
    pub remark: String,
    /// Whether P was a count, and is in newtons with the scale.
    pub becomes_newton: bool,
}

impl ScaleSurvey {
    /// Begins with a calibration that has gains, for frames of the taxels `ids`.
    ///
    /// # Errors
    /// Its taxels measure different quantities; the calibration or the ids are for another body.
    pub fn new(body: &Body, calibration: Calibration, ids: &[u32]) -> Result<Self> {
        let quantity = calibration.taxels.first().map_or(Quantity::Count, |taxel| taxel.quantity);
        if calibration.taxels.iter().any(|taxel| taxel.quantity != quantity) {
            return Err(Error::failed("its taxels measure different quantities; give all of them one unit"));
        }
        let scene = Scene::default().outputs(Outputs::TOTAL).touches(crate::touch::Options::default());
        let options = Options::default().scene(scene).calibration(calibration).backend(BackendKind::Cpu).batch(256);
        let mut engine = Engine::new(body, options)?;
        engine.set_channels(ids)?;
        Ok(Self { engine, quantity, divider: Divider::default(), last: [0.0; 2], most: 0.0, wholes: Vec::new() })
    }

    /// Takes `frames`.
    ///
    /// # Errors
    /// As [`Engine::process`]; the body does not say where its sensors are, or how large those of pressures are.
    pub fn add(&mut self, frames: &[Frame]) -> Result<()> {
        let percepts = self.engine.process(frames)?;
        for frame in 0..percepts.frames() {
            let Some(found) = percepts.touches(frame) else {
                return Err(Error::failed("the body does not say where its sensors are, so that it has no touches"));
            };
            let mut whole = 0.0;
            for touch in &found.touches {
                whole += match (self.quantity, touch.force_newton) {
                    (Quantity::Pascal, None) => {
                        return Err(Error::failed(
                            "P is a pressure, and a sensor has no area; give its area, or P in N",
                        ));
                    }
                    (Quantity::Pascal, Some(newtons)) => newtons,
                    _ => touch.total,
                };
            }
            let calm = middle(self.last[0], self.last[1], whole as f32);
            self.last = [self.last[1], whole as f32];
            match self.divider.see(calm.into()) {
                Part::Within => self.most = self.most.max(calm.into()),
                Part::Ended => self.wholes.push(std::mem::take(&mut self.most)),
                Part::Between => {}
            }
        }
        Ok(())
    }

    /// What the presses say, which `forces` made one after the other, or one of them all.
    ///
    /// # Errors
    /// Nothing was pressed; there were more or fewer presses than forces.
    pub fn finish(mut self, forces: &KnownForces) -> Result<ScaleEstimate> {
        if self.divider.is_pressed() {
            self.wholes.push(self.most);
        }
        let wholes: Vec<f64> = clear(self.wholes.iter().copied(), &forces.0).collect();
        let (scale, remark) = scale_of(&wholes, &forces.0)?;
        let becomes_newton = self.quantity == Quantity::Count;
        Ok(ScaleEstimate { scale, presses: wholes.len(), remark, becomes_newton })
    }
}

/// The calibration `text` with the scale of `estimate`, on top of one that it has. What is counted in P goes with it.
///
/// # Errors
/// It is not the text of a calibration; taxels have units of their own.
pub fn with_scale(text: &str, estimate: &ScaleEstimate) -> Result<String> {
    let mut document: DocumentMut = text.parse().map_err(|e| Error::failed(format!("{e}")))?;
    let scale = estimate.scale;
    let taxels = document.get_mut("taxel").and_then(Item::as_table_like_mut);
    for (id, taxel) in taxels.into_iter().flat_map(|table| table.iter_mut()) {
        let Some(taxel) = taxel.as_table_like_mut() else { continue };
        if estimate.becomes_newton && taxel.contains_key("unit") {
            return Err(Error::failed(format!("[taxel.{id}] has a unit of its own; remove it")));
        }
        multiply(taxel, &["dead_band", "p_max"], scale);
    }
    // Gains, also of tangential values, are multiplied by `scale` where they are read.
    let tables = [("contact", &["on", "off"][..]), ("change", &["dead_band", "on", "off"])];
    for (name, keys) in tables {
        let Some(table) = document.get_mut(name).and_then(Item::as_table_like_mut) else { continue };
        multiply(table, keys, scale);
        let fields = table.get_mut("field").and_then(Item::as_table_like_mut);
        for (_, field) in fields.into_iter().flat_map(|table| table.iter_mut()) {
            field.as_table_like_mut().into_iter().for_each(|field| multiply(field, keys, scale));
        }
    }
    let all = document.entry("all").or_insert_with(|| Item::Table(Table::new()));
    let Some(all) = all.as_table_like_mut() else { return Err(Error::failed("`all` is not a table")) };
    multiply(all, &["dead_band", "p_max"], scale);
    let before = all.get("scale").and_then(number).unwrap_or(1.0);
    all.insert("scale", value(rounded(before * scale)));
    if estimate.becomes_newton {
        all.insert("unit", value("N"));
    }
    Ok(document.to_string())
}

fn number(item: &Item) -> Option<f64> {
    item.as_float().or_else(|| item.as_integer().map(|n| n as f64))
}

/// Multiplies the numbers `keys` of `table`, where they are.
fn multiply(table: &mut dyn TableLike, keys: &[&str], by: f64) {
    for key in keys {
        if let Some(before) = table.get(key).and_then(number) {
            table.insert(key, value(rounded(before * by)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_goes_into_a_calibration_with_what_is_counted_in_p() {
        let text = "# Mine.\n[all]\ngain = 2\ndead_band = 3 # counts\n\n[taxel.7]\ngain = 4.0\np_max = 800\n\n[contact]\non = 10\n\
                    [contact.field.\"a\"]\non = 20\n[shear]\ngain = 3\n[taxel.3]\nshear_gain = 5\n";
        let estimate = ScaleEstimate { scale: 0.01, presses: 1, remark: String::new(), becomes_newton: true };
        let once = with_scale(text, &estimate).unwrap();
        assert!(once.contains("# Mine.") && once.contains("gain = 4.0"), "{once}");
        let read = Calibration::parse(&once, &[3, 7]).unwrap();
        assert_eq!(read.taxels.iter().map(|taxel| taxel.gain).collect::<Vec<_>>(), [0.02, 0.04]);
        assert_eq!((read.taxels[1].dead_band, read.taxels[1].p_max), (0.03, 8.0));
        assert_eq!((read.contact.on, read.fields["a"].on), (0.1, 0.2));
        assert_eq!([0, 1].map(|taxel| read.shear.gains_of(taxel, 1.0, 1.0)), [[0.05; 2], [0.03; 2]]);
        assert_eq!(read.taxels[0].quantity, Quantity::Newton);
        let twice =
            with_scale(&once, &ScaleEstimate { scale: 2.0, becomes_newton: false, ..estimate.clone() }).unwrap();
        assert_eq!(Calibration::parse(&twice, &[3, 7]).unwrap().taxels[1].gain, 0.08);
        let own = with_scale("[taxel.3]\nunit = \"kPa\"\n", &estimate).unwrap_err().to_string();
        assert_eq!(own, "[taxel.3] has a unit of its own; remove it");
    }

    #[test]
    fn a_scale_keeps_what_a_calibration_has_for_other_kinds_of_taxel() {
        use crate::body::Modality::{Force3, Proximity, Temperature};
        let text = "[all]\ngain = 2\n[shear]\nbaseline = [5, 6]\ngain = [0.5, 0.25]\nraw_range = [-9, 9]\nnoise = 1\nslips_at = 0.5\n\
                    cross_axis = [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]\n[taxel.7]\nshear_baseline = [1, 2]\nshear_gain = 3\n\
                    shear_raw_range = [0, 7]\nshear_noise = 2\n[temperature]\ngain = 0.1\ninvert = true\nraw_range = [0, 900]\n\
                    [proximity]\ninvert = true\nrange = 80\n[taxel.8]\ninvert = false\n";
        let taxels = [(3, Force3), (7, Force3), (8, Temperature), (9, Proximity)];
        let estimate = ScaleEstimate { scale: 0.01, presses: 1, remark: String::new(), becomes_newton: true };
        let read = |text: &str| Calibration::parse_for(text, &taxels).unwrap();
        let (before, after) = (read(text), read(&with_scale(text, &estimate).unwrap()));
        // How a pull compares with a press stays.
        let gains = |of: &Calibration, taxel: usize| of.shear.gains_of(taxel, of.taxels[taxel].gain, 1.0);
        for taxel in [0, 1] {
            assert_eq!(gains(&after, taxel), gains(&before, taxel).map(|gain| 0.01 * gain));
            assert_eq!(after.taxels[taxel].gain, 0.01 * before.taxels[taxel].gain);
        }
        let mut same = after.shear.clone();
        (same.gain, same.own_gains) = (before.shear.gain, before.shear.own_gains.clone());
        assert_eq!(
            (same, &after.temperature, &after.proximity),
            (before.shear, &before.temperature, &before.proximity)
        );
    }
}
