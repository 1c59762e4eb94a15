//! Taxels' places on the surfaces of a body at rest.

use std::collections::{BTreeMap, BTreeSet};

use super::geodesic::SurfacePlace;
use super::link_surface::LinkSurface;
use super::surface_groups::surface_groups;
use crate::body::{Body, Home, Taxel};

/// A taxel farther from a surface than this is not on it, m: a cover may be between them.
const ON_SURFACE_M: f64 = 0.01;

/// Surfaces that are connected where they touch, at rest in the frame of a link.
pub(super) struct Group {
    pub(super) anchor: usize,
    pub(super) surface: LinkSurface,
    links: BTreeSet<usize>,
}

impl Group {
    /// The groups of `body` that one of `links` moves.
    pub(super) fn all(body: &Body, links: impl Iterator<Item = usize>) -> Vec<Self> {
        let mut surfaces: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (surface, group) in surface_groups(body).into_iter().enumerate() {
            surfaces.entry(group).or_default().push(surface);
        }
        let wanted: BTreeSet<usize> = links.collect();
        let group = |surfaces: Vec<usize>| {
            let links: BTreeSet<usize> =
                surfaces.iter().flat_map(|&surface| carriers(&body.surfaces[surface].home)).collect();
            let anchor = *links.first()?;
            (!links.is_disjoint(&wanted)).then(|| Self {
                anchor,
                surface: LinkSurface::at_rest(body, anchor, &surfaces),
                links,
            })
        };
        surfaces.into_values().filter_map(group).collect()
    }
}

fn carriers(home: &Home) -> Vec<usize> {
    match home {
        Home::Rigid { link, .. } => vec![*link],
        Home::Skinned { joints, .. } => joints.iter().map(|(link, _)| *link).collect(),
    }
}

/// The surfaces of a body at rest, and where its taxels are on them.
pub struct Seated {
    pub(super) groups: Vec<Group>,
    /// Per taxel of the body; `None` for one on no surface.
    pub(super) seats: Vec<Option<Seat>>,
}

impl Seated {
    /// The taxels of `body`.
    pub fn new(body: &Body) -> Self {
        let groups = Group::all(body, body.taxels.iter().map(|taxel| taxel.link));
        let seats = body.taxels.iter().map(|taxel| seat(body, &groups, taxel)).collect();
        Self { groups, seats }
    }
}

/// A taxel's place on the surface of a group.
pub(super) struct Seat {
    pub(super) group: usize,
    pub(super) place: SurfacePlace,
}

/// The place of `taxel` on the nearest surface that its link moves.
pub(super) fn seat(body: &Body, groups: &[Group], taxel: &Taxel) -> Option<Seat> {
    let own = groups.iter().enumerate().filter(|(_, group)| group.links.contains(&taxel.link));
    let seats = own.filter_map(|(index, group)| {
        let anchor_from_link = body.rest_transform(group.anchor, taxel.link);
        let at = anchor_from_link.transform_point3(taxel.position_in_link);
        let place = group.surface.locate(at, anchor_from_link.transform_vector3(taxel.normal_in_link))?;
        Some((place.position(&group.surface.topology).distance(at), Seat { group: index, place }))
    });
    let nearest = seats.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (nearest.0 <= ON_SURFACE_M).then_some(nearest.1)
}
