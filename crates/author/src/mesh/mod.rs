//! Meshes of other formats as glTF: STL, OBJ, COLLADA, PLY, and robots in URDF, whose meshes may be glTF, too.
//!
//! A mesh becomes one link, a URDF a link for each of its own. What comes out is a file to author on, in metres.

mod collada;
mod formats;
mod mjcf;
mod obj;
mod options;
mod ply;
mod ros_packages;
mod shapes;
mod stl;
mod triangles;
mod urdf;
mod urdf_file;
mod urdf_skin;
mod urdf_text;
mod urdf_tree;
mod xml;

pub use mjcf::author_mjcf_skin;
pub use options::{Geometry, MeshOptions};
pub use urdf_skin::author_urdf_skin;
pub use urdf_text::urdf_of_skin;

pub use urdf_file::{JointMotion, Robot, RobotJoint};
pub use urdf_tree::{Driver, followed, order};

use std::path::{Path, PathBuf};

use self::formats::is_gltf;
use self::options::{doubt, ending, y_up_from};

use super::lint::MAX_LIKELY_LINK_M;
pub use crate::body::Up;
use crate::body::{Body, Glb, Original};
use crate::error::{Error, Result};

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
        let meshes = robot.mesh_files();
        files.extend(meshes.into_iter().flat_map(|mesh| if is_gltf(&mesh) { Body::files(mesh) } else { vec![mesh] }));
    }
    files
}

/// Opens the mesh or robot at `path` as a glTF to author on.
///
/// # Errors
/// The file cannot be read, is damaged, or is a xacro; a mesh that it names is missing. One line says where.
pub fn open(path: &Path, options: &MeshOptions) -> Result<Original> {
    let (glb, notes) = match ending(path).as_str() {
        "urdf" | "xacro" => urdf::robot(path, options)?,
        _ => one_link(path, options)?,
    };
    let mut file = Original::from_bytes(&path.display().to_string(), &glb.to_bytes()?, None)?;
    file.notes.extend(notes);
    Ok(file)
}

/// A mesh as one link called as the file, and what is doubtful.
fn one_link(path: &Path, options: &MeshOptions) -> Result<(Glb, Vec<String>)> {
    let (mut mesh, own_up) = formats::load(path, options.unit_m).map_err(|e| e.at(path.display()))?;
    if mesh.triangles.is_empty() {
        return Err(Error::failed("it has no triangles; export a mesh with faces").at(path.display()));
    }
    let up = options.up.or(own_up).unwrap_or(Up::Y);
    mesh.transform(&y_up_from(up));
    let what_to_do = if ending(path) == "dae" { "set its <unit meter=\"0.001\">" } else { "give --unit mm" };
    let doubt = doubt("it", mesh.size_m(), MAX_LIKELY_LINK_M);
    let name = path.file_stem().map_or_else(|| "mesh".to_owned(), |stem| stem.to_string_lossy().into_owned());
    let mut glb = Glb::new();
    let material = glb.material("mesh", [0.6, 0.62, 0.66], 0.8);
    let link = glb.node(&name, None, glam::DVec3::ZERO);
    glb.mesh(link, &name, &mesh.into_mesh_data(), Some(material), None);
    Ok((glb, doubt.map(|doubt| format!("{doubt}, {what_to_do}")).into_iter().collect()))
}
