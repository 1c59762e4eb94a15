//! Where a ray leaves a shape.

use glam::DVec3;

use super::model::GeomShape;
use crate::mesh::triangles::Triangles;

/// A place where a ray leaves a surface: how far away it is, and the outward unit normal there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Exit {
    pub(super) distance_m: f64,
    pub(super) normal: DVec3,
}

/// Where the ray from `origin` along the unit vector `direction` leaves `shape` for the last time, if it does. `mesh` is that of
/// [`GeomShape::Mesh`].
pub(super) fn last_exit(shape: &GeomShape, mesh: Option<&Triangles>, origin: DVec3, direction: DVec3) -> Option<Exit> {
    let exit = match *shape {
        GeomShape::Box(half) => of_box(half, origin, direction),
        GeomShape::Ellipsoid(radii) => of_ellipsoid(radii, origin, direction),
        GeomShape::Cylinder { radius_m, half_length_m } => of_cylinder(radius_m, half_length_m, origin, direction),
        GeomShape::Capsule { radius_m, half_length_m } => of_capsule(radius_m, half_length_m, origin, direction),
        GeomShape::Mesh(_) => of_mesh(mesh?, origin, direction),
        GeomShape::Other => None,
    };
    exit.filter(|exit| exit.distance_m > 0.0 && exit.normal.is_finite())
}

fn of_box(half: DVec3, origin: DVec3, direction: DVec3) -> Option<Exit> {
    let (mut enter, mut leave) = (f64::NEG_INFINITY, Exit { distance_m: f64::INFINITY, normal: DVec3::ZERO });
    for (axis, unit) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
        let (from, along) = (origin[axis], direction[axis]);
        if along.abs() < 1e-15 {
            if from.abs() > half[axis] {
                return None;
            }
            continue;
        }
        let sign = along.signum();
        enter = enter.max((-sign * half[axis] - from) / along);
        let far = (sign * half[axis] - from) / along;
        if far < leave.distance_m {
            leave = Exit { distance_m: far, normal: sign * unit };
        }
    }
    (enter <= leave.distance_m).then_some(leave)
}

/// The larger solution of a t² + 2 b t + c = 0.
fn larger_root(a: f64, b: f64, c: f64) -> Option<f64> {
    let discriminant = b * b - a * c;
    (discriminant >= 0.0 && a > 0.0).then(|| (-b + discriminant.sqrt()) / a)
}

fn of_ellipsoid(radii: DVec3, origin: DVec3, direction: DVec3) -> Option<Exit> {
    let (from, along) = (origin / radii, direction / radii);
    let distance_m = larger_root(along.dot(along), from.dot(along), from.dot(from) - 1.0)?;
    let normal = ((origin + distance_m * direction) / (radii * radii)).try_normalize()?;
    Some(Exit { distance_m, normal })
}

fn of_cylinder(radius_m: f64, half_length_m: f64, origin: DVec3, direction: DVec3) -> Option<Exit> {
    let flat = |v: DVec3| DVec3::new(v.x, v.y, 0.0);
    let (from, along) = (flat(origin), flat(direction));
    let side = larger_root(along.dot(along), from.dot(along), from.dot(from) - radius_m * radius_m)
        .map(|distance_m| Exit { distance_m, normal: flat(origin + distance_m * direction) / radius_m });
    let within = |exit: &Exit| (origin.z + exit.distance_m * direction.z).abs() <= half_length_m;
    let sign = direction.z.signum();
    let cap = Exit { distance_m: (sign * half_length_m - origin.z) / direction.z, normal: sign * DVec3::Z };
    let on_cap = cap.distance_m.is_finite() && flat(origin + cap.distance_m * direction).length() <= radius_m;
    side.filter(within).or(on_cap.then_some(cap))
}

fn of_capsule(radius_m: f64, half_length_m: f64, origin: DVec3, direction: DVec3) -> Option<Exit> {
    let sphere = |z: f64| of_ellipsoid(DVec3::splat(radius_m), origin - z * DVec3::Z, direction);
    let flat = |v: DVec3| DVec3::new(v.x, v.y, 0.0);
    let (from, along) = (flat(origin), flat(direction));
    let side = larger_root(along.dot(along), from.dot(along), from.dot(from) - radius_m * radius_m)
        .map(|distance_m| Exit { distance_m, normal: flat(origin + distance_m * direction) / radius_m });
    let side = side.filter(|exit| (origin.z + exit.distance_m * direction.z).abs() <= half_length_m);
    let ends = [sphere(half_length_m), sphere(-half_length_m)];
    // It is the union of a cylinder and two spheres: the last exit of any.
    side.into_iter().chain(ends.into_iter().flatten()).max_by(|a, b| a.distance_m.total_cmp(&b.distance_m))
}

fn of_mesh(mesh: &Triangles, origin: DVec3, direction: DVec3) -> Option<Exit> {
    let exits = mesh.triangles.iter().filter_map(|triangle| {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
        let normal = (b - a).cross(c - a);
        let along = normal.dot(direction);
        if along <= 0.0 {
            return None;
        }
        let distance_m = normal.dot(a - origin) / along;
        let at = origin + distance_m * direction;
        let is_inside = [[a, b], [b, c], [c, a]].iter().all(|[p, q]| (*q - *p).cross(at - *p).dot(normal) >= 0.0);
        is_inside.then(|| Exit { distance_m, normal: normal.normalize() })
    });
    exits.max_by(|a, b| a.distance_m.total_cmp(&b.distance_m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn a_ray_leaves_each_shape_where_it_ends() {
        let cylinder = GeomShape::Cylinder { radius_m: 0.2, half_length_m: 0.5 };
        let capsule = GeomShape::Capsule { radius_m: 0.2, half_length_m: 0.5 };
        for (shape, along, distance_m) in [
            (GeomShape::Box(DVec3::new(0.1, 0.2, 0.3)), DVec3::Y, 0.2),
            (GeomShape::Ellipsoid(DVec3::new(0.1, 0.2, 0.3)), -DVec3::Z, 0.3),
            (cylinder.clone(), DVec3::X, 0.2),
            (cylinder, DVec3::Z, 0.5),
            (capsule.clone(), DVec3::X, 0.2),
            (capsule, -DVec3::Z, 0.7),
        ] {
            let exit = last_exit(&shape, None, DVec3::ZERO, along).unwrap();
            assert!((exit.distance_m - distance_m).abs() < 1e-12 && exit.normal.distance(along) < 1e-12, "{shape:?}");
            assert_eq!(last_exit(&shape, None, 2.0 * along, along), None, "it looks away from {shape:?}");
        }
        let mesh = shapes::cuboid(DVec3::splat(2.0));
        let exit = last_exit(&GeomShape::Mesh("a".into()), Some(&mesh), DVec3::new(0.1, 0.2, 0.0), DVec3::Z).unwrap();
        assert!((exit.distance_m - 1.0).abs() < 1e-12 && exit.normal == DVec3::Z);
        assert_eq!(last_exit(&GeomShape::Other, None, DVec3::ZERO, DVec3::X), None);
    }
}
