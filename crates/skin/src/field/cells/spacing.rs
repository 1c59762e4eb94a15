//! How far points are apart, and how long edges of the surface around them may be.

use glam::DVec3;

use crate::body::{PointTree, point_tree};

/// Points nearer to each other than this share a cell, m.
pub const COINCIDENT_M: f64 = 1e-6;

/// Edges are cut that are longer than this share of the distance from the nearest point to its own nearest.
const EDGE_SHARE: f64 = 0.7;

/// How far points are from each other.
pub(super) struct Spacing {
    tree: PointTree,
    /// Per point the distance to the nearest other, m.
    nearest_m: Vec<f64>,
    /// The least of them, m.
    least_m: f64,
}

impl Spacing {
    pub(super) fn from_positions(positions: &[DVec3]) -> Self {
        let tree = point_tree(positions.iter().copied());
        let nearest = |(index, at): (usize, &DVec3)| {
            let mut others = tree.nearest_neighbor_iter_with_distance_2(at.to_array());
            let other = others.find(|&(spot, squared)| spot.data != index && squared > COINCIDENT_M * COINCIDENT_M);
            other.map_or(f64::INFINITY, |(_, squared)| squared.sqrt())
        };
        let nearest_m: Vec<f64> = positions.iter().enumerate().map(nearest).collect();
        let least_m = nearest_m.iter().copied().fold(f64::INFINITY, f64::min);
        Self { tree, nearest_m, least_m }
    }

    /// The largest distance of a point to its nearest other, m; infinite where no two are apart.
    pub(super) fn largest_m(&self) -> f64 {
        let largest_m = self.nearest_m.iter().copied().filter(|m| m.is_finite()).fold(0.0, f64::max);
        if largest_m > 0.0 { largest_m } else { f64::INFINITY }
    }

    /// Maximum length of an edge anywhere, m.
    pub(super) fn shortest_edge(&self) -> f64 {
        EDGE_SHARE * self.least_m
    }

    /// Maximum length of an edge around `p`, m. It changes by no more than `EDGE_SHARE` a metre: where it leapt, an edge that is cut
    /// beside a longer one that is not would come back as the new edge, again and again.
    pub(super) fn edge_at(&self, p: DVec3) -> f64 {
        let mut least_m = f64::INFINITY;
        for (spot, squared) in self.tree.nearest_neighbor_iter_with_distance_2(p.to_array()) {
            let away_m = squared.sqrt();
            if away_m >= least_m {
                break;
            }
            least_m = least_m.min(self.nearest_m[spot.data].max(away_m));
        }
        EDGE_SHARE * least_m
    }
}
