//! The tables of senses beside pressure: `[temperature]`, `[proximity]` and `[shear]`.

use serde::Deserialize;
use toml::Spanned;

use crate::error::{Result, nearest};
use crate::keys::Text;
use crate::signal::curve::Curve;
use crate::signal::response::{GAIN_RANGE, MAX_MAGNITUDE};
use crate::signal::sense::{Sense, SenseCalibration, SenseResponse, ShearCalibration, ZERO_CELSIUS_K};

/// Windows of rates, s.
const WINDOWS_S: std::ops::RangeInclusive<f64> = 1e-3..=3600.0;

/// Units of temperature: the name, °C of one of it, °C at 0 of it.
const TEMPERATURES: [(&str, f64, f64); 3] =
    [("°C", 1.0, 0.0), ("K", 1.0, -ZERO_CELSIUS_K), ("°F", 5.0 / 9.0, -160.0 / 9.0)];
/// Units of distance, and m of one of it.
const DISTANCES: [(&str, f64, f64); 4] = [("mm", 1e-3, 0.0), ("cm", 1e-2, 0.0), ("m", 1.0, 0.0), ("in", 0.0254, 0.0)];

/// `[temperature]`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TemperatureKeys {
    unit: Option<Spanned<String>>,
    baseline: Option<Spanned<f64>>,
    gain: Option<Spanned<f64>>,
    curve: Option<Spanned<String>>,
    ntc: Option<Spanned<NtcKeys>>,
    raw_range: Option<Spanned<[f64; 2]>>,
    missing: Option<Vec<f64>>,
    window_s: Option<Spanned<f64>>,
}

/// `[proximity]`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ProximityKeys {
    unit: Option<Spanned<String>>,
    baseline: Option<Spanned<f64>>,
    gain: Option<Spanned<f64>>,
    curve: Option<Spanned<String>>,
    raw_range: Option<Spanned<[f64; 2]>>,
    missing: Option<Vec<f64>>,
    window_s: Option<Spanned<f64>>,
    range: Option<Spanned<f64>>,
}

/// `[shear]`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ShearKeys {
    baseline: Option<Spanned<[f64; 2]>>,
    gain: Option<Spanned<f64>>,
    cross_axis: Option<Spanned<[[f64; 3]; 2]>>,
    slips_at: Option<Spanned<f64>>,
}

/// A thermistor to ground under a resistor.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct NtcKeys {
    ohm_at_25: f64,
    b_k: f64,
    series_ohm: f64,
    full_raw: f64,
}

/// The keys that two tables share.
struct Common<'a> {
    unit: Option<&'a Spanned<String>>,
    baseline: Option<&'a Spanned<f64>>,
    gain: Option<&'a Spanned<f64>>,
    curve: Option<&'a Spanned<String>>,
    raw_range: Option<&'a Spanned<[f64; 2]>>,
    missing: &'a [f64],
}

/// The file's curves and their names.
pub(super) type Curves<'a> = (&'a [Curve], &'a [&'a str]);

/// Which of the file's curves, whose names are `names`, is called `name`.
pub(super) fn curve_index(name: &Spanned<String>, names: &[&str], text: Text<'_>) -> Result<usize> {
    names.iter().position(|known| known == name.get_ref()).ok_or_else(|| {
        let hint = match nearest(name.get_ref(), names.iter().copied()) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("add a table [curve.{}]", name.get_ref()),
        };
        text.wrong(name.span(), format!("`curve` is `{}`, which the file does not have: {hint}", name.get_ref()))
    })
}

/// The curve called `name`.
pub(super) fn curve_called(name: &Spanned<String>, (curves, names): Curves<'_>, text: Text<'_>) -> Result<Curve> {
    Ok(curves[curve_index(name, names, text)?].clone())
}

/// A gain, which may be negative.
pub(super) fn gain_of(key: &str, gain: &Spanned<f64>, text: Text<'_>) -> Result<f64> {
    let number = *gain.get_ref();
    if GAIN_RANGE.contains(&number.abs()) {
        return Ok(number);
    }
    Err(text.wrong(gain.span(), format!("`{key}` is {number}; it must be between 1e-12 and 1e12 in size")))
}

pub(super) fn baselines_of(key: &str, baselines: &Spanned<[f64; 2]>, text: Text<'_>) -> Result<[f64; 2]> {
    let both = *baselines.get_ref();
    if both.iter().all(|raw| raw.abs() <= MAX_MAGNITUDE) {
        return Ok(both);
    }
    Err(text.wrong(baselines.span(), format!("`{key}` is {both:?}; it must be two finite numbers of raw units")))
}

