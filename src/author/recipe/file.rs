//! Reads and checks a recipe's file.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use glam::DVec3;
use serde::Deserialize;
use toml::Spanned;

use super::{DEFAULT_WITHIN_M, Origin, PlaceSpec, Placement, Recipe, SKIN, check_count, metres, unit_metres};
use crate::author::glob::Globs;
use crate::author::group::FieldRule;
use crate::author::region::Region;
use crate::body::{MAX_TAXEL_ID, Modality};
use crate::error::{Result, nearest};
use crate::keys::Text;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    seed: u64,
    unit: Option<Spanned<String>>,
    #[serde(default)]
    existing: Existing,
    #[serde(default)]
    bare: Vec<Spanned<String>>,
    #[serde(default)]
    regions: HashMap<Spanned<String>, RegionKeys>,
    #[serde(default)]
    place: Vec<Spanned<PlaceKeys>>,
    #[serde(default)]
    fields: Vec<Spanned<FieldRule>>,
}

#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
enum Existing {
    #[default]
    Replace,
    Keep,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RegionKeys {
    node: Option<Spanned<Names>>,
    material: Option<Spanned<Names>>,
    attribute: Option<Spanned<String>>,
    #[serde(rename = "box")]
    bounds: Option<Spanned<[[f64; 3]; 2]>>,
    except: Option<Spanned<Names>>,
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
enum GridName {
    Hexagonal,
    Rectangular,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaceKeys {
    name: Option<Spanned<String>>,
    region: Option<Spanned<Names>>,
    seed: Option<u64>,
    first_id: Option<Spanned<i64>>,
    modality: Option<Spanned<String>>,
    taxels: Option<Spanned<i64>>,
    spacing: Option<Spanned<LengthKey>>,
    density: Option<Spanned<String>>,
    grid: Option<Spanned<GridName>>,
    pitch: Option<Spanned<LengthKey>>,
    origin: Option<Spanned<[f64; 3]>>,
    u: Option<Spanned<[f64; 3]>>,
    points: Option<Spanned<Names>>,
    csv: Option<Spanned<String>>,
    icub: Option<Spanned<String>>,
    link: Option<Spanned<String>>,
    within: Option<Spanned<LengthKey>>,
}

#[derive(Clone, Deserialize)]
#[serde(untagged, expecting = "it is a name, or a list of names")]
enum Names {
    One(String),
    Many(Vec<String>),
}

impl Names {
    fn list(&self) -> Vec<String> {
        match self {
            Self::One(name) => vec![name.clone()],
            Self::Many(names) => names.clone(),
        }
    }
}

#[derive(Clone, Deserialize)]
#[serde(untagged, expecting = "a length is a number of metres, or a text like \"8 mm\"")]
enum LengthKey {
    Metres(f64),
    Text(String),
}

/// A recipe's text and its name in messages.
#[derive(Clone, Copy)]
struct RecipeText<'a> {
    name: &'a str,
    text: Text<'a>,
}

impl RecipeText<'_> {
    /// The place of `value`.
    fn origin<T>(self, value: &Spanned<T>) -> Origin {
        Origin { file: self.name.to_owned(), line: format!("line {}", self.text.line(value.span().start)) }
    }

    fn length(self, key: &str, value: &Spanned<LengthKey>) -> Result<f64> {
        let wrong = |what: String| self.origin(value).wrong(format!("`{key}`: {what}"));
        match value.get_ref() {
            LengthKey::Metres(m) if m.is_finite() && *m > 0.0 => Ok(*m),
            LengthKey::Metres(m) => Err(wrong(format!("{m} is no length over 0, in metres"))),
            LengthKey::Text(text) => metres(text).map_err(wrong),
        }
    }

    fn globs(self, names: Option<&Spanned<Names>>) -> Result<Option<Globs>> {
        let globs = names.map(|names| Globs::new(&names.get_ref().list()).map_err(|e| self.origin(names).put(e)));
        globs.transpose()
    }

    fn point(self, key: &str, value: &Spanned<[f64; 3]>) -> Result<DVec3> {
        let point = DVec3::from_array(*value.get_ref());
        let fits = point.is_finite();
        if fits {
            Ok(point)
        } else {
            Err(self.origin(value).wrong(format!("`{key}` is {point}; its numbers must be finite")))
        }
    }
}

pub(super) fn parse(name: &str, text: &str, folder: &Path) -> Result<Recipe> {
    let recipe_text = RecipeText { name, text: Text(text) };
    let file: File = recipe_text.text.parse().map_err(|e| e.at(name))?;
    let mut recipe = Recipe { keeps_existing: file.existing == Existing::Keep, seed: file.seed, ..Recipe::none() };
    if let Some(unit) = &file.unit {
        let metres = unit_metres(unit.get_ref()).map_err(|what| recipe_text.origin(unit).wrong(what))?;
        recipe.unit = Some((unit.get_ref().clone(), metres));
    }
    for (name, keys) in &file.regions {
        recipe.regions.insert(name.get_ref().clone(), region(recipe_text, name, keys)?);
    }
    let known = &recipe.regions;
    let check = |names: &[String], at: &Origin| {
        let Some(unknown) = names.iter().find(|name| !known.contains_key(*name)) else { return Ok(()) };
        let hint = match nearest(unknown, known.keys().map(String::as_str)) {
            Some(near) => format!("did you mean `{near}`?"),
            None => "write a [regions] table for it".to_owned(),
        };
        Err(at.wrong(format!("there is no region `{unknown}`; {hint}")))
    };
    for region in known.values() {
        check(&region.except, &region.at)?;
    }
    recipe.bare = file.bare.iter().map(|name| (name.get_ref().clone(), recipe_text.origin(name))).collect();
    for (name, at) in &recipe.bare {
        check(std::slice::from_ref(name), at)?;
    }
    for keys in &file.place {
        let place = place(recipe_text, keys, folder)?;
        let at = keys.get_ref().region.as_ref().map_or_else(|| place.at.clone(), |region| recipe_text.origin(region));
        check(&place.regions, &at)?;
        if recipe.places.iter().any(|other| other.name == place.name) {
            let at = keys.get_ref().name.as_ref().map_or_else(|| place.at.clone(), |name| recipe_text.origin(name));
            return Err(at.wrong(format!("two places are called `{}`; give one another `name`", place.name)));
        }
        recipe.places.push(place);
    }
    check_first_ids(recipe_text, &file.place, &recipe.places)?;
    recipe.fields =
        file.fields.into_iter().map(|table| (table.get_ref().clone(), recipe_text.origin(&table))).collect();
    Ok(recipe)
}

fn region(recipe_text: RecipeText<'_>, name: &Spanned<String>, keys: &RegionKeys) -> Result<Region> {
    let bounds = match &keys.bounds {
        None => None,
        Some(bounds) => {
            let [low, high] = bounds.get_ref().map(DVec3::from_array);
            if !(low.cmple(high).all() && low.is_finite() && high.is_finite()) {
                let what =
                    "`box` has its lower corner over its upper; give [[x, y, z], [x, y, z]], the smaller numbers first";
                return Err(recipe_text.origin(bounds).wrong(what));
            }
            Some([low, high])
        }
    };
    Ok(Region {
        node: recipe_text.globs(keys.node.as_ref())?,
        material: recipe_text.globs(keys.material.as_ref())?,
        attribute: keys.attribute.as_ref().map(|attribute| attribute.get_ref().clone()),
        bounds,
        except: keys.except.as_ref().map_or_else(Vec::new, |names| names.get_ref().list()),
        at: keys.attribute.as_ref().map_or_else(|| recipe_text.origin(name), |attribute| recipe_text.origin(attribute)),
    })
}

fn place(recipe_text: RecipeText<'_>, spanned: &Spanned<PlaceKeys>, folder: &Path) -> Result<PlaceSpec> {
    let keys = spanned.get_ref();
    let at = recipe_text.origin(spanned);
    let (how, at) = how(recipe_text, keys, &at, folder)?;
    let regions = keys.region.as_ref().map_or_else(Vec::new, |names| names.get_ref().list());
    let default_name = || regions.first().cloned().unwrap_or_else(|| SKIN.to_owned());
    let first_id = match &keys.first_id {
        None => 0,
        Some(id) if how.has_ids() => {
            return Err(recipe_text.origin(id).wrong("`first_id` means nothing where the table has ids; remove it"));
        }
        Some(id) => u32::try_from(*id.get_ref()).ok().filter(|id| *id <= MAX_TAXEL_ID).ok_or_else(|| {
            recipe_text
                .origin(id)
                .wrong(format!("`first_id` is {}; ids lie between 0 and {MAX_TAXEL_ID}", id.get_ref()))
        })?,
    };
    Ok(PlaceSpec {
        name: keys.name.as_ref().map_or_else(default_name, |name| name.get_ref().clone()),
        regions,
        seed: keys.seed,
        first_id,
        modality: keys.modality.as_ref().map_or(Ok(Modality::Pressure), |name| modality(recipe_text, name))?,
        how,
        at,
    })
}

fn modality(recipe_text: RecipeText<'_>, name: &Spanned<String>) -> Result<Modality> {
    let known = [Modality::Pressure, Modality::Temperature, Modality::Proximity];
    let found = known.into_iter().find(|modality| modality.name() == *name.get_ref());
    let names = known.map(Modality::name);
    found.ok_or_else(|| {
        let hint = match nearest(name.get_ref(), names.iter().map(String::as_str)) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("it is one of {}", names.join(", ")),
        };
        recipe_text.origin(name).wrong(format!("there is no modality `{}`; {hint}", name.get_ref()))
    })
}

