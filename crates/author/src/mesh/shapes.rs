//! The simple shapes of a URDF as triangles.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::triangles::Triangles;

/// Sides of a round shape.
const SIDES: u32 = 48;
/// Rings of a sphere, poles included.
const RINGS: u32 = 25;

/// A box of `size` around the origin.
pub(super) fn cuboid(size: DVec3) -> Triangles {
    let corner = |index: u32| {
        let sign = |bit: u32| if index >> bit & 1 == 0 { -0.5 } else { 0.5 };
        DVec3::new(sign(0), sign(1), sign(2)) * size
    };
    // Counter-clockwise seen from outside.
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut mesh = Triangles { positions: (0..8).map(corner).collect(), triangles: Vec::new() };
    for [a, b, c, d] in sides {
        mesh.triangles.extend([[a, b, c], [a, c, d]]);
    }
    mesh
}

/// A cylinder along z around the origin.
pub(super) fn cylinder(radius_m: f64, length_m: f64) -> Triangles {
    let half = length_m / 2.0;
    revolved(&[(0.0, -half), (radius_m, -half), (radius_m, half), (0.0, half)])
}

/// A capsule along z around the origin: a cylinder of `length_m` with half a sphere at each end.
pub(super) fn capsule(radius_m: f64, length_m: f64) -> Triangles {
    let mut ball = sphere(radius_m);
    ball.positions.iter_mut().enumerate().for_each(|(index, p)| {
        // The middle ring is the lower half's end.
        let is_upper = index as u32 / SIDES > RINGS / 2;
        p.z += if is_upper { length_m / 2.0 } else { -length_m / 2.0 };
    });
    ball
}

/// A sphere around the origin.
pub(super) fn sphere(radius_m: f64) -> Triangles {
    let ring = |index: u32| {
        let angle = PI * f64::from(index) / f64::from(RINGS - 1);
        let out = if index == 0 || index == RINGS - 1 { 0.0 } else { radius_m * libm::sin(angle) };
        (out, -radius_m * libm::cos(angle))
    };
    revolved(&(0..RINGS).map(ring).collect::<Vec<_>>())
}

/// `outline`, (distance from z, z) from the lowest to the highest, around z.
fn revolved(outline: &[(f64, f64)]) -> Triangles {
    let mut mesh = Triangles::default();
    for &(out, z) in outline {
        for side in 0..SIDES {
            let angle = TAU * f64::from(side) / f64::from(SIDES);
            mesh.positions.push(DVec3::new(out * libm::cos(angle), out * libm::sin(angle), z));
        }
    }
    for ring in 0..outline.len() as u32 - 1 {
        for side in 0..SIDES {
            let next = (side + 1) % SIDES;
            let at = |ring: u32, side: u32| ring * SIDES + side;
            let [a, b, c, d] = [at(ring, side), at(ring, next), at(ring + 1, next), at(ring + 1, side)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume inside and area of the surface.
    fn measured(mesh: &Triangles) -> (f64, f64) {
        let corners = mesh.triangles.iter().map(|triangle| triangle.map(|v| mesh.positions[v as usize]));
        corners.fold((0.0, 0.0), |(volume, area), [a, b, c]| {
            (volume + a.dot(b.cross(c)) / 6.0, area + (b - a).cross(c - a).length() / 2.0)
        })
    }

    #[test]
    fn shapes_look_outwards_and_have_their_size() {
        let near = |(volume, area): (f64, f64), (v, a): (f64, f64)| {
            (volume / v - 1.0).abs() < 0.01 && (area / a - 1.0).abs() < 0.01
        };
        assert!(near(measured(&cuboid(DVec3::new(1.0, 2.0, 3.0))), (6.0, 22.0)));
        assert!(near(measured(&cylinder(0.5, 2.0)), (PI / 2.0, 2.5 * PI)));
        assert!(near(measured(&sphere(0.1)), (4.0 / 3.0 * PI * 1e-3, 0.04 * PI)));
    }
}
