//! Receptive fields: taxels with weights and coordinates.
//!
//! [`FieldSet::new`] builds the fields that a body's file specifies: a parent gets the union of its descendants' taxels,
//! every field an anchor, and a chart if it has one.

mod chart;

mod distortion;
pub mod geodesic;
mod geodesic_surface;
mod link_surface;
mod neighbours;
mod rechart;
mod surface_grid;
mod unroll;

use std::collections::{BTreeMap, BTreeSet};

use glam::{DAffine3, DVec3};

pub use chart::{Chart, NoChart};
pub use distortion::Distortion;
pub(crate) use link_surface::LinkSurface;
pub use neighbours::neighbours;
pub(crate) use rechart::Recharted;
pub use surface_grid::Lift;
pub use unroll::Unroller;

use crate::body::{Body, FieldSpec, Nearest};
use crate::error::{Error, Result};

/// Name of the world frame: of fields whose links share no ancestor, and of percepts in posed frames.
pub const WORLD: &str = "world";

/// A taxel as a member of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Member {
    /// Index into the body's taxels.
    pub taxel: usize,
    /// Weight w > 0.
    pub weight: f64,
    /// (u, v, depth along the normal) in the field's chart, m; the depth is 0 in a geodesic one. In a field without a chart,
    /// the offset from its origin along its anchor's axes, m.
    pub place: DVec3,
}

/// A receptive field with all properties that do not change between frames.
#[derive(Clone, Debug)]
pub struct Field {
    /// Unique name.
    pub name: String,
    /// Index of the parent field.
    pub parent: Option<usize>,
    /// The link of the field's frame; `None` is the world at rest.
    pub anchor: Option<usize>,
    /// Members by ascending taxel id.
    pub members: Vec<Member>,
    /// Origin of the members' places, in the anchor's frame, m.
    pub origin_in_anchor: DVec3,
    /// The field's chart, or why it has none.
    pub chart: std::result::Result<Chart, NoChart>,
}

impl Field {
    /// The largest distance of a member from the origin, m.
    #[must_use]
    pub fn radius_m(&self) -> f64 {
        self.members.iter().map(|member| member.place.length()).fold(0.0, f64::max)
    }

    /// Estimated distance of neighbouring members, m, as if they were spread evenly over the field's extent.
    #[must_use]
    pub fn spacing_m(&self) -> f64 {
        let span = |axis: fn(DVec3) -> f64| {
            let ends =
                self.members.iter().map(|m| axis(m.place)).fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
            (ends.1 - ends.0).max(0.0)
        };
        let mut spans = [span(|p| p.x), span(|p| p.y), span(|p| p.z)];
        spans.sort_by(|a, b| b.total_cmp(a));
        let count = self.members.len() as f64;
        (spans[0] * spans[1] / count).sqrt().max(spans[0] / count)
    }
}

/// All fields of a body, a parent before its children.
#[derive(Clone, Debug)]
pub struct FieldSet {
    /// The fields.
    pub fields: Vec<Field>,
}

impl FieldSet {
    /// Builds the fields that `body` specifies.
    ///
    /// # Errors
    /// A field has no taxel, nor have its descendants.
    pub fn new(body: &Body) -> Result<Self> {
        Self::of(body, &body.fields)
    }

    /// Builds the fields `specs` on `body`.
    fn of(body: &Body, specs: &[FieldSpec]) -> Result<Self> {
        let parents = parents(specs);
        let taxels = unions(specs);
        let nearest = Nearest::new(body);
        let mut fields = Vec::with_capacity(specs.len());
        for (index, spec) in specs.iter().enumerate() {
            let members: Vec<(usize, f64, Option<[f64; 2]>)> = taxels[index]
                .iter()
                .filter_map(|id| {
                    let own = spec.members.get(id).copied().unwrap_or_default();
                    Some((body.taxel_index(*id)?, own.weight, own.uv))
                })
                .collect();
            if members.is_empty() {
                return Err(Error::failed(format!(
                    "field `{}` has no taxels, nor has any field below it; give it some or remove it",
                    spec.name
                ))
                .at(&body.name));
            }
            fields.push(chart::complete(body, &nearest, spec, parents[index], &members));
        }
        Ok(Self { fields })
    }
}

/// Per field the index of its parent.
fn parents(fields: &[FieldSpec]) -> Vec<Option<usize>> {
    let index_of: BTreeMap<&str, usize> = fields.iter().enumerate().map(|(i, f)| (f.name.as_str(), i)).collect();
    fields.iter().map(|f| f.parent.as_deref().and_then(|p| index_of.get(p).copied())).collect()
}

/// Per field of `fields`, which has parents before their children, the ids of its own taxels and its descendants'.
#[must_use]
pub fn unions(fields: &[FieldSpec]) -> Vec<BTreeSet<u32>> {
    let parents = parents(fields);
    let mut taxels: Vec<BTreeSet<u32>> = fields.iter().map(|f| f.members.keys().copied().collect()).collect();
    // Children come after their parents, so that one pass from the back gathers all descendants.
    for child in (0..taxels.len()).rev() {
        if let Some(parent) = parents[child] {
            let below = taxels[child].clone();
            taxels[parent].extend(below);
        }
    }
    taxels
}

/// At rest, the transform from link `link` to a field's anchor.
pub(crate) fn anchor_from_link(body: &Body, anchor: Option<usize>, link: usize) -> DAffine3 {
    match anchor {
        Some(anchor) => body.rest_transform(anchor, link),
        None => body.links[link].world_from_link,
    }
}
