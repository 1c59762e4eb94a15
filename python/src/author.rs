//! `author`: a skin on a mesh or a robot, or one that comes with its places.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use somatic::author::mesh::{Geometry, MeshOptions, author_mjcf_skin, author_urdf_skin};
use somatic::author::{Authored, Recipe, author_csv_skin, author_icub};
use somatic::body::{Original, Up};
use somatic::internal::author::{Zones, author_zones, mesh};
use somatic::internal::limits::{self, MAX_TABLE_BYTES};
use somatic::{Body, Error, Result, bundled};

use crate::body::PyBody;
use crate::error::{OrRaise, interrupted, usage};
use crate::opening::text_of;
use crate::progress::Progress;
use crate::threads::free;

/// How a mesh of another format than glTF is read.
#[derive(Default)]
struct Reading {
    up: Option<Up>,
    packages: BTreeMap<String, PathBuf>,
    geometry: Option<Geometry>,
}

/// The axis that is called so.
pub(crate) fn up_of(up: Option<&str>) -> Result<Option<Up>> {
    match up {
        None => Ok(None),
        Some("y") => Ok(Some(Up::Y)),
        Some("z") => Ok(Some(Up::Z)),
        Some(other) => Err(Error::usage(format!("up: there is no '{other}'; it is 'y' or 'z'"))),
    }
}

impl Reading {
    fn new(up: Option<&str>, package: Option<BTreeMap<String, PathBuf>>, geometry: Option<&str>) -> Result<Self> {
        let up = up_of(up)?;
        let geometry = match geometry {
            None => None,
            Some("visual") => Some(Geometry::Visual),
            Some("collision") => Some(Geometry::Collision),
            Some("none") => Some(Geometry::None),
            Some(other) => {
                let what = format!("geometry: there is no '{other}'; it is 'visual', 'collision' or 'none'");
                return Err(Error::usage(what));
            }
        };
        Ok(Self { up, packages: package.unwrap_or_default(), geometry })
    }

    /// The keyword that is of no use where a glTF file is read.
    fn given(&self) -> Option<&'static str> {
        let given =
            [("up", self.up.is_some()), ("package", !self.packages.is_empty()), ("geometry", self.geometry.is_some())];
        given.into_iter().find_map(|(name, is_given)| is_given.then_some(name))
    }

    fn options(&self, unit_m: Option<f64>) -> MeshOptions {
        let mut options = MeshOptions::default().with_ros_packages();
        (options.unit_m, options.up, options.packages) = (unit_m, self.up, self.packages.clone());
        options.geometry = self.geometry.unwrap_or(Geometry::Visual);
        options
    }
}

/// A skin that comes with its places.
enum Placed {
    Urdf(PathBuf),
    Mjcf(PathBuf),
    Csv(PathBuf),
    Icub(Vec<PathBuf>),
}

impl Placed {
    fn file(&self) -> &Path {
        match self {
            Self::Urdf(path) | Self::Mjcf(path) | Self::Csv(path) => path,
            Self::Icub(paths) => paths.first().map_or(Path::new("icub"), |path| path),
        }
    }

    fn author(&self, reading: &Reading) -> Result<Authored> {
        match self {
            Self::Urdf(path) => author_urdf_skin(path, &reading.options(None)),
            Self::Mjcf(path) => author_mjcf_skin(path, &reading.options(None)),
            Self::Csv(path) => author_csv_skin(path),
            Self::Icub(paths) => author_icub(paths),
        }
    }
}

