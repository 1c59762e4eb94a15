//! A body's surface in the frames of its links.

use std::collections::BTreeMap;
use std::rc::Rc;

use glam::{DAffine3, DVec3};

use super::geodesic::SurfacePlace;
use crate::body::{Body, Home, Surface, SurfaceIndex, Topology};

/// A taxel nearer to a surface than this is on it, m.
const ON_SURFACE_M: f64 = 1e-4;

/// A body's surface in the frames of its links, computed on demand.
pub struct Surfaces<'a> {
    body: &'a Body,
    in_links: BTreeMap<usize, Rc<LinkSurface>>,
}

impl<'a> Surfaces<'a> {
    pub fn new(body: &'a Body) -> Self {
        Self { body, in_links: BTreeMap::new() }
    }

    /// The surface of `link` in its frame, at rest: of the meshes that it carries alone or with others, if all of its taxels
    /// are on these, else of all. What other links carry moves on its own, and a robot has many links.
    pub fn in_link(&mut self, link: usize) -> Rc<LinkSurface> {
        let body = self.body;
        let own = || {
            let carries = |surface: &Surface| surface.is_carried_by(link);
            let own = LinkSurface::new(body, link, &carries);
            own.holds(body, link).then_some(own)
        };
        let made = || Rc::new(own().unwrap_or_else(|| LinkSurface::new(body, link, &|_| true)));
        self.in_links.entry(link).or_insert_with(made).clone()
    }
}

/// A surface with topology and search index over the same triangles.
pub struct LinkSurface {
    /// The triangles and their neighbours.
    pub topology: Topology,
    index: SurfaceIndex,
    /// Per surface of the body its index, the number of triangles before it, and whether it is mirrored.
    parts: Vec<(usize, usize, bool)>,
}

impl LinkSurface {
    /// The surfaces `chosen` of `body` at rest, in the frame of `link`: each vertex of a skinned one as its heaviest joint has it.
    pub fn at_rest(body: &Body, link: usize, chosen: &[usize]) -> Self {
        let (mut corners, mut parts) = (Vec::new(), Vec::new());
        for &index in chosen {
            let surface = &body.surfaces[index];
            let ways: Vec<DAffine3> = match &surface.home {
                Home::Rigid { link: carrier, link_from_mesh } => {
                    vec![body.rest_transform(link, *carrier) * *link_from_mesh]
                }
                Home::Skinned { joints, .. } => {
                    joints.iter().map(|&(joint, way)| body.rest_transform(link, joint) * way).collect()
                }
            };
            let way_of = |vertex: u32| match &surface.home {
                Home::Rigid { .. } => ways[0],
                Home::Skinned { heaviest, .. } => ways[heaviest[vertex as usize]],
            };
            let mirrored = ways[0].matrix3.determinant() < 0.0;
            parts.push((index, corners.len() / 3, mirrored));
            for &[a, b, c] in &surface.triangles {
                let turned = if mirrored { [a, c, b] } else { [a, b, c] };
                corners.extend(turned.map(|v| way_of(v).transform_point3(surface.positions[v as usize])));
            }
        }
        Self::of_corners(&corners, parts)
    }

    /// The surfaces of `body` that are `chosen`, in the frame of `link`.
    fn new(body: &Body, link: usize, chosen: &dyn Fn(&Surface) -> bool) -> Self {
        let seen = body.surfaces.iter().enumerate().filter(|(_, surface)| chosen(surface));
        let seen = seen.filter_map(|(i, surface)| Some((i, surface, surface.link_from_mesh(body, link)?)));
        let corners = seen.clone().flat_map(|(_, surface, link_from_mesh)| surface.corners_through(link_from_mesh));
        let corners: Vec<DVec3> = corners.flatten().collect();
        let mut before = 0;
        let parts = seen.map(|(i, surface, link_from_mesh)| {
            let first = before;
            before += surface.triangles.len();
            (i, first, link_from_mesh.matrix3.determinant() < 0.0)
        });
        Self::of_corners(&corners, parts.collect())
    }

