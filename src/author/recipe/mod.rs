//! Recipes: a requested layout, read and checked before the mesh.

mod file;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::glob::Globs;
use super::group::FieldRule;
use super::region::Region;
use crate::body::Modality;
use crate::error::{Error, Result};
use crate::length::{self, Length};

/// Default maximum distance of a given place from the surface, m.
const DEFAULT_WITHIN_M: f64 = 0.01;

/// The place of a key in messages: `recipe.toml: line 12`, or a flag.
#[derive(Clone, Debug, Default)]
pub(super) struct Origin {
    file: String,
    line: String,
}

impl Origin {
    fn flag(name: &str) -> Self {
        Self { file: String::new(), line: name.to_owned() }
    }

    /// The error `what` at this place.
    pub(super) fn wrong(&self, what: impl Into<String>) -> Error {
        self.put(Error::failed(what))
    }

    /// `error` with this place.
    pub(super) fn put(&self, error: Error) -> Error {
        let error = if self.line.is_empty() { error } else { error.at(&self.line) };
        if self.file.is_empty() { error } else { error.at(&self.file) }
    }
}

/// Which taxels to place on a body, and how to group them.
///
/// In a file it is TOML; a length is a number of metres or a text like `"8 mm"`.
///
/// ```
/// use somatic::author::{Recipe, author};
/// use somatic::body::Original;
/// use somatic::bundled;
///
/// # fn main() -> somatic::Result<()> {
/// let text = r#"
///     seed = 1                     # which of many equally good placements
///     bare = ["face"]              # regions that nothing is sampled on
///
///     [regions.head]               # what a triangle must have; all of it has to hold
///     node = "head"                # a node with a mesh, the mesh, or the link that carries the triangle
///
///     [regions.face]
///     node = ["head", "neck"]      # any of several, as globs; `material` likewise
///     box = [[-1, 0, 0.05], [1, 2, 1]]     # where its middle is, in the world at rest, m
///
///     [regions.rest]
///     except = "head"              # names of other regions; `attribute = "_PALM"` or "COLOR_0.r" is a painted one
///
///     [[place]]                    # so many, as blue noise
///     region = "head"
///     first_id = 0                 # ids count up from here, and so never depend on another place
///     taxels = 60                  # with `density = "_DENSITY"` as it is painted, with `spacing` no closer
///
///     [[place]]                    # as many as fit
///     region = "rest"
///     first_id = 1000
///     spacing = "40 mm"
///     modality = "temperature"
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
/// The other ways to fill a place: `grid = "hexagonal"` or `"rectangular"` with `pitch`, and where wanted `origin` and `u`
/// (the direction of its rows), in a geodesic chart; `points = "tip*"`, empties and points of the file by their names;
/// `csv = "taxels.csv"`, a table `id,x,y,z` in metres in the world at rest, or in the frame of a fifth column `link`. The
/// last two are taken to the nearest surface, if that is not beyond `within` (10 mm unless it is given). `seed` and `name`
/// may be a place's own: it samples with a seed made of both. `unit = "mm"` says what the file's numbers are, `existing =
/// "keep"` that the taxels it has stay.
#[derive(Clone, Debug)]
pub struct Recipe {
    /// The unit of the mesh file's numbers, and its metres.
    pub(super) unit: Option<(String, f64)>,
    /// Regions that get no taxel from any place that samples.
    pub(super) bare: Vec<(String, Origin)>,
    /// Whether taxels that the file has stay.
    pub(super) keeps_existing: bool,
    pub(super) regions: BTreeMap<String, Region>,
    pub(super) places: Vec<PlaceSpec>,
    pub(super) fields: Vec<(FieldRule, Origin)>,
    seed: u64,
}

/// Taxels of one kind on some regions.
#[derive(Clone, Debug)]
pub(super) struct PlaceSpec {
    pub(super) name: String,
    /// Names of regions; none means all of the skin.
    pub(super) regions: Vec<String>,
    /// Its own seed, instead of the recipe's.
    pub(super) seed: Option<u64>,
    /// The first of its ids, which count up.
    pub(super) first_id: u32,
    pub(super) modality: Modality,
    pub(super) how: Placement,
    pub(super) at: Origin,
}

/// How taxels are placed.
#[derive(Clone, Debug)]
pub(super) enum Placement {
    /// `count` as blue noise, with a minimum spacing if given.
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
    pub(super) fn has_ids(&self) -> bool {
        matches!(self, Self::Table { .. })
    }

    /// Whether places are sampled, which excludes bare regions.
    pub(super) fn samples(&self) -> bool {
        !matches!(self, Self::Marks { .. } | Self::Table { .. } | Self::Icub { .. })
    }
}

