//! Where a touch is over time: waypoints, and the surface under them.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::body::SurfaceIndex;
use crate::field::{Chart, Lift};

/// A waypoint in a link's frame may lie so far off the surface, and a chart's surface so far beyond its members' depth.
const REACH_M: f64 = 0.02;
/// Distance between the places at which a path is tried before it is taken.
const STEP_M: f64 = 5e-4;
/// Most places tried between two waypoints.
const MOST_STEPS: f64 = 20_000.0;
/// cos 10°: how near the normal may come to the link's +x before +z takes its place.
const NEARLY_PARALLEL: f64 = 0.984_807_753_012_208;

/// In what coordinates the waypoints are.
#[derive(Clone, Debug)]
pub(super) enum Ground {
    /// (u, v, 0) in a field's chart, taken along its normal to the surface.
    Chart { chart: Chart, origin_in_link: DVec3, reach_m: f64 },
    /// (u, v, 0) in a field's geodesic chart, taken to the surface as percepts' positions are.
    Curved { chart: Chart, origin_in_link: DVec3, lift: Box<Lift> },
    /// Points in the link's frame, taken to the nearest point of the surface.
    Link,
}

impl Ground {
    /// Of a field whose members lie up to `deepest_m` from its chart's plane.
    pub(super) fn of_field(chart: Chart, origin_in_link: DVec3, deepest_m: f64) -> Self {
        Self::Chart { chart, origin_in_link, reach_m: 2.0 * deepest_m + REACH_M }
    }
}

/// A point of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) position_in_link: DVec3,
    pub(super) normal_in_link: DVec3,
    pub(super) uv: Option<[f64; 2]>,
}

/// Waypoints and the times at which they are passed; before the first and after the last the touch rests there.
#[derive(Clone, Debug)]
pub(super) struct Path {
    pub(super) ground: Ground,
    pub(super) surface: Arc<SurfaceIndex>,
    pub(super) waypoints: Vec<DVec3>,
    /// One a waypoint, increasing, s.
    pub(super) times_s: Vec<f64>,
}

impl Path {
    /// The waypoint's coordinates at `t_s`, before they are taken to the surface.
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
    pub(super) fn place(&self, t_s: f64) -> Option<Place> {
        let waypoint = self.waypoint(t_s);
        match &self.ground {
            Ground::Chart { chart, origin_in_link, reach_m } => {
                let above = *origin_in_link + chart.unproject(waypoint);
                let hit = self.surface.along(above, chart.normal_in_anchor, *reach_m)?;
                let uv = Some([waypoint.x, waypoint.y]);
                Some(Place { position_in_link: hit.position, normal_in_link: hit.normal, uv })
            }
            Ground::Curved { chart, origin_in_link, lift } => {
                let (point, _) = lift.covers(waypoint.truncate()).then(|| lift.at(waypoint.truncate()))?;
                let hit = self.surface.nearest(*origin_in_link + chart.unproject(point))?;
                let uv = Some([waypoint.x, waypoint.y]);
                Some(Place { position_in_link: hit.position, normal_in_link: hit.normal, uv })
            }
            Ground::Link => {
                let hit = self.surface.nearest(waypoint)?;
                let near = hit.position.distance(waypoint) <= REACH_M;
                near.then_some(Place { position_in_link: hit.position, normal_in_link: hit.normal, uv: None })
            }
        }
    }

    /// In the tangent plane at `place`, the direction at `angle` from +u to +v: seen along the chart's normal it lies at
    /// that angle in the chart; in a geodesic chart it leads where a small step at that angle does. A link's +u is its +x, or +z where that is within 10° of the normal.
    pub(super) fn direction(&self, place: &Place, angle: f64) -> DVec3 {
        let normal = place.normal_in_link;
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let (flat, upward) = match &self.ground {
            Ground::Chart { chart, .. } => (chart.u_in_anchor * cos + chart.v_in_anchor * sin, chart.normal_in_anchor),
            Ground::Curved { chart, lift, .. } => {
                let at = place.uv.map_or(DVec2::ZERO, DVec2::from_array);
                let ahead = at + DVec2::new(cos, sin) * STEP_M;
                (chart.unproject(lift.at(ahead).0 - lift.at(at).0), normal)
            }
            Ground::Link => {
                let u = if normal.x.abs() > NEARLY_PARALLEL { DVec3::Z } else { DVec3::X };
                let u = (u - normal * u.dot(normal)).normalize();
                (u * cos + normal.cross(u) * sin, normal)
            }
        };
        let direction = flat - upward * (flat.dot(normal) / upward.dot(normal));
        direction.try_normalize().unwrap_or_else(|| normal.any_orthonormal_vector())
    }

    /// Times that leave no more than half a millimetre of path between them, s, and the waypoints' own.
    pub(super) fn times_to_try(&self) -> impl Iterator<Item = f64> + '_ {
        let between = self.times_s.windows(2).zip(self.waypoints.windows(2)).flat_map(|(times, ends)| {
            let steps = (ends[0].distance(ends[1]) / STEP_M).clamp(1.0, MOST_STEPS) as u32 + 1;
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

    fn path(ground: Ground) -> Path {
        let flat = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let surface = Arc::new(SurfaceIndex::of_triangles([flat]));
        Path { ground, surface, waypoints: vec![DVec3::ZERO, DVec3::X], times_s: vec![1.0, 2.0] }
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
        let on_chart = path(Ground::of_field(chart.clone(), DVec3::ZERO, 0.0));
        let normal_in_link = DVec3::new(0.5, -0.3, 0.7).normalize();
        let slope = Place { position_in_link: DVec3::ZERO, normal_in_link, uv: None };
        for degrees in [0.0_f64, 30.0, 90.0, 135.0, 179.0] {
            let direction = on_chart.direction(&slope, degrees.to_radians());
            assert!(direction.dot(normal_in_link).abs() < 1e-15 && (direction.length() - 1.0).abs() < 1e-15);
            let seen = chart.project(direction);
            assert!((seen.y.atan2(seen.x).to_degrees() - degrees).abs() < 1e-12);
        }
        let on_link = path(Ground::Link);
        let along = |normal: DVec3, degrees: f64| {
            let place = Place { position_in_link: DVec3::ZERO, normal_in_link: normal, uv: None };
            on_link.direction(&place, degrees.to_radians())
        };
        assert!(along(DVec3::Y, 0.0).distance(DVec3::X) < 1e-15);
        assert!(along(DVec3::Y, 90.0).distance(DVec3::NEG_Z) < 1e-15);
        assert!(along(DVec3::X, 0.0).distance(DVec3::Z) < 1e-15);
    }

    #[test]
    fn it_rests_before_and_after_and_moves_evenly_between() {
        let path = path(Ground::Link);
        let x = |t_s: f64| path.waypoint(t_s).x;
        assert_eq!([0.0, 1.0, 1.25, 2.0, 9.0].map(x), [0.0, 0.0, 0.25, 1.0, 1.0]);
        let tried: Vec<f64> = path.times_to_try().collect();
        assert!(tried.windows(2).all(|pair| pair[1] > pair[0] && x(pair[1]) - x(pair[0]) <= STEP_M));
        assert_eq!((tried[0], tried[tried.len() - 1]), (1.0, 2.0));
    }
}
