//! What bodies have as tables: taxels, surfaces and joints.

use std::collections::HashMap;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use somatic::Body;
use somatic::body::{Modality, Taxel};
use somatic::internal::body::{LinkMotion, WORLD_FROM_BODY};

use crate::arrays::{self, array, structured};
use crate::kinematics;

/// The taxels, as an array of structures.
pub(crate) fn taxels<'py>(py: Python<'py>, body: &Body) -> PyResult<Bound<'py, PyAny>> {
    let taxels = &body.taxels;
    let count = taxels.len();
    let place =
        |taxel: &Taxel| body.links[taxel.link].world_from_link().transform_point3(taxel.position_in_link).to_array();
    let tangent = |taxel: &Taxel| match taxel.modality {
        Modality::Force3 => taxel.tangents_in_link()[0].to_array(),
        _ => [f64::NAN; 3],
    };
    let vectors =
        |of: &dyn Fn(&Taxel) -> [f64; 3]| array(py, taxels.iter().flat_map(of).collect::<Vec<f64>>(), &[count, 3]);
    let modalities: Vec<String> = taxels.iter().map(|taxel| taxel.modality.name()).collect();
    let mut fields = vec![
        ("id", "u4", 1, array(py, taxels.iter().map(|taxel| taxel.id).collect(), &[count])?),
        ("link", "i8", 1, array(py, taxels.iter().map(|taxel| taxel.link as i64).collect(), &[count])?),
        ("position", "f8", 3, vectors(&|taxel| taxel.position_in_link.to_array())?),
        ("normal", "f8", 3, vectors(&|taxel| taxel.normal_in_link.to_array())?),
        ("place", "f8", 3, vectors(&place)?),
        ("area", "f8", 1, array(py, taxels.iter().map(|taxel| taxel.area).collect(), &[count])?),
        ("modality", "U24", 1, modalities.into_pyobject(py)?.into_any().unbind()),
    ];
    if taxels.iter().any(|taxel| taxel.modality == Modality::Force3) {
        fields.push(("tangent", "f8", 3, vectors(&tangent)?));
    }
    structured(py, count, &fields)
}

/// `vectors`, of each taxel one in the frame of its link, in the world with the body at rest.
pub(crate) fn at_rest(py: Python<'_>, body: &Body, vectors: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
    let vectors = arrays::vectors(vectors, "vectors")?;
    let turned = body.taxels.iter().zip(&vectors);
    let turned = turned
        .flat_map(|(taxel, vector)| body.links[taxel.link].world_from_link().transform_vector3(*vector).to_array());
    array(py, turned.collect::<Vec<f64>>(), &[vectors.len(), 3])
}

/// The surface in the world with the body at rest, as vertices and faces.
pub(crate) fn surface(py: Python<'_>, body: &Body) -> PyResult<(Py<PyAny>, Py<PyAny>)> {
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    let mut index_of = HashMap::new();
    for (_, corners) in body.triangles_at_rest() {
        faces.extend(corners.map(|corner| {
            let corner = WORLD_FROM_BODY.transform_point3(corner).to_array();
            *index_of.entry(corner.map(f64::to_bits)).or_insert_with(|| {
                vertices.extend(corner);
                (vertices.len() / 3 - 1) as u32
            })
        }));
    }
    let shapes = [[vertices.len() / 3, 3], [faces.len() / 3, 3]];
    Ok((array(py, vertices, &shapes[0])?, array(py, faces, &shapes[1])?))
}

/// The joints that move on their own, by name.
pub(crate) fn joints<'py>(py: Python<'py>, body: &Body) -> PyResult<Bound<'py, PyDict>> {
    let made = PyDict::new(py);
    for (name, link) in kinematics::joints(body) {
        let link = &body.links[link];
        let Some(joint) = &link.joint else { continue };
        let (kind, unit) = match joint.motion {
            LinkMotion::Revolute(_) => ("revolute", "rad"),
            LinkMotion::Continuous(_) => ("continuous", "rad"),
            LinkMotion::Prismatic(_) => ("prismatic", "m"),
        };
        let about = PyDict::new(py);
        about.set_item("link", &link.name)?;
        about.set_item("kind", kind)?;
        about.set_item("unit", unit)?;
        about.set_item("limits", joint.limits.map(|[low, high]| (low, high)))?;
        made.set_item(name, about)?;
    }
    Ok(made)
}
