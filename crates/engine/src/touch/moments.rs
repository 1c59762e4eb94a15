//! Place and shape of a touch: its chart, second moments, axis and two farthest points.
//!
//! With the pull wP of each taxel and S = Σ wP, c = Σ wP x / S is the weighted mean of positions in space. The chart is based at the
//! taxel nearest to c; with places x there and their mean c̄, the moments are M = Σ wP (x − c̄)(x − c̄)ᵀ / S. Its eigenvalues λ₁ ≥ λ₂
//! give the spread √λ₁ along and √λ₂ across the principal axis, and the anisotropy (λ₁ − λ₂)/(λ₁ + λ₂).
//!
//! * One taxel: all absent, `one_taxel`.
//! * √(λ₁ + λ₂) ≤ 1 µm: the taxels fall together; all absent, `coincident`.
//! * Anisotropy under 10⁻³: the axis is absent, `isotropic`.
//! * A normal over 120° from the base's: `wrapped`. The moments are those of positions in space, and λ₁ and λ₂ the larger two.
//!
//! Orientation is the line through the two farthest of the points c̄ + (wP / S)(x − c̄), equally far ones by the lower node; as in
//! `stage/orientation.rs`, with `tie` and `coincident`.

use glam::{DMat3, DVec2, DVec3};

use super::chart::{self, WRAPPED_COSINE};
use super::skin::Skin;
use crate::percept::TouchFlags;

/// Taxels nearer to each other than this fall together, m.
const TOGETHER_M: f64 = 1e-6;
/// Anisotropy under which there is no axis.
pub(super) const ISOTROPIC: f64 = 1e-3;
/// 2⁻¹⁴: points nearer than this part of the farthest one's distance fall together, distances nearer than this are a tie.
pub(super) const NEAR: f64 = 1.0 / 16_384.0;

/// A pressed taxel of a touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pulling {
    pub(super) node: u32,
    /// wP.
    pub(super) pull: f64,
}

/// A line across the normal of the chart, or in space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Line {
    /// Unit vector in the body at rest.
    pub(super) along: DVec3,
    /// The same as an angle in the chart, in [0, π), rad; absent in space.
    pub(super) angle_rad: Option<f64>,
}

/// The shape of a touch.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Shape {
    pub(super) axis: Option<Line>,
    pub(super) anisotropy: Option<f64>,
    pub(super) spread_m: Option<[f64; 2]>,
    pub(super) orientation: Option<Line>,
    pub(super) flags: TouchFlags,
}

/// The weighted mean of the positions of `taxels`, which is not empty, and Σ wP.
pub(super) fn mean(skin: &Skin, taxels: &[Pulling]) -> (DVec3, f64) {
    // About one of them, so that nothing is lost far from the origin.
    let about = skin.taxel(taxels[0].node).position;
    let total: f64 = taxels.iter().map(|taxel| taxel.pull).sum();
    let moment: DVec3 = taxels.iter().map(|taxel| (skin.taxel(taxel.node).position - about) * taxel.pull).sum();
    (about + moment / total, total)
}

/// The taxel nearest to `mean`, of equally near ones the lower node.
pub(super) fn base(skin: &Skin, taxels: &[Pulling], mean: DVec3) -> u32 {
    let far = |node: u32| skin.taxel(node).position.distance_squared(mean);
    let nearest = taxels.iter().map(|taxel| (far(taxel.node), taxel.node));
    nearest.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).map_or(0, |(_, node)| node)
}

