//! The graph of taxels: which of them are neighbours on the skin.
//!
//! Its nodes are a body's pressure taxels. Two have an edge if their cells on the surface at rest share a border and the way
//! along the surface is at most 2 √(the larger cell). Parts of one link's surface that no mesh connects, links that the layout
//! joins, and taxels without a surface get edges by their places: see `points.rs`. Other links have edges between them only where one
//! surface connects them.

mod joined;
mod nodes;
mod points;
mod surface;

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use self::nodes::nodes;
use super::cells::Divided;
use crate::body::{Body, EdgeRow, StoredEdges, listed};

/// Stored sums of lengths are rounded to whole parts of this many a metre.
const PARTS_PER_M: f64 = 1e6;

/// Sums of lengths differ by less than this where a layout is current, m: editors round positions.
const SAME_LENGTH_M: f64 = 1e-5;

/// Which pressure taxels are neighbours on the skin.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TaxelGraph {
    /// Per taxel of the body its neighbours, ascending indices.
    neighbours: Vec<Vec<u32>>,
}

impl TaxelGraph {
    /// The edges that `body`'s file holds, if they are current; else those of its surface. The second part says why stored
    /// edges are not current.
    #[must_use]
    pub fn from_body(body: &Body) -> (Self, Option<String>) {
        let stored = body.edges.as_ref().filter(|edges| !edges.rows.is_empty());
        match stored.map(|edges| Self::stored(body, edges)) {
            Some(Ok(graph)) => (graph, None),
            Some(Err(why)) => {
                let note = format!("the edges between taxels in the file are out of date, and made anew: {why}");
                (Self::made(body), Some(note))
            }
            None => (Self::made(body), None),
        }
    }

    /// The edges of `body`'s surface and places.
    #[must_use]
    pub fn made(body: &Body) -> Self {
        Self::from_edges(body.taxels.len(), surface::edges(body))
    }

    /// The edges of `body`, whose surface is all divided among its pressure `taxels`.
    #[doc(hidden)]
    pub fn of_cells(body: &Body, taxels: &[usize], divided: &Divided) -> Self {
        Self::from_edges(body.taxels.len(), surface::edges_of_cells(body, taxels, divided))
    }

    /// The edges `stored`, or why they are not those of `body`.
    fn stored(body: &Body, stored: &StoredEdges) -> Result<Self, String> {
        let nodes: BTreeSet<u32> = nodes(body).map(|taxel| body.taxels[taxel].id).collect();
        let known: BTreeSet<u32> = stored.rows.keys().copied().collect();
        let ids = |ids: Vec<u32>| {
            if ids.len() == 1 { format!("taxel {}", ids[0]) } else { format!("taxels {}", listed(&ids)) }
        };
        let new: Vec<u32> = nodes.difference(&known).copied().collect();
        if !new.is_empty() {
            return Err(format!("they lack {}", ids(new)));
        }
        let ends = stored.rows.values().flat_map(|row| &row.to).chain(&known).copied();
        let gone: BTreeSet<u32> = ends.filter(|id| !nodes.contains(id)).collect();
        if !gone.is_empty() {
            return Err(format!("they have {}, which the body does not", ids(gone.into_iter().collect())));
        }
        let index = |id: u32| body.taxel_index(id).unwrap_or(0) as u32;
        let rows = stored.rows.iter();
        let pairs = rows.flat_map(|(&id, row)| row.to.iter().map(move |&to| (index(id), index(to)))).collect();
        let graph = Self::from_edges(body.taxels.len(), pairs);
        let rows = graph.rows(body);
        let moved = stored.rows.iter().filter(|(id, row)| {
            let now = rows.get(id).map_or(0.0, |row| row.lengths_m);
            (row.lengths_m - now).abs() > SAME_LENGTH_M
        });
        let moved: Vec<u32> = moved.map(|(&id, _)| id).collect();
        if moved.is_empty() { Ok(graph) } else { Err(format!("{} or their neighbours have moved", ids(moved))) }
    }

    /// The lower index first; some of `pairs` may appear twice.
    fn from_edges(taxels: usize, mut pairs: Vec<(u32, u32)>) -> Self {
        pairs.sort_unstable();
        pairs.dedup();
        let mut neighbours = vec![Vec::new(); taxels];
        for (a, b) in pairs {
            neighbours[a as usize].push(b);
            neighbours[b as usize].push(a);
        }
        neighbours.iter_mut().for_each(|own| own.sort_unstable());
        Self { neighbours }
    }

