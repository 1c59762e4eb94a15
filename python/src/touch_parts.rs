//! What touches have more than one of: links that they lie on, and taxels.

use pyo3::prelude::*;
use somatic::percept::{LinkShare, Wrench};
use somatic::{Body, TouchFrame};

use crate::arrays::{array, structured};

/// The parts of the touches of `frames`, a row for each link of each touch.
pub(crate) fn wrenches<'py, 'a>(
    py: Python<'py>,
    frames: impl Iterator<Item = &'a TouchFrame>,
) -> PyResult<Bound<'py, PyAny>> {
    let of_touch = |found: &'a TouchFrame| found.touches.iter().map(move |touch| found.links(touch));
    let links = frames.flat_map(of_touch).enumerate();
    let rows: Vec<(usize, LinkShare)> =
        links.flat_map(|(row, links)| links.iter().map(move |link| (row, *link))).collect();
    let count = rows.len();
    let vectors = |of: &dyn Fn(Wrench) -> [f64; 3]| {
        let numbers = rows.iter().flat_map(|(_, share)| share.wrench.map_or([f64::NAN; 3], of));
        array(py, numbers.collect::<Vec<f64>>(), &[count, 3])
    };
    let fields = [
        ("touch", "i8", 1, array(py, rows.iter().map(|(row, _)| *row as i64).collect(), &[count])?),
        ("link", "i8", 1, array(py, rows.iter().map(|(_, share)| i64::from(share.link)).collect(), &[count])?),
        ("total", "f8", 1, array(py, rows.iter().map(|(_, share)| share.total).collect(), &[count])?),
        ("force", "f8", 3, vectors(&|wrench| wrench.force_newton.to_array())?),
        ("torque", "f8", 3, vectors(&|wrench| wrench.torque_newton_m.to_array())?),
    ];
    structured(py, count, &fields)
}

/// The ids of the pressed taxels of each touch of `frames`, on `body`.
pub(crate) fn taxels<'a>(
    py: Python<'_>,
    body: &Body,
    frames: impl Iterator<Item = &'a TouchFrame>,
) -> PyResult<Vec<Py<PyAny>>> {
    let can_touch = body.taxels.iter().filter(|taxel| taxel.modality.is_pressed());
    let ids: Vec<u32> = can_touch.map(|taxel| taxel.id).collect();
    let of_touch = |found: &'a TouchFrame| found.touches.iter().map(move |touch| found.taxels(touch));
    let of_nodes = |nodes: &[u32]| nodes.iter().map(|&node| ids[node as usize]).collect::<Vec<u32>>();
    frames.flat_map(of_touch).map(|nodes| array(py, of_nodes(nodes), &[nodes.len()])).collect()
}
