//! Which points of a body's surface something can touch.
//!
//! A ray starts 0.1 mm outside a point in each of 256 directions. The point is open if five of them escape at rest, or in one of the
//! poses of the body's joints. Of points from which only one escapes, up to 7 % are closed to 256 other directions; of those with
//! five, 0.1 %.

use glam::DVec3;

use super::drawn_poses::DrawnPoses;
use super::posed_surface::{BodyPoint, DIRECTIONS, PosedSurface, directions};
use crate::body::Body;
use crate::parallel;

/// So many rays escape from an open point.
const ENOUGH: usize = 5;

/// Points that a thread takes at a time.
const PER_TASK: usize = 32;

/// A body's surface, with what stands before it.
pub(crate) struct Touchable<'a> {
    body: &'a Body,
    surface: PosedSurface<'a>,
    directions: Vec<DVec3>,
}

impl<'a> Touchable<'a> {
    /// For `body` in `poses`; the first is rest.
    pub(crate) fn new(body: &'a Body, poses: &'a DrawnPoses) -> Self {
        Self { body, surface: PosedSurface::new(body, poses), directions: directions() }
    }

    /// Per point whether it is open. `progress` gets the share that is done, and says whether to go on; `None` if it does not.
    pub(crate) fn are_open(&self, points: &[BodyPoint], progress: &mut dyn FnMut(f64) -> bool) -> Option<Vec<bool>> {
        let (mut open, count) = (vec![false; points.len()], points.len());
        let at_once = 4 * PER_TASK * parallel::threads();
        for (index, (open, points)) in open.chunks_mut(at_once).zip(points.chunks(at_once)).enumerate() {
            if !progress((index * at_once) as f64 / count as f64) {
                return None;
            }
            let tasks = open.chunks_mut(PER_TASK).zip(points.chunks(PER_TASK));
            parallel::for_each(parallel::threads(), tasks, |(open, points): (&mut [bool], &[BodyPoint])| {
                for (open, point) in open.iter_mut().zip(points) {
                    *open = self.is_open(point);
                }
            });
        }
        Some(open)
    }

    fn is_open(&self, point: &BodyPoint) -> bool {
        let mut last = (0..self.surface.parts()).find(|&part| self.surface.is_of(part, point.link)).unwrap_or(0);
        (0..self.surface.poses()).any(|pose| self.is_open_in(pose, point, &mut last))
    }

    fn is_open_in(&self, pose: usize, point: &BodyPoint, last: &mut usize) -> bool {
        let (start, normal) = self.surface.start(pose, self.body, point);
        // Those along the normal first, as they mostly escape.
        let (mut escaped, mut tried) = (0, [false; DIRECTIONS]);
        for least in [0.8, 0.3, 0.0, -1.1] {
            for (direction, tried) in self.directions.iter().zip(&mut tried) {
                if *tried || direction.dot(normal) < least {
                    continue;
                }
                *tried = true;
                escaped += usize::from(self.surface.escapes(pose, start, *direction, last));
                if escaped == ENOUGH {
                    return true;
                }
            }
        }
        false
    }
}
