//! Charts: a field's own two coordinates.
//!
//! A plane chart is the orthogonal projection on the plane through the origin perpendicular to the members' mean normal.
//! It shortens lengths by the cosine of the tilt. It requires all normals within 75° of the mean, and all members on one
//! link.
//!
//! A geodesic chart gives each point the length and the initial direction of the shortest path from the origin over the
//! surface, and so unrolls a limb. It is stored in the layout; [`super::Unroller`] computes it.

use std::collections::BTreeSet;
use std::fmt;

use glam::{DVec2, DVec3};

use super::distortion::Distortion;
use super::{Field, Member, anchor_from_link};
use crate::body::{Body, ChartKind, FieldSpec, Hit, Nearest};

/// cos 75°: maximum angle of a member's normal from the mean.
const MIN_NORMAL_COSINE: f64 = 0.258_819_045_102_520_76;

/// cos 10°: +u is along the anchor's +z instead of +x if the normal is nearer to +x.
const PARALLEL_COSINE: f64 = 0.984_807_753_012_208;

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
    /// The largest relative error of distances between neighbouring members, see [`Distortion`].
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
        /// The angle between their departures, rad.
        apart_rad: f64,
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
                let angle = angle.to_degrees();
                write!(
                    f,
                    "it wraps around: a taxel's normal is {angle:.0}° from the mean, and 75° is the limit; split it"
                )
            }
            Self::ByChoice => f.write_str("the layout asks for none"),
            Self::Unplaced(count) => {
                write!(
                    f,
                    "its chart is geodesic, and {count} of its taxels have no (u, v); lay it with `somatic author`"
                )
            }
            Self::NoTaxels => f.write_str("it has no taxels of its own; list those that it is to chart"),
            Self::NoSurface => f.write_str("there is no surface to measure ways on; add the mesh"),
            Self::Unreachable(taxel, count) => {
                write!(f, "no path on the surface leads from its origin to taxel {taxel}")?;
                if *count > 1 {
                    write!(f, " and {} more", count - 1)?;
                }
                f.write_str("; split it, or join the parts of the mesh")
            }
            Self::CutLocus { taxel, distance_m, .. } => write!(
                f,
                "it goes all the way around a limb or a knob: two paths lead to taxel {taxel}, {:.1} mm away, one on each \
                 side; split it",
                distance_m * 1e3
            ),
            Self::Torn(a, b, times) => write!(
                f,
                "it goes all the way around: taxels {a} and {b}, which are neighbours, would be {times:.1} times too far \
                 apart; split it"
            ),
            Self::Bent(taxel, bend) => write!(
                f,
                "the path to taxel {taxel} turns by {:.0}° around a hole or the surface's edge; split it",
                bend.to_degrees()
            ),
            Self::TooRough(why) => f.write_str(why),
            Self::Untrue(most) => write!(f, "distances in its best chart are up to {:.0} % off", most * 100.0),
        }
    }
}

