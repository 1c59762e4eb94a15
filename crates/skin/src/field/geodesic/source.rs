//! Sources of straight lines: the start point, and vertices at which paths bend.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::SurfacePlace;
use crate::body::{NONE, Topology, area_vector, next};

/// A point with at least this barycentric weight is the corner.
const CORNER_WEIGHT: f64 = 1.0 - 1e-9;

/// A point from which straight lines start, at the origin of the unfolded planes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    /// Length of the path to here, m; 0 at the start.
    pub(super) distance_m: f64,
    /// The start that the path comes from.
    pub(super) start: u32,
    /// Initial direction of the path to here, before scaling to a full turn, rad.
    pub(super) angle_rad: f64,
    /// The largest bend of the path before here, rad.
    pub(super) bend_rad: f64,
    /// The total angle of the surface around here, rad; infinite at the surface's edge.
    pub(super) around_rad: f64,
    /// Whether lines from here have the initial direction `angle_rad`, as behind a bend, or their own.
    pub(super) bends: bool,
}

impl Source {
    /// The bend of a path that continues `turn_rad` from its arrival, rad.
    pub(super) fn bend(&self, turn_rad: f64) -> f64 {
        if !self.bends {
            return 0.0;
        }
        let turn = turn_rad.abs();
        self.bend_rad.max(turn.min((self.around_rad - turn).abs()) - PI).max(0.0)
    }
}

/// A triangle at a source, unfolded with the source at the origin.
#[derive(Clone, Copy, Debug)]
pub(in crate::field) struct Wedge {
    pub(in crate::field) triangle: u32,
    pub(in crate::field) corners: [DVec2; 3],
    /// The angle of the x-axis, rad.
    pub(super) base_rad: f64,
    /// The source's corner, if the source is a vertex.
    pub(super) apex: Option<u32>,
}

/// The start point: its tangent frame, and the map from angles on the surface to the tangent plane.
pub(in crate::field) struct Start {
    pub(super) position: DVec3,
    pub(super) u: DVec3,
    pub(super) normal: DVec3,
    pub(in crate::field) wedges: Vec<Wedge>,
    /// The angle on the surface of +u.
    pub(super) zero_rad: f64,
    /// Factor that scales angles on the surface to a full turn.
    pub(super) scale: f64,
    /// The start's vertex, or [`NONE`].
    pub(super) vertex: u32,
}

impl Start {
    /// The start at `place`, with +u along the tangential part of `u`.
    pub(in crate::field) fn new(topology: &Topology, place: SurfacePlace, u: DVec3) -> Self {
        match (0..3).find(|&corner| place.barycentric[corner] >= CORNER_WEIGHT) {
            Some(corner) => Self::at_vertex(topology, 3 * place.triangle + corner as u32, u),
            None => Self::inside(topology, place, u),
        }
    }

    fn inside(topology: &Topology, place: SurfacePlace, u: DVec3) -> Self {
        let corners = topology.corners(place.triangle);
        let normal = normal_of(corners);
        let position = place.position(topology);
        let (u, v) = tangents(normal, u);
        let flat = corners.map(|corner| {
            let offset = corner - position;
            DVec2::new(offset.dot(u), offset.dot(v))
        });
        let wedge = Wedge { triangle: place.triangle, corners: flat, base_rad: 0.0, apex: None };
        Self { position, u, normal, wedges: vec![wedge], zero_rad: 0.0, scale: 1.0, vertex: NONE }
    }

    fn at_vertex(topology: &Topology, edge: u32, u: DVec3) -> Self {
        let vertex = topology.ends(edge).0;
        let position = topology.positions[vertex as usize];
        let fan = Fan::new(topology, edge);
        let weighted = |wedge: &Wedge| normal_of(topology.corners(wedge.triangle)) * wedge_angle(wedge);
        let normal = fan.wedges.iter().map(weighted).sum::<DVec3>().normalize_or(DVec3::Z);
        let (u, v) = tangents(normal, u);
        let seen = |to: u32| {
            let offset = topology.positions[to as usize] - position;
            angle(DVec2::new(offset.dot(u), offset.dot(v)))
        };
        // Find the wedge that contains +u, seen along the normal, and the share of its angle.
        let holds_u = fan.wedges.iter().find_map(|wedge| {
            let apex = 3 * wedge.triangle + wedge.apex?;
            let (right, left) = (seen(topology.ends(next(apex)).0), seen(topology.ends(next(apex)).1));
            let (width, to_u) = ((left - right).rem_euclid(TAU), (-right).rem_euclid(TAU));
            (to_u <= width && width > 0.0).then(|| wedge.base_rad + wedge_angle(wedge) * to_u / width)
        });
        let scale = if fan.closed { TAU / fan.angle_rad } else { 1.0 };
        let zero_rad = holds_u.unwrap_or_else(|| -seen(topology.ends(edge).1) / scale);
        Self { position, u, normal, wedges: fan.wedges, zero_rad, scale, vertex }
    }

    /// The angle in the tangent plane, from +u to +v in (−π, π], of an angle on the surface.
    pub(super) fn in_plane(&self, angle_rad: f64) -> f64 {
        let angle = (self.scale * (angle_rad - self.zero_rad)).rem_euclid(TAU);
        if angle > PI { angle - TAU } else { angle }
    }
}

/// All triangles around a vertex.
pub(super) struct Fan {
    pub(super) wedges: Vec<Wedge>,
    pub(super) angle_rad: f64,
    pub(super) closed: bool,
}

impl Fan {
    /// The fan around the vertex at which `edge` starts.
    pub(super) fn new(topology: &Topology, edge: u32) -> Self {
        let (edges, closed) = topology.fan(edge);
        let mut angle_rad = 0.0;
        let wedges = edges.into_iter().map(|edge| {
            let [a, b, c] =
                [edge, next(edge), next(next(edge))].map(|e| topology.positions[topology.ends(e).0 as usize]);
            let (along, far) = ((b - a).length(), c - a);
            let x = far.dot(b - a) / along;
            let y = (b - a).cross(far).length() / along;
            let mut corners = [DVec2::ZERO; 3];
            let apex = edge % 3;
            corners[(apex as usize + 1) % 3] = DVec2::new(along, 0.0);
            corners[(apex as usize + 2) % 3] = DVec2::new(x, y);
            let wedge = Wedge { triangle: edge / 3, corners, base_rad: angle_rad, apex: Some(apex) };
            angle_rad += angle(DVec2::new(x, y));
            wedge
        });
        let wedges = wedges.collect();
        Self { wedges, angle_rad, closed }
    }
}

fn wedge_angle(wedge: &Wedge) -> f64 {
    let far = wedge.corners[(wedge.apex.unwrap_or(0) as usize + 2) % 3];
    angle(far)
}

/// The direction of `p`, rad in (−π, π].
pub(super) fn angle(p: DVec2) -> f64 {
    libm::atan2(p.y, p.x)
}

/// The unit vector in the direction `angle_rad`.
pub(super) fn towards(angle_rad: f64) -> DVec2 {
    let (sin, cos) = libm::sincos(angle_rad);
    DVec2::new(cos, sin)
}

fn normal_of(corners: [DVec3; 3]) -> DVec3 {
    area_vector(corners).normalize_or(DVec3::Z)
}

fn tangents(normal: DVec3, wanted: DVec3) -> (DVec3, DVec3) {
    let u = (wanted - normal * wanted.dot(normal)).try_normalize().unwrap_or(normal.any_orthonormal_vector());
    (u, normal.cross(u))
}
