//! Distances to several points over parts of a surface whose triangles are small beside the cells.
//!
//! Exact windows would be tens on each edge there. Instead the corners of triangles get their distances to a point one after the other,
//! the nearest first. In a triangle two of whose corners have theirs, these say where the point is in the triangle's plane. If the
//! straight line from there to the third corner crosses the edge between the two, its length is the distance; else the path runs along an
//! edge (fast marching with spherical fronts: Novotni and Klein, 2002). On a plane, lines that cross edges are exact. Where a cell has
//! 400 triangles, areas are off by up to 2 %, lengths of paths by up to 4 %.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use super::super::geodesic::Start;
use super::polygon::Candidate;
use crate::body::Topology;

/// Points that a corner has the distance to: its own, and those beyond a border nearby.
const KEPT: usize = 4;

/// The points that are near a corner, the nearest first.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
struct Near {
    count: u8,
    sites: [u32; KEPT],
    distances_m: [f64; KEPT],
}

impl Near {
    fn to(&self, site: u32) -> Option<f64> {
        let known = self.sites[..self.count as usize].iter().position(|&known| known == site)?;
        Some(self.distances_m[known])
    }

    /// Notes the distance to `site`, if that is less than what is noted and one of the least; whether it is. Else it would find no room:
    /// those noted come first.
    fn lower(&mut self, site: u32, distance_m: f64) -> bool {
        let count = self.count as usize;
        let at = match self.sites[..count].iter().position(|&known| known == site) {
            Some(known) if self.distances_m[known] <= distance_m => return false,
            Some(known) => known,
            None if count < KEPT => {
                self.count += 1;
                count
            }
            None => {
                let farther = |a: usize, b: usize| if self.distances_m[b] > self.distances_m[a] { b } else { a };
                let last = (1..KEPT).fold(0, farther);
                if self.distances_m[last] < distance_m {
                    return false;
                }
                last
            }
        };
        (self.sites[at], self.distances_m[at]) = (site, distance_m);
        true
    }
}

/// An arrival at a corner that may be the first from its point.
struct Coming {
    distance_m: f64,
    vertex: u32,
    site: u32,
}

/// The triangles that are marched over, by their corners.
pub(super) struct Ground {
    /// Per vertex where its half-edges begin in `leaving`.
    first: Vec<u32>,
    /// The half-edges that leave each vertex, one vertex after the other.
    leaving: Vec<u32>,
    /// Per vertex its longest edge, m.
    longest_m: Vec<f64>,
}

impl Ground {
    /// Those triangles of `topology` for which `is_marched` is true.
    pub(super) fn new(topology: &Topology, is_marched: impl Fn(u32) -> bool) -> Self {
        let vertices = topology.positions.len();
        let mut first = vec![0_u32; vertices + 1];
        let edges = || (0..topology.triangles.len() as u32).filter(|&triangle| is_marched(triangle));
        let edges = || edges().flat_map(|triangle| 3 * triangle..3 * triangle + 3);
        let mut longest_m = vec![0.0_f64; vertices];
        for edge in edges() {
            let (from, to) = topology.ends(edge);
            first[from as usize + 1] += 1;
            let length_m = topology.positions[from as usize].distance(topology.positions[to as usize]);
            for vertex in [from, to] {
                longest_m[vertex as usize] = longest_m[vertex as usize].max(length_m);
            }
        }
        (1..first.len()).for_each(|vertex| first[vertex] += first[vertex - 1]);
        let mut next = first.clone();
        let mut leaving = vec![0; first[vertices] as usize];
        for edge in edges() {
            let from = topology.ends(edge).0 as usize;
            leaving[next[from] as usize] = edge;
            next[from] += 1;
        }
        Self { first, leaving, longest_m }
    }
}

/// Distances of corners to points.
pub(super) struct Marched<'a> {
    topology: &'a Topology,
    ground: &'a Ground,
    near: Vec<Near>,
    /// Per vertex the least distances that are or were in the queue.
    coming: Vec<Near>,
    queue: BinaryHeap<Coming>,
    /// Nothing is farther from a point than this, m.
    reach_m: f64,
}

impl<'a> Marched<'a> {
    /// On the triangles `ground` of `topology`, as far as `reach_m` from a point.
    pub(super) fn new(topology: &'a Topology, ground: &'a Ground, reach_m: f64) -> Self {
        let vertices = if ground.leaving.is_empty() { 0 } else { topology.positions.len() };
        let near = vec![Near::default(); vertices];
        Self { topology, ground, coming: near.clone(), near, queue: BinaryHeap::new(), reach_m }
    }

    /// Adds the point `site`, from which distances start at `start`.
    pub(super) fn add(&mut self, start: &Start, site: u32) {
        for wedge in &start.wedges {
            let corners = self.topology.triangles[wedge.triangle as usize];
            self.queue.extend(corners.into_iter().zip(wedge.corners).map(|(vertex, corner)| Coming {
                distance_m: corner.length(),
                vertex,
                site,
            }));
        }
    }

