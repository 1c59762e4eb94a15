//! The path of a touch: waypoints over time, projected to the surface.

use std::sync::Arc;

use glam::{DQuat, DVec2, DVec3};

use crate::body::SurfaceIndex;
use crate::field::{Chart, Lift, default_u};

/// Maximum distance of a waypoint in a link's frame from the surface, and of a chart's surface beyond its members' depth.
const MAX_SURFACE_DISTANCE_M: f64 = 0.02;
/// Distance of the points at which a path is checked.
const STEP_M: f64 = 5e-4;
/// Maximum number of points checked between two waypoints.
const MAX_STEPS: f64 = 20_000.0;

#[derive(Clone, Debug)]
pub(super) enum PathFrame {
    /// (u, v, 0) in a field's chart, taken along its normal to the surface.
    Chart { chart: Chart, origin_in_link: DVec3, reach_m: f64 },
    /// (u, v, 0) in a field's geodesic chart, taken to the surface as percepts' positions are.
    Curved { chart: Chart, origin_in_link: DVec3, lift: Box<Lift> },
    /// Points in the link's frame, taken to the nearest point of the surface.
    Link,
}

impl PathFrame {
    /// For a field whose members lie up to `deepest_m` from its chart's plane.
    pub(super) fn of_field(chart: Chart, origin_in_link: DVec3, deepest_m: f64) -> Self {
        Self::Chart { chart, origin_in_link, reach_m: 2.0 * deepest_m + MAX_SURFACE_DISTANCE_M }
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct ContactPoint {
    pub(super) position_in_link: DVec3,
    pub(super) normal_in_link: DVec3,
    pub(super) uv: Option<[f64; 2]>,
}

/// Waypoints and their times; before the first and after the last the touch does not move.
#[derive(Clone, Debug)]
pub(super) struct Path {
    pub(super) frame: PathFrame,
    pub(super) surface: Arc<SurfaceIndex>,
    pub(super) waypoints: Vec<DVec3>,
    /// One per waypoint, increasing, s.
    pub(super) times_s: Vec<f64>,
}

impl Path {
    /// The interpolated waypoint at `t_s`, before projection to the surface.
    pub(super) fn waypoint(&self, t_s: f64) -> DVec3 {
        let next = self.times_s.partition_point(|&t| t <= t_s);
        if next == 0 {
            return self.waypoints[0];
        }
        let Some(&t1) = self.times_s.get(next) else { return self.waypoints[next - 1] };
        let t0 = self.times_s[next - 1];
        self.waypoints[next - 1].lerp(self.waypoints[next], (t_s - t0) / (t1 - t0))
    }

    /// The point of the surface at `t_s`; `None` where there is none.
    pub(super) fn place(&self, t_s: f64) -> Option<ContactPoint> {
        let waypoint = self.waypoint(t_s);
        match &self.frame {
            PathFrame::Chart { chart, origin_in_link, reach_m } => {
                let above = *origin_in_link + chart.unproject(waypoint);
                let hit = self.surface.along(above, chart.normal_in_anchor, *reach_m)?;
                let uv = Some([waypoint.x, waypoint.y]);
                Some(ContactPoint { position_in_link: hit.position, normal_in_link: hit.normal, uv })
            }
            PathFrame::Curved { chart, origin_in_link, lift } => {
                let (point, _) = lift.covers(waypoint.truncate()).then(|| lift.at(waypoint.truncate()))?;
                let hit = self.surface.nearest(*origin_in_link + chart.unproject(point))?;
                let uv = Some([waypoint.x, waypoint.y]);
                Some(ContactPoint { position_in_link: hit.position, normal_in_link: hit.normal, uv })
            }
            PathFrame::Link => {
                let hit = self.surface.nearest(waypoint)?;
                let near = hit.position.distance(waypoint) <= MAX_SURFACE_DISTANCE_M;
                near.then_some(ContactPoint { position_in_link: hit.position, normal_in_link: hit.normal, uv: None })
            }
        }
    }

    /// The direction in the tangent plane at `place` that is at `angle` from +u to +v in the chart, seen along the chart's
    /// normal; in a geodesic chart that of a small step. A link's +u is its +x, or +z if +x is within 10° of the normal.
    pub(super) fn direction(&self, place: &ContactPoint, angle: f64) -> DVec3 {
        let normal = place.normal_in_link;
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let (flat, upward) = match &self.frame {
            PathFrame::Chart { chart, .. } => {
                (chart.u_in_anchor * cos + chart.v_in_anchor * sin, chart.normal_in_anchor)
            }
            PathFrame::Curved { chart, lift, .. } => {
                let at = place.uv.map_or(DVec2::ZERO, DVec2::from_array);
                let ahead = at + DVec2::new(cos, sin) * STEP_M;
                (chart.unproject(lift.at(ahead).0 - lift.at(at).0), normal)
            }
            PathFrame::Link => {
                let u = default_u(normal);
                let u = (u - normal * u.dot(normal)).normalize();
                (u * cos + normal.cross(u) * sin, normal)
            }
        };
        let direction = flat - upward * (flat.dot(normal) / upward.dot(normal));
        direction.try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector())
    }

    /// `vector`, which is tangent to the surface at `place`, along u and v of the chart: turned with the normal, as the engine turns
    /// shear; `None` without a plane chart.
    pub(super) fn in_chart(&self, place: &ContactPoint, vector: DVec3) -> Option<[f64; 2]> {
        let PathFrame::Chart { chart, .. } = &self.frame else { return None };
        let turned = DQuat::from_rotation_arc(place.normal_in_link, chart.normal_in_anchor) * vector;
        Some([turned.dot(chart.u_in_anchor), turned.dot(chart.v_in_anchor)])
    }

    /// Times at most half a millimetre of path apart, s, and the waypoints' times.
    pub(super) fn times_to_check(&self) -> impl Iterator<Item = f64> + '_ {
        let between = self.times_s.windows(2).zip(self.waypoints.windows(2)).flat_map(|(times, ends)| {
            let steps = (ends[0].distance(ends[1]) / STEP_M).clamp(1.0, MAX_STEPS) as u32 + 1;
            let (from, to) = (times[0], times[1]);
            (0..steps).map(move |step| from + (to - from) * (f64::from(step) / f64::from(steps)))
        });
        between.chain(self.times_s.last().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::ChartKind;

    fn path(frame: PathFrame) -> Path {
        let flat = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let surface = Arc::new(SurfaceIndex::of_triangles([flat]));
        Path { frame, surface, waypoints: vec![DVec3::ZERO, DVec3::X], times_s: vec![1.0, 2.0] }
    }

    #[test]
    fn a_direction_on_a_slope_is_seen_at_its_angle_in_the_chart() {
        let chart = Chart {
            kind: ChartKind::Plane,
            u_in_anchor: DVec3::Y,
            v_in_anchor: DVec3::NEG_X,
            normal_in_anchor: DVec3::Z,
            distortion: 0.0,
            distortion_rms: 0.0,
        };
        let on_chart = path(PathFrame::of_field(chart.clone(), DVec3::ZERO, 0.0));
        let normal_in_link = DVec3::new(0.5, -0.3, 0.7).normalize();
        let slope = ContactPoint { position_in_link: DVec3::ZERO, normal_in_link, uv: None };
        for degrees in [0.0_f64, 30.0, 90.0, 135.0, 179.0] {
            let direction = on_chart.direction(&slope, degrees.to_radians());
            assert!(direction.dot(normal_in_link).abs() < 1e-15 && (direction.length() - 1.0).abs() < 1e-15);
            let seen = chart.project(direction);
            assert!((seen.y.atan2(seen.x).to_degrees() - degrees).abs() < 1e-12);
        }
        let on_link = path(PathFrame::Link);
        let along = |normal: DVec3, degrees: f64| {
            let place = ContactPoint { position_in_link: DVec3::ZERO, normal_in_link: normal, uv: None };
            on_link.direction(&place, degrees.to_radians())
        };
        assert!(along(DVec3::Y, 0.0).distance(DVec3::X) < 1e-15);
        assert!(along(DVec3::Y, 90.0).distance(DVec3::NEG_Z) < 1e-15);
        assert!(along(DVec3::X, 0.0).distance(DVec3::Z) < 1e-15);
    }

    #[test]
    fn it_rests_before_and_after_and_moves_evenly_between() {
        let path = path(PathFrame::Link);
        let x = |t_s: f64| path.waypoint(t_s).x;
        assert_eq!([0.0, 1.0, 1.25, 2.0, 9.0].map(x), [0.0, 0.0, 0.25, 1.0, 1.0]);
        let tried: Vec<f64> = path.times_to_check().collect();
        assert!(tried.windows(2).all(|pair| pair[1] > pair[0] && x(pair[1]) - x(pair[0]) <= STEP_M));
        assert_eq!((tried[0], tried[tried.len() - 1]), (1.0, 2.0));
    }
}
