//! The body's surface as viewers draw it: vertices in their links' frames, with smooth normals.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};
use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::body::{Body, Home, Taxel};

/// Vertices closer than this share a normal, m.
const WELD_M: f64 = 1e-6;
/// cos 40°: vertices at one place whose own normals differ by more are at an edge, and keep their normals.
const SMOOTH_COSINE: f64 = 0.766;
/// The largest radius of the disc of a taxel of unknown area, m.
const MAX_DEFAULT_RADIUS_M: f64 = 0.005;
/// The radius of such a disc, of the distance to the nearest taxel.
const DEFAULT_RADIUS_SHARE: f64 = 0.4;
/// The largest radius of any disc, of that distance: discs leave a gap between each other.
const MAX_RADIUS_SHARE: f64 = 0.47;

/// Triangles of all surfaces.
#[derive(Debug, Default)]
pub(super) struct Mesh {
    /// By vertex, in the frame of its link, m.
    pub(super) positions: Vec<DVec3>,
    /// By vertex, outward, in the frame of its link.
    pub(super) normals: Vec<DVec3>,
    /// By vertex.
    pub(super) links: Vec<usize>,
    /// Counter-clockwise from outside.
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The surfaces of `body`.
    pub(super) fn new(body: &Body) -> Self {
        let mut mesh = Self::default();
        for surface in &body.surfaces {
            let first = mesh.positions.len() as u32;
            let (ways, of): (Vec<(usize, DAffine3)>, Option<&Vec<usize>>) = match &surface.home {
                Home::Rigid { link, link_from_mesh } => (vec![(*link, *link_from_mesh)], None),
                Home::Skinned { joints, heaviest, .. } => (joints.clone(), Some(heaviest)),
            };
            for (vertex, &position) in surface.positions.iter().enumerate() {
                let (link, link_from_mesh) = ways[of.map_or(0, |heaviest| heaviest[vertex])];
                debug_assert_eq!(link, surface.carrier(vertex));
                mesh.positions.push(link_from_mesh.transform_point3(position));
                mesh.links.push(link);
            }
            let mirrored = ways.first().is_some_and(|(_, way)| way.matrix3.determinant() < 0.0);
            mesh.triangles.extend(surface.triangles.iter().map(|triangle| {
                let [a, b, c] = triangle.map(|corner| first + corner);
                if mirrored { [a, c, b] } else { [a, b, c] }
            }));
        }
        mesh.split_at_edges();
        mesh.normals = mesh.smooth_normals(body);
        mesh
    }

    /// The middle of the surface and the taxels of `body` at rest, in the world, m.
    pub(super) fn centre(&self, body: &Body) -> DVec3 {
        let at = |link: usize, position| body.links[link].world_from_link().transform_point3(position);
        let vertices = self.positions.iter().zip(&self.links).map(|(&position, &link)| at(link, position));
        let taxels = body.taxels.iter().map(|taxel| at(taxel.link, taxel.position_in_link));
        let box_of = vertices.chain(taxels).fold(None, |ends: Option<(DVec3, DVec3)>, p| {
            Some(ends.map_or((p, p), |(low, high)| (low.min(p), high.max(p))))
        });
        box_of.map_or(DVec3::ZERO, |(low, high)| low + 0.5 * (high - low))
    }

    /// Gives each side of an edge vertices of its own: where triangles that share a vertex are turned against each other by more
    /// than smooth ones are, as the sides of a box that has eight vertices.
    fn split_at_edges(&mut self) {
        // By vertex, the vertices that stand for it, each with the direction of its first triangle.
        let mut sides: Vec<Vec<(u32, DVec3)>> = vec![Vec::new(); self.positions.len()];
        for triangle in &mut self.triangles {
            let [a, b, c] = triangle.map(|corner| self.positions[corner as usize]);
            let Some(direction) = (b - a).cross(c - a).try_normalize() else { continue };
            for corner in triangle {
                let vertex = *corner as usize;
                let alike = sides[vertex].iter().find(|(_, other)| other.dot(direction) >= SMOOTH_COSINE);
                let alike = alike.map(|&(own, _)| own);
                *corner = match alike {
                    Some(own) => own,
                    None if sides[vertex].is_empty() => *corner,
                    None => {
                        self.positions.push(self.positions[vertex]);
                        self.links.push(self.links[vertex]);
                        self.positions.len() as u32 - 1
                    }
                };
                if alike.is_none() {
                    sides[vertex].push((*corner, direction));
                }
            }
        }
    }

    /// Area-weighted normals over the triangles around a place; across an edge those of its own side alone.
    fn smooth_normals(&self, body: &Body) -> Vec<DVec3> {
        let way =
            |vertex: usize| body.links[self.links[vertex]].body_from_link.transform_point3(self.positions[vertex]);
        let at_rest: Vec<DVec3> = (0..self.positions.len()).map(way).collect();
        let mut own = vec![DVec3::ZERO; at_rest.len()];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|corner| at_rest[corner as usize]);
            let area_vector = (b - a).cross(c - a);
            triangle.iter().for_each(|&corner| own[corner as usize] += area_vector);
        }
        let mut at_place: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
        for (vertex, position) in at_rest.iter().enumerate() {
            let cell = (*position / WELD_M).round().to_array().map(|x| x as i64);
            at_place.entry(cell).or_default().push(vertex);
        }
        let mut normals = vec![DVec3::ZERO; own.len()];
        for vertices in at_place.values() {
            for &vertex in vertices {
                let alone = own[vertex].normalize_or_zero();
                let alike = vertices.iter().map(|&other| own[other]);
                let sum: DVec3 = alike.filter(|other| other.normalize_or_zero().dot(alone) >= SMOOTH_COSINE).sum();
                let in_body = sum.try_normalize().unwrap_or(if alone == DVec3::ZERO { DVec3::Y } else { alone });
                let link_from_body = body.links[self.links[vertex]].body_from_link.inverse();
                normals[vertex] = link_from_body.transform_vector3(in_body).normalize_or(DVec3::Y);
            }
        }
        normals
    }
}