/// The field of `spec`, with its anchor, origin, chart and its members' places.
pub(super) fn complete(
    body: &Body,
    nearest: &Nearest<'_>,
    spec: &FieldSpec,
    parent: Option<usize>,
    taxels: &[(usize, f64, Option<[f64; 2]>)],
) -> Field {
    let links: BTreeSet<usize> = taxels.iter().map(|&(taxel, ..)| body.taxels[taxel].link).collect();
    let anchor = body.common_ancestor(links.iter().copied());
    let in_anchor: Vec<(DVec3, DVec3)> = taxels
        .iter()
        .map(|&(taxel, ..)| {
            let taxel = &body.taxels[taxel];
            let anchor_from_link = anchor_from_link(body, anchor, taxel.link);
            (
                anchor_from_link.transform_point3(taxel.position_in_link),
                anchor_from_link.transform_vector3(taxel.normal_in_link),
            )
        })
        .collect();
    let count = taxels.len() as f64;
    let mean_position = in_anchor.iter().map(|(position, _)| *position).sum::<DVec3>() / count;
    let mean_normal = in_anchor.iter().map(|(_, normal)| *normal).sum::<DVec3>().try_normalize();
    let least_cosine = mean_normal.map_or(-1.0, |mean| in_anchor.iter().map(|(_, n)| n.dot(mean)).fold(1.0, f64::min));

    let kind = spec.chart.map_or(ChartKind::Plane, |chart| chart.kind);
    let unplaced = taxels.iter().filter(|(.., uv)| uv.is_none()).count();
    let refusal = if kind == ChartKind::None {
        Some(NoChart::ByChoice)
    } else if links.len() > 1 || anchor.is_none() {
        Some(NoChart::SeveralLinks(links.len()))
    } else if kind == ChartKind::Geodesic {
        (unplaced > 0).then_some(NoChart::Unplaced(unplaced))
    } else if least_cosine < MIN_NORMAL_COSINE {
        Some(NoChart::Wraps(least_cosine.clamp(-1.0, 1.0).acos()))
    } else {
        None
    };
    let wanted_origin = spec.chart.and_then(|chart| chart.origin_in_anchor).map(DVec3::from_array);
    let wanted_u = spec.chart.and_then(|chart| chart.u_in_anchor).map(DVec3::from_array);
    let (origin_in_anchor, frame) = match (refusal, mean_normal, anchor) {
        (None, _, Some(anchor)) if kind == ChartKind::Geodesic => {
            let origin = wanted_origin.unwrap_or(mean_position);
            let normal = normal_at(nearest, anchor, origin, &in_anchor);
            (origin, Ok(frame(normal, wanted_u)))
        }
        (None, Some(normal), Some(anchor)) => {
            let origin =
                wanted_origin.unwrap_or_else(|| nearest.in_link(anchor, mean_position).unwrap_or(mean_position));
            (origin, Ok(frame(normal, wanted_u)))
        }
        (refusal, ..) => (mean_position, Err(refusal.unwrap_or(NoChart::Wraps(std::f64::consts::PI)))),
    };
    let place_of = |uv: Option<[f64; 2]>, position: DVec3| {
        let offset = position - origin_in_anchor;
        match (&frame, kind, uv) {
            (Ok(_), ChartKind::Geodesic, Some([u, v])) => DVec3::new(u, v, 0.0),
            (Ok([u, v, normal]), ..) => DVec3::new(offset.dot(*u), offset.dot(*v), offset.dot(*normal)),
            (Err(_), ..) => offset,
        }
    };
    let members: Vec<Member> = taxels
        .iter()
        .zip(&in_anchor)
        .map(|(&(taxel, weight, uv), (position, _))| Member { taxel, weight, place: place_of(uv, *position) })
        .collect();
    let chart = frame.map(|[u_in_anchor, v_in_anchor, normal_in_anchor]| {
        let places: Vec<DVec2> = members.iter().map(|member| member.place.truncate()).collect();
        let Distortion { largest, rms, .. } = Distortion::of(&in_anchor, &places);
        Chart { kind, u_in_anchor, v_in_anchor, normal_in_anchor, distortion: largest, distortion_rms: rms }
    });
    Field { name: spec.name.clone(), parent, anchor, members, origin_in_anchor, chart }
}

/// The surface's normal at `origin`, or without a surface that of the nearest member.
fn normal_at(nearest: &Nearest<'_>, anchor: usize, origin: DVec3, members: &[(DVec3, DVec3)]) -> DVec3 {
    let radius = members.iter().map(|(position, _)| position.distance(origin)).fold(0.0, f64::max);
    let surface = nearest.around(anchor, origin, radius * 0.1 + 1e-6);
    let around = |hit: Hit| surface.normal_around(hit.position, radius * 1e-6 + 1e-9);
    let closest = members.iter().min_by(|a, b| a.0.distance(origin).total_cmp(&b.0.distance(origin)));
    surface.nearest(origin).and_then(around).or(closest.map(|(_, normal)| *normal)).unwrap_or(DVec3::Z)
}

/// (u, v, normal) with u along the tangential part of `wanted_u`, or of the default.
pub(super) fn frame(normal: DVec3, wanted_u: Option<DVec3>) -> [DVec3; 3] {
    let across = |direction: DVec3| (direction - normal * direction.dot(normal)).try_normalize();
    let default = || if normal.x.abs() > PARALLEL_COSINE { DVec3::Z } else { DVec3::X };
    let u = wanted_u.and_then(across).or_else(|| across(default())).unwrap_or(normal.any_orthonormal_vector());
    [u, normal.cross(u), normal]
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
}
