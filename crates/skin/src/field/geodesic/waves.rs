//! Windows that run over a surface from one start or from several, the nearest first.

use std::collections::BinaryHeap;
use std::f64::consts::PI;

use glam::DVec2;

use super::along_edges::along_edges;
use super::queue::{QueueEntry, VERTEX_FLAG};
use super::source::{Fan, Source, Start, Wedge, angle};
use crate::body::{NONE, Topology, next};

/// Relative tolerance in comparing lengths: rounding over a sequence of unfolded triangles.
const ROUNDING: f64 = 1e-12;

/// Windows narrower than this share of their edge are rounding errors.
const MIN_WINDOW_WIDTH: f64 = 1e-12;

/// A vertex is flat if its total angle is over that of a plane by less than this, rad.
const FLAT_RAD: f64 = 1e-6;

/// The part of an edge that straight lines from a source reach.
#[derive(Clone, Copy, Debug)]
pub(in crate::field) struct Window {
    /// The edge, as half-edge of the triangle that is entered.
    pub(in crate::field) edge: u32,
    pub(super) source: u32,
    /// The edge's ends, unfolded with the source at the origin.
    ends: [DVec2; 2],
    /// The part of the edge that is reached, from 0 to 1.
    pub(super) part: [f64; 2],
    /// The angle of the x-axis at the source, rad.
    pub(super) base_rad: f64,
    /// Whether a gap is beyond each end of the part, which straight lines do not reach.
    is_closed: [bool; 2],
    /// The previous window that enters the same triangle.
    pub(super) before: u32,
}

impl Window {
    pub(super) fn at(&self, t: f64) -> DVec2 {
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
pub(in crate::field) struct Arrival {
    pub(in crate::field) distance_m: f64,
    /// The start that it comes from.
    pub(in crate::field) start: u32,
    pub(super) angle_rad: f64,
    pub(super) bend_rad: f64,
    /// An edge that starts at the vertex, and the angle from it to the arriving path.
    pub(super) edge: u32,
    back_rad: f64,
}

const UNKNOWN: Arrival =
    Arrival { distance_m: f64::INFINITY, start: NONE, angle_rad: 0.0, bend_rad: 0.0, edge: NONE, back_rad: 0.0 };

/// The windows of a search.
pub(in crate::field) struct Waves<'a> {
    pub(in crate::field) topology: &'a Topology,
    limit_m: f64,
    pub(super) sources: Vec<Source>,
    /// Per vertex the shortest path to it.
    pub(in crate::field) arrivals: Vec<Arrival>,
    windows: Vec<Window>,
    /// Windows that lead nowhere, to be used again.
    free: Vec<u32>,
    pub(super) followed: usize,
    /// The largest number of windows to follow.
    most: usize,
    /// Per triangle the last window that enters it.
    entering: Vec<u32>,
    queue: BinaryHeap<QueueEntry>,
    turn: u32,
    /// Per vertex whether straight lines leave a gap behind it; empty if that is not asked.
    leaves_gap: Vec<bool>,
    /// Per vertex the length of a path to it along edges, which is no shorter than the shortest, m; empty as above. Without it,
    /// windows past a vertex that rounding hides, as between needles, would never end.
    along_edges_m: Vec<f64>,
    /// Per edge the nearest source that sees the third corner of its triangle over it; empty as above.
    splitter: Vec<Splitter>,
}

/// A source of a window that splits at the corner across its edge.
#[derive(Clone, Copy, Debug)]
struct Splitter {
    /// Length of the path to the corner, m.
    distance_m: f64,
    /// Along the edge from its first end, and in front of it, m.
    place: DVec2,
}

const NO_SPLITTER: Splitter = Splitter { distance_m: f64::INFINITY, place: DVec2::ZERO };

impl<'a> Waves<'a> {
    /// Without a start; no path gets longer than `limit_m`, and at most `most` windows are followed.
    pub(in crate::field) fn new(topology: &'a Topology, limit_m: f64, most: usize) -> Self {
        Self {
            topology,
            limit_m,
            sources: Vec::new(),
            arrivals: vec![UNKNOWN; topology.positions.len()],
            windows: Vec::new(),
            free: Vec::new(),
            followed: 0,
            most,
            entering: vec![NONE; topology.triangles.len()],
            queue: BinaryHeap::new(),
            turn: 0,
            leaves_gap: Vec::new(),
            along_edges_m: Vec::new(),
            splitter: Vec::new(),
        }
    }

