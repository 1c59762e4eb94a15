//! The chart of a touch: where taxels lie around one of them, when the skin is unrolled by its normals.
//!
//! The base has the normal n₀. For a taxel at the offset r with the normal n, let t = r − (r·n₀)n₀, θ the angle between the
//! normals, e the unit tangent along n − (n·n₀)n₀, and m = e cos(θ/2) − n₀ sin(θ/2), the direction of a chord. Then
//!
//! place = t + e ((r·m) (θ/2) / sin(θ/2) − t·e)
//!
//! The chord's part along m becomes the arc over it. On planes, spheres and cylinders that is exact in every direction; at a
//! crease it is as long as the way over it where both sides are equally long.

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
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn planes_spheres_and_cylinders_are_unrolled_exactly() {
        let radius_m = 0.04;
        for turn in [0.0, 1e-10, 1e-7, 1e-4, 0.01, 0.5, 1.5, FRAC_PI_2, 2.5, 3.1_f64] {
            for side in [1.0, -1.0] {
                let normal = DVec3::new(side * turn.sin(), 0.0, turn.cos());
                let arc_m = side * radius_m * turn;
                let on_cylinder = (normal - DVec3::Z) * radius_m + DVec3::Y * 0.013;
                let found = place(on_cylinder, DVec3::Z, normal);
                assert!(found.distance(DVec3::new(arc_m, 0.013, 0.0)) < 1e-11, "{turn}: {found}");
                let on_sphere = (normal - DVec3::Z) * radius_m;
                assert!(place(on_sphere, DVec3::Z, normal).distance(DVec3::X * arc_m) < 1e-11);
                // Seen from inside, normals turn the other way.
                assert!(place(-on_sphere, DVec3::Z, normal).distance(-DVec3::X * arc_m) < 1e-11);
            }
        }
        let flat = DVec3::new(0.3, -0.2, 0.0);
        assert_eq!(place(flat, DVec3::Z, DVec3::Z), flat);
        // A height over the plane is not a distance on it.
        assert_eq!(place(flat + DVec3::Z, DVec3::Z, DVec3::Z), flat);
        assert!(place(flat, DVec3::Z, -DVec3::Z).is_finite());
    }

    #[test]
    fn the_two_forms_of_the_half_angle_meet() {
        let at = |turn: f64| DVec3::new(turn.sin(), 0.0, turn.cos());
        for turn in [FRAC_PI_2 - 1e-9, FRAC_PI_2 + 1e-9] {
            assert!((place(at(turn) - DVec3::Z, DVec3::Z, at(turn)).x - turn).abs() < 1e-12);
        }
    }

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
