//! The surface of a body in several poses, for rays.

use glam::{DAffine3, DVec3};

use super::drawn_poses::DrawnPoses;
use crate::body::{Body, Home, Ray, RayTree, Surface};

/// Directions from each taxel.
pub(super) const DIRECTIONS: usize = 256;

/// Distance of a ray's start from the surface, m.
pub(super) const START_M: f64 = 1e-4;

/// The directions, on a Fibonacci sphere.
pub(super) fn directions() -> Vec<DVec3> {
    let golden = std::f64::consts::PI * (1.0 + 5.0_f64.sqrt());
    let direction = |index: usize| {
        let step = index as f64 + 0.5;
        let height = 1.0 - 2.0 * step / DIRECTIONS as f64;
        let radius = (1.0 - height * height).sqrt();
        let turn = golden * step;
        DVec3::new(radius * libm::cos(turn), radius * libm::sin(turn), height)
    };
    (0..DIRECTIONS).map(direction).collect()
}

/// A point of the surface of a body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BodyPoint {
    /// The link that it moves with.
    pub(crate) link: usize,
    /// In the body at rest, m.
    pub(crate) position: DVec3,
    /// Outward unit normal, in the body at rest.
    pub(crate) normal: DVec3,
}

/// Triangles that move together, or those of a skinned mesh, one pose after the other.
enum Part {
    Rigid { link: usize, in_link: RayTree },
    Skinned { links: Vec<usize>, in_body: Vec<RayTree> },
}

/// A body's surface in several poses.
pub(super) struct PosedSurface<'a> {
    poses: &'a [Vec<DAffine3>],
    /// By pose and link.
    link_from_body: Vec<Vec<DAffine3>>,
    parts: Vec<Part>,
}

impl<'a> PosedSurface<'a> {
    /// For `body` in `poses`; the first is rest. A vertex of a skinned mesh is at rest where the weights of its joints put it, and
    /// moves with the heaviest of them.
    pub(super) fn new(body: &Body, poses: &'a DrawnPoses) -> Self {
        let poses = &poses.body_from_link[..];
        let mut rigid: Vec<Vec<[DVec3; 3]>> = vec![Vec::new(); body.links.len()];
        let mut parts = Vec::new();
        for surface in &body.surfaces {
            match &surface.home {
                Home::Rigid { link, link_from_mesh } => rigid[*link].extend(surface.corners_through(*link_from_mesh)),
                Home::Skinned { joints, .. } => {
                    let links = joints.iter().map(|(link, _)| *link).collect();
                    let in_body = poses.iter().map(|pose| RayTree::new(skinned(surface, &poses[0], pose))).collect();
                    parts.push(Part::Skinned { links, in_body });
                }
            }
        }
        for (link, triangles) in rigid.into_iter().enumerate().filter(|(_, triangles)| !triangles.is_empty()) {
            parts.push(Part::Rigid { link, in_link: RayTree::new(triangles) });
        }
        let inverse = |pose: &Vec<DAffine3>| pose.iter().map(|link| link.inverse()).collect();
        Self { poses, link_from_body: poses.iter().map(inverse).collect(), parts }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.parts.is_empty()
    }

    pub(super) fn poses(&self) -> usize {
        self.poses.len()
    }

    pub(super) fn parts(&self) -> usize {
        self.parts.len()
    }

    pub(super) fn body_from_link(&self, pose: usize, link: usize) -> DAffine3 {
        self.poses[pose][link]
    }

    /// Where rays start from `point`, and its normal, in the body.
    pub(super) fn start(&self, pose: usize, body: &Body, point: &BodyPoint) -> (DVec3, DVec3) {
        let link_from_rest = body.links[point.link].body_from_link.inverse();
        let way = self.body_from_link(pose, point.link) * link_from_rest;
        let normal = way.transform_vector3(point.normal);
        (way.transform_point3(point.position) + normal * START_M, normal)
    }

