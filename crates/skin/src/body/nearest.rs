//! The surface around places of a body, in the frames of its links: for many fields, without a search index of all for each.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use glam::{DAffine3, DVec3};
use rstar::primitives::{CachedEnvelope, GeomWithData};
use rstar::{AABB, RTree};

use super::model::Body;
use super::surface::{Hit, Line, SurfaceIndex, Triangle};

/// Searches in one link's frame before search indices of surfaces are made there, which takes as long.
const SEARCHES_WITHOUT_INDEX: u32 = 16;

/// Triangles as the mesh has them, with their numbers and whether the link's frame mirrors them.
type TriangleTree = RTree<GeomWithData<CachedEnvelope<Triangle>, (u32, bool)>>;

/// The number of searches in a link's frame, and per surface its search index there, if it was needed.
type Searched = (u32, HashMap<usize, Rc<TriangleTree>>);

/// Finds the nearest points of a body's surface in any link's frame. The results do not depend on whether an index is there.
#[derive(Debug)]
pub struct Nearest<'a> {
    body: &'a Body,
    /// Per surface its longest edge, in mesh coordinates.
    longest: Vec<f64>,
    /// Per surface its lowest and highest coordinates, in its mesh.
    bounds: Vec<[DVec3; 2]>,
    /// Per link.
    indices: RefCell<HashMap<usize, Searched>>,
}

impl<'a> Nearest<'a> {
    /// Of the surfaces of `body`.
    pub fn new(body: &'a Body) -> Self {
        let edges = |&[a, b, c]: &[u32; 3]| [(a, b), (b, c), (c, a)];
        let longest = body.surfaces.iter().map(|surface| {
            let at = |vertex: u32| surface.positions[vertex as usize];
            let lengths = surface.triangles.iter().flat_map(edges).map(|(a, b)| at(a).distance_squared(at(b)));
            lengths.fold(0.0, f64::max).sqrt()
        });
        let bounds = body.surfaces.iter().map(|surface| {
            let ends = [DVec3::INFINITY, DVec3::NEG_INFINITY];
            surface.positions.iter().fold(ends, |[low, high], &p| [low.min(p), high.max(p)])
        });
        Self { body, longest: longest.collect(), bounds: bounds.collect(), indices: RefCell::default() }
    }

