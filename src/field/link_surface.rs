//! A body's surface in the frames of its links.

use std::collections::BTreeMap;
use std::rc::Rc;

use glam::DVec3;

use super::geodesic::SurfacePlace;
use crate::body::{Body, SurfaceIndex, Topology};

/// A body's surface in the frames of its links, computed on demand.
pub(crate) struct Surfaces<'a> {
    body: &'a Body,
    in_links: BTreeMap<usize, Rc<LinkSurface>>,
}

impl<'a> Surfaces<'a> {
    pub(crate) fn new(body: &'a Body) -> Self {
        Self { body, in_links: BTreeMap::new() }
    }

    /// All of the body's surface in the frame of `link`, at rest.
    pub(crate) fn in_link(&mut self, link: usize) -> Rc<LinkSurface> {
        self.in_links.entry(link).or_insert_with(|| Rc::new(LinkSurface::new(self.body, link))).clone()
    }
}

/// A surface with topology and search index over the same triangles.
pub(crate) struct LinkSurface {
    pub(crate) topology: Topology,
    index: SurfaceIndex,
    /// Per surface of the body its index, the number of triangles before it, and whether it is mirrored.
    parts: Vec<(usize, usize, bool)>,
}

impl LinkSurface {
    fn new(body: &Body, link: usize) -> Self {
        let corners: Vec<DVec3> = body.triangles_in_link(link).flatten().collect();
        let triangles: Vec<[u32; 3]> = (0..corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
        let topology = Topology::new(&corners, &triangles);
        let index = SurfaceIndex::of_triangles((0..topology.triangles.len() as u32).map(|t| topology.corners(t)));
        let mut before = 0;
        let seen = body.surfaces.iter().enumerate();
        let seen = seen.filter_map(|(i, surface)| Some((i, surface, surface.link_from_mesh(body, link)?)));
        let parts = seen.map(|(i, surface, link_from_mesh)| {
            let first = before;
            before += surface.triangles.len();
            (i, first, link_from_mesh.matrix3.determinant() < 0.0)
        });
        let parts = parts.collect();
        Self { topology, index, parts }
    }

    /// The place of the point `p` with the outward `normal`: the nearest one, or one about as near with a similar normal, as
    /// on the other side of a sheet.
    pub(crate) fn locate(&self, p: DVec3, normal: DVec3) -> Option<SurfacePlace> {
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

    pub(crate) fn nearest(&self, p: DVec3) -> Option<SurfacePlace> {
        let hit = self.index.nearest(p)?;
        Some(SurfacePlace::in_triangle(&self.topology, hit.triangle as u32, hit.position))
    }

    /// The body's surface of `place`, the triangle's index there, and the weights of its corners in that surface's order.
    pub(crate) fn origin_of(&self, place: &SurfacePlace) -> (usize, usize, [f64; 3]) {
        let given = self.topology.given[place.triangle as usize] as usize;
        let part = self.parts.partition_point(|&(_, first, _)| first <= given) - 1;
        let (surface, first, mirrored) = self.parts[part];
        let [a, b, c] = place.barycentric;
        (surface, given - first, if mirrored { [a, c, b] } else { [a, b, c] })
    }
}
