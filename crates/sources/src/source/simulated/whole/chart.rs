//! Where points of a curved surface lie beside one of them, as far as normals say it.

use glam::{DMat3, DVec3};

/// Where the normals of two points are farther apart than this, one is not beside the other: 97°, as meshes have many
/// edges of 90° and few near this.
const MIN_COSINE: f64 = -0.121_869_343_405_147_48;

/// Whether a point with the normal `other` may lie beside one with `normal`.
pub(super) fn is_beside(normal: DVec3, other: DVec3) -> bool {
    normal.dot(other) > MIN_COSINE
}

/// Where a point at `offset` with the normal `other` lies in the plane across `normal`, when the surface is unrolled: exact on
/// planes, spheres and cylinders.
pub(super) fn unrolled(offset: DVec3, normal: DVec3, other: DVec3) -> DVec3 {
    let flat = offset - normal * offset.dot(normal);
    let cos = normal.dot(other);
    let tilt = other - normal * cos;
    let sin = tilt.length();
    if sin < 1e-9 {
        return flat;
    }
    let towards = tilt / sin;
    // Halves of the angle between the normals; the series where it is exact to 10⁻⁸.
    let (half_sin, half_cos) = (((1.0 - cos) / 2.0).max(0.0).sqrt(), ((1.0 + cos) / 2.0).max(0.0).sqrt());
    let arc_to_chord =
        if cos > 0.0 && sin < 0.05 { 1.0 + sin * sin / 24.0 } else { libm::atan2(sin, cos) / 2.0 / half_sin };
    let along = offset.dot(towards * half_cos - normal * half_sin) * arc_to_chord;
    flat + towards * (along - flat.dot(towards))
}

/// The distance of a point at `offset` with the normal `other`, along the surface: never less than the straight one.
pub(super) fn distance(offset: DVec3, normal: DVec3, other: DVec3) -> f64 {
    unrolled(offset, normal, other).length_squared().max(offset.length_squared()).sqrt()
}

/// `vector`, carried from where the normal is `from` to where it is `to` by the smallest turn between them.
pub(in crate::source::simulated) fn carried(vector: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    let cos = from.dot(to);
    if cos <= -1.0 + 1e-9 {
        return vector;
    }
    let axis = from.cross(to);
    let across = axis.cross(vector);
    vector + across + axis.cross(across) / (1.0 + cos)
}

/// The direction of the largest of the second moments `moments`, and that and the next one.
pub(super) fn principal(moments: DMat3) -> Option<(DVec3, f64, f64)> {
    let strongest = |matrix: DMat3| {
        // Squared again and again, all but the largest vanish.
        let mut power = matrix;
        for _ in 0..40 {
            let scale = power.to_cols_array().iter().fold(0.0_f64, |most, e| most.max(e.abs()));
            if scale <= 0.0 || !scale.is_finite() {
                return None;
            }
            power *= 1.0 / scale;
            power = power * power;
        }
        let columns = [power.x_axis, power.y_axis, power.z_axis];
        let longest = columns.into_iter().reduce(|a, b| if b.length_squared() > a.length_squared() { b } else { a })?;
        let direction = longest.try_normalize()?;
        Some((direction, direction.dot(matrix * direction)))
    };
    let (direction, first) = strongest(moments)?;
    let point = |a: f64| direction * (a * first);
    let rest = moments - DMat3::from_cols(point(direction.x), point(direction.y), point(direction.z));
    Some((direction, first, strongest(rest).map_or(0.0, |(_, second)| second.max(0.0))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cylinder_and_a_sphere_are_unrolled_exactly() {
        let radius = 0.04;
        for turn in [1e-7_f64, 0.01, 0.049, 0.051, 0.5, 1.5] {
            let normal = DVec3::new(turn.sin(), 0.0, turn.cos());
            let on_cylinder = normal * radius + DVec3::Y * 0.013 - DVec3::Z * radius;
            let place = unrolled(on_cylinder, DVec3::Z, normal);
            assert!(place.distance(DVec3::new(radius * turn, 0.013, 0.0)) < 1e-9, "{turn}: {place}");
            let on_sphere = (normal - DVec3::Z) * radius;
            assert!((distance(on_sphere, DVec3::Z, normal) - radius * turn).abs() < 1e-9, "{turn}");
            // From inside, too.
            assert!((distance(-on_sphere, DVec3::Z, normal) - radius * turn).abs() < 1e-9, "{turn}");
        }
        // A step of two parallel faces is not a place beside each other.
        assert!((distance(DVec3::new(0.003, 0.0, -0.004), DVec3::Z, DVec3::Z) - 0.005).abs() < 1e-12);
    }

    #[test]
    fn a_direction_is_carried_around_a_cylinder_as_along_a_helix() {
        let (turn, rise) = (0.7_f64, 0.6);
        let at = |turn: f64| DVec3::new(turn.sin(), 0.0, turn.cos());
        let along = |turn: f64| DVec3::new(turn.cos(), 0.0, -turn.sin()) * 0.8 + DVec3::Y * rise;
        assert!(carried(along(0.0), at(0.0), at(turn)).distance(along(turn)) < 1e-12);
    }

    #[test]
    fn the_largest_moment_is_found_whatever_its_direction() {
        let direction = DVec3::new(0.3, -0.5, 0.8).normalize();
        let [u, v] = direction.any_orthonormal_pair().into();
        let outer = |d: DVec3, s: f64| DMat3::from_cols(d * (d.x * s), d * (d.y * s), d * (d.z * s));
        let moments = outer(direction, 3e-6) + outer(u, 2e-6) + outer(v, 1e-7);
        let (found, first, second) = principal(moments).unwrap();
        assert!(found.cross(direction).length() < 1e-9);
        assert!((first - 3e-6).abs() < 1e-15 && (second - 2e-6).abs() < 1e-12, "{first:e} {second:e}");
        assert!(principal(DMat3::ZERO).is_none());
    }
}
