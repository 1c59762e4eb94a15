//! A body's triangles, with nearest-point and ray queries.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use glam::{DAffine3, DVec3};
use rstar::primitives::{CachedEnvelope, GeomWithData};
use rstar::{AABB, PointDistance, RTree, RTreeObject};

use super::model::{Body, Home};

impl Body {
    /// A search index of the surface in the frame of `link`.
    #[must_use]
    pub fn surface_in_link(&self, link: usize) -> SurfaceIndex {
        SurfaceIndex::of_triangles(self.triangles_in_link(link))
    }

    /// The corners of all triangles in the frame of `link`, each counter-clockwise seen from outside.
    pub fn triangles_in_link(&self, link: usize) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        let seen = self.surfaces.iter().filter_map(move |surface| Some((surface, surface.link_from_mesh(self, link)?)));
        seen.flat_map(|(surface, link_from_mesh)| surface.corners_through(link_from_mesh))
    }

    /// All triangles in the body at rest, counter-clockwise seen from outside, each with its link. Corners of a skinned one
    /// are transformed by the joint with the largest weight.
    #[must_use]
    pub fn triangles_at_rest(&self) -> Vec<(usize, [DVec3; 3])> {
        let mut triangles = Vec::new();
        for surface in &self.surfaces {
            match &surface.home {
                Home::Rigid { link, link_from_mesh } => {
                    let body_from_mesh = self.links[*link].body_from_link * *link_from_mesh;
                    triangles.extend(surface.corners_through(body_from_mesh).map(|corners| (*link, corners)));
                }
                Home::Skinned { joints, heaviest } => {
                    let way = |&(link, way): &(usize, DAffine3)| (link, self.links[link].body_from_link * way);
                    let ways: Vec<(usize, DAffine3)> = joints.iter().map(way).collect();
                    let mirrored = ways.first().is_some_and(|(_, way)| way.matrix3.determinant() < 0.0);
                    let of = |v: u32| ways[heaviest[v as usize]];
                    let at = |v: u32| of(v).1.transform_point3(surface.positions[v as usize]);
                    triangles.extend(surface.triangles.iter().map(|&[a, b, c]| {
                        let [a, b, c] = if mirrored { [a, c, b] } else { [a, b, c] };
                        (of(a).0, [at(a), at(b), at(c)])
                    }));
                }
            }
        }
        triangles
    }
}

/// Searches for nearest points in one link's frame before a search index of its triangles is made: that takes as long.
const SEARCHES_WITHOUT_INDEX: u32 = 16;

/// Triangles as the mesh has them, with their numbers and whether the link's frame mirrors them.
type TriangleTree = RTree<GeomWithData<CachedEnvelope<Triangle>, (u32, bool)>>;

/// The number of searches in a link's frame, and the index if there is one.
type Searched = (u32, Option<Rc<TriangleTree>>);

/// Finds the nearest points of a body's surface in any link's frame. The results do not depend on whether an index is there.
#[derive(Debug)]
pub(crate) struct Nearest<'a> {
    body: &'a Body,
    /// Per surface its longest edge, in mesh coordinates.
    longest: Vec<f64>,
    /// Per surface its lowest and highest coordinates, in its mesh.
    bounds: Vec<[DVec3; 2]>,
    /// Per link.
    indices: RefCell<HashMap<usize, Searched>>,
}

