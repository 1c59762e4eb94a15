//! Normals of taxels that are means over some surface around them, for charts: those of single facets halve the touches on
//! meshes of few triangles that can be laid flat.

use glam::DVec3;

use super::geodesic::SurfacePlace;
use super::link_surface::LinkSurface;
use super::seats::{Seat, Seated};
use crate::body::{Body, Taxel, area_vector};

/// Surface up to this distance from a taxel counts, m.
const REACH_M: f64 = 0.004;

/// Triangles are cut until their edges are shorter than this, m.
const PIECE_M: f64 = REACH_M / 3.0;

/// Normals that differ by less than this are the same.
const SAME_NORMAL: f64 = 1e-9;

/// Maximum number of cuts of a triangle.
const MAX_CUTS: u32 = 40;

/// Per taxel of `body` the mean outward normal of the surface within 4 mm, in its link's frame, of unit length. Surface at the
/// distance d from the taxel has the weight 1 − (d/4 mm)². Only what is connected with the taxel's place and faces its side
/// counts. Without such a surface it is the taxel's own normal.
#[must_use]
pub fn mean_normals(body: &Body) -> Vec<DVec3> {
    mean_normals_of(body, &Seated::new(body))
}

/// The same of taxels that are `seated`.
pub fn mean_normals_of(body: &Body, seated: &Seated) -> Vec<DVec3> {
    let mean = |(taxel, seat): (&Taxel, &Option<Seat>)| {
        let seat = seat.as_ref()?;
        let group = &seated.groups[seat.group];
        let anchor_from_link = body.rest_transform(group.anchor, taxel.link);
        let own = anchor_from_link.transform_vector3(taxel.normal_in_link);
        let mean = mean_normal(&group.surface, &seat.place, own)?;
        Some(body.rest_transform(taxel.link, group.anchor).transform_vector3(mean))
    };
    let taxels = body.taxels.iter().zip(&seated.seats);
    taxels.map(|(taxel, seat)| mean((taxel, seat)).unwrap_or(taxel.normal_in_link)).collect()
}

/// The mean normal around `place`, on the side that `own` faces.
fn mean_normal(surface: &LinkSurface, place: &SurfacePlace, own: DVec3) -> Option<DVec3> {
    let topology = &surface.topology;
    let (at, part) = (place.position(topology), topology.part[place.triangle as usize]);
    let mut near: Vec<(u32, DVec3)> = surface
        .within(at, REACH_M)
        .filter(|&(triangle, normal)| topology.part[triangle as usize] == part && normal.dot(own) > 0.0)
        .collect();
    // Sums must not depend on the order of a search.
    near.sort_unstable_by_key(|&(triangle, _)| triangle);
    let (_, first) = *near.first()?;
    if near.iter().all(|(_, normal)| normal.distance(first) < SAME_NORMAL) {
        return Some(first);
    }
    let sum: DVec3 = near.iter().map(|&(triangle, normal)| normal * weight(topology.corners(triangle), at)).sum();
    sum.try_normalize()
}

/// The integral of the weight over a triangle, by pieces.
fn weight(corners: [DVec3; 3], at: DVec3) -> f64 {
    let mut sum = 0.0;
    let mut open = vec![(corners, MAX_CUTS)];
    while let Some(([a, b, c], cuts)) = open.pop() {
        let middle = (a + b + c) / 3.0;
        let radius = [a, b, c].map(|p| p.distance(middle)).into_iter().fold(0.0, f64::max);
        if middle.distance(at) > REACH_M + radius {
            continue;
        }
        // Cut across the longest edge.
        let lengths = [a.distance_squared(b), b.distance_squared(c), c.distance_squared(a)];
        let longest = (0..3).fold(0, |best, edge| if lengths[edge] > lengths[best] { edge } else { best });
        if cuts == 0 || lengths[longest] <= PIECE_M * PIECE_M {
            let share = 1.0 - middle.distance_squared(at) / (REACH_M * REACH_M);
            sum += share.max(0.0) * area_vector([a, b, c]).length() / 2.0;
            continue;
        }
        let turned = [[a, b, c], [b, c, a], [c, a, b]][longest];
        let [from, to, third] = turned;
        let half = (from + to) / 2.0;
        open.push(([from, half, third], cuts - 1));
        open.push(([half, to, third], cuts - 1));
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Glb, MeshData, Modality, Taxel};

    /// A roof over the y-axis whose sides fall by `slope`, with taxels at the distances `across` from the ridge.
    fn roof(slope: f64, across: &[f64]) -> Body {
        let corner = |x: f64, y: f64| DVec3::new(x, y, -slope * x.abs()).as_vec3().to_array();
        let positions = [-0.05, 0.0, 0.05].iter().flat_map(|&x| [corner(x, -0.05), corner(x, 0.05)]).collect();
        let triangles = vec![[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]];
        let mesh = MeshData { positions, normals: vec![[0.0, 0.0, 1.0]; 6], triangles, skinning: None };
        let mut glb = Glb::new();
        let link = glb.node("roof", None, DVec3::ZERO);
        glb.mesh(link, "roof", &mesh, None, None);
        let taxel = |(id, &x): (u32, &f64)| Taxel {
            id,
            link: 0,
            position_in_link: DVec3::new(x, 0.0, -slope * x.abs()),
            normal_in_link: DVec3::new(slope * x.signum(), 0.0, 1.0).normalize(),
            area: 0.0,
            modality: Modality::Pressure,
            tangent_in_link: None,
        };
        glb.taxels("taxels", Some(link), &(0..).zip(across).map(taxel).collect::<Vec<_>>(), None);
        Body::from_bytes("roof", &glb.to_bytes().unwrap()).unwrap()
    }

    #[test]
    fn a_mean_normal_turns_towards_the_other_side_of_a_ridge() {
        let body = roof(0.5, &[0.02, 1e-6, 0.001, -0.002]);
        let means = mean_normals(&body);
        let own: Vec<DVec3> = body.taxels.iter().map(|taxel| taxel.normal_in_link).collect();
        assert!(means[0].distance(own[0]) < 1e-6, "nothing else is within reach");
        assert!(means[1].distance(DVec3::Z) < 0.01, "{}", means[1]);
        // At x the ridge is s = x √1.25 away along the side. The other side's part of a bump of radius 4 mm, folded by the roof's
        // angle, is less than what a plane would have: the share of the weight beyond a line at s/r = 0.28 is 0.29.
        let turned = |i: usize| means[i].x / own[i].x;
        assert!((0.35..0.62).contains(&turned(2)), "{}", turned(2));
        assert!((0.75..0.99).contains(&turned(3)) && means[3].x < 0.0, "{}", turned(3));
        assert!(means.iter().all(|mean| (mean.length() - 1.0).abs() < 1e-12 && mean.y.abs() < 0.01));
    }

    #[test]
    fn the_weight_of_a_plane_is_that_of_a_bump() {
        let large = [DVec3::new(-1.0, -1.0, 0.0), DVec3::new(2.0, -1.0, 0.0), DVec3::new(-1.0, 2.0, 0.0)];
        // ∫ (1 − ρ²/r²) over a disc is half its area.
        let half = std::f64::consts::PI * REACH_M * REACH_M / 2.0;
        assert!((weight(large, DVec3::ZERO) / half - 1.0).abs() < 0.02, "{}", weight(large, DVec3::ZERO) / half);
        assert_eq!(weight(large, DVec3::Z), 0.0);
    }
}
