//! Neighbouring taxels.

use std::collections::BTreeMap;

use rstar::RTree;
use rstar::primitives::GeomWithData;

use crate::body::Body;

/// Maximum distance of neighbours, in spacings.
const NEIGHBOUR_SPACINGS: f64 = 1.5;

/// Per taxel of `body` the indices of its neighbours: on the same link, within 1.5 times the link's median distance between
/// nearest taxels, and with normals within 90°, which excludes the other side of a finger.
#[must_use]
pub fn neighbours(body: &Body) -> Vec<Vec<u32>> {
    let mut by_link: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (index, taxel) in body.taxels.iter().enumerate().filter(|(_, taxel)| taxel.modality.is_pressed()) {
        by_link.entry(taxel.link).or_default().push(index);
    }
    let mut neighbours = vec![Vec::new(); body.taxels.len()];
    for taxels in by_link.values() {
        let place = |index: usize| body.taxels[index].position_in_link.to_array();
        let tree = RTree::bulk_load(taxels.iter().map(|&index| GeomWithData::new(place(index), index)).collect());
        // The spacing of coincident taxels is the distance to the nearest other point.
        let nearest = |&index: &usize| {
            tree.nearest_neighbor_iter_with_distance_2(place(index)).map(|(_, d2)| d2).find(|&d2| d2 > 0.0)
        };
        let mut distances: Vec<f64> = taxels.iter().filter_map(nearest).map(f64::sqrt).collect();
        if distances.is_empty() {
            continue;
        }
        distances.sort_by(f64::total_cmp);
        // The last factor admits the diagonals of a rounded grid.
        let reach = NEIGHBOUR_SPACINGS * distances[distances.len() / 2] * (1.0 + 1e-6);
        for &index in taxels {
            let here = &body.taxels[index];
            let mut beside: Vec<u32> = tree
                .locate_within_distance(place(index), reach * reach)
                .map(|other| other.data)
                .filter(|&other| other != index && body.taxels[other].normal_in_link.dot(here.normal_in_link) > 0.0)
                .map(|other| other as u32)
                .collect();
            beside.sort_unstable();
            neighbours[index] = beside;
        }
    }
    neighbours
}
