//! The tables `[temperature]` and `[proximity]`.

use std::ops::{Range, RangeInclusive};

use serde::Deserialize;
use toml::Spanned;

use crate::error::{Result, nearest};
use crate::keys::{Text, in_words, whole};
use crate::signal::curve::Curve;
use crate::signal::response::{GAIN_RANGE, MAX_MAGNITUDE};
use crate::signal::sense::{Sense, SenseCalibration, SenseResponse, ZERO_CELSIUS_K};

/// Windows of rates, s.
const WINDOWS_S: RangeInclusive<f64> = 1e-3..=3600.0;
/// B parameters of thermistors, K. Those that are sold have 2000 to 6000; with less the temperatures of a divider leave all that a
/// sensor survives.
const B_K: RangeInclusive<f64> = 500.0..=20_000.0;
/// Resistances of thermistors at 25 °C and beside them, Ω: some Ω to some MΩ. As their ratio alone counts, some write them in MΩ.
const OHMS: RangeInclusive<f64> = 1e-6..=1e9;

/// Most raw values that `missing` may list: every value of every frame is compared with each.
const MAX_MISSING: usize = 16;

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
    invert: Option<bool>,
    curve: Option<Spanned<String>>,
    ntc: Option<Spanned<NtcKeys>>,
    #[serde(default, deserialize_with = "whole")]
    raw_range: Option<Spanned<[f64; 2]>>,
    #[serde(default, deserialize_with = "whole")]
    missing: Option<Spanned<Vec<f64>>>,
    window_s: Option<Spanned<f64>>,
}

/// `[proximity]`.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ProximityKeys {
    unit: Option<Spanned<String>>,
    baseline: Option<Spanned<f64>>,
    gain: Option<Spanned<f64>>,
    invert: Option<bool>,
    curve: Option<Spanned<String>>,
    #[serde(default, deserialize_with = "whole")]
    raw_range: Option<Spanned<[f64; 2]>>,
    #[serde(default, deserialize_with = "whole")]
    missing: Option<Spanned<Vec<f64>>>,
    window_s: Option<Spanned<f64>>,
    range: Option<Spanned<f64>>,
}

/// A thermistor to ground under a resistor.
#[derive(Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "{ ohm_at_25 = Ω, b_k = K, series_ohm = Ω, full_raw = the raw value of the reference voltage }"
)]
struct NtcKeys {
    ohm_at_25: Spanned<f64>,
    b_k: Spanned<f64>,
    series_ohm: Spanned<f64>,
    full_raw: Spanned<f64>,
}

impl NtcKeys {
    fn read(&self, text: Text<'_>) -> Result<SenseResponse> {
        let within = |key: &str, value: &Spanned<f64>, range: &RangeInclusive<f64>, of: &str| {
            let number = *value.get_ref();
            if range.contains(&number) {
                return Ok(number);
            }
            let (least, most) = range.clone().into_inner();
            let [number, least, most] = [number, least, most].map(in_words);
            let what = format!("`{key}` is {number}; {of} is from {least} to {most}");
            Err(text.wrong(value.span(), what))
        };
        let resistance = "a resistance in Ω";
        Ok(SenseResponse::Ntc {
            ohm_at_25: within("ohm_at_25", &self.ohm_at_25, &OHMS, resistance)?,
            b_k: within("b_k", &self.b_k, &B_K, "the B parameter of a thermistor, in K,")?,
            series_ohm: within("series_ohm", &self.series_ohm, &OHMS, resistance)?,
            full_raw: text.positive("full_raw", &self.full_raw)?,
        })
    }
}

/// The keys that two tables share.
struct Common<'a> {
    unit: Option<&'a Spanned<String>>,
    baseline: Option<&'a Spanned<f64>>,
    gain: Option<&'a Spanned<f64>>,
    invert: Option<bool>,
    curve: Option<&'a Spanned<String>>,
    raw_range: Option<&'a Spanned<[f64; 2]>>,
    missing: Option<&'a Spanned<Vec<f64>>>,
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