    /// The body.
    pub fn body(&self) -> &'a Body {
        self.body
    }

    /// A lower bound of the distance from `p` to surface `surface`, m.
    fn bound(&self, surface: usize, link_from_mesh: &DAffine3, p: DVec3) -> f64 {
        let [low, high] = self.bounds[surface];
        if !(low.cmple(high).all() && low.is_finite() && high.is_finite()) {
            return 0.0;
        }
        let corner = |k: u32| {
            let side = |axis: u32, low: f64, high: f64| if k >> axis & 1 == 0 { low } else { high };
            let corner = DVec3::new(side(0, low.x, high.x), side(1, low.y, high.y), side(2, low.z, high.z));
            link_from_mesh.transform_point3(corner)
        };
        let ends = (0..8).map(corner).fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        // Less what rounding may add.
        p.distance(p.clamp(ends.0, ends.1)) * (1.0 - 1e-9)
            - 1e-9 * (p.abs() + ends.0.abs() + ends.1.abs()).max_element()
    }

    /// The surface within about `radius` of `centre`, m, in the frame of `link`.
    pub fn around(&self, link: usize, centre: DVec3, radius: f64) -> SurfaceIndex {
        if self.has_trees(link) {
            let reach = DVec3::splat(radius * (1.0 + 1e-9) + f64::MIN_POSITIVE);
            let ends = AABB::from_corners((centre - reach).to_array(), (centre + reach).to_array());
            let trees = self.trees_near(link, centre, radius);
            let close = trees.iter().flat_map(|tree| tree.locate_in_envelope_intersecting(ends)).map(numbered);
            let mut near: Vec<(u32, Triangle)> =
                close.filter(|(_, t)| t.box_distance_squared(centre) <= radius * radius).collect();
            near.sort_unstable_by_key(|(number, _)| *number);
            return SurfaceIndex::new(near.into_iter().map(|(_, triangle)| triangle).collect());
        }
        let mut near = Vec::new();
        for (index, (surface, longest)) in self.body.surfaces.iter().zip(&self.longest).enumerate() {
            let Some(link_from_mesh) = surface.link_from_mesh(self.body, link) else { continue };
            if self.bound(index, &link_from_mesh, centre) > radius {
                continue;
            }
            // One corner excludes most triangles.
            let within = (radius + slack(&link_from_mesh, *longest)).powi(2);
            let close = surface.corners_through(link_from_mesh);
            let close = close.filter(|[a, ..]| a.distance_squared(centre) <= within).map(Triangle);
            near.extend(close.filter(|t| t.box_distance_squared(centre) <= radius * radius));
        }
        SurfaceIndex::new(near)
    }

    /// The same, to be pierced by lines.
    pub fn near(&self, link: usize, centre: DVec3, radius: f64) -> Near {
        match self.has_trees(link) {
            true => Near::Trees { trees: self.trees_near(link, centre, radius), centre, radius },
            false => Near::Index(self.around(link, centre, radius)),
        }
    }

    /// The surface point nearest to `p`, in the frame of `link`; of several, that of the first triangle.
    pub fn in_link(&self, link: usize, p: DVec3) -> Option<DVec3> {
        if !self.has_trees(link) {
            return self.in_link_one_by_one(link, p);
        }
        let mut nearest: Option<(f64, u32, DVec3)> = None;
        for (bound, surface) in self.by_bound(link, p) {
            if nearest.is_some_and(|(least, ..)| bound * bound > least) {
                break;
            }
            let tree = self.tree(link, surface)?;
            let Some(near) = tree.nearest_neighbor(p.to_array()) else { continue };
            let least = p.distance_squared(near.geom().nearest(p));
            // Beyond the rounding of boxes and distances.
            let within = tree.locate_within_distance(p.to_array(), least * (1.0 + 1e-9) + f64::MIN_POSITIVE);
            let points = within.map(|triangle| (triangle.geom().nearest(p), triangle.data.0));
            let points = points.map(|(point, number)| (p.distance_squared(point), number, point));
            nearest = nearest.into_iter().chain(points).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        }
        nearest.map(|(.., point)| point)
    }

    /// The surfaces in the frame of `link`, each with a lower bound of its distance from `p`, m; the least first.
    fn by_bound(&self, link: usize, p: DVec3) -> Vec<(f64, usize)> {
        let placed = self.body.surfaces.iter().enumerate();
        let placed = placed.filter_map(|(i, surface)| Some((i, surface.link_from_mesh(self.body, link)?)));
        let mut placed: Vec<(f64, usize)> = placed.map(|(i, way)| (self.bound(i, &way, p), i)).collect();
        placed.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        placed
    }

    /// Whether surfaces have search indices in the frame of `link`: from a number of searches on.
    fn has_trees(&self, link: usize) -> bool {
        let mut indices = self.indices.borrow_mut();
        let (searches, _) = indices.entry(link).or_default();
        *searches += 1;
        *searches > SEARCHES_WITHOUT_INDEX
    }

    /// The search indices of the surfaces that may be within `radius` of `centre`.
    fn trees_near(&self, link: usize, centre: DVec3, radius: f64) -> Vec<Rc<TriangleTree>> {
        let near = self.by_bound(link, centre).into_iter().take_while(|(bound, _)| *bound <= radius);
        near.filter_map(|(_, surface)| self.tree(link, surface)).collect()
    }

    /// The search index of a surface in the frame of `link`; its triangles are numbered among those of all surfaces.
    fn tree(&self, link: usize, index: usize) -> Option<Rc<TriangleTree>> {
        if let Some(tree) = self.indices.borrow().get(&link).and_then(|(_, trees)| trees.get(&index)) {
            return Some(tree.clone());
        }
        let surface = &self.body.surfaces[index];
        let link_from_mesh = surface.link_from_mesh(self.body, link)?;
        let before: usize = self.body.surfaces[..index].iter().map(|surface| surface.triangles.len()).sum();
        let at = |v: u32| link_from_mesh.transform_point3(surface.positions[v as usize]);
        let mirrored = link_from_mesh.matrix3.determinant() < 0.0;
        let triangles = surface.triangles.iter().map(|&[a, b, c]| Triangle([at(a), at(b), at(c)]));
        let numbered = triangles.zip(before as u32..).filter(|(triangle, _)| triangle.unit_normal().is_some());
        let numbered =
            numbered.map(|(triangle, number)| GeomWithData::new(CachedEnvelope::new(triangle), (number, mirrored)));
        let tree = Rc::new(RTree::bulk_load(numbered.collect()));
        self.indices.borrow_mut().entry(link).or_default().1.insert(index, tree.clone());
        Some(tree)
    }

    fn in_link_one_by_one(&self, link: usize, p: DVec3) -> Option<DVec3> {
        let (mut nearest, mut least) = (None, f64::INFINITY);
        let mut of_surface = 0;
        for (bound, index) in self.by_bound(link, p) {
            if bound > 0.0 && bound * bound > least {
                break;
            }
            let (surface, longest) = (&self.body.surfaces[index], &self.longest[index]);
            let Some(link_from_mesh) = surface.link_from_mesh(self.body, link) else { continue };
            let slack = slack(&link_from_mesh, *longest);
            let points: Vec<DVec3> = surface.positions.iter().map(|&p| link_from_mesh.transform_point3(p)).collect();
            let mut within: f64 = (least.sqrt() + slack).powi(2);
            for &[a, b, c] in &surface.triangles {
                let corner = points[a as usize];
                if corner.distance_squared(p) > within {
                    continue;
                }
                let triangle = Triangle([corner, points[b as usize], points[c as usize]]);
                if triangle.unit_normal().is_some() {
                    let point = triangle.nearest(p);
                    let distance = p.distance_squared(point);
                    // Of equals that of the first surface.
                    if distance < least || (distance == least && index < of_surface) {
                        (nearest, least, of_surface) = (Some(point), distance, index);
                        within = (least.sqrt() + slack).powi(2);
                    }
                }
            }
        }
        nearest
    }
}

