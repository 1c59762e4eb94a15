//! The conversion from raw value to pressure: the keys `sensor`, `curve`, `tap`, `signal` and `full_scale_newton`, and the
//! check that keys fit together.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::{Keys, TaxelCalibration, line_of};
use crate::error::{Error, Result, nearest};
use crate::signal::FsrCircuit;
use crate::signal::curve::{Column, Curve};

/// The conversion from a taxel's raw value to its pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Response {
    /// A straight line: P = gain · (raw − baseline).
    #[default]
    Linear,
    /// P = |gain| · curve(±(raw − baseline)), with the sign of the gain; which of [`super::Calibration::curves`].
    Curve(usize),
    /// The same with the curve of the paper's circuit.
    Fsr(FsrResponse),
}

/// A force-sensing resistor in the paper's circuit, [`FsrCircuit`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FsrResponse {
    /// The potentiometer's setting.
    pub tap: u8,
    /// Which of the paper's signals P is.
    pub signal: FsrSignal,
    /// The force at which the linearised signal is 1000, N.
    pub full_scale_newton: f64,
}

impl Default for FsrResponse {
    fn default() -> Self {
        Self {
            tap: FsrCircuit::MIDDLE_TAP,
            signal: FsrSignal::default(),
            full_scale_newton: FsrCircuit::SATURATION_NEWTON,
        }
    }
}

/// The paper's two signals, both from 0 to 1000.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum FsrSignal {
    /// The inverted reading: about logarithmic in the force.
    Raw,
    /// Proportional to the force.
    #[default]
    Linear,
}

impl FsrSignal {
    const NAMES: [(&str, Self); 2] = [("raw", Self::Raw), ("linear", Self::Linear)];
}

impl fmt::Display for FsrSignal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Raw => "raw",
            Self::Linear => "linear",
        })
    }
}

impl FromStr for FsrSignal {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let found = Self::NAMES.into_iter().find(|(known, _)| *known == name);
        found.map(|(_, signal)| signal).ok_or_else(|| Error::usage(format!("`{name}` is neither `raw` nor `linear`")))
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
    pub(super) fn read(&self, name: &str, text: &str) -> Result<Curve> {
        let numbers = |column: &Spanned<Vec<Spanned<f64>>>| -> Vec<f64> {
            column.get_ref().iter().map(|x| *x.get_ref()).collect()
        };
        Curve::checked(&numbers(&self.raw), &numbers(&self.p)).map_err(|error| {
            let column = if error.column == Column::Raw { &self.raw } else { &self.p };
            let span = column.get_ref().get(error.knot).map_or(column.span(), Spanned::span);
            Error::failed(error.what).at(format!("[curve.{name}]")).at(format!("line {}", line_of(text, span.start)))
        })
    }
}

/// A taxel's calibration while its keys are read.
#[derive(Clone, Copy, Default)]
pub(super) struct Draft {
    pub(super) taxel: TaxelCalibration,
    kind: Kind,
    fsr: FsrResponse,
    /// Lines of keys that are checked together with others at the end.
    baseline_line: Option<usize>,
    gain_line: Option<usize>,
    range_given: bool,
}

#[derive(Clone, Copy, Default, PartialEq)]
enum Kind {
    #[default]
    Linear,
    Curve(usize),
    Fsr,
}