/// The baseline of a taxel, or of all that measure the same.
pub(super) fn baseline_of(baseline: &Spanned<f64>, text: Text<'_>) -> Result<f64> {
    let number = *baseline.get_ref();
    if number.abs() <= MAX_MAGNITUDE {
        return Ok(number);
    }
    let what =
        format!("`baseline` is {}; it must be a finite number of raw units, at most 1e18 in size", in_words(number));
    Err(text.wrong(baseline.span(), what))
}

/// The gain of a taxel, or of all that measure the same.
pub(super) fn gain_of(gain: &Spanned<f64>, text: Text<'_>) -> Result<f64> {
    let number = *gain.get_ref();
    if GAIN_RANGE.contains(&number) {
        return Ok(number);
    }
    let must = "it must be over 0, and between 1e-12 and 1e12 (`invert = true` turns the sign)";
    Err(text.wrong(gain.span(), format!("`gain` is {}; {must}", in_words(number))))
}

/// A range of raw values.
pub(super) fn range_of(key: &str, range: &Spanned<[f64; 2]>, text: Text<'_>) -> Result<[f64; 2]> {
    let [low, high] = *range.get_ref();
    if low < high && low.abs() <= MAX_MAGNITUDE && high.abs() <= MAX_MAGNITUDE {
        return Ok([low, high]);
    }
    let [low, high] = [low, high].map(in_words);
    Err(text.wrong(range.span(), format!("`{key}` is [{low}, {high}]; give the lowest and the highest raw value")))
}

/// What `missing` lists, in single precision.
pub(super) fn codes_of(codes: &Spanned<Vec<f64>>, text: Text<'_>) -> Result<Vec<f32>> {
    if codes.get_ref().len() > MAX_MISSING {
        let what = format!("`missing` has {} values; it may have {MAX_MISSING}", codes.get_ref().len());
        return Err(text.wrong(codes.span(), what));
    }
    let code =
        |&raw: &f64| match raw {
            raw if raw.abs() <= MAX_MAGNITUDE => Ok(raw as f32),
            raw => Err(text
                .wrong(codes.span(), format!("`missing` has {}; its values must be finite raw values", in_words(raw)))),
        };
    codes.get_ref().iter().map(code).collect()
}

impl Common<'_> {
    /// The conversion, with units `units`; as `usual` where no key is given.
    fn read(&self, usual: Sense, units: &[(&str, f64, f64)], curves: Curves<'_>, text: Text<'_>) -> Result<Sense> {
        let mut sense = Sense { gain: 1.0, ..usual };
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
            sense.baseline = baseline_of(baseline, text)?;
        }
        if let Some(gain) = self.gain {
            sense.gain = gain_of(gain, text)?;
        }
        sense.gain *= factor;
        sense.offset = offset;
        sense.falls = self.invert.unwrap_or(false);
        if let Some(curve) = self.curve {
            sense.response = SenseResponse::Curve(curve_called(curve, curves, text)?);
        }
        if let Some(range) = self.raw_range {
            sense.raw_range = range_of("raw_range", range, text)?;
        }
        if let Some(codes) = self.missing {
            sense.missing = codes_of(codes, text)?;
        }
        Ok(sense)
    }

    /// A key that does not go with `ntc`, and where it is.
    fn rival_of_ntc(&self) -> Option<(&'static str, Range<usize>)> {
        let numbers = [("gain", self.gain), ("baseline", self.baseline)];
        let names = [("unit", self.unit), ("curve", self.curve)];
        let names = names.into_iter().filter_map(|(key, value)| Some((key, value?.span())));
        numbers.into_iter().filter_map(|(key, value)| Some((key, value?.span()))).chain(names).next()
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
            invert: self.invert,
            curve: self.curve.as_ref(),
            raw_range: self.raw_range.as_ref(),
            missing: self.missing.as_ref(),
        };
        let usual = SenseCalibration::of_temperature();
        let mut all = common.read(usual.all.clone(), &TEMPERATURES, curves, text)?;
        if let Some(ntc) = &self.ntc {
            if let Some((key, at)) = common.rival_of_ntc() {
                let what = format!("`{key}` and `ntc` both make °C of raw values; remove one of them");
                return Err(text.wrong(at, what));
            }
            all.response = ntc.get_ref().read(text)?;
        }
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
            invert: self.invert,
            curve: self.curve.as_ref(),
            raw_range: self.raw_range.as_ref(),
            missing: self.missing.as_ref(),
        };
        let usual = SenseCalibration::of_proximity();
        let all = common.read(usual.all.clone(), &DISTANCES, curves, text)?;
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

