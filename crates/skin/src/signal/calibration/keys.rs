//! The keys of a taxel's calibration, and the check that they fit together.

use std::ops::Range;

use serde::Deserialize;
use toml::{Spanned, Value};

use super::senses::{Curves, codes_of, curve_called, curve_index, range_of};
use super::shear_keys::{Gains, OwnShear, scaled};
use super::{Onset, Sensors, TaxelCalibration};
use crate::error::{Error, Result};
use crate::keys::{Text, whole};
use crate::signal::curve::{Column, Curve};
use crate::signal::fsr::FsrCircuit;
use crate::signal::response::{FsrResponse, GAIN_RANGE, MAX_MAGNITUDE, Response};
use crate::signal::sense::{SenseCalibration, SenseResponse, ShearCalibration};
use crate::signal::unit::UnitOfP;

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Keys {
    unit: Option<Spanned<String>>,
    sensors: Option<Spanned<String>>,
    baseline: Option<Spanned<f64>>,
    gain: Option<Spanned<f64>>,
    scale: Option<Spanned<f64>>,
    invert: Option<bool>,
    dead_band: Option<Spanned<f64>>,
    onset: Option<Spanned<String>>,
    p_max: Option<Spanned<f64>>,
    #[serde(default, deserialize_with = "whole")]
    raw_range: Option<Spanned<[f64; 2]>>,
    noise: Option<Spanned<f64>>,
    gain_spread: Option<Spanned<f64>>,
    missing: Option<Spanned<Vec<Spanned<f64>>>>,
    mask: Option<bool>,
    curve: Option<Spanned<String>>,
    sensor: Option<Spanned<String>>,
    wiper: Option<Spanned<i64>>,
    signal: Option<Spanned<String>>,
    full_scale_newton: Option<Spanned<f64>>,
    #[serde(default, deserialize_with = "whole")]
    shear_baseline: Option<Spanned<[f64; 2]>>,
    #[serde(default, deserialize_with = "whole")]
    shear_gain: Option<Spanned<Gains>>,
    #[serde(default, deserialize_with = "whole")]
    shear_raw_range: Option<Spanned<[f64; 2]>>,
    shear_noise: Option<Spanned<Value>>,
}

impl Keys {
    /// The raw values that are not readings, in single precision as raw values are; `None` if the key is not given.
    pub(super) fn missing(&self, text: Text<'_>) -> Result<Option<Vec<f32>>> {
        self.missing.as_ref().map(|codes| codes_of(codes, text)).transpose()
    }

