//! What is asked for of accuracy: a tolerance, a budget, or the knobs themselves.

use std::collections::BTreeMap;

#[cfg(feature = "cli")]
use schemars::JsonSchema;
use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer};

use super::deserialize::word;
use super::target::{Target, angle, length, time};
use crate::backend::BackendKind;
use crate::error::{Error, Result, place_in};
use crate::percept::Outputs;
use crate::scene::{Arithmetic, Cadence, Charts, Coverage, Knobs, OrientationBy};

/// Speed against accuracy: either tolerances and a time budget, for which a measurement chooses the options, or these
/// options themselves.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(feature = "cli", derive(JsonSchema))]
#[non_exhaustive]
pub struct Accuracy {
    /// How far 95 of 100 places may be from the truth, such as "3 mm".
    #[serde(rename = "centroid", deserialize_with = "metres")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>"))]
    pub centroid_m: Option<f64>,

    /// How far 95 of 100 orientations may be turned from it, such as "5 deg".
    #[serde(rename = "orientation", deserialize_with = "radians")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>"))]
    pub orientation_rad: Option<f64>,

    /// Measure, and use only options with which a frame takes at most this time, such as 100us.
    ///
    /// The median frame counts. Without a tolerance, the most accurate of these options are chosen.
    #[serde(rename = "budget", deserialize_with = "seconds")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>"))]
    pub budget_s: Option<f64>,

    /// How sums are made: one-pass, compensated or double [default: one-pass; reference: double].
    ///
    /// In single precision (one-pass), with the rounding errors added back (compensated), or in double precision on
    /// the CPU (double).
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = Arithmetic::WORDS)))]
    pub arithmetic: Option<Arithmetic>,

    /// Which charts fields have: as-authored, plane or geodesic [default: as-authored].
    ///
    /// They are the layout's (as-authored), tangent planes (plane), or shortest paths over the surface where that is
    /// possible (geodesic).
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = Charts::WORDS)))]
    pub charts: Option<Charts>,

    /// Which output gives an orientation: as-asked, two-points, second-moments, fit-1, fit-2 or fit [default:
    /// as-asked].
    ///
    /// The ones in `outputs` (as-asked), orientation alone (two-points), or principal_axis alone (second-moments). A
    /// fit adds touches.fit_direction and touches.fit_place to principal_axis. It fits a contact to each touch in one
    /// step (fit-1), two (fit-2) or all (fit).
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = OrientationBy::WORDS)))]
    pub orientation_by: Option<OrientationBy>,

    /// Which fields are computed in a live frame on the CPU: all, touched or auto [default: auto].
    ///
    /// All of them (all), only those that changed (touched), or the faster of these (auto). Percepts are the same.
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = Coverage::WORDS)))]
    pub coverage: Option<Coverage>,

    /// When a field is computed: every-frame or on-change [default: every-frame].
    ///
    /// With on-change, a field is computed when its values change, and motion is from change to change.
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = Cadence::WORDS)))]
    pub cadence: Option<Cadence>,
}

fn quantity<'de, D: Deserializer<'de>>(from: D, of: fn(&str) -> Result<f64>) -> Result<Option<f64>, D::Error> {
    of(&String::deserialize(from)?).map(Some).map_err(serde::de::Error::custom)
}

fn metres<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    quantity(from, length)
}

fn radians<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    quantity(from, angle)
}

fn seconds<'de, D: Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    quantity(from, time)
}

impl Accuracy {
    /// This, with the values of `below` where it has none. Options replace a target in `below`, and a target replaces
    /// options in `below`.
    #[must_use]
    pub fn over(self, below: Self) -> Self {
        let below = match (self.target().is_empty(), self.knob().is_none()) {
            (true, false) => Self { centroid_m: None, orientation_rad: None, budget_s: None, ..below },
            (false, true) => Self {
                centroid_m: below.centroid_m,
                orientation_rad: below.orientation_rad,
                budget_s: below.budget_s,
                ..Self::default()
            },
            _ => below,
        };
        Self {
            centroid_m: self.centroid_m.or(below.centroid_m),
            orientation_rad: self.orientation_rad.or(below.orientation_rad),
            budget_s: self.budget_s.or(below.budget_s),
            arithmetic: self.arithmetic.or(below.arithmetic),
            charts: self.charts.or(below.charts),
            orientation_by: self.orientation_by.or(below.orientation_by),
            coverage: self.coverage.or(below.coverage),
            cadence: self.cadence.or(below.cadence),
        }
    }

