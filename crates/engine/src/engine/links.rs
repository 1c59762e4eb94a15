//! Where the body's links are in a frame.

use std::collections::HashMap;
use std::ops::Range;

use glam::DAffine3;

use crate::body::{Body, Link};
use crate::scene::{Coordinates, PlanField, Scene};
use crate::signal::Frame;

/// What poses are applied to: the body's links and how they hang together at rest.
pub(super) struct Links {
    /// Whether poses are heeded.
    pub(super) posed: bool,
    /// The link in whose frame everything is put instead of the world.
    relative_to: Option<usize>,
    pub(super) index_of: HashMap<String, usize>,
    names: Vec<String>,
    parent: Vec<Option<usize>>,
    /// At rest.
    world_from_link: Vec<DAffine3>,
    /// The links of all poses of the call's frames, frame by frame.
    of_poses: Vec<u32>,
    /// Where those of each frame end.
    ends: Vec<usize>,
    /// The links of the poses of the last frame, which mostly has them in the same order as the next.
    likely: Vec<u32>,
}

/// Where every link is in a frame, where that is known.
#[derive(Clone, Debug, Default)]
pub(super) struct LinkPoses {
    /// By link.
    world_from_link: Vec<Option<DAffine3>>,
    /// Memory: by link, which of the frame's poses is its own.
    own: Vec<Option<usize>>,
}

impl LinkPoses {
    /// Forgets the frame: none is known.
    pub(super) fn clear(&mut self) {
        self.world_from_link.clear();
    }

    /// By link; empty if none is known.
    pub(super) fn as_slice(&self) -> &[Option<DAffine3>] {
        &self.world_from_link
    }
}

/// A frame of the call with the links of its poses.
#[derive(Clone, Copy)]
pub(super) struct Posed<'a> {
    frame: &'a Frame,
    /// By pose.
    links: &'a [u32],
}

impl Posed<'_> {
    /// Which of the frame's poses is that of `link`.
    fn pose_of(self, link: usize) -> Option<usize> {
        self.links.iter().position(|&posed| posed as usize == link)
    }

    /// world_from_link of the link of a pose.
    fn transform(self, pose: usize) -> DAffine3 {
        self.frame.pose[pose].1.transform()
    }
}

impl Links {
    /// The links of `body`, with poses as `scene` wants them.
    pub(super) fn new(body: &Body, scene: &Scene) -> Self {
        let index = |name: &str| body.links.iter().position(|link| link.name == *name);
        Self {
            posed: scene.coordinates == Coordinates::World,
            relative_to: scene.relative_to.as_deref().and_then(index),
            index_of: body.links.iter().enumerate().map(|(i, link)| (link.name.clone(), i)).collect(),
            names: body.links.iter().map(|link| link.name.clone()).collect(),
            parent: body.links.iter().map(|link| link.parent).collect(),
            world_from_link: body.links.iter().map(Link::world_from_link).collect(),
            of_poses: Vec::new(),
            ends: Vec::new(),
            likely: Vec::new(),
        }
    }

    /// Begins a call: forgets the frames of the one before.
    pub(super) fn forget(&mut self) {
        self.of_poses.clear();
        self.ends.clear();
    }