impl<'a> Nearest<'a> {
    pub(crate) fn new(body: &'a Body) -> Self {
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

    pub(crate) fn body(&self) -> &'a Body {
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
    pub(crate) fn around(&self, link: usize, centre: DVec3, radius: f64) -> SurfaceIndex {
        if let Some(index) = self.index(link) {
            let reach = DVec3::splat(radius * (1.0 + 1e-9) + f64::MIN_POSITIVE);
            let ends = AABB::from_corners((centre - reach).to_array(), (centre + reach).to_array());
            let close = index.locate_in_envelope_intersecting(ends).map(|triangle| (triangle.data, **triangle.geom()));
            let close = close.map(|((number, mirrored), Triangle([a, b, c]))| {
                (number, Triangle(if mirrored { [a, c, b] } else { [a, b, c] }))
            });
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

    /// The surface point nearest to `p`, in the frame of `link`; of several, that of the first triangle.
    pub(crate) fn in_link(&self, link: usize, p: DVec3) -> Option<DVec3> {
        match self.index(link) {
            Some(index) => {
                let near = index.nearest_neighbor(p.to_array())?;
                let least = p.distance_squared(near.geom().nearest(p));
                // Beyond the rounding of boxes and distances.
                let within = index.locate_within_distance(p.to_array(), least * (1.0 + 1e-9) + f64::MIN_POSITIVE);
                let points = within.map(|triangle| (triangle.geom().nearest(p), triangle.data.0));
                let nearest = points
                    .map(|(point, number)| (p.distance_squared(point), number, point))
                    .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                nearest.map(|(.., point)| point)
            }
            None => self.in_link_one_by_one(link, p),
        }
    }

    /// The search index of `link`, from a number of searches on.
    fn index(&self, link: usize) -> Option<Rc<TriangleTree>> {
        let mut indices = self.indices.borrow_mut();
        let (searches, index) = indices.entry(link).or_default();
        *searches += 1;
        if *searches > SEARCHES_WITHOUT_INDEX && index.is_none() {
            let seen = self.body.surfaces.iter();
            let seen = seen.filter_map(|surface| Some((surface, surface.link_from_mesh(self.body, link)?)));
            let triangles = seen.flat_map(|(surface, link_from_mesh)| {
                let at = move |v: u32| link_from_mesh.transform_point3(surface.positions[v as usize]);
                let mirrored = link_from_mesh.matrix3.determinant() < 0.0;
                surface.triangles.iter().map(move |&[a, b, c]| (Triangle([at(a), at(b), at(c)]), mirrored))
            });
            let numbered = triangles.zip(0..).filter(|((triangle, _), _)| triangle.unit_normal().is_some());
            let numbered = numbered.map(|((triangle, mirrored), number)| {
                GeomWithData::new(CachedEnvelope::new(triangle), (number, mirrored))
            });
            *index = Some(Rc::new(RTree::bulk_load(numbered.collect())));
        }
        index.clone()
    }

    fn in_link_one_by_one(&self, link: usize, p: DVec3) -> Option<DVec3> {
        let (mut nearest, mut least) = (None, f64::INFINITY);
        let placed = self.body.surfaces.iter().enumerate();
        let placed = placed.filter_map(|(i, surface)| Some((i, surface, surface.link_from_mesh(self.body, link)?)));
        let mut placed: Vec<_> = placed.map(|(i, surface, way)| (self.bound(i, &way, p), i, surface, way)).collect();
        placed.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut of_surface = 0;
        for (bound, index, surface, link_from_mesh) in placed {
            if bound > 0.0 && bound * bound > least {
                break;
            }
            let longest = &self.longest[index];
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

/// The outward normal of a triangle, of twice its area.
pub(crate) fn area_vector([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// The point of a triangle that is nearest to `p`.
pub(crate) fn nearest_on_triangle(corners: [DVec3; 3], p: DVec3) -> DVec3 {
    Triangle(corners).nearest(p)
}

/// Three corners, counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug)]
struct Triangle([DVec3; 3]);

impl Triangle {
    /// The outward normal; `None` for a triangle without area.
    fn unit_normal(&self) -> Option<DVec3> {
        area_vector(self.0).try_normalize()
    }

    /// Squared distance of `p` from the bounding box: a lower bound for the triangle.
    fn box_distance_squared(&self, p: DVec3) -> f64 {
        let [a, b, c] = self.0;
        p.distance_squared(p.clamp(a.min(b).min(c), a.max(b).max(c)))
    }

    /// The point of the triangle that is nearest to `p` (Ericson, Real-Time Collision Detection, 5.1.5).
    fn nearest(&self, p: DVec3) -> DVec3 {
        let [a, b, c] = self.0;
        let (ab, ac, ap) = (b - a, c - a, p - a);
        let (d1, d2) = (ab.dot(ap), ac.dot(ap));
        if d1 <= 0.0 && d2 <= 0.0 {
            return a;
        }
        let bp = p - b;
        let (d3, d4) = (ab.dot(bp), ac.dot(bp));
        if d3 >= 0.0 && d4 <= d3 {
            return b;
        }
        let vc = d1 * d4 - d3 * d2;
        if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
            return a + ab * (d1 / (d1 - d3));
        }
        let cp = p - c;
        let (d5, d6) = (ab.dot(cp), ac.dot(cp));
        if d6 >= 0.0 && d5 <= d6 {
            return c;
        }
        let vb = d5 * d2 - d1 * d6;
        if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
            return a + ac * (d2 / (d2 - d6));
        }
        let va = d3 * d6 - d5 * d4;
        if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
            return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
        }
        let scale = 1.0 / (va + vb + vc);
        a + ab * (vb * scale) + ac * (vc * scale)
    }

    /// The intersection of the line `origin + t·direction` with the triangle, as t (Möller and Trumbore).
    fn pierced(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let [a, b, c] = self.0;
        let (ab, ac) = (b - a, c - a);
        let across = direction.cross(ac);
        let determinant = ab.dot(across);
        // Nearly parallel to the triangle.
        if determinant.abs() <= 1e-12 * ab.length() * ac.length() * direction.length() {
            return None;
        }
        let from_a = origin - a;
        let beta = from_a.dot(across) / determinant;
        let turned = from_a.cross(ab);
        let gamma = direction.dot(turned) / determinant;
        // A tolerance, so that a ray along a shared edge hits one of the triangles.
        let inside = beta >= -1e-9 && gamma >= -1e-9 && beta + gamma <= 1.0 + 1e-9;
        inside.then(|| ac.dot(turned) / determinant)
    }
}

impl RTreeObject for Triangle {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        AABB::from_points(&self.0.map(|p| p.to_array()))
    }
}

impl PointDistance for Triangle {
    fn distance_2(&self, point: &[f64; 3]) -> f64 {
        let p = DVec3::from_array(*point);
        p.distance_squared(self.nearest(p))
    }
}

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Position in the frame of the index.
    pub position: DVec3,
    /// The outward unit normal of the triangle there.
    pub normal: DVec3,
    /// Index of the triangle among those given.
    pub triangle: usize,
}

/// A search index of triangles in one frame.
#[derive(Debug)]
pub struct SurfaceIndex {
    /// Triangles with their outward unit normals and indices.
    tree: RTree<GeomWithData<CachedEnvelope<Triangle>, (DVec3, u32)>>,
}

impl SurfaceIndex {
    fn new(triangles: Vec<Triangle>) -> Self {
        let triangles = triangles
            .into_iter()
            .zip(0..)
            .filter_map(|(triangle, number)| {
                Some(GeomWithData::new(CachedEnvelope::new(triangle), (triangle.unit_normal()?, number)))
            })
            .collect();
        Self { tree: RTree::bulk_load(triangles) }
    }

    /// A search index of `triangles`, given by corners; those without area are left out.
    #[must_use]
    pub fn of_triangles(triangles: impl IntoIterator<Item = [DVec3; 3]>) -> Self {
        Self::new(triangles.into_iter().map(Triangle).collect())
    }

    /// Whether there is no surface at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.tree.size() == 0
    }

    /// The surface point nearest to `p`.
    #[must_use]
    pub fn nearest(&self, p: DVec3) -> Option<Hit> {
        let triangle = self.tree.nearest_neighbor(p.to_array())?;
        let (normal, number) = triangle.data;
        Some(Hit { position: triangle.geom().nearest(p), normal, triangle: number as usize })
    }

    /// The surface point nearest to `p` of the triangles whose outward unit normal `fits`.
    pub(crate) fn nearest_where(&self, p: DVec3, fits: impl Fn(DVec3) -> bool) -> Option<Hit> {
        let triangle = self.tree.nearest_neighbor_iter(p.to_array()).find(|triangle| fits(triangle.data.0))?;
        let (normal, number) = triangle.data;
        Some(Hit { position: triangle.geom().nearest(p), normal, triangle: number as usize })
    }

    /// The triangles within `within_m` of `p`, in any order.
    pub(crate) fn within(&self, p: DVec3, within_m: f64) -> impl Iterator<Item = usize> + '_ {
        let near = self.tree.locate_within_distance(p.to_array(), within_m * within_m);
        near.map(|triangle| triangle.data.1 as usize)
    }

    /// The mean outward unit normal of the triangles within `within_m` of `p`.
    #[must_use]
    pub fn normal_around(&self, p: DVec3, within_m: f64) -> Option<DVec3> {
        self.normals_within(p, within_m).sum::<DVec3>().try_normalize()
    }

    /// The outward unit normals of the triangles within `within_m` of `p`: on an edge, of both sides.
    pub fn normals_within(&self, p: DVec3, within_m: f64) -> impl Iterator<Item = DVec3> + '_ {
        self.triangles_within(p, within_m).map(|(_, normal)| normal)
    }

