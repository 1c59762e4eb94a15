//! Calibration: converts a robot's raw values to pressures, and says which raw values to reject.
//!
//! The file is TOML, and belongs to one robot; `docs/reference/calibration.md` lists its keys. Without a file P is the raw value.

mod file;
mod keys;
mod kinds;
mod layer;
mod old_names;
mod overlay;
mod senses;
mod sensors;
mod shear_keys;
mod thresholds;

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

pub use self::layer::LayerResponse;
pub use self::overlay::LaidOver;
pub use self::sensors::Sensors;
pub use self::thresholds::{ChangeCalibration, ContactThresholds};
use super::curve::Curve;
use super::drift::DriftKeys;
use super::frame::RawValue;
use super::fsr::FsrCircuit;
use super::response::{FsrResponse, FsrSignal, Response};
use super::sense::{SenseCalibration, ShearCalibration};
use super::unit::Quantity;
use crate::error::{Result, failed};

/// What a taxel's pressure is where it leaves its dead band.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Onset {
    /// It jumps to P.
    #[default]
    Hard,
    /// It is P less the dead band, and so begins with 0.
    Soft,
}

/// How one taxel's raw value becomes a pressure: by its [`Response`], then 0 up to the dead band. The constants are those of
/// the file; the backends `cpu` and `gpu` round each once to single precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TaxelCalibration {
    /// Raw value at rest.
    pub baseline: f64,
    /// Pressure per raw unit; negative for a sensor that falls when pressed (`invert`).
    pub gain: f64,
    /// Pressures up to this one, in the unit of P, count as 0.
    pub dead_band: f64,
    /// What becomes of pressures over it.
    pub onset: Onset,
    /// The largest pressure of the sensor's range; higher ones are kept but flagged `saturated`.
    pub p_max: f64,
    /// The range of raw values, in single precision as these are; others are kept but flagged `out_of_range`.
    pub raw_range: [f32; 2],
    /// Standard deviation of a raw value, quantisation included, raw units; `None` where it is not known.
    pub noise: Option<f64>,
    /// Relative standard deviation of this taxel's gain, where it is more than [`LayerResponse::gain_spread`].
    pub gain_spread: Option<f64>,
    /// Ignore this taxel.
    pub mask: bool,
    /// The conversion from raw value to pressure.
    pub response: Response,
    /// What P is. Gain, dead band and P_max are in its SI unit, whatever unit the file is in.
    pub quantity: Quantity,
    /// SI units to one of the file's.
    pub unit_factor: f64,
    /// The sensor's size relative to its cell; `None` if it is not given.
    pub sensors: Option<Sensors>,
}

impl Default for TaxelCalibration {
    fn default() -> Self {
        Self {
            baseline: 0.0,
            gain: 1.0,
            dead_band: 0.0,
            onset: Onset::Hard,
            p_max: f32::MAX.into(),
            raw_range: [-f32::MAX, f32::MAX],
            noise: None,
            gain_spread: None,
            mask: false,
            response: Response::Linear,
            quantity: Quantity::Count,
            unit_factor: 1.0,
            sensors: None,
        }
    }
}

impl TaxelCalibration {
    /// Whether its P counts times the area of its cell in the place and axis of a touch: a pressure always does, a force or a count of
    /// sensors of one size. If nothing is given, sensors that give newtons cover their cells, and others are of one size.
    #[must_use]
    pub fn weighs_by_cell(&self) -> bool {
        match (self.quantity, self.sensors) {
            (Quantity::Pascal, _) => true,
            (_, Some(sensors)) => sensors == Sensors::Equal,
            (quantity, None) => quantity == Quantity::Count,
        }
    }
}

/// Checks that reject frames and values before any field is computed. All are off by default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Checks {
    /// Number of first frames to reject, for sensors that begin with partial ones.
    pub settle_frames: u64,
    /// A frame with more than this share of values outside the raw range is rejected.
    pub broken_frame_share: Option<f64>,
    /// A raw value this many times the largest of its neighbours' is rejected, if also over `isolated_above`.
    pub isolated_ratio: Option<f64>,
    /// Values up to this one (raw units above baseline) are never rejected as isolated.
    pub isolated_above: f64,
}

