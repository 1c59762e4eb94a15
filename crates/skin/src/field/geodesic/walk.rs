//! Straight walks over a surface.

use glam::DVec3;

use super::place::SurfacePlace;
use crate::body::{NONE, Topology, area_vector, next};

/// The end of a straight walk of `length` from `from` in `triangle`; at the surface's edge, an error with the length left.
pub fn walk(
    topology: &Topology,
    triangle: u32,
    from: DVec3,
    direction: DVec3,
    length: f64,
) -> Result<SurfacePlace, f64> {
    match walk_to_edge(topology, triangle, from, direction, length) {
        (place, 0.0) => Ok(place),
        (_, left) => Err(left),
    }
}

/// The end of such a walk, or where it meets the surface's edge, and the length left there, m.
pub fn walk_to_edge(
    topology: &Topology,
    mut triangle: u32,
    mut from: DVec3,
    mut direction: DVec3,
    mut length: f64,
) -> (SurfacePlace, f64) {
    let mut entered = NONE;
    // A bound: a walk crosses a triangle again only after going around the surface.
    for _ in 0..100 * topology.triangles.len().max(100) {
        let corners = topology.corners(triangle);
        let normal = area_vector(corners).normalize_or_zero();
        let mut exit: Option<(f64, u32)> = None;
        for side in 0..3_u32 {
            let edge = 3 * triangle + side;
            if edge == entered {
                continue;
            }
            let (a, b) = (corners[side as usize], corners[(side as usize + 1) % 3]);
            let outward = (b - a).cross(normal);
            let towards = outward.dot(direction);
            if towards > 0.0 {
                let t = (outward.dot(a - from) / towards).max(0.0);
                if exit.is_none_or(|(least, _)| t < least) {
                    exit = Some((t, edge));
                }
            }
        }
        let Some((t, edge)) = exit else { break };
        if t >= length {
            return (SurfacePlace::in_triangle(topology, triangle, from + direction * length), 0.0);
        }
        from += direction * t;
        length -= t;
        let beyond = topology.across[edge as usize];
        if beyond == NONE {
            break;
        }
        let [a, b] = [topology.ends(edge).0, topology.ends(edge).1].map(|v| topology.positions[v as usize]);
        let along = (b - a).normalize_or_zero();
        let (forward, aside) = (direction.dot(along.cross(normal)), direction.dot(along));
        triangle = beyond / 3;
        entered = beyond;
        // Inward across the shared edge, in the plane of the triangle beyond.
        let third = topology.positions[topology.ends(next(next(beyond))).0 as usize] - a;
        let inward = (third - along * third.dot(along)).normalize_or_zero();
        direction = (along * aside + inward * forward).normalize_or_zero();
        if direction == DVec3::ZERO {
            break;
        }
    }
    (SurfacePlace::in_triangle(topology, triangle, from), length.max(f64::MIN_POSITIVE))
}