    /// The keys that only a taxel that feels pressure has, and where they are.
    pub(super) fn of_pressure(&self) -> [(&'static str, Option<Range<usize>>); 11] {
        [
            ("unit", self.unit.as_ref().map(Spanned::span)),
            ("sensors", self.sensors.as_ref().map(Spanned::span)),
            ("dead_band", self.dead_band.as_ref().map(Spanned::span)),
            ("onset", self.onset.as_ref().map(Spanned::span)),
            ("p_max", self.p_max.as_ref().map(Spanned::span)),
            ("noise", self.noise.as_ref().map(Spanned::span)),
            ("gain_spread", self.gain_spread.as_ref().map(Spanned::span)),
            ("sensor", self.sensor.as_ref().map(Spanned::span)),
            ("wiper", self.wiper.as_ref().map(Spanned::span)),
            ("signal", self.signal.as_ref().map(Spanned::span)),
            ("full_scale_newton", self.full_scale_newton.as_ref().map(Spanned::span)),
        ]
    }

    /// The keys that only a taxel with three axes has, and where they are.
    pub(super) fn of_shear(&self) -> [(&'static str, Option<Range<usize>>); 4] {
        [
            ("shear_baseline", self.shear_baseline.as_ref().map(Spanned::span)),
            ("shear_gain", self.shear_gain.as_ref().map(Spanned::span)),
            ("shear_raw_range", self.shear_raw_range.as_ref().map(Spanned::span)),
            ("shear_noise", self.shear_noise.as_ref().map(Spanned::span)),
        ]
    }

    /// Lays the keys of the body's taxel `taxel` over those of its sense, whichever that is.
    pub(super) fn sense(
        &self,
        taxel: usize,
        senses: &mut SenseCalibration,
        curves: Curves<'_>,
        text: Text<'_>,
    ) -> Result<()> {
        let mut own = senses.all.clone();
        if let Some(baseline) = &self.baseline {
            own.baseline = *baseline.get_ref();
        }
        if let Some(gain) = &self.gain {
            own.gain *= gain.get_ref() / senses.written_gain;
        }
        if let Some(curve) = &self.curve {
            own.response = SenseResponse::Curve(curve_called(curve, curves, text)?);
        }
        if let Some(range) = &self.raw_range {
            own.raw_range = *range.get_ref();
        }
        own.falls = self.invert.unwrap_or(own.falls);
        own.mask = self.mask.unwrap_or(own.mask);
        if own != senses.all {
            senses.own.insert(taxel, own);
        }
        Ok(())
    }

    /// The same of its tangential forces.
    pub(super) fn shear(&self, taxel: usize, shear: &mut ShearCalibration, text: Text<'_>) -> Result<()> {
        let own = OwnShear {
            baseline: self.shear_baseline.as_ref(),
            gain: self.shear_gain.as_ref(),
            raw_range: self.shear_raw_range.as_ref(),
            noise: self.shear_noise.as_ref(),
        };
        own.read(taxel, shear, text)
    }

    /// Refuses keys that hold for all taxels alike under a single one.
    pub(super) fn only_for_one(&self, id: &str, text: Text<'_>) -> Result<()> {
        match &self.scale {
            Some(scale) => {
                let what = format!("`scale` is a key of [all], for every gain; give [taxel.{id}] its own `gain`");
                Err(text.wrong(scale.span(), what))
            }
            None => Ok(()),
        }
    }
}

/// `[curve.NAME]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CurveKeys {
    raw: Spanned<Vec<Spanned<f64>>>,
    p: Spanned<Vec<Spanned<f64>>>,
}

impl CurveKeys {
    pub(super) fn read(&self, name: &str, text: Text<'_>) -> Result<Curve> {
        let numbers = |column: &Spanned<Vec<Spanned<f64>>>| -> Vec<f64> {
            column.get_ref().iter().map(|x| *x.get_ref()).collect()
        };
        Curve::checked(&numbers(&self.raw), &numbers(&self.p)).map_err(|error| {
            let column = if error.column == Column::Raw { &self.raw } else { &self.p };
            let span = column.get_ref().get(error.knot).map_or(column.span(), Spanned::span);
            text.put(span, Error::failed(error.what).at(format!("[curve.{name}]")))
        })
    }
}

/// A taxel's calibration while its keys are read.
#[derive(Clone, Copy, Default)]
pub(super) struct Draft {
    taxel: TaxelCalibration,
    /// Of gain, dead band and P_max.
    unit: UnitOfP,
    kind: Kind,
    fsr: FsrResponse,
    /// Where keys are that are checked together with others at the end.
    baseline_at: Option<usize>,
    gain_at: Option<usize>,
    range_given: bool,
    /// What every gain is multiplied by, and where that stands.
    scale: Option<(f64, usize)>,
}

#[derive(Clone, Copy, Default, PartialEq)]
enum Kind {
    #[default]
    Linear,
    Curve(usize),
    Fsr,
}

impl Draft {
    /// Applies `keys`; `curves` are the names of the file's curves.
    pub(super) fn apply(&mut self, keys: &Keys, curves: &[&str], text: Text<'_>) -> Result<()> {
        self.apply_response(keys, curves, text)?;
        if let Some(unit) = &keys.unit {
            self.unit = unit.get_ref().parse().map_err(|e: Error| text.wrong(unit.span(), e.to_string()))?;
        }
        if let Some(sensors) = &keys.sensors {
            let sensors = sensors.get_ref().parse::<Sensors>().map_err(|_| {
                let what = format!("`sensors` is `{}`; it must be `cell` or `equal`", sensors.get_ref());
                text.wrong(sensors.span(), what)
            })?;
            self.taxel.sensors = Some(sensors);
        }
        let taxel = &mut self.taxel;
        let number =
            |key: &str, value: &Option<Spanned<f64>>, fits: &dyn Fn(f64) -> bool, must: &str| -> Result<Option<f64>> {
                let Some(value) = value else { return Ok(None) };
                if fits(*value.get_ref()) {
                    return Ok(Some(*value.get_ref()));
                }
                Err(text.wrong(value.span(), format!("`{key}` is {}; it must be {must}", value.get_ref())))
            };
        if let Some(x) =
            number("baseline", &keys.baseline, &|x| x.abs() <= MAX_MAGNITUDE, "a finite number of raw units")?
        {
            taxel.baseline = x;
        }
        if let Some(x) = number(
            "gain",
            &keys.gain,
            &|x| GAIN_RANGE.contains(&x),
            "over 0, and between 1e-12 and 1e12 (`invert = true` turns the sign)",
        )? {
            taxel.gain = x.copysign(taxel.gain);
        }
        if let (Some(x), Some(scale)) =
            (number("scale", &keys.scale, &|x| GAIN_RANGE.contains(&x), "between 1e-12 and 1e12")?, &keys.scale)
        {
            self.scale = Some((x, scale.span().start));
        }
        if let Some(invert) = keys.invert {
            taxel.gain = if invert { -taxel.gain.abs() } else { taxel.gain.abs() };
        }
        if let Some(x) = number(
            "dead_band",
            &keys.dead_band,
            &|x| (0.0..=MAX_MAGNITUDE).contains(&x),
            "0 or more, in the unit of P",
        )? {
            taxel.dead_band = x;
        }
        if let Some(onset) = &keys.onset {
            taxel.onset = match onset.get_ref().as_str() {
                "hard" => Onset::Hard,
                "soft" => Onset::Soft,
                other => {
                    let what = format!("`onset` is `{other}`; it must be `hard` or `soft`");
                    return Err(text.wrong(onset.span(), what));
                }
            };
        }
        if let Some(x) = number("p_max", &keys.p_max, &|x| x > 0.0 && x <= MAX_MAGNITUDE, "over 0, in the unit of P")? {
            taxel.p_max = x;
        }
        if let Some(x) = number("noise", &keys.noise, &|x| (0.0..=MAX_MAGNITUDE).contains(&x), "0 or more raw units")? {
            taxel.noise = Some(x);
        }
        if let Some(x) = number("gain_spread", &keys.gain_spread, &|x| (0.0..=1.0).contains(&x), "between 0 and 1")? {
            taxel.gain_spread = Some(x);
        }
        if let Some(range) = &keys.raw_range {
            let [low, high] = range_of("raw_range", range, text)?;
            taxel.raw_range = [low as f32, high as f32];
        }
        if let Some(mask) = keys.mask {
            taxel.mask = mask;
        }
        Ok(())
    }

