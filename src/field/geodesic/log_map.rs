//! Windows, their priority queue, and the shortest paths that they give.

use std::collections::BinaryHeap;
use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::SurfacePlace;
use super::queue::{QueueEntry, VERTEX_FLAG};
use super::source::{Fan, Source, Start, Wedge, angle, towards};
use crate::body::{NONE, Topology, next};
use crate::error::{Error, Result, failed};

/// First limit of a search, over the straight distance to the farthest point: half a circle, and a margin.
pub(crate) const FIRST_LIMIT: f64 = 1.1 * std::f64::consts::FRAC_PI_2;

/// Number of windows at which a surface counts as too rough.
pub(crate) const MAX_WINDOWS: usize = 2_000_000;

/// Vertices and triangles whose preparation takes as long as a window.
const PREPARED_PER_WINDOW: usize = 50;

/// Relative tolerance in comparing lengths: rounding over a sequence of unfolded triangles.
const ROUNDING: f64 = 1e-12;

/// Windows narrower than this share of their edge are rounding errors.
const MIN_WINDOW_WIDTH: f64 = 1e-12;

/// Paths to one point are different if their departures are further apart than this, 20°.
const MIN_RIVAL_ANGLE: f64 = PI / 9.0;

/// The part of an edge that straight lines from a source reach.
#[derive(Clone, Copy, Debug)]
struct Window {
    /// The edge, as half-edge of the triangle that is entered.
    edge: u32,
    source: u32,
    /// The edge's ends, unfolded with the source at the origin.
    ends: [DVec2; 2],
    /// The part of the edge that is reached, from 0 to 1.
    part: [f64; 2],
    /// The angle of the x-axis at the source, rad.
    base_rad: f64,
    /// The previous window that enters the same triangle.
    before: u32,
}

impl Window {
    fn at(&self, t: f64) -> DVec2 {
        self.ends[0].lerp(self.ends[1], t)
    }

    /// The least distance from the source to what is reached.
    fn nearest(&self) -> f64 {
        let (a, b) = (self.at(self.part[0]), self.at(self.part[1]));
        let along = b - a;
        let t = (-a.dot(along) / along.length_squared()).clamp(0.0, 1.0);
        if t.is_nan() { a.length() } else { a.lerp(b, t).length() }
    }
}

/// The shortest known path to a vertex.
#[derive(Clone, Copy, Debug)]
struct Arrival {
    distance_m: f64,
    angle_rad: f64,
    bend_rad: f64,
    /// An edge that starts at the vertex, and the angle from it to the arriving path.
    edge: u32,
    back_rad: f64,
}

