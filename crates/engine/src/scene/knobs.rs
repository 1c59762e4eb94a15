//! The knobs: where a user may trade speed for accuracy, and what each of them can be turned to.

use serde::Serialize;

use super::choose_fields;
use crate::body::{Body, ChartKind};
use crate::error::{Error, Result};
use crate::field::{FieldSet, Recharted};
use crate::percept::Outputs;
use crate::stage::fit;

/// What is traded for what; the default is as accurate as single precision is without pains, and as fast as it is.
///
/// `docs/how-to/accuracy.md` has what each costs and gives, `somatic tradeoff` measures it on one's own body and machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[non_exhaustive]
pub struct Knobs {
    /// How sums are made; `None` is what the backend is made for: one-pass, and double on the reference.
    pub arithmetic: Option<Arithmetic>,
    /// Which charts fields have.
    pub charts: Charts,
    /// What "the orientation" is.
    pub orientation_by: OrientationBy,
    /// Which fields are computed in a frame.
    pub coverage: Coverage,
    /// When a field is looked at.
    pub cadence: Cadence,
}

setters!(Knobs {
    arithmetic: impl Into<Option<Arithmetic>>,
    charts: Charts,
    orientation_by: OrientationBy,
    coverage: Coverage,
    cadence: Cadence,
});

words! {"arithmetic",
    /// How sums over a field's taxels are made.
    Arithmetic {
        /// Single precision, each term added once: the total and the centroid's moments about the chart's origin in one
        /// pass; second moments and farthest points about the centroid, in another.
        OnePass = "one-pass",
        /// Single precision, each sum with what it lost carried along: as exact for a million taxels as for ten.
        Compensated = "compensated",
        /// Double precision, by the reference, on the CPU.
        Double = "double",
    }
}

words! {"kind of charts",
    /// Which charts fields have.
    #[derive(Default)]
    Charts {
        /// Those of the layout.
        #[default]
        AsAuthored = "as-authored",
        /// Tangent planes, wherever there can be one.
        Plane = "plane",
        /// Shortest ways over the surface, wherever they can be followed.
        Geodesic = "geodesic",
    }
}

words! {"way to orientation",
    /// What is given to somebody who wants the orientation of a touch, and does not mind how it is found.
    #[derive(Default)]
    OrientationBy {
        /// What is asked for by name: outputs `orientation`, `principal_axis` or both.
        #[default]
        AsAsked = "as-asked",
        /// The line through the two farthest points: output `orientation`.
        TwoPoints = "two-points",
        /// The principal axis of the second moments: output `principal_axis`.
        SecondMoments = "second-moments",
        /// The contact fitted to each touch of the whole body in one step: outputs `touches.fit_place` and
        /// `touches.fit_direction`, beside the axis for touches without a fit. It is not tested whether it explains the taxels.
        FitInOne = "fit-1",
        /// The same in two steps.
        FitInTwo = "fit-2",
        /// The same in all steps.
        Fit = "fit",
    }
}

words! {"coverage",
    /// Which fields are computed in a live frame on the CPU; percepts are the same to the last bit.
    #[derive(Default)]
    Coverage {
        /// Those that changed, where a gate pays: on large skins that are mostly idle.
        #[default]
        Auto = "auto",
        /// All.
        All = "all",
        /// Those that changed, always behind a gate.
        Touched = "touched",
    }
}

words! {"cadence",
    /// When a field is looked at.
    #[derive(Default)]
    Cadence {
        /// In every frame: a value that is delivered again is a touch that stands still.
        #[default]
        EveryFrame = "every-frame",
        /// When one of its values changes. Until then it keeps its percept whole, motion too, and motion is measured from
        /// change to change: for a source that repeats values until its sensors have new ones.
        OnChange = "on-change",
    }
}

words! {"frame of coordinates",
    /// In which frame positions and normals are given.
    #[derive(Default)]
    Coordinates {
        /// The world, where a frame carries poses; else each field's anchor.
        #[default]
        World = "world",
        /// Each field's anchor, whatever poses there are.
        Anchor = "anchor",
    }
}

