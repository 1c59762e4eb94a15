//! Receptive fields: which taxels, with what weight, in what coordinates.
//!
//! A body's file outlines fields; [`FieldSet::new`] completes them: every parent gets the union of its descendants'
//! taxels, every field an anchor, and a chart where one exists.

mod chart;
mod curved;
mod distortion;
pub mod geodesic;
mod lift;
mod neighbours;
mod rechart;
mod surfaces;
mod unroll;

use std::collections::{BTreeMap, BTreeSet};

use glam::{DAffine3, DVec3};

pub use chart::{Chart, NoChart};
pub use distortion::Distortion;
pub use lift::Lift;
pub use neighbours::neighbours;
pub(crate) use rechart::Recharted;
pub(crate) use surfaces::Skin;
pub use unroll::Unroller;

use crate::body::{Body, FieldSpec, Nearest};
use crate::error::{Error, Result};

/// Name of the frame that fields are anchored in when their links share no ancestor, and of posed percepts.
pub const WORLD: &str = "world";

/// One taxel's part in a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Member {
    /// Index into the body's taxels.
    pub taxel: usize,
    /// Weight w > 0.
    pub weight: f64,
    /// (u, v, depth along the normal) in the field's chart, m, where the depth of a geodesic one is 0; of a field without
    /// a chart, the offset from its origin along its anchor's axes.
    pub place: DVec3,
}

/// A receptive field with everything worked out that does not change from frame to frame.
#[derive(Clone, Debug)]
pub struct Field {
    /// Unique name.
    pub name: String,
    /// Index of the parent field.
    pub parent: Option<usize>,
    /// The link in whose frame the field answers; `None` is the world at rest.
    pub anchor: Option<usize>,
    /// Members by ascending taxel id.
    pub members: Vec<Member>,
    /// Where places are measured from, in the anchor's frame.
    pub origin_in_anchor: DVec3,
    /// The field's own coordinates, or why it has none.
    pub chart: std::result::Result<Chart, NoChart>,
}

impl Field {
    /// The largest distance of a member from the origin, m.
    #[must_use]
    pub fn radius_m(&self) -> f64 {
        self.members.iter().map(|member| member.place.length()).fold(0.0, f64::max)
    }

    /// About how far neighbouring members lie apart, m: what they would if spread evenly over the field's extent.
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
    /// Completes the fields that `body` outlines.
    ///
    /// # Errors
    /// A field without any taxel, even through its children.
    pub fn new(body: &Body) -> Result<Self> {
        Self::of(body, &body.fields)
    }

    /// Completes the fields that `specs` outline on `body`.
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
