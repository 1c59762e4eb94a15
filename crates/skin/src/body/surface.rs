//! A body's triangles, with nearest-point and ray queries.

use std::ops::Deref as _;

use glam::{DAffine3, DVec3};
use rstar::primitives::{CachedEnvelope, GeomWithData};
use rstar::{AABB, PointDistance, RTree, RTreeObject, SelectionFunction};

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
                Home::Skinned { joints, heaviest, .. } => {
                    let way = |&(link, way): &(usize, DAffine3)| (link, self.links[link].body_from_link * way);
                    let ways: Vec<(usize, DAffine3)> = joints.iter().map(way).collect();
                    let mirrored = ways.first().is_some_and(|(_, way)| way.matrix3.determinant() < 0.0);
                    let way = |v: u32| ways[heaviest[v as usize]];
                    let at = |v: u32| way(v).1.transform_point3(surface.positions[v as usize]);
                    triangles.extend(surface.triangles.iter().map(|&[a, b, c]| {
                        let [a, b, c] = if mirrored { [a, c, b] } else { [a, b, c] };
                        (way(a).0, [at(a), at(b), at(c)])
                    }));
                }
            }
        }
        triangles
    }
}

/// The outward normal of a triangle, of twice its area.
pub fn area_vector([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// The point of a triangle that is nearest to `p`.
pub fn nearest_on_triangle(corners: [DVec3; 3], p: DVec3) -> DVec3 {
    Triangle(corners).nearest(p)
}

/// Three corners, counter-clockwise seen from outside.
#[derive(Clone, Copy, Debug)]
pub struct Triangle(pub(super) [DVec3; 3]);

impl Triangle {
    /// The outward normal; `None` for a triangle without area.
    pub(super) fn unit_normal(&self) -> Option<DVec3> {
        area_vector(self.0).try_normalize()
    }

    /// Squared distance of `p` from the bounding box: a lower bound for the triangle.
    pub(super) fn box_distance_squared(&self, p: DVec3) -> f64 {
        let [a, b, c] = self.0;
        p.distance_squared(p.clamp(a.min(b).min(c), a.max(b).max(c)))
    }

    /// The point of the triangle that is nearest to `p` (Ericson, Real-Time Collision Detection, 5.1.5).
    pub(super) fn nearest(&self, p: DVec3) -> DVec3 {
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
    pub(super) fn new(triangles: Vec<Triangle>) -> Self {
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
    #[doc(hidden)]
    pub fn nearest_where(&self, p: DVec3, fits: impl Fn(DVec3) -> bool) -> Option<Hit> {
        let triangle = self.tree.nearest_neighbor_iter(p.to_array()).find(|triangle| fits(triangle.data.0))?;
        let (normal, number) = triangle.data;
        Some(Hit { position: triangle.geom().nearest(p), normal, triangle: number as usize })
    }

    /// The surface point nearest to `p` of the triangles that face within about 45° of the unit `normal`, if there are any, else of all.
    #[doc(hidden)]
    pub fn nearest_facing(&self, p: DVec3, normal: DVec3) -> Option<Hit> {
        let faces = |other: DVec3| other.dot(normal) > 0.7;
        self.nearest_where(p, faces).or_else(|| self.nearest(p))
    }

    /// The triangles within `within_m` of `p`, in any order.
    #[doc(hidden)]
    pub fn within(&self, p: DVec3, within_m: f64) -> impl Iterator<Item = usize> + '_ {
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
    #[doc(hidden)]
    pub fn triangles_within(&self, p: DVec3, within_m: f64) -> impl Iterator<Item = (u32, DVec3)> + '_ {
        let near = self.tree.locate_within_distance(p.to_array(), within_m * within_m);
        near.map(|triangle| (triangle.data.1, triangle.data.0))
    }

    /// The intersection nearest to `p` of the surface and the line through `p` along the unit vector `direction`, within
    /// `reach` of `p` and with an outward normal along `direction`.
    #[must_use]
    pub fn along(&self, p: DVec3, direction: DVec3, reach: f64) -> Option<Hit> {
        let line = Line { p, direction, reach };
        let close = self.tree.locate_with_selection_function(line);
        line.first(close.map(|triangle| (*triangle.geom().deref(), triangle.data.0, triangle.data.1)))
    }
}

/// The part of a line within `reach` of `p`.
#[derive(Clone, Copy)]
pub(super) struct Line {
    pub(super) p: DVec3,
    pub(super) direction: DVec3,
    pub(super) reach: f64,
}

impl Line {
    /// Where it pierces one of `triangles`, which have their outward normals and numbers, nearest to `p` with the normal along its
    /// direction; of equals that of the lowest number.
    pub(super) fn first(&self, triangles: impl Iterator<Item = (Triangle, DVec3, u32)>) -> Option<Hit> {
        let Self { p, direction, reach } = *self;
        triangles
            .filter(|(_, normal, _)| normal.dot(direction) > 0.0)
            .filter_map(|(triangle, normal, number)| Some((triangle.pierced(p, direction)?, normal, number)))
            .filter(|(t, ..)| t.abs() <= reach)
            .min_by(|a, b| a.0.abs().total_cmp(&b.0.abs()).then(a.2.cmp(&b.2)))
            .map(|(t, normal, number)| Hit { position: p + direction * t, normal, triangle: number as usize })
    }

    /// Whether it may pierce what is in a box.
    fn may_pierce(&self, ends: &AABB<[f64; 3]>) -> bool {
        let [low, high] = [ends.lower(), ends.upper()].map(DVec3::from_array);
        // Beyond the tolerance of a triangle's sides, and rounding.
        let margin =
            (high - low).max_element() * 1e-6 + low.abs().max(high.abs()).max(self.p.abs()).max_element() * 1e-12;
        // Most boxes are beside it: that is cheaper to see.
        let around = self.direction.abs() * self.reach + DVec3::splat(margin);
        if (low - self.p).cmpgt(around).any() || (self.p - high).cmpgt(around).any() {
            return false;
        }
        let (mut from, mut to) = (-self.reach - margin, self.reach + margin);
        for axis in 0..3 {
            let [a, b] = [low[axis] - margin - self.p[axis], high[axis] + margin - self.p[axis]];
            let along = self.direction[axis];
            if along == 0.0 {
                if a > 0.0 || b < 0.0 {
                    return false;
                }
                continue;
            }
            let (near, far) = if along > 0.0 { (a / along, b / along) } else { (b / along, a / along) };
            from = from.max(near);
            to = to.min(far);
        }
        from <= to
    }
}

impl<T: RTreeObject<Envelope = AABB<[f64; 3]>>> SelectionFunction<T> for Line {
    fn should_unpack_parent(&self, envelope: &AABB<[f64; 3]>) -> bool {
        self.may_pierce(envelope)
    }

    fn should_unpack_leaf(&self, leaf: &T) -> bool {
        self.may_pierce(&leaf.envelope())
    }
}

/// A search tree of numbered points.
pub type PointTree = RTree<GeomWithData<[f64; 3], usize>>;

/// The tree of `points`, numbered from 0.
pub fn point_tree(points: impl IntoIterator<Item = DVec3>) -> PointTree {
    let numbered = points.into_iter().enumerate();
    RTree::bulk_load(numbered.map(|(index, p)| GeomWithData::new(p.to_array(), index)).collect())
}
