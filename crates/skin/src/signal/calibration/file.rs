//! The file of a calibration, TOML.

use std::collections::HashMap;
use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use super::keys::{CurveKeys, Draft, Keys, only_for_fsr};
use super::layer::LayerKeys;
use super::senses::{ProximityKeys, TemperatureKeys};
use super::shear_keys::ShearKeys;
use super::thresholds::{ChangeKeys, ContactKeys};
use super::{Calibration, Checks};
use super::{kinds, shear_keys};
use crate::body::Modality;
use crate::error::{Error, Result, failed};
use crate::keys::Text;
use crate::limits::{self, MAX_TOML_BYTES};
use crate::signal::drift::DriftKeys;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    body: Option<String>,
    #[serde(default)]
    curve: HashMap<Spanned<String>, CurveKeys>,
    #[serde(default)]
    all: Keys,
    #[serde(default)]
    taxel: HashMap<Spanned<String>, Keys>,
    #[serde(default)]
    contact: ContactKeys,
    #[serde(default)]
    change: ChangeKeys,
    #[serde(default)]
    checks: Checks,
    #[serde(default)]
    drift: DriftKeys,
    layer: Option<LayerKeys>,
    #[serde(default)]
    temperature: TemperatureKeys,
    #[serde(default)]
    proximity: ProximityKeys,
    #[serde(default)]
    shear: ShearKeys,
}

impl Calibration {
    /// Reads the file at `path` for a body whose taxels have the ids `ids`, ascending.
    ///
    /// # Errors
    /// The file cannot be read, is not TOML, has a key this version does not know or a value that makes no sense, or
    /// names a taxel that the body does not have. The message has the line.
    pub fn load(path: impl AsRef<Path>, ids: &[u32]) -> Result<Self> {
        let path = path.as_ref();
        let text = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
        Self::parse(&text, ids).map_err(|e| e.at(path.display()))
    }

    /// Reads the calibration in `text`, as [`Calibration::load`] does.
    ///
    /// # Errors
    /// As [`Calibration::load`].
    pub fn parse(text: &str, ids: &[u32]) -> Result<Self> {
        Self::of_kinds(Text(text), ids, |_| None)
    }

    /// Reads the calibration in `text` for `taxels`, ids and what they measure, ascending by id, as [`Calibration::parse`] does.
    ///
    /// # Errors
    /// As [`Calibration::load`]; also for a taxel's key that taxels of its modality do not have.
    pub fn parse_for(text: &str, taxels: &[(u32, Modality)]) -> Result<Self> {
        let ids: Vec<u32> = taxels.iter().map(|(id, _)| *id).collect();
        Self::of_kinds(Text(text), &ids, |index| Some(taxels[index].1))
    }

