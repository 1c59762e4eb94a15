//! A requested layout.

use std::collections::BTreeMap;
use std::path::PathBuf;

use glam::DVec3;

use crate::body::Modality;
use crate::error::{Error, Result, failed};
use crate::group::FieldRule;
use crate::length;
use crate::limits::MAX_TAXELS;
use crate::origin::Origin;
use crate::recipe_values::{Globs, Length, Names};
use crate::region::Region;

/// Which taxels to place on a body, and how to group them.
///
/// In a file it is TOML; a length is a number of metres or a text like `"8 mm"`.
///
/// ```
/// use somatic_author::{Recipe, author};
/// use somatic_skin::body::Original;
/// use somatic_bodies as bundled;
///
/// # fn main() -> somatic_skin::Result<()> {
/// let text = r#"
///     [regions.head]
///     node = "head"
///
///     [[place]]
///     region = "head"
///     taxels = 60
/// "#;
/// let recipe = Recipe::parse("recipe.toml", text, "".as_ref())?;
/// let file = Original::from_bytes("humanoid", bundled::HUMANOID, None)?;
/// let authored = author(file, &recipe, |_share| {})?;
/// assert_eq!(authored.places[0].ids, Vec::from_iter(0..60));
/// authored.file.to_glb()?; // or `save`
/// # Ok(())
/// # }
/// ```
///
/// `docs/reference/recipe.md` describes all keys.
#[derive(Clone, Debug, Default)]
pub struct Recipe {
    /// The unit of the mesh file's numbers, and its metres.
    pub(crate) unit: Option<(String, f64)>,
    /// Regions that get no taxel from any place that samples.
    pub(crate) bare: Vec<(String, Origin)>,
    /// Whether taxels that the file has stay.
    pub(crate) keeps_existing: bool,
    pub(crate) regions: BTreeMap<String, Region>,
    pub(crate) places: Vec<PlaceSpec>,
    pub(crate) fields: Vec<(FieldRule, Origin)>,
    /// Links that carry one skin.
    pub(crate) joins: Vec<(Globs, Origin)>,
    pub(super) seed: u64,
    /// Whether points that were sampled stay where they are, instead of moving until their cells are alike.
    pub(crate) is_scattered: bool,
    /// Whether surface that nothing can touch gets sampled taxels, too.
    pub(crate) keeps_hidden: bool,
    /// How far sampled taxels are from borders of links and seams at least, m.
    pub(crate) clear_m: Option<f64>,
    /// Whether the two sides of the body, by the plane y = 0 of the world, get the same taxels.
    pub(crate) is_mirrored: bool,
}

/// Taxels of one kind on some regions.
#[derive(Clone, Debug)]
pub(crate) struct PlaceSpec {
    pub(crate) name: String,
    /// Names of regions; none means all of the skin.
    pub(crate) regions: Vec<String>,
    /// Its own seed, instead of the recipe's.
    pub(crate) seed: Option<u64>,
    /// The first of its ids, which count up.
    pub(crate) first_id: u32,
    /// What its taxels measure, if it says so.
    pub(crate) modality: Option<Modality>,
    pub(crate) how: Placement,
    pub(crate) at: Origin,
}

#[derive(Clone, Debug)]
pub(crate) enum Placement {
    /// `count` evenly, with a minimum spacing if given.
    Evenly { count: usize, apart_m: Option<f64> },
    /// `count` by a painted density.
    Density { count: usize, attribute: String },
    /// As many as fit with a spacing.
    Apart { spacing_m: f64 },
    /// On a grid in a geodesic chart.
    Grid { hexagonal: bool, pitch_m: f64, origin: Option<DVec3>, u: Option<DVec3> },
    /// At empties or points with these names.
    Marks { names: Globs, within_m: f64 },
    /// At the places of a table.
    Table { path: PathBuf, within_m: f64 },
    /// At the places of an iCub position file, in the frame of `link`, or of the link that the file names.
    Icub { path: PathBuf, link: Option<String>, within_m: f64 },
}

impl Placement {
    /// Whether the places have ids.
    pub(crate) fn has_ids(&self) -> bool {
        matches!(self, Self::Table { .. })
    }

    /// Whether places are sampled, which excludes bare regions.
    pub(crate) fn samples(&self) -> bool {
        !matches!(self, Self::Marks { .. } | Self::Table { .. } | Self::Icub { .. })
    }
}

impl Recipe {
    /// The files that places are read from: tables and position files.
    #[must_use]
    pub fn files(&self) -> Vec<PathBuf> {
        let named = self.places.iter().filter_map(|place| match &place.how {
            Placement::Table { path, .. } | Placement::Icub { path, .. } => Some(path.clone()),
            _ => None,
        });
        named.collect()
    }

