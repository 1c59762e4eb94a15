//! From the (u, v) of a geodesic chart back to the surface, by way of the members around.
//!
//! A geodesic chart is known at the members. Each of them knows, from its neighbours, which way on the surface a step in
//! (u, v) leads; a place between several is the mean of what they say, the nearer counting more (Franke and Nielson 1980),
//! and then taken along the normal there to the surface.

use glam::{DMat2, DVec2, DVec3};
use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::{Field, anchor_from_link};
use crate::body::{Body, SurfaceIndex};

/// Members that a place is made of.
const AROUND: usize = 9;

/// Neighbours from which a member knows its surroundings.
const BESIDE: usize = 6;

/// Neighbours whose (u, v) lie on a line: the smaller eigenvalue's share of the whole, about.
const ON_A_LINE: f64 = 1e-6;

/// A member, and where steps from it lead.
struct Known {
    uv: DVec2,
    offset: DVec3,
    normal: DVec3,
    /// What a metre of u, and of v, is on the surface.
    step: [DVec3; 2],
}

/// Members of a field with a geodesic chart, as seen from its origin along its anchor's axes.
pub(super) struct Curved<'a> {
    known: Vec<Known>,
    tree: RTree<GeomWithData<[f64; 2], usize>>,
    surface: &'a SurfaceIndex,
    origin: DVec3,
    spacing_m: f64,
}

impl<'a> Curved<'a> {
    pub(super) fn new(body: &Body, field: &Field, default_u: DVec3, surface: &'a SurfaceIndex) -> Self {
        let mut known: Vec<Known> = field
            .members
            .iter()
            .map(|member| {
                let taxel = &body.taxels[member.taxel];
                let anchor_from_link = anchor_from_link(body, field.anchor, taxel.link);
                Known {
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

    /// The offset from the origin (m) and the outward normal, along the anchor's axes, of what is at `uv`.
    pub(super) fn at(&self, uv: DVec2) -> (DVec3, DVec3) {
        let near: Vec<&Known> =
            self.tree.nearest_neighbor_iter(uv.to_array()).take(AROUND).map(|spot| &self.known[spot.data]).collect();
        let nearest = near[0];
        // Nobody answers for places far from every member.
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
            // Falls to 0 at the farthest, so that the mean does not jump when another takes its place.
            let root = (1.0 / distance - 1.0 / reach).max(0.0) * self.spacing_m;
            let weight = root * root;
            offset += (known.offset + known.step[0] * away.x + known.step[1] * away.y) * weight;
            normal += known.normal * weight;
            total += weight;
        }
        if total <= 0.0 {
            // All equally far, or only one.
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

/// What a metre of u, and of v, is on the surface at member `i`: the least-squares fit to its neighbours.
fn step(known: &[Known], tree: &RTree<GeomWithData<[f64; 2], usize>>, i: usize, default_u: DVec3) -> [DVec3; 2] {
    let here = &known[i];
    let beside = tree.nearest_neighbor_iter(here.uv.to_array()).map(|spot| &known[spot.data]);
    let beside = beside.take(4 * BESIDE).filter(|other| other.uv != here.uv).take(BESIDE);
    let (mut squares, mut along_u, mut along_v) = (DMat2::ZERO, DVec3::ZERO, DVec3::ZERO);
    for other in beside {
        let (away, chord) = (other.uv - here.uv, other.offset - here.offset);
        // Steps of any length count the same.
        let weight = 1.0 / away.length_squared();
        squares += DMat2::from_cols(away * away.x, away * away.y) * weight;
        along_u += chord * (away.x * weight);
        along_v += chord * (away.y * weight);
    }
    let across = |v: DVec3| v - here.normal * v.dot(here.normal);
    let trace = squares.x_axis.x + squares.y_axis.y;
    if squares.determinant() > ON_A_LINE * trace * trace {
        let inverse = squares.inverse();
        let fit = |column: DVec2| across(along_u * column.x + along_v * column.y);
        return [fit(inverse.x_axis), fit(inverse.y_axis)];
    }
    // Neighbours on a line give one direction; (u, v, normal) is right-handed, which gives the other.
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
