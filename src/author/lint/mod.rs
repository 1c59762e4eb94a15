//! Finds problems of a valid layout, each with its place and remedy.

pub(super) mod checks;

use std::fmt;

use crate::body::Body;
use crate::field::Field;

/// Maximum number of ids and names listed in a message.
const MAX_LISTED: usize = 8;

/// The kind of a problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FindingKind {
    /// The body has no taxels.
    NoTaxels,
    /// The body has no fields.
    NoFields,
    /// A field has too few taxels for an orientation.
    SmallField,
    /// A taxel is in no field.
    UnusedTaxel,
    /// Taxels are coincident.
    CoincidentTaxels,
    /// A taxel lies off the surface.
    OffSurface,
    /// A normal points into the body.
    InwardNormal,
    /// A normal is not the surface's.
    StaleNormal,
    /// A taxel is far from all others.
    IsolatedTaxel,
    /// (u, v) of a geodesic chart are not what the surface gives.
    StaleChart,
}

impl FindingKind {
    /// The name for programs.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::NoTaxels => "no_taxels",
            Self::NoFields => "no_fields",
            Self::SmallField => "small_field",
            Self::UnusedTaxel => "unused_taxel",
            Self::CoincidentTaxels => "coincident_taxels",
            Self::OffSurface => "off_surface",
            Self::InwardNormal => "inward_normal",
            Self::StaleNormal => "stale_normal",
            Self::IsolatedTaxel => "isolated_taxel",
            Self::StaleChart => "stale_chart",
        }
    }

    /// The unit of [`Finding::worst`].
    #[must_use]
    pub fn unit(self) -> Option<&'static str> {
        match self {
            Self::OffSurface | Self::IsolatedTaxel | Self::StaleChart => Some("m"),
            Self::InwardNormal | Self::StaleNormal => Some("rad"),
            Self::NoTaxels | Self::NoFields | Self::SmallField | Self::UnusedTaxel | Self::CoincidentTaxels => None,
        }
    }

    /// What to do about it.
    fn remedy(self) -> &'static str {
        match self {
            Self::NoTaxels => "place some, as with `somatic author`",
            Self::NoFields => "make some, as with `somatic author`",
            Self::SmallField => "give it more taxels, or ask it for no orientation",
            Self::UnusedTaxel => "put it into a field",
            Self::CoincidentTaxels => "move one, or remove it",
            Self::OffSurface => "snap it to the surface",
            Self::InwardNormal => "turn it over, or the triangles beneath it",
            Self::StaleNormal | Self::StaleChart => "work it out again, as `somatic author BODY -o OUT` does",
            Self::IsolatedTaxel => "see whether it is where it should be",
        }
    }
}

/// One kind of problem, with all its places.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The kind.
    pub kind: FindingKind,
    /// Ids of the taxels concerned, ascending.
    pub taxels: Vec<u32>,
    /// Names of the fields concerned.
    pub fields: Vec<String>,
    /// The worst value, in [`FindingKind::unit`].
    pub worst: Option<f64>,
    /// The place of the worst value: a taxel and its link, or a field.
    pub place: Option<String>,
    what: String,
}

impl Finding {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        self.kind.remedy()
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.what, self.remedy())
    }
}

/// All problems of the layout of `body`, whose fields are `fields`.
///
/// A taxel is compared with the body's surface at rest, a skinned one with the mesh at bind. It is on the surface within
/// 1 µm, beside rounding to single precision; its normal is current within 10⁻⁵ rad of a triangle's there.
#[must_use]
pub fn lint(body: &Body, fields: &[Field]) -> Vec<Finding> {
    let mut findings = Vec::new();
    findings.extend(checks::empty(body));
    findings.extend(checks::small(fields));
    findings.extend(checks::unused(body, fields));
    findings.extend(checks::crowding(body));
    findings.extend(checks::against_surface(body));
    findings.extend(checks::stale_charts(body));
    findings
}

/// The first of `words`, and the number of the others.
pub(super) fn listed<T: fmt::Display>(words: &[T]) -> String {
    let first: Vec<String> = words.iter().take(MAX_LISTED).map(ToString::to_string).collect();
    match words.len().saturating_sub(MAX_LISTED) {
        0 => first.join(", "),
        more => format!("{} and {more} more", first.join(", ")),
    }
}
