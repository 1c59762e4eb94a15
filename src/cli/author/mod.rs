//! `somatic author`: a mesh in, a body with a skin out.

mod compare;
mod compare_figure;
mod convert;
mod grid;
mod report;
mod skin;

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use somatic::author::{Recipe, author};
use somatic::internal::author::{Zones, author_zones};
use somatic::internal::body::Original;
use somatic::internal::error::nearest;
use somatic::internal::limits::{self, MAX_TABLE_BYTES};
use somatic::internal::setup::FilesRead;
use somatic::{Error, Result, bundled};

use self::compare::{CompareArguments, body_output};
use self::convert::{MeshArguments, MeshFile};
use self::grid::GridArguments;
use self::report::{summary, text};
use self::skin::SkinArguments;
use super::bar::Bar;
use super::expected;
use super::stdio::{DONE, print};

const EXAMPLES: &str = "\
Examples:
  somatic author hand.glb --taxels 500 --seed 1 -o skin.glb     500 taxels, evenly spread
  somatic author arm.glb --spacing 8mm --region 'forearm*' -o skin.glb
  somatic author arm.gltf --unit mm --recipe arm.toml -o skin.glb
  somatic author --grid 31x11 --pitch 8.6mm -o insole.glb       a flat sheet; it needs no mesh
  somatic author insole.glb --zones heel=30%,midfoot,toes=15% -o zones.glb
  somatic author finger.stl --unit mm --spacing 3mm -o finger.glb
  somatic author --icub left_hand.txt left_forearm.txt -o icub.glb
  somatic author --urdf-skin robot.urdf --geometry none -o robot.glb
  somatic author --mjcf-skin hand.xml -o hand.glb
  somatic author robot.urdf --package my_robot=. --taxels 800 -o robot.glb   its links become links
  somatic inspect skin.glb
  somatic author --compare a.glb b.glb -o errors.svg            two layouts, side by side
  somatic run --body skin.glb --source touch.csv

