//! A body of arrays.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec3, Vec3};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use somatic::author::{Recipe, author};
use somatic::body::{MAX_TAXEL_ID, Modality, Taxel};
use somatic::internal::body::{BODY_FROM_WORLD, Glb, MeshData, Original};
use somatic::internal::error::suggestion;

use crate::arrays::{doubles, shown, vectors};
use crate::error::{unknown_name, usage};

/// A name for all taxels, or for each.
#[derive(FromPyObject)]
pub(crate) enum Names {
    One(String),
    Each(Vec<String>),
}

/// What a body is made of, by taxel, with its surfaces.
pub(crate) struct Arrays<'a, 'py> {
    pub(crate) positions: &'a Bound<'py, PyAny>,
    pub(crate) normals: &'a Bound<'py, PyAny>,
    pub(crate) link: Option<Names>,
    pub(crate) ids: Option<Vec<u32>>,
    pub(crate) areas: Option<&'a Bound<'py, PyAny>>,
    pub(crate) modality: Option<Names>,
    pub(crate) tangents: Option<&'a Bound<'py, PyAny>>,
    pub(crate) surface: Option<&'a Bound<'py, PyAny>>,
}

/// Taxels and surfaces by link.
pub(crate) struct ArrayBody {
    links: Vec<(String, Vec<Taxel>)>,
    meshes: BTreeMap<String, MeshData>,
}

impl Arrays<'_, '_> {
    /// The body called `name`.
    pub(crate) fn body(self, py: Python<'_>, name: &str) -> PyResult<ArrayBody> {
        let (positions, normals) = (vectors(self.positions, "positions")?, vectors(self.normals, "normals")?);
        let count = positions.len();
        if count == 0 {
            return Err(usage(py, "positions has no rows; a body has a taxel at least"));
        }
        as_many(py, "normals", normals.len(), count)?;
        check_rows(py, &positions, &normals)?;
        let ids = self.ids.unwrap_or_else(|| (0..count as u32).collect());
        as_many(py, "ids", ids.len(), count)?;
        let mut seen = BTreeSet::new();
        if let Some(id) = ids.iter().find(|id| !seen.insert(**id) || **id > MAX_TAXEL_ID) {
            let what = if *id > MAX_TAXEL_ID { format!("is over {MAX_TAXEL_ID}") } else { "is there twice".to_owned() };
            return Err(usage(py, format!("ids: {id} {what}")));
        }
        let areas = areas_of(py, self.areas, count)?;
        let normals: Vec<DVec3> = normals.into_iter().map(DVec3::normalize).collect();
        let modalities = modalities_of(py, self.modality, count)?;
        let tangents = tangents_of(py, self.tangents, &modalities, &normals)?;
        let names = names_of(py, "link", self.link, name, count)?;
        let mut links: Vec<(String, Vec<Taxel>)> = Vec::new();
        for (row, link) in names.into_iter().enumerate() {
            let taxel = Taxel {
                id: ids[row],
                link: 0,
                position_in_link: positions[row],
                normal_in_link: normals[row],
                area: areas[row],
                modality: modalities[row],
                tangent_in_link: tangents[row],
            };
            match links.iter_mut().find(|(known, _)| *known == link) {
                Some((_, taxels)) => taxels.push(taxel),
                None => links.push((link, vec![taxel])),
            }
        }
        let meshes = self.surface.map_or(Ok(BTreeMap::new()), |surface| meshes_of(surface, &links))?;
        Ok(ArrayBody { links, meshes })
    }
}

/// Refuses as many of `what` as `given`, if taxels are not so many.
fn as_many(py: Python<'_>, what: &str, given: usize, taxels: usize) -> PyResult<()> {
    match given == taxels {
        true => Ok(()),
        false => Err(usage(py, format!("{what} should be one a taxel, {taxels}; there are {given}"))),
    }
}

/// The names in `given`, called `what`, by taxel.
fn names_of(py: Python<'_>, what: &str, given: Option<Names>, usual: &str, count: usize) -> PyResult<Vec<String>> {
    match given {
        None => Ok(vec![usual.to_owned(); count]),
        Some(Names::One(name)) => Ok(vec![name; count]),
        Some(Names::Each(names)) => as_many(py, what, names.len(), count).map(|()| names),
    }
}

/// What each taxel measures.
fn modalities_of(py: Python<'_>, given: Option<Names>, count: usize) -> PyResult<Vec<Modality>> {
    let names = names_of(py, "modality", given, &Modality::Pressure.name(), count)?;
    let modality = |name: String| {
        let code = Modality::names().position(|known| known == name);
        code.map(|code| Modality::from_code(code as u32)).ok_or_else(|| {
            let near = suggestion(&name, Modality::names());
            unknown_name(py, format!("modality: there is no `{name}`; {near}"))
        })
    };
    names.into_iter().map(modality).collect()
}

/// The tangents of taxels that measure `modalities`, those that are given.
fn tangents_of(
    py: Python<'_>,
    given: Option<&Bound<'_, PyAny>>,
    modalities: &[Modality],
    normals: &[DVec3],
) -> PyResult<Vec<Option<DVec3>>> {
    let Some(given) = given else { return Ok(vec![None; normals.len()]) };
    let given = vectors(given, "tangents")?;
    as_many(py, "tangents", given.len(), normals.len())?;
    let tangent = |(row, tangent): (usize, DVec3)| {
        if tangent.is_nan() {
            return Ok(None);
        }
        if modalities[row] != Modality::Force3 {
            let what = format!("row {row} has a tangent and is of {}; give NaN there", modalities[row].name());
            return Err(usage(py, format!("tangents: {what}")));
        }
        let across = tangent.try_normalize().map(|tangent| tangent.reject_from(normals[row]));
        across.filter(|across| across.length() > 1e-3).and_then(DVec3::try_normalize).map(Some).ok_or_else(|| {
            usage(py, format!("the tangent of row {row} has no direction across its normal; give another, or NaN"))
        })
    };
    given.into_iter().enumerate().map(tangent).collect()
}

