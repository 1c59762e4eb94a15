//! Charts: a field's own two coordinates.
//!
//! A plane chart is the orthogonal projection on the plane through the origin perpendicular to the members' mean normal.
//! It shortens lengths by the cosine of the tilt. It requires all normals within 75° of the mean, and all members on one
//! link.
//!
//! A geodesic chart gives each point the length and the initial direction of the shortest path from the origin over the
//! surface, and so unrolls a limb. A chart by normals estimates that from positions and normals ([`super::place_by_normals`]), and
//! requires all normals within 120° of the middle one. Both are stored in the layout; [`super::Unroller`] computes them.

use std::fmt;

use glam::{DQuat, DVec2, DVec3};

use crate::body::ChartKind;

/// A field's two coordinates and their frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// The kind of chart.
    pub kind: ChartKind,
    /// Direction of +u in the anchor's frame.
    pub u_in_anchor: DVec3,
    /// Direction of +v in the anchor's frame; (u, v, normal) is right-handed.
    pub v_in_anchor: DVec3,
    /// Outward normal in the anchor's frame.
    pub normal_in_anchor: DVec3,
    /// The largest relative error of distances between neighbouring members, see [`super::Distortion`].
    pub distortion: f64,
    /// The root mean square of these errors.
    pub distortion_rms: f64,
}

/// Why a field has no chart.
#[derive(Clone, Debug, PartialEq)]
pub enum NoChart {
    /// Its members are on several links.
    SeveralLinks(usize),
    /// A member's normal is this far from the mean, rad: the field wraps around a part.
    Wraps(f64),
    /// A member's normal is this far from that of the member in the middle, rad: a chart by normals cannot hold it.
    Turns(f64),
    /// The layout requests no chart.
    ByChoice,
    /// This many members of a geodesic chart have no (u, v) in the layout.
    Unplaced(usize),
    /// It has no taxels of its own.
    NoTaxels,
    /// There is no surface to measure distances on.
    NoSurface,
    /// The taxel with this id is on another part of the surface than the origin, as is this number of members.
    Unreachable(u32, usize),
    /// Two paths to the taxel with this id have about the same length: the field meets itself around a limb or a bump.
    CutLocus {
        /// Id of the taxel.
        taxel: u32,
        /// Length of the shorter path, m.
        distance_m: f64,
    },
    /// Neighbours with these ids are this many times as far apart in the chart as on the surface.
    Torn(u32, u32, f64),
    /// The path to the taxel with this id bends by this angle around a hole or the surface's edge, rad.
    Bent(u32, f64),
    /// Distances cannot be computed, for this reason.
    TooRough(String),
    /// The least distorted chart has this distortion.
    Untrue(f64),
}

impl fmt::Display for NoChart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SeveralLinks(count) => write!(f, "its taxels sit on {count} links that move against each other"),
            Self::Wraps(angle) => {
                write!(
                    f,
                    "a taxel's normal is {:.0}° from the mean, over the limit of 75°; split it",
                    angle.to_degrees()
                )
            }
            Self::Turns(angle) => {
                let degrees = angle.to_degrees();
                write!(f, "a taxel's normal is {degrees:.0}° from the middle taxel's, over the limit of 120°; split it")
            }
            Self::ByChoice => f.write_str("the layout has none for it"),
            Self::Unplaced(count) => {
                write!(f, "{count} of its taxels have no (u, v); compute them with `somatic author`")
            }
            Self::NoTaxels => f.write_str("it has no taxels of its own; list its taxels"),
            Self::NoSurface => f.write_str("the body has no surface to measure distances on; add the mesh"),
            Self::Unreachable(taxel, count) => {
                write!(f, "no path on the surface leads from its origin to taxel {taxel}")?;
                if *count > 1 {
                    write!(f, " and {} more", count - 1)?;
                }
                f.write_str("; split it, or join the parts of the mesh")
            }
            Self::CutLocus { taxel, distance_m } => {
                let distance_mm = distance_m * 1e3;
                write!(
                    f,
                    "it goes all the way around: two paths of {distance_mm:.1} mm lead to taxel {taxel}; split it"
                )
            }
            Self::Torn(a, b, times) => {
                write!(
                    f,
                    "it goes all the way around: taxels {a} and {b} would be {times:.1} times too far apart; split it"
                )
            }
            Self::Bent(taxel, bend) => {
                let degrees = bend.to_degrees();
                write!(f, "the path to taxel {taxel} turns by {degrees:.0}° around a hole or an edge; split it")
            }
            Self::TooRough(why) => f.write_str(why),
            Self::Untrue(most) => write!(f, "distances in its best chart are up to {:.0} % off", most * 100.0),
        }
    }
}

impl Chart {
    /// (u, v, depth) of a point that lies `offset` from the origin in the anchor's frame.
    #[must_use]
    pub fn project(&self, offset: DVec3) -> DVec3 {
        DVec3::new(offset.dot(self.u_in_anchor), offset.dot(self.v_in_anchor), offset.dot(self.normal_in_anchor))
    }

    /// The offset from the origin, in the anchor's frame, of the point (u, v, depth).
    #[must_use]
    pub fn unproject(&self, place: DVec3) -> DVec3 {
        self.u_in_anchor * place.x + self.v_in_anchor * place.y + self.normal_in_anchor * place.z
    }

    /// Along u and v, what is along `tangent` on a taxel that looks along `normal`, both in the anchor's frame: turned by the
    /// smallest turn that takes the normal to the chart's, so that no length is lost.
    #[doc(hidden)]
    #[must_use]
    pub fn along(&self, tangent: DVec3, normal: DVec3) -> DVec2 {
        let turn = DQuat::from_rotation_arc(normal.normalize(), self.normal_in_anchor.normalize());
        let tangent = turn * tangent;
        DVec2::new(tangent.dot(self.u_in_anchor), tangent.dot(self.v_in_anchor))
    }
}
