//! Meshes of an MJCF, with their vertices in the order in which a tactile sensor counts them.

use std::collections::HashMap;
use std::path::Path;

use glam::{DQuat, DVec3};
use roxmltree::Node;

use super::builtin;
use super::document::{Defaults, numbers, three};
use crate::error::{Error, Result, failed};
use crate::mesh::formats;
use crate::mesh::triangles::{Triangles, whole};

/// The name of the asset `node` and its mesh, as it stands in a geom, m.
pub(super) fn read(
    node: Node<'_, '_>,
    defaults: &Defaults,
    folder: &Path,
    strips: bool,
) -> Result<(String, Triangles)> {
    let file = node.attribute("file");
    let stem = || {
        let stem = file.and_then(|file| Path::new(file).file_stem())?;
        Some(stem.to_string_lossy().into_owned())
    };
    let name = node.attribute("name").map(str::to_owned).or_else(stem);
    let name = name.ok_or_else(|| Error::failed("a <mesh> has neither a `name` nor a `file`"))?;
    let get = |key: &str| defaults.get(node, key);
    let mut mesh = match (file, node.attribute("builtin"), node.attribute("vertex")) {
        (Some(file), ..) => {
            let file = Path::new(file);
            let file = if strips { file.file_name().map_or(file, Path::new) } else { file };
            let path = folder.join(file);
            of_file(&path).map_err(|e| e.at(path.display()))?
        }
        (_, Some(kind), _) => {
            let params = node.attribute("params").map_or(Ok(Vec::new()), |text| numbers(node, "params", text))?;
            builtin::make(kind, &params)?
        }
        (_, _, Some(text)) => inline(node, text)?,
        // A plugin makes its surface; it has no vertices that are known here.
        _ => Triangles::default(),
    };
    if let Some(text) = get("refpos") {
        let origin = three(node, "refpos", text)?;
        mesh.positions.iter_mut().for_each(|p| *p -= origin);
    }
    if let Some(text) = get("refquat") {
        let &[w, x, y, z] = &numbers(node, "refquat", text)?[..] else {
            return Err(failed!("`refquat` is `{text}`; write four numbers"));
        };
        let turn = DQuat::from_xyzw(x, y, z, w).normalize().inverse();
        mesh.positions.iter_mut().for_each(|p| *p = turn * *p);
    }
    if let Some(text) = get("scale") {
        let scale = three(node, "scale", text)?;
        mesh.transform(&glam::DAffine3::from_scale(scale));
    }
    if !mesh.is_sound() {
        return Err(failed!("mesh `{name}` has a corner that is missing or not a number"));
    }
    Ok((name, mesh))
}

/// The mesh at `path`, with the vertices that MuJoCo has: those of an `.obj` in its order, of others each place once.
fn of_file(path: &Path) -> Result<Triangles> {
    let (mesh, _) = formats::load(path, None)?;
    let is_obj = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("obj"));
    Ok(if is_obj { mesh } else { shared(&mesh) })
}

/// The vertices that stand in the file itself, and the faces if there are any.
fn inline(node: Node<'_, '_>, text: &str) -> Result<Triangles> {
    let coordinates = numbers(node, "vertex", text)?;
    let faces = node.attribute("face").map_or(Ok(Vec::new()), |text| numbers(node, "face", text))?;
    if coordinates.len() % 3 != 0 || faces.len() % 3 != 0 {
        return Err(Error::failed("`vertex` and `face` have three numbers for each"));
    }
    let corner =
        |&number: &f64| whole(number).ok_or_else(|| failed!("`face` has vertex {number}; give its number, from 0 on"));
    let corners = faces.iter().map(corner).collect::<Result<Vec<u32>>>()?;
    Ok(Triangles {
        positions: coordinates.chunks_exact(3).map(DVec3::from_slice).collect(),
        triangles: corners.chunks_exact(3).map(|face| [face[0], face[1], face[2]]).collect(),
    })
}

/// The same mesh with one vertex at each place, in the order in which they come first.
fn shared(mesh: &Triangles) -> Triangles {
    let mut index_of: HashMap<[u32; 3], u32> = HashMap::new();
    let mut positions = Vec::new();
    let own: Vec<u32> = mesh
        .positions
        .iter()
        .map(|&p| {
            *index_of.entry(p.as_vec3().to_array().map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
                positions.push(p);
                positions.len() as u32 - 1
            })
        })
        .collect();
    let triangles = mesh.triangles.iter().map(|triangle| triangle.map(|v| own[v as usize])).collect();
    Triangles { positions, triangles }
}
