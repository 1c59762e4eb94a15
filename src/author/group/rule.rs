//! What a `[[fields]]` table of a recipe says.

use serde::Deserialize;

use super::super::recipe_values::{Globs, Ids, Length};

/// One rule: which taxels, and what fields they make. As a table of a recipe:
///
/// ```toml
/// [[fields]]
/// name = "left_arm/forearm"      # makes `left_arm` too, which holds what is below it
/// link = "l_forearm"
/// patches = { of = 16 }          # left_arm/forearm/patch_01, …, about 16 taxels each
///
/// [[fields]]
/// within = "left_arm/*/patch_*"  # each of them gets children of its own
/// radius = "15 mm"               # …/patch_01/disc_01, …
/// overlap = 0.5
/// ```
///
/// **Which taxels.** `link`, `mesh`, `material` (globs or lists of them), `attribute` (a painted vertex attribute: over
/// 0.5 where the taxel is), `modality` and `taxels` (ids and ranges, `[1, 2, "10..=20"]`); a taxel has to meet all that are
/// given. Without `modality` and `taxels`, only taxels for pressure where there are any. With `within`, a glob over the
/// fields that rules before this one made, the rule is applied in each of those by itself.
///
/// **What they make.** Without more, one field called `name`. Else that field, where there is a `name`, and below it, by one
/// of these keys:
///
/// | key | children |
/// |---|---|
/// | `each = "link"`, `"mesh"` or `"material"` | one for each, with its name |
/// | `patches = 8` or `{ of = 16 }` | so many compact patches, or as many as have about 16 taxels, by distance along the surface |
/// | `radius = "20 mm"` | all within that distance along the surface of each of the `seeds`: ids, points `[x, y, z]` (m, in the world at rest) or a glob over fields, whose middles they are; without `seeds`, of seeds spread so that neighbouring discs share `overlap` of their width (0 to under 1; 0.5 and more leaves no taxel out) |
/// | `seeds` with `overlap` | the same, each disc as wide as makes it share that much with the nearest other |
/// | `rows = { of = 8, first = 0, stride = 32 }` | one for each run of 8 ids, from `first` (the lowest id) on, `stride` (8) apart |
/// | `columns = { of = 8, first = 0 }` | one for each place in runs of 8 ids |
///
/// Patches and discs keep to one link each. Children are called by `stem` (`patch`, `disc`, `row`, `column`) and a number from
/// one. Every level of a name is a field; one that no rule makes holds what is below it. With `parent`, the topmost level stands
/// below that field: `parent = "body"` puts `left_arm/forearm` under `body` without a longer name.
///
/// **Charts.** `chart` is `"auto"` (a plane where that is true to length to 5 %, else the truer of both; one that is over 25 %
/// off is split where `wrap` says so, else told), `"plane"`, `"geodesic"` or
/// `"none"`; `u` the direction of +u in the anchor's frame. A field that has no such chart, as it goes around a limb, is by
/// `wrap` given none (`"bare"`, which is what happens without the key to `auto`), split into children that have one
/// (`"split"`), or an error that says what split would do (`"refuse"`, without the key where a chart is asked for by name).
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FieldRule {
    /// Name of the field, or of what its children stand below.
    pub name: Option<String>,
    /// The field that the topmost level of its names stands below.
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
    /// What children are called, before their number.
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
    },
}

/// Where discs have their middles.
#[derive(Clone, Debug, Deserialize)]
#[serde(untagged, expecting = "give seeds as taxel ids, as points [x, y, z] in m, or as a glob over fields")]
pub enum Seeds {
    /// At these taxels.
    Ids(Vec<Ids>),
    /// At the surface points nearest to these, m, in the world at rest.
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
    /// A plane where that is true to length, else the truer of a plane and a geodesic one.
    #[default]
    Auto,
    /// The tangent plane's.
    Plane,
    /// A geodesic one.
    Geodesic,
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