    /// The same, to be asked for [`Self::extended_length`].
    pub(in crate::field) fn extending(topology: &'a Topology, limit_m: f64, most: usize) -> Self {
        let mut around_rad = vec![0.0; topology.positions.len()];
        // Straight lines leave a gap behind a vertex with more than a full turn of surface, at an edge with more than half of one.
        let mut flat_rad = vec![2.0 * PI; topology.positions.len()];
        for (triangle, corners) in (0..).zip(&topology.triangles) {
            let [a, b, c] = topology.corners(triangle);
            let angles = [(b - a, c - a), (c - b, a - b), (a - c, b - c)];
            for ((corner, (from, to)), edge) in corners.iter().zip(angles).zip(3 * triangle..) {
                around_rad[*corner as usize] += libm::atan2(from.cross(to).length(), from.dot(to));
                if topology.across[edge as usize] == NONE {
                    let (from, to) = topology.ends(edge);
                    (flat_rad[from as usize], flat_rad[to as usize]) = (PI, PI);
                }
            }
        }
        let leaves_gap = around_rad.iter().zip(flat_rad).map(|(around, flat)| *around > flat + FLAT_RAD).collect();
        let splitter = vec![NO_SPLITTER; topology.across.len()];
        Self { leaves_gap, splitter, ..Self::new(topology, limit_m, most) }
    }

    /// Adds the start `number`.
    pub(in crate::field) fn add(&mut self, start: &Start, number: u32) {
        let source = self.sources.len() as u32;
        let around_rad = f64::INFINITY;
        let own = Source { distance_m: 0.0, start: number, angle_rad: 0.0, bend_rad: 0.0, around_rad, bends: false };
        self.sources.push(own);
        if start.vertex != NONE {
            let arrival = &mut self.arrivals[start.vertex as usize];
            (arrival.distance_m, arrival.start) = (0.0, number);
        }
        for wedge in &start.wedges {
            self.start_windows(wedge, source);
        }
    }

    /// Follows all windows; whether there were few enough.
    pub(in crate::field) fn run(&mut self) -> bool {
        if !self.leaves_gap.is_empty() {
            let known = self.arrivals.iter().map(|arrival| arrival.distance_m).collect();
            self.along_edges_m = along_edges(self.topology, known);
        }
        while let Some(waiting) = self.queue.pop() {
            match waiting.what & VERTEX_FLAG {
                0 if self.followed == self.most && !self.is_idle(waiting.what) => return false,
                0 => self.follow(waiting.what),
                _ => self.start_at_vertex(waiting.what & !VERTEX_FLAG, waiting.distance_m),
            }
        }
        true
    }

    /// The windows that enter `triangle`.
    pub(in crate::field) fn entering(&self, triangle: u32) -> impl Iterator<Item = &Window> {
        let at = |index: u32| self.windows.get(index as usize);
        std::iter::successors(at(self.entering[triangle as usize]), move |window| at(window.before))
    }

    /// The start that `window` comes from.
    pub(in crate::field) fn start_of(&self, window: &Window) -> u32 {
        self.sources[window.source as usize].start
    }

    /// The ends of the edge of `window`, and the third corner of the triangle that it enters, unfolded.
    pub(in crate::field) fn unfolded(&self, window: &Window) -> [DVec2; 3] {
        let [p, q] = window.ends;
        [p, q, self.third(window)]
    }

    /// Length of the path through `window` to the unfolded point `to`, m.
    pub(in crate::field) fn length_to(&self, window: &Window, to: DVec2) -> f64 {
        let (first, rest) = self.through(window, to);
        self.sources[window.source as usize].distance_m + first.length() + rest
    }

