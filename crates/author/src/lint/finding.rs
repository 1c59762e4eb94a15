//! Problems of a layout.

use std::fmt;

use serde::Serialize;

use crate::body::{Body, Taxel};

/// The kind of a problem.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
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
    /// A taxel is far from all others, for what is usual around it.
    IsolatedTaxel,
    /// Taxels are close to each other, for what is usual around them.
    CrowdedTaxels,
    /// (u, v) of a geodesic chart are not what the surface gives.
    StaleChart,
    /// A link is so large that its numbers are probably millimetres.
    LargeLink,
    /// Nothing can touch a taxel.
    HiddenTaxel,
    /// Nothing can touch a taxel at rest, and the body has no joints that could uncover it.
    CoveredAtRest,
    /// Taxels lie on faces that point into their own link.
    InwardFaces,
    /// Links are inside each other at rest.
    RestRunsIntoItself,
}

impl FindingKind {
    /// The unit of [`Finding::worst`].
    #[must_use]
    pub fn unit(self) -> Option<&'static str> {
        match self {
            Self::OffSurface | Self::IsolatedTaxel | Self::CrowdedTaxels | Self::StaleChart | Self::LargeLink => {
                Some("m")
            }
            Self::InwardNormal | Self::StaleNormal => Some("rad"),
            Self::HiddenTaxel | Self::CoveredAtRest | Self::InwardFaces => Some("1"),
            _ => None,
        }
    }
}

/// Taxels of a link that share a problem.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LinkShare {
    /// The link's name.
    pub link: String,
    /// Their ids, ascending.
    pub taxels: Vec<u32>,
    /// Number of the link's taxels that were checked.
    pub of: usize,
}

/// One kind of problem, with all its places.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Finding {
    /// The kind.
    pub kind: FindingKind,
    /// Ids of the taxels concerned, ascending.
    pub taxels: Vec<u32>,
    /// Names of the fields concerned.
    pub fields: Vec<String>,
    /// The worst value, in [`FindingKind::unit`]; for hidden taxels their share of the skin's area.
    pub worst: Option<f64>,
    /// The place of the worst value: a taxel and its link, a link, a field, or the link with most of the taxels.
    pub place: Option<String>,
    /// The taxels by link, for findings that count them so; the link with most first.
    pub links: Vec<LinkShare>,
    pub(super) what: String,
}

impl Finding {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self.kind {
            FindingKind::NoTaxels | FindingKind::NoFields => "add some with `somatic author`",
            FindingKind::SmallField => "give it more taxels, or do not request its orientation",
            FindingKind::UnusedTaxel => "put it into a field",
            FindingKind::CoincidentTaxels | FindingKind::CrowdedTaxels => "move or remove one",
            FindingKind::OffSurface => "move it to the surface",
            FindingKind::InwardNormal => "flip it, or the triangles below it",
            FindingKind::StaleNormal | FindingKind::StaleChart => "recompute it with `somatic author BODY -o OUT`",
            FindingKind::IsolatedTaxel => "check its place",
            FindingKind::LargeLink => "author it again in its unit: `--unit mm`, or a `scale` in the URDF",
            FindingKind::HiddenTaxel => "remove them, or move them to the outside",
            FindingKind::CoveredAtRest => "give the robot's joints: somatic inspect BODY --joints robot.urdf",
            FindingKind::InwardFaces => "flip these faces: until then their taxels count as inside",
            FindingKind::RestRunsIntoItself => "give the body a rest pose that the robot can take",
        }
    }

    pub(super) fn of_taxels(kind: FindingKind, taxels: Vec<u32>, what: String) -> Self {
        Self { kind, taxels, fields: Vec::new(), worst: None, place: None, links: Vec::new(), what }
    }

    pub(super) fn of_fields(kind: FindingKind, fields: Vec<String>, what: String) -> Self {
        Self { kind, taxels: Vec::new(), fields, worst: None, place: None, links: Vec::new(), what }
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; {}", self.what, self.remedy())
    }
}

/// A taxel's place for people.
pub(super) fn place(body: &Body, taxel: &Taxel) -> String {
    format!("taxel {} on link `{}`", taxel.id, body.links[taxel.link].name)
}

/// `count` and what of, one or several.
pub(super) fn count(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}