    /// The triangles within `within_m` of `p`, with their outward unit normals.
    pub(crate) fn triangles_within(&self, p: DVec3, within_m: f64) -> impl Iterator<Item = (u32, DVec3)> + '_ {
        let near = self.tree.locate_within_distance(p.to_array(), within_m * within_m);
        near.map(|triangle| (triangle.data.1, triangle.data.0))
    }

    /// The intersection nearest to `p` of the surface and the line through `p` along the unit vector `direction`, within
    /// `reach` of `p` and with an outward normal along `direction`.
    #[must_use]
    pub fn along(&self, p: DVec3, direction: DVec3, reach: f64) -> Option<Hit> {
        let ends = AABB::from_corners((p - direction * reach).to_array(), (p + direction * reach).to_array());
        self.tree
            .locate_in_envelope_intersecting(ends)
            .filter(|triangle| triangle.data.0.dot(direction) > 0.0)
            .filter_map(|triangle| Some((triangle.geom().pierced(p, direction)?, triangle.data)))
            .filter(|(t, _)| t.abs() <= reach)
            .min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()))
            .map(|(t, (normal, number))| Hit { position: p + direction * t, normal, triangle: number as usize })
    }
}

/// A search tree of numbered points.
pub(crate) type PointTree = RTree<GeomWithData<[f64; 3], usize>>;

