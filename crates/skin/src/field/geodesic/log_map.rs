//! The shortest paths from one point, with their lengths and initial directions.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::SurfacePlace;
use super::source::{Start, angle, towards};
use super::waves::{Arrival, Waves, Window};
use crate::body::{NONE, Topology};
use crate::error::{Error, Result, failed};

/// First limit of a search, over the straight distance to the farthest point: half a circle, and a margin.
pub const FIRST_LIMIT: f64 = 1.1 * std::f64::consts::FRAC_PI_2;

/// Number of windows at which a surface counts as too rough.
pub const MAX_WINDOWS: usize = 2_000_000;

/// Vertices and triangles whose preparation takes as long as a window.
const PREPARED_PER_WINDOW: usize = 50;

/// Paths to one point are different if their departures are further apart than this, 20°.
const MIN_RIVAL_ANGLE: f64 = PI / 9.0;

/// The shortest path to a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    /// (u, v), m: the path's length in its initial direction.
    pub uv: DVec2,
    /// Length of the path, m.
    pub distance_m: f64,
    /// The largest bend of the path at one point, rad: over 0 around a hole or the surface's edge and, slightly, on a saddle.
    pub bend_rad: f64,
    /// The shortest other geodesic that departs over 20° apart, if any was found.
    pub rival: Option<Rival>,
}

/// A candidate path to a place.
struct Way {
    distance_m: f64,
    angle_rad: f64,
    bend_rad: f64,
    /// Whether it is straight through its last window; else it can be shortened.
    is_straight: bool,
}

/// A second path to a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rival {
    /// Its length, m.
    pub distance_m: f64,
    /// The angle between the two departures, rad.
    pub apart_rad: f64,
}

/// Shortest paths from one point of a surface to all others up to a length.
pub struct LogMap<'a> {
    start: Start,
    /// The part of the surface that the start is on.
    part: u32,
    waves: Waves<'a>,
}

impl<'a> LogMap<'a> {
    /// Computes all shortest paths from `place` up to the length `limit_m`; +u is along the tangential part of `u`, angles are
    /// counter-clockwise seen from outside. At a vertex angles are scaled to a full turn.
    ///
    /// # Errors
    /// `place` is on no triangle, or the surface is too rough, with too many windows.
    pub fn new(topology: &'a Topology, place: SurfacePlace, u: DVec3, limit_m: f64) -> Result<Self> {
        Self::with_windows(topology, place, u, limit_m, &mut { MAX_WINDOWS })
    }

    /// The same with at most `left` windows, from which those that it takes are subtracted.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_windows(
        topology: &'a Topology,
        place: SurfacePlace,
        u: DVec3,
        limit_m: f64,
        left: &mut usize,
    ) -> Result<Self> {
        let prepared = (topology.positions.len() + topology.triangles.len()) / PREPARED_PER_WINDOW;
        // Without a limit of its own, preparing it costs nothing.
        if *left < MAX_WINDOWS {
            *left = left.saturating_sub(prepared);
            if *left == 0 {
                return Err(too_rough(limit_m));
            }
        }
        if place.triangle as usize >= topology.triangles.len() {
            return Err(Error::failed("the chart's origin is not on the surface; move it there"));
        }
        let start = Start::new(topology, place, u);
        let part = topology.part[place.triangle as usize];
        let mut map = Self { start, part, waves: Waves::new(topology, limit_m, *left) };
        map.waves.add(&map.start, 0);
        let done = map.waves.run();
        *left -= map.waves.followed;
        if done { Ok(map) } else { Err(too_rough(limit_m)) }
    }

    /// The start, and its tangent frame: (origin, u, v, normal).
    #[must_use]
    pub fn frame(&self) -> [DVec3; 4] {
        let Start { position, u, normal, .. } = self.start;
        [position, u, normal.cross(u), normal]
    }

    /// Number of followed windows.
    #[must_use]
    pub fn windows(&self) -> usize {
        self.waves.followed
    }

    /// The shortest path to `place`; `None` beyond the limit, and on another part of the surface.
    #[must_use]
    pub fn reach(&self, place: &SurfacePlace) -> Option<Reached> {
        // Parts may share a vertex. A path through it would lead to the triangles around it alone, and not back.
        let topology = self.waves.topology;
        if topology.part[place.triangle as usize] != self.part {
            return None;
        }
        let mut ways: Vec<Way> = Vec::new();
        for wedge in self.start.wedges.iter().filter(|wedge| wedge.triangle == place.triangle) {
            let at = mix(wedge.corners, place.barycentric);
            let angle_rad = wedge.base_rad + angle(at);
            ways.push(Way { distance_m: at.length(), angle_rad, bend_rad: 0.0, is_straight: true });
        }
        for window in self.waves.entering(place.triangle) {
            let corner = window.edge as usize % 3;
            let weights = [0, 1, 2].map(|step| place.barycentric[(corner + step) % 3]);
            ways.push(self.way(window, mix(self.waves.unfolded(window), weights)));
        }
        let position = place.position(topology);
        for vertex in topology.triangles[place.triangle as usize] {
            let Arrival { distance_m, angle_rad, bend_rad, edge, .. } = self.waves.arrivals[vertex as usize];
            let distance_m = distance_m + position.distance(topology.positions[vertex as usize]);
            if edge != NONE {
                ways.push(Way { distance_m, angle_rad, bend_rad, is_straight: false });
            }
        }
        let shortest = |a: &&Way, b: &&Way| a.distance_m.total_cmp(&b.distance_m);
        let &Way { distance_m, angle_rad, bend_rad, .. } = ways.iter().min_by(shortest)?;
        let angle_rad = self.start.in_plane(angle_rad);
        let apart = |other: &Way| {
            let apart = (self.start.in_plane(other.angle_rad) - angle_rad).abs();
            apart.min(2.0 * PI - apart)
        };
        let rival = ways.iter().filter(|way| way.is_straight && apart(way) > MIN_RIVAL_ANGLE).min_by(shortest);
        let rival = rival.map(|way| Rival { distance_m: way.distance_m, apart_rad: apart(way) });
        Some(Reached { uv: towards(angle_rad) * distance_m, distance_m, bend_rad, rival })
    }

    /// The path through `window` to the unfolded point `to`.
    fn way(&self, window: &Window, to: DVec2) -> Way {
        let (first, rest) = self.waves.through(window, to);
        let source = &self.waves.sources[window.source as usize];
        let own = window.base_rad + angle(first);
        Way {
            distance_m: source.distance_m + first.length() + rest,
            angle_rad: if source.bends { source.angle_rad } else { own },
            bend_rad: source.bend(own),
            is_straight: rest == 0.0,
        }
    }
}

fn too_rough(limit_m: f64) -> Error {
    failed!(
        "the surface within {limit_m:.3} m of the chart's origin is too rough to measure ways on; simplify or smooth it"
    )
}

fn mix([a, b, c]: [DVec2; 3], weights: [f64; 3]) -> DVec2 {
    a * weights[0] + b * weights[1] + c * weights[2]
}