    /// Whether part `part` belongs to `link`: its own triangles, or a mesh that it is a joint of.
    pub(super) fn is_of(&self, part: usize, link: usize) -> bool {
        match &self.parts[part] {
            Part::Rigid { link: own, .. } => *own == link,
            Part::Skinned { links, .. } => links.contains(&link),
        }
    }

    /// The link of part `part`, if that is rigid.
    pub(super) fn rigid_link(&self, part: usize) -> Option<usize> {
        match &self.parts[part] {
            Part::Rigid { link, .. } => Some(*link),
            Part::Skinned { .. } => None,
        }
    }

    fn seen_by(&self, pose: usize, part: usize, origin: DVec3, direction: DVec3) -> (&RayTree, Ray) {
        match &self.parts[part] {
            Part::Skinned { in_body, .. } => (&in_body[pose], Ray::new(origin, direction)),
            Part::Rigid { link, in_link } => {
                let way = &self.link_from_body[pose][*link];
                (in_link, Ray::new(way.transform_point3(origin), way.transform_vector3(direction)))
            }
        }
    }

    /// Whether the ray from `origin` along `direction`, both in the body, meets part `part`.
    pub(super) fn is_hit(&self, pose: usize, part: usize, origin: DVec3, direction: DVec3) -> bool {
        let (tree, ray) = self.seen_by(pose, part, origin, direction);
        tree.is_hit(&ray)
    }

    /// How often such a ray goes out of part `part`, less how often it comes in.
    pub(super) fn crossings(&self, pose: usize, part: usize, origin: DVec3, direction: DVec3) -> i64 {
        let (tree, ray) = self.seen_by(pose, part, origin, direction);
        tree.crossings(&ray)
    }

    /// Whether such a ray meets nothing. `last` is the part that was met last, which is tried first.
    pub(super) fn escapes(&self, pose: usize, origin: DVec3, direction: DVec3, last: &mut usize) -> bool {
        if self.parts.is_empty() {
            return true;
        }
        if self.is_hit(pose, *last, origin, direction) {
            return false;
        }
        let mut others = (0..self.parts.len()).filter(|part| *part != *last);
        match others.find(|&part| self.is_hit(pose, part, origin, direction)) {
            Some(part) => {
                *last = part;
                false
            }
            None => true,
        }
    }
}

/// The triangles of a skinned mesh in the body in `pose`. Each corner follows its heaviest joint, from where it is in `rest`.
pub(super) fn skinned<'a>(
    surface: &'a Surface,
    rest: &[DAffine3],
    pose: &[DAffine3],
) -> impl Iterator<Item = [DVec3; 3]> + use<'a> {
    let (mut points, mut is_mirrored) = (Vec::new(), false);
    if let Home::Skinned { joints, heaviest, at_rest } = &surface.home {
        let moved: Vec<DAffine3> = joints.iter().map(|(link, _)| pose[*link] * rest[*link].inverse()).collect();
        points.extend(at_rest.iter().zip(heaviest).map(|(&vertex, &joint)| moved[joint].transform_point3(vertex)));
        is_mirrored = is_skin_mirrored(joints, rest);
    }
    surface.triangles.iter().map(move |&[a, b, c]| {
        let [a, b, c] = if is_mirrored { [a, c, b] } else { [a, b, c] };
        [a, b, c].map(|v| points[v as usize])
    })
}

/// Whether `joints` turn a skinned mesh inside out in the body at `rest`.
pub(super) fn is_skin_mirrored(joints: &[(usize, DAffine3)], rest: &[DAffine3]) -> bool {
    joints.first().is_some_and(|&(link, way)| (rest[link] * way).matrix3.determinant() < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_even() {
        let directions = directions();
        assert!(directions.iter().all(|d| (d.length() - 1.0).abs() < 1e-12));
        assert!(directions.iter().sum::<DVec3>().length() < 0.5);
        let nearest = |d: &DVec3| directions.iter().filter(|o| *o != d).map(|o| o.dot(*d)).fold(-1.0, f64::max);
        assert!(directions.iter().all(|d| nearest(d) < 0.99), "none is within 8° of another");
    }
}