/// The name of the file at `path`, with the ending of bodies.
fn with_ending(path: &Path) -> String {
    path.with_extension("glb").file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// The body that was authored, called `name`.
fn named(name: String, authored: Authored) -> Result<PyBody> {
    let bytes = Arc::new(authored.file.to_glb()?);
    Ok(PyBody { inner: Arc::new(Body { name, ..authored.body }), bytes })
}

/// Puts a skin on a mesh or a robot, as `somatic author` does, and gives the body.
///
/// Parameters
/// ----------
/// shape : Body, str or path, optional
///     A body, a file (.glb, .gltf, .stl, .obj, .dae, .ply, or a robot as .urdf) or a bundled body.
/// recipe : str or path, optional
///     A file that docs/reference/recipe.md describes. Without it, `taxels` says how many and `spacing`, such as '8 mm', how far apart, on the
///     nodes, meshes or links whose names match one of the globs `regions`.
/// seed, unit, even, hidden, clear, mirror
///     `unit` says what the file's numbers are: 'um', 'mm', 'cm' or 'm'. `even=False` leaves taxels where they were scattered, `hidden='keep'` places
///     some where nothing can touch them, `clear`, such as '5 mm', is their least distance from where a link, a mesh or the surface
///     ends, and `mirror='y'` makes the right side like the left. Without them the recipe's hold.
/// up, package, geometry
///     Of meshes and robots of other formats: the axis that points up, 'y' or 'z'; a dict of a package's name to its folder; and 'visual', 'collision' or
///     'none', the geometry of a .urdf.
/// zones : str, path, or dict of int to str, optional
///     Named zones of each topmost field of a body that has a skin, which stays as it is: names from the bottom of the page up, or from the
///     left to the right, with shares of the length, such as 'heel=30%,midfoot,toes', where those without one share the rest equally; or
///     by taxel its zone, a dict or a .csv with the columns taxel and zone.
/// urdf_skin, mjcf_skin, csv_skin, icub
///     In the place of `shape`, a skin that has its places: a .urdf with tactile sensors, an .xml of MuJoCo with such, a table of taxels,
///     or a list of the iCub's position files.
/// progress : bool or callable, optional
///     True shows a bar of tqdm, a function is called with the share that is done, 0 to 1.
///
/// Returns
/// -------
/// Body
///     Without `recipe`, `taxels` and `spacing` the layout that a .glb has is brought up to date.
///
/// Examples
/// --------
/// >>> import somatic_touch as st
/// >>> body = st.author("hand", taxels=60, seed=1)
/// >>> len(body.taxels)
/// 60
/// >>> list(st.author(st.Body.grid(20, 8, 0.01, name="insole"), zones="heel=30%,midfoot,toes").fields)
/// ['insole', 'insole/heel', 'insole/midfoot', 'insole/toes']
#[pyfunction]
#[pyo3(signature = (shape = None, recipe = None, *, taxels = None, spacing = None, regions = Vec::new(), seed = None, unit = None, even = None, hidden = None, clear = None, mirror = None, zones = None, up = None, package = None, geometry = None, urdf_skin = None, mjcf_skin = None, csv_skin = None, icub = None, progress = None))]
#[expect(clippy::too_many_arguments, reason = "they are keywords")]
pub(crate) fn author(
    py: Python<'_>,
    shape: Option<&Bound<'_, PyAny>>,
    recipe: Option<PathBuf>,
    taxels: Option<u64>,
    spacing: Option<&str>,
    regions: Vec<String>,
    seed: Option<u64>,
    unit: Option<&str>,
    even: Option<bool>,
    hidden: Option<&str>,
    clear: Option<&str>,
    mirror: Option<&str>,
    zones: Option<&Bound<'_, PyAny>>,
    up: Option<&str>,
    package: Option<BTreeMap<String, PathBuf>>,
    geometry: Option<&str>,
    urdf_skin: Option<PathBuf>,
    mjcf_skin: Option<PathBuf>,
    csv_skin: Option<PathBuf>,
    icub: Option<Vec<PathBuf>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<PyBody> {
    let reading = Reading::new(up, package, geometry).or_raise(py)?;
    let wish = Wish { recipe, taxels, spacing, regions: &regions, seed, unit, even, hidden, clear, mirror };
    let skins =
        [urdf_skin.map(Placed::Urdf), mjcf_skin.map(Placed::Mjcf), csv_skin.map(Placed::Csv), icub.map(Placed::Icub)];
    let mut skins: Vec<Placed> = skins.into_iter().flatten().collect();
    match (shape.map(Shape::new).transpose()?, zones, skins.pop()) {
        (None, _, Some(skin)) if skins.is_empty() => {
            if let Some(name) = wish.given().or(zones.is_some().then_some("zones")) {
                let what = format!("{name}: this skin has its places; leave it out");
                return Err(Error::usage(what)).or_raise(py);
            }
            free(py, || named(with_ending(skin.file()), skin.author(&reading)?)).or_raise_of(py, skin.file())
        }
        (Some(shape), Some(zones), None) => {
            if let Some(name) = wish.given() {
                let what = format!("{name}: zones are parts of a skin that is there; leave it out");
                return Err(Error::usage(what)).or_raise(py);
            }
            let zones = zones_of(zones)?;
            let zoned = || named(shape.name(), author_zones(open(&shape, &mut Recipe::none(), &reading)?, &zones)?);
            free(py, zoned).or_raise_of(py, shape.place())
        }
        (Some(shape), None, None) => on_shape(py, &shape, wish.recipe().or_raise(py)?, &reading, progress),
        _ => Err(Error::usage("give one shape, or one of urdf_skin=, mjcf_skin=, csv_skin= and icub=")).or_raise(py),
    }
}

/// What a skin is put on.
enum Shape {
    Body(PyBody),
    File(PathBuf),
}

impl Shape {
    fn new(any: &Bound<'_, PyAny>) -> PyResult<Self> {
        match any.cast::<PyBody>() {
            Ok(body) => Ok(Self::Body(body.get().clone())),
            Err(_) => any.extract().map(Self::File),
        }
    }

    /// What messages are about.
    fn place(&self) -> &Path {
        match self {
            Self::Body(body) => Path::new(&body.inner.name),
            Self::File(path) => path,
        }
    }

    /// What the body with a skin is called.
    fn name(&self) -> String {
        match self {
            Self::Body(body) => body.inner.name.clone(),
            Self::File(path) => with_ending(path),
        }
    }

    /// Whether it is in another format than glTF.
    fn is_mesh(&self) -> bool {
        matches!(self, Self::File(path) if mesh::is_mesh(path))
    }
}

/// Zones of `given`: shares of the length, a table, or by taxel.
fn zones_of(given: &Bound<'_, PyAny>) -> PyResult<Zones> {
    let py = given.py();
    if given.is_instance_of::<PyDict>() {
        let wrong = || usage(py, "zones should have by taxel its zone, such as {17: 'heel'}");
        let table: BTreeMap<u32, String> = given.extract().map_err(|_| wrong())?;
        let is_whole = !table.is_empty() && table.values().all(|zone| !zone.trim().is_empty());
        return if is_whole { Ok(Zones::Table(table)) } else { Err(wrong()) };
    }
    let text = text_of(given)?;
    let path = Path::new(&text);
    if !path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv")) {
        return Zones::of_shares(&text).map_err(|e| e.at("zones")).or_raise(py);
    }
    let table = limits::read_to_string(path, MAX_TABLE_BYTES).map_err(|e| Error::io(path, &e));
    table.and_then(|table| Zones::of_table(&text, &table)).or_raise_of(py, path)
}

/// What is to be placed.
struct Wish<'a> {
    recipe: Option<PathBuf>,
    taxels: Option<u64>,
    spacing: Option<&'a str>,
    regions: &'a [String],
    seed: Option<u64>,
    unit: Option<&'a str>,
    even: Option<bool>,
    hidden: Option<&'a str>,
    clear: Option<&'a str>,
    mirror: Option<&'a str>,
}

