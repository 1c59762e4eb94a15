//! Reads and checks a recipe's file.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use serde::Deserialize;
use toml::Spanned;

use super::spec::{PlaceSpec, Placement, Recipe, SKIN, unit_metres};
use crate::body::{MAX_TAXEL_ID, Modality};
use crate::error::{Error, Result, suggestion};
use crate::group::FieldRule;
use crate::keys::Text;
use crate::limits::{self, MAX_PLACES, MAX_TAXELS, MAX_TOML_BYTES};
use crate::origin::Origin;
use crate::recipe_values::{Globs, Length, Names};
use crate::region::Region;

/// Default maximum distance of a given place from the surface, m.
const DEFAULT_WITHIN_M: f64 = 0.01;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(default)]
    seed: u64,
    unit: Option<Spanned<String>>,
    even: Option<bool>,
    #[serde(default)]
    hidden: HiddenSurface,
    clear: Option<Length>,
    mirror: Option<MirrorAxis>,
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
    #[serde(default)]
    join: Vec<JoinKeys>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct JoinKeys {
    links: Spanned<Globs>,
}

#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
enum Existing {
    #[default]
    Replace,
    Keep,
}

#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
enum HiddenSurface {
    #[default]
    Drop,
    Keep,
}

/// The axis of the world that the mirror plane is perpendicular to.
#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum MirrorAxis {
    Y,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RegionKeys {
    node: Option<Globs>,
    material: Option<Globs>,
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
    spacing: Option<Spanned<Length>>,
    density: Option<Spanned<String>>,
    grid: Option<Spanned<GridName>>,
    pitch: Option<Spanned<Length>>,
    origin: Option<Spanned<[f64; 3]>>,
    u: Option<Spanned<[f64; 3]>>,
    points: Option<Spanned<Globs>>,
    csv: Option<Spanned<String>>,
    icub: Option<Spanned<String>>,
    link: Option<Spanned<String>>,
    within: Option<Spanned<Length>>,
}

/// A recipe's text and its name in messages.
#[derive(Clone, Copy)]
struct RecipeText<'a> {
    text: Text<'a>,
    /// Both, as origins keep them.
    shared: &'a [Arc<str>; 2],
}

impl RecipeText<'_> {
    fn origin(self, span: Range<usize>) -> Origin {
        let [name, text] = self.shared;
        Origin::in_text(name, text, span.start)
    }

    fn point(self, key: &str, value: Option<&Spanned<[f64; 3]>>) -> Result<Option<DVec3>> {
        let Some(value) = value else { return Ok(None) };
        let point = DVec3::from_array(*value.get_ref());
        let wrong = || self.text.wrong(value.span(), format!("`{key}` is {point}; its numbers must be finite"));
        if point.is_finite() { Ok(Some(point)) } else { Err(wrong()) }
    }
}

fn span<T>(key: Option<&Spanned<T>>) -> Option<Range<usize>> {
    key.map(Spanned::span)
}

impl Recipe {
    /// Reads the recipe in the TOML file at `path`.
    ///
    /// # Errors
    /// The file cannot be read, is not TOML, or is inconsistent. One line says where.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let text = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
        Self::parse(&path.display().to_string(), &text, path.parent().unwrap_or(Path::new("")))
    }

    /// Reads the recipe in `text`, called `name` in messages; files that it names are looked for in `folder`.
    ///
    /// # Errors
    /// As [`Recipe::load`].
    pub fn parse(name: &str, text: &str, folder: &Path) -> Result<Self> {
        parse(RecipeText { text: Text(text), shared: &[name.into(), text.into()] }, folder).map_err(|e| e.at(name))
    }
}

