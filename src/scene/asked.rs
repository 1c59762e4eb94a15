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
    /// Of touches.
    pub of_touches: Option<TouchOutputs>,
}

impl AskedOutputs {
    /// All names that there are.
    pub fn names() -> impl Iterator<Item = String> {
        Outputs::all().names().chain(TouchOutputs::all().names().map(|name| format!("touches.{name}")))
    }

    /// What is asked of touches of the whole body. Fits and self-contacts are of fields' own touches: where these are asked for, so are
    /// all touches.
    #[must_use]
    pub fn of_body(self) -> Option<TouchOutputs> {
        let are_of_fields = self.of_fields.intersects(Outputs::FIT.union(Outputs::SELF_CONTACTS));
        self.of_touches.filter(|_| !are_of_fields)
    }
}

impl From<Outputs> for AskedOutputs {
    fn from(of_fields: Outputs) -> Self {
        Self { of_fields, of_touches: of_fields.contains(Outputs::TOUCHES).then_some(TouchOutputs::USUAL) }
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
        let of_touches = name.strip_prefix("touches.").and_then(TouchOutputs::named);
        let of_touches = of_touches
            .map(|output| Self { of_fields: Outputs::TOUCHES, of_touches: Some(TouchOutputs::USUAL | output) });
        of_touches.or_else(|| Outputs::named(name).map(Self::from)).ok_or_else(|| {
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
            names.iter().map(|name| name.parse::<AskedOutputs>().unwrap()).reduce(|a, b| a | b).unwrap()
        };
        assert_eq!(asked(&["total", "peak"]), (Outputs::TOTAL | Outputs::PEAK).into());
        assert_eq!(asked(&["touches"]).of_body(), Some(TouchOutputs::USUAL));
        let more = asked(&["touches.wrench", "total"]);
        assert_eq!(more.of_body(), Some(TouchOutputs::USUAL | TouchOutputs::WRENCH));
        assert_eq!(more.of_fields, Outputs::TOUCHES | Outputs::TOTAL);
        assert_eq!(asked(&["touches", "fit_place"]).of_body(), None);
        for name in AskedOutputs::names() {
            assert!(name.parse::<AskedOutputs>().is_ok(), "{name}");
        }
        let error = "touches.wrenches".parse::<AskedOutputs>().unwrap_err().to_string();
        assert!(error.contains("touches.wrench"), "{error}");
    }
}
