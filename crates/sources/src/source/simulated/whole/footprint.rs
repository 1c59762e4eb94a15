//! What is true of the pressure on the taxels: its place, normal, link and principal axis.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};

use super::chart::{principal, unrolled};
use super::press::Felt;
use super::surface::{Spot, WholeSurface};
use crate::body::SurfaceIndex;

/// Normals farther from the place's than 120° are on the other side of a limb.
const WRAPPED_COSINE: f64 = -0.5;
/// A touch is wrapped around a limb if more than this share of its force is there.
const WRAPPED_SHARE: f64 = 0.01;
/// Moments that differ by a smaller share have no principal axis.
const MIN_ANISOTROPY: f64 = 0.01;

/// The place and shape of the pressure under the layer, at rest.
pub(super) struct Footprint {
    /// The surface point nearest to the pressure's mean in space, and its facet.
    pub(super) spot: Spot,
    /// The smooth outward normal there.
    pub(super) normal: DVec3,
    /// The link that bears most of the force.
    pub(super) link: usize,
    /// Unit vector along the footprint, if it has a direction.
    pub(super) principal_axis: Option<DVec3>,
    /// Of the even disc with the same second moment, m.
    pub(super) radius_m: f64,
}

impl Footprint {
    /// Of what the pieces of `surface` feel; `None` if they feel nothing.
    pub(super) fn new(surface: &WholeSurface, felt: &[Felt]) -> Option<Self> {
        let force: f64 = felt.iter().map(|felt| felt.force_newton).sum();
        if force <= 0.0 {
            return None;
        }
        let mean = felt.iter().map(|felt| felt.piece.middle * felt.force_newton).sum::<DVec3>() / force;
        let mut facets: Vec<usize> = felt.iter().map(|felt| felt.facet).collect();
        facets.sort_unstable();
        facets.dedup();
        let index = SurfaceIndex::of_triangles(facets.iter().map(|&facet| surface.facet(facet).corners));
        let nearest = index.nearest(mean)?;
        let spot = Spot { position: nearest.position, normal: nearest.normal, facet: facets[nearest.triangle] };
        let normal = surface.smooth_normal(&spot);
        let mut by_link: BTreeMap<usize, f64> = BTreeMap::new();
        felt.iter().for_each(|felt| *by_link.entry(surface.facet(felt.facet).link).or_default() += felt.force_newton);
        let most = by_link.into_iter().reduce(|most, other| if other.1 > most.1 { other } else { most });
        let (link, _) = most?;
        let moments = moments(surface, felt, &spot, normal);
        let radius_m = (2.0 * (moments.x_axis.x + moments.y_axis.y + moments.z_axis.z)).sqrt();
        Some(Self { spot, normal, link, principal_axis: axis(moments), radius_m })
    }
}

/// The second moments of the pressure, unrolled around `spot`, m²; in space where it is wrapped around a limb.
fn moments(surface: &WholeSurface, felt: &[Felt], spot: &Spot, normal: DVec3) -> DMat3 {
    let force: f64 = felt.iter().map(|felt| felt.force_newton).sum();
    let behind = felt.iter().filter(|felt| surface.facet(felt.facet).normal.dot(normal) < WRAPPED_COSINE);
    let wrapped = behind.map(|felt| felt.force_newton).sum::<f64>() > WRAPPED_SHARE * force;
    let place = |felt: &Felt| {
        let offset = felt.piece.middle - spot.position;
        if wrapped { offset } else { unrolled(offset, normal, surface.facet(felt.facet).normal) }
    };
    let mean = felt.iter().map(|felt| place(felt) * felt.force_newton).sum::<DVec3>() / force;
    let mut moments = DMat3::ZERO;
    for felt in felt {
        let from_mean = place(felt) - mean;
        let weighted = from_mean * (felt.force_newton / force);
        moments += DMat3::from_cols(from_mean * weighted.x, from_mean * weighted.y, from_mean * weighted.z);
    }
    moments
}

/// The direction of the largest of them, if they have one.
fn axis(moments: DMat3) -> Option<DVec3> {
    let (direction, first, second) = principal(moments)?;
    ((first - second) >= MIN_ANISOTROPY * (first + second)).then_some(direction)
}