    /// Finds all distances.
    pub(super) fn run(&mut self) {
        while let Some(Coming { distance_m, vertex, site }) = self.queue.pop() {
            if !self.arrive(vertex, site, distance_m) {
                continue;
            }
            let [from, to] = [0, 1].map(|step| self.ground.first[vertex as usize + step] as usize);
            for &edge in &self.ground.leaving[from..to] {
                let corners = self.topology.triangles[edge as usize / 3];
                let own = edge as usize % 3;
                let sides = [1, 2].map(|step| corners[(own + step) % 3]);
                let known = sides.map(|side| self.near[side as usize].to(site));
                for (to, via) in [(0, 1), (1, 0)] {
                    if known[to].is_some() || self.near[sides[to] as usize].count as usize == KEPT {
                        continue;
                    }
                    let known = [Some(distance_m), known[via]];
                    let distance_m = self.by_corners(sides[to], [vertex, sides[via]], known);
                    if !self.is_far(sides[to], distance_m) && self.coming[sides[to] as usize].lower(site, distance_m) {
                        self.queue.push(Coming { distance_m, vertex: sides[to], site });
                    }
                }
            }
        }
    }

    /// Whether nothing that arrives at `vertex` after `distance_m` is noted there: it is beyond the reach, or beyond the triangles at a
    /// border, where nothing is to be known of the point on the other side.
    fn is_far(&self, vertex: u32, distance_m: f64) -> bool {
        let (near, coming) = (&self.near[vertex as usize], &self.coming[vertex as usize]);
        // The first to arrive is no farther than what is in the queue.
        let first_m = match near.count {
            0 => coming.distances_m[..coming.count as usize].iter().copied().fold(f64::INFINITY, f64::min),
            _ => near.distances_m[0],
        };
        distance_m > first_m + self.ground.longest_m[vertex as usize] || distance_m > self.reach_m
    }

    /// Whether `site` is the first from there at `vertex`, and near enough to count.
    fn arrive(&mut self, vertex: u32, site: u32, distance_m: f64) -> bool {
        let near = &self.near[vertex as usize];
        let count = near.count as usize;
        let is_far = count > 0 && self.is_far(vertex, distance_m);
        if count == KEPT || is_far || distance_m > self.reach_m || near.to(site).is_some() {
            return false;
        }
        let near = &mut self.near[vertex as usize];
        (near.sites[count], near.distances_m[count], near.count) = (site, distance_m, near.count + 1);
        true
    }

    /// The distance of vertex `to` to a point, by the distances `known` of the vertices `from`, which are in a triangle with it.
    fn by_corners(&self, to: u32, from: [u32; 2], known: [Option<f64>; 2]) -> f64 {
        let at = |vertex: u32| self.topology.positions[vertex as usize];
        let along = |which: usize| known[which].map_or(f64::INFINITY, |known| known + at(from[which]).distance(at(to)));
        let along_m = along(0).min(along(1));
        let [Some(a), Some(b)] = known else { return along_m };
        // In the plane, the first at the origin and the second on the x-axis; the corner is above, the point below.
        let (p, side) = (at(from[0]), at(from[1]) - at(from[0]));
        let length = side.length();
        let offset = at(to) - p;
        let x = offset.dot(side) / length;
        let y = (offset.length_squared() - x * x).max(0.0).sqrt();
        let source_x = (a * a - b * b + length * length) / (2.0 * length);
        let below = a * a - source_x * source_x;
        if !(below > 0.0 && length > 0.0) {
            return along_m;
        }
        let below = below.sqrt();
        let crossing = source_x + (x - source_x) * below / (below + y);
        if !(0.0..=length).contains(&crossing) {
            return along_m;
        }
        libm::hypot(x - source_x, y + below).min(along_m)
    }

    /// The distance of `vertex` to its nearest point.
    pub(super) fn least_m(&self, vertex: u32) -> f64 {
        let near = &self.near[vertex as usize];
        if near.count > 0 { near.distances_m[0] } else { f64::INFINITY }
    }

    /// Adds to `candidates` the points that are near the corners of `triangle`.
    pub(super) fn reaching(&self, triangle: u32, candidates: &mut Vec<Candidate>) {
        let vertices = self.topology.triangles[triangle as usize];
        for vertex in vertices {
            let near = self.near[vertex as usize];
            for &site in &near.sites[..near.count as usize] {
                if candidates.iter().any(|candidate| candidate.site == site) {
                    continue;
                }
                let known = vertices.map(|vertex| self.near[vertex as usize].to(site));
                let distance = |corner: usize| {
                    known[corner].unwrap_or_else(|| {
                        let from = [(corner + 1) % 3, (corner + 2) % 3];
                        self.by_corners(
                            vertices[corner],
                            from.map(|corner| vertices[corner]),
                            from.map(|corner| known[corner]),
                        )
                    })
                };
                candidates.push(Candidate { site, squared: [0, 1, 2].map(|corner| distance(corner).powi(2)) });
            }
        }
    }
}

impl Coming {
    /// It rises with the distance, then with the point, then with the vertex. Numbers from 0 up have the order of their bits.
    fn key(&self) -> u128 {
        (u128::from(self.distance_m.abs().to_bits()) << 64) | (u128::from(self.site) << 32) | u128::from(self.vertex)
    }
}

impl Ord for Coming {
    fn cmp(&self, other: &Self) -> Ordering {
        // The nearest first; of equally near ones those with the lower numbers, for one order.
        other.key().cmp(&self.key())
    }
}

impl PartialOrd for Coming {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }

    // The queue asks for this alone, and by keys it is faster than by `cmp`.
    fn le(&self, other: &Self) -> bool {
        self.key() >= other.key()
    }
}

impl PartialEq for Coming {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Coming {}
