//! Distances along the skin between the taxels of one link.
//!
//! Exact ones, by [`LogMap`]. Where the surface is too rough for them, or there is none, along a net: the surface's edges,
//! or from each taxel to those beside it.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};
use std::rc::Rc;

use glam::{DVec2, DVec3};

use crate::field::Skin;
use crate::field::geodesic::{LogMap, Place};

/// How far taxels without a surface reach to be beside each other, in median distances to the nearest.
const BESIDE: f64 = 2.0;

/// Taxels on one triangle that each of them is joined with in a net.
const ON_TRIANGLE: usize = 8;

/// The first ways followed to all taxels are as long as around half a circle whose diameter is the straight distance to the
/// farthest, and a bit.
const FIRST_REACH: f64 = 1.1 * std::f64::consts::FRAC_PI_2;

/// How often they are followed twice as far before it is as far as they lead.
const MOST_DOUBLINGS: u32 = 4;

/// What a way leads to: its length in m, infinite where there is none within the limit, and (u, v) about where it starts,
/// m, where that is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reach {
    pub(super) distance_m: f64,
    pub(super) uv: Option<DVec2>,
}

const OUT: Reach = Reach { distance_m: f64::INFINITY, uv: None };

/// Some taxels of one link, and the ways between them.
pub(super) struct Ways {
    /// Indices of the taxels in their body.
    pub(super) taxels: Vec<usize>,
    /// Where they are, and their normals, in the link's frame.
    pub(super) points: Vec<(DVec3, DVec3)>,
    skin: Rc<Skin>,
    places: Vec<Place>,
    /// The length from which exact ways have proved too many.
    too_long_m: Option<f64>,
    net: Option<Vec<Vec<(u32, f64)>>>,
}

impl Ways {
    /// Ways over `skin` between `taxels` at `points` (position, normal).
    pub(super) fn new(skin: Rc<Skin>, taxels: Vec<usize>, points: Vec<(DVec3, DVec3)>) -> Self {
        let places: Vec<Place> = points.iter().filter_map(|&(p, normal)| skin.locate(p, normal)).collect();
        Self { taxels, points, skin, places, too_long_m: None, net: None }
    }

    /// How many taxels there are.
    pub(super) fn len(&self) -> usize {
        self.taxels.len()
    }

    /// Whether lengths are those of a net, as there is no surface, or it is too rough.
    pub(super) fn are_rough(&self) -> bool {
        self.net.is_some()
    }

    /// Ways from taxel `from` to all, up to `limit_m`.
    pub(super) fn over(&mut self, from: usize, limit_m: f64) -> Vec<Reach> {
        let mut reached = match self.places.get(from).copied() {
            Some(place) => self.over_place(&place, from, limit_m),
            None => self.over_net(from, limit_m),
        };
        reached[from] = Reach { distance_m: 0.0, uv: Some(DVec2::ZERO) };
        reached
    }

    /// Ways from taxel `from` to all that a way leads to.
    pub(super) fn over_all(&mut self, from: usize) -> Vec<Reach> {
        let Some(start) = self.places.get(from) else { return self.over(from, f64::INFINITY) };
        let part = |place: &Place| self.skin.topology.part[place.triangle as usize];
        let same: Vec<usize> = (0..self.places.len()).filter(|&i| part(&self.places[i]) == part(start)).collect();
        let apart = same.iter().map(|&i| self.points[i].0.distance(self.points[from].0));
        let mut limit_m = FIRST_REACH * apart.fold(0.0, f64::max);
        for _ in 0..MOST_DOUBLINGS {
            let reached = self.over(from, limit_m);
            if same.iter().all(|&i| reached[i].distance_m < f64::INFINITY) {
                return reached;
            }
            limit_m *= 2.0;
        }
        self.over(from, f64::INFINITY)
    }

    /// Ways from `place`, or in a net from taxel `nearest`, to all, up to `limit_m`.
    pub(super) fn over_place(&mut self, place: &Place, nearest: usize, limit_m: f64) -> Vec<Reach> {
        if self.too_long_m.is_none_or(|too_long_m| limit_m < too_long_m) {
            match LogMap::new(&self.skin.topology, *place, DVec3::X, limit_m) {
                Ok(map) => {
                    let reach = |to: &Place| match map.reach(to) {
                        Some(way) if way.distance_m <= limit_m => {
                            Reach { distance_m: way.distance_m, uv: Some(way.uv) }
                        }
                        _ => OUT,
                    };
                    return self.places.iter().map(reach).collect();
                }
                Err(_) => self.too_long_m = Some(limit_m),
            }
        }
        self.over_net(nearest, limit_m)
    }