/// How taxels are placed, and the place of that key.
fn how(recipe_text: RecipeText<'_>, keys: &PlaceKeys, at: &Origin, folder: &Path) -> Result<(Placement, Origin)> {
    let ways = [
        ("taxels", keys.taxels.as_ref().map(|key| recipe_text.origin(key))),
        ("spacing", keys.spacing.as_ref().map(|key| recipe_text.origin(key))),
        ("grid", keys.grid.as_ref().map(|key| recipe_text.origin(key))),
        ("points", keys.points.as_ref().map(|key| recipe_text.origin(key))),
        ("csv", keys.csv.as_ref().map(|key| recipe_text.origin(key))),
        ("icub", keys.icub.as_ref().map(|key| recipe_text.origin(key))),
    ];
    let mut given = ways.into_iter().filter_map(|(name, at)| Some((name, at?)));
    let Some((way, way_at)) = given.next() else {
        return Err(at.wrong("a place says how: give it `taxels`, `spacing`, `grid`, `points`, `csv` or `icub`"));
    };
    if let Some((other, other_at)) = given.next()
        && (way, other) != ("taxels", "spacing")
    {
        return Err(other_at.wrong(format!("a place has one way: remove `{other}` or `{way}`")));
    }
    // Optional keys, and the key that each belongs to.
    let extras = [
        ("density", keys.density.as_ref().map(|key| recipe_text.origin(key)), "taxels"),
        ("pitch", keys.pitch.as_ref().map(|key| recipe_text.origin(key)), "grid"),
        ("origin", keys.origin.as_ref().map(|key| recipe_text.origin(key)), "grid"),
        ("u", keys.u.as_ref().map(|key| recipe_text.origin(key)), "grid"),
        (
            "within",
            keys.within.as_ref().map(|key| recipe_text.origin(key)),
            if ["csv", "icub"].contains(&way) { way } else { "points" },
        ),
        ("link", keys.link.as_ref().map(|key| recipe_text.origin(key)), "icub"),
    ];
    if let Some((name, at, _)) = extras.into_iter().filter_map(|(n, at, of)| Some((n, at?, of))).find(|e| e.2 != way) {
        return Err(at.wrong(format!("`{name}` means nothing beside `{way}`; remove it")));
    }
    let spacing_m = keys.spacing.as_ref().map(|key| recipe_text.length("spacing", key)).transpose()?;
    let within_m = keys.within.as_ref().map_or(Ok(DEFAULT_WITHIN_M), |key| recipe_text.length("within", key))?;
    let how = if let Some(taxels) = &keys.taxels {
        let count =
            u64::try_from(*taxels.get_ref()).map_err(|_| way_at.wrong("there are no negative numbers of taxels"));
        let count = check_count(count?).map_err(|e| way_at.put(e))?;
        match (&keys.density, spacing_m) {
            (Some(density), Some(_)) => {
                return Err(recipe_text
                    .origin(density)
                    .wrong("a place has `density` or `spacing`, not both; remove one"));
            }
            (Some(density), None) => Placement::Density { count, attribute: density.get_ref().clone() },
            (None, apart_m) => Placement::Evenly { count, apart_m },
        }
    } else if let Some(spacing_m) = spacing_m {
        Placement::Apart { spacing_m }
    } else if let Some(grid) = &keys.grid {
        let pitch =
            keys.pitch.as_ref().ok_or_else(|| way_at.wrong("a grid needs its `pitch`, as in `pitch = \"5 mm\"`"))?;
        Placement::Grid {
            hexagonal: *grid.get_ref() == GridName::Hexagonal,
            pitch_m: recipe_text.length("pitch", pitch)?,
            origin: keys.origin.as_ref().map(|origin| recipe_text.point("origin", origin)).transpose()?,
            u: keys.u.as_ref().map(|u| recipe_text.point("u", u)).transpose()?,
        }
    } else if let Some(icub) = &keys.icub {
        let link = keys.link.as_ref().map(|link| link.get_ref().clone());
        Placement::Icub { path: folder.join(icub.get_ref()), link, within_m }
    } else if let Some(csv) = &keys.csv {
        Placement::Table { path: folder.join(csv.get_ref()), within_m }
    } else if let Some(names) = recipe_text.globs(keys.points.as_ref())? {
        Placement::Marks { names, within_m }
    } else {
        return Err(at.wrong("a place says how: give it `taxels`, `spacing`, `grid`, `points`, `csv` or `icub`"));
    };
    Ok((how, way_at))
}

