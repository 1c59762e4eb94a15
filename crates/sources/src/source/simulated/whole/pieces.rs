//! Cuts triangles into pieces that are small enough to count as points.

use glam::DVec3;

/// Maximum number of times that a triangle is halved; pieces of a sane one are small long before.
const MAX_HALVINGS: u32 = 60;

/// Cuts the triangle with these corners into pieces with edges up to `edge_m`, and gives `take` the corners and the area
/// of each, m². Pieces within a radius of a middle for which `keep` is false are left out, with all that is in them.
///
/// The longest edge is halved each time, so that pieces of thin triangles are not needlessly small.
pub(super) fn pieces(
    corners: [DVec3; 3],
    edge_m: f64,
    keep: impl Fn(DVec3, f64) -> bool,
    mut take: impl FnMut([DVec3; 3], f64),
) {
    let [a, b, c] = corners;
    let mut open = vec![(corners, (b - a).cross(c - a).length() / 2.0, 0)];
    while let Some((corners, area, halvings)) = open.pop() {
        let [a, b, c] = corners;
        let middle = middle(corners);
        let radius = corners.iter().map(|p| p.distance_squared(middle)).fold(0.0, f64::max).sqrt();
        if !keep(middle, radius) {
            continue;
        }
        let (ab, bc, ca) = (a.distance_squared(b), b.distance_squared(c), c.distance_squared(a));
        let longest = ab.max(bc).max(ca);
        if longest <= edge_m * edge_m || halvings == MAX_HALVINGS {
            take(corners, area);
            continue;
        }
        // The first edge of the longest.
        let [a, b, c] = match longest {
            _ if ab >= longest => [a, b, c],
            _ if bc >= longest => [b, c, a],
            _ => [c, a, b],
        };
        let half = (a + b) / 2.0;
        open.push(([half, b, c], area / 2.0, halvings + 1));
        open.push(([a, half, c], area / 2.0, halvings + 1));
    }
}

/// The triangles that make up the part of that with these corners which lies between two planes: those of the points whose
/// coordinate along `along` is `from` and `to`.
pub(super) fn between(corners: [DVec3; 3], along: DVec3, [from, to]: [f64; 2]) -> Vec<[DVec3; 3]> {
    let coordinates = corners.map(|p| p.dot(along));
    if coordinates.iter().all(|&x| (from..=to).contains(&x)) {
        return vec![corners];
    }
    let mut outline = corners.to_vec();
    for (limit, inwards) in [(from, 1.0), (to, -1.0)] {
        let beyond = |p: DVec3| (p.dot(along) - limit) * inwards;
        let mut cut = Vec::with_capacity(outline.len() + 1);
        for (index, &p) in outline.iter().enumerate() {
            let q = outline[(index + 1) % outline.len()];
            let (here, there) = (beyond(p), beyond(q));
            if here >= 0.0 {
                cut.push(p);
            }
            if (here < 0.0) != (there < 0.0) {
                cut.push(p + (q - p) * (here / (here - there)));
            }
        }
        outline = cut;
    }
    outline.windows(2).skip(1).map(|pair| [outline[0], pair[0], pair[1]]).collect()
}

pub(super) fn middle([a, b, c]: [DVec3; 3]) -> DVec3 {
    (a + b + c) / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_cut_at_both_planes() {
        let corners = [DVec3::ZERO, DVec3::X * 4.0, DVec3::Y * 4.0];
        let area =
            |parts: &[[DVec3; 3]]| -> f64 { parts.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).z / 2.0).sum() };
        for (ends, wanted) in
            [([0.0, 4.0], 8.0), ([1.0, 2.0], 2.5), ([-1.0, 1.0], 3.5), ([3.0, 9.0], 0.5), ([5.0, 6.0], 0.0)]
        {
            let parts = between(corners, DVec3::X, ends);
            assert!((area(&parts) - wanted).abs() < 1e-12, "{ends:?}: {}", area(&parts));
            let inside = |p: &DVec3| p.x >= ends[0] - 1e-12 && p.x <= ends[1] + 1e-12;
            assert!(parts.iter().flatten().all(inside), "{parts:?}");
        }
    }

    #[test]
    fn pieces_are_the_whole_triangle_and_no_longer_than_asked() {
        for corners in [
            [DVec3::ZERO, DVec3::X, DVec3::Y],
            [DVec3::ZERO, DVec3::X * 0.1, DVec3::new(0.05, 0.0004, 0.0)],
            [DVec3::ONE, DVec3::ONE * 1.001, DVec3::new(1.0, 1.01, 1.0)],
        ] {
            let [a, b, c] = corners;
            let whole = (b - a).cross(c - a).length() / 2.0;
            let (mut area, mut moment, mut count) = (0.0, DVec3::ZERO, 0);
            pieces(
                corners,
                0.01,
                |_, _| true,
                |piece, piece_area| {
                    let [a, b, c] = piece;
                    assert!(a.distance(b).max(b.distance(c)).max(c.distance(a)) <= 0.01);
                    assert!((piece_area - (b - a).cross(c - a).length() / 2.0).abs() < 1e-12);
                    (area, moment, count) = (area + piece_area, moment + middle(piece) * piece_area, count + 1);
                },
            );
            assert!((area - whole).abs() < 1e-9 * whole && (moment / area).distance(middle(corners)) < 1e-9);
            assert!(count < 60_000, "{count}");
        }
    }

    #[test]
    fn what_is_not_kept_is_left_out_and_nothing_else() {
        let near = DVec3::new(0.2, 0.2, 0.0);
        let mut area = 0.0;
        let within = |p: DVec3, radius: f64| p.distance(near) <= 0.1 + radius;
        pieces([DVec3::ZERO, DVec3::X, DVec3::Y], 0.005, within, |piece, piece_area| {
            assert!(middle(piece).distance(near) < 0.11);
            area += if middle(piece).distance(near) <= 0.1 { piece_area } else { 0.0 };
        });
        assert!((area / (std::f64::consts::PI * 0.01) - 1.0).abs() < 2e-3, "{area}");
    }
}
