//! Maps the (u, v) of a geodesic chart to the surface by interpolation between members.
//!
//! A geodesic chart is known at the members. Each member has a linear map from steps in (u, v) to steps on the surface,
//! fitted to its neighbours. A point between members is the weighted mean of their extrapolations (Franke and Nielson
//! 1980), projected along the normal to the surface.

use glam::{DMat2, DVec2, DVec3};
use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::set::{Field, anchor_from_link};
use crate::body::{Body, Near};

const BLEND_MEMBERS: usize = 9;

/// Number of neighbours for the fit of a member's linear map.
const STEP_NEIGHBOURS: usize = 6;

/// Neighbours are collinear below this share of the smaller eigenvalue, about.
const COLLINEAR_SHARE: f64 = 1e-6;

/// A member and its linear map from (u, v) to the surface.
struct MemberFrame {
    uv: DVec2,
    offset: DVec3,
    normal: DVec3,
    /// Change on the surface per metre of u, and of v.
    step: [DVec3; 2],
}

/// Maps (u, v) of a field's geodesic chart to the surface. Offsets are from the origin along the anchor's axes.
pub(super) struct GeodesicSurface<'a> {
    known: Vec<MemberFrame>,
    tree: RTree<GeomWithData<[f64; 2], usize>>,
    surface: &'a Near,
    origin: DVec3,
    spacing_m: f64,
}

impl<'a> GeodesicSurface<'a> {
    pub(super) fn new(body: &Body, field: &Field, default_u: DVec3, surface: &'a Near) -> Self {
        let mut known: Vec<MemberFrame> = field
            .members
            .iter()
            .map(|member| {
                let taxel = &body.taxels[member.taxel];
                let anchor_from_link = anchor_from_link(body, field.anchor, taxel.link);
                MemberFrame {
                    uv: member.place.truncate(),
                    offset: anchor_from_link.transform_point3(taxel.position_in_link) - field.origin_in_anchor,
                    normal: anchor_from_link.transform_vector3(taxel.normal_in_link),
                    step: [DVec3::ZERO; 2],
                }
            })
            .collect();
        let tree =
            RTree::bulk_load(known.iter().enumerate().map(|(i, k)| GeomWithData::new(k.uv.to_array(), i)).collect());
        for i in 0..known.len() {
            known[i].step = step(&known, &tree, i, default_u);
        }
        Self { known, tree, surface, origin: field.origin_in_anchor, spacing_m: field.spacing_m() }
    }

    /// The offset from the origin (m) and the outward normal at `uv`, along the anchor's axes.
    pub(super) fn at(&self, uv: DVec2) -> (DVec3, DVec3) {
        let near: Vec<&MemberFrame> = self
            .tree
            .nearest_neighbor_iter(uv.to_array())
            .take(BLEND_MEMBERS)
            .map(|spot| &self.known[spot.data])
            .collect();
        let nearest = near[0];
        // Points far from all members are clamped.
        let beyond = uv - nearest.uv;
        let uv = nearest.uv + beyond.clamp_length_max(2.0 * self.spacing_m);
        let reach = near[near.len() - 1].uv.distance(uv);
        let (mut offset, mut normal, mut total) = (DVec3::ZERO, DVec3::ZERO, 0.0);
        for known in &near {
            let away = uv - known.uv;
            let distance = away.length();
            if distance <= 1e-9 * self.spacing_m {
                (offset, normal, total) = (known.offset, known.normal, 1.0);
                break;
            }
            // 0 at the farthest member, so that the mean is continuous when the set of members changes.
            let root = (1.0 / distance - 1.0 / reach).max(0.0) * self.spacing_m;
            let weight = root * root;
            offset += (known.offset + known.step[0] * away.x + known.step[1] * away.y) * weight;
            normal += known.normal * weight;
            total += weight;
        }
        if total <= 0.0 {
            // All members are equally far, or there is only one.
            let away = uv - nearest.uv;
            offset = nearest.offset + nearest.step[0] * away.x + nearest.step[1] * away.y;
            (normal, total) = (nearest.normal, 1.0);
        }
        let (offset, normal) = (offset / total, normal.normalize_or(nearest.normal));
        match self.surface.along(self.origin + offset, normal, self.spacing_m.max(1e-6)) {
            Some(hit) => (hit.position - self.origin, hit.normal),
            None => (offset, normal),
        }
    }
}

/// Change on the surface per metre of u and of v at member `i`: the least-squares fit to its neighbours.
fn step(known: &[MemberFrame], tree: &RTree<GeomWithData<[f64; 2], usize>>, i: usize, default_u: DVec3) -> [DVec3; 2] {
    let here = &known[i];
    let beside = tree.nearest_neighbor_iter(here.uv.to_array()).map(|spot| &known[spot.data]);
    let beside = beside.take(4 * STEP_NEIGHBOURS).filter(|other| other.uv != here.uv).take(STEP_NEIGHBOURS);
    let (mut squares, mut along_u, mut along_v) = (DMat2::ZERO, DVec3::ZERO, DVec3::ZERO);
    for other in beside {
        let (away, chord) = (other.uv - here.uv, other.offset - here.offset);
        // All steps have the same weight.
        let weight = 1.0 / away.length_squared();
        squares += DMat2::from_cols(away * away.x, away * away.y) * weight;
        along_u += chord * (away.x * weight);
        along_v += chord * (away.y * weight);
    }
    let across = |v: DVec3| v - here.normal * v.dot(here.normal);
    let trace = squares.x_axis.x + squares.y_axis.y;
    if squares.determinant() > COLLINEAR_SHARE * trace * trace {
        let inverse = squares.inverse();
        let fit = |column: DVec2| across(along_u * column.x + along_v * column.y);
        return [fit(inverse.x_axis), fit(inverse.y_axis)];
    }
    // Collinear neighbours give one direction; the other follows from the normal.
    let line = if squares.x_axis.x >= squares.y_axis.y { squares.x_axis } else { squares.y_axis };
    let line = line.try_normalize();
    let on_surface = line.and_then(|line| across(along_u * line.x + along_v * line.y).try_normalize());
    let (line, on_surface) = match (line, on_surface) {
        (Some(line), Some(on_surface)) => (line, on_surface),
        _ => (DVec2::X, across(default_u).normalize_or(here.normal.any_orthonormal_vector())),
    };
    let left = here.normal.cross(on_surface);
    [on_surface * line.x - left * line.y, on_surface * line.y + left * line.x]
}
