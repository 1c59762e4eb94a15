//! The chart of a touch: where taxels lie around one of them, when the skin is unrolled by its normals ([`place`]).

use glam::{DMat3, DVec3};

pub(super) use crate::field::place_by_normals as place;

/// Angle of normals to the base's from which on a taxel is on the other side of a limb: cos 120°.
pub(super) const WRAPPED_COSINE: f64 = -0.5;

/// cos 10°: where +u would be nearer to the normal than this, another axis takes its place.
const PARALLEL_COSINE: f64 = 0.984_807_753_012_208;

/// Directions of +u and +v across `normal`, for the axes of the link: u is its +x projected, or its +z within 10° of the normal;
/// (u, v, normal) is right-handed.
pub(super) fn directions(normal: DVec3, axes: &DMat3) -> [DVec3; 2] {
    let wanted = if normal.dot(axes.x_axis).abs() > PARALLEL_COSINE { axes.z_axis } else { axes.x_axis };
    let u = (wanted - normal * wanted.dot(normal)).try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector());
    [u, normal.cross(u)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn u_is_the_links_x_unless_that_is_along_the_normal() {
        let [u, v] = directions(DVec3::Z, &DMat3::IDENTITY);
        assert_eq!([u, v], [DVec3::X, DVec3::Y]);
        let [u, v] = directions(DVec3::X, &DMat3::IDENTITY);
        assert_eq!([u, v], [DVec3::Z, DVec3::X.cross(DVec3::Z)]);
        let slanted = DVec3::new(0.5, 0.2, 0.8).normalize();
        let [u, v] = directions(slanted, &DMat3::IDENTITY);
        assert!(u.cross(v).distance(slanted) < 1e-15 && u.x > 0.0 && u.dot(slanted).abs() < 1e-15);
    }
}
