//! What P is, and the units that people give it in.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

use crate::error::{Error, Result, nearest};

/// What P is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize)]
pub enum Quantity {
    /// An uncalibrated number.
    #[default]
    #[serde(rename = "count")]
    Count,
    /// A pressure in Pa.
    #[serde(rename = "Pa")]
    Pascal,
    /// A force in N.
    #[serde(rename = "N")]
    Newton,
}

impl Quantity {
    /// As data files spell its unit: `count`, `Pa` or `N`.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Count => "count",
            Self::Pascal => "Pa",
            Self::Newton => "N",
        }
    }

    /// What a force is in where P is this.
    #[must_use]
    pub const fn of_force(self) -> Self {
        match self {
            Self::Pascal => Self::Newton,
            other => other,
        }
    }

    /// A factor and a unit in which people read values as large as `size`.
    #[must_use]
    pub fn readable(self, size: f64) -> (f64, &'static str) {
        match self {
            Self::Count => (1.0, "counts"),
            Self::Pascal if size >= 1e6 => (1e-6, "MPa"),
            Self::Pascal if size >= 1e3 => (1e-3, "kPa"),
            Self::Pascal => (1.0, "Pa"),
            Self::Newton if size > 0.0 && size < 0.1 => (1e3, "mN"),
            Self::Newton => (1.0, "N"),
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol())
    }
}

/// A unit of P, as a calibration or a pressure system's export names it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnitOfP {
    symbol: &'static str,
    /// What it measures.
    pub quantity: Quantity,
    /// How many Pa, N or counts it is.
    pub factor: f64,
}

/// Pa of a millimetre of mercury.
const MMHG: f64 = 133.322_387_415;
/// N of a kilogram's weight.
const KGF: f64 = 9.806_65;

const fn unit(symbol: &'static str, quantity: Quantity, factor: f64) -> UnitOfP {
    UnitOfP { symbol, quantity, factor }
}

/// Every unit, in the spelling that is written.
const UNITS: [UnitOfP; 24] = [
    UnitOfP::COUNT,
    unit("Pa", Quantity::Pascal, 1.0),
    unit("hPa", Quantity::Pascal, 1e2),
    unit("kPa", Quantity::Pascal, 1e3),
    unit("MPa", Quantity::Pascal, 1e6),
    unit("mbar", Quantity::Pascal, 1e2),
    unit("bar", Quantity::Pascal, 1e5),
    unit("mmHg", Quantity::Pascal, MMHG),
    unit("cmHg", Quantity::Pascal, 10.0 * MMHG),
    unit("inHg", Quantity::Pascal, 25.4 * MMHG),
    unit("cmH2O", Quantity::Pascal, 98.066_5),
    unit("inH2O", Quantity::Pascal, 249.088_91),
    unit("psi", Quantity::Pascal, 6_894.757_293_168),
    unit("N/m2", Quantity::Pascal, 1.0),
    unit("N/cm2", Quantity::Pascal, 1e4),
    unit("N/mm2", Quantity::Pascal, 1e6),
    unit("gf/cm2", Quantity::Pascal, 10.0 * KGF),
    unit("kgf/cm2", Quantity::Pascal, 1e4 * KGF),
    unit("N", Quantity::Newton, 1.0),
    unit("mN", Quantity::Newton, 1e-3),
    unit("kN", Quantity::Newton, 1e3),
    unit("gf", Quantity::Newton, 1e-3 * KGF),
    unit("kgf", Quantity::Newton, KGF),
    unit("lbf", Quantity::Newton, 4.448_221_615_260_5),
];

impl UnitOfP {
    /// No unit: P is a count.
    pub const COUNT: Self = unit("count", Quantity::Count, 1.0);
    /// Kilopascals.
    pub const KILOPASCAL: Self = UNITS[3];

    /// Its name, as calibrations spell it.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        self.symbol
    }

    /// The names of all units.
    pub fn names() -> impl Iterator<Item = &'static str> {
        UNITS.iter().map(|unit| unit.symbol)
    }
}

impl Default for UnitOfP {
    fn default() -> Self {
        Self::COUNT
    }
}

impl fmt::Display for UnitOfP {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.symbol)
    }
}