#[cfg(test)]
mod tests {
    use crate::body::Modality;
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
    fn what_makes_no_sense_is_said_with_its_line() {
        let why = |text: &str| read(text).unwrap_err();
        assert_eq!(why("[temperature]\nunit = \"hot\""), "line 2: there is no unit `hot` here; choose of °C, K, °F");
        let over_0 = "it must be over 0, and between 1e-12 and 1e12 (`invert = true` turns the sign)";
        for table in ["temperature", "proximity", "taxel.7", "all"] {
            for wrong in ["0", "-1", "inf", "1e300"] {
                assert_eq!(why(&format!("[{table}]\ngain = {wrong}")), format!("line 2: `gain` is {wrong}; {over_0}"));
            }
            assert_eq!(
                why(&format!("[{table}]\nbaseline = 1e300")),
                "line 2: `baseline` is 1e300; it must be a finite number of raw units, at most 1e18 in size"
            );
            assert_eq!(why(&format!("[{table}]\nmissing = [\"a\"]")), "line 2: this must be [number, …]");
        }
        assert_eq!(why("temperature = 3"), "line 1: this is the number `3`; it must be a table of keys");
        assert!(why("[proximity]\nwindow_s = 0").starts_with("line 2: `window_s` is 0"));
        assert!(why("[proximity]\nrange = -1").starts_with("line 2: `range` is -1; it must be over 0"));
        assert!(why("[proximity]\ncurve = \"far\"").contains("add a table [curve.far]"));
        assert!(why("[temprature]\ngain = 1").contains("did you mean `temperature`"));
        let many = format!("[temperature]\nmissing = {:?}", [1; 17]);
        assert_eq!(why(&many), "line 2: `missing` has 17 values; it may have 16");
        assert!(
            why("[proximity]\nmissing = [1, inf]").starts_with("line 2: `missing` has inf; its values must be finite")
        );
    }