impl Wish<'_> {
    /// A keyword that was given.
    fn given(&self) -> Option<&'static str> {
        let given = [
            ("recipe", self.recipe.is_some()),
            ("taxels", self.taxels.is_some()),
            ("spacing", self.spacing.is_some()),
            ("regions", !self.regions.is_empty()),
            ("seed", self.seed.is_some()),
            ("unit", self.unit.is_some()),
            ("even", self.even.is_some()),
            ("hidden", self.hidden.is_some()),
            ("clear", self.clear.is_some()),
            ("mirror", self.mirror.is_some()),
        ];
        given.into_iter().find_map(|(name, is_given)| is_given.then_some(name))
    }

    fn recipe(&self) -> Result<Recipe> {
        let is_counted = self.taxels.is_some() || self.spacing.is_some() || !self.regions.is_empty();
        let mut made = match &self.recipe {
            Some(_) if is_counted => {
                let what = "a recipe says what is placed where; leave taxels, spacing and regions out";
                return Err(Error::usage(what));
            }
            Some(path) => Recipe::load(path)?,
            None if is_counted => Recipe::simple(self.taxels, self.spacing, self.regions)?,
            None => Recipe::none(),
        };
        if let Some(seed) = self.seed {
            made = made.with_seed(seed);
        }
        if let Some(unit) = self.unit {
            made = made.with_unit(unit).map_err(|e| e.at("unit"))?;
        }
        if let Some(even) = self.even {
            made = made.with_even(even);
        }
        if let Some(hidden) = self.hidden {
            made = made.with_hidden(match hidden {
                "keep" => true,
                "drop" => false,
                _ => return Err(Error::usage(format!("hidden: there is no '{hidden}'; it is 'drop' or 'keep'"))),
            });
        }
        if let Some(clear) = self.clear {
            made = made.with_clear(clear).map_err(|e| e.at("clear"))?;
        }
        match self.mirror {
            None => {}
            Some("y") if made.is_empty() => {
                let what = "mirror: it is for taxels to be placed; give taxels= or recipe=";
                return Err(Error::usage(what));
            }
            Some("y") => made = made.with_mirror(true),
            Some(other) => return Err(Error::usage(format!("mirror: there is no '{other}'; it is 'y'"))),
        }
        Ok(made)
    }
}