    /// A recipe without taxels: the body's own are grouped.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// A number of taxels (`taxels`), spread evenly, a spacing (such as `8 mm`), or both, on the nodes, meshes or links whose
    /// names match one of `nodes`; without any, on the whole surface.
    ///
    /// # Errors
    /// Neither number nor spacing is given, or one is invalid.
    pub fn simple(taxels: Option<u64>, spacing: Option<&str>, nodes: &[String]) -> Result<Self> {
        let mut recipe = Self::none();
        let usage = |flag: &str, e: &Error| Error::usage(e.to_string()).at(flag);
        let spacing = spacing.map(|text| text.parse().map_err(|e| usage("--spacing", &e))).transpose()?;
        let spacing_m = spacing.map(|length: Length| length.metres);
        let (how, flag) = match (taxels, spacing_m) {
            (Some(count), apart_m) => {
                let wrong = || failed!("{count} taxels; ask for 1 to {MAX_TAXELS}").at("--taxels");
                let fits = usize::try_from(count).ok().filter(|count| (1..=MAX_TAXELS).contains(count));
                (Placement::Evenly { count: fits.ok_or_else(wrong)?, apart_m }, "--taxels")
            }
            (None, Some(spacing_m)) => (Placement::Apart { spacing_m }, "--spacing"),
            (None, None) => {
                return Err(Error::usage("give a number of taxels (--taxels) or their spacing (--spacing)"));
            }
        };
        let name = if nodes.is_empty() { SKIN.to_owned() } else { nodes.join(", ") };
        let mut regions = Vec::new();
        // Each is a region of its own, so that one that is not there is reported.
        for own in nodes {
            let at = Origin::flag("--region");
            let node = Some(Globs::try_from(Names(vec![own.clone()])).map_err(|e| at.put(e))?);
            let region = Region { node, material: None, attribute: None, bounds: None, except: Vec::new(), at };
            recipe.regions.insert(own.clone(), region);
            regions.push(own.clone());
        }
        recipe.places.push(PlaceSpec {
            name,
            regions,
            seed: None,
            first_id: 0,
            modality: None,
            how,
            at: Origin::flag(flag),
        });
        Ok(recipe)
    }

    /// The same with another seed.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// The same where sampled taxels move until their cells are alike (`true`, as without this), or stay where they were scattered.
    #[must_use]
    pub fn with_even(self, even: bool) -> Self {
        Self { is_scattered: !even, ..self }
    }

    /// The same where surface that nothing can touch gets sampled taxels, too (`true`), or none (`false`, as without this).
    #[must_use]
    pub fn with_hidden(self, keep: bool) -> Self {
        Self { keeps_hidden: keep, ..self }
    }

    /// The same with sampled taxels at least so far from borders of links and seams, such as `5 mm`.
    ///
    /// # Errors
    /// It is not a length.
    pub fn with_clear(self, length: &str) -> Result<Self> {
        let length: Length = length.parse().map_err(|e: Error| Error::usage(e.to_string()))?;
        Ok(Self { clear_m: Some(length.metres), ..self })
    }

    /// The same with the same taxels on both sides of the body (`true`): sampled left of the world's plane y = 0, and mirrored in it.
    #[must_use]
    pub fn with_mirror(self, is_mirrored: bool) -> Self {
        Self { is_mirrored, ..self }
    }

    /// The same with the mesh file's numbers in `unit`: `um`, `mm`, `cm` or `m`.
    ///
    /// # Errors
    /// There is no such unit.
    pub fn with_unit(self, unit: &str) -> Result<Self> {
        Ok(Self { unit: Some((unit.to_owned(), unit_metres(unit)?)), ..self })
    }

    /// Whether it asks for nothing: neither taxels nor fields nor joined links.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.places.is_empty() && self.fields.is_empty() && self.joins.is_empty()
    }

    /// Takes its unit out, m: for a file whose numbers are made metres when it is opened.
    pub fn take_unit(&mut self) -> Option<f64> {
        self.unit.take().map(|(_, metres)| metres)
    }

    /// The seed of `place`, from its own or the recipe's seed and its name, so that it does not depend on other places.
    pub(crate) fn seed_of(&self, place: &PlaceSpec) -> u64 {
        // FNV-1a.
        let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3);
        let name = place.name.bytes().fold(0xCBF2_9CE4_8422_2325, step);
        place.seed.unwrap_or(self.seed).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ name
    }
}

pub(super) const SKIN: &str = "skin";

/// The metres of `unit`.
pub(super) fn unit_metres(unit: &str) -> Result<f64> {
    length::unit(unit).ok_or_else(|| Error::usage(format!("there is no unit `{unit}`; it is um, mm, cm or m")))
}

/// `metres` as text.
pub(crate) fn shown(metres: f64) -> String {
    if metres < 1.0 { format!("{:.1} mm", metres * 1e3) } else { format!("{metres:.2} m") }
}