    /// Ways along the net (Dijkstra).
    fn over_net(&mut self, from: usize, limit_m: f64) -> Vec<Reach> {
        let first_taxel = if self.places.is_empty() { 0 } else { self.skin.topology.positions.len() };
        let net = match self.net.take() {
            Some(net) => net,
            None if self.places.is_empty() => self.beside(),
            None => self.along_edges(),
        };
        let mut lengths = vec![f64::INFINITY; net.len()];
        // Lengths from 0 up are in the order of their bits.
        let mut open = BinaryHeap::from([(Reverse(0_u64), (first_taxel + from) as u32)]);
        lengths[first_taxel + from] = 0.0;
        while let Some((Reverse(bits), node)) = open.pop() {
            let length = f64::from_bits(bits);
            if length > lengths[node as usize] {
                continue;
            }
            for &(next, step) in &net[node as usize] {
                let through = length + step;
                if through < lengths[next as usize] && through <= limit_m {
                    lengths[next as usize] = through;
                    open.push((Reverse(through.to_bits()), next));
                }
            }
        }
        self.net = Some(net);
        lengths[first_taxel..].iter().map(|&distance_m| Reach { distance_m, uv: None }).collect()
    }

    /// The net of the surface's edges, with each taxel joined to its triangle's corners and the next taxels there.
    fn along_edges(&self) -> Vec<Vec<(u32, f64)>> {
        let vertices = &self.skin.topology.positions;
        let mut net = vec![Vec::new(); vertices.len() + self.len()];
        let mut join = |a: usize, b: usize, length: f64| {
            net[a].push((b as u32, length));
            net[b].push((a as u32, length));
        };
        for triangle in &self.skin.topology.triangles {
            let [a, b, c] = triangle.map(|v| v as usize);
            for (p, q) in [(a, b), (b, c), (c, a)] {
                join(p, q, vertices[p].distance(vertices[q]));
            }
        }
        let at: Vec<DVec3> = self.places.iter().map(|place| place.position(&self.skin.topology)).collect();
        let mut on: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (i, place) in self.places.iter().enumerate() {
            on.entry(place.triangle).or_default().push(i);
            for v in self.skin.topology.triangles[place.triangle as usize] {
                join(vertices.len() + i, v as usize, at[i].distance(vertices[v as usize]));
            }
        }
        for same in on.values() {
            for &i in same {
                let mut others: Vec<usize> = same.iter().copied().filter(|&j| j != i).collect();
                others.sort_by(|&a, &b| at[a].distance(at[i]).total_cmp(&at[b].distance(at[i])));
                others.iter().take(ON_TRIANGLE).for_each(|&j| {
                    join(vertices.len() + i, vertices.len() + j, at[i].distance(at[j]));
                });
            }
        }
        net
    }

    /// The net of taxels beside each other that do not face apart.
    fn beside(&self) -> Vec<Vec<(u32, f64)>> {
        let apart = |i: usize, j: usize| self.points[i].0.distance(self.points[j].0);
        let others = |i: usize| (0..self.len()).filter(move |&j| j != i);
        let nearest = |i: usize| others(i).map(|j| apart(i, j)).filter(|&d| d > 0.0).fold(f64::INFINITY, f64::min);
        let mut distances: Vec<f64> = (0..self.len()).map(nearest).collect();
        distances.sort_by(f64::total_cmp);
        let reach = BESIDE * distances.get(distances.len() / 2).copied().unwrap_or(0.0);
        let same_side = |i: usize, j: usize| self.points[i].1.dot(self.points[j].1) > 0.0;
        let around = |i: usize| {
            let near = others(i).filter(|&j| apart(i, j) <= reach && same_side(i, j));
            near.map(|j| (j as u32, apart(i, j))).collect()
        };
        (0..self.len()).map(around).collect()
    }
}
