//! Fields of bodies, and how sensors of a sheet lie.

use pyo3::prelude::*;
use somatic::Body;
use somatic::field::{Field, FieldSet};

use crate::arrays::array;
use crate::error::usage;

/// A field of a body: which taxels it has, and where these are in its chart.
///
/// >>> import somatic_touch as st
/// >>> back = st.Body.bundled("hand").fields["hand/back"]
/// >>> back
/// <Field hand/back: 9 taxels on hand, chart plane>
/// >>> back.uv.shape
/// (9, 2)
#[pyclass(module = "somatic_touch", name = "Field", frozen)]
pub(crate) struct PyField {
    name: String,
    parent: Option<String>,
    anchor: Option<String>,
    chart: Option<String>,
    distortion: Option<f64>,
    taxels: Py<PyAny>,
    weights: Py<PyAny>,
    uv: Option<Py<PyAny>>,
}

#[pymethods]
impl PyField {
    /// Its name, such as 'hand/back'.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// The name of the field that it is a part of.
    #[getter]
    fn parent(&self) -> Option<&str> {
        self.parent.as_deref()
    }

    /// The link in whose frame its positions are; None where its taxels sit on several links.
    #[getter]
    fn anchor(&self) -> Option<&str> {
        self.anchor.as_deref()
    }

    /// The kind of its chart, 'plane' or 'geodesic'; None where it has none.
    #[getter]
    fn chart(&self) -> Option<&str> {
        self.chart.as_deref()
    }

    /// The largest relative error of distances between neighbours in the chart.
    #[getter]
    fn distortion(&self) -> Option<f64> {
        self.distortion
    }

    /// The ids of its taxels, uint32 [members], ascending.
    #[getter]
    fn taxels(&self, py: Python<'_>) -> Py<PyAny> {
        self.taxels.clone_ref(py)
    }

    /// Their weights, float64 [members].
    #[getter]
    fn weights(&self, py: Python<'_>) -> Py<PyAny> {
        self.weights.clone_ref(py)
    }

    /// Where they are in the chart, float64 [members, 2], in metres; None without a chart.
    #[getter]
    fn uv(&self, py: Python<'_>) -> Option<Py<PyAny>> {
        self.uv.as_ref().map(|uv| uv.clone_ref(py))
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.taxels.bind(py).len()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let (anchor, chart) = (self.anchor.as_deref().unwrap_or("several links"), self.chart.as_deref());
        Ok(format!(
            "<Field {}: {} taxels on {anchor}, chart {}>",
            self.name,
            self.__len__(py)?,
            chart.unwrap_or("none")
        ))
    }
}

impl PyField {
    /// `field`, one of `set`, on `body`.
    pub(crate) fn from_field(py: Python<'_>, body: &Body, set: &FieldSet, field: &Field) -> PyResult<Self> {
        let count = field.members.len();
        let members = || field.members.iter();
        let chart = field.chart.as_ref().ok();
        let uv = chart.map(|_| members().flat_map(|member| member.place.truncate().to_array()).collect::<Vec<f64>>());
        Ok(Self {
            name: field.name.clone(),
            parent: field.parent.map(|parent| set.fields[parent].name.clone()),
            anchor: field.anchor.map(|anchor| body.links[anchor].name.clone()),
            chart: chart.map(|chart| format!("{:?}", chart.kind).to_lowercase()),
            distortion: chart.map(|chart| chart.distortion),
            taxels: array(py, members().map(|member| body.taxels[member.taxel].id).collect(), &[count])?,
            weights: array(py, members().map(|member| member.weight).collect(), &[count])?,
            uv: uv.map(|uv| array(py, uv, &[count, 2])).transpose()?,
        })
    }
}

/// From one sensor to the next: in both directions, or from row to row and from column to column.
#[derive(FromPyObject)]
pub(crate) enum PitchOfGrid {
    Both(f64),
    Each(f64, f64),
}

/// The pitch that `any` is.
pub(crate) fn pitch_of(any: &Bound<'_, PyAny>) -> PyResult<PitchOfGrid> {
    let what =
        "pitch_m should be a number of metres, such as 0.005, or one from row to row and one from column to column";
    any.extract().map_err(|_| usage(any.py(), what))
}
