//! What a `[[fields]]` table of a recipe says.

use serde::Deserialize;

use crate::error::{Error, Result};
use crate::recipe_values::{Globs, Ids, Length};

/// One rule: which taxels, and what fields they make. As a table of a recipe:
///
/// ```toml
/// [[fields]]
/// name = "left_arm/forearm"      # makes `left_arm` too, which holds what is below it
/// link = "l_forearm"
/// patches = { of = 16 }          # left_arm/forearm/inner_1, …, about 16 taxels each
///
/// [[fields]]
/// within = "left_arm/forearm/*"  # each of them gets children of its own
/// radius = "15 mm"               # …/inner_1/disc_01, …
/// overlap = 0.5
/// ```
///
/// A taxel must meet all conditions that are given. A rule makes the field `name`, or with one of `each`, `patches`, `radius`,
/// `seeds`, `rows` and `columns` children below it, called by `stem` and a number, patches without it by the
/// side of the body that they are on. Every level of a name is a field.
/// `docs/reference/recipe.md` describes all keys.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct FieldRule {
    /// Name of the field, or of what its children stand below.
    pub name: Option<String>,
    /// The parent of the topmost level of its names.
    pub parent: Option<String>,
    /// Fields to apply the rule in.
    pub within: Option<Globs>,
    /// Names of links.
    pub link: Option<Globs>,
    /// Names of nodes that show meshes.
    pub mesh: Option<Globs>,
    /// Names of materials.
    pub material: Option<Globs>,
    /// A painted vertex attribute, or a colour's channel, as [`super::Painted`] knows it.
    pub attribute: Option<String>,
    /// What the taxels measure: a modality's name.
    pub modality: Option<String>,
    /// Ids and ranges of ids.
    pub taxels: Option<Vec<Ids>>,
    /// One child for each of these.
    pub each: Option<Each>,
    /// Compact patches.
    pub patches: Option<Patches>,
    /// How far a disc reaches from its seed along the surface.
    pub radius: Option<Length>,
    /// The middles of discs.
    pub seeds: Option<Seeds>,
    /// The share of its width that a disc has in common with its neighbour, on the line between their seeds.
    pub overlap: Option<f64>,
    /// Rows of a board.
    pub rows: Option<Rows>,
    /// Columns of a board.
    pub columns: Option<Rows>,
    /// What children are called, before their number; patches without it are called by the sides that they are on.
    pub stem: Option<String>,
    /// The weight of every member; 1 without.
    pub weight: Option<f64>,
    /// What chart the fields get.
    pub chart: Option<ChartWish>,
    /// What happens to a field that has no such chart.
    pub wrap: Option<Wrap>,
    /// Direction of +u in the anchor's frame.
    pub u: Option<[f64; 3]>,
}

impl FieldRule {
    /// Checks that the rule is consistent by itself.
    pub(super) fn check(&self) -> Result<()> {
        let (radius, seeds, overlap) = (self.radius.is_some(), self.seeds.is_some(), self.overlap.is_some());
        let discs = radius || seeds || overlap;
        let divisions =
            [self.each.is_some(), self.patches.is_some(), discs, self.rows.is_some(), self.columns.is_some()];
        let divides = divisions.into_iter().filter(|&given| given).count();
        let is_bad_weight = |weight: f64| !(1e-6..=1e6).contains(&weight);
        let problems = [
            (
                divides > 1,
                "it has several of `each`, `patches`, `radius`, `rows` and `columns`: keep one, and divide further by a rule `within`",
            ),
            (divides == 0 && self.name.is_none(), "add a `name`, or `each`, `patches`, `radius`, `rows` or `columns`"),
            (
                matches!(self.patches, Some(Patches::Number(0) | Patches::Of { of: 0, .. })),
                "`patches` must be 1 or more",
            ),
            (self.parent.is_some() && self.within.is_some(), "`parent` has no effect with `within`; remove one"),
            (
                self.rows.or(self.columns).is_some_and(|rows| rows.of == 0 || rows.stride == Some(0)),
                "`of` and `stride` of rows must be 1 or more",
            ),
            (self.overlap.is_some_and(|share| !(0.0..1.0).contains(&share)), "`overlap` must be from 0 to under 1"),
            (discs && !radius && !(seeds && overlap), "discs need a `radius`, or `seeds` and an `overlap`"),
            (discs && !seeds && !overlap, "discs of a `radius` need `seeds` or an `overlap`"),
            (radius && seeds && overlap, "remove one of `radius`, `seeds` and `overlap`"),
            (self.weight.is_some_and(is_bad_weight), "`weight` must be from 1e-6 to 1e6"),
            (
                self.u.is_some_and(|u| !u.iter().all(|x| x.is_finite()) || u == [0.0; 3]),
                "`u` must be a direction [x, y, z], not all 0",
            ),
        ];
        match problems.into_iter().find(|(found, _)| *found) {
            Some((_, what)) => Err(Error::failed(what)),
            None => Ok(()),
        }
    }
}

/// What children are made for each of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Each {
    /// Links.
    Link,
    /// Nodes that show meshes.
    Mesh,
    /// Materials.
    Material,
}

/// How many patches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(untagged, expecting = "give a number of patches, or `{ of = N }` for about N taxels a patch")]
pub enum Patches {
    /// So many.
    Number(usize),
    /// As many as have about `of` taxels each.
    Of {
        /// Taxels a patch.
        of: usize,
        /// Whether patches of a link have equal numbers of taxels, rather than equal extents.
        #[serde(default)]
        even: bool,
    },
}

/// Where discs have their middles.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged, expecting = "give seeds as taxel ids, as points [x, y, z] in m, or as a glob over fields")]
pub enum Seeds {
    /// At these taxels.
    Ids(Vec<Ids>),
    /// At the surface points nearest to these, m, in the body at rest.
    Points(Vec<[f64; 3]>),
    /// At the middles of fields.
    Fields(Globs),
}

/// Runs of ids.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rows {
    /// Ids a run.
    pub of: u32,
    /// The first run's first id; the lowest id chosen without.
    pub first: Option<u32>,
    /// From a run's first id to the next's; `of` without.
    pub stride: Option<u32>,
}

/// What chart a field is to get.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ChartWish {
    /// A plane where that is true to length, else the truer of a plane and a geodesic one; one by normals where both are poor.
    #[default]
    Auto,
    /// The tangent plane's.
    Plane,
    /// A geodesic one.
    Geodesic,
    /// One by the normals of its taxels.
    Normals,
    /// None.
    None,
}

/// What happens to a field that cannot have the chart it is to get.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Wrap {
    /// It has none, and a note says why.
    Bare,
    /// It gets children that have one.
    Split,
    /// It is an error, which says what split would do.
    Refuse,
}