impl ArrayBody {
    /// It as a file called `name`, with the fields that authoring makes.
    pub(crate) fn to_glb(&self, name: &str) -> somatic::Result<Vec<u8>> {
        let mut glb = Glb::new();
        for (link, taxels) in &self.links {
            // So that coordinates of the link are those of the world.
            let node = glb.placed_node(link, None, BODY_FROM_WORLD);
            if let Some(mesh) = self.meshes.get(link) {
                glb.mesh(node, link, mesh, None, None);
            }
            glb.taxels(&format!("{link} taxels"), Some(node), taxels, None);
        }
        let file = Original::from_bytes(name, &glb.to_bytes()?, None)?;
        author(file, &Recipe::none(), |_| {})?.file.to_glb()
    }
}

/// Refuses positions and normals that are not finite, and normals without a direction.
fn check_rows(py: Python<'_>, positions: &[DVec3], normals: &[DVec3]) -> PyResult<()> {
    for (row, (position, normal)) in positions.iter().zip(normals).enumerate() {
        if !position.is_finite() || !normal.is_finite() {
            return Err(usage(py, format!("the position or the normal of row {row} is not finite; leave the row out")));
        }
        if normal.length() < 1e-9 {
            return Err(usage(
                py,
                format!("the normal of row {row} is zero; give the direction that is outwards there"),
            ));
        }
    }
    Ok(())
}

/// The areas of `count` taxels, m²: one for all, one for each, or unknown ones.
fn areas_of(py: Python<'_>, areas: Option<&Bound<'_, PyAny>>, count: usize) -> PyResult<Vec<f64>> {
    let areas = match areas.map(|areas| doubles(areas, "areas")).transpose()? {
        None => vec![0.0; count],
        Some((areas, shape)) if shape.is_empty() => vec![areas[0]; count],
        Some((areas, shape)) if shape == [count] => areas,
        Some((_, shape)) => {
            return Err(usage(py, format!("areas should have shape [] or [{count}]; this has {}", shown(&shape))));
        }
    };
    match areas.iter().position(|area| !area.is_finite() || *area < 0.0) {
        Some(row) => {
            Err(usage(py, format!("the area of row {row} is {}; give m², or 0 where it is unknown", areas[row])))
        }
        None => Ok(areas),
    }
}

/// The surfaces in `surface` by link: one of the first link, or a dict of several.
fn meshes_of(surface: &Bound<'_, PyAny>, links: &[(String, Vec<Taxel>)]) -> PyResult<BTreeMap<String, MeshData>> {
    let Ok(of_links) = surface.cast::<PyDict>() else {
        return Ok(BTreeMap::from([(links[0].0.clone(), mesh(surface)?)]));
    };
    let mut meshes = BTreeMap::new();
    for (link, surface) in of_links.iter() {
        let link: String = link.extract()?;
        if !links.iter().any(|(known, _)| *known == link) {
            let near = suggestion(&link, links.iter().map(|(name, _)| name.as_str()));
            return Err(unknown_name(surface.py(), format!("surface: no taxel is on a link `{link}`; {near}")));
        }
        meshes.insert(link, mesh(&surface)?);
    }
    Ok(meshes)
}

/// The triangles in `any`, vertices and faces, with normals that are means of those of faces by their areas.
fn mesh(any: &Bound<'_, PyAny>) -> PyResult<MeshData> {
    let py = any.py();
    let wrong =
        |what: String| usage(py, format!("surface should be (vertices, faces), [vertices, 3] and [faces, 3]; {what}"));
    let (vertices, faces): (Bound<'_, PyAny>, Bound<'_, PyAny>) =
        any.extract().map_err(|_| wrong("this is no pair".to_owned()))?;
    let (vertices, faces) = (vectors(&vertices, "vertices")?, vectors(&faces, "faces")?);
    if let Some(row) = vertices.iter().position(|vertex| !vertex.is_finite()) {
        return Err(wrong(format!("vertex {row} is not finite")));
    }
    let mut triangles = Vec::with_capacity(faces.len());
    for (row, face) in faces.iter().enumerate() {
        let is_index = |index: &f64| *index >= 0.0 && index.fract() == 0.0 && *index < vertices.len() as f64;
        if !face.to_array().iter().all(is_index) {
            return Err(wrong(format!("face {row} has no vertex of that index among {}", vertices.len())));
        }
        triangles.push(face.to_array().map(|index| index as u32));
    }
    let mut normals = vec![DVec3::ZERO; vertices.len()];
    for triangle in &triangles {
        let [a, b, c] = triangle.map(|vertex| vertices[vertex as usize]);
        let normal = (b - a).cross(c - a);
        triangle.iter().for_each(|&vertex| normals[vertex as usize] += normal);
    }
    let unit = |normal: &DVec3| normal.try_normalize().map_or(Vec3::Z, DVec3::as_vec3).to_array();
    Ok(MeshData {
        positions: vertices.iter().map(|vertex| vertex.as_vec3().to_array()).collect(),
        normals: normals.iter().map(unit).collect(),
        triangles,
        skinning: None,
    })
}
