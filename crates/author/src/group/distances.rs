//! Distances along the surface between the taxels of one link.
//!
//! They are exact by [`LogMap`]; if the surface is too rough for that, or there is none, approximate along a net: the
//! surface's edges, or lines between neighbouring taxels.

use std::collections::BTreeMap;
use std::rc::Rc;

use glam::{DVec2, DVec3};

use super::net::Net;
use crate::body::{PointTree, point_tree};
use crate::field::LinkSurface;
use crate::field::geodesic::{FIRST_LIMIT, LogMap, MAX_WINDOWS, SurfacePlace};

/// Taxels without a surface are neighbours up to this many median distances to the nearest.
const NEIGHBOUR_DISTANCE: f64 = 2.0;

/// Maximum number of taxels on the same triangle that a taxel is connected to in a net.
const MAX_JOINED_ON_TRIANGLE: usize = 8;

/// Taxels on parts that do not meet are neighbours up to this many median distances to the nearest.
const GAP: f64 = 3.0;

/// Maximum number of such neighbours of a taxel.
const MAX_JOINED: usize = 6;

/// Fewer taxels than these are joined to the nearest one.
const FEW: usize = 3;

/// How often the limit is doubled before it is dropped.
const MAX_DOUBLINGS: u32 = 4;

/// The distance to a taxel, m, infinite beyond the limit, and its (u, v) around the start, m, if known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TaxelDistance {
    pub(super) distance_m: f64,
    pub(super) uv: Option<DVec2>,
}

const UNREACHED: TaxelDistance = TaxelDistance { distance_m: f64::INFINITY, uv: None };

/// Taxels of one link, and the distances between them.
pub(super) struct LinkDistances {
    /// Indices of the taxels in their body.
    pub(super) taxels: Vec<usize>,
    /// Their positions and normals in the link's frame.
    pub(super) points: Vec<(DVec3, DVec3)>,
    surface: Rc<LinkSurface>,
    places: Vec<SurfacePlace>,
    /// The limit from which exact distances have failed, m.
    too_long_m: Option<f64>,
    /// Its nodes are the surface's vertices, then the taxels.
    net: Option<Net>,
    /// The same with lines between taxels of parts that do not meet.
    joined_net: Option<Net>,
    /// How many windows may still be used; then distances are those in space. Without it, each map has a limit of its own.
    pub(super) windows_left: Option<usize>,
}

impl LinkDistances {
    /// Distances on `surface` between `taxels` at `points` (position, normal).
    pub(super) fn new(surface: Rc<LinkSurface>, taxels: Vec<usize>, points: Vec<(DVec3, DVec3)>) -> Self {
        let places: Vec<SurfacePlace> = points.iter().filter_map(|&(p, normal)| surface.locate(p, normal)).collect();
        Self { taxels, points, surface, places, too_long_m: None, net: None, joined_net: None, windows_left: None }
    }

    pub(super) fn len(&self) -> usize {
        self.taxels.len()
    }

    pub(super) fn is_approximate(&self) -> bool {
        self.net.is_some()
    }

    /// Distances from taxel `from` up to `limit_m`.
    pub(super) fn near_taxel(&mut self, from: usize, limit_m: f64) -> Vec<TaxelDistance> {
        let mut reached = match self.places.get(from).copied() {
            Some(place) => self.near_place(&place, from, limit_m),
            None => self.along_net(from, limit_m, None),
        };
        reached[from] = TaxelDistance { distance_m: 0.0, uv: Some(DVec2::ZERO) };
        reached
    }

    /// Distances from taxel `from` without a limit.
    pub(super) fn all_from_taxel(&mut self, from: usize) -> Vec<TaxelDistance> {
        let Some(start) = self.places.get(from) else { return self.near_taxel(from, f64::INFINITY) };
        let part = |place: &SurfacePlace| self.surface.topology.part[place.triangle as usize];
        let same: Vec<usize> = (0..self.places.len()).filter(|&i| part(&self.places[i]) == part(start)).collect();
        let apart = same.iter().map(|&i| self.points[i].0.distance(self.points[from].0));
        let mut limit_m = FIRST_LIMIT * apart.fold(0.0, f64::max);
        for _ in 0..MAX_DOUBLINGS {
            let reached = self.near_taxel(from, limit_m);
            if same.iter().all(|&i| reached[i].distance_m < f64::INFINITY) {
                return reached;
            }
            limit_m *= 2.0;
        }
        self.near_taxel(from, f64::INFINITY)
    }