    fn of_corners(corners: &[DVec3], parts: Vec<(usize, usize, bool)>) -> Self {
        let triangles: Vec<[u32; 3]> = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let topology = Topology::new(corners, &triangles);
        let index = SurfaceIndex::of_triangles((0..topology.triangles.len() as u32).map(|t| topology.corners(t)));
        Self { topology, index, parts }
    }

    /// Whether all taxels of `link` are on this surface.
    fn holds(&self, body: &Body, link: usize) -> bool {
        let is_near = |p: DVec3| self.index.nearest(p).is_some_and(|hit| hit.position.distance(p) <= ON_SURFACE_M);
        body.taxels.iter().filter(|taxel| taxel.link == link).all(|taxel| is_near(taxel.position_in_link))
    }

    /// The place of the point `p` with the outward `normal`: the nearest one, or one about as near with a similar normal, as
    /// on the other side of a sheet.
    pub fn locate(&self, p: DVec3, normal: DVec3) -> Option<SurfacePlace> {
        let nearest = self.index.nearest(p)?;
        let hit = match nearest.normal.dot(normal) >= 0.0 {
            true => nearest,
            false => {
                let reach = 2.0 * nearest.position.distance(p) + 1e-9;
                self.index.along(p, normal, reach).unwrap_or(nearest)
            }
        };
        Some(SurfacePlace::in_triangle(&self.topology, hit.triangle as u32, hit.position))
    }

    /// The triangles within `reach_m` of `p`, with their outward unit normals.
    pub fn within(&self, p: DVec3, reach_m: f64) -> impl Iterator<Item = (u32, DVec3)> + '_ {
        self.index.triangles_within(p, reach_m)
    }

    /// The place of the surface nearest to `p`.
    pub fn nearest(&self, p: DVec3) -> Option<SurfacePlace> {
        let hit = self.index.nearest(p)?;
        Some(SurfacePlace::in_triangle(&self.topology, hit.triangle as u32, hit.position))
    }

    /// The body's surface of `place`, the triangle's index there, and the weights of its corners in that surface's order.
    pub fn origin_of(&self, place: &SurfacePlace) -> (usize, usize, [f64; 3]) {
        let given = self.topology.given[place.triangle as usize] as usize;
        let part = self.parts.partition_point(|&(_, first, _)| first <= given) - 1;
        let (surface, first, mirrored) = self.parts[part];
        let [a, b, c] = place.barycentric;
        (surface, given - first, if mirrored { [a, c, b] } else { [a, b, c] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Glb, MeshData, Modality, Taxel};

    /// Two links with a triangle each, and a taxel below the first at the height `y`.
    fn two_links(y: f64) -> Body {
        let mut glb = Glb::new();
        let positions = vec![[0.0, 0.0, 0.0], [0.0, 0.0, 0.1], [0.1, 0.0, 0.0]];
        let mesh =
            MeshData { positions, normals: vec![[0.0, 1.0, 0.0]; 3], triangles: vec![[0, 1, 2]], skinning: None };
        let links = [("lower", 0.0), ("upper", 1.0)].map(|(name, y)| glb.node(name, None, DVec3::Y * y));
        links.iter().for_each(|&link| {
            glb.mesh(link, "plate", &mesh, None, None);
        });
        let position_in_link = DVec3::new(0.02, y, 0.02);
        let (normal_in_link, modality) = (DVec3::Y, Modality::Pressure);
        let taxel =
            Taxel { id: 0, link: 0, position_in_link, normal_in_link, area: 1e-5, modality, tangent_in_link: None };
        glb.taxels("taxels", Some(links[0]), &[taxel], None);
        Body::from_bytes("two", &glb.to_bytes().unwrap()).unwrap()
    }

    #[test]
    fn a_link_is_measured_on_its_own_meshes_unless_its_taxels_are_on_others() {
        for (y, triangles) in [(0.0, 1), (1.0, 2)] {
            let body = two_links(y);
            let surface = Surfaces::new(&body).in_link(body.taxels[0].link);
            assert_eq!(surface.topology.triangles.len(), triangles);
            let place = surface.locate(body.taxels[0].position_in_link, DVec3::Y).unwrap();
            assert_eq!(surface.origin_of(&place).0, triangles - 1);
        }
    }
}
