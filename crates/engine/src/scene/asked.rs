//! Outputs by their names: quantities of fields, and of touches of the whole body.

use std::ops::BitOr;
use std::str::FromStr;

use crate::error::{Error, Result, unknown};
use crate::percept::{Outputs, TouchOutputs};

/// What names of outputs ask for: `total` or another quantity of fields; `touches`, the usual quantities of touches; or
/// `touches.wrench` or another, which is that beside the usual ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AskedOutputs {
    /// Of fields.
    pub of_fields: Outputs,
    /// Of touches of the whole body; `None` looks for none.
    pub of_touches: Option<TouchOutputs>,
}

impl AskedOutputs {
    /// What is given unless something else is asked for: the usual quantities of fields and of touches.
    pub const USUAL: Self = Self { of_fields: Outputs::USUAL, of_touches: Some(TouchOutputs::USUAL) };

    /// What `named` ask for together, or the usual quantities where none are named.
    #[must_use]
    pub fn all_of(named: &[Self]) -> Self {
        named.iter().copied().reduce(|a, b| a | b).unwrap_or(Self::USUAL)
    }

    /// All names that there are.
    pub fn names() -> impl Iterator<Item = String> {
        let of_fields = Outputs::all().names().chain([TOUCHES.to_owned()]);
        of_fields.chain(TouchOutputs::all().names().map(|name| format!("{TOUCHES}.{name}")))
    }
}

/// What asks for the quantity of touches that is called `name` where that does not.
fn comes_with(name: &str) -> Option<String> {
    TouchOutputs::all().columns().find(|column| column.name == name)?.output.names().next()
}

/// The name that asks for the usual quantities of touches.
const TOUCHES: &str = "touches";

impl From<Outputs> for AskedOutputs {
    fn from(of_fields: Outputs) -> Self {
        Self { of_fields, of_touches: None }
    }
}

impl BitOr for AskedOutputs {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        let of_touches = [self.of_touches, other.of_touches].into_iter().flatten().reduce(|a, b| a | b);
        Self { of_fields: self.of_fields | other.of_fields, of_touches }
    }
}

impl FromStr for AskedOutputs {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let of_touches = match name.strip_prefix(TOUCHES) {
            Some("") => Some(TouchOutputs::USUAL),
            Some(rest) => rest.strip_prefix('.').and_then(TouchOutputs::named).map(|one| TouchOutputs::USUAL | one),
            None => None,
        };
        if of_touches.is_some() {
            return Ok(Self { of_fields: Outputs::empty(), of_touches });
        }
        Outputs::named(name).map(Self::from).ok_or_else(|| {
            if let Some(with) = name.strip_prefix("touches.").and_then(comes_with) {
                return Error::usage(format!("`{name}` comes with `{TOUCHES}.{with}`: ask for that"));
            }
            let names: Vec<String> = Self::names().collect();
            Error::usage(unknown("output", name, names.iter().map(String::as_str)))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_ask_for_quantities_of_fields_and_of_touches() {
        let asked = |names: &[&str]| {
            let named: Vec<AskedOutputs> = names.iter().map(|name| name.parse().unwrap()).collect();
            AskedOutputs::all_of(&named)
        };
        assert_eq!(asked(&[]), AskedOutputs::USUAL);
        assert_eq!(asked(&["total", "peak"]), (Outputs::TOTAL | Outputs::PEAK).into());
        let usual = Some(TouchOutputs::USUAL);
        assert_eq!(asked(&["touches"]), AskedOutputs { of_fields: Outputs::empty(), of_touches: usual });
        let more = asked(&["touches.wrench", "total"]);
        assert_eq!(more.of_touches, Some(TouchOutputs::USUAL | TouchOutputs::WRENCH));
        assert_eq!(more.of_fields, Outputs::TOTAL);
        assert_eq!(asked(&["touches", "peak"]).of_touches, usual);
        for name in AskedOutputs::names() {
            assert!(name.parse::<AskedOutputs>().is_ok(), "{name}");
        }
        let error = "touches.wrenches".parse::<AskedOutputs>().unwrap_err().to_string();
        assert!(error.contains("touches.wrench"), "{error}");
        let why = |name: &str| name.parse::<AskedOutputs>().unwrap_err().to_string();
        for name in ["force_vector", "torsion", "friction"] {
            assert_eq!(
                why(&format!("touches.{name}")),
                format!("`touches.{name}` comes with `touches.shear`: ask for that")
            );
        }
        assert!(why("touches.fit_angle").contains("comes with `touches.fit_direction`"));
        assert!(why("touches.tortion").starts_with("there is no output `touches.tortion`"));
        // What fields had, touches have now.
        let error = "fit_angle".parse::<AskedOutputs>().unwrap_err().to_string();
        assert_eq!(error, "`fit_angle` is `touches.fit_direction` now");
    }
}