    /// Distances from `place`, or in a net from taxel `nearest`, up to `limit_m`.
    pub(super) fn near_place(&mut self, place: &SurfacePlace, nearest: usize, limit_m: f64) -> Vec<TaxelDistance> {
        if self.too_long_m.is_none_or(|too_long_m| limit_m < too_long_m) {
            let mut own = MAX_WINDOWS;
            let left = self.windows_left.as_mut().unwrap_or(&mut own);
            match LogMap::with_windows(&self.surface.topology, *place, DVec3::X, limit_m, left) {
                Ok(map) => {
                    let reach = |to: &SurfacePlace| match map.reach(to) {
                        Some(way) if way.distance_m <= limit_m => {
                            TaxelDistance { distance_m: way.distance_m, uv: Some(way.uv) }
                        }
                        _ => UNREACHED,
                    };
                    return self.places.iter().map(reach).collect();
                }
                Err(_) => self.too_long_m = Some(limit_m),
            }
        }
        match self.windows_left {
            Some(_) => self.in_space(place, limit_m),
            None => self.along_net(nearest, limit_m, None),
        }
    }

    /// Distances from `place` in space, to taxels on its part of the surface.
    fn in_space(&self, place: &SurfacePlace, limit_m: f64) -> Vec<TaxelDistance> {
        let topology = &self.surface.topology;
        let (part, from) = (|place: &SurfacePlace| topology.part[place.triangle as usize], place.position(topology));
        let reach = |to: &SurfacePlace| match to.position(topology).distance(from) {
            distance_m if distance_m <= limit_m && part(to) == part(place) => TaxelDistance { distance_m, uv: None },
            _ => UNREACHED,
        };
        self.places.iter().map(reach).collect()
    }

    /// Whether its taxels are on several parts of the surface, which do not meet.
    pub(super) fn are_apart(&self) -> bool {
        let part = |place: &SurfacePlace| self.surface.topology.part[place.triangle as usize];
        self.places.iter().any(|place| part(place) != part(&self.places[0]))
    }

    /// Distances from taxel `from` along the net to the taxels `wanted`, or to all, m: longer than along the surface, by up to
    /// a third, but soon known. Those to other taxels may be too long. Lines lead from shell to shell of the surface.
    pub(super) fn along_net_from(&mut self, from: usize, wanted: Option<&[usize]>) -> Vec<f64> {
        if !self.are_apart() {
            return self.along_net(from, f64::INFINITY, wanted).into_iter().map(|way| way.distance_m).collect();
        }
        let net = self.joined_net.take().unwrap_or_else(|| self.joined());
        let lengths_m = net.lengths(from, f64::INFINITY, wanted);
        self.joined_net = Some(net);
        lengths_m
    }

    /// Distances along the net, final for the taxels `wanted`; for the others, they may be too long.
    fn along_net(&mut self, from: usize, limit_m: f64, wanted: Option<&[usize]>) -> Vec<TaxelDistance> {
        let net = match self.net.take() {
            Some(net) => net,
            None if self.places.is_empty() => self.beside(),
            None => self.along_edges(),
        };
        let lengths_m = net.lengths(from, limit_m, wanted);
        self.net = Some(net);
        lengths_m.into_iter().map(|distance_m| TaxelDistance { distance_m, uv: None }).collect()
    }

    /// The net of the surface's edges, and lines between taxels near each other on parts that do not meet.
    fn joined(&self) -> Net {
        let mut net = self.along_edges();
        let tree = point_tree(self.points.iter().map(|(position, _)| *position));
        let apart = |i: usize, j: usize| self.points[i].0.distance(self.points[j].0);
        let near = |i: usize| {
            let sorted = tree.nearest_neighbor_iter(self.points[i].0.to_array()).map(|spot| spot.data);
            sorted.filter(move |&j| j != i)
        };
        let mut nearest: Vec<f64> = (0..self.len()).filter_map(|i| Some(apart(i, near(i).next()?))).collect();
        nearest.sort_by(f64::total_cmp);
        let reach_m = GAP * nearest.get(nearest.len() / 2).copied().unwrap_or(0.0);
        let part = |i: usize| self.surface.topology.part[self.places[i].triangle as usize];
        for i in 0..self.len() {
            let beyond = |&j: &usize| part(i) != part(j) && self.points[i].1.dot(self.points[j].1) > 0.0;
            for j in near(i).take_while(|&j| apart(i, j) <= reach_m).filter(beyond).take(MAX_JOINED) {
                net.join(i, j, apart(i, j));
            }
        }
        self.join_few(&mut net, near);
        net
    }

