//! Where ways start: the point that is asked about, and the vertices at which ways bend.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::Place;
use crate::body::{NONE, Topology, next};

/// A point this near to a corner, in barycentric weight, is the corner.
const AT_CORNER: f64 = 1.0 - 1e-9;

/// A point from which straight lines start, at the origin of the planes that triangles are unfolded into.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    /// The way's length up to here, m; 0 at the start of all.
    pub(super) distance_m: f64,
    /// The direction in which the way here left the start, before the tangent plane is evened out, rad.
    pub(super) angle_rad: f64,
    /// How much the way bent at most before it came here, rad.
    pub(super) bend_rad: f64,
    /// The angle of all the surface around here, rad; infinite where the surface ends.
    pub(super) around_rad: f64,
    /// Whether lines from here keep the direction `angle_rad`, as behind a bend, or have their own.
    pub(super) bends: bool,
}

impl Source {
    /// How much a way bends that comes in and goes on `turn_rad` further round, rad.
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
pub(super) struct Wedge {
    pub(super) triangle: u32,
    /// Its corners.
    pub(super) corners: [DVec2; 3],
    /// The angle of the x-axis, rad.
    pub(super) base_rad: f64,
    /// The source's corner, where it is one.
    pub(super) apex: Option<u32>,
}

/// The surface around a start: its tangent frame, and how angles on it become angles in the tangent plane.
pub(super) struct Start {
    pub(super) position: DVec3,
    pub(super) u: DVec3,
    pub(super) normal: DVec3,
    pub(super) wedges: Vec<Wedge>,
    /// The angle on the surface at which +u is.
    pub(super) zero_rad: f64,
    /// What angles on the surface are multiplied by so that they go once round.
    pub(super) scale: f64,
    /// The vertex that it is, or [`NONE`].
    pub(super) vertex: u32,
}

impl Start {
    /// The start at `place`, with +u along `u` as far as that is tangential.
    pub(super) fn new(topology: &Topology, place: Place, u: DVec3) -> Self {
        match (0..3).find(|&corner| place.barycentric[corner] >= AT_CORNER) {
            Some(corner) => Self::at_vertex(topology, 3 * place.triangle + corner as u32, u),
            None => Self::inside(topology, place, u),
        }
    }

    fn inside(topology: &Topology, place: Place, u: DVec3) -> Self {
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
        // +u lies in one of the wedges as they are seen along the normal, at some part of its angle.
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

/// The wedge's angle at its apex.
fn wedge_angle(wedge: &Wedge) -> f64 {
    let far = wedge.corners[(wedge.apex.unwrap_or(0) as usize + 2) % 3];
    angle(far)
}

/// The direction of `p`, rad in (−π, π]: the same bits on every machine.
pub(super) fn angle(p: DVec2) -> f64 {
    libm::atan2(p.y, p.x)
}

/// The unit vector in the direction `angle_rad`: the same bits on every machine.
pub(super) fn towards(angle_rad: f64) -> DVec2 {
    let (sin, cos) = libm::sincos(angle_rad);
    DVec2::new(cos, sin)
}

fn normal_of([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or(DVec3::Z)
}

fn tangents(normal: DVec3, wanted: DVec3) -> (DVec3, DVec3) {
    let u = (wanted - normal * wanted.dot(normal)).try_normalize().unwrap_or(normal.any_orthonormal_vector());
    (u, normal.cross(u))
}