impl Common<'_> {
    /// The conversion, with units `units`.
    fn read(&self, units: &[(&str, f64, f64)], curves: Curves<'_>, text: Text<'_>) -> Result<Sense> {
        let mut sense = Sense::default();
        let plain = |unit: &str| unit.trim_start_matches('°').to_ascii_lowercase();
        let (_, factor, offset) = match self.unit {
            None => units[0],
            Some(unit) => {
                let found = units.iter().find(|(known, ..)| plain(known) == plain(unit.get_ref().trim()));
                *found.ok_or_else(|| {
                    let names = units.iter().map(|(name, ..)| *name).collect::<Vec<_>>().join(", ");
                    text.wrong(unit.span(), format!("there is no unit `{}` here; choose of {names}", unit.get_ref()))
                })?
            }
        };
        if let Some(baseline) = self.baseline {
            sense.baseline = text.finite("baseline", baseline)?;
        }
        if let Some(gain) = self.gain {
            sense.gain = gain_of("gain", gain, text)?;
        }
        sense.gain *= factor;
        sense.offset = offset;
        if let Some(curve) = self.curve {
            sense.response = SenseResponse::Curve(curve_called(curve, curves, text)?);
        }
        if let Some(range) = self.raw_range {
            let [low, high] = *range.get_ref();
            if !(low < high && low.is_finite() && high.is_finite()) {
                let what = format!("`raw_range` is [{low}, {high}]; give the lowest and the highest raw value");
                return Err(text.wrong(range.span(), what));
            }
            sense.raw_range = [low, high];
        }
        sense.missing = self.missing.iter().map(|&raw| raw as f32).collect();
        Ok(sense)
    }
}

/// A gain as the file has it.
fn written(gain: Option<&Spanned<f64>>) -> f64 {
    gain.map_or(1.0, |gain| *gain.get_ref())
}

fn window_of(window_s: Option<&Spanned<f64>>, usual: f64, text: Text<'_>) -> Result<f64> {
    let Some(window_s) = window_s else { return Ok(usual) };
    if WINDOWS_S.contains(window_s.get_ref()) {
        return Ok(*window_s.get_ref());
    }
    Err(text.wrong(window_s.span(), format!("`window_s` is {}; it must be from 0.001 to 3600", window_s.get_ref())))
}

impl TemperatureKeys {
    pub(super) fn read(&self, curves: Curves<'_>, text: Text<'_>) -> Result<SenseCalibration> {
        let common = Common {
            unit: self.unit.as_ref(),
            baseline: self.baseline.as_ref(),
            gain: self.gain.as_ref(),
            curve: self.curve.as_ref(),
            raw_range: self.raw_range.as_ref(),
            missing: self.missing.as_deref().unwrap_or_default(),
        };
        let mut all = common.read(&TEMPERATURES, curves, text)?;
        if let Some(ntc) = &self.ntc {
            if self.curve.is_some() || self.unit.is_some() {
                let what = "`ntc` gives °C by itself; leave out `curve` and `unit`";
                return Err(text.wrong(ntc.span(), what));
            }
            let &NtcKeys { ohm_at_25, b_k, series_ohm, full_raw } = ntc.get_ref();
            if ![ohm_at_25, b_k, series_ohm, full_raw].iter().all(|x| *x > 0.0 && x.is_finite()) {
                let what =
                    "`ntc` has a number that is not over 0: ohm_at_25 (Ω), b_k (K), series_ohm (Ω) and full_raw are";
                return Err(text.wrong(ntc.span(), what));
            }
            all.response = SenseResponse::Ntc { ohm_at_25, b_k, series_ohm, full_raw };
        }
        let usual = SenseCalibration::of_temperature();
        let window_s = window_of(self.window_s.as_ref(), usual.window_s, text)?;
        Ok(SenseCalibration { all, window_s, written_gain: written(self.gain.as_ref()), ..usual })
    }
}

impl ProximityKeys {
    pub(super) fn read(&self, curves: Curves<'_>, text: Text<'_>) -> Result<SenseCalibration> {
        let common = Common {
            unit: self.unit.as_ref(),
            baseline: self.baseline.as_ref(),
            gain: self.gain.as_ref(),
            curve: self.curve.as_ref(),
            raw_range: self.raw_range.as_ref(),
            missing: self.missing.as_deref().unwrap_or_default(),
        };
        let all = common.read(&DISTANCES, curves, text)?;
        let usual = SenseCalibration::of_proximity();
        let window_s = window_of(self.window_s.as_ref(), usual.window_s, text)?;
        let mut range_m = usual.range_m;
        if let Some(range) = &self.range {
            // In the unit of the distances: what one is in m without the gain.
            let factor = all.gain / written(self.gain.as_ref());
            range_m = text.positive("range", range)? * factor;
        }
        Ok(SenseCalibration { all, window_s, range_m, written_gain: written(self.gain.as_ref()), ..usual })
    }
}