/// The radius of each taxel's disc, m: that of its area as far as it reaches no neighbour, or where the area is unknown a part of
/// the distance to the nearest other taxel of its link.
pub(super) fn disc_radii_m(taxels: &[Taxel]) -> Vec<f64> {
    let mut of_link: HashMap<usize, Vec<GeomWithData<[f64; 3], u32>>> = HashMap::new();
    for (index, taxel) in taxels.iter().enumerate() {
        let point = GeomWithData::new(taxel.position_in_link.to_array(), index as u32);
        of_link.entry(taxel.link).or_default().push(point);
    }
    let trees: HashMap<usize, RTree<_>> =
        of_link.into_iter().map(|(link, points)| (link, RTree::bulk_load(points))).collect();
    let radius = |(index, taxel): (usize, &Taxel)| {
        let near = trees[&taxel.link].nearest_neighbor_iter(taxel.position_in_link.to_array());
        let distances = near
            .filter(|other| other.data != index as u32)
            .map(|other| DVec3::from_array(*other.geom()).distance(taxel.position_in_link));
        // Taxels at the same place are one sensor to look at.
        let nearest = { distances }.find(|distance| *distance > 1e-9);
        let nearest = nearest.unwrap_or(f64::INFINITY);
        if taxel.area > 0.0 {
            return (taxel.area / std::f64::consts::PI).sqrt().min(MAX_RADIUS_SHARE * nearest);
        }
        (DEFAULT_RADIUS_SHARE * nearest).min(MAX_DEFAULT_RADIUS_M)
    };
    taxels.iter().enumerate().map(radius).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundled;

    #[test]
    fn the_mesh_is_the_bodys_surface_at_rest() {
        for name in bundled::BODIES {
            let body = Body::from_bytes(name, bundled::body(name).unwrap()).unwrap();
            let mesh = Mesh::new(&body);
            let triangles = body.triangles_at_rest();
            assert_eq!(mesh.triangles.len(), triangles.len());
            let at = |vertex: u32| {
                let vertex = vertex as usize;
                body.links[mesh.links[vertex]].body_from_link.transform_point3(mesh.positions[vertex])
            };
            let (mut agree, mut volume) = (0, 0.0);
            for (corners, (_, expected)) in mesh.triangles.iter().zip(&triangles) {
                let [a, b, c] = corners.map(at);
                assert!([a, b, c].iter().zip(expected).all(|(p, q)| p.distance(*q) < 1e-9), "{name}");
                volume += a.dot(b.cross(c)) / 6.0;
                let outward = (b - a).cross(c - a);
                let vertex = corners[0] as usize;
                let way = body.links[mesh.links[vertex]].body_from_link;
                agree += usize::from(way.transform_vector3(mesh.normals[vertex]).dot(outward) >= 0.0);
            }
            assert!(agree * 100 > triangles.len() * 98, "{name}: {agree} of {}", triangles.len());
            assert!(volume > 0.0, "{name}: seen from outside");
            assert!(mesh.normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-9));
        }
    }

    #[test]
    fn a_box_of_eight_vertices_has_flat_sides() {
        let corner = |i: usize| DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2 & 1) as f64);
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let mut mesh = Mesh {
            positions: (0..8).map(corner).collect(),
            normals: Vec::new(),
            links: vec![0; 8],
            triangles: sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        };
        mesh.split_at_edges();
        assert_eq!((mesh.positions.len(), mesh.links.len(), mesh.triangles.len()), (24, 24, 12));
        for (side, triangles) in sides.iter().zip(mesh.triangles.chunks(2)) {
            let own: std::collections::BTreeSet<u32> = triangles.iter().flatten().copied().collect();
            let places = own.iter().map(|&vertex| mesh.positions[vertex as usize]);
            assert!(own.len() == 4 && places.into_iter().all(|at| side.iter().any(|&i| corner(i as usize) == at)));
        }
        // What is smooth stays as it is.
        let mut flat = Mesh {
            positions: [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.3]]
                .map(DVec3::from_array)
                .to_vec(),
            normals: Vec::new(),
            links: vec![0; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        };
        flat.split_at_edges();
        assert_eq!((flat.positions.len(), flat.triangles), (4, vec![[0, 1, 2], [0, 2, 3]]));
    }

    #[test]
    fn a_disc_has_its_area_or_a_stated_default() {
        let taxel = |id, x: f64, area| Taxel {
            id,
            link: 0,
            position_in_link: DVec3::new(x, 0.0, 0.0),
            normal_in_link: DVec3::Y,
            area,
            modality: crate::body::Modality::Pressure,
            tangent_in_link: None,
        };
        let taxels =
            [taxel(0, 0.0, 1e-4), taxel(1, 0.010, 0.0), taxel(2, 0.014, 0.0), taxel(3, 1.0, 0.0), taxel(4, 1.0, 0.0)];
        let radii = disc_radii_m(&taxels);
        // The first one's area would reach over its neighbour, 10 mm away.
        let expected = [0.0047, 0.4 * 0.004, 0.4 * 0.004, 0.005, 0.005];
        assert!(radii.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{radii:?}");
        assert_eq!(disc_radii_m(&taxels[1..2]), [0.005]);
        assert_eq!(disc_radii_m(&taxels[..1]), [(1e-4 / std::f64::consts::PI).sqrt()]);
    }
}
