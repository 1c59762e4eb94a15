//! `render`: pictures of bodies, and of touches on them.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use somatic::OutputPath;

use crate::body::PyBody;
use crate::calibration::PyCalibration;
use crate::error::{OrRaise, usage};
use crate::recording::PyRecording;

/// A picture that `render` drew.
///
/// Notebooks show it, `numpy.asarray` gives its pixels, so that matplotlib draws it too, and `save` writes it.
#[pyclass(module = "somatic_touch", name = "Picture", frozen)]
pub(crate) struct PyPicture {
    /// Width and height, pixels.
    pub(crate) size: [u32; 2],
    /// How many there are, one after the other.
    pub(crate) count: usize,
    pub(crate) pixels: Py<PyAny>,
    pub(crate) png: Vec<u8>,
}

#[pymethods]
impl PyPicture {
    /// Red, green, blue and opacity of each pixel, uint8 [height, width, 4], read-only; of an animation [pictures, height, width, 4].
    #[getter]
    fn pixels(&self, py: Python<'_>) -> Py<PyAny> {
        self.pixels.clone_ref(py)
    }

    /// Its width and height, in pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.size[0], self.size[1])
    }

    /// Writes it to `path` as PNG, animated where it shows a time span; a file that exists is replaced only with `force`.
    #[pyo3(signature = (path, *, force = false))]
    fn save(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        if path.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("png")) {
            return Err(usage(py, format!("{}: only PNG is written; let its name end in .png", path.display())));
        }
        OutputPath::new(&path, force, &[]).and_then(|output| output.write(&self.png)).or_raise_of(py, &path)
    }

    #[pyo3(signature = (dtype = None, copy = None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<&Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let keys = PyDict::new(py);
        keys.set_item("dtype", dtype)?;
        keys.set_item("copy", copy)?;
        py.import("numpy")?.call_method("array", (&self.pixels,), Some(&keys))
    }

    fn _repr_png_<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.png)
    }

    fn __repr__(&self) -> String {
        let [width, height] = self.size;
        match self.count {
            1 => format!("<Picture: {width} × {height} pixels>"),
            count => format!("<Picture: {count} of {width} × {height} pixels, one after the other>"),
        }
    }
}

/// What is drawn: the keywords of `render`.
#[cfg_attr(not(feature = "gpu"), expect(dead_code, reason = "nothing is drawn"))]
pub(crate) struct Wish<'a> {
    pub(crate) body: &'a PyBody,
    pub(crate) recording: Option<&'a PyRecording>,
    pub(crate) calibration: Option<&'a PyCalibration>,
    pub(crate) letter: Option<String>,
    pub(crate) at_s: Option<f64>,
    pub(crate) from_s: Option<f64>,
    pub(crate) to_s: Option<f64>,
    pub(crate) rate_hz: f64,
    pub(crate) views: Vec<String>,
    pub(crate) fields: Vec<String>,
    pub(crate) uv: Option<String>,
    pub(crate) look_at: Option<String>,
    pub(crate) ids: bool,
    pub(crate) edges: bool,
    pub(crate) size: [u32; 2],
}

/// Width, or width and height at most, pixels.
#[derive(FromPyObject)]
pub(crate) enum SizeOfPicture {
    Width(u32),
    Both(u32, u32),
}