/// Puts the skin of `recipe` on `shape`.
fn on_shape(
    py: Python<'_>,
    shape: &Shape,
    mut recipe: Recipe,
    reading: &Reading,
    progress: Option<Py<PyAny>>,
) -> PyResult<PyBody> {
    let progress = Progress::new(py, progress, Some(1.0), "")?;
    let mut raised = None;
    let done = free(py, || {
        let file = open(shape, &mut recipe, reading)?;
        if recipe.is_empty() && shape.is_mesh() {
            let (body, _) = file.read()?;
            let inner = Arc::new(Body { name: shape.name(), ..body });
            return Ok(PyBody { inner, bytes: Arc::new(file.to_glb()?) });
        }
        let shown = |share: f64| {
            let heard = Python::attach(|py| {
                py.check_signals()?;
                progress.as_ref().map_or(Ok(()), |progress| progress.tell(py, (share,)))
            });
            raised = heard.err();
            raised.is_none()
        };
        named(shape.name(), somatic::internal::author::author_while(file, &recipe, shown)?)
    });
    match raised {
        Some(error) => Err(interrupted(Some(error))),
        None => {
            let made = done.or_raise_of(py, shape.place())?;
            progress.as_ref().map_or(Ok(()), |progress| progress.fill(py, (1.0,)))?;
            Ok(made)
        }
    }
}

fn open(shape: &Shape, recipe: &mut Recipe, reading: &Reading) -> Result<Original> {
    let shape = match shape {
        Shape::File(path) => path,
        Shape::Body(body) => {
            if let Some(name) = reading.given() {
                return Err(Error::usage(format!("{name}: a body has been read; leave it out")));
            }
            return Original::from_bytes(&body.inner.name, &body.bytes, None);
        }
    };
    let is_bundled = !shape.exists() && shape.to_str().is_some_and(|name| bundled::body(name).is_some());
    if let Some(name) = reading.given().filter(|_| is_bundled || !mesh::is_mesh(shape)) {
        return Err(Error::usage(format!("{name}: it is for .stl, .obj, .dae, .ply and .urdf; leave it out here")));
    }
    if let Some((name, bytes)) =
        shape.to_str().and_then(|name| Some((name, bundled::body(name)?))).filter(|_| is_bundled)
    {
        return Original::from_bytes(name, bytes, None);
    }
    if mesh::is_mesh(shape) {
        return mesh::open(shape, &reading.options(recipe.take_unit()));
    }
    Original::open(shape)
}
