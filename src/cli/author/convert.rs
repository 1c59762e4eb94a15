//! Meshes of other formats: the flags that say how they are read.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use serde_json::json;
use somatic::author::Recipe;
use somatic::author::mesh::{Geometry, MeshOptions};
use somatic::internal::author::mesh::{self, Up};
use somatic::internal::body::Original;
use somatic::{Error, OutputPath, Result};

use crate::cli::stdio::{DONE, print};
use crate::cli::words::{bullet, count};

const HEADING: &str = "Meshes and robots of other formats";

#[derive(Args)]
pub(super) struct MeshArguments {
    /// The file's axis that points up: y, or z as in most CAD programs [default: z in .urdf and MJCF, the .dae's own,
    /// else y].
    ///
    /// A robot whose z is up faces along its x.
    #[arg(long, value_name = "AXIS", help_heading = HEADING)]
    up: Option<UpWord>,

    /// The folder of a package of a .urdf, for its package://NAME/…; may be repeated.
    ///
    /// Others are searched in the folders of ROS_PACKAGE_PATH and AMENT_PREFIX_PATH.
    #[arg(long = "package", value_name = "NAME=FOLDER", help_heading = HEADING)]
    packages: Vec<String>,

    /// The geometry of a .urdf: visual, collision or none [default: visual].
    ///
    /// People see the visual one. The one for collision is coarser. With none there are links alone.
    #[arg(long, value_name = "KIND", help_heading = HEADING)]
    geometry: Option<GeometryWord>,
}

#[derive(Clone, Copy, ValueEnum)]
enum UpWord {
    Y,
    Z,
}

#[derive(Clone, Copy, ValueEnum)]
enum GeometryWord {
    Visual,
    Collision,
    None,
}

/// A mesh of another format than glTF, and how it is read.
pub(super) struct MeshFile {
    path: PathBuf,
    options: MeshOptions,
}

impl MeshArguments {
    /// How `mesh` is opened if it is of another format; takes the unit out of `recipe` then.
    pub(super) fn opener(&self, mesh: Option<&str>, recipe: Option<&mut Recipe>) -> Result<Option<MeshFile>> {
        let Some(path) = mesh.map(Path::new).filter(|path| mesh::is_mesh(path)) else {
            let given = [
                ("--up", self.up.is_some()),
                ("--package", !self.packages.is_empty()),
                ("--geometry", self.geometry.is_some()),
            ];
            return match given.into_iter().find(|(_, given)| *given) {
                Some((flag, _)) => {
                    Err(Error::usage("it is for .stl, .obj, .dae, .ply and .urdf; leave it out here").at(flag))
                }
                None => Ok(None),
            };
        };
        let options = self.options(recipe.and_then(Recipe::take_unit))?;
        Ok(Some(MeshFile { path: path.to_owned(), options }))
    }
}

impl MeshArguments {
    /// How a mesh is read whose unit is `unit_m`.
    pub(super) fn options(&self, unit_m: Option<f64>) -> Result<MeshOptions> {
        let mut packages = BTreeMap::new();
        for text in &self.packages {
            let wrong = || {
                Error::usage("write the package's name and its folder, as NAME=FOLDER").at(format!("--package {text}"))
            };
            let (name, folder) = text.split_once('=').ok_or_else(wrong)?;
            packages.insert(name.to_owned(), PathBuf::from(folder));
        }
        let up = self.up.map(|up| match up {
            UpWord::Y => Up::Y,
            UpWord::Z => Up::Z,
        });
        let geometry = match self.geometry {
            Some(GeometryWord::Collision) => Geometry::Collision,
            Some(GeometryWord::None) => Geometry::None,
            _ => Geometry::Visual,
        };
        let mut options = MeshOptions::default().with_ros_packages();
        (options.unit_m, options.up, options.packages, options.geometry) = (unit_m, up, packages, geometry);
        Ok(options)
    }
}

impl MeshFile {
    /// The files that are read.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        mesh::files(&self.path, &self.options)
    }

    /// Whether it is a URDF with its visual geometry.
    pub(super) fn is_visual_robot(&self) -> bool {
        let is_urdf = self.path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("urdf"));
        is_urdf && self.options.geometry == Geometry::Visual
    }

    pub(super) fn open(&self) -> Result<Original> {
        mesh::open(&self.path, &self.options)
    }
}

/// Writes a mesh as a body without taxels, and says what to do next.
pub(super) fn save(file: &Original, output: OutputPath, as_json: bool) -> Result<u8> {
    let (body, _) = file.read()?;
    let name = output.name().display().to_string();
    file.save(output)?;
    let links: Vec<&str> = body.links.iter().map(|link| link.name.as_str()).collect();
    if as_json {
        print(&format!("{}\n", json!({"output": name, "taxels": 0, "links": links, "notes": file.notes})))?;
        return Ok(DONE);
    }
    let triangles: usize = body.surfaces.iter().map(|surface| surface.triangles.len()).sum();
    let mut text = format!(
        "{name}: {} with {}, without taxels: give --taxels, --spacing or --recipe\n",
        count(links.len() as u64, "link"),
        count(triangles as u64, "triangle"),
    );
    text.extend(file.notes.iter().map(|note| bullet(note)));
    print(&text)?;
    Ok(DONE)
}
