//! A body's surface as charts and groups need it, link by link.

use std::collections::BTreeMap;
use std::rc::Rc;

use glam::DVec3;

use super::geodesic::Place;
use crate::body::{Body, SurfaceIndex, Topology};

/// A body's surface in the frames of its links, each taken up when it is first asked for.
pub(crate) struct Surfaces<'a> {
    body: &'a Body,
    in_links: BTreeMap<usize, Rc<Skin>>,
}

impl<'a> Surfaces<'a> {
    pub(crate) fn new(body: &'a Body) -> Self {
        Self { body, in_links: BTreeMap::new() }
    }

    /// All of the body's surface in the frame of `link`, at rest.
    pub(crate) fn in_link(&mut self, link: usize) -> Rc<Skin> {
        self.in_links.entry(link).or_insert_with(|| Rc::new(Skin::new(self.body, link))).clone()
    }
}

/// A surface with known neighbours that can be searched; both count the same triangles.
pub(crate) struct Skin {
    pub(crate) topology: Topology,
    index: SurfaceIndex,
    /// Per surface of the body that is seen: its index, how many triangles come before it, whether it is mirrored.
    parts: Vec<(usize, usize, bool)>,
}

impl Skin {
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

    /// Where on the surface the point `p` with the outward `normal` is: at the nearest place, or where a place about as
    /// near looks the same way, as on the two sides of a sheet, at that one.
    pub(crate) fn locate(&self, p: DVec3, normal: DVec3) -> Option<Place> {
        let nearest = self.index.nearest(p)?;
        let hit = match nearest.normal.dot(normal) >= 0.0 {
            true => nearest,
            false => {
                let reach = 2.0 * nearest.position.distance(p) + 1e-9;
                self.index.along(p, normal, reach).unwrap_or(nearest)
            }
        };
        Some(Place::in_triangle(&self.topology, hit.triangle as u32, hit.position))
    }

    /// The place nearest to `p`.
    pub(crate) fn nearest(&self, p: DVec3) -> Option<Place> {
        let hit = self.index.nearest(p)?;
        Some(Place::in_triangle(&self.topology, hit.triangle as u32, hit.position))
    }

    /// The body's surface that `place` is on, the triangle among that surface's own, and the weights of its corners in
    /// the surface's order.
    pub(crate) fn origin_of(&self, place: &Place) -> (usize, usize, [f64; 3]) {
        let given = self.topology.given[place.triangle as usize] as usize;
        let part = self.parts.partition_point(|&(_, first, _)| first <= given) - 1;
        let (surface, first, mirrored) = self.parts[part];
        let [a, b, c] = place.barycentric;
        (surface, given - first, if mirrored { [a, c, b] } else { [a, b, c] })
    }
}
