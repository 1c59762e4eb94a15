//! What is asked for of accuracy: a tolerance, a budget, or the knobs themselves.

use std::collections::BTreeMap;

use clap::Args;
use schemars::JsonSchema;
use serde::de::IgnoredAny;
use serde::{Deserialize, Deserializer};
use somatic::error::place_in;
use somatic::scene::{Arithmetic, Cadence, Charts, Coverage, Knobs, OrientationBy};
use somatic::tradeoff::{Target, angle, length, time};
use somatic::{BackendKind, Error, Outputs, Result};

use super::deserialize::word;
use super::flags::{ACCURACY, one_of};

/// Speed against accuracy: either how far percepts may be off and how long a frame may take, so that the knobs are chosen
/// by measurement, or the knobs themselves.
#[derive(Args, Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(in crate::cli) struct Accuracy {
    /// Tolerances by flag; in a file they are two keys.
    #[arg(long, help_heading = ACCURACY, value_name = "LENGTH,ANGLE", value_parser = Target::within,
        help = "Measure, and use the fastest method that keeps 95 of 100 places and orientations within this of the truth, such as \
                '3 mm, 5 deg' or one of these")]
    #[serde(skip)]
    pub(in crate::cli) within: Option<Target>,

    /// How far 95 of 100 places may be from the truth, such as "3 mm".
    #[arg(skip)]
    #[serde(deserialize_with = "metres")]
    #[schemars(with = "Option<String>")]
    centroid: Option<f64>,

    /// How far 95 of 100 orientations may be turned from it, such as "5 deg".
    #[arg(skip)]
    #[serde(deserialize_with = "radians")]
    #[schemars(with = "Option<String>")]
    orientation: Option<f64>,

    /// Measure, and use only knobs with which a frame takes at most this in the median, such as 100us; without --within
    /// the most accurate of them.
    #[arg(long, help_heading = ACCURACY, value_name = "TIME", value_parser = time)]
    #[serde(deserialize_with = "seconds")]
    #[schemars(with = "Option<String>")]
    pub(in crate::cli) budget: Option<f64>,

    /// How sums are made: in single precision (one-pass), with the rounding errors added back (compensated), or in
    /// double precision on the CPU (double) [default: one-pass; reference: double].
    #[arg(long, help_heading = ACCURACY, value_name = "HOW",
        value_parser = one_of::<Arithmetic>(Arithmetic::WORDS))]
    #[serde(deserialize_with = "word")]
    #[schemars(with = "Option<String>", extend("enum" = Arithmetic::WORDS))]
    pub(in crate::cli) arithmetic: Option<Arithmetic>,

    /// Which charts fields have: the layout's (as-authored), tangent planes (plane), or shortest paths over the surface
    /// where that is possible (geodesic) [default: as-authored].
    #[arg(long, help_heading = ACCURACY, value_name = "KIND",
        value_parser = one_of::<Charts>(Charts::WORDS))]
    #[serde(deserialize_with = "word")]
    #[schemars(with = "Option<String>", extend("enum" = Charts::WORDS))]
    pub(in crate::cli) charts: Option<Charts>,

    /// Which output gives an orientation: the ones in --outputs (as-asked), orientation alone (two-points), principal_axis alone
    /// (second-moments), or with it the direction and place of the contact fitted to each touch in one step (fit-1), two
    /// (fit-2) or all (fit): touches.fit_direction and touches.fit_place [default: as-asked].
    #[arg(long, help_heading = ACCURACY, value_name = "WAY",
        value_parser = one_of::<OrientationBy>(OrientationBy::WORDS))]
    #[serde(deserialize_with = "word")]
    #[schemars(with = "Option<String>", extend("enum" = OrientationBy::WORDS))]
    pub(in crate::cli) orientation_by: Option<OrientationBy>,

    /// Which fields are computed in a live frame on the CPU: all, only those that changed (touched), or the faster of
    /// these (auto); percepts are the same [default: auto].
    #[arg(long, help_heading = ACCURACY, value_name = "WHICH",
        value_parser = one_of::<Coverage>(Coverage::WORDS))]
    #[serde(deserialize_with = "word")]
    #[schemars(with = "Option<String>", extend("enum" = Coverage::WORDS))]
    pub(in crate::cli) coverage: Option<Coverage>,

    /// When a field is computed: in every frame (every-frame), or when its values change (on-change), and motion then
    /// from change to change [default: every-frame].
    #[arg(long, help_heading = ACCURACY, value_name = "WHEN",
        value_parser = one_of::<Cadence>(Cadence::WORDS))]
    #[serde(deserialize_with = "word")]
    #[schemars(with = "Option<String>", extend("enum" = Cadence::WORDS))]
    pub(in crate::cli) cadence: Option<Cadence>,
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
    /// These arguments, and what `file` says where they say nothing. Knobs by flag take the place of a file's wish, and a
    /// wish by flag that of a file's knobs.
    pub(super) fn or(&self, file: Self) -> Self {
        let file = match (self.target().is_empty(), self.knob().is_none()) {
            (true, false) => Self { centroid: None, orientation: None, budget: None, ..file },
            (false, true) => {
                Self { centroid: file.centroid, orientation: file.orientation, budget: file.budget, ..Self::default() }
            }
            _ => file,
        };
        Self {
            within: self.within,
            centroid: file.centroid,
            orientation: file.orientation,
            budget: self.budget.or(file.budget),
            arithmetic: self.arithmetic.or(file.arithmetic),
            charts: self.charts.or(file.charts),
            orientation_by: self.orientation_by.or(file.orientation_by),
            coverage: self.coverage.or(file.coverage),
            cadence: self.cadence.or(file.cadence),
        }
    }

    /// What is wished for, if anything is.
    pub(in crate::cli) fn target(&self) -> Target {
        let file = Target { centroid_m: self.centroid, orientation_rad: self.orientation, budget_s: self.budget };
        self.within.unwrap_or_default().or(file)
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

    pub(in crate::cli) fn knobs(&self) -> Knobs {
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
            let what = format!("`{knob}` sets a knob that {} chooses; give one or the other", target.words());
            return Err((knob, Error::usage(what)));
        }
        if target.centroid_m.is_some() && outputs.is_empty() {
            return Err(("centroid", Error::usage("a tolerance needs outputs to hold for")));
        }
        if target.orientation_rad.is_some() && !outputs.intersects(Outputs::ORIENTATION | Outputs::PRINCIPAL_AXIS) {
            let what =
                "a tolerance of orientation is for output `orientation` or `principal_axis`, and neither is asked for";
            return Err(("orientation", Error::usage(what)));
        }
        match (backend, self.arithmetic) {
            (BackendKind::Gpu, Some(Arithmetic::Double)) => {
                let what =
                    "`arithmetic` is double, and shaders have no double precision; take backend `cpu`, or compensated";
                return Err(("arithmetic", Error::usage(what)));
            }
            (BackendKind::Reference, Some(arithmetic @ (Arithmetic::OnePass | Arithmetic::Compensated))) => {
                let what = format!(
                    "`arithmetic` is {arithmetic}, and backend `reference` is always double; take `cpu` or `gpu`"
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