    fn apply_response(&mut self, keys: &Keys, curves: &[&str], text: Text<'_>) -> Result<()> {
        if let (Some(curve), Some(_)) = (&keys.curve, &keys.sensor) {
            let what = "`curve` and `sensor` both define the response; keep one of them";
            return Err(text.wrong(curve.span(), what));
        }
        if let Some(curve) = &keys.curve {
            let index = curve_index(curve, curves, text)?;
            self.kind = Kind::Curve(index);
        }
        if let Some(sensor) = &keys.sensor {
            self.kind = match sensor.get_ref().as_str() {
                "linear" => Kind::Linear,
                "fsr" => Kind::Fsr,
                other => {
                    let what = format!("`sensor` is `{other}`; it must be `linear` or `fsr`");
                    return Err(text.wrong(sensor.span(), what));
                }
            };
        }
        if let Some(wiper) = &keys.wiper {
            self.fsr.wiper = u8::try_from(*wiper.get_ref()).map_err(|_| {
                text.wrong(wiper.span(), format!("`wiper` is {}; it must be between 0 and 255", wiper.get_ref()))
            })?;
        }
        if let Some(signal) = &keys.signal {
            self.fsr.signal = signal.get_ref().parse().map_err(|_| {
                text.wrong(signal.span(), format!("`signal` is `{}`; it must be `raw` or `linear`", signal.get_ref()))
            })?;
        }
        if let Some(force) = &keys.full_scale_newton {
            let newton = *force.get_ref();
            if !(FsrCircuit::BREAK_NEWTON..=1e6).contains(&newton) {
                let what = format!("`full_scale_newton` is {newton}; it must be between 0.1 and 1e6");
                return Err(text.wrong(force.span(), what));
            }
            self.fsr.full_scale_newton = newton;
        }
        self.baseline_at = keys.baseline.as_ref().map(|x| x.span().start).or(self.baseline_at);
        self.gain_at = keys.gain.as_ref().map(|x| x.span().start).or(self.gain_at);
        self.range_given |= keys.raw_range.is_some();
        Ok(())
    }

