//! Meshes of other formats as glTF: STL, OBJ, COLLADA, PLY, and robots in URDF.
//!
//! A mesh becomes one link, a URDF a link for each of its own. What comes out is a file to author on, in metres.

mod formats;
mod guarded;
mod mjcf;
mod options;
mod ply;
mod shapes;
mod triangles;
mod urdf;
mod urdf_file;
mod urdf_skin;
mod urdf_text;

pub use mjcf::author_mjcf_skin;
pub use options::{Geometry, MeshOptions, Up};
pub use urdf_skin::author_urdf_skin;
pub use urdf_text::urdf_of_skin;

pub(crate) use options::y_up_from;
pub(crate) use urdf::order;
pub(crate) use urdf_file::{JointMotion, Robot, RobotJoint};

use std::path::{Path, PathBuf};

use self::options::ending;

use crate::body::{Glb, Original};
use crate::error::{Error, Result};

/// A body of over this size was probably not meant in metres, m.
const MAX_LIKELY_SIZE_M: f64 = 20.0;

/// Whether `path` names a mesh or robot that this module reads, by its ending.
#[must_use]
pub fn is_mesh(path: &Path) -> bool {
    matches!(ending(path).as_str(), "stl" | "obj" | "dae" | "ply" | "urdf" | "xacro")
}

/// The files that [`open`] reads, as far as they can be found out.
#[must_use]
pub fn files(path: &Path, options: &MeshOptions) -> Vec<PathBuf> {
    let mut files = vec![path.to_owned()];
    if ending(path) == "urdf"
        && let Ok(robot) = Robot::load(path, options)
    {
        files.extend(robot.mesh_files());
    }
    files
}

/// Opens the mesh or robot at `path` as a glTF to author on.
///
/// # Errors
/// The file cannot be read, is damaged, or is a xacro; a mesh that it names is missing. One line says where.
pub fn open(path: &Path, options: &MeshOptions) -> Result<Original> {
    let (glb, size_m) = match ending(path).as_str() {
        "urdf" | "xacro" => urdf::robot(path, options)?,
        _ => one_link(path, options)?,
    };
    let mut file = Original::from_bytes(&path.display().to_string(), &glb.to_bytes()?, None)?;
    if size_m > MAX_LIKELY_SIZE_M {
        let what_to_do = match ending(path).as_str() {
            "urdf" | "xacro" => "write metres into the URDF, or a `scale` of its meshes",
            _ => "give --unit mm",
        };
        file.notes.push(format!("it is {size_m:.0} m across: if its numbers are millimetres, {what_to_do}"));
    }
    Ok(file)
}

/// A mesh as one link called as the file, and its size, m.
fn one_link(path: &Path, options: &MeshOptions) -> Result<(Glb, f64)> {
    let (mut mesh, own_up) = formats::load(path, options.unit_m).map_err(|e| e.at(path.display()))?;
    if mesh.triangles.is_empty() {
        return Err(Error::failed("it has no triangles; export a mesh with faces").at(path.display()));
    }
    let up = options.up.or(own_up).unwrap_or(Up::Y);
    mesh.transform(&y_up_from(up));
    let size_m = mesh.size_m();
    let name = path.file_stem().map_or_else(|| "mesh".to_owned(), |stem| stem.to_string_lossy().into_owned());
    let mut glb = Glb::new();
    let material = glb.material("mesh", [0.6, 0.62, 0.66], 0.8);
    let link = glb.node(&name, None, glam::DVec3::ZERO);
    glb.mesh(link, &name, &mesh.into_mesh_data(), Some(material), None);
    Ok((glb, size_m))
}