/// Draws a body with its fields, or a touch on it, as `somatic render` does.
///
/// `what` is a `Body`, or a `Recording` whose body is known. Of a body the taxels have the colours of their `fields` (globs); `uv` draws
/// the chart of one field instead; `ids` labels taxels, `edges` connects neighbours on the skin. Of a recording they have the colours of
/// their pressures under `calibration` (by default its own), or of `letter`: 'shear', 'temperature' or 'proximity'; and each touch of the
/// body has its mark: at the time `at_s`, by default where there is most to see, or from `from_s` to `to_s` as an animation with `rate_hz`
/// pictures a second. `views` are sides, such as 'front' and 'top', or 'all'; `look_at` is a field or link that fills the picture; `size`
/// is the width, or width and height at most, in pixels.
///
/// It needs a wheel with the GPU, and an adapter; a software one such as Mesa's lavapipe will do.
///
/// >>> import numpy as np
/// >>> import somatic_touch as st
/// >>> st.render("hand")
/// Traceback (most recent call last):
///     ...
/// somatic_touch.UsageError: a picture is of a Body or a Recording; this is a str
#[pyfunction]
#[pyo3(signature = (what, *, at_s = None, from_s = None, to_s = None, rate_hz = 12.0, calibration = None, letter = None, views = Vec::new(), fields = Vec::new(), uv = None, look_at = None, ids = false, edges = false, size = SizeOfPicture::Width(1600)))]
#[expect(clippy::too_many_arguments, reason = "they are keywords")]
pub(crate) fn render(
    py: Python<'_>,
    what: &Bound<'_, PyAny>,
    at_s: Option<f64>,
    from_s: Option<f64>,
    to_s: Option<f64>,
    rate_hz: f64,
    calibration: Option<&Bound<'_, PyCalibration>>,
    letter: Option<String>,
    views: Vec<String>,
    fields: Vec<String>,
    uv: Option<String>,
    look_at: Option<String>,
    ids: bool,
    edges: bool,
    size: SizeOfPicture,
) -> PyResult<PyPicture> {
    let recording = what.cast::<PyRecording>().ok().map(Bound::get);
    let body = match recording {
        Some(recording) => recording
            .body
            .as_ref()
            .map(|body| body.bind(py).clone())
            .ok_or_else(|| usage(py, format!("{}: it has no body; read it with body=", recording.name)))?,
        None => what.cast::<PyBody>().cloned().map_err(|_| {
            let kind = what.get_type().name().map_or_else(|_| "something else".to_owned(), |name| name.to_string());
            usage(py, format!("a picture is of a Body or a Recording; this is a {kind}"))
        })?,
    };
    let of_touch = [
        ("at_s", at_s.is_some()),
        ("from_s", from_s.is_some()),
        ("to_s", to_s.is_some()),
        ("calibration", calibration.is_some()),
        ("letter", letter.is_some()),
    ];
    if let Some((key, _)) = of_touch.into_iter().find(|(_, given)| *given && recording.is_none()) {
        return Err(usage(py, format!("{key} is about a touch; give a Recording")));
    }
    if at_s.is_some() && (from_s.is_some() || to_s.is_some()) {
        return Err(usage(py, "at_s is one time, from_s and to_s are a span; give one of them"));
    }
    let of_body = [("uv", uv.is_some()), ("fields", !fields.is_empty())];
    if let Some((key, _)) = of_body.into_iter().find(|(_, given)| *given && (ids || recording.is_some())) {
        return Err(usage(py, format!("{key} is about a body's fields; it goes with neither a recording nor ids")));
    }
    if uv.is_some() && (look_at.is_some() || !views.is_empty() || edges) {
        return Err(usage(py, "uv draws a chart, which has neither views nor a part to look at nor edges"));
    }
    let calibration = match recording {
        Some(recording) => recording.calibrated(py, calibration, body.get())?,
        None => None,
    };
    let wish = Wish {
        body: body.get(),
        recording,
        calibration: calibration.as_ref().map(Py::get),
        letter,
        at_s,
        from_s,
        to_s,
        rate_hz,
        views,
        fields,
        uv,
        look_at,
        ids,
        edges,
        size: match size {
            SizeOfPicture::Width(width) => [width, width],
            SizeOfPicture::Both(width, height) => [width, height],
        },
    };
    draw(py, wish)
}

#[cfg(feature = "gpu")]
use crate::drawing::draw;

#[cfg(not(feature = "gpu"))]
fn draw(py: Python<'_>, _wish: Wish<'_>) -> PyResult<PyPicture> {
    let what = "this wheel draws no pictures; install it with --config-settings=build-args=\"--features gpu\"";
    Err(crate::error::failed(py, what))
}