    /// For a taxel that feels no pressure: what its keys say of a pressure need not fit together.
    pub(super) fn of_no_pressure(&mut self) {
        self.baseline_at = None;
        if matches!(self.kind, Kind::Curve(_)) {
            self.kind = Kind::Linear;
        }
    }

    /// What every gain is multiplied by, and where that is said.
    pub(super) fn scale(&self) -> Option<(f64, usize)> {
        self.scale
    }

    /// The unit of what it measures.
    pub(super) fn unit(&self) -> UnitOfP {
        self.unit
    }

    pub(super) fn is_fsr(&self) -> bool {
        self.kind == Kind::Fsr
    }

    /// The finished calibration, if its keys fit together.
    pub(super) fn finish(mut self, curves: &[Curve], text: Text<'_>) -> Result<TaxelCalibration> {
        if let Some((scale, at)) = self.scale {
            self.taxel.gain = scaled(self.taxel.gain, (scale, at), text)?;
        }
        let mut taxel = self.taxel;
        match self.kind {
            Kind::Linear => self.check_baseline(text)?,
            Kind::Curve(index) => {
                taxel.response = Response::Curve(index);
                let at = self.gain_at.unwrap_or(0);
                curves[index].scaled(taxel.gain * self.unit.factor).map_err(|e| text.put(at..at, e))?;
            }
            Kind::Fsr => {
                taxel.response = Response::Fsr(self.fsr);
                if !self.range_given {
                    taxel.raw_range = [0.0, FsrCircuit::OPEN_COUNTS.into()];
                }
            }
        }
        taxel.quantity = self.unit.quantity;
        taxel.unit_factor = self.unit.factor;
        taxel.gain *= self.unit.factor;
        taxel.dead_band *= self.unit.factor;
        if taxel.p_max < f64::from(f32::MAX) {
            taxel.p_max *= self.unit.factor;
        }
        Ok(taxel)
    }

    /// Rejects a baseline at which no touch can be measured.
    fn check_baseline(&self, text: Text<'_>) -> Result<()> {
        let Some(at) = self.baseline_at else { return Ok(()) };
        let TaxelCalibration { baseline, gain, p_max, raw_range: [low, high], .. } = self.taxel;
        let what = if self.range_given && gain > 0.0 && baseline >= high.into() {
            format!("`baseline` is {baseline}, and `raw_range` ends at {high}: no reading is above it")
        } else if self.range_given && gain < 0.0 && baseline <= low.into() {
            format!("`baseline` is {baseline}, and `raw_range` begins at {low}: no reading is below it")
        } else if !self.range_given && gain > 0.0 && gain * baseline > p_max {
            format!(
                "`baseline` is {baseline}, above `p_max` {p_max}; lower it, or give the `raw_range` of a sensor that \
                 reads that high"
            )
        } else {
            return Ok(());
        };
        Err(text.wrong(at..at, what))
    }
}

/// Rejects keys of the circuit for other sensors.
pub(super) fn only_for_fsr(keys: &Keys, is_fsr: bool, text: Text<'_>) -> Result<()> {
    let starts = [
        ("wiper", keys.wiper.as_ref().map(Spanned::span)),
        ("signal", keys.signal.as_ref().map(Spanned::span)),
        ("full_scale_newton", keys.full_scale_newton.as_ref().map(Spanned::span)),
    ];
    match starts.into_iter().find_map(|(key, span)| Some((key, span?.start))) {
        Some((key, start)) if !is_fsr => {
            let what = format!("`{key}` is for the paper's circuit; add `sensor = \"fsr\"`");
            Err(text.wrong(start..start, what))
        }
        _ => Ok(()),
    }
}
