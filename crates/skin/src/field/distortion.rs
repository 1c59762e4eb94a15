//! The distortion of lengths in a chart.

use glam::{DVec2, DVec3};

use crate::body::point_tree;

/// Number of neighbours to measure per member.
const NEIGHBOURS: usize = 6;

/// Number of nearest members to search for them; some may be coincident or face away.
const MAX_CANDIDATES: usize = 24;

const MAX_MEASURED: usize = 4096;

/// How much a chart stretches and shrinks distances.
///
/// Each member is compared with its six nearest with normals within 90°. The relative error of a pair is its distance in
/// (u, v) over its distance on the surface, less 1. The distance on the surface is estimated from positions and normals
/// for a constant curvature: with the chord c, the angle θ between the normals and m the direction of their difference,
/// c's part along m is lengthened by (θ/2)/sin(θ/2). That is exact on planes, spheres and cylinders. Each is also compared with its
/// six nearest in (u, v): no way on a surface is shorter than the chord, so where these are nearer to each other than that, the chart is
/// folded, and the relative error is what is missing. Of more than 4096 members, 4096 are measured, evenly selected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Distortion {
    /// The largest relative error, also of folds; 0 without neighbours.
    pub largest: f64,
    /// The root mean square of the relative errors of neighbours on the surface.
    pub rms: f64,
    /// The most stretched pair of members, and its factor.
    pub worst: Option<(usize, usize, f64)>,
}

impl Distortion {
    /// The distortion of a chart that maps `members` (position, m, and unit normal) to `places`, m.
    #[must_use]
    pub fn measure(members: &[(DVec3, DVec3)], places: &[DVec2]) -> Self {
        let tree = point_tree(members.iter().map(|(position, _)| *position));
        let in_chart = point_tree(places.iter().map(|place| place.extend(0.0)));
        let mut measured = Self::default();
        let (mut squares, mut pairs) = (0.0, 0_u64);
        for i in (0..members.len()).step_by(members.len().div_ceil(MAX_MEASURED).max(1)) {
            let (position, normal) = members[i];
            let near = tree.nearest_neighbor_iter(position.to_array()).take(MAX_CANDIDATES).map(|spot| spot.data);
            let beside = near.filter(|&j| members[j].0 != position && members[j].1.dot(normal) > 0.0);
            for j in beside.take(NEIGHBOURS) {
                let factor = places[i].distance(places[j]) / on_surface(members[i], members[j]);
                let error = (factor - 1.0).abs();
                measured.largest = measured.largest.max(error);
                if measured.worst.is_none_or(|(.., most)| factor > most) {
                    measured.worst = Some((i, j, factor));
                }
                squares += error * error;
                pairs += 1;
            }
            let near = in_chart.nearest_neighbor_iter(places[i].extend(0.0).to_array()).map(|spot| spot.data);
            for j in near.filter(|&j| members[j].0 != position).take(NEIGHBOURS) {
                measured.largest =
                    measured.largest.max(1.0 - places[i].distance(places[j]) / members[j].0.distance(position));
            }
        }
        measured.rms = if pairs > 0 { (squares / pairs as f64).sqrt() } else { 0.0 };
        measured
    }
}

/// The distance on the surface between two points with normals within 90°, m.
pub(super) fn on_surface(a: (DVec3, DVec3), b: (DVec3, DVec3)) -> f64 {
    let (chord, turned) = (b.0 - a.0, b.1 - a.1);
    // Unit normals differ by 2·sin(θ/2).
    let half_sine = turned.length() / 2.0;
    let Some(along) = turned.try_normalize() else { return chord.length() };
    let arc = chord.dot(along);
    let longer = half_sine.min(1.0).asin() / half_sine;
    (chord.length_squared() + arc * arc * (longer * longer - 1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Members on a cylinder of radius 1 around y: (angle, height) and what they are.
    fn cylinder(step: f64, around: i32) -> Vec<((DVec3, DVec3), DVec2)> {
        let at = |angle: f64, y: f64| {
            let normal = DVec3::new(angle.sin(), 0.0, angle.cos());
            ((normal + DVec3::Y * y, normal), DVec2::new(angle, y))
        };
        (-around..=around).flat_map(|a| (0..6).map(move |y| at(f64::from(a) * step, f64::from(y) * step))).collect()
    }

    #[test]
    fn an_unrolled_cylinder_has_none_and_a_projected_one_its_cosine() {
        let (members, places): (Vec<_>, Vec<_>) = cylinder(0.1, 12).into_iter().unzip();
        let unrolled = Distortion::measure(&members, &places);
        assert!(unrolled.largest < 1e-13 && unrolled.rms <= unrolled.largest, "{unrolled:?}");
        let projected: Vec<DVec2> = members.iter().map(|(position, _)| position.truncate()).collect();
        let projected = Distortion::measure(&members, &projected);
        // The outermost pair lies between 1.1 and 1.2 rad.
        let right = 1.0 - (1.2_f64.sin() - 1.1_f64.sin()) / 0.1;
        assert!((projected.largest - right).abs() < 1e-12, "{projected:?} {right}");
        assert!(projected.rms > 0.0 && projected.rms < projected.largest);
        let doubled: Vec<DVec2> = places.iter().map(|&p| 2.0 * p).collect();
        assert!((Distortion::measure(&members, &doubled).rms - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_two_sides_of_a_fin_are_folded_onto_each_other() {
        let side = |y: f64, normal: DVec3| (0..4).map(move |i| (DVec3::new(0.01 * f64::from(i), y, 0.0), normal));
        let members: Vec<_> = side(0.0, DVec3::Y).chain(side(-0.002, DVec3::NEG_Y)).collect();
        let places: Vec<DVec2> = members.iter().map(|(position, _)| DVec2::new(position.x, -position.z)).collect();
        assert!((Distortion::measure(&members, &places).largest - 1.0).abs() < 1e-12);
        let apart: Vec<DVec2> = (0..8).map(|i| DVec2::new(0.01 * f64::from(i % 4), 0.1 * f64::from(i / 4))).collect();
        assert!(Distortion::measure(&members, &apart).largest < 1e-12);
    }

    #[test]
    fn members_on_one_point_or_alone_have_none() {
        let member = (DVec3::X, DVec3::Z);
        assert_eq!(Distortion::measure(&[member; 40], &[DVec2::ZERO; 40]), Distortion::default());
        assert_eq!(Distortion::measure(&[], &[]), Distortion::default());
    }
}
