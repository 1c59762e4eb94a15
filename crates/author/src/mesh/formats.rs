//! Reads a mesh by the ending of its file.

use std::path::Path;

use super::options::{check_unit, ending};
use super::triangles::Triangles;
use super::{collada, obj, ply, stl};
use crate::body::{Original, Up};
use crate::error::{Error, Result, failed};
use crate::limits::{self, MAX_MESH_BYTES, MAX_XML_BYTES};

pub(super) fn is_gltf(path: &Path) -> bool {
    matches!(ending(path).as_str(), "glb" | "gltf")
}

/// The mesh at `path` that is a part of a robot, in the axes that it has, in metres.
pub(super) fn load_part(path: &Path) -> Result<Triangles> {
    if !is_gltf(path) {
        return Ok(load(path, None)?.0);
    }
    let (body, _) = Original::open(path)?.read()?;
    let mut mesh = Triangles::default();
    for (_, corners) in body.triangles_at_rest() {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    Ok(mesh)
}

/// The mesh at `path` in metres, and which axis points up if the file says so. `unit_m` is its unit, for formats without one.
pub(super) fn load(path: &Path, unit_m: Option<f64>) -> Result<(Triangles, Option<Up>)> {
    let most = if ending(path) == "dae" { MAX_XML_BYTES } else { MAX_MESH_BYTES };
    let bytes = limits::read(path, most).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => Error::failed("no such file"),
        _ => Error::failed(e.to_string()),
    })?;
    if bytes.is_empty() {
        return Err(Error::failed("the file is empty"));
    }
    let (mut mesh, up) = match ending(path).as_str() {
        "stl" => (stl::read(&bytes)?, None),
        "obj" => (obj::read(&bytes)?, None),
        "ply" => (ply::read(&bytes)?, None),
        "dae" => {
            if unit_m.is_some() {
                return Err(Error::usage("a COLLADA file says its unit itself; leave --unit out"));
            }
            let (mesh, up) = collada::read(&bytes)?;
            (mesh, Some(up))
        }
        other => return Err(failed!("a mesh `.{other}` is not read; give .stl, .obj, .dae, .ply, .glb or .gltf")),
    };
    if let Some(unit_m) = unit_m {
        let metres = check_unit(unit_m)?;
        mesh.positions.iter_mut().for_each(|p| *p *= metres);
    }
    if !mesh.is_sound() {
        return Err(Error::failed("a corner is missing or not a number; export the file again"));
    }
    Ok((mesh, up))
}
