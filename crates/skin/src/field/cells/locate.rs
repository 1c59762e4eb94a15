//! Which part of a cut triangle a point is in.

use glam::DVec3;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use crate::body::Topology;

/// Boxes reach beyond their parts by this share of their size, as rounding may put a point of a side outside.
const MARGIN: f64 = 1e-6;

/// The parts of one triangle, found by place: a triangle with thousands of points has tens of thousands of parts.
pub(super) struct Located<'a> {
    cut: &'a Topology,
    parts: &'a [u32],
    tree: RTree<GeomWithData<Rectangle<[f64; 3]>, u32>>,
}

impl<'a> Located<'a> {
    /// Of `parts`, triangles of `cut` that lie in one plane.
    pub(super) fn new(cut: &'a Topology, parts: &'a [u32]) -> Self {
        let boxed = |&part: &u32| {
            let [a, b, c] = cut.corners(part);
            let (low, high) = (a.min(b).min(c), a.max(b).max(c));
            let margin = DVec3::splat(MARGIN * high.distance(low));
            GeomWithData::new(Rectangle::from_corners((low - margin).to_array(), (high + margin).to_array()), part)
        };
        Self { cut, parts, tree: RTree::bulk_load(parts.iter().map(boxed).collect()) }
    }

    /// The part that `p` is deepest in, the last of those that it is equally deep in.
    pub(super) fn part_at(&self, p: DVec3) -> Option<u32> {
        let deepest = |parts: &mut dyn Iterator<Item = u32>| {
            let depths = parts.map(|part| (depth(self.cut.corners(part), p), part));
            depths.max_by(|(a, first), (b, second)| a.total_cmp(b).then(first.cmp(second))).map(|(_, part)| part)
        };
        let here = AABB::from_point(p.to_array());
        // If rounding puts it outside of all of them, it is the least outside of one.
        deepest(&mut self.tree.locate_in_envelope_intersecting(here).map(|boxed| boxed.data))
            .or_else(|| deepest(&mut self.parts.iter().copied()))
    }
}

/// How deep `p`, in the plane of the triangle, is within it: the least of its barycentric coordinates.
fn depth([a, b, c]: [DVec3; 3], p: DVec3) -> f64 {
    let normal = (b - a).cross(c - a);
    let part = |from: DVec3, to: DVec3| normal.dot((to - from).cross(p - from));
    part(b, c).min(part(c, a)).min(part(a, b)) / normal.length_squared()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_in_the_part_that_all_of_them_give() {
        // A triangle cut into a fan of 400 parts, some of them slivers.
        let positions: Vec<DVec3> = (0..=400)
            .map(|i| DVec3::new(f64::from(i) * f64::from(i) / 16e4, 0.0, 0.0))
            .chain([DVec3::new(0.3, 1.0, 0.5)])
            .collect();
        let triangles: Vec<[u32; 3]> = (0..400).map(|i| [i, i + 1, 401]).collect();
        let cut = Topology::new(&positions, &triangles);
        let parts: Vec<u32> = (0..cut.triangles.len() as u32).collect();
        let located = Located::new(&cut, &parts);
        let of_all = |p: DVec3| {
            let depths = parts.iter().map(|&part| (depth(cut.corners(part), p), part));
            depths.max_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map(|(_, part)| part)
        };
        for i in 0..=50 {
            for k in 0..=50 {
                let along = positions[0].lerp(positions[400], f64::from(i) / 50.0);
                let p = along.lerp(positions[401], f64::from(k) / 50.0);
                assert_eq!(located.part_at(p), of_all(p), "{i} {k}");
            }
        }
        // A point beyond all of them has one too.
        assert_eq!(located.part_at(DVec3::new(2.0, 0.0, 0.0)), of_all(DVec3::new(2.0, 0.0, 0.0)));
    }
}