/// Checks that each of several places that number their taxels has a `first_id`.
fn check_first_ids(recipe_text: RecipeText<'_>, keys: &[Spanned<PlaceKeys>], places: &[PlaceSpec]) -> Result<()> {
    let counting: Vec<usize> = (0..places.len()).filter(|&i| !places[i].how.has_ids()).collect();
    if places.len() < 2 {
        return Ok(());
    }
    let Some(&without) = counting.iter().find(|&&i| keys[i].get_ref().first_id.is_none()) else { return Ok(()) };
    // Ranges of a power of ten, at least twice the largest number of taxels, leave room to grow.
    let most = places.iter().map(|place| match place.how {
        Placement::Evenly { count, .. } | Placement::Density { count, .. } => 2 * count,
        _ => 1000,
    });
    let most = most.max().unwrap_or(1000);
    let mut step = 100;
    while step < most {
        step *= 10;
    }
    let given: BTreeMap<usize, u32> =
        counting.iter().filter(|&&i| keys[i].get_ref().first_id.is_some()).map(|&i| (i, places[i].first_id)).collect();
    let free = (0..).map(|n| n * step).find(|n| !given.values().any(|&id| id as usize / step == n / step));
    Err(recipe_text.origin(&keys[without]).wrong(format!(
        "place `{}` needs a `first_id`, so that its ids stay when other places come or go; write `first_id = {}`",
        places[without].name,
        free.unwrap_or(0)
    )))
}
