//! Charts by normals: taxels around one of them, laid out as if the surface were unrolled by its normals.
//!
//! The base has the normal n₀. For a taxel at the offset r with the normal n, let t = r − (r·n₀)n₀, θ the angle between the
//! normals, e the unit tangent along n − (n·n₀)n₀, and m = e cos(θ/2) − n₀ sin(θ/2), the direction of a chord. Then
//!
//! place = t + e ((r·m) (θ/2) / sin(θ/2) − t·e)
//!
//! The chord's part along m becomes the arc over it. On planes, spheres and cylinders that is exact in every direction; at a
//! crease it is as long as the way over it where both sides are equally long. It needs no surface, so that holes, gaps and
//! shells that do not meet make no difference.

use std::collections::BTreeSet;

use glam::DVec3;

use super::chart::NoChart;
use super::set::MAX_TURN_COSINE;
use crate::body::{Body, ChartKind, ChartSpec, FieldSpec, tangent_frame};

/// Normals with a smaller sine between them are parallel.
const PARALLEL_SINE: f64 = 1e-9;

/// θ/2 ÷ sin(θ/2), from the sine.
fn arc_by_chord(half_sine: f64) -> f64 {
    if half_sine < 1e-4 { 1.0 + half_sine * half_sine / 6.0 } else { libm::asin(half_sine.min(1.0)) / half_sine }
}

/// The place of a taxel at `offset` from the base, as a vector across the base's `normal`; `other` is the taxel's own normal.
#[doc(hidden)]
#[must_use]
pub fn place_by_normals(offset: DVec3, normal: DVec3, other: DVec3) -> DVec3 {
    let flat = offset - normal * offset.dot(normal);
    let cosine = normal.dot(other);
    let tilt = other - normal * cosine;
    let sine = tilt.length();
    if sine < PARALLEL_SINE {
        return flat;
    }
    let towards = tilt / sine;
    let half_cosine = ((1.0 + cosine) / 2.0).max(0.0).sqrt();
    // The first form loses nothing at small angles, the second nothing at large ones.
    let half_sine = if cosine > 0.0 { sine / (2.0 * half_cosine) } else { ((1.0 - cosine) / 2.0).max(0.0).sqrt() };
    let chord = offset.dot(towards * half_cosine - normal * half_sine);
    flat + towards * (chord * arc_by_chord(half_sine) - flat.dot(towards))
}

/// The link that all own members of `spec` are on, and their taxels.
///
/// # Errors
/// There are none, or they are on several links.
pub(super) fn taxels_on_one_link(body: &Body, spec: &FieldSpec) -> Result<(usize, Vec<usize>), NoChart> {
    let taxels: Vec<usize> = spec.members.keys().filter_map(|&id| body.taxel_index(id)).collect();
    let links: BTreeSet<usize> = taxels.iter().map(|&taxel| body.taxels[taxel].link).collect();
    match links.first() {
        None => Err(NoChart::NoTaxels),
        Some(&link) if links.len() == 1 => Ok((link, taxels)),
        Some(_) => Err(NoChart::SeveralLinks(links.len())),
    }
}

/// `spec` with a chart by normals and its own members' (u, v). The base is the member nearest to the origin of `spec`'s chart, else to the
/// middle; the direction of +u is that of `spec`'s chart, else the default of a plane chart.
///
/// # Errors
/// Why there is no such chart.
pub(super) fn unroll(body: &Body, spec: &FieldSpec) -> Result<FieldSpec, NoChart> {
    let (_, taxels) = taxels_on_one_link(body, spec)?;
    let members: Vec<(DVec3, DVec3)> = taxels
        .iter()
        .map(|&taxel| (body.taxels[taxel].position_in_link, body.taxels[taxel].normal_in_link.normalize()))
        .collect();
    let mean = members.iter().map(|(position, _)| *position).sum::<DVec3>() / members.len() as f64;
    let facing = members.iter().map(|(_, normal)| *normal).sum::<DVec3>().normalize_or_zero();
    let wanted = spec.chart.and_then(|chart| chart.origin_in_anchor).map(DVec3::from_array);
    let off = |(position, normal): &(DVec3, DVec3)| match wanted {
        Some(origin) => position.distance(origin),
        // One that looks another way is farther.
        None => position.distance(mean) * (2.0 - normal.dot(facing)),
    };
    let base = members.iter().copied().min_by(|a, b| off(a).total_cmp(&off(b)));
    let Some((origin, normal)) = base else { return Err(NoChart::NoTaxels) };
    let least = members.iter().map(|(_, other)| other.dot(normal)).fold(1.0, f64::min);
    if least < MAX_TURN_COSINE {
        return Err(NoChart::Turns(least.clamp(-1.0, 1.0).acos()));
    }
    let wanted = spec.chart.and_then(|chart| chart.u_in_anchor).map(DVec3::from_array);
    let [u, v, normal] = tangent_frame(normal, wanted);
    let mut spec = spec.clone();
    spec.chart = Some(ChartSpec {
        kind: ChartKind::Normals,
        origin_in_anchor: Some(origin.to_array()),
        u_in_anchor: Some(u.to_array()),
    });
    for (&taxel, (position, own)) in taxels.iter().zip(&members) {
        let place = place_by_normals(*position - origin, normal, *own);
        if let Some(member) = spec.members.get_mut(&body.taxels[taxel].id) {
            member.uv = Some([place.dot(u), place.dot(v)]);
        }
    }
    Ok(spec)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::place_by_normals as place;
    use super::*;

    #[test]
    fn planes_spheres_and_cylinders_are_unrolled_exactly() {
        let radius_m = 0.04;
        for turn in [0.0, 1e-10, 1e-7, 1e-4, 0.01, 0.5, 1.5, FRAC_PI_2, 2.5, 3.1_f64] {
            for side in [1.0, -1.0] {
                let normal = DVec3::new(side * turn.sin(), 0.0, turn.cos());
                let arc_m = side * radius_m * turn;
                let on_cylinder = (normal - DVec3::Z) * radius_m + DVec3::Y * 0.013;
                let found = place(on_cylinder, DVec3::Z, normal);
                assert!(found.distance(DVec3::new(arc_m, 0.013, 0.0)) < 1e-11, "{turn}: {found}");
                let on_sphere = (normal - DVec3::Z) * radius_m;
                assert!(place(on_sphere, DVec3::Z, normal).distance(DVec3::X * arc_m) < 1e-11);
                // Seen from inside, normals turn the other way.
                assert!(place(-on_sphere, DVec3::Z, normal).distance(-DVec3::X * arc_m) < 1e-11);
            }
        }
        let flat = DVec3::new(0.3, -0.2, 0.0);
        assert_eq!(place(flat, DVec3::Z, DVec3::Z), flat);
        // A height over the plane is not a distance on it.
        assert_eq!(place(flat + DVec3::Z, DVec3::Z, DVec3::Z), flat);
        assert!(place(flat, DVec3::Z, -DVec3::Z).is_finite());
    }

    #[test]
    fn the_two_forms_of_the_half_angle_meet() {
        let at = |turn: f64| DVec3::new(turn.sin(), 0.0, turn.cos());
        for turn in [FRAC_PI_2 - 1e-9, FRAC_PI_2 + 1e-9] {
            assert!((place(at(turn) - DVec3::Z, DVec3::Z, at(turn)).x - turn).abs() < 1e-12);
        }
    }
}
