//! Reads a mesh by the ending of its file.

use std::path::Path;

use glam::DVec3;
use mesh_loader::Scene;

use super::options::{Up, check_unit, ending};
use super::triangles::Triangles;
use super::{guarded, ply};
use crate::error::{Error, Result, failed};
use crate::limits::{self, MAX_MESH_BYTES};

/// The mesh at `path` in metres, and which axis points up if the file says so. `unit_m` is its unit, for formats without one.
pub(super) fn load(path: &Path, unit_m: Option<f64>) -> Result<(Triangles, Option<Up>)> {
    let bytes = limits::read(path, MAX_MESH_BYTES).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => Error::failed("no such file"),
        _ => Error::failed(e.to_string()),
    })?;
    if bytes.is_empty() {
        return Err(Error::failed("the file is empty"));
    }
    let (mut mesh, up) = match ending(path).as_str() {
        "stl" => (of_scene(&mesh_loader::stl::from_slice(&bytes), "STL")?, None),
        "obj" => (
            of_scene(
                &mesh_loader::obj::from_slice(&bytes, None::<&Path>, |_| {
                    Err::<Vec<u8>, _>(std::io::ErrorKind::NotFound.into())
                }),
                "OBJ",
            )?,
            None,
        ),
        "ply" => (ply::read(&bytes)?, None),
        "dae" => {
            if unit_m.is_some() {
                return Err(Error::usage("a COLLADA file says its unit itself; leave --unit out"));
            }
            let scene = guarded::call(|| mesh_loader::collada::from_slice(&bytes));
            let scene = scene.unwrap_or_else(|| Err(std::io::Error::other("an index leads nowhere")));
            (of_scene(&scene, "COLLADA")?, up_of(&bytes))
        }
        other => return Err(failed!("a mesh `.{other}` is not read; give .stl, .obj, .dae, .ply or .glb")),
    };
    if let Some(unit_m) = unit_m {
        let metres = check_unit(unit_m)?;
        mesh.positions.iter_mut().for_each(|p| *p *= metres);
    }
    if !mesh.is_sound() {
        return Err(Error::failed("it has a corner that is no number or is not there; export it again"));
    }
    Ok((mesh, up))
}

fn of_scene(scene: &std::io::Result<Scene>, kind: &str) -> Result<Triangles> {
    let scene = scene.as_ref().map_err(|e| failed!("not a valid {kind} mesh: {}", one_line(&e.to_string())))?;
    let mut all = Triangles::default();
    for mesh in &scene.meshes {
        all.extend(&Triangles {
            positions: mesh.vertices.iter().map(|&p| DVec3::from_array(p.map(f64::from))).collect(),
            triangles: mesh.faces.clone(),
        });
    }
    Ok(all)
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The `<up_axis>` of a COLLADA file, which is y where it says nothing.
fn up_of(bytes: &[u8]) -> Option<Up> {
    let text = std::str::from_utf8(bytes).ok()?;
    let document = roxmltree::Document::parse(text).ok()?;
    let asset = document
        .root_element()
        .children()
        .find(|node| node.has_tag_name((node.tag_name().namespace().unwrap_or(""), "asset")));
    let up = asset.and_then(|asset| asset.children().find(|node| node.tag_name().name() == "up_axis"));
    match up.and_then(|up| up.text()).map(str::trim) {
        Some("Z_UP") => Some(Up::Z),
        _ => Some(Up::Y),
    }
}