impl Knobs {
    /// Refuses what does not go together with `outputs` of fields, with letters that are changes and with no touches.
    pub(super) fn check(self, outputs: Outputs, has_changes: bool, has_touches: bool) -> Result<()> {
        let refuse = |what: &str| Err(Error::usage(format!("{what}; leave one of them out")));
        let on_change = self.cadence == Cadence::OnChange;
        if on_change && has_changes {
            return refuse("with cadence on-change, letter `change` would never fall to 0");
        }
        if on_change && outputs.intersects(Outputs::FILTERED) {
            return refuse("cadence on-change and outputs filtered_* both decide which motion counts");
        }
        if on_change && outputs.intersects(Outputs::SELF_CONTACTS | Outputs::SPEED_IN_WORLD) {
            return refuse(
                "cadence on-change keeps places of touches while links move, and self_contacts and speed_in_world are made of them",
            );
        }
        let either = Outputs::ORIENTATION | Outputs::PRINCIPAL_AXIS;
        let has_orientation = outputs.intersects(either) || (has_touches && self.orientation_by.steps().is_some());
        if self.orientation_by != OrientationBy::AsAsked && !has_orientation {
            return Err(Error::usage(format!(
                "{} is a way to an orientation, which is not asked for; add output `orientation`",
                self.orientation_by
            )));
        }
        Ok(())
    }
}

impl Charts {
    /// `fields` of `body`, those that `globs` name in such charts; with it the names of those that cannot have one.
    #[doc(hidden)]
    pub fn applied(self, body: &Body, fields: FieldSet, globs: &[String]) -> Result<Recharted> {
        let kind = match self {
            Self::AsAuthored => return Ok(Recharted { fields, kept: Vec::new() }),
            Self::Plane => ChartKind::Plane,
            Self::Geodesic => ChartKind::Geodesic,
        };
        let which = choose_fields(&fields, globs).map_err(|e| e.at(&body.name))?;
        fields.recharted(body, &which, kind)
    }
}

impl OrientationBy {
    /// `outputs` of fields, with the one of `orientation` and `principal_axis` that this stands for in the place of either.
    #[must_use]
    pub fn applied(self, outputs: Outputs) -> Outputs {
        let either = Outputs::ORIENTATION | Outputs::PRINCIPAL_AXIS;
        match self {
            Self::TwoPoints if outputs.intersects(either) => (outputs - Outputs::PRINCIPAL_AXIS) | Outputs::ORIENTATION,
            Self::SecondMoments | Self::FitInOne | Self::FitInTwo | Self::Fit if outputs.intersects(either) => {
                (outputs - Outputs::ORIENTATION) | Outputs::PRINCIPAL_AXIS
            }
            _ => outputs,
        }
    }

    /// In how many steps contacts are fitted for it, if they are.
    #[must_use]
    pub fn steps(self) -> Option<usize> {
        match self {
            Self::FitInOne => Some(1),
            Self::FitInTwo => Some(2),
            Self::Fit => Some(fit::STEPS),
            Self::AsAsked | Self::TwoPoints | Self::SecondMoments => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_is_read_as_what_it_is_shown_as() {
        for (knob, word) in Arithmetic::ALL.iter().zip(Arithmetic::WORDS) {
            assert_eq!((knob.to_string().as_str(), word.parse::<Arithmetic>().unwrap()), (*word, *knob));
        }
        for (knob, word) in Coverage::ALL.iter().zip(Coverage::WORDS) {
            assert_eq!((knob.to_string().as_str(), word.parse::<Coverage>().unwrap()), (*word, *knob));
        }
        let says = |error: Error| error.to_string();
        assert!(says("onepass".parse::<Arithmetic>().unwrap_err()).contains("did you mean `one-pass`?"));
        let wrong = says("quantum".parse::<Coverage>().unwrap_err());
        assert!(wrong.contains("it is one of all, auto, touched"), "{wrong}");
    }

    #[test]
    fn an_orientation_that_is_not_asked_for_stays_away() {
        let both = Outputs::ORIENTATION | Outputs::PRINCIPAL_AXIS | Outputs::TOTAL;
        assert_eq!(OrientationBy::AsAsked.applied(both), both);
        assert_eq!(OrientationBy::TwoPoints.applied(both), Outputs::ORIENTATION | Outputs::TOTAL);
        assert_eq!(OrientationBy::SecondMoments.applied(Outputs::ORIENTATION), Outputs::PRINCIPAL_AXIS);
        assert_eq!(OrientationBy::SecondMoments.applied(Outputs::TOTAL), Outputs::TOTAL);
        // The fit is that of touches.
        assert_eq!(OrientationBy::FitInTwo.applied(Outputs::ORIENTATION), Outputs::PRINCIPAL_AXIS);
        assert_eq!(OrientationBy::Fit.applied(Outputs::TOTAL), Outputs::TOTAL);
    }
}
