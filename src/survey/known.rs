//! Presses with a known force, such as a weight from a kitchen scale: what makes newtons of raw units.

use std::str::FromStr;

use somatic::error::{Error, Result};
use somatic::internal::signal::UnitOfP;
use somatic::signal::Quantity;

/// A force in newtons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KnownForce(pub f64);

impl FromStr for KnownForce {
    type Err = Error;

    /// `4.9N`, or a weight such as `500g`.
    fn from_str(text: &str) -> Result<Self> {
        let bad = || Error::usage(format!("{text} is not a force; write it as 4.9N, or as a weight, 500g"));
        let text = text.trim();
        let end = text.find(|c: char| c.is_alphabetic()).unwrap_or(text.len());
        let unit = match text[end..].trim() {
            "g" => "gf",
            "kg" => "kgf",
            other => other,
        };
        let number: f64 = text[..end].trim().parse().map_err(|_| bad())?;
        let unit: UnitOfP = unit.parse().map_err(|_| bad())?;
        let force = number * unit.factor;
        let is_force = unit.quantity == Quantity::Newton && force.is_finite() && force > 0.0;
        if is_force { Ok(Self(force)) } else { Err(bad()) }
    }
}

/// What the known force pressed on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PressedOn {
    /// Each sensor by itself.
    Taxel,
    /// All of them together.
    Field,
}

impl FromStr for PressedOn {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "taxel" => Ok(Self::Taxel),
            "field" => Ok(Self::Field),
            _ => Err(Error::usage(format!("there is no `{text}`; taxel or field"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_is_written_with_its_unit() {
        let newtons = |text: &str| text.parse::<KnownForce>().unwrap().0;
        assert_eq!((newtons("4.9N"), newtons("500 mN")), (4.9, 0.5));
        assert!((newtons("500g") - 4.903_325).abs() < 1e-12 && (newtons("0.5 kg") - 4.903_325).abs() < 1e-12);
        for wrong in ["4.9", "N", "-1N", "0g", "3kPa", "1 m", "nanN"] {
            assert!(wrong.parse::<KnownForce>().unwrap_err().is_usage(), "{wrong}");
        }
        assert!("elbow".parse::<PressedOn>().unwrap_err().is_usage());
    }
}