const UNKNOWN: Arrival =
    Arrival { distance_m: f64::INFINITY, angle_rad: 0.0, bend_rad: 0.0, edge: NONE, back_rad: 0.0 };

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
    topology: &'a Topology,
    start: Start,
    limit_m: f64,
    /// The part of the surface that the start is on.
    part: u32,
    sources: Vec<Source>,
    arrivals: Vec<Arrival>,
    windows: Vec<Window>,
    followed: usize,
    /// The largest number of windows to follow.
    most: usize,
    /// Per triangle the last window that enters it.
    entering: Vec<u32>,
    queue: BinaryHeap<QueueEntry>,
    turn: u32,
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
    pub(crate) fn with_windows(
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
            return Err(Error::failed("the chart's origin is on no triangle of the surface"));
        }
        let around_rad = f64::INFINITY;
        let source = Source { distance_m: 0.0, angle_rad: 0.0, bend_rad: 0.0, around_rad, bends: false };
        let mut map = Self {
            topology,
            start: Start::new(topology, place, u),
            limit_m,
            part: topology.part[place.triangle as usize],
            sources: vec![source],
            arrivals: vec![UNKNOWN; topology.positions.len()],
            windows: Vec::new(),
            followed: 0,
            most: *left,
            entering: vec![NONE; topology.triangles.len()],
            queue: BinaryHeap::new(),
            turn: 0,
        };
        if map.start.vertex != NONE {
            map.arrivals[map.start.vertex as usize].distance_m = 0.0;
        }
        for wedge in map.start.wedges.clone() {
            map.start_windows(&wedge, 0);
        }
        let mut done = Ok(());
        while let Some(waiting) = map.queue.pop() {
            match waiting.what & VERTEX_FLAG {
                0 => done = map.follow(waiting.what),
                _ => map.start_at_vertex(waiting.what & !VERTEX_FLAG, waiting.distance_m),
            }
            if done.is_err() {
                break;
            }
        }
        *left -= map.followed;
        done.map(|()| map)
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
        self.followed
    }

    /// The shortest path to `place`; `None` beyond the limit, and on another part of the surface.
    #[must_use]
    pub fn reach(&self, place: &SurfacePlace) -> Option<Reached> {
        // Parts may share a vertex. A path through it would lead to the triangles around it alone, and not back.
        if self.topology.part[place.triangle as usize] != self.part {
            return None;
        }
        let mut ways: Vec<Way> = Vec::new();
        for wedge in self.start.wedges.iter().filter(|wedge| wedge.triangle == place.triangle) {
            let at = mix(wedge.corners, place.barycentric);
            let angle_rad = wedge.base_rad + angle(at);
            ways.push(Way { distance_m: at.length(), angle_rad, bend_rad: 0.0, is_straight: true });
        }
        let mut list = self.entering[place.triangle as usize];
        while let Some(window) = self.windows.get(list as usize) {
            let corner = window.edge as usize % 3;
            let [p, q] = window.ends;
            let third = self.third(window);
            let weights = [0, 1, 2].map(|step| place.barycentric[(corner + step) % 3]);
            ways.push(self.way(window, mix([p, q, third], weights)));
            list = window.before;
        }
        let position = place.position(self.topology);
        for vertex in self.topology.triangles[place.triangle as usize] {
            let Arrival { distance_m, angle_rad, bend_rad, edge, .. } = self.arrivals[vertex as usize];
            let distance_m = distance_m + position.distance(self.topology.positions[vertex as usize]);
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
        let [a, b] = window.part.map(|t| window.at(t));
        // A point beside the window's cone is reached around the window's end.
        let (first, rest) = if a.perp_dot(to) > 0.0 {
            (a, a.distance(to))
        } else if b.perp_dot(to) < 0.0 {
            (b, b.distance(to))
        } else {
            (to, 0.0)
        };
        let source = &self.sources[window.source as usize];
        let own = window.base_rad + angle(first);
        Way {
            distance_m: source.distance_m + first.length() + rest,
            angle_rad: if source.bends { source.angle_rad } else { own },
            bend_rad: source.bend(own),
            is_straight: rest == 0.0,
        }
    }

    /// The unfolded third corner of the triangle beyond the window.
    fn third(&self, window: &Window) -> DVec2 {
        let corner = |edge: u32| self.topology.positions[self.topology.ends(edge).0 as usize];
        let (a, b, c) = (corner(window.edge), corner(next(window.edge)), corner(next(next(window.edge))));
        let (edge, far) = (b - a, c - a);
        let squared = edge.length_squared();
        let [p, q] = window.ends;
        let along = (q - p) * (far.dot(edge) / squared);
        // The triangle is on the left of its own edges.
        p + along + (q - p).perp() * (edge.cross(far).length() / squared)
    }

    fn enqueue(&mut self, distance_m: f64, what: u32) {
        self.turn += 1;
        self.queue.push(QueueEntry { distance_m, turn: self.turn, what });
    }

    /// Starts the windows over `wedge` from source `source`.
    fn start_windows(&mut self, wedge: &Wedge, source: u32) {
        let sides = wedge.apex.map_or(0..3, |apex| (apex + 1) % 3..(apex + 1) % 3 + 1);
        for side in sides {
            let edge = 3 * wedge.triangle + side;
            let [p, q] = [side as usize, (side as usize + 1) % 3].map(|corner| wedge.corners[corner]);
            self.add_window(edge, [q, p], [0.0, 1.0], source, wedge.base_rad);
        }
        for corner in (0..3).filter(|&corner| Some(corner) != wedge.apex) {
            let at = wedge.corners[corner as usize];
            let onward = wedge.corners[(corner as usize + 1) % 3] - at;
            let own = wedge.base_rad + angle(at);
            self.update_vertex(3 * wedge.triangle + corner, at, onward, source, own);
        }
    }

    /// Queues the window of `source` on the other side of edge `edge`.
    fn add_window(&mut self, edge: u32, ends: [DVec2; 2], part: [f64; 2], source: u32, base_rad: f64) {
        let beyond = self.topology.across[edge as usize];
        if beyond == NONE || part[1] - part[0] <= MIN_WINDOW_WIDTH {
            return;
        }
        let window = Window { edge: beyond, source, ends, part, base_rad, before: NONE };
        let distance_m = self.sources[source as usize].distance_m + window.nearest();
        if distance_m <= self.limit_m {
            self.enqueue(distance_m, self.windows.len() as u32);
            self.windows.push(window);
        }
    }

    /// Updates the path from `source` to the vertex where `edge` starts, unfolded at `at`; `onward` is that edge, unfolded.
    fn update_vertex(&mut self, edge: u32, at: DVec2, onward: DVec2, source: u32, own_rad: f64) {
        let vertex = self.topology.ends(edge).0 as usize;
        let from = &self.sources[source as usize];
        let distance_m = from.distance_m + at.length();
        if distance_m < self.arrivals[vertex].distance_m * (1.0 - ROUNDING) {
            let angle_rad = if from.bends { from.angle_rad } else { own_rad };
            let back_rad = angle(DVec2::new(onward.dot(-at), onward.perp_dot(-at)));
            self.arrivals[vertex] = Arrival { distance_m, angle_rad, bend_rad: from.bend(own_rad), edge, back_rad };
            if distance_m <= self.limit_m {
                self.enqueue(distance_m, vertex as u32 | VERTEX_FLAG);
            }
        }
    }

    /// Whether the path through the end `t` of `window` is longer than that via the vertex where `edge` starts.
    fn is_longer_than_via(&self, window: &Window, t: f64, edge: u32, unfolded: DVec2) -> bool {
        let known = self.arrivals[self.topology.ends(edge).0 as usize].distance_m;
        let end = window.at(t);
        let own = self.sources[window.source as usize].distance_m + end.length();
        known + unfolded.distance(end) < own * (1.0 - ROUNDING)
    }

    /// Propagates window `index` through its triangle to the two edges beyond.
    fn follow(&mut self, index: u32) -> Result<()> {
        let window = self.windows[index as usize];
        let [p, q] = window.ends;
        // Any path through it is longer than one via an end of its edge (Xin and Wang 2009).
        if self.is_longer_than_via(&window, window.part[1], window.edge, p)
            || self.is_longer_than_via(&window, window.part[0], next(window.edge), q)
        {
            return Ok(());
        }
        if self.followed == self.most {
            return Err(too_rough(self.limit_m));
        }
        let list = &mut self.entering[window.edge as usize / 3];
        self.windows[index as usize].before = std::mem::replace(list, index);
        self.followed += 1;

        let third = self.third(&window);
        let [a, b] = window.part.map(|t| window.at(t));
        let (right_of_a, left_of_b) = (a.perp_dot(third) <= 0.0, b.perp_dot(third) >= 0.0);
        // The intersection of the line through `ray` with the edge from `from` to `to`.
        let met = |ray: DVec2, from: DVec2, to: DVec2| {
            let (before, after) = (ray.perp_dot(from), ray.perp_dot(to));
            let t = before / (before - after);
            if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) }
        };
        let (right, left) = (next(window.edge), next(next(window.edge)));
        if right_of_a && left_of_b {
            let onward = p - third;
            let own = window.base_rad + angle(third);
            self.update_vertex(left, third, onward, window.source, own);
        }
        if left_of_b {
            // The part of the right edge: from the third corner, or the leftmost line, to the rightmost.
            let from = if right_of_a { 0.0 } else { met(a, third, q) };
            let child = Window { ends: [third, q], part: [from, met(b, third, q)], ..window };
            if !self.is_longer_than_via(&child, child.part[1], window.edge, p) {
                self.add_window(right, child.ends, child.part, child.source, child.base_rad);
            }
        }
        if right_of_a {
            let to = if left_of_b { 1.0 } else { met(b, p, third) };
            let child = Window { ends: [p, third], part: [met(a, p, third), to], ..window };
            if !self.is_longer_than_via(&child, child.part[0], right, q) {
                self.add_window(left, child.ends, child.part, child.source, child.base_rad);
            }
        }
        Ok(())
    }

    /// Starts new windows at `vertex` into the gap that straight lines leave behind it.
    fn start_at_vertex(&mut self, vertex: u32, distance_m: f64) {
        let arrival = self.arrivals[vertex as usize];
        if arrival.distance_m < distance_m || arrival.edge == NONE {
            return;
        }
        let fan = Fan::new(self.topology, arrival.edge);
        // Angles are measured from the fan's first edge; those of the new source from its arriving path.
        let start =
            fan.wedges.iter().find(|wedge| wedge.apex == Some(arrival.edge % 3) && wedge.triangle == arrival.edge / 3);
        let Some(back_rad) = start.map(|wedge| wedge.base_rad + arrival.back_rad) else { return };
        let around_rad = if fan.closed { fan.angle_rad } else { f64::INFINITY };
        if fan.closed && fan.angle_rad <= 2.0 * PI * (1.0 + ROUNDING) {
            return;
        }
        let Arrival { distance_m, angle_rad, bend_rad, .. } = arrival;
        let source = self.sources.len() as u32;
        let mut is_one = false;
        for (index, wedge) in fan.wedges.iter().enumerate() {
            let end = fan.wedges.get(index + 1).map_or(fan.angle_rad, |wedge| wedge.base_rad);
            let (from, to) = (wedge.base_rad - back_rad, end - back_rad);
            // In the gap, the path turns by π or more on both sides. All turns are within ±around.
            let turned = |turn: f64| if fan.closed { turn.rem_euclid(fan.angle_rad) } else { turn };
            let in_gap = match fan.closed {
                true => {
                    let (from, width) = (turned(from), to - from);
                    from + width >= PI && from <= fan.angle_rad - PI
                }
                false => to >= PI || from <= -PI,
            };
            if !in_gap {
                continue;
            }
            if !is_one {
                is_one = true;
                self.sources.push(Source { distance_m, angle_rad, bend_rad, around_rad, bends: true });
            }
            self.start_windows(&Wedge { base_rad: turned(from), ..*wedge }, source);
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
