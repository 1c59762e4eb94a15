//! Where the links are in a frame.

use glam::{DAffine3, DVec3};

use crate::body::Body;
use crate::signal::Pose;

/// The links' poses, from those that a frame has.
#[derive(Clone, Debug)]
pub(super) struct Poses {
    /// Per link its parent, world_from_link at rest, and parent_from_link.
    links: Vec<(Option<usize>, DAffine3, DAffine3)>,
    origin: DVec3,
    world: Vec<DAffine3>,
    posed: Vec<bool>,
    seven: Vec<[f32; 7]>,
    changes: u64,
}

impl Poses {
    /// Of the links of `body` at rest, relative to `origin`.
    pub(super) fn new(body: &Body, origin: DVec3) -> Self {
        let links: Vec<_> = body
            .links
            .iter()
            .enumerate()
            .map(|(index, link)| {
                let world_from_link = link.world_from_link();
                let parent_from_link = link.parent.map_or(world_from_link, |p| body.rest_transform(p, index));
                (link.parent, world_from_link, parent_from_link)
            })
            .collect();
        let mut poses = Self {
            origin,
            world: links.iter().map(|link| link.1).collect(),
            posed: vec![false; links.len()],
            seven: vec![[0.0; 7]; links.len()],
            links,
            changes: 0,
        };
        poses.set(&[]);
        poses.changes = 0;
        poses
    }

    /// x, y, z relative to the origin, m, and a quaternion x, y, z, w, per link.
    pub(super) fn seven(&self) -> &[[f32; 7]] {
        &self.seven
    }

    /// Counts the frames in which a link was elsewhere than in the frame before; 0 at rest.
    pub(super) fn changes(&self) -> u64 {
        self.changes
    }

    /// Puts the links in `posed` where it says, and their descendants with them; all others are at rest.
    pub(super) fn set(&mut self, posed: &[(u32, Pose)]) {
        let mut changed = false;
        for (index, (parent, at_rest, parent_from_link)) in self.links.iter().enumerate() {
            let own = posed.iter().find(|(link, _)| *link as usize == index);
            let above = parent.filter(|&parent| self.posed[parent]);
            self.posed[index] = own.is_some() || above.is_some();
            self.world[index] = match (own, above) {
                (Some((_, pose)), _) => pose.transform(),
                (None, Some(parent)) => self.world[parent] * *parent_from_link,
                (None, None) => *at_rest,
            };
            let (_, rotation, translation) = self.world[index].to_scale_rotation_translation();
            let place = (translation - self.origin).as_vec3().to_array();
            let turn = rotation.normalize().as_quat().to_array();
            let seven: [f32; 7] = std::array::from_fn(|i| if i < 3 { place[i] } else { turn[i - 3] });
            changed |= seven != self.seven[index];
            self.seven[index] = seven;
        }
        self.changes += u64::from(changed);
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;
    use crate::bundled;

    #[test]
    fn a_posed_link_carries_what_hangs_on_it() {
        let body = Body::from_bytes("humanoid", bundled::HUMANOID).unwrap();
        let child = (0..body.links.len()).rev().find(|&link| body.links[link].parent.is_some()).unwrap();
        let parent = body.links[child].parent.unwrap();
        let origin = DVec3::new(1.0, 2.0, 3.0);
        let mut poses = Poses::new(&body, origin);
        let rest = poses.seven().to_vec();
        poses.set(&[]);
        assert_eq!((poses.changes(), poses.seven()), (0, &rest[..]));
        let at_rest = body.links[parent].world_from_link();
        let (_, rotation, translation) = at_rest.to_scale_rotation_translation();
        let moved = Pose { translation: translation + DVec3::X, rotation: DQuat::from_rotation_y(0.5) * rotation };
        poses.set(&[(parent as u32, moved)]);
        assert_eq!(poses.changes(), 1);
        let expected =
            DAffine3::from_rotation_translation(moved.rotation, moved.translation) * body.rest_transform(parent, child);
        let place = poses.seven()[child];
        let place = DVec3::new(place[0].into(), place[1].into(), place[2].into());
        assert!((place - (expected.translation - origin)).length() < 1e-6);
        poses.set(&[]);
        assert_eq!((poses.changes(), poses.seven()), (2, &rest[..]));
    }
}