/// A robot's calibration, for the taxels of one body.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// The file name of its body, if given, with or without folder and extension.
    pub body: Option<String>,
    /// One entry a taxel, in the body's order.
    pub taxels: Vec<TaxelCalibration>,
    /// By taxel, the raw values that are not readings, in single precision as raw values are; empty if no taxel has any.
    pub missing: Vec<Vec<f32>>,
    /// The curves that [`Response::Curve`] indexes.
    pub curves: Vec<Curve>,
    /// Contact thresholds of fields that are not in `fields`.
    pub contact: ContactThresholds,
    /// Contact thresholds by field.
    pub fields: BTreeMap<String, ContactThresholds>,
    /// Dead band and contact thresholds of pressure changes.
    pub change: ChangeCalibration,
    /// Checks of the input.
    pub checks: Checks,
    /// How baselines follow drift and defective taxels are detected.
    pub drift: DriftKeys,
    /// What the layer over the taxels makes of a contact, where that is known.
    pub layer: Option<LayerResponse>,
    /// Of temperatures.
    pub temperature: SenseCalibration,
    /// Of distances.
    pub proximity: SenseCalibration,
    /// Of tangential forces.
    pub shear: ShearCalibration,
}

impl Default for Calibration {
    fn default() -> Self {
        Self {
            body: None,
            taxels: Vec::new(),
            missing: Vec::new(),
            curves: Vec::new(),
            contact: ContactThresholds::default(),
            fields: BTreeMap::new(),
            change: ChangeCalibration::default(),
            checks: Checks::default(),
            drift: DriftKeys::default(),
            layer: None,
            temperature: SenseCalibration::of_temperature(),
            proximity: SenseCalibration::of_proximity(),
            shear: ShearCalibration::default(),
        }
    }
}

impl Calibration {
    /// The calibration of a robot without a file: P is the raw value.
    #[must_use]
    pub fn identity(taxels: usize) -> Self {
        Self { taxels: vec![TaxelCalibration::default(); taxels], ..Self::default() }
    }

    /// Checks that the calibration is for the body `name`.
    ///
    /// # Errors
    /// The names differ, without folders and extensions.
    pub fn check_body(&self, name: &str) -> Result<()> {
        let stem = |name: &str| Path::new(name).file_stem().map(std::ffi::OsStr::to_owned);
        match &self.body {
            Some(body) if stem(body) != stem(name) => Err(failed!(
                "the calibration is for body `{body}`, and this is `{name}`; change its key `body` if they are one"
            )),
            _ => Ok(()),
        }
    }

    /// The curve of `taxel` with its gain and sign, and with `signal` for a sensor in the paper's circuit. `None` for a
    /// linear response.
    #[doc(hidden)]
    pub fn curve_of(&self, taxel: &TaxelCalibration, signal: Option<FsrSignal>) -> Result<Option<Curve>> {
        let curve = match taxel.response {
            Response::Linear => return Ok(None),
            Response::Curve(index) => {
                let missing = || failed!("a taxel has curve {index} of {}", self.curves.len());
                self.curves.get(index).ok_or_else(missing)?.scaled(taxel.gain)
            }
            Response::Fsr(fsr) => {
                Curve::fsr(&FsrResponse { signal: signal.unwrap_or(fsr.signal), ..fsr }).scaled(taxel.gain)
            }
        };
        curve.map(Some)
    }

    /// Whether `value` of the taxel `index` is not a reading.
    #[doc(hidden)]
    pub fn is_no_reading(&self, index: usize, value: RawValue) -> bool {
        self.missing.get(index).is_some_and(|codes| {
            !codes.is_empty() && value.number().is_some_and(|number| codes.contains(&(number as f32)))
        })
    }

    /// How far `value` of the taxel `index` is from rest, raw units, positive if pressed. With constants in single precision
    /// for all backends, so that all reject the same values.
    #[doc(hidden)]
    pub fn rise(&self, index: usize, value: f64) -> f64 {
        let taxel = &self.taxels[index];
        let signed = (value - f64::from(taxel.baseline as f32)) * taxel.gain.signum();
        match taxel.response {
            Response::Linear => signed,
            Response::Curve(curve) => self.curves.get(curve).map_or(0.0, |curve| curve.rise(signed)),
            Response::Fsr(_) => f64::from(FsrCircuit::OPEN_COUNTS) - signed,
        }
    }
}