    /// Joins each set of fewer than [`FEW`] taxels that `net` connects to the taxel nearest to it: alone they would be no patch.
    fn join_few<'n, Near: Iterator<Item = usize> + 'n>(&self, net: &mut Net, near: impl Fn(usize) -> Near) {
        let mut is_seen = vec![false; self.len()];
        for i in 0..self.len() {
            if std::mem::replace(&mut is_seen[i], true) {
                continue;
            }
            let lengths_m = net.lengths(i, f64::INFINITY, None);
            let own: Vec<usize> = (0..self.len()).filter(|&j| lengths_m[j] < f64::INFINITY).collect();
            own.iter().for_each(|&j| is_seen[j] = true);
            if own.len() >= FEW {
                continue;
            }
            let beyond = own.iter().filter_map(|&a| Some((a, near(a).find(|b| !own.contains(b))?)));
            let apart = |(a, b): (usize, usize)| self.points[a].0.distance(self.points[b].0);
            if let Some((a, b)) = beyond.min_by(|x, y| apart(*x).total_cmp(&apart(*y))) {
                net.join(a, b, apart((a, b)));
            }
        }
    }

    /// The net of the surface's edges, with each taxel connected to its triangle's corners and nearest taxels.
    fn along_edges(&self) -> Net {
        let vertices = &self.surface.topology.positions;
        let mut ways = Vec::with_capacity(self.surface.topology.across.len() + 3 * self.len());
        let mut join = |a: usize, b: usize, length: f64| ways.push((a as u32, b as u32, length));
        for (edge, &beyond) in (0..).zip(&self.surface.topology.across) {
            // One of two that are the same.
            if edge < beyond {
                let (p, q) = self.surface.topology.ends(edge);
                join(p as usize, q as usize, vertices[p as usize].distance(vertices[q as usize]));
            }
        }
        let at: Vec<DVec3> = self.places.iter().map(|place| place.position(&self.surface.topology)).collect();
        let mut on: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (i, place) in self.places.iter().enumerate() {
            on.entry(place.triangle).or_default().push(i);
            for v in self.surface.topology.triangles[place.triangle as usize] {
                join(vertices.len() + i, v as usize, at[i].distance(vertices[v as usize]));
            }
        }
        for same in on.values() {
            let tree = point_tree(same.iter().map(|&i| at[i]));
            for &i in same {
                for (j, length_m) in nearest_taxels(&tree, same, &at, i) {
                    join(vertices.len() + i, vertices.len() + j, length_m);
                }
            }
        }
        Net::new(vertices.len() + self.len(), self.len(), &ways)
    }

    /// The net of neighbouring taxels with normals less than 90° apart.
    fn beside(&self) -> Net {
        let apart = |i: usize, j: usize| self.points[i].0.distance(self.points[j].0);
        let others = |i: usize| (0..self.len()).filter(move |&j| j != i);
        let nearest = |i: usize| others(i).map(|j| apart(i, j)).filter(|&d| d > 0.0).fold(f64::INFINITY, f64::min);
        let mut distances: Vec<f64> = (0..self.len()).map(nearest).collect();
        distances.sort_by(f64::total_cmp);
        let reach = NEIGHBOUR_DISTANCE * distances.get(distances.len() / 2).copied().unwrap_or(0.0);
        let same_side = |i: usize, j: usize| self.points[i].1.dot(self.points[j].1) > 0.0;
        let mut net = Net::new(self.len(), self.len(), &[]);
        for i in 0..self.len() {
            (0..i).filter(|&j| apart(i, j) <= reach && same_side(i, j)).for_each(|j| net.join(i, j, apart(i, j)));
        }
        net
    }
}

/// Up to [`MAX_JOINED_ON_TRIANGLE`] taxels of `same`, which `tree` has, that are nearest to taxel `of`, and how far they are from it, m; of
/// equally far ones the first. Taxel `i` is at `at[i]`.
fn nearest_taxels(tree: &PointTree, same: &[usize], at: &[DVec3], of: usize) -> Vec<(usize, f64)> {
    let mut nearest: Vec<(usize, f64)> = Vec::new();
    for spot in tree.nearest_neighbor_iter(at[of].to_array()).filter(|spot| same[spot.data] != of) {
        let other = same[spot.data];
        let length_m = at[other].distance(at[of]);
        // Those as far as the last one may come after it, and by rounding also some that are nearer.
        if nearest.get(MAX_JOINED_ON_TRIANGLE - 1).is_some_and(|(_, last_m)| length_m > last_m * (1.0 + 1e-12)) {
            break;
        }
        nearest.push((other, length_m));
    }
    nearest.sort_by(|(a, a_m), (b, b_m)| a_m.total_cmp(b_m).then(a.cmp(b)));
    nearest.truncate(MAX_JOINED_ON_TRIANGLE);
    nearest
}