    /// As [`Self::length_to`], but along a straight line also beside the window's cone, if there is no gap.
    pub(in crate::field) fn extended_length(&self, window: &Window, to: DVec2) -> f64 {
        let [a, b] = window.part.map(|t| window.at(t));
        let is_near = |end: DVec2| end.dot(to) > 0.0;
        let is_beyond = [a.perp_dot(to) > 0.0, b.perp_dot(to) < 0.0];
        let is_extended = (is_beyond[0] && !window.is_closed[0] && is_near(a))
            || (!is_beyond[0] && is_beyond[1] && !window.is_closed[1] && is_near(b));
        match is_extended {
            true => self.sources[window.source as usize].distance_m + to.length(),
            false => self.length_to(window, to),
        }
    }

    fn leaves_gap(&self, vertex: u32) -> bool {
        self.leaves_gap.get(vertex as usize).copied().unwrap_or(true)
    }

    /// The first bend of the path through `window` to `to`, or `to` itself, and the length beyond it, m.
    pub(super) fn through(&self, window: &Window, to: DVec2) -> (DVec2, f64) {
        let [a, b] = window.part.map(|t| window.at(t));
        // A point beside the window's cone is reached around the window's end.
        if a.perp_dot(to) > 0.0 {
            (a, a.distance(to))
        } else if b.perp_dot(to) < 0.0 {
            (b, b.distance(to))
        } else {
            (to, 0.0)
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
            let (first, last) = self.topology.ends(edge);
            let is_closed = [last, first].map(|vertex| self.leaves_gap(vertex));
            let (ends, part, base_rad) = ([q, p], [0.0, 1.0], wedge.base_rad);
            self.add_window(Window { edge, source, ends, part, base_rad, is_closed, before: NONE });
        }
        for corner in (0..3).filter(|&corner| Some(corner) != wedge.apex) {
            let at = wedge.corners[corner as usize];
            let onward = wedge.corners[(corner as usize + 1) % 3] - at;
            let own = wedge.base_rad + angle(at);
            self.update_vertex(3 * wedge.triangle + corner, at, onward, source, own);
        }
    }

    /// Queues `window`, which leaves a triangle, on the other side of its edge.
    fn add_window(&mut self, window: Window) {
        let beyond = self.topology.across[window.edge as usize];
        if beyond == NONE || window.part[1] - window.part[0] <= MIN_WINDOW_WIDTH {
            return;
        }
        let window = Window { edge: beyond, ..window };
        let distance_m = self.sources[window.source as usize].distance_m + window.nearest();
        if distance_m <= self.limit_m {
            let index = self.free.pop().unwrap_or(self.windows.len() as u32);
            self.enqueue(distance_m, index);
            match self.windows.get_mut(index as usize) {
                Some(slot) => *slot = window,
                None => self.windows.push(window),
            }
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
            self.arrivals[vertex] =
                Arrival { distance_m, start: from.start, angle_rad, bend_rad: from.bend(own_rad), edge, back_rad };
            if distance_m <= self.limit_m {
                self.enqueue(distance_m, vertex as u32 | VERTEX_FLAG);
            }
        }
    }

    /// Whether the path through the end `t` of `window` is longer than that via the vertex where `edge` starts.
    fn is_longer_than_via(&self, window: &Window, t: f64, edge: u32, unfolded: DVec2) -> bool {
        let vertex = self.topology.ends(edge).0 as usize;
        let known = self.arrivals[vertex].distance_m;
        let known = self.along_edges_m.get(vertex).map_or(known, |along| known.min(*along));
        let end = window.at(t);
        let own = self.sources[window.source as usize].distance_m + end.length();
        known + unfolded.distance(end) < own * (1.0 - ROUNDING)
    }

    /// Whether any path through window `index` is longer than one via an end of its edge (Xin and Wang 2009).
    fn is_idle(&self, index: u32) -> bool {
        let window = &self.windows[index as usize];
        let [p, q] = window.ends;
        self.is_longer_than_via(window, window.part[1], window.edge, p)
            || self.is_longer_than_via(window, window.part[0], next(window.edge), q)
    }