impl ShearKeys {
    pub(super) fn read(&self, text: Text<'_>) -> Result<ShearCalibration> {
        let mut shear = ShearCalibration::default();
        if let Some(baselines) = &self.baseline {
            shear.baselines = baselines_of("baseline", baselines, text)?;
        }
        shear.gain = self.gain.as_ref().map(|gain| gain_of("gain", gain, text)).transpose()?;
        if let Some(matrix) = &self.cross_axis {
            if !matrix.get_ref().iter().flatten().all(|x| x.abs() <= 1e6) {
                let what = "`cross_axis` has a number that is not finite; give two rows of three: shares of the normal force, of u and of v";
                return Err(text.wrong(matrix.span(), what));
            }
            shear.cross_axis = *matrix.get_ref();
        }
        if let Some(slips_at) = &self.slips_at {
            shear.slips_at = Some(text.positive("slips_at", slips_at)?);
        }
        Ok(shear)
    }
}

#[cfg(test)]
mod tests {
    use crate::keys::without_column;
    use crate::signal::{Calibration, RawValue, Reading};

    fn read(text: &str) -> Result<Calibration, String> {
        Calibration::parse(text, &[3, 7]).map_err(|e| without_column(&e.to_string()))
    }

    fn value(reading: Reading) -> f64 {
        match reading {
            Reading::Value(value, _) => value,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn temperatures_are_in_degrees_celsius_whatever_the_unit() {
        for (unit, raw) in [("°C", 36.6), ("K", 309.75), ("°F", 97.88), ("c", 36.6)] {
            let read = read(&format!("[temperature]\nunit = \"{unit}\"\n")).unwrap().temperature;
            let single = f64::from(raw as f32);
            let right = 36.6 + (single - raw) * if unit == "°F" { 5.0 / 9.0 } else { 1.0 };
            assert!((value(read.of_taxel(0).read(RawValue::new(raw))) - right).abs() < 1e-12, "{unit}");
        }
        let by_ten = read("[temperature]\ngain = 0.1\nbaseline = 50\n[taxel.7]\nbaseline = 100\n").unwrap().temperature;
        assert_eq!([0, 1].map(|taxel| value(by_ten.of_taxel(taxel).read(RawValue::new(300.0)))), [25.0, 20.0]);
        let ntc =
            "[temperature]\nntc = { ohm_at_25 = 10e3, b_k = 3950, series_ohm = 10e3, full_raw = 1023 }\nwindow_s = 5\n";
        let ntc = read(ntc).unwrap().temperature;
        assert!((value(ntc.of_taxel(1).read(RawValue::new(511.5))) - 25.0).abs() < 1e-9 && ntc.window_s == 5.0);
    }

    #[test]
    fn distances_are_in_metres_and_have_a_range_in_their_unit() {
        let read =
            read("[proximity]\nunit = \"cm\"\ngain = 2\nrange = 30\n[taxel.3]\nmask = true\n").unwrap().proximity;
        assert_eq!((value(read.of_taxel(1).read(RawValue::new(5.0))), read.range_m), (0.1, 0.3));
        assert_eq!(read.of_taxel(0).read(RawValue::new(5.0)), Reading::Faulty);
    }

    #[test]
    fn tangential_forces_have_baselines_gains_and_what_the_axes_share() {
        let text = "[all]\nunit = \"N\"\n[shear]\nbaseline = [10, -10]\ngain = 0.01\ncross_axis = [[0.1, 1, 0], [0, 0, 1]]\nslips_at = 0.6\n\
                    [taxel.7]\nshear_baseline = [1, 2]\nshear_gain = 0.02\n";
        let shear = read(text).unwrap().shear;
        assert_eq!((shear.baselines, shear.gain, shear.cross_axis[0]), ([10.0, -10.0], Some(0.01), [0.1, 1.0, 0.0]));
        assert_eq!((shear.own_baselines[&1], shear.own_gains[&1], shear.slips_at), ([1.0, 2.0], 0.02, Some(0.6)));
    }

    #[test]
    fn what_makes_no_sense_is_said_with_its_line() {
        let why = |text: &str| read(text).unwrap_err();
        assert_eq!(why("[temperature]\nunit = \"hot\""), "line 2: there is no unit `hot` here; choose of °C, K, °F");
        assert_eq!(why("[temperature]\ngain = 0"), "line 2: `gain` is 0; it must be between 1e-12 and 1e12 in size");
        assert!(why("[proximity]\nwindow_s = 0").starts_with("line 2: `window_s` is 0"));
        assert!(why("[proximity]\nrange = -1").starts_with("line 2: `range` is -1; it must be over 0"));
        assert!(why("[proximity]\ncurve = \"far\"").contains("add a table [curve.far]"));
        let both = "[temperature]\nunit = \"K\"\nntc = { ohm_at_25 = 1, b_k = 1, series_ohm = 1, full_raw = 1 }";
        assert!(why(both).starts_with("line 3: `ntc` gives °C by itself"));
        assert!(why("[shear]\ncross_axis = [[1, nan, 0], [0, 0, 1]]").starts_with("line 2: `cross_axis`"));
        assert!(why("[shear]\nslips_at = 0").starts_with("line 2: `slips_at` is 0"));
        assert!(why("[temprature]\ngain = 1").contains("did you mean `temperature`"));
    }
}
