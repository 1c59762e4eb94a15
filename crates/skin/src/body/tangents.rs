//! Directions along a surface.

use glam::DVec3;

/// The default direction of +u: +x, or +z where the normal is within 10° of +x.
pub fn default_u(normal: DVec3) -> DVec3 {
    const PARALLEL_COSINE: f64 = 0.984_807_753_012_208;
    if normal.x.abs() > PARALLEL_COSINE { DVec3::Z } else { DVec3::X }
}

/// (u, v, normal) with u along the tangential part of `wanted_u`, or of the default.
pub(crate) fn tangent_frame(normal: DVec3, wanted_u: Option<DVec3>) -> [DVec3; 3] {
    let across = |direction: DVec3| (direction - normal * direction.dot(normal)).try_normalize();
    let u = wanted_u.and_then(across).or_else(|| across(default_u(normal))).unwrap_or(normal.any_orthonormal_vector());
    [u, normal.cross(u), normal]
}