fn parse(recipe_text: RecipeText<'_>, folder: &Path) -> Result<Recipe> {
    let text = recipe_text.text;
    let file: File = text.parse()?;
    let mut recipe = Recipe { keeps_existing: file.existing == Existing::Keep, seed: file.seed, ..Recipe::none() };
    recipe.is_scattered = file.even == Some(false);
    recipe.keeps_hidden = file.hidden == HiddenSurface::Keep;
    recipe.clear_m = file.clear.map(|length| length.metres);
    recipe.is_mirrored = matches!(file.mirror, Some(MirrorAxis::Y));
    if let Some(unit) = &file.unit {
        let metres = unit_metres(unit.get_ref()).map_err(|e| text.wrong(unit.span(), e.to_string()))?;
        recipe.unit = Some((unit.get_ref().clone(), metres));
    }
    let known: Vec<String> = file.regions.keys().map(|name| name.get_ref().clone()).collect();
    let check = |names: &[String], at: Range<usize>| {
        let Some(name) = names.iter().find(|name| !known.contains(name)) else { return Ok(()) };
        let hint = match known.is_empty() {
            true => "write a [regions] table for it".to_owned(),
            false => suggestion(name, known.iter().map(String::as_str)),
        };
        Err(text.wrong(at, format!("there is no region `{name}`; {hint}")))
    };
    for (name, keys) in file.regions {
        if let Some(except) = &keys.except {
            check(&except.get_ref().0, except.span())?;
        }
        let at = recipe_text.origin(keys.attribute.as_ref().map_or(name.span(), Spanned::span));
        recipe.regions.insert(name.get_ref().clone(), region(text, keys, at)?);
    }
    for name in &file.bare {
        check(std::slice::from_ref(name.get_ref()), name.span())?;
        recipe.bare.push((name.get_ref().clone(), recipe_text.origin(name.span())));
    }
    if let Some(place) = file.place.get(MAX_PLACES) {
        let what =
            format!("there are over {MAX_PLACES} places; place taxels by `points` or a `csv`, which may have many");
        return Err(text.wrong(place.span(), what));
    }
    let mut names = BTreeSet::new();
    for spanned in &file.place {
        let keys = spanned.get_ref();
        let place = place(recipe_text, spanned, folder)?;
        check(&place.regions, span(keys.region.as_ref()).unwrap_or(spanned.span()))?;
        if !names.insert(place.name.clone()) {
            let what = format!("two places are called `{}`; give one another `name`", place.name);
            return Err(text.wrong(span(keys.name.as_ref()).unwrap_or(spanned.span()), what));
        }
        recipe.places.push(place);
    }
    check_first_ids(text, &file.place, &recipe.places)?;
    recipe.fields = file
        .fields
        .into_iter()
        .map(|rule| {
            let at = recipe_text.origin(rule.span());
            (rule.into_inner(), at)
        })
        .collect();
    recipe.joins = file
        .join
        .into_iter()
        .map(|JoinKeys { links }| {
            let at = recipe_text.origin(links.span());
            (links.into_inner(), at)
        })
        .collect();
    Ok(recipe)
}

fn region(text: Text<'_>, keys: RegionKeys, at: Origin) -> Result<Region> {
    let bounds = keys.bounds.map(|bounds| {
        let [low, high] = bounds.get_ref().map(DVec3::from_array);
        let what =
            "the lower corner of `box` is over its upper one; write [[x, y, z], [x, y, z]], smaller numbers first";
        let fits = low.cmple(high).all() && low.is_finite() && high.is_finite();
        if fits { Ok([low, high]) } else { Err(text.wrong(bounds.span(), what)) }
    });
    Ok(Region {
        node: keys.node,
        material: keys.material,
        attribute: keys.attribute.map(Spanned::into_inner),
        bounds: bounds.transpose()?,
        except: keys.except.map_or_else(Vec::new, |names| names.into_inner().0),
        at,
    })
}

fn place(recipe_text: RecipeText<'_>, spanned: &Spanned<PlaceKeys>, folder: &Path) -> Result<PlaceSpec> {
    let (text, keys) = (recipe_text.text, spanned.get_ref());
    let (how, way_at) = how(recipe_text, spanned, folder)?;
    if let Some(id) = keys.first_id.as_ref().filter(|_| how.has_ids()) {
        return Err(text.wrong(id.span(), "`first_id` has no meaning where the table has ids; remove it"));
    }
    let modality = match &keys.modality {
        None => None,
        Some(name) => {
            let known = [Modality::Pressure, Modality::Temperature, Modality::Proximity, Modality::Force3];
            let names = known.map(Modality::name);
            let found = known.into_iter().find(|modality| modality.name() == *name.get_ref());
            Some(found.ok_or_else(|| text.unknown(name, "modality", names.iter().map(String::as_str)))?)
        }
    };
    let regions = keys.region.as_ref().map_or_else(Vec::new, |names| names.get_ref().0.clone());
    let default_name = || regions.first().cloned().unwrap_or_else(|| SKIN.to_owned());
    Ok(PlaceSpec {
        name: keys.name.as_ref().map_or_else(default_name, |name| name.get_ref().clone()),
        seed: keys.seed,
        first_id: text.int("first_id", keys.first_id.as_ref(), 0..i64::from(MAX_TAXEL_ID) + 1)?.unwrap_or(0),
        modality,
        how,
        regions,
        at: recipe_text.origin(way_at),
    })
}