    #[test]
    fn what_would_count_beside_a_thermistor_is_refused() {
        let curve = "[curve.a]\nraw = [0, 300]\np = [0, 30]\n";
        let ntc = "ntc = { ohm_at_25 = 10e3, b_k = 3950, series_ohm = 10e3, full_raw = 1023 }\n";
        for key in ["gain = 0.1", "gain = 1", "baseline = 5", "unit = \"K\"", "curve = \"a\""] {
            let name = key.split(' ').next().unwrap();
            for text in [format!("{key}\n{ntc}"), format!("{ntc}{key}\n")] {
                let (text, line) = (format!("{curve}[temperature]\n{text}"), if text.starts_with(key) { 5 } else { 6 });
                let both = format!("line {line}: `{name}` and `ntc` both make °C of raw values; remove one of them");
                assert_eq!(read(&text).unwrap_err(), both);
            }
        }
        let kinds = [(3, Modality::Pressure), (7, Modality::Temperature)];
        let own = |keys: &str| {
            let text = format!("{curve}[temperature]\n{ntc}{keys}");
            Calibration::parse_for(&text, &kinds).map_err(|e| without_column(&e.to_string()))
        };
        for (key, name) in [("gain = 2", "gain"), ("baseline = 0", "baseline")] {
            assert_eq!(
                own(&format!("[taxel.7]\n{key}\n")).unwrap_err(),
                format!(
                    "line 7: `{name}` does not go with `ntc` in [temperature]; remove it, or give taxel 7 a `curve`"
                )
            );
        }
        let read = own("[taxel.3]\ngain = 2\nbaseline = 3\n[taxel.7]\ncurve = \"a\"\ngain = 2\nbaseline = 10\n");
        let read = read.unwrap();
        assert_eq!((read.taxels[0].gain, value(read.temperature.of_taxel(1).read(RawValue::new(110.0)))), (2.0, 20.0));
        // What is laid over a gain takes its place.
        let laid = Calibration::lay_over_for(
            "[temperature]\ngain = 2\n[taxel.7]\nbaseline = 3\n",
            &format!("[temperature]\n{ntc}"),
            &kinds,
        );
        let laid = Calibration::parse_for(&laid.unwrap().text, &kinds).unwrap().temperature;
        assert!((value(laid.of_taxel(1).read(RawValue::new(511.5))) - 25.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_colder_than_absolute_zero_is_no_reading() {
        for (unit, zero) in [("°C", -273.15), ("K", 0.0), ("°F", -459.67)] {
            let read =
                read(&format!("[temperature]\nunit = \"{unit}\"\n[taxel.7]\ninvert = true\n")).unwrap().temperature;
            let at = |taxel: usize, raw: f64| read.of_taxel(taxel).read(RawValue::new(raw));
            assert_eq!([at(0, zero - 0.01), at(1, 0.01 - zero)], [Reading::Faulty; 2], "{unit}");
            assert!(value(at(0, zero + 0.01)) < -273.1 && value(at(1, -zero - 0.01)) < -273.1, "{unit}");
        }
        let kelvin = read("[temperature]\nunit = \"K\"\n").unwrap().temperature;
        assert_eq!(value(kelvin.of_taxel(0).read(RawValue::new(0.0))), -273.15);
        // Distances have no such end.
        assert_eq!(value(read("").unwrap().proximity.of_taxel(0).read(RawValue::new(-300.0))), -0.3);
    }

    #[test]
    fn lists_of_another_length_are_refused() {
        for text in
            ["[all]\nraw_range = [0, 10, 20]", "[temperature]\nraw_range = [0]", "[proximity]\nraw_range = [0, 1, 2]"]
        {
            let why = read(text).unwrap_err();
            assert!(why.starts_with("line 2: a list has ") && why.contains("here; give it "), "{text}: {why}");
        }
    }

    #[test]
    fn thermistors_are_such_as_there_are() {
        let why = |keys: &str| read(&format!("[temperature]\nntc = {keys}")).unwrap_err();
        assert_eq!(
            why("5"),
            "line 2: this is the number `5`; it must be { ohm_at_25 = Ω, b_k = K, series_ohm = Ω, full_raw = the raw \
             value of the reference voltage }"
        );
        let with = |r25: &str, b: &str, above: &str, full: &str| {
            why(&format!("{{ ohm_at_25 = {r25}, b_k = {b}, series_ohm = {above}, full_raw = {full} }}"))
        };
        assert_eq!(
            with("1e4", "100", "1e4", "1023"),
            "line 2: `b_k` is 100; the B parameter of a thermistor, in K, is from 500 to 20000"
        );
        assert_eq!(
            with("1e30", "3950", "1e4", "1023"),
            "line 2: `ohm_at_25` is 1e30; a resistance in Ω is from 0.000001 to 1000000000"
        );
        assert!(with("1e4", "3950", "0", "1023").starts_with("line 2: `series_ohm` is 0; a resistance"));
        assert!(with("1e4", "3950", "1e4", "nan").starts_with("line 2: `full_raw` is NaN; it must be over 0"));
    }
}
