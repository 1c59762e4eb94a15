//! Fields and their members, made from a body's specifications.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DAffine3, DVec2, DVec3};

use super::chart::{Chart, NoChart};
use super::distortion::Distortion;
use crate::body::{BitsHasher, Body, ChartKind, FieldSpec, Hit, KeptOfShape, Nearest, tangent_frame};
use crate::error::{Result, failed};

/// cos 75°: maximum angle of a member's normal from the mean.
/// Cosine of the angle from which on a member is on the other side of its part: 120°.
pub(super) const MAX_TURN_COSINE: f64 = -0.5;

const MIN_NORMAL_COSINE: f64 = 0.258_819_045_102_520_76;

/// Name of the world frame, which is z up, x forward, y left: of fields whose links share no ancestor, and of percepts in posed frames.
pub const WORLD: &str = "world";

/// A taxel as a member of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Member {
    /// Index into the body's taxels.
    pub taxel: usize,
    /// Weight w > 0.
    pub weight: f64,
    /// (u, v, depth along the normal) in the field's chart, m; the depth is 0 in a geodesic one. In a field without a chart,
    /// the offset from its origin along its anchor's axes, m.
    pub place: DVec3,
}

/// A receptive field with all properties that do not change between frames.
#[derive(Clone, Debug)]
pub struct Field {
    /// Unique name.
    pub name: String,
    /// Index of the parent field.
    pub parent: Option<usize>,
    /// The link of the field's frame; `None` is the world, with the body at rest.
    pub anchor: Option<usize>,
    /// Members by ascending taxel id.
    pub members: Vec<Member>,
    /// Origin of the members' places, in the anchor's frame, m.
    pub origin_in_anchor: DVec3,
    /// The field's chart, or why it has none.
    pub chart: std::result::Result<Chart, NoChart>,
}

impl Field {
    /// The largest distance of a member from the origin, m.
    #[must_use]
    pub fn radius_m(&self) -> f64 {
        self.members.iter().map(|member| member.place.length()).fold(0.0, f64::max)
    }

    /// Estimated distance of neighbouring members, m, as if they were spread evenly over the field's extent.
    #[must_use]
    pub fn spacing_m(&self) -> f64 {
        let span = |axis: fn(DVec3) -> f64| {
            let ends =
                self.members.iter().map(|m| axis(m.place)).fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
            (ends.1 - ends.0).max(0.0)
        };
        let mut spans = [span(|p| p.x), span(|p| p.y), span(|p| p.z)];
        spans.sort_by(|a, b| b.total_cmp(a));
        let count = self.members.len() as f64;
        (spans[0] * spans[1] / count).sqrt().max(spans[0] / count)
    }
}

/// All fields of a body, a parent before its children.
#[derive(Clone, Debug)]
pub struct FieldSet {
    /// The fields.
    pub fields: Vec<Field>,
}

impl FieldSet {
    /// Builds the fields that `body` specifies.
    ///
    /// # Errors
    /// A field has no taxel, nor have its descendants.
    pub fn new(body: &Body) -> Result<Self> {
        Self::from_specs(body, &body.fields)
    }

    #[doc(hidden)]
    pub fn from_specs(body: &Body, specs: &[FieldSpec]) -> Result<Self> {
        let parents = parents(specs);
        let taxels = unions(specs);
        let (nearest, kept) = (Nearest::new(body), body.kept_of_shape());
        let mut fields = Vec::with_capacity(specs.len());
        for (index, spec) in specs.iter().enumerate() {
            let members: Vec<(usize, f64, Option<[f64; 2]>)> = taxels[index]
                .iter()
                .filter_map(|id| {
                    let own = spec.members.get(id).copied().unwrap_or_default();
                    Some((body.taxel_index(*id)?, own.weight, own.uv))
                })
                .collect();
            if members.is_empty() {
                return Err(failed!(
                    "field `{}` has no taxels, nor has any field below it; give it some or remove it",
                    spec.name
                )
                .at(&body.name));
            }
            fields.push(complete(body, (&nearest, &kept), spec, parents[index], &members));
        }
        Ok(Self { fields })
    }
}