    /// What a layout of `body` stores of it.
    #[must_use]
    pub fn to_stored(&self, body: &Body) -> StoredEdges {
        let mut rows = self.rows(body);
        rows.values_mut().for_each(|row| row.lengths_m = (row.lengths_m * PARTS_PER_M).round() / PARTS_PER_M);
        StoredEdges { rows, joined: body.edges.as_ref().map_or_else(Vec::new, |edges| edges.joined.clone()) }
    }

    fn rows(&self, body: &Body) -> BTreeMap<u32, EdgeRow> {
        let places: Vec<DVec3> =
            body.taxels.iter().map(|taxel| place_at_rest(body, taxel.link, taxel.position_in_link)).collect();
        let row = |taxel: usize| {
            let higher = self.neighbours[taxel].iter().filter(|&&other| other as usize > taxel);
            let length = |&other: &u32| match body.taxels[taxel].link == body.taxels[other as usize].link {
                // As precise far from the world's origin.
                true => body.taxels[taxel].position_in_link.distance(body.taxels[other as usize].position_in_link),
                false => places[taxel].distance(places[other as usize]),
            };
            let lengths_m = higher.clone().map(length).sum();
            EdgeRow { lengths_m, to: higher.map(|&other| body.taxels[other as usize].id).collect() }
        };
        nodes(body).map(|taxel| (body.taxels[taxel].id, row(taxel))).collect()
    }

    /// The neighbours of the body's taxel `taxel`, ascending indices.
    #[must_use]
    pub fn neighbours(&self, taxel: usize) -> &[u32] {
        &self.neighbours[taxel]
    }

    /// All edges by taxel indices, the lower first, ascending.
    pub fn edges(&self) -> impl Iterator<Item = (u32, u32)> + '_ {
        let own = self.neighbours.iter().zip(0..);
        own.flat_map(|(others, taxel)| {
            others.iter().filter(move |&&other| other > taxel).map(move |&other| (taxel, other))
        })
    }

    /// The pressure taxels of `body`, which has this graph, that are connected with each other: per island ascending indices,
    /// the largest island first.
    #[must_use]
    pub fn islands(&self, body: &Body) -> Vec<Vec<u32>> {
        let mut is_seen = vec![false; self.neighbours.len()];
        let mut islands = Vec::new();
        for start in nodes(body) {
            if std::mem::replace(&mut is_seen[start], true) {
                continue;
            }
            let mut island = vec![start as u32];
            let mut next = 0;
            while let Some(&taxel) = island.get(next) {
                next += 1;
                for &other in &self.neighbours[taxel as usize] {
                    if !std::mem::replace(&mut is_seen[other as usize], true) {
                        island.push(other);
                    }
                }
            }
            island.sort_unstable();
            islands.push(island);
        }
        islands.sort_by_key(|island| (std::cmp::Reverse(island.len()), island[0]));
        islands
    }

    /// The graph of the taxels that have a value where others have none, as when they are missing or masked: those are
    /// bridges, whose neighbours are each other's, also across several of them. They have no edges themselves.
    #[must_use]
    pub fn bridging(&self, has_value: &[bool]) -> Self {
        let mut neighbours = self.neighbours.clone();
        let mut is_seen = vec![false; neighbours.len()];
        let has_none = |taxel: u32| !has_value[taxel as usize];
        for start in (0..neighbours.len() as u32).filter(|&taxel| has_none(taxel)) {
            if is_seen[start as usize] {
                continue;
            }
            // All taxels without a value that are connected, and what surrounds them.
            is_seen[start as usize] = true;
            let (mut bridge, mut next, mut around) = (vec![start], 0, BTreeSet::new());
            while let Some(&taxel) = bridge.get(next) {
                next += 1;
                for &other in &self.neighbours[taxel as usize] {
                    if !has_none(other) {
                        around.insert(other);
                    } else if !std::mem::replace(&mut is_seen[other as usize], true) {
                        bridge.push(other);
                    }
                }
            }
            for &taxel in &around {
                neighbours[taxel as usize].extend(around.iter().filter(|&&other| other != taxel));
            }
        }
        for (own, &has_value) in neighbours.iter_mut().zip(has_value) {
            own.retain(|&other| has_value && !has_none(other));
            own.sort_unstable();
            own.dedup();
        }
        Self { neighbours }
    }
}

fn place_at_rest(body: &Body, link: usize, position_in_link: DVec3) -> DVec3 {
    body.links[link].body_from_link.transform_point3(position_in_link)
}

#[cfg(test)]
mod tests;
