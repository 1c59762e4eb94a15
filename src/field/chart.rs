//! Charts: a field's own two coordinates.
//!
//! The tangent plane's chart is the orthogonal projection on the plane through the origin across the members' mean
//! normal. It keeps lengths along the surface up to the cosine of the tilt, and it exists only where the surface is
//! seen from one side: no member's normal more than 75° from the mean, all members on one link.

use std::collections::BTreeSet;
use std::fmt;

use glam::DVec3;

use super::{Field, Member, anchor_from_link};
use crate::body::{Body, ChartKind, FieldSpec};

/// cos 75°: how far a member's normal may lie from the mean.
const LEAST_COSINE: f64 = 0.258_819_045_102_520_76;

/// cos 10°: how near the normal may come to the anchor's +x before +z takes its place.
const NEARLY_PARALLEL: f64 = 0.984_807_753_012_208;

/// A field's frame and how its coordinates come about.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// How coordinates come about.
    pub kind: ChartKind,
    /// Direction of +u in the anchor's frame.
    pub u_in_anchor: DVec3,
    /// Direction of +v in the anchor's frame; (u, v, normal) is right-handed.
    pub v_in_anchor: DVec3,
    /// Outward normal in the anchor's frame.
    pub normal_in_anchor: DVec3,
    /// The largest shortening of a small step along the surface at any member: for a plane, 1 − cos(tilt).
    pub distortion: f64,
}

/// Why a field has no chart.
#[derive(Clone, Debug, PartialEq)]
pub enum NoChart {
    /// Its members sit on links that move against each other.
    SeveralLinks(usize),
    /// A member's normal lies this far from the mean, rad: the field wraps around something.
    Wraps(f64),
    /// The layout asks for none.
    ByChoice,
}

impl fmt::Display for NoChart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SeveralLinks(count) => write!(f, "its taxels sit on {count} links that move against each other"),
            Self::Wraps(angle) => {
                write!(f, "it wraps around: a normal lies {:.0}° from the mean, over 75°; split it", angle.to_degrees())
            }
            Self::ByChoice => f.write_str("the layout asks for none"),
        }
    }
}

/// The field that `spec` outlines, with its anchor, origin, chart and its members' places.
pub(super) fn complete(
    body: &Body,
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

    let refusal = if spec.chart.is_some_and(|chart| chart.kind == ChartKind::None) {
        Some(NoChart::ByChoice)
    } else if links.len() > 1 || anchor.is_none() {
        Some(NoChart::SeveralLinks(links.len()))
    } else if least_cosine < LEAST_COSINE {
        Some(NoChart::Wraps(least_cosine.clamp(-1.0, 1.0).acos()))
    } else {
        None
    };
    let (origin_in_anchor, chart) = match (refusal, mean_normal, anchor) {
        (None, Some(normal), Some(anchor)) => {
            let origin = spec.chart.and_then(|chart| chart.origin_in_anchor).map(DVec3::from_array);
            let origin = origin.unwrap_or_else(|| origin_on_surface(body, anchor, mean_position, &in_anchor));
            let u = spec.chart.and_then(|chart| chart.u_in_anchor).map(DVec3::from_array);
            (origin, Ok(plane(normal, u, least_cosine)))
        }
        (refusal, ..) => (mean_position, Err(refusal.unwrap_or(NoChart::Wraps(std::f64::consts::PI)))),
    };
    let members = taxels
        .iter()
        .zip(&in_anchor)
        .map(|(&(taxel, weight, _), (position, _))| {
            let offset = *position - origin_in_anchor;
            let place = match &chart {
                Ok(chart) => chart.project(offset),
                Err(_) => offset,
            };
            Member { taxel, weight, place }
        })
        .collect();
    Field { name: spec.name.clone(), parent, anchor, members, origin_in_anchor, chart }
}

/// The surface point nearest to `mean`; without a surface, `mean` itself.
fn origin_on_surface(body: &Body, anchor: usize, mean: DVec3, members: &[(DVec3, DVec3)]) -> DVec3 {
    let radius = members.iter().map(|(position, _)| position.distance(mean)).fold(0.0, f64::max);
    // The members lie on the surface, so that the nearest point is no farther than they are.
    let surface = body.surface_in_link(anchor, Some((mean, radius * 1.01 + 1e-6)));
    let surface = if surface.is_empty() { body.surface_in_link(anchor, None) } else { surface };
    surface.nearest(mean).map_or(mean, |hit| hit.position)
}

fn plane(normal: DVec3, wanted_u: Option<DVec3>, least_cosine: f64) -> Chart {
    let across = |direction: DVec3| (direction - normal * direction.dot(normal)).try_normalize();
    let default = || if normal.x.abs() > NEARLY_PARALLEL { DVec3::Z } else { DVec3::X };
    let u = wanted_u.and_then(across).or_else(|| across(default())).unwrap_or(normal.any_orthonormal_vector());
    Chart {
        kind: ChartKind::Plane,
        u_in_anchor: u,
        v_in_anchor: normal.cross(u),
        normal_in_anchor: normal,
        distortion: (1.0 - least_cosine).max(0.0),
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
}
