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
    /// Of `body` in `poses`, the first of which is rest. `at_rest` has the vertices of a surface in the body at rest, m, by the weights of
    /// all their joints; where it has none, each follows its heaviest joint.
    pub(super) fn new<'v>(body: &Body, poses: &'a DrawnPoses, at_rest: impl Fn(usize) -> Option<&'v [DVec3]>) -> Self {
        let poses = &poses.body_from_link[..];
        let mut rigid: Vec<Vec<[DVec3; 3]>> = vec![Vec::new(); body.links.len()];
        let mut parts = Vec::new();
        for (index, surface) in body.surfaces.iter().enumerate() {
            match &surface.home {
                Home::Rigid { link, link_from_mesh } => rigid[*link].extend(surface.corners_through(*link_from_mesh)),
                Home::Skinned { joints, .. } => {
                    let links = joints.iter().map(|(link, _)| *link).collect();
                    let rest = at_rest(index).map(|vertices| (&poses[0][..], vertices));
                    let in_body = poses.iter().map(|pose| RayTree::new(skinned(surface, pose, rest))).collect();
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

/// The triangles of a skinned mesh in the body; each corner follows its heaviest joint, from where it is at rest if `rest` says that: the
/// pose at rest and the vertices in it.
fn skinned<'a>(
    surface: &'a Surface,
    pose: &[DAffine3],
    rest: Option<(&[DAffine3], &[DVec3])>,
) -> impl Iterator<Item = [DVec3; 3]> + use<'a> {
    let mut points = surface.positions.clone();
    let mut is_mirrored = false;
    if let Home::Skinned { joints, heaviest } = &surface.home {
        let ways: Vec<DAffine3> = joints.iter().map(|(link, way)| pose[*link] * *way).collect();
        is_mirrored = ways.first().is_some_and(|way| way.matrix3.determinant() < 0.0);
        match rest {
            None => {
                for (point, joint) in points.iter_mut().zip(heaviest) {
                    *point = ways[*joint].transform_point3(*point);
                }
            }
            Some((at_rest, vertices)) => {
                let moved: Vec<DAffine3> =
                    joints.iter().map(|(link, _)| pose[*link] * at_rest[*link].inverse()).collect();
                for ((point, vertex), joint) in points.iter_mut().zip(vertices).zip(heaviest) {
                    *point = moved[*joint].transform_point3(*vertex);
                }
            }
        }
    }
    surface.triangles.iter().map(move |&[a, b, c]| {
        let [a, b, c] = if is_mirrored { [a, c, b] } else { [a, b, c] };
        [a, b, c].map(|v| points[v as usize])
    })
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
