//! A source whose frames get poses of links from the transforms of a bag.

use glam::DQuat;

use super::bag_poses::BagPoses;
use crate::body::Body;
use crate::error::{Result, failed};
use crate::signal::{Frame, Pose};
use crate::source::Source;

/// Names that a message has at most.
const MOST_NAMED: usize = 8;
/// The age of a transform from which on it is too old, by default, s.
const DEFAULT_MAX_AGE_S: f64 = 0.1;

/// Frames of another source, with poses of links from `/tf`, `/tf_static` and odometry of a bag. The root of the transforms is the world. A
/// frame's own pose of a link stays.
///
/// Where a transform of a link with taxels is missing or too old, the frame has no pose of it, and [`Frame::has_stale_pose`].
pub struct PosedSource {
    source: Box<dyn Source + Send>,
    poses: BagPoses,
    /// The body's links that the bag has, and whether each has taxels.
    links: Vec<(String, bool)>,
    summary: String,
    max_age_s: f64,
    frames: usize,
    without_pose: usize,
}

somatic_skin::debug_by_name!(PosedSource);

/// The first of `names`.
fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.take(MOST_NAMED).map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

impl PosedSource {
    /// Gives the frames of `source` poses of the links of `body`, if transforms are not older than `max_age_s`, or 0.1 s.
    ///
    /// # Errors
    /// No link of the body is in the bag, or two have different roots.
    pub fn new(source: Box<dyn Source + Send>, poses: BagPoses, body: &Body, max_age_s: Option<f64>) -> Result<Self> {
        let has_taxels = |link: usize| body.taxels.iter().any(|taxel| taxel.link == link);
        let known = body.links.iter().enumerate().filter(|(_, link)| poses.has(&link.name));
        let links: Vec<(String, bool)> = known.map(|(index, link)| (link.name.clone(), has_taxels(index))).collect();
        let Some((first, _)) = links.first() else {
            return Err(
                failed!("none of its frames is a link of the body; it has {}", listed(poses.names())).at(poses.name())
            );
        };
        let root = poses.root_of(first).to_owned();
        if let Some((other, _)) = links.iter().find(|(name, _)| poses.root_of(name) != root) {
            let else_root = poses.root_of(other);
            return Err(failed!(
                "`{first}` is in `{root}` and `{other}` in `{else_root}`, and nothing says where one is in the other"
            )
            .at(poses.name()));
        }
        let lacks: Vec<&str> =
            body.links.iter().map(|link| link.name.as_str()).filter(|name| !poses.has(name)).collect();
        let without = if lacks.is_empty() {
            String::new()
        } else {
            format!("; it has no frame of {}", listed(lacks.iter().copied()))
        };
        let summary = format!("{}: poses of {} links, in `{root}`{without}", poses.name(), links.len());
        let max_age_s = max_age_s.unwrap_or(DEFAULT_MAX_AGE_S);
        Ok(Self { source, poses, links, summary, max_age_s, frames: 0, without_pose: 0 })
    }

    /// Which links have poses, and in what, in a line.
    #[must_use]
    pub fn summary(&self) -> &str {
        &self.summary
    }
}

impl Source for PosedSource {
    fn taxels(&self) -> &[u32] {
        self.source.taxels()
    }

    fn wrapped(&self) -> Option<&dyn Source> {
        Some(&*self.source)
    }

    fn wrapped_mut(&mut self) -> Option<&mut dyn Source> {
        Some(&mut *self.source)
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        if !self.source.next_frame(frame)? {
            return Ok(false);
        }
        let mut is_stale = false;
        for (name, has_taxels) in &self.links {
            if frame.pose.iter().any(|(own, _)| own == name) {
                continue;
            }
            match self.poses.at(name, frame.time(), self.max_age_s) {
                Some(world_from_link) => {
                    let rotation = DQuat::from_mat3(&world_from_link.matrix3).normalize();
                    frame.pose.push((name.clone(), Pose { translation: world_from_link.translation, rotation }));
                }
                None => is_stale |= has_taxels,
            }
        }
        frame.has_stale_pose |= is_stale;
        self.frames += 1;
        self.without_pose += usize::from(is_stale);
        Ok(true)
    }

    fn closing(&self) -> Vec<String> {
        let mut closing = self.source.closing();
        if self.without_pose > 0 {
            closing.push(format!(
                "{} of {} frames lack poses of links: transforms of {} were missing, or older than {} s",
                self.without_pose,
                self.frames,
                self.poses.name(),
                self.max_age_s
            ));
        }
        closing
    }

    fn losses(&self) -> Vec<String> {
        let mut losses = self.source.losses();
        losses.extend(self.poses.losses().iter().cloned());
        losses
    }
}
