//! Where the body's links are in a frame.

use std::collections::HashMap;

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
        }
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

    /// world_from_anchor of `field`, whose members are all on its anchor, in `frame`, if that says where it is; the world is
    /// the scene's link, where it names one.
    #[inline(always)]
    pub(super) fn world_from_anchor(&self, field: &PlanField, frame: &Frame) -> Option<DAffine3> {
        if !self.are_posed(frame) {
            return None;
        }
        let world_from_anchor = self.world_from(field.anchor?, frame)?;
        match self.relative_to {
            None => Some(world_from_anchor),
            Some(link) => Some(self.world_from(link, frame)?.inverse() * world_from_anchor),
        }
    }

    /// world_from_link of `link` in `frame`: its own pose, or that of its nearest ancestor that has one, at rest from
    /// there on. `None` where the frame poses neither, and where it lacks the link's own pose because joints are late: which
    /// of them moves the link against its ancestor is not known here.
    fn world_from(&self, link: usize, frame: &Frame) -> Option<DAffine3> {
        let mut at = Some(link);
        while let Some(ancestor) = at {
            let posed = frame.pose.iter().find(|(name, _)| *name == self.names[ancestor]);
            if let Some((_, pose)) = posed {
                let world_from_ancestor = pose.transform();
                let ancestor_from_link = self.world_from_link[ancestor].inverse() * self.world_from_link[link];
                return Some(world_from_ancestor * ancestor_from_link);
            }
            at = self.parent[ancestor].filter(|_| !frame.has_stale_pose);
        }
        None
    }

    /// Puts world_from_link of every link in `frame` into `poses`, as [`Links::world_from_anchor`] has it: none of a frame
    /// that is not posed.
    pub(super) fn poses_into(&self, frame: &Frame, poses: &mut Vec<Option<DAffine3>>) {
        poses.clear();
        poses.resize(self.names.len(), None);
        if !self.are_posed(frame) {
            return;
        }
        let from_world = match self.relative_to {
            None => Some(DAffine3::IDENTITY),
            Some(link) => self.world_from(link, frame).map(|world_from_link| world_from_link.inverse()),
        };
        let Some(from_world) = from_world else { return };
        let mut own: Vec<Option<usize>> = vec![None; self.names.len()];
        for (at, (name, _)) in frame.pose.iter().enumerate().rev() {
            if let Some(&link) = self.index_of.get(name) {
                own[link] = Some(at);
            }
        }
        for (link, pose) in poses.iter_mut().enumerate() {
            let mut above = Some(link);
            while let Some(ancestor) = above {
                if let Some(at) = own[ancestor] {
                    let world_from_ancestor = frame.pose[at].1.transform();
                    let ancestor_from_link = self.world_from_link[ancestor].inverse() * self.world_from_link[link];
                    *pose = Some(from_world * (world_from_ancestor * ancestor_from_link));
                    break;
                }
                above = self.parent[ancestor].filter(|_| !frame.has_stale_pose);
            }
        }
    }
}
