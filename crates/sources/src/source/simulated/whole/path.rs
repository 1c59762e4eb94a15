//! The path of a touch over a whole body: places on its skin, and the way between them.

use glam::{DAffine3, DVec3};

use super::indenter::Pose;
use super::surface::{Spot, WholeSurface};
use crate::field::default_u;

/// Maximum distance of a path from the skin, m.
const MAX_SURFACE_DISTANCE_M: f64 = 0.02;
/// Between two places a path rises by at most this much above the arc through them, m, and by this share of its length,
/// so that what lies under the skin is not nearer than the skin.
const MAX_RISE_M: f64 = 5e-3;
const RISE_SHARE: f64 = 0.1;
/// Distance of the points at which a path is checked, m, and their maximum number between two places.
const STEP_M: f64 = 2e-3;
const MAX_STEPS: f64 = 5_000.0;
/// Directions within 10° of the normal have none along the surface.
const STEEP_COSINE: f64 = 0.984_807_753_012_208;

/// A place of a path on the skin at rest.
#[derive(Clone, Copy, Debug)]
pub(in crate::source::simulated) struct Waypoint {
    pub(in crate::source::simulated) position: DVec3,
    /// The smooth outward normal.
    pub(in crate::source::simulated) normal: DVec3,
}

/// Places and their times; before the first and after the last the touch does not move.
#[derive(Clone, Debug)]
pub(in crate::source::simulated) struct BodyPath {
    pub(in crate::source::simulated) waypoints: Vec<Waypoint>,
    /// One per place, increasing, s.
    pub(in crate::source::simulated) times_s: Vec<f64>,
    /// At rest, the frame of the first place's link.
    pub(in crate::source::simulated) body_from_link: DAffine3,
}

impl BodyPath {
    /// The places before and after `t_s`, and the share of the way between them.
    fn leg(&self, t_s: f64) -> (usize, usize, f64) {
        let next = self.times_s.partition_point(|&t| t <= t_s);
        let last = self.waypoints.len() - 1;
        if next == 0 || next > last {
            let end = next.min(last);
            return (end, end, 0.0);
        }
        let (from, to) = (self.times_s[next - 1], self.times_s[next]);
        (next - 1, next, (t_s - from) / (to - from))
    }

    /// A point over the skin at `t_s`, and which way is out.
    fn over(&self, t_s: f64) -> (DVec3, DVec3) {
        let (before, after, share) = self.leg(t_s);
        let (a, b) = (self.waypoints[before], self.waypoints[after]);
        let outward = a.normal.lerp(b.normal, share).normalize_or(a.normal);
        // The arc through both places across their normals is at most this far over the line between them.
        let length = a.position.distance(b.position);
        let turn = libm::atan2(a.normal.cross(b.normal).length(), a.normal.dot(b.normal));
        let rise = length / 2.0 * libm::tan(turn / 4.0) + (RISE_SHARE * length).min(MAX_RISE_M);
        (a.position.lerp(b.position, share) + outward * (rise * 4.0 * share * (1.0 - share)), outward)
    }

    /// The place on the skin at `t_s`; `None` where there is none near the path.
    fn spot(&self, surface: &WholeSurface, t_s: f64) -> Option<Spot> {
        let (over, outward) = self.over(t_s);
        let spot = surface.nearest(over, outward)?;
        (spot.position.distance(over) <= MAX_SURFACE_DISTANCE_M).then_some(spot)
    }

    /// The pose of an indenter at `t_s`, turned by `angle` from the way that the path runs, or from the link's +x where it stays
    /// in one place.
    pub(super) fn pose(&self, surface: &WholeSurface, t_s: f64, angle: f64) -> Option<Pose> {
        let spot = self.spot(surface, t_s)?;
        let normal = surface.smooth_normal(&spot);
        let flat = |direction: DVec3| (direction - normal * direction.dot(normal)).try_normalize();
        let heading = self.heading(t_s).filter(|heading| heading.dot(normal).abs() < STEEP_COSINE);
        let in_link = default_u(self.body_from_link.inverse().transform_vector3(normal));
        let ahead = heading.and_then(flat).or_else(|| flat(self.body_from_link.transform_vector3(in_link)));
        let ahead = ahead.unwrap_or_else(|| normal.any_orthonormal_vector());
        let along = ahead * libm::cos(angle) + normal.cross(ahead) * libm::sin(angle);
        Some(Pose { spot, normal, along })
    }

    /// The way that the path runs at `t_s`, or last ran, or runs first.
    fn heading(&self, t_s: f64) -> Option<DVec3> {
        let way = |pair: &[Waypoint]| (pair[1].position - pair[0].position).try_normalize();
        let (before, after, _) = self.leg(t_s);
        let so_far = self.waypoints[..=after.max(before)].windows(2).rev().find_map(way);
        so_far.or_else(|| self.waypoints.windows(2).find_map(way))
    }

    /// Times at which the path is checked, s: those of its places and at most two millimetres of path apart.
    pub(super) fn times_to_check(&self) -> impl Iterator<Item = f64> + '_ {
        let between = self.times_s.windows(2).zip(self.waypoints.windows(2)).flat_map(|(times, ends)| {
            let steps = (ends[0].position.distance(ends[1].position) / STEP_M).clamp(1.0, MAX_STEPS) as u32 + 1;
            let (from, to) = (times[0], times[1]);
            (0..steps).map(move |step| from + (to - from) * (f64::from(step) / f64::from(steps)))
        });
        between.chain(self.times_s.last().copied())
    }

    /// Whether there is skin near the path at `t_s`.
    pub(super) fn is_on_skin(&self, surface: &WholeSurface, t_s: f64) -> bool {
        self.spot(surface, t_s).is_some()
    }
}

/// The skin at `p`, a place that a path names, if there is any.
pub(super) fn waypoint(surface: &WholeSurface, p: DVec3, outward: Option<DVec3>) -> Option<Waypoint> {
    let spot = match outward {
        Some(outward) => surface.nearest(p, outward),
        None => surface.nearest_of_all(p),
    }?;
    let near = spot.position.distance(p) <= MAX_SURFACE_DISTANCE_M;
    near.then(|| Waypoint { position: spot.position, normal: surface.smooth_normal(&spot) })
}