/// How taxels are placed, and the place of that key.
fn how(recipe_text: RecipeText<'_>, spanned: &Spanned<PlaceKeys>, folder: &Path) -> Result<(Placement, Range<usize>)> {
    let (text, keys) = (recipe_text.text, spanned.get_ref());
    let ways = [
        ("taxels", span(keys.taxels.as_ref())),
        ("spacing", span(keys.spacing.as_ref())),
        ("grid", span(keys.grid.as_ref())),
        ("points", span(keys.points.as_ref())),
        ("csv", span(keys.csv.as_ref())),
        ("icub", span(keys.icub.as_ref())),
    ];
    let none =
        || text.wrong(spanned.span(), "add `taxels`, `spacing`, `grid`, `points`, `csv` or `icub` to this place");
    let mut given = ways.into_iter().filter_map(|(name, at)| Some((name, at?)));
    let (way, way_at) = given.next().ok_or_else(none)?;
    if let Some((other, other_at)) = given.next()
        && (way, other) != ("taxels", "spacing")
    {
        return Err(text.wrong(other_at, format!("a place is filled in one way: remove `{other}` or `{way}`")));
    }
    // Further keys, and the keys that they belong to.
    let extras = [
        ("density", span(keys.density.as_ref()), &["taxels"][..]),
        ("pitch", span(keys.pitch.as_ref()), &["grid"]),
        ("origin", span(keys.origin.as_ref()), &["grid"]),
        ("u", span(keys.u.as_ref()), &["grid"]),
        ("within", span(keys.within.as_ref()), &["points", "csv", "icub"]),
        ("link", span(keys.link.as_ref()), &["icub"]),
    ];
    for (name, at, of) in extras {
        if let Some(at) = at.filter(|_| !of.contains(&way)) {
            return Err(text.wrong(at, format!("`{name}` has no effect with `{way}`; remove it")));
        }
    }
    let spacing_m = keys.spacing.as_ref().map(|spacing| spacing.get_ref().metres);
    let within_m = keys.within.as_ref().map_or(DEFAULT_WITHIN_M, |within| within.get_ref().metres);
    let how = if let Some(count) = text.int("taxels", keys.taxels.as_ref(), 1..MAX_TAXELS as i64 + 1)? {
        let count = count as usize;
        match (&keys.density, spacing_m) {
            (Some(density), Some(_)) => {
                return Err(text.wrong(density.span(), "a place has `density` or `spacing`, not both; remove one"));
            }
            (Some(density), None) => Placement::Density { count, attribute: density.get_ref().clone() },
            (None, apart_m) => Placement::Evenly { count, apart_m },
        }
    } else if let Some(spacing_m) = spacing_m {
        Placement::Apart { spacing_m }
    } else if let Some(grid) = &keys.grid {
        let missing = || text.wrong(grid.span(), "a grid needs its `pitch`, as in `pitch = \"5 mm\"`");
        Placement::Grid {
            hexagonal: *grid.get_ref() == GridName::Hexagonal,
            pitch_m: keys.pitch.as_ref().ok_or_else(missing)?.get_ref().metres,
            origin: recipe_text.point("origin", keys.origin.as_ref())?,
            u: recipe_text.point("u", keys.u.as_ref())?,
        }
    } else if let Some(icub) = &keys.icub {
        let link = keys.link.as_ref().map(|link| link.get_ref().clone());
        Placement::Icub { path: folder.join(icub.get_ref()), link, within_m }
    } else if let Some(csv) = &keys.csv {
        Placement::Table { path: folder.join(csv.get_ref()), within_m }
    } else {
        let names = keys.points.as_ref().ok_or_else(none)?.get_ref().clone();
        Placement::Marks { names, within_m }
    };
    Ok((how, way_at))
}

/// Checks that each of several places that number their taxels has a `first_id`.
fn check_first_ids(text: Text<'_>, keys: &[Spanned<PlaceKeys>], places: &[PlaceSpec]) -> Result<()> {
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
    Err(text.wrong(
        keys[without].span(),
        format!(
            "place `{}` needs a `first_id`, so that its ids do not depend on other places; write `first_id = {}`",
            places[without].name,
            free.unwrap_or(0)
        ),
    ))
}