A recipe places taxels region by region:
  seed = 1
  bare = [\"nails\"]
  [regions.palm]
  node = \"palm*\"               # or material, attribute, box, except
  [regions.nails]
  material = \"nail\"
  [[place]]
  region = \"palm\"
  first_id = 0
  spacing = \"4 mm\"             # or taxels, with density; grid; points; csv; icub

Whatever else the file holds stays as it is. A layout that it has is replaced; a recipe without
[[place]] keeps its taxels and groups them anew. Without recipe, --taxels and --spacing the layout
is brought up to date, as after editing it in Blender:
  somatic author edited.glb -o skin.glb";

/// Put a skin on a mesh or a robot.
///
/// Taxels are placed as asked, in fields, in a file that Blender and every glTF viewer open.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The mesh: a .glb, .gltf, .stl, .obj, .dae or .ply file, a robot as .urdf, or the bundled hand, mat or
    /// humanoid.
    #[arg(value_name = "MESH", required_unless_present_any = ["grid", "icub", "urdf_skin", "mjcf_skin", "csv_skin", "compare"],
        conflicts_with_all = ["grid", "icub", "urdf_skin", "mjcf_skin", "csv_skin"])]
    mesh: Option<String>,

    /// What to place where, a TOML file.
    #[arg(long, value_name = "RECIPE.toml", conflicts_with_all = ["taxels", "spacing", "region"])]
    recipe: Option<PathBuf>,

    /// Number of taxels, spread evenly over the surface that something can touch.
    #[arg(long, value_name = "N")]
    taxels: Option<u64>,

    /// The least distance between taxels, such as 8mm.
    ///
    /// With --taxels there are exactly that many, else as many as fit.
    #[arg(long, value_name = "LENGTH")]
    spacing: Option<String>,

    /// Nodes, meshes or links that get taxels, as a glob; may be repeated [default: all].
    #[arg(long, value_name = "GLOB")]
    region: Vec<String>,

    /// Seed of the placement, which selects one of many equally good ones [default: the recipe's, or 0].
    #[arg(long, value_name = "N")]
    seed: Option<u64>,

    /// Whether taxels given by number are evened out, on or off [default: the recipe's, or on].
    ///
    /// With on, they move until the surface around each is alike. With off, they stay where they were scattered.
    #[arg(long, value_name = "WORD")]
    even: Option<EvenWord>,

    /// What to do with surface that nothing can touch: drop or keep [default: the recipe's, or drop].
    ///
    /// It is inside the body, or under another link in all poses. With drop it gets no taxels, with keep as many as
    /// elsewhere.
    #[arg(long, value_name = "WORD")]
    hidden: Option<HiddenWord>,

    /// The least distance of taxels from where a link, a mesh or the surface ends, such as 5mm [default: the recipe's, or none].
    #[arg(long, value_name = "LENGTH")]
    clear: Option<String>,

    /// The same layout on both sides of the plane that is perpendicular to this axis of the world.
    ///
    /// Taxels are placed to the left of the plane, and mirrored in it. The axis from right to left is y.
    #[arg(long, value_name = "AXIS")]
    mirror: Option<MirrorWord>,

    /// The unit of the mesh file's numbers: um, mm, cm or m [default: the recipe's, or m].
    #[arg(long, value_name = "UNIT")]
    unit: Option<String>,

    /// Named zones of each topmost field, from the bottom of the page up or from the left to the right, such as heel=30%,midfoot,toes.
    ///
    /// A share is of the length; zones without one share the rest equally. Or a table: a CSV with the columns taxel and
    /// zone. Taxels and other fields stay.
    #[arg(long, value_name = "NAME,...|FILE.csv", requires = "mesh",
        conflicts_with_all = ["recipe", "taxels", "spacing", "region", "seed", "unit", "even", "hidden", "clear", "mirror"])]
    zones: Option<String>,

    #[command(flatten)]
    mesh_file: MeshArguments,

    #[command(flatten)]
    sheet: GridArguments,

    #[command(flatten)]
    skin: SkinArguments,

    #[command(flatten)]
    compared: CompareArguments,

    /// Simulate touches on the result: how far off place, axis and force will be, with the same on an ideal skin.
    #[arg(long, conflicts_with = "compare")]
    errors: bool,

    /// The body to write, .glb or .gltf; with --compare the picture, .svg or .png.
    #[arg(short, long, value_name = "BODY.glb")]
    output: Option<PathBuf>,

    /// Replace the output if it is there; the mesh itself is never replaced.
    #[arg(long)]
    force: bool,

    /// Print what was placed as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum EvenWord {
    On,
    Off,
}

#[derive(Clone, Copy, ValueEnum)]
enum HiddenWord {
    Drop,
    Keep,
}

#[derive(Clone, Copy, ValueEnum)]
enum MirrorWord {
    Y,
}

pub(super) fn run(arguments: &Arguments) -> Result<u8> {
    if let Some(bodies) = arguments.compared.bodies()? {
        return compare::run(bodies, arguments.output.as_deref(), arguments.force, arguments.json);
    }
    let path = body_output(arguments.output.as_ref())?;
    check_ending(path)?;
    let has_places = arguments.sheet.is_asked() || arguments.skin.is_asked();
    let mut recipe = if has_places { None } else { Some(recipe(arguments)?) };
    let foreign = match arguments.skin.is_asked() {
        true => None,
        false => arguments.mesh_file.opener(arguments.mesh.as_deref(), recipe.as_mut())?,
    };
    let read = FilesRead::default().bodies(&arguments.mesh).files(&arguments.recipe).files(arguments.sheet.files());
    let read = read.files(recipe.iter().flat_map(Recipe::files)).files(foreign.iter().flat_map(MeshFile::files));
    let read = read.files(arguments.skin.files(&arguments.mesh_file)?).files(arguments.zone_table());
    let output = read.outputs(arguments.force).add(path)?;
    let authored = match (&recipe, &arguments.mesh) {
        (_, Some(mesh)) if arguments.zones.is_some() => {
            let file = foreign.as_ref().map_or_else(|| open(mesh), MeshFile::open)?;
            author_zones(file, &arguments.read_zones()?)?
        }
        (Some(recipe), Some(mesh)) => {
            let file = foreign.as_ref().map_or_else(|| open(mesh), MeshFile::open)?;
            if foreign.is_some() && recipe.is_empty() {
                return convert::save(&file, output, arguments.json);
            }
            let mut bar = Bar::new("placing taxels");
            author(file, recipe, |share| bar.show(share))?
        }
        _ if arguments.skin.is_asked() => arguments.skin.author(&arguments.mesh_file)?,
        _ => arguments.sheet.author(&name_of(path))?,
    };
    authored.file.save(output)?;
    let errors = if arguments.errors { Some(expected::of_body(&authored.body)?) } else { None };
    print(&match arguments.json {
        true => format!("{}\n", summary(path, &authored, errors.as_ref())),
        false => text(path, &authored, errors.as_ref(), foreign.as_ref().is_some_and(MeshFile::is_visual_robot)),
    })?;
    Ok(DONE)
}