/// The shape of the touch on `taxels`, which is not empty; its link's chart is based at `base`. `total` is Σ wP. `places` is
/// memory.
pub(super) fn shape(
    skin: &Skin,
    taxels: &[Pulling],
    (base, link, total): (u32, u32, f64),
    wants_orientation: bool,
    places: &mut Vec<DVec2>,
) -> Shape {
    if taxels.len() == 1 {
        return Shape { flags: TouchFlags::ONE_TAXEL, ..Shape::default() };
    }
    let base = skin.taxel(base);
    let normal = base.mean_normal;
    let is_behind = |taxel: &Pulling| skin.taxel(taxel.node).mean_normal.dot(normal) < WRAPPED_COSINE;
    if taxels.iter().any(is_behind) {
        return in_space(skin, taxels, link, total);
    }
    let [u, v] = chart::directions(normal, skin.axes_of(link));
    places.clear();
    places.extend(taxels.iter().map(|taxel| {
        let taxel = skin.taxel(taxel.node);
        let place = chart::place(taxel.position - base.position, normal, taxel.mean_normal);
        DVec2::new(place.dot(u), place.dot(v))
    }));
    let pulls = || taxels.iter().zip(places.iter());
    let centre = pulls().map(|(taxel, &place)| place * taxel.pull).sum::<DVec2>() / total;
    let (mut a, mut b, mut d) = (0.0, 0.0, 0.0);
    for (taxel, &place) in pulls() {
        let (offset, pull) = (place - centre, taxel.pull / total);
        a += pull * offset.x * offset.x;
        b += pull * offset.x * offset.y;
        d += pull * offset.y * offset.y;
    }
    let line = |along: DVec2| {
        let along = if along.y < 0.0 || (along.y == 0.0 && along.x < 0.0) { -along } else { along };
        let angle_rad = Some(angle_of_line(along));
        Line { along: u * along.x + v * along.y, angle_rad }
    };
    let (trace, h) = (a + d, hypot(a - d, 2.0 * b));
    let axis = || half_way(a - d, 2.0 * b, h).map(line);
    let mut shape = of_moments((trace + h) / 2.0, ((trace - h) / 2.0).max(0.0), axis);
    if wants_orientation {
        let (orientation, flags) = two_points(taxels, places, centre, total);
        shape.orientation = orientation.map(line);
        shape.flags |= flags;
    }
    shape
}

/// The shape by the larger two moments.
fn of_moments(first: f64, second: f64, axis: impl FnOnce() -> Option<Line>) -> Shape {
    let trace = first + second;
    if trace <= TOGETHER_M * TOGETHER_M {
        return Shape { flags: TouchFlags::COINCIDENT, ..Shape::default() };
    }
    let anisotropy = ((first - second) / trace).clamp(0.0, 1.0);
    let axis = if anisotropy < ISOTROPIC { None } else { axis() };
    Shape {
        axis,
        anisotropy: Some(anisotropy),
        spread_m: Some([first.max(0.0).sqrt(), second.max(0.0).sqrt()]),
        flags: if axis.is_none() { TouchFlags::ISOTROPIC } else { TouchFlags::empty() },
        ..Shape::default()
    }
}

fn in_space(skin: &Skin, taxels: &[Pulling], link: u32, total: f64) -> Shape {
    let (centre, _) = mean(skin, taxels);
    let mut moments = DMat3::ZERO;
    for taxel in taxels {
        let offset = skin.taxel(taxel.node).position - centre;
        let weighted = offset * (taxel.pull / total);
        moments += DMat3::from_cols(offset * weighted.x, offset * weighted.y, offset * weighted.z);
    }
    let (values, vectors) = symmetric_eigen(moments);
    let axes = skin.axes_of(link);
    let line = || {
        let along = vectors[0].try_normalize()?;
        // The one of the two directions that is along the first of the link's axes that it is not across.
        let towards = axes.transpose() * along;
        let first = towards.to_array().into_iter().find(|part| part.abs() > 1e-9).unwrap_or(1.0);
        Some(Line { along: along * first.signum(), angle_rad: None })
    };
    let shape = of_moments(values[0], values[1].max(0.0), line);
    Shape { flags: shape.flags | TouchFlags::WRAPPED, ..shape }
}

/// The line through the two farthest points, not of unit length one.
fn two_points(taxels: &[Pulling], places: &[DVec2], centre: DVec2, total: f64) -> (Option<DVec2>, TouchFlags) {
    // The three farthest: distance, node and point.
    let none = (f64::NEG_INFINITY, u32::MAX, DVec2::ZERO);
    let mut farthest = [none; 3];
    for (taxel, &place) in taxels.iter().zip(places) {
        let point = (place - centre) * (taxel.pull / total);
        let far = hypot(point.x, point.y);
        let is_before = |other: &(f64, u32, DVec2)| far > other.0 || (far == other.0 && taxel.node < other.1);
        if let Some(rank) = farthest.iter().position(is_before) {
            farthest[rank..].rotate_right(1);
            farthest[rank] = (far, taxel.node, point);
        }
    }
    let [(r1, _, first), (r2, _, second), (r3, ..)] = farthest;
    let along = first - second;
    let length = hypot(along.x, along.y);
    if length <= NEAR * r1 || length == 0.0 {
        return (None, TouchFlags::COINCIDENT);
    }
    (Some(along / length), if r2 - r3 <= NEAR * r1 { TouchFlags::TIE } else { TouchFlags::empty() })
}

