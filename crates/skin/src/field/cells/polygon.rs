//! A triangle divided among points, whose squared distances to its corners are known.
//!
//! On a flat triangle the difference of the squared distances to two points is linear, so that borders are straight and
//! what is interpolated between corners is exact.

use glam::DVec3;

/// Differences of squared distances below this share of them are 0.
const ROUNDING: f64 = 1e-10;

/// A point, and its squared distance to each corner of the triangle, m².
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Candidate {
    pub(super) site: u32,
    pub(super) squared: [f64; 3],
}

impl Candidate {
    /// Whether all of the triangle is nearer to `other`, by more than rounding: nothing of it would be left by a cut.
    fn is_beaten_by(&self, other: &Self) -> bool {
        let (mine, others) = (DVec3::from_array(self.squared), DVec3::from_array(other.squared));
        (mine - others).min_element() > 2.0 * ROUNDING * (mine + others).max_element()
    }
}

/// A side of a polygon: its start, in the triangle's barycentric coordinates, and the point whose cell is beyond it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    pub(super) from: DVec3,
    pub(super) beyond: Option<u32>,
}

/// The part of the triangle that is nearer to `own` than to any other of `all`, as a convex polygon; empty if there is none.
pub(super) fn nearest_part(own: &Candidate, all: &[Candidate], polygon: &mut Vec<Side>, spare: &mut Vec<Side>) {
    polygon.clear();
    if all.iter().any(|other| other.site != own.site && own.is_beaten_by(other)) {
        return;
    }
    polygon.extend(DVec3::AXES.map(|from| Side { from, beyond: None }));
    for other in all.iter().filter(|other| other.site != own.site) {
        cut(polygon, spare, own, other);
        if polygon.len() < 3 {
            polygon.clear();
            return;
        }
    }
}

/// Cuts off what is nearer to `other` than to `own`.
fn cut(polygon: &mut Vec<Side>, spare: &mut Vec<Side>, own: &Candidate, other: &Candidate) {
    let (mine, others) = (DVec3::from_array(own.squared), DVec3::from_array(other.squared));
    let (farther, least) = (mine - others, ROUNDING * (mine + others).max_element());
    let excess = |side: &Side| {
        let excess = farther.dot(side.from);
        if excess.abs() <= least { 0.0 } else { excess }
    };
    let count = polygon.len();
    if polygon.iter().all(|side| excess(side) <= 0.0) {
        // A border along a side of the triangle.
        for index in 0..count {
            if excess(&polygon[index]) == 0.0 && excess(&polygon[(index + 1) % count]) == 0.0 {
                polygon[index].beyond.get_or_insert(other.site);
            }
        }
        return;
    }
    spare.clear();
    for index in 0..count {
        let (side, end) = (polygon[index], polygon[(index + 1) % count]);
        let (before, after) = (excess(&side), excess(&end));
        let crossing = || side.from.lerp(end.from, before / (before - after));
        if before <= 0.0 {
            spare.push(side);
        }
        if before <= 0.0 && after > 0.0 {
            spare.push(Side { from: crossing(), beyond: Some(other.site) });
        }
        if before > 0.0 && after <= 0.0 {
            spare.push(Side { from: crossing(), ..side });
        }
    }
    std::mem::swap(polygon, spare);
}

/// The share of the triangle's area that `polygon` has.
pub(super) fn share(polygon: &[Side]) -> f64 {
    let count = polygon.len();
    let twice = |index: usize| {
        let (a, b) = (polygon[index].from, polygon[(index + 1) % count].from);
        a.y * b.z - a.z * b.y
    };
    (0..count).map(twice).sum()
}

/// The squared distance of the place `at` to `own`, for corners whose sides have the squared lengths `sides` (those opposite
/// to each corner), m².
pub(super) fn squared_at(own: &Candidate, sides: DVec3, at: DVec3) -> f64 {
    DVec3::from_array(own.squared).dot(at) - at.y * at.z * sides.x - at.z * at.x * sides.y - at.x * at.y * sides.z
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    const CORNERS: [DVec2; 3] = [DVec2::ZERO, DVec2::new(4.0, 0.0), DVec2::new(1.0, 3.0)];

    fn candidates(points: &[DVec2]) -> Vec<Candidate> {
        let one = |(site, point): (usize, &DVec2)| Candidate {
            site: site as u32,
            squared: CORNERS.map(|corner| corner.distance_squared(*point)),
        };
        points.iter().enumerate().map(one).collect()
    }

    #[test]
    fn cells_are_those_of_the_plane_and_fill_the_triangle() {
        let points = [(0.5, 0.2), (3.0, 0.1), (1.2, 2.4), (1.7, 0.9), (9.0, 9.0), (2.0, -1.5)].map(DVec2::from);
        let all = candidates(&points);
        let (mut polygon, mut spare) = (Vec::new(), Vec::new());
        let mut whole = 0.0;
        for own in &all {
            nearest_part(own, &all, &mut polygon, &mut spare);
            whole += share(&polygon);
            let at = |b: DVec3| CORNERS[0] * b.x + CORNERS[1] * b.y + CORNERS[2] * b.z;
            let lengths = |a: usize, b: usize| CORNERS[a].distance_squared(CORNERS[b]);
            let sides = DVec3::new(lengths(1, 2), lengths(2, 0), lengths(0, 1));
            for (index, side) in polygon.iter().enumerate() {
                let next = polygon[(index + 1) % polygon.len()].from;
                for b in [side.from, side.from.lerp(next, 0.3)] {
                    let own_m2 = at(b).distance_squared(points[own.site as usize]);
                    assert!((squared_at(own, sides, b) - own_m2).abs() < 1e-12);
                    assert!(points.iter().all(|point| at(b).distance_squared(*point) >= own_m2 - 1e-9));
                    if let Some(beyond) = side.beyond {
                        assert!((at(b).distance_squared(points[beyond as usize]) - own_m2).abs() < 1e-9);
                    }
                }
            }
            if own.site == 4 {
                assert!(polygon.is_empty(), "nothing is nearest to a point far away");
            }
        }
        assert!((whole - 1.0).abs() < 1e-12, "{whole}");
        // A point alone has all of it.
        nearest_part(&all[4], &all[4..5], &mut polygon, &mut spare);
        assert_eq!((polygon.len(), share(&polygon)), (3, 1.0));
    }

    #[test]
    fn a_border_along_a_side_is_seen() {
        // Mirror images at the side from the first corner to the second.
        let all = candidates(&[DVec2::new(2.0, 0.5), DVec2::new(2.0, -0.5)]);
        let (mut polygon, mut spare) = (Vec::new(), Vec::new());
        nearest_part(&all[0], &all, &mut polygon, &mut spare);
        assert_eq!(polygon.iter().map(|side| side.beyond).collect::<Vec<_>>(), [Some(1), None, None]);
        nearest_part(&all[1], &all, &mut polygon, &mut spare);
        assert!(share(&polygon) < 1e-9);
    }
}