impl FromStr for UnitOfP {
    type Err = Error;

    /// Takes a unit as people and pressure systems write it: `kPa`, `KPA`, `N/cm²`, `N/cm^2`, `lb/in²`, `raw`.
    fn from_str(text: &str) -> Result<Self> {
        let plain = text.trim().replace('²', "2").replace(['^', ' '], "");
        let known = |name: &str| UNITS.iter().find(|unit| unit.symbol == name).copied();
        if let Some(unit) = known(&plain) {
            return Ok(unit);
        }
        // Exports shout; MPa and mPa, MN and mN would be confused, so that prefixes must be as they are written.
        let same = |unit: &&UnitOfP| unit.symbol.eq_ignore_ascii_case(&plain) && !plain.starts_with(['m', 'M']);
        let other = match plain.to_ascii_lowercase().as_str() {
            "raw" | "counts" => Some(Self::COUNT),
            "mmhg" => known("mmHg"),
            "mbar" => known("mbar"),
            "lb/in2" | "lbf/in2" => known("psi"),
            "kg/cm2" => known("kgf/cm2"),
            "g/cm2" => known("gf/cm2"),
            "newton" | "newtons" => known("N"),
            "pascal" => known("Pa"),
            _ => UNITS.iter().find(same).copied(),
        };
        other.ok_or_else(|| {
            let near = nearest(&plain, Self::names()).map(|near| format!("did you mean `{near}`?"));
            let all = || format!("choose of {}", Self::names().collect::<Vec<_>>().join(", "));
            Error::usage(format!("there is no unit `{text}`; {}", near.unwrap_or_else(all)))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factor(text: &str) -> f64 {
        text.parse::<UnitOfP>().unwrap().factor
    }

    #[test]
    fn a_unit_is_named_as_people_and_exports_write_it() {
        for same in ["kPa", "KPA", "kpa", " kPa "] {
            assert_eq!(same.parse::<UnitOfP>().unwrap(), UnitOfP::KILOPASCAL, "{same}");
        }
        for same in ["N/cm2", "N/cm²", "N/cm^2", "n/cm2"] {
            assert_eq!(factor(same), 1e4, "{same}");
        }
        assert_eq!(
            (factor("mmHg"), factor("MMHG"), factor("psi"), factor("PSI")),
            (MMHG, MMHG, factor("psi"), factor("lb/in²"))
        );
        assert_eq!("raw".parse::<UnitOfP>().unwrap(), UnitOfP::COUNT);
        assert_eq!((factor("mN"), factor("MPa"), factor("lbf")), (1e-3, 1e6, 4.448_221_615_260_5));
        for unit in UNITS {
            assert_eq!(unit.symbol.parse::<UnitOfP>().unwrap(), unit);
        }
    }

    #[test]
    fn units_agree_with_each_other() {
        // A pound is 0.45359237 kg and an inch 25.4 mm; an atmosphere is 760 mmHg but for a part in 10⁷.
        let psi = 0.453_592_37 * KGF / (0.0254 * 0.0254);
        assert!((factor("psi") / psi - 1.0).abs() < 1e-12);
        assert!((760.0 * MMHG / 101_325.0 - 1.0).abs() < 2e-7 && 760.0 * MMHG != 101_325.0);
        assert!((factor("kgf/cm2") / 98_066.5 - 1.0).abs() < 1e-15);
    }

    #[test]
    fn what_is_no_unit_is_a_usage_error_with_a_way_out() {
        let why = |text: &str| text.parse::<UnitOfP>().unwrap_err();
        assert!(why("kPA!").is_usage() && why("kPs").to_string().contains("did you mean"));
        assert!(why("furlong").to_string().contains("mmHg"));
        // A megapascal or a millipascal: it is refused.
        assert!("mPa".parse::<UnitOfP>().is_err() && "MN".parse::<UnitOfP>().is_err());
    }

    #[test]
    fn people_read_kilopascals_and_millinewtons() {
        assert_eq!(Quantity::Pascal.readable(52_000.0), (1e-3, "kPa"));
        assert_eq!(Quantity::Newton.readable(0.02), (1e3, "mN"));
        assert_eq!(Quantity::Count.readable(1e9), (1.0, "counts"));
    }
}