    /// Propagates window `index` through its triangle to the two edges beyond.
    fn follow(&mut self, index: u32) {
        if self.is_idle(index) {
            self.free.push(index);
            return;
        }
        let window = self.windows[index as usize];
        let [p, q] = window.ends;
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
        let is_third_closed = self.leaves_gap(self.topology.ends(left).0);
        if right_of_a && left_of_b {
            let onward = p - third;
            let own = window.base_rad + angle(third);
            self.update_vertex(left, third, onward, window.source, own);
        }
        let [is_left_needed, is_right_needed] = match right_of_a && left_of_b {
            true => self.sides_needed(&window, third),
            false => [true; 2],
        };
        if left_of_b && is_right_needed {
            // The part of the right edge: from the third corner, or the leftmost line, to the rightmost.
            let from = if right_of_a { 0.0 } else { met(a, third, q) };
            let is_closed = [if right_of_a { is_third_closed } else { window.is_closed[0] }, window.is_closed[1]];
            let child = Window { ends: [third, q], part: [from, met(b, third, q)], is_closed, ..window };
            if !self.is_longer_than_via(&child, child.part[1], window.edge, p) {
                self.add_window(Window { edge: right, ..child });
            }
        }
        if right_of_a && is_left_needed {
            let to = if left_of_b { 1.0 } else { met(b, p, third) };
            let is_closed = [window.is_closed[0], if left_of_b { is_third_closed } else { window.is_closed[1] }];
            let child = Window { ends: [p, third], part: [met(a, p, third), to], is_closed, ..window };
            if !self.is_longer_than_via(&child, child.part[0], right, q) {
                self.add_window(Window { edge: left, ..child });
            }
        }
    }

    /// Whether the parts left and right of the corner `third`, which `window` sees, can be nearest to its source. Of two sources
    /// that see it over the same edge, the farther one is nearest on its own side only (Chen and Han 1990).
    fn sides_needed(&mut self, window: &Window, third: DVec2) -> [bool; 2] {
        let Some(known) = self.splitter.get_mut(window.edge as usize) else { return [true; 2] };
        let [p, q] = window.ends;
        let along = (q - p).normalize_or_zero();
        let in_edge = |at: DVec2| DVec2::new((at - p).dot(along), along.perp_dot(at - p));
        let (place, corner) = (in_edge(DVec2::ZERO), in_edge(third));
        let distance_m = self.sources[window.source as usize].distance_m + third.length();
        if distance_m < known.distance_m {
            *known = Splitter { distance_m, place };
            return [true; 2];
        }
        let is_left = (corner - known.place).perp_dot(place - known.place) > 0.0;
        [is_left, !is_left]
    }

    /// Starts new windows at `vertex` into the gap that straight lines leave behind it.
    fn start_at_vertex(&mut self, vertex: u32, distance_m: f64) {
        let arrival = self.arrivals[vertex as usize];
        if arrival.distance_m < distance_m || arrival.edge == NONE {
            return;
        }
        let fan = Fan::new(self.topology, arrival.edge);
        // Angles are measured from the fan's first edge; those of the new source from its arriving path.
        let first =
            fan.wedges.iter().find(|wedge| wedge.apex == Some(arrival.edge % 3) && wedge.triangle == arrival.edge / 3);
        let Some(back_rad) = first.map(|wedge| wedge.base_rad + arrival.back_rad) else { return };
        let around_rad = if fan.closed { fan.angle_rad } else { f64::INFINITY };
        if fan.closed && fan.angle_rad <= 2.0 * PI * (1.0 + ROUNDING) {
            return;
        }
        let Arrival { distance_m, start, angle_rad, bend_rad, .. } = arrival;
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
                self.sources.push(Source { distance_m, start, angle_rad, bend_rad, around_rad, bends: true });
            }
            self.start_windows(&Wedge { base_rad: turned(from), ..*wedge }, source);
        }
    }
}