    /// Finds the links of the poses of `frame`, the next one of the call.
    ///
    /// # Errors
    /// The name of a link that the body has not.
    pub(super) fn resolve<'f>(&mut self, frame: &'f Frame) -> Result<(), &'f str> {
        for (at, (name, _)) in frame.pose.iter().enumerate() {
            let likely = self.likely.get(at).filter(|&&link| self.names[link as usize] == *name);
            let link = match likely {
                Some(&link) => link,
                None => {
                    let link = *self.index_of.get(name).ok_or(name.as_str())? as u32;
                    self.likely.truncate(at);
                    self.likely.push(link);
                    link
                }
            };
            self.of_poses.push(link);
        }
        self.ends.push(self.of_poses.len());
        Ok(())
    }

    /// `frame`, the one with number `index` of the call.
    pub(super) fn posed<'a>(&'a self, index: usize, frame: &'a Frame) -> Posed<'a> {
        let range: Range<usize> = index.checked_sub(1).map_or(0, |before| self.ends[before])..self.ends[index];
        Posed { frame, links: &self.of_poses[range] }
    }

    /// Whether places in `frame` are wanted in the world, and it says where any link is there.
    #[inline(always)]
    pub(super) fn are_posed(&self, frame: &Frame) -> bool {
        self.posed && !frame.pose.is_empty()
    }

    /// Whether places in `frame` are wanted in the world, and it would say where links are there, were their joints not late.
    #[inline(always)]
    pub(super) fn may_pose(&self, frame: &Frame) -> bool {
        self.posed && (!frame.pose.is_empty() || frame.has_stale_pose)
    }

    /// world_from_anchor of `field`, whose members are all on its anchor, in `frame`, number `index` of the call, if that says
    /// where it is; the world is the scene's link, where it names one.
    #[inline(always)]
    pub(super) fn world_from_anchor(&self, field: &PlanField, index: usize, frame: &Frame) -> Option<DAffine3> {
        if !self.are_posed(frame) {
            return None;
        }
        let posed = self.posed(index, frame);
        let world_from_anchor = self.world_from(field.anchor?, posed)?;
        match self.relative_to {
            None => Some(world_from_anchor),
            Some(link) => Some(self.world_from(link, posed)?.inverse() * world_from_anchor),
        }
    }

    /// world_from_link of `link` in `frame`: its own pose, or that of its nearest ancestor that has one, at rest from
    /// there on. `None` where the frame poses neither, and where it lacks the link's own pose because joints are late: which
    /// of them moves the link against its ancestor is not known here.
    fn world_from(&self, link: usize, posed: Posed<'_>) -> Option<DAffine3> {
        let mut at = Some(link);
        while let Some(ancestor) = at {
            if let Some(pose) = posed.pose_of(ancestor) {
                let ancestor_from_link = self.world_from_link[ancestor].inverse() * self.world_from_link[link];
                return Some(posed.transform(pose) * ancestor_from_link);
            }
            at = self.parent[ancestor].filter(|_| !posed.frame.has_stale_pose);
        }
        None
    }

    /// Puts world_from_link of every link in `frame`, number `index` of the call, into `poses`, as [`Links::world_from_anchor`]
    /// has it: none of a frame that is not posed.
    pub(super) fn poses_into(&self, index: usize, frame: &Frame, poses: &mut LinkPoses) {
        let LinkPoses { world_from_link: poses, own } = poses;
        poses.clear();
        poses.resize(self.names.len(), None);
        if !self.are_posed(frame) {
            return;
        }
        let posed = self.posed(index, frame);
        let from_world = match self.relative_to {
            None => Some(DAffine3::IDENTITY),
            Some(link) => self.world_from(link, posed).map(|world_from_link| world_from_link.inverse()),
        };
        let Some(from_world) = from_world else { return };
        own.clear();
        own.resize(self.names.len(), None);
        for (at, &link) in posed.links.iter().enumerate().rev() {
            own[link as usize] = Some(at);
        }
        for (link, pose) in poses.iter_mut().enumerate() {
            let mut above = Some(link);
            while let Some(ancestor) = above {
                if let Some(at) = own[ancestor] {
                    let ancestor_from_link = self.world_from_link[ancestor].inverse() * self.world_from_link[link];
                    *pose = Some(from_world * (posed.transform(at) * ancestor_from_link));
                    break;
                }
                above = self.parent[ancestor].filter(|_| !frame.has_stale_pose);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::*;
    use crate::signal::Pose;

    fn frame(poses: &[(&str, f64)]) -> Frame {
        let pose =
            |&(link, x): &(&str, f64)| (link.to_owned(), Pose { translation: DVec3::X * x, rotation: DQuat::IDENTITY });
        Frame { pose: poses.iter().map(pose).collect(), ..Frame::default() }
    }

    #[test]
    fn poses_are_found_by_links_in_any_order_and_number() {
        let names = ["base", "arm", "hand"];
        let mut links = Links {
            posed: true,
            relative_to: None,
            index_of: names.iter().zip(0..).map(|(name, link)| ((*name).to_owned(), link)).collect(),
            names: Vec::from(names.map(str::to_owned)),
            parent: vec![None, Some(0), Some(1)],
            world_from_link: vec![DAffine3::IDENTITY; 3],
            of_poses: Vec::new(),
            ends: Vec::new(),
            likely: Vec::new(),
        };
        let frames = [
            frame(&[("base", 1.0), ("hand", 3.0)]),
            frame(&[]),
            frame(&[("hand", 5.0), ("base", 4.0)]),
            // The first of two holds.
            frame(&[("hand", 6.0), ("arm", 7.0), ("hand", 8.0)]),
            frame(&[("hand", 9.0)]),
        ];
        let expected = [
            [Some(1.0), Some(1.0), Some(3.0)],
            [None; 3],
            [Some(4.0), Some(4.0), Some(5.0)],
            [None, Some(7.0), Some(6.0)],
            [None, None, Some(9.0)],
        ];
        // A second call knows nothing of the frames of the first.
        for call in [0..5, 2..5] {
            links.forget();
            frames[call.clone()].iter().for_each(|frame| links.resolve(frame).unwrap());
            for (index, (frame, expected)) in frames[call.clone()].iter().zip(&expected[call]).enumerate() {
                let mut poses = LinkPoses::default();
                links.poses_into(index, frame, &mut poses);
                let found: Vec<Option<f64>> =
                    poses.as_slice().iter().map(|pose| pose.map(|pose| pose.translation.x)).collect();
                assert_eq!(found, expected);
                let posed = links.posed(index, frame);
                let alone: Vec<Option<f64>> =
                    (0..3).map(|link| links.world_from(link, posed).map(|pose| pose.translation.x)).collect();
                assert_eq!(alone, expected);
            }
        }
        assert_eq!(links.resolve(&frame(&[("base", 1.0), ("leg", 2.0)])), Err("leg"));
    }
}