/// The tree of `points`, numbered from 0.
pub(crate) fn point_tree(points: impl IntoIterator<Item = DVec3>) -> PointTree {
    let numbered = points.into_iter().enumerate();
    RTree::bulk_load(numbered.map(|(index, p)| GeomWithData::new(p.to_array(), index)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundled;

    #[test]
    fn with_an_index_the_nearest_point_is_the_same_to_the_bit() {
        for bytes in [bundled::HAND, bundled::HUMANOID] {
            let body = Body::from_bytes("a.glb", bytes).unwrap();
            let nearest = Nearest::new(&body);
            let mut compared = 0;
            for link in 0..body.links.len() {
                // Corners and middles of edges are equally near to several triangles.
                let triangles: Vec<[DVec3; 3]> = body.triangles_in_link(link).step_by(37).take(20).collect();
                let places = triangles.iter().flat_map(|&[a, b, c]| [a, (a + b) / 2.0, (a + b + c) / 3.0, c * 1.1]);
                for p in places {
                    let one_by_one = nearest.in_link_one_by_one(link, p);
                    assert_eq!(nearest.in_link(link, p), one_by_one, "{p} in link {link}");
                    let (radius, fresh) = (0.01, Nearest::new(&body));
                    let around =
                        |nearest: &Nearest<'_>| nearest.around(link, p, radius).nearest(p + DVec3::splat(1e-3));
                    assert_eq!(around(&nearest), around(&fresh), "around {p} in link {link}");
                    compared += usize::from(nearest.indices.borrow()[&link].1.is_some());
                }
            }
            assert!(compared > 100, "{compared} with an index");
        }
    }
}