fn hypot(x: f64, y: f64) -> f64 {
    libm::hypot(x, y)
}

/// The unit vector half-way between (x, y), of the length r, and +x: the line's direction has half the angle.
fn half_way(x: f64, y: f64, r: f64) -> Option<DVec2> {
    // Of the two equal forms (r + x, y) and (y, r − x), the one that adds numbers of one sign loses nothing.
    let along = if x >= 0.0 { DVec2::new(r + x, y) } else { DVec2::new(y, r - x) };
    let length = hypot(along.x, along.y);
    (length > 0.0).then(|| along / length)
}

/// The angle of a line in [0, π), whose direction has v ≥ 0.
fn angle_of_line(along: DVec2) -> f64 {
    let angle_rad = libm::atan2(along.y + 0.0, along.x + 0.0);
    if angle_rad >= std::f64::consts::PI { 0.0 } else { angle_rad.max(0.0) }
}

/// The eigenvalues of a symmetric matrix, the largest first, and unit vectors along them, by Jacobi's rotations.
pub(super) fn symmetric_eigen(matrix: DMat3) -> ([f64; 3], [DVec3; 3]) {
    let mut m = matrix.to_cols_array_2d();
    let mut vectors = DMat3::IDENTITY.to_cols_array_2d();
    // Each sweep squares what is off the diagonal: a few are enough.
    for _ in 0..12 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if m[p][q] == 0.0 {
                continue;
            }
            let theta = (m[q][q] - m[p][p]) / (2.0 * m[p][q]);
            let sign = if theta < 0.0 { -1.0 } else { 1.0 };
            let tangent = sign / (theta.abs() + (theta * theta + 1.0).sqrt());
            let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
            let sine = tangent * cosine;
            for k in 0..3 {
                let (kp, kq) = (m[k][p], m[k][q]);
                (m[k][p], m[k][q]) = (cosine * kp - sine * kq, sine * kp + cosine * kq);
            }
            for k in 0..3 {
                let (pk, qk) = (m[p][k], m[q][k]);
                (m[p][k], m[q][k]) = (cosine * pk - sine * qk, sine * pk + cosine * qk);
                let (vp, vq) = (vectors[p][k], vectors[q][k]);
                (vectors[p][k], vectors[q][k]) = (cosine * vp - sine * vq, sine * vp + cosine * vq);
            }
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| m[b][b].total_cmp(&m[a][a]));
    (order.map(|k| m[k][k]), order.map(|k| DVec3::from_array(vectors[k])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_are_those_of_the_matrix() {
        let outer = |d: DVec3, s: f64| DMat3::from_cols(d * (d.x * s), d * (d.y * s), d * (d.z * s));
        for (direction, values) in [
            (DVec3::new(0.3, -0.5, 0.8), [3e-6, 2e-6, 1e-7]),
            (DVec3::Y, [5.0, 5.0, 1.0]),
            (DVec3::new(1.0, 1e-9, 0.0), [1e12, 0.0, 0.0]),
        ] {
            let along = direction.normalize();
            let (u, v) = along.any_orthonormal_pair();
            let (found, vectors) = symmetric_eigen(outer(along, values[0]) + outer(u, values[1]) + outer(v, values[2]));
            for k in 0..3 {
                assert!((found[k] - values[k]).abs() <= 1e-14 * values[0], "{found:?}");
                assert!((vectors[k].length() - 1.0).abs() < 1e-14);
            }
            if values[0] > values[1] {
                assert!(vectors[0].cross(along).length() < 1e-9);
            }
        }
        assert_eq!(symmetric_eigen(DMat3::ZERO).0, [0.0; 3]);
    }

    #[test]
    fn a_line_has_half_the_angle() {
        for tenths in 0..3600 {
            let angle = (f64::from(tenths) / 10.0).to_radians();
            let along = half_way(angle.cos(), angle.sin(), 1.0).unwrap();
            let cross = along.x * (angle / 2.0).sin() - along.y * (angle / 2.0).cos();
            assert!(cross.abs() < 1e-14, "{tenths}");
        }
        assert!(half_way(0.0, 0.0, 0.0).is_none());
        assert_eq!([DVec2::NEG_X, DVec2::X].map(angle_of_line), [0.0, 0.0]);
    }
}
