//! The conversion from a raw value to a pressure, and the numbers that are credible in one.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

use super::fsr::FsrCircuit;
use crate::error::{Error, Result};

/// Gains for which products stay in single precision.
pub(super) const GAIN_RANGE: std::ops::RangeInclusive<f64> = 1e-12..=1e12;
/// Baselines, dead bands and values above this are not credible.
pub(super) const MAX_MAGNITUDE: f64 = 1.15e18;

/// The conversion from a taxel's raw value to its pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Response {
    /// A straight line: P = gain · (raw − baseline).
    #[default]
    Linear,
    /// P = |gain| · curve(±(raw − baseline)), with the sign of the gain; which of
    /// [`Calibration::curves`](crate::signal::Calibration::curves).
    Curve(usize),
    /// The same with the curve of the paper's circuit.
    Fsr(FsrResponse),
}

/// A force-sensing resistor in the paper's circuit, [`FsrCircuit`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FsrResponse {
    /// The potentiometer's setting.
    pub wiper: u8,
    /// Which of the paper's signals P is.
    pub signal: FsrSignal,
    /// The force at which the linearised signal is 1000, N.
    pub full_scale_newton: f64,
}

impl Default for FsrResponse {
    fn default() -> Self {
        Self {
            wiper: FsrCircuit::MIDDLE_WIPER,
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
        self.serialize(f)
    }
}

impl FromStr for FsrSignal {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let found = Self::NAMES.into_iter().find(|(known, _)| *known == name);
        found.map(|(_, signal)| signal).ok_or_else(|| Error::usage(format!("`{name}` is neither `raw` nor `linear`")))
    }
}