    /// What is wished for, if anything is.
    #[doc(hidden)]
    #[must_use]
    pub fn target(&self) -> Target {
        Target { centroid_m: self.centroid_m, orientation_rad: self.orientation_rad, budget_s: self.budget_s }
    }

    /// The first knob that is turned, by its key.
    fn knob(&self) -> Option<&'static str> {
        let given = [
            ("arithmetic", self.arithmetic.is_some()),
            ("charts", self.charts.is_some()),
            ("orientation_by", self.orientation_by.is_some()),
            ("coverage", self.coverage.is_some()),
            ("cadence", self.cadence.is_some()),
        ];
        given.into_iter().find(|(_, given)| *given).map(|(key, _)| key)
    }

    /// The knobs that it turns; others stay where they usually are.
    #[must_use]
    pub fn knobs(&self) -> Knobs {
        let usual = Knobs::default();
        Knobs::default()
            .arithmetic(self.arithmetic)
            .charts(self.charts.unwrap_or(usual.charts))
            .orientation_by(self.orientation_by.unwrap_or(usual.orientation_by))
            .coverage(self.coverage.unwrap_or(usual.coverage))
            .cadence(self.cadence.unwrap_or(usual.cadence))
    }

    /// Refuses what contradicts itself, with the key where it is found out.
    pub(super) fn check(&self, backend: BackendKind, outputs: Outputs) -> Result<(), (&'static str, Error)> {
        let target = self.target();
        if let Some(knob) = self.knob().filter(|_| !target.is_empty()) {
            let what = format!("`{knob}` sets an option that {} chooses; give one or the other", target.words());
            return Err((knob, Error::usage(what)));
        }
        if target.centroid_m.is_some() && outputs.is_empty() {
            return Err(("centroid", Error::usage("a tolerance needs outputs to hold for")));
        }
        if target.orientation_rad.is_some() && !outputs.intersects(Outputs::ORIENTATION | Outputs::PRINCIPAL_AXIS) {
            let what = "a tolerance of orientation needs output `orientation` or `principal_axis`; add one of them";
            return Err(("orientation", Error::usage(what)));
        }
        match (backend, self.arithmetic) {
            (BackendKind::Gpu, Some(Arithmetic::Double)) => {
                let what =
                    "`arithmetic` is double, and shaders have no double precision; use backend `cpu`, or compensated";
                return Err(("arithmetic", Error::usage(what)));
            }
            (BackendKind::Reference, Some(arithmetic @ (Arithmetic::OnePass | Arithmetic::Compensated))) => {
                let what = format!(
                    "`arithmetic` is {arithmetic}, and backend `reference` is always double; use `cpu` or `gpu`"
                );
                return Err(("arithmetic", Error::usage(what)));
            }
            _ => {}
        }
        let only_cpu = |coverage: &Coverage| !matches!(coverage, Coverage::Auto | Coverage::All);
        if let Some(coverage) = self.coverage.filter(only_cpu)
            && matches!(backend, BackendKind::Gpu | BackendKind::Reference)
        {
            let what = format!("`coverage` is {coverage}, which only backend `cpu` has");
            return Err(("coverage", Error::usage(what)));
        }
        Ok(())
    }

    /// `error` at the place of `[accuracy]` key `key` in the scene file's `text`.
    pub(super) fn placed(text: &str, key: &str, error: Error) -> Error {
        #[derive(Deserialize)]
        struct Keys {
            accuracy: BTreeMap<toml::Spanned<String>, IgnoredAny>,
        }
        let keys = toml::from_str(text).map_or_else(|_| BTreeMap::new(), |keys: Keys| keys.accuracy);
        match keys.keys().find(|known| known.get_ref() == key) {
            Some(known) => Error::usage(error.to_string()).at(place_in(text, known.span().start)),
            None => error,
        }
    }
}
