//! Problems of a layout.

use std::fmt;

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
            Self::NoTaxels => "add some with `somatic author`",
            Self::NoFields => "add some with `somatic author`",
            Self::SmallField => "give it more taxels, or do not request its orientation",
            Self::UnusedTaxel => "put it into a field",
            Self::CoincidentTaxels => "move or remove one",
            Self::OffSurface => "move it to the surface",
            Self::InwardNormal => "flip it, or the triangles below it",
            Self::StaleNormal | Self::StaleChart => "recompute it with `somatic author BODY -o OUT`",
            Self::IsolatedTaxel => "check its place",
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
    pub(super) what: String,
}

impl Finding {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        self.kind.remedy()
    }
}

impl Finding {
    pub(super) fn of_taxels(kind: FindingKind, taxels: Vec<u32>, what: String) -> Self {
        Self { kind, taxels, fields: Vec::new(), worst: None, place: None, what }
    }

    pub(super) fn of_fields(kind: FindingKind, fields: Vec<String>, what: String) -> Self {
        Self { kind, taxels: Vec::new(), fields, worst: None, place: None, what }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.what, self.remedy())
    }
}