impl Draft {
    /// Applies the keys of the response; `curves` are the names of the file's curves.
    pub(super) fn take(&mut self, keys: &Keys, curves: &[&str], text: &str) -> Result<()> {
        let line = |start: usize| format!("line {}", line_of(text, start));
        if let (Some(curve), Some(_)) = (&keys.curve, &keys.sensor) {
            let what = "`curve` and `sensor` both define the response; keep one of them";
            return Err(Error::failed(what).at(line(curve.span().start)));
        }
        if let Some(curve) = &keys.curve {
            let index = curves.iter().position(|name| name == curve.get_ref()).ok_or_else(|| {
                let name = curve.get_ref();
                let hint = match nearest(name, curves.iter().copied()) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => format!("add a table [curve.{name}]"),
                };
                Error::failed(format!("`curve` is `{name}`, which is not there: {hint}")).at(line(curve.span().start))
            })?;
            self.kind = Kind::Curve(index);
        }
        if let Some(sensor) = &keys.sensor {
            self.kind = match sensor.get_ref().as_str() {
                "linear" => Kind::Linear,
                "fsr" => Kind::Fsr,
                other => {
                    let what = format!("`sensor` is `{other}`; it must be `linear` or `fsr`");
                    return Err(Error::failed(what).at(line(sensor.span().start)));
                }
            };
        }
        if let Some(tap) = &keys.tap {
            self.fsr.tap = u8::try_from(*tap.get_ref()).map_err(|_| {
                Error::failed(format!("`tap` is {}; it must be between 0 and 255", tap.get_ref()))
                    .at(line(tap.span().start))
            })?;
        }
        if let Some(signal) = &keys.signal {
            self.fsr.signal = signal.get_ref().parse().map_err(|_| {
                Error::failed(format!("`signal` is `{}`; it must be `raw` or `linear`", signal.get_ref()))
                    .at(line(signal.span().start))
            })?;
        }
        if let Some(force) = &keys.full_scale_newton {
            let newton = *force.get_ref();
            if !(FsrCircuit::BREAK_NEWTON..=1e6).contains(&newton) {
                let what = format!("`full_scale_newton` is {newton}; it must be between 0.1 and 1e6");
                return Err(Error::failed(what).at(line(force.span().start)));
            }
            self.fsr.full_scale_newton = newton;
        }
        self.baseline_line = keys.baseline.as_ref().map(|x| line_of(text, x.span().start)).or(self.baseline_line);
        self.gain_line = keys.gain.as_ref().map(|x| line_of(text, x.span().start)).or(self.gain_line);
        self.range_given |= keys.raw_range.is_some();
        Ok(())
    }

    pub(super) fn is_fsr(&self) -> bool {
        self.kind == Kind::Fsr
    }

    /// The finished calibration, if its keys fit together.
    pub(super) fn finish(self, curves: &[Curve]) -> Result<TaxelCalibration> {
        let mut taxel = self.taxel;
        match self.kind {
            Kind::Linear => self.check_baseline()?,
            Kind::Curve(index) => {
                taxel.response = Response::Curve(index);
                curves[index].scaled(taxel.gain).map_err(|e| e.at(format!("line {}", self.gain_line.unwrap_or(1))))?;
            }
            Kind::Fsr => {
                taxel.response = Response::Fsr(self.fsr);
                if !self.range_given {
                    taxel.raw_range = [0.0, FsrCircuit::OPEN_COUNTS.into()];
                }
            }
        }
        Ok(taxel)
    }

    /// Rejects a baseline at which no touch can be measured.
    fn check_baseline(&self) -> Result<()> {
        let Some(line) = self.baseline_line else { return Ok(()) };
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
        Err(Error::failed(what).at(format!("line {line}")))
    }
}

/// Rejects keys of the circuit for other sensors.
pub(super) fn only_for_fsr(keys: &Keys, is_fsr: bool, text: &str) -> Result<()> {
    let starts = [
        ("tap", keys.tap.as_ref().map(Spanned::span)),
        ("signal", keys.signal.as_ref().map(Spanned::span)),
        ("full_scale_newton", keys.full_scale_newton.as_ref().map(Spanned::span)),
    ];
    match starts.into_iter().find_map(|(key, span)| Some((key, span?.start))) {
        Some((key, start)) if !is_fsr => {
            let what = format!("`{key}` is for sensors of one kind; say `sensor = \"fsr\"` too");
            Err(Error::failed(what).at(format!("line {}", line_of(text, start))))
        }
        _ => Ok(()),
    }
}
