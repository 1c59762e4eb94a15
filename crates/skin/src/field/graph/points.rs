//! Edges by places alone, between taxels that no surface connects, of one link or of links that carry one skin.
//!
//! Two taxels have an edge if no other is strictly inside the ball that has the line between them as its diameter (Gabriel and
//! Sokal 1969), if they are at most 2 √(the larger cell) apart, and if their normals are within 90°: those of two faces at a box's
//! edge are.

use glam::DVec3;

use crate::body::{PointTree, point_tree};

/// A taxel this share of the squared diameter inside the ball is strictly inside: corners of a rounded grid are not.
const INSIDE_SHARE: f64 = 1e-5;

/// Limit of an edge's length over the root of the larger cell.
pub(super) const LENGTH_PER_ROOT: f64 = 2.0;

/// cos 90°, with a tolerance for normals that a file has in single precision.
const MIN_NORMAL_COSINE: f64 = -1e-6;

/// A taxel. All that are compared are in the frame of one link.
pub(super) struct LinkPoint {
    /// Its index in the body.
    pub(super) taxel: u32,
    pub(super) position: DVec3,
    pub(super) normal: DVec3,
    /// The area of its cell, or of the sensor if it is on no surface, m²; `None` if unknown.
    pub(super) cell_m2: Option<f64>,
    /// The part of the surface that it is on; taxels on one part get no edges here.
    pub(super) part: Option<(u32, u32)>,
}

/// The edges between `points`, none of them at the place of another.
pub(super) fn edges(points: &[LinkPoint]) -> Vec<(u32, u32)> {
    let are_apart = |a: &LinkPoint, b: &LinkPoint| a.part.is_none() || a.part != b.part;
    if points.windows(2).all(|pair| !are_apart(&pair[0], &pair[1])) {
        return Vec::new();
    }
    let tree = point_tree(points.iter().map(|point| point.position));
    let limits: Vec<f64> = limits_m(points, &tree);
    let mut found = Vec::new();
    for (index, (point, &limit)) in points.iter().zip(&limits).enumerate() {
        for other in tree.locate_within_distance(point.position.to_array(), limit * limit).map(|spot| spot.data) {
            // The one with the larger cell finds the pair.
            let is_own = (limit, index) > (limits[other], other);
            let beyond = &points[other];
            if is_own
                && are_apart(point, beyond)
                && point.normal.dot(beyond.normal) > MIN_NORMAL_COSINE
                && is_free(&tree, points, index, other)
            {
                found.push((point.taxel.min(beyond.taxel), point.taxel.max(beyond.taxel)));
            }
        }
    }
    found
}

/// Per point the longest edge to a neighbour with a smaller cell, m.
fn limits_m(points: &[LinkPoint], tree: &PointTree) -> Vec<f64> {
    let nearest = |(index, point): (usize, &LinkPoint)| {
        let mut near = tree.nearest_neighbor_iter_with_distance_2(point.position.to_array());
        near.find(|(spot, _)| spot.data != index).map_or(0.0, |(_, squared)| squared)
    };
    let nearest_m2: Vec<f64> = points.iter().enumerate().map(nearest).collect();
    let mut sorted = nearest_m2.clone();
    sorted.sort_by(f64::total_cmp);
    let usual_m2 = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let cell = |(point, nearest_m2): (&LinkPoint, f64)| match (point.cell_m2, point.part) {
        (Some(cell_m2), Some(_)) => cell_m2,
        // A sensor may be smaller than its cell, as a button.
        (Some(sensor_m2), None) => sensor_m2.max(usual_m2),
        (None, _) => nearest_m2,
    };
    // Beyond the rounding of a grid.
    points.iter().zip(nearest_m2).map(cell).map(|cell| LENGTH_PER_ROOT * cell.sqrt() * (1.0 + 1e-6)).collect()
}

/// Whether no third point is inside the ball on the points `a` and `b`.
fn is_free(tree: &PointTree, points: &[LinkPoint], a: usize, b: usize) -> bool {
    let [p, q] = [a, b].map(|point| points[point].position);
    let squared = p.distance_squared(q) / 4.0 * (1.0 - INSIDE_SHARE);
    let mut inside = tree.locate_within_distance(((p + q) / 2.0).to_array(), squared);
    !inside.any(|spot| spot.data != a && spot.data != b)
}
