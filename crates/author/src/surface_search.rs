//! Searches a body's surface at rest, as seen from each of its links.

use glam::{DAffine3, DVec3};

use crate::body::{Body, Hit, Home, Surface, SurfaceIndex};

/// Transforms of a skinned mesh to the body are equal up to this difference, m: the rounding of inverse bind matrices.
const SAME_TRANSFORM: f64 = 2e-7;

/// Maximum distance of a taxel on the surface, beside rounding to single precision, m; see `docs/reference/layout.md`.
const ON_SURFACE_M: f64 = 1e-6;

/// Relative error of two roundings to single precision, as in the welding of `Topology`.
const ROUNDING: f64 = 1.0 / (1 << 22) as f64;

/// Search indices of a body's surfaces in the body at rest. A skinned mesh is transformed by the joint of the link that
/// searches, at bind.
pub(super) struct SurfaceSearch<'a> {
    body: &'a Body,
    rigid: SurfaceIndex,
    /// Per skinned surface its transforms to the body, each with a search index.
    skinned: Vec<(&'a Surface, Vec<(DAffine3, SurfaceIndex)>)>,
    /// Maximum distance of a point that is on the surface, m.
    tolerance_m: f64,
}

impl<'a> SurfaceSearch<'a> {
    pub(super) fn from_body(body: &'a Body) -> Self {
        let (mut rigid, mut skinned, mut largest) = (Vec::new(), Vec::new(), 0.0_f64);
        for surface in &body.surfaces {
            // Coordinates are rounded in the mesh and in the taxels' node.
            let mut measure = |way: DAffine3| {
                let far = surface.positions.iter().map(|&p| way.transform_point3(p).abs().max_element());
                largest = far.fold(largest, f64::max);
            };
            match &surface.home {
                Home::Rigid { link, link_from_mesh } => {
                    measure(*link_from_mesh);
                    rigid.extend(surface.corners_through(body.links[*link].body_from_link * *link_from_mesh));
                }
                Home::Skinned { joints, .. } => {
                    joints.iter().for_each(|&(_, way)| measure(way));
                    skinned.push((surface, Vec::new()));
                }
            }
        }
        let tolerance_m = ON_SURFACE_M + ROUNDING * largest;
        let mut surface_search = Self { body, rigid: SurfaceIndex::of_triangles(rigid), skinned, tolerance_m };
        for link in 0..body.links.len() {
            if body.taxels.iter().any(|taxel| taxel.link == link) {
                surface_search.add_link(link);
            }
        }
        surface_search
    }

    fn add_link(&mut self, link: usize) {
        for (surface, ways) in &mut self.skinned {
            let Some(way) = body_from_skinned(self.body, surface, link) else { continue };
            if !ways.iter().any(|(known, _)| known.abs_diff_eq(way, SAME_TRANSFORM)) {
                ways.push((way, SurfaceIndex::of_triangles(surface.corners_through(way))));
            }
        }
    }

    /// The search indices for `link`.
    fn seen_from(&self, link: usize) -> impl Iterator<Item = &SurfaceIndex> {
        let skinned = self.skinned.iter().filter_map(move |(surface, ways)| {
            let way = body_from_skinned(self.body, surface, link)?;
            ways.iter().find(|(known, _)| known.abs_diff_eq(way, SAME_TRANSFORM)).map(|(_, index)| index)
        });
        std::iter::once(&self.rigid).chain(skinned).filter(|index| !index.is_empty())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.body.surfaces.is_empty()
    }

    /// Maximum distance of a point that is on the surface, m.
    pub(super) fn tolerance_m(&self) -> f64 {
        self.tolerance_m
    }

    /// The surface point nearest to `p`, both in the body, as `link` sees it.
    pub(super) fn nearest(&self, link: usize, p: DVec3) -> Option<Hit> {
        let hits = self.seen_from(link).filter_map(|index| index.nearest(p));
        hits.min_by(|a, b| a.position.distance_squared(p).total_cmp(&b.position.distance_squared(p)))
    }

    /// The outward normals of the triangles at the surface point `p`, in the body, as `link` sees it.
    pub(super) fn normals_at(&self, link: usize, p: DVec3) -> impl Iterator<Item = DVec3> {
        self.seen_from(link).flat_map(move |index| index.normals_within(p, self.tolerance_m))
    }
}

/// The transform of a skinned mesh to the body at rest, by the joint of `link`, else by its first joint.
fn body_from_skinned(body: &Body, surface: &Surface, link: usize) -> Option<DAffine3> {
    let Home::Skinned { joints, .. } = &surface.home else { return None };
    let own = joints.iter().find(|(joint, _)| *joint == link).or(joints.first());
    own.map(|&(joint, link_from_mesh)| body.links[joint].body_from_link * link_from_mesh)
}