impl Arguments {
    /// The table of zones, if one is named.
    fn zone_table(&self) -> Option<&Path> {
        let path = Path::new(self.zones.as_deref()?);
        path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("csv")).then_some(path)
    }

    fn read_zones(&self) -> Result<Zones> {
        match (self.zone_table(), &self.zones) {
            (Some(path), _) => {
                let text = limits::read_to_string(path, MAX_TABLE_BYTES).map_err(|e| Error::io(path, &e))?;
                Zones::of_table(&path.display().to_string(), &text)
            }
            (None, zones) => Zones::of_shares(zones.as_deref().unwrap_or_default()).map_err(|e| e.at("--zones")),
        }
    }
}

fn recipe(arguments: &Arguments) -> Result<Recipe> {
    let mut recipe = match &arguments.recipe {
        Some(path) => Recipe::load(path)?,
        None if arguments.taxels.is_none() && arguments.spacing.is_none() && arguments.region.is_empty() => {
            Recipe::none()
        }
        None => Recipe::simple(arguments.taxels, arguments.spacing.as_deref(), &arguments.region)?,
    };
    if let Some(seed) = arguments.seed {
        recipe = recipe.with_seed(seed);
    }
    if let Some(even) = arguments.even {
        recipe = recipe.with_even(matches!(even, EvenWord::On));
    }
    if let Some(hidden) = arguments.hidden {
        recipe = recipe.with_hidden(matches!(hidden, HiddenWord::Keep));
    }
    if let Some(clear) = &arguments.clear {
        recipe = recipe.with_clear(clear).map_err(|e| e.at("--clear"))?;
    }
    if let Some(MirrorWord::Y) = arguments.mirror {
        if recipe.is_empty() {
            return Err(Error::usage("it is for taxels to be placed; give --taxels or --recipe").at("--mirror"));
        }
        recipe = recipe.with_mirror(true);
    }
    if let Some(unit) = &arguments.unit {
        recipe = recipe.with_unit(unit).map_err(|e| e.at("--unit"))?;
    }
    Ok(recipe)
}

/// What the output `path` is called without folder and ending.
fn name_of(path: &Path) -> String {
    path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

/// Refuses an output that would be no body, before any work is done.
fn check_ending(path: &Path) -> Result<()> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    if !matches!(ending.as_deref(), Some("glb" | "gltf")) {
        return Err(Error::usage("a body is a .glb or a .gltf; name the output so").at(path.display()));
    }
    Ok(())
}

/// The file `name`, or the bundled body of that name where there is no such file.
fn open(name: &str) -> Result<Original> {
    if !Path::new(name).exists() {
        if let Some(bytes) = bundled::body(name) {
            return Original::from_bytes(name, bytes, None);
        }
        if let Some(near) = nearest(name, bundled::BODIES) {
            return Err(Error::failed(format!("no such file; did you mean the bundled body `{near}`?")).at(name));
        }
    }
    Original::open(name)
}
