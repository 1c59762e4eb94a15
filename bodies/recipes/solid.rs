//! Solids as signed distance functions, and their surfaces as closed triangle meshes. Lengths in metres.

use std::collections::BTreeSet;

use fast_surface_nets::ndshape::{RuntimeShape, Shape};
use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use glam::DVec3;
use somatic::internal::body::MeshData;

/// A signed distance, at least near the surface: negative inside.
pub(crate) trait Solid {
    fn distance(&self, p: DVec3) -> f64;
}

impl<F: Fn(DVec3) -> f64> Solid for F {
    fn distance(&self, p: DVec3) -> f64 {
        self(p)
    }
}

/// A capsule from `a` to `b` whose radius goes evenly from `ra` to `rb`.
#[derive(Clone, Copy)]
pub(crate) struct Taper {
    pub(crate) a: DVec3,
    pub(crate) b: DVec3,
    pub(crate) ra: f64,
    pub(crate) rb: f64,
}

impl Solid for Taper {
    fn distance(&self, p: DVec3) -> f64 {
        let along = self.b - self.a;
        let t = ((p - self.a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        p.distance(self.a + along * t) - (self.ra + (self.rb - self.ra) * t)
    }
}

/// An ellipsoid with half-axes of lengths `radii` along the unit vectors `axes`.
#[derive(Clone, Copy)]
pub(crate) struct Ellipsoid {
    pub(crate) centre: DVec3,
    pub(crate) axes: [DVec3; 3],
    pub(crate) radii: DVec3,
}

impl Solid for Ellipsoid {
    fn distance(&self, p: DVec3) -> f64 {
        let from_centre = p - self.centre;
        let q = DVec3::from_array(self.axes.map(|axis| axis.dot(from_centre)));
        let scaled = q / self.radii;
        let slope = (scaled / self.radii).length();
        let radius = scaled.length();
        if slope < 1e-9 { -self.radii.min_element() } else { radius * (radius - 1.0) / slope }
    }
}

/// The smaller of two distances, with the crease rounded over about `width`.
pub(crate) fn smooth_min(a: f64, b: f64, width: f64) -> f64 {
    let h = ((width - (a - b).abs()) / width).max(0.0);
    a.min(b) - h * h * h * width / 6.0
}

/// The larger of two distances, with the edge rounded over about `width`.
pub(crate) fn smooth_max(a: f64, b: f64, width: f64) -> f64 {
    -smooth_min(-a, -b, width)
}

/// How the distance changes at `p`: outward, of length about 1.
fn gradient(solid: &impl Solid, p: DVec3) -> DVec3 {
    const STEP: f64 = 1e-6;
    let slope = |axis: DVec3| (solid.distance(p + axis * STEP) - solid.distance(p - axis * STEP)) / (2.0 * STEP);
    DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z))
}

/// `p` brought to the surface along the gradient.
fn to_surface(solid: &impl Solid, mut p: DVec3) -> DVec3 {
    for _ in 0..6 {
        let slope = gradient(solid, p);
        p -= slope * (solid.distance(p) / slope.length_squared().max(0.25));
    }
    p
}

/// The surface of `solid` between the corners `low` and `high`, as triangles with edges of about `edge`.
///
/// The box has to hold all of it. Vertices lie on the surface to the rounding of single precision.
pub(crate) fn mesh(solid: &impl Solid, low: DVec3, high: DVec3, edge: f64) -> MeshData {
    let size = ((high - low) / edge).ceil().as_uvec3() + glam::UVec3::splat(3);
    let origin = low - DVec3::splat(edge);
    let shape = RuntimeShape::<u32, 3>::new(size.to_array());
    let at = |[x, y, z]: [u32; 3]| origin + DVec3::new(x.into(), y.into(), z.into()) * edge;
    let samples: Vec<f32> = (0..shape.size()).map(|i| solid.distance(at(shape.delinearize(i))) as f32).collect();
    let mut net = SurfaceNetsBuffer::default();
    surface_nets(&samples, &shape, [0; 3], (size - 1).to_array(), &mut net);
    let on_grid = |p: &[f32; 3]| origin + DVec3::from_array(p.map(f64::from)) * edge;
    let mut positions: Vec<DVec3> = net.positions.iter().map(|p| to_surface(solid, on_grid(p))).collect();
    let quads: Vec<[u32; 4]> =
        net.indices.as_chunks::<6>().0.iter().map(|&[a, b, c, d, e, f]| quad([a, b, c], [d, e, f])).collect();
    relax(solid, &mut positions, &quads);
    let normals = positions.iter().map(|&p| gradient(solid, p).normalize().as_vec3().to_array()).collect();
    let triangles = quads.iter().flat_map(|&quad| cut(quad, &positions)).collect();
    let positions = positions.iter().map(|p| p.as_vec3().to_array()).collect();
    MeshData { positions, normals, triangles, skinning: None }
}

/// The four corners, in order, of two triangles that share an edge.
fn quad(one: [u32; 3], other: [u32; 3]) -> [u32; 4] {
    let lone = (0..3).find(|&k| !other.contains(&one[k])).expect("the two differ in one corner");
    let opposite = *other.iter().find(|v| !one.contains(v)).expect("the two differ in one corner");
    [one[lone], one[(lone + 1) % 3], opposite, one[(lone + 2) % 3]]
}

/// The two triangles of a quad, cut along its shorter diagonal.
fn cut([a, b, c, d]: [u32; 4], positions: &[DVec3]) -> [[u32; 3]; 2] {
    let squared = |i: u32, j: u32| positions[i as usize].distance_squared(positions[j as usize]);
    if squared(a, c) <= squared(b, d) { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] }
}

/// Evens out the net: each vertex to the mean of its neighbours, then back to the surface.
fn relax(solid: &impl Solid, positions: &mut Vec<DVec3>, quads: &[[u32; 4]]) {
    let mut neighbours = vec![BTreeSet::new(); positions.len()];
    for quad in quads {
        for k in 0..4 {
            let (i, j) = (quad[k], quad[(k + 1) % 4]);
            neighbours[i as usize].insert(j);
            neighbours[j as usize].insert(i);
        }
    }
    for _ in 0..4 {
        *positions = neighbours
            .iter()
            .map(|list| {
                let sum: DVec3 = list.iter().map(|&j| positions[j as usize]).sum();
                to_surface(solid, sum / list.len() as f64)
            })
            .collect();
    }
}

/// Where the ray from `origin` along the unit vector `direction` leaves `mesh`: the point, and its triangle's normal.
pub(crate) fn exit_point(mesh: &MeshData, origin: DVec3, direction: DVec3) -> Option<(DVec3, DVec3)> {
    let mut last: Option<(f64, DVec3)> = None;
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|v| DVec3::from_array(mesh.positions[v as usize].map(f64::from)));
        let (ab, ac, from_a) = (b - a, c - a, origin - a);
        let across = direction.cross(ac);
        let determinant = ab.dot(across);
        if determinant >= -1e-18 {
            continue;
        }
        let turned = from_a.cross(ab);
        let (beta, gamma) = (from_a.dot(across) / determinant, direction.dot(turned) / determinant);
        let t = ac.dot(turned) / determinant;
        // A ray along a shared edge must not slip between the two triangles.
        if beta >= -1e-9 && gamma >= -1e-9 && beta + gamma <= 1.0 + 1e-9 && last.is_none_or(|(t0, _)| t > t0) {
            last = Some((t, ab.cross(ac).normalize()));
        }
    }
    last.filter(|(t, _)| *t > 0.0).map(|(t, normal)| (origin + direction * t, normal))
}