/// The field of `spec`, with its anchor, origin, chart and its members' places.
fn complete(
    body: &Body,
    shape: (&Nearest<'_>, &KeptOfShape<'_>),
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
    let wanted_origin = spec.chart.and_then(|chart| chart.origin_in_anchor).map(DVec3::from_array);
    let wanted_u = spec.chart.and_then(|chart| chart.u_in_anchor).map(DVec3::from_array);
    let laid = match (kind, anchor.filter(|_| links.len() == 1), mean_normal) {
        (ChartKind::None, ..) => Err(NoChart::ByChoice),
        (_, None, _) => Err(NoChart::SeveralLinks(links.len())),
        (ChartKind::Geodesic | ChartKind::Normals, ..) if unplaced > 0 => Err(NoChart::Unplaced(unplaced)),
        (ChartKind::Geodesic, Some(anchor), _) => {
            let origin = wanted_origin.unwrap_or(mean_position);
            Ok((origin, tangent_frame(normal_at(shape, anchor, origin, &in_anchor), wanted_u)))
        }
        (ChartKind::Normals, ..) => {
            let origin = wanted_origin.unwrap_or(mean_position);
            let far = |(position, _): &&(DVec3, DVec3)| position.distance(origin);
            let nearest = in_anchor.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
            Ok((origin, tangent_frame(nearest.map_or(DVec3::Z, |(_, normal)| *normal), wanted_u)))
        }
        (ChartKind::Plane, Some(anchor), Some(normal)) if least_cosine >= MIN_NORMAL_COSINE => {
            let on_surface = || shape.0.in_link(anchor, mean_position).unwrap_or(mean_position);
            Ok((wanted_origin.unwrap_or_else(on_surface), tangent_frame(normal, wanted_u)))
        }
        _ => Err(NoChart::Wraps(least_cosine.clamp(-1.0, 1.0).acos())),
    };
    let origin_in_anchor = laid.as_ref().map_or(mean_position, |(origin, _)| *origin);
    let place_of = |uv: Option<[f64; 2]>, position: DVec3| {
        let offset = position - origin_in_anchor;
        match (&laid, kind, uv) {
            (Ok(_), ChartKind::Geodesic | ChartKind::Normals, Some([u, v])) => DVec3::new(u, v, 0.0),
            (Ok((_, [u, v, normal])), ..) => DVec3::new(offset.dot(*u), offset.dot(*v), offset.dot(*normal)),
            (Err(_), ..) => offset,
        }
    };
    let members: Vec<Member> = taxels
        .iter()
        .zip(&in_anchor)
        .map(|(&(taxel, weight, uv), (position, _))| Member { taxel, weight, place: place_of(uv, *position) })
        .collect();
    let chart = laid.map(|(_, [u_in_anchor, v_in_anchor, normal_in_anchor])| {
        let places: Vec<DVec2> = members.iter().map(|member| member.place.truncate()).collect();
        let Distortion { largest, rms, .. } = Distortion::measure(&in_anchor, &places);
        Chart { kind, u_in_anchor, v_in_anchor, normal_in_anchor, distortion: largest, distortion_rms: rms }
    });
    Field { name: spec.name.clone(), parent, anchor, members, origin_in_anchor, chart }
}

/// The surface's normal at `origin`, or without a surface that of the nearest member.
fn normal_at(
    (nearest, kept): (&Nearest<'_>, &KeptOfShape<'_>),
    anchor: usize,
    origin: DVec3,
    members: &[(DVec3, DVec3)],
) -> DVec3 {
    let mut key = BitsHasher::default();
    key.number(anchor);
    key.vector(origin);
    members.iter().for_each(|&(position, normal)| [position, normal].into_iter().for_each(|v| key.vector(v)));
    let find = || NormalAt(normal_of_surface_at(nearest, anchor, origin, members));
    kept.get(key.finish(), find).0
}

/// So that it is kept apart from other vectors.
struct NormalAt(DVec3);

fn normal_of_surface_at(nearest: &Nearest<'_>, anchor: usize, origin: DVec3, members: &[(DVec3, DVec3)]) -> DVec3 {
    let radius = members.iter().map(|(position, _)| position.distance(origin)).fold(0.0, f64::max);
    let surface = nearest.around(anchor, origin, radius * 0.1 + 1e-6);
    let around = |hit: Hit| surface.normal_around(hit.position, radius * 1e-6 + 1e-9);
    let closest = members.iter().min_by(|a, b| a.0.distance(origin).total_cmp(&b.0.distance(origin)));
    surface.nearest(origin).and_then(around).or(closest.map(|(_, normal)| *normal)).unwrap_or(DVec3::Z)
}

fn parents(fields: &[FieldSpec]) -> Vec<Option<usize>> {
    let index_of: BTreeMap<&str, usize> = fields.iter().enumerate().map(|(i, f)| (f.name.as_str(), i)).collect();
    fields.iter().map(|f| f.parent.as_deref().and_then(|p| index_of.get(p).copied())).collect()
}

/// Per field of `fields`, which has parents before their children, the ids of its own taxels and its descendants'.
#[must_use]
pub fn unions(fields: &[FieldSpec]) -> Vec<BTreeSet<u32>> {
    let parents = parents(fields);
    let mut taxels: Vec<BTreeSet<u32>> = fields.iter().map(|f| f.members.keys().copied().collect()).collect();
    // Children come after their parents, so that one pass from the back gathers all descendants.
    for child in (0..taxels.len()).rev() {
        if let Some(parent) = parents[child] {
            let below = taxels[child].clone();
            taxels[parent].extend(below);
        }
    }
    taxels
}

/// At rest, the transform from link `link` to a field's anchor.
pub(super) fn anchor_from_link(body: &Body, anchor: Option<usize>, link: usize) -> DAffine3 {
    match anchor {
        Some(anchor) => body.rest_transform(anchor, link),
        None => body.links[link].world_from_link(),
    }
}