impl Recipe {
    /// Reads the recipe in the TOML file at `path`.
    ///
    /// # Errors
    /// The file cannot be read, is no TOML, or asks for something that makes no sense. One line says where.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, &e))?;
        Self::parse(&path.display().to_string(), &text, path.parent().unwrap_or(Path::new("")))
    }

    /// Reads the recipe in `text`, called `name` in messages; files that it names are looked for in `folder`.
    ///
    /// # Errors
    /// As [`Recipe::load`].
    pub fn parse(name: &str, text: &str, folder: &Path) -> Result<Self> {
        file::parse(name, text, folder)
    }

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
        Self {
            unit: None,
            bare: Vec::new(),
            keeps_existing: false,
            regions: BTreeMap::new(),
            places: Vec::new(),
            fields: Vec::new(),
            seed: 0,
        }
    }

    /// A number of taxels as blue noise (`taxels`), a spacing (such as `8 mm`), or both, on the nodes, meshes or links whose
    /// names match one of `nodes`; without any, on the whole surface.
    ///
    /// # Errors
    /// Neither number nor spacing is given, or one is invalid.
    pub fn simple(taxels: Option<u64>, spacing: Option<&str>, nodes: &[String]) -> Result<Self> {
        let mut recipe = Self::none();
        let flag = |name: &str| Origin::flag(name);
        let spacing_m =
            spacing.map(|text| metres(text).map_err(|what| Error::usage(what).at("--spacing"))).transpose()?;
        let how = match (taxels, spacing_m) {
            (Some(count), apart_m) => {
                Placement::Evenly { count: check_count(count).map_err(|e| flag("--taxels").put(e))?, apart_m }
            }
            (None, Some(spacing_m)) => Placement::Apart { spacing_m },
            (None, None) => return Err(Error::usage("say how many taxels (--taxels) or how far apart (--spacing)")),
        };
        let mut regions = Vec::new();
        if !nodes.is_empty() {
            let at = flag("--region");
            let node = Some(Globs::new(nodes).map_err(|e| at.put(e))?);
            let region = Region { node, material: None, attribute: None, bounds: None, except: Vec::new(), at };
            recipe.regions.insert(nodes.join(", "), region);
            regions.push(nodes.join(", "));
        }
        recipe.places.push(PlaceSpec {
            name: regions.first().cloned().unwrap_or_else(|| SKIN.to_owned()),
            regions,
            seed: None,
            first_id: 0,
            modality: Modality::Pressure,
            how,
            at: flag(if taxels.is_some() { "--taxels" } else { "--spacing" }),
        });
        Ok(recipe)
    }

    /// The same with another seed.
    #[must_use]
    pub fn with_seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// The same with the mesh file's numbers in `unit`: `um`, `mm`, `cm` or `m`.
    ///
    /// # Errors
    /// There is no such unit.
    pub fn with_unit(self, unit: &str) -> Result<Self> {
        Ok(Self { unit: Some((unit.to_owned(), unit_metres(unit).map_err(Error::usage)?)), ..self })
    }

    /// The seed of `place`, from its own or the recipe's seed and its name, so that it does not depend on other places.
    pub(super) fn seed_of(&self, place: &PlaceSpec) -> u64 {
        // FNV-1a.
        let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3);
        let name = place.name.bytes().fold(0xCBF2_9CE4_8422_2325, step);
        place.seed.unwrap_or(self.seed).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ name
    }
}

/// Default name of a place on the whole surface.
const SKIN: &str = "skin";

fn check_count(count: u64) -> Result<usize> {
    match usize::try_from(count) {
        Ok(count) if (1..=4_000_000).contains(&count) => Ok(count),
        _ => Err(Error::failed(format!("{count} taxels cannot be placed; ask for 1 to 4000000"))),
    }
}

/// Parses a length over 0, m.
fn metres(text: &str) -> Result<f64, String> {
    let length = Length::parse(text.trim())?.ok_or("a length is missing; write one like 8mm")?;
    let unit = length.unit_m.ok_or_else(|| format!("`{text}` has no unit; write one like 8mm"))?;
    let metres = length.number * unit;
    let fits = metres.is_finite() && metres > 0.0;
    fits.then_some(metres).ok_or_else(|| format!("`{text}` is no length over 0"))
}

fn unit_metres(unit: &str) -> Result<f64, String> {
    length::unit(unit).ok_or_else(|| format!("there is no unit `{unit}`; it is um, mm, cm or m"))
}

/// `metres` as text.
pub(super) fn shown(metres: f64) -> String {
    if metres < 1.0 { format!("{:.1} mm", metres * 1e3) } else { format!("{metres:.2} m") }
}