    /// `kind_of` a place among `ids` is what that taxel measures, where it is known.
    fn of_kinds(text: Text<'_>, ids: &[u32], kind_of: impl Fn(usize) -> Option<Modality>) -> Result<Self> {
        let file: File = text.parse().map_err(|e| without_scale(e, text.0))?;
        let mut named: Vec<_> = file.curve.into_iter().collect();
        named.sort_by_key(|(name, _)| name.span().start);
        let names: Vec<&str> = named.iter().map(|(name, _)| name.get_ref().as_str()).collect();
        let curves = named.iter().map(|(name, keys)| keys.read(name.get_ref(), text)).collect::<Result<Vec<_>>>()?;

        let mut all = Draft::default();
        all.apply(&file.all, &names, text)?;
        kinds::check_all(&file.all, text)?;
        let mut drafts = vec![all; ids.len()];
        let mut missing = vec![file.all.missing(text)?.unwrap_or_default(); ids.len()];
        let mut named: Vec<_> = file.taxel.into_iter().collect();
        named.sort_by_key(|(id, _)| id.span().start);
        let mut temperature = file.temperature.read((&curves, &names), text)?;
        let mut proximity = file.proximity.read((&curves, &names), text)?;
        let (mut shear, matrix_at) = (file.shear.read(text)?, file.shear.matrix_at());
        let mut table_of = HashMap::new();
        for (id, keys) in named {
            let index = index_of(&id, ids, file.body.as_deref(), text)?;
            if let Some(before) = table_of.insert(index, id.get_ref().clone()) {
                let what = format!(
                    "[taxel.{}] is taxel {}, which has the table [taxel.{before}] already; keep one of the two",
                    id.get_ref(),
                    ids[index]
                );
                return Err(text.wrong(id.span(), what));
            }
            keys.only_for_one(id.get_ref(), text)?;
            if let Some(codes) = keys.missing(text)? {
                missing[index] = codes;
            }
            let kind = kind_of(index);
            if let Some(kind) = kind {
                kinds::check(&keys, (ids[index], kind), &temperature, text)?;
            }
            drafts[index].apply(&keys, &names, text)?;
            if kind.is_some_and(|kind| !kind.is_pressed()) {
                drafts[index].of_no_pressure();
            }
            for (of, sense) in [(Modality::Temperature, &mut temperature), (Modality::Proximity, &mut proximity)] {
                // Where it is not known, whatever it may be.
                if kind.is_none_or(|kind| kind == of) {
                    keys.sense(index, sense, (&curves, &names), text)?;
                }
            }
            keys.shear(index, &mut shear, text)?;
            only_for_fsr(&keys, drafts[index].is_fsr(), text)?;
        }
        let (temperature, proximity) = (temperature.above_resistors(), proximity.above_resistors());
        if let Some(scale) = all.scale() {
            shear_keys::scale(&mut shear, scale, text)?;
        }
        only_for_fsr(&file.all, all.is_fsr() || drafts.iter().any(Draft::is_fsr), text)?;
        let taxels = drafts.into_iter().map(|draft| draft.finish(&curves, text)).collect::<Result<_>>()?;
        if missing.iter().all(Vec::is_empty) {
            missing.clear();
        }
        check_checks(&file.checks)?;
        file.drift.check()?;
        // Sums and changes have the unit that holds for all.
        let factor = all.unit().factor;
        let (contact, fields) = file.contact.read(text)?;
        let contact = contact.times(factor);
        let fields = fields.into_iter().map(|(name, thresholds)| (name, thresholds.times(factor))).collect();
        let change = file.change.read(text)?.times(factor);
        let layer = file.layer.map(|keys| keys.read(text)).transpose()?;
        let File { body, checks, drift, .. } = file;
        let senses = Self { temperature, proximity, shear, ..Self::default() };
        let made = Self { body, taxels, missing, curves, contact, fields, change, checks, drift, layer, ..senses };
        for (index, &id) in ids.iter().enumerate().filter(|(index, _)| kind_of(*index) == Some(Modality::Force3)) {
            made.check_leak(index, id).map_err(|e| text.put(matrix_at.clone(), e))?;
        }
        Ok(made)
    }
}

/// The place among `ids` of the taxel whose table is called `id`, in a file that is for `body`.
fn index_of(id: &Spanned<String>, ids: &[u32], body: Option<&str>, text: Text<'_>) -> Result<usize> {
    id.get_ref().parse().ok().and_then(|id: u32| ids.binary_search(&id).ok()).ok_or_else(|| {
        let made_for = body.map_or(String::new(), |body| format!(" (the file is for `{body}`)"));
        let name = id.get_ref();
        let what = format!("[taxel.{name}] names a taxel that the body does not have; remove it{made_for}");
        text.wrong(id.span(), what)
    })
}

fn check_checks(checks: &Checks) -> Result<()> {
    let wrong = |key: &str, must: &str| Err(failed!("[checks] `{key}` must be {must}"));
    if checks.broken_frame_share.is_some_and(|share| !(0.0..=1.0).contains(&share)) {
        return wrong("broken_frame_share", "between 0 and 1");
    }
    if checks.isolated_ratio.is_some_and(|ratio| !(ratio.is_finite() && ratio >= 1.0)) {
        return wrong("isolated_ratio", "1 or more");
    }
    if !(checks.isolated_above.is_finite() && checks.isolated_above >= 0.0) {
        return wrong("isolated_above", "0 or more");
    }
    Ok(())
}