/// Upper bound of the distance from a corner to the nearest point of its triangle's bounding box, for edges up to
/// `longest` in the mesh.
fn slack(link_from_mesh: &DAffine3, longest: f64) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|axis| link_from_mesh.matrix3.col(axis).length_squared());
    (x + y + z).sqrt() * longest * 3.0_f64.sqrt() * (1.0 + 1e-9)
}

/// The surface around a place, to be pierced by lines.
pub enum Near {
    /// Search indices of whole surfaces; only what is within `radius` of `centre` counts.
    Trees {
        /// The indices.
        trees: Vec<Rc<TriangleTree>>,
        /// The place, in the link.
        centre: DVec3,
        /// m.
        radius: f64,
    },
    /// One of the surface around the place.
    Index(SurfaceIndex),
}

impl Near {
    /// As [`SurfaceIndex::along`].
    pub fn along(&self, p: DVec3, direction: DVec3, reach: f64) -> Option<Hit> {
        match self {
            Self::Index(index) => index.along(p, direction, reach),
            Self::Trees { trees, centre, radius } => {
                let line = Line { p, direction, reach };
                let close = trees.iter().flat_map(|tree| tree.locate_with_selection_function(line)).map(numbered);
                let close = close.filter(|(_, t)| t.box_distance_squared(*centre) <= radius * radius);
                line.first(close.filter_map(|(number, triangle)| Some((triangle, triangle.unit_normal()?, number))))
            }
        }
    }
}

/// A triangle of a tree with its number, counter-clockwise seen from outside.
fn numbered(triangle: &GeomWithData<CachedEnvelope<Triangle>, (u32, bool)>) -> (u32, Triangle) {
    let ((number, mirrored), Triangle([a, b, c])) = (triangle.data, **triangle.geom());
    (number, Triangle(if mirrored { [a, c, b] } else { [a, b, c] }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use somatic_bodies as bundled;

    #[test]
    fn with_an_index_the_nearest_point_is_the_same_to_the_bit() {
        for bytes in [bundled::HAND, bundled::HUMANOID] {
            let body = Body::from_bytes("a.glb", bytes).unwrap();
            let nearest = Nearest::new(&body);
            let (mut compared, mut pierced_some) = (0, false);
            for link in 0..body.links.len() {
                // Corners and middles of edges are equally near to several triangles.
                let triangles: Vec<[DVec3; 3]> = body.triangles_in_link(link).step_by(37).take(20).collect();
                let places = triangles.iter().flat_map(|&[a, b, c]| {
                    let normal = (b - a).cross(c - a).normalize_or(DVec3::Z);
                    [a, (a + b) / 2.0, (a + b + c) / 3.0, c * 1.1].map(|p| (p, normal))
                });
                for (p, normal) in places {
                    let one_by_one = nearest.in_link_one_by_one(link, p);
                    assert_eq!(nearest.in_link(link, p), one_by_one, "{p} in link {link}");
                    let (radius, fresh) = (0.01, Nearest::new(&body));
                    let around =
                        |nearest: &Nearest<'_>| nearest.around(link, p, radius).nearest(p + DVec3::splat(1e-3));
                    assert_eq!(around(&nearest), around(&fresh), "around {p} in link {link}");
                    let (from, way) = (p + DVec3::splat(1e-4), normal);
                    let pierced = |nearest: &Nearest<'_>| {
                        let hit = nearest.near(link, p, radius).along(from, way, radius)?;
                        Some((hit.position, hit.normal))
                    };
                    assert_eq!(pierced(&nearest), pierced(&fresh), "through {p} in link {link}");
                    pierced_some |= pierced(&nearest).is_some();
                    compared += usize::from(!nearest.indices.borrow()[&link].1.is_empty());
                }
            }
            assert!(compared > 100 && pierced_some, "{compared} with an index");
        }
    }
}