/// `error` without `scale` among the keys that a table has, if it is of one [taxel.N]: that is a key of [all] alone.
fn without_scale(error: Error, text: &str) -> Error {
    let Some(place) = error.place().map(str::to_owned) else { return error };
    let line = place.strip_prefix("line ").and_then(|rest| rest.split(',').next()?.parse().ok()).unwrap_or(0);
    let head = text.lines().take(line).map(str::trim_start).filter(|line| line.starts_with('[')).last();
    let told = error.to_string();
    match told.strip_prefix(&format!("{place}: ")) {
        Some(what) if what.starts_with("there is no key") && head.is_some_and(|head| head.starts_with("[taxel.")) => {
            Error::failed(what.replace(" scale,", "")).at(place)
        }
        _ => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::keys::without_column;
    use crate::signal::{ChangeCalibration, ContactThresholds, FsrResponse, FsrSignal, Response, Sensors};

    #[test]
    fn a_taxel_overrides_what_holds_for_all() {
        let text = "[all]\nbaseline = 240\ngain = 2\ninvert = true\np_max = 255\nnoise = 1.5\n[taxel.7]\nbaseline = 200\nmask = true\n\
             noise = 0\n";
        let calibration = Calibration::parse(text, &[3, 7]).unwrap();
        assert_eq!(calibration.taxels[0].gain, -2.0);
        assert_eq!(calibration.taxels[0].baseline, 240.0);
        assert_eq!(calibration.taxels[1].baseline, 200.0);
        assert_eq!([0, 1].map(|taxel| calibration.taxels[taxel].noise), [Some(1.5), Some(0.0)]);
        assert_eq!(Calibration::parse("", &[3]).unwrap().taxels[0].noise, None);
        assert!(calibration.taxels[1].mask && !calibration.taxels[0].mask);
    }

    #[test]
    fn a_scale_multiplies_every_gain_and_no_other_key() {
        let text = "[curve.a]\nraw = [0, 10]\np = [0, 4]\n[all]\nscale = 0.5\ngain = 3\ndead_band = 2\np_max = 90\nunit = \"kPa\"\n\
             [taxel.7]\ngain = 4\ninvert = true\n[taxel.9]\ncurve = \"a\"\n";
        let read = Calibration::parse(text, &[3, 7, 9]).unwrap();
        assert_eq!(read.taxels.iter().map(|taxel| taxel.gain).collect::<Vec<_>>(), [1500.0, -2000.0, 1500.0]);
        assert!(read.taxels.iter().all(|taxel| (taxel.dead_band, taxel.p_max) == (2000.0, 90_000.0)));
        let why = |text: &str| without_column(&Calibration::parse(text, &[3, 7]).unwrap_err().to_string());
        let keys_of = |table: &str| why(&format!("[{table}]\nzzz = 1"));
        assert!(keys_of("all").contains(" raw_range, scale, sensor,"), "{}", keys_of("all"));
        assert!(keys_of("taxel.7").starts_with("line 2: there is no key `zzz`; it is one of baseline, curve,"));
        assert!(keys_of("taxel.7").contains(" raw_range, sensor,"), "{}", keys_of("taxel.7"));
        assert_eq!(why("[all]\nscale = 0"), "line 2: `scale` is 0; it must be between 1e-12 and 1e12");
        assert_eq!(
            why("[taxel.7]\nscale = 2"),
            "line 2: `scale` is a key of [all], for every gain; give [taxel.7] its own `gain`"
        );
        assert_eq!(
            why("[all]\ngain = 1e-10\nscale = 1e-6"),
            "line 3: `scale` makes a gain 1e-16; gains must be between 1e-12 and 1e12"
        );
    }

    #[test]
    fn what_makes_no_sense_is_named_with_its_line() {
        let why = |text: &str| without_column(&Calibration::parse(text, &[3, 7]).unwrap_err().to_string());
        assert_eq!(
            why("[all]\ngain = 0"),
            "line 2: `gain` is 0; it must be over 0, and between 1e-12 and 1e12 (`invert = true` turns the sign)"
        );
        assert!(why("[all]\ngain = nan").contains("line 2"));
        assert!(why("[taxel.5]\ngain = 1").contains("[taxel.5] names a taxel"));
        assert!(why("[all]\nbaselin = 1").contains("did you mean `baseline`"));
        assert!(why("[all]\nraw_range = [5, 1]").contains("line 2"));
        assert_eq!(why("[all]\nonset = \"late\""), "line 2: `onset` is `late`; it must be `hard` or `soft`");
        assert_eq!(why("[all]\nsensors = \"all\""), "line 2: `sensors` is `all`; it must be `cell` or `equal`");
        assert_eq!(why("[all]\nnoise = -1"), "line 2: `noise` is -1; it must be 0 or more raw units");
        assert!(why("[checks]\nbroken_frame_share = 3").contains("between 0 and 1"));
        assert!(why("all = 3").contains("line 1"));
        assert_eq!(why("[contact]\non = 3\noff = 4"), "line 3: `off` is 4; it must be between 0 and `on`");
        assert!(why("[contact]\non = -3").contains("line 2"));
        assert_eq!(why("[change]\ndead_band = -1"), "line 2: `dead_band` is -1; it must be 0 or more, in P per second");
        assert_eq!(why("[change]\non = nan"), "line 2: `on` is NaN; it must be 0 or more, in P per second");
        assert_eq!(why("[change]\non = 3\noff = 4"), "line 3: `off` is 4; it must be between 0 and `on`");
        assert_eq!(why("[layer]\nsigma_m = 0"), "line 2: `sigma_m` is 0; it must be over 0, and at most 1");
        assert!(why("[layer]\nsigma_m = 0.004\ngain_spread = 1.5").contains("line 3: `gain_spread` is 1.5"));
        assert!(why("[layer]\ngain_spread = 0.1").contains("sigma_m"));
        assert!(why("[chnge]\non = 3").contains("did you mean `change`"));
        assert!(why("[change]\nfield = 3").starts_with("line 2"));
    }

    #[test]
    fn a_pressure_weighs_by_its_cell_and_other_quantities_as_their_sensors_cover_it() {
        let weighs = |keys: &str, of_seven: &str| {
            let text = format!("[all]\n{keys}\n[taxel.7]\n{of_seven}\n");
            let read = Calibration::parse(&text, &[3, 7]).unwrap();
            [0, 1].map(|taxel| read.taxels[taxel].weighs_by_cell())
        };
        let [cell, equal] = [Sensors::Cell, Sensors::Equal].map(|sensors| format!("sensors = \"{}\"", sensors.name()));
        assert_eq!(weighs("", &cell), [true, false]);
        assert_eq!(weighs("unit = \"mN\"", &equal), [false, true]);
        assert_eq!(weighs(&cell, "unit = \"kPa\""), [false, true]);
        assert_eq!(weighs(&cell, &equal), [false, true]);
        assert_eq!(weighs(&format!("unit = \"N\"\n{equal}"), &cell), [true, false]);
    }

    #[test]
    fn raw_values_that_are_not_readings_are_listed_for_all_and_for_single_taxels() {
        let read = |text: &str| Calibration::parse(text, &[3, 7]).map_err(|e| without_column(&e.to_string()));
        let both = read("[all]\nmissing = [30000, -1]\n[taxel.7]\nmissing = [0.1]").unwrap();
        assert_eq!(both.missing, [vec![30_000.0, -1.0], vec![0.1]]);
        let value = crate::signal::RawValue::new;
        assert!(both.is_no_reading(0, value(30_000.0)) && !both.is_no_reading(1, value(30_000.0)));
        assert!(both.is_no_reading(1, value(0.1)), "as raw values are, in single precision");
        assert!(read("[all]\nmissing = []\n[taxel.3]\ngain = 2").unwrap().missing.is_empty());
        let why = |text: &str| read(text).unwrap_err();
        assert_eq!(why("[all]\nmissing = [1, nan]"), "line 2: `missing` has NaN; its values must be finite raw values");
        let many = format!("[all]\nmissing = {:?}", [1; 17]);
        assert_eq!(why(&many), "line 2: `missing` has 17 values; it may have 16");
    }

    #[test]
    fn a_taxel_has_one_table_however_its_id_is_written() {
        for (first, second) in [("17", "017"), ("+17", "17")] {
            let text = format!("[taxel.\"{first}\"]\nmask = true\n[taxel.\"{second}\"]\nmask = false\n");
            let why = without_column(&Calibration::parse(&text, &[3, 17]).unwrap_err().to_string());
            let right = format!(
                "line 3: [taxel.{second}] is taxel 17, which has the table [taxel.{first}] already; keep one of the two"
            );
            assert_eq!(why, right);
        }
    }

    #[test]
    fn what_changes_has_thresholds_of_its_own() {
        let read = |text: &str| Calibration::parse(text, &[]).unwrap().change;
        let contact = ContactThresholds { on: 30.0, off: 20.0 };
        assert_eq!(read("[change]\ndead_band = 5\non = 30\noff = 20"), ChangeCalibration { dead_band: 5.0, contact });
        assert_eq!(read("[change]\non = 30").contact.off, 30.0);
        assert_eq!(read("[contact]\non = 30"), ChangeCalibration::default());
    }

    #[test]
    fn a_response_is_read_and_overridden_by_a_taxel() {
        let text = "body = \"hand\"\n[curve.finger]\nraw = [0, 128, 255]\np = [9.5, 4, 0]\n[all]\nsensor = \"fsr\"\n\
                    wiper = 12\nsignal = \"raw\"\n[taxel.3]\nwiper = 255\nsignal = \"linear\"\nfull_scale_newton = 4\n\
                    [taxel.7]\ncurve = \"finger\"\n[taxel.9]\nsensor = \"linear\"";
        let calibration = Calibration::parse(text, &[1, 3, 7, 9]).unwrap();
        let fsr = |wiper, signal, full_scale_newton| Response::Fsr(FsrResponse { wiper, signal, full_scale_newton });
        let responses: Vec<Response> = calibration.taxels.iter().map(|taxel| taxel.response).collect();
        let right =
            [fsr(12, FsrSignal::Raw, 10.0), fsr(255, FsrSignal::Linear, 4.0), Response::Curve(0), Response::Linear];
        assert_eq!(responses, right);
        assert_eq!(calibration.taxels[0].raw_range, [0.0, 1023.0]);
        assert_eq!(calibration.curves[0].knots(), [[0.0, 9.5], [128.0, 4.0], [255.0, 0.0]]);
        // Pressed is positive, whichever way a sensor goes.
        assert_eq!(
            (calibration.rise(1, 1000.0), calibration.rise(2, 200.0), calibration.rise(3, 5.0)),
            (23.0, 55.0, 5.0)
        );
    }

    #[test]
    fn a_response_that_makes_no_sense_is_named_with_its_line() {
        let why = |text: &str| without_column(&Calibration::parse(text, &[3, 7]).unwrap_err().to_string());
        let curve = |raw: &str, p: &str| why(&format!("[curve.finger]\nraw = [{raw}]\np = [{p}]\n"));
        assert_eq!(
            curve("0, 1, 2", "0,\n9,\n8"),
            "line 5: [curve.finger]: `p` is 8 at knot 3, after 9: it is not monotone; it must rise all the way, or fall \
             all the way"
        );
        assert!(curve("0, 1, 2", "0, 1").starts_with("line 3: [curve.finger]: `raw` has 3 knots and `p` has 2"));
        assert!(curve("0", "1").starts_with("line 2: [curve.finger]: `raw` has 1 of the two"));
        assert!(curve("0, nan", "1, 2").starts_with("line 2: [curve.finger]: `raw` is NaN at knot 2"));
        assert!(curve("0, 3, 3", "1, 2, 3").starts_with("line 2: [curve.finger]: `raw` is 3 at knot 3, after 3"));
        let table = "[curve.finger]\nraw = [0, 1]\np = [0, 1]\n[all]\n";
        assert_eq!(
            why(&format!("{table}curve = \"fingr\"")),
            "line 5: `curve` is `fingr`, which the file does not have: did you mean `finger`?"
        );
        assert!(
            why("[taxel.3]\ncurve = \"a\"")
                .contains("line 2: `curve` is `a`, which the file does not have: add a table")
        );
        assert!(why(&format!("{table}curve = \"finger\"\nsensor = \"fsr\"")).contains("line 5: `curve` and `sensor`"));
        let steep = "[curve.a]\nraw = [0, 0.1]\np = [0, 1]\n[all]\ncurve = \"a\"\ngain = 1e12";
        assert!(why(steep).starts_with("line 6: `gain`"), "{}", why(steep));
        assert!(
            why("[all]\nsensor = \"fsr\"\nwiper = 256").starts_with("line 3: `wiper` is 256; it must be between 0")
        );
        assert!(why("[all]\nsensor = \"fsr\"\nwiper = 3.5").starts_with("line 3"));
        assert!(why("[all]\nsensor = \"fsr\"\nsignal = \"log\"").starts_with("line 3: `signal` is `log`"));
        assert!(why("[all]\nsensor = \"fsr\"\nfull_scale_newton = nan").starts_with("line 3: `full_scale_newton`"));
        assert!(why("[all]\nsensor = \"piezo\"").starts_with("line 2: `sensor` is `piezo`"));
        assert!(why("[all]\nwiper = 3").starts_with("line 2: `wiper` is for the paper's circuit"));
        assert!(
            why("[all]\nsensor = \"fsr\"\n[taxel.3]\nsensor = \"linear\"\nwiper = 3").starts_with("line 5: `wiper`")
        );
        assert!(why("[curv.a]\nraw = [0, 1]").contains("did you mean `curve`"));
    }

    #[test]
    fn a_baseline_that_leaves_nothing_to_feel_is_refused() {
        let why = |text: &str| Calibration::parse(text, &[3, 7]).map_err(|e| without_column(&e.to_string()));
        assert_eq!(
            why("[all]\nbaseline = 300\np_max = 255").unwrap_err(),
            "line 2: `baseline` is 300, above `p_max` 255; lower it, or give the `raw_range` of a sensor that reads that \
             high"
        );
        assert!(why("[all]\np_max = 255\n[taxel.7]\nbaseline = 300").unwrap_err().starts_with("line 4: `baseline`"));
        let ranged = "[all]\nbaseline = 300\np_max = 255\nraw_range = [0, 255]";
        assert!(why(ranged).unwrap_err().contains("`raw_range` ends at 255: no reading is above it"));
        assert!(why(&format!("{ranged}\ninvert = true")).is_ok());
        assert!(why("[all]\nbaseline = 5\ninvert = true\nraw_range = [5, 9]").unwrap_err().contains("below it"));
        // A barometer that reads 24000 at rest.
        assert!(why("[all]\nbaseline = 24000\np_max = 900\nraw_range = [0, 65535]").is_ok());
        assert!(why("[all]\nbaseline = 244\ninvert = true\np_max = 200").is_ok());
        assert!(why("[all]\np_max = 10\nbaseline = 244\n[taxel.3]\nbaseline = 1\n[taxel.7]\nbaseline = 2").is_ok());
    }

    #[test]
    fn a_file_for_another_body_is_refused_by_name() {
        let calibration = Calibration::parse("body = \"robots/hand.glb\"", &[]).unwrap();
        for same in ["hand", "hand.glb", "/somewhere/hand.gltf"] {
            assert!(calibration.check_body(same).is_ok(), "{same}");
        }
        let why = calibration.check_body("arm.glb").unwrap_err().to_string();
        assert!(why.starts_with("the calibration is for body `robots/hand.glb`, and this is `arm.glb`"), "{why}");
        let unknown = Calibration::parse("body = \"hand\"\n[taxel.9]\ngain = 2", &[1]).unwrap_err().to_string();
        assert!(unknown.contains("[taxel.9]") && unknown.contains("(the file is for `hand`)"), "{unknown}");
        assert!(Calibration::identity(3).check_body("anything").is_ok());
    }
}
