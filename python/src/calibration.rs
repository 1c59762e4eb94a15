//! `Calibration`.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use somatic::body::Modality;
use somatic::{Calibration, OutputPath};

use crate::body::PyBody;
use crate::error::OrRaise;
use crate::same::{hash_of, same};

/// How one robot's sensors answer: baselines, gains, units, and which values to reject.
///
/// `text` is a file as docs/reference/calibration.md describes it, made for `body`.
///
/// >>> import somatic_touch as st
/// >>> body = st.Body.bundled("hand")
/// >>> st.Calibration("[all]\ngain = 2\nunit = 'kPa'", body).quantity
/// 'Pa'
///
/// Two of the same text for the same taxels are equal (`==`).
#[pyclass(module = "somatic_touch", name = "Calibration", frozen, skip_from_py_object)]
#[derive(Clone)]
pub(crate) struct PyCalibration {
    pub(crate) inner: Calibration,
    /// As tables keep it.
    pub(crate) text: String,
    /// The name and the taxels of the body that it is for.
    of: (String, Vec<(u32, u32)>),
}

/// The taxels of a calibration that was pickled.
#[derive(FromPyObject)]
enum PickledTaxels {
    /// Ids, and the numbers of what they measure.
    WithKinds(Vec<(u32, u32)>),
    /// Ids alone, as pickles had them while every taxel that was read was one of pressure.
    Ids(Vec<u32>),
}

impl PyCalibration {
    pub(crate) fn of_text(text: &str, body: &PyBody) -> somatic::Result<Self> {
        let taxels = body.inner.taxels.iter().map(|taxel| (taxel.id, taxel.modality.code()));
        Self::of_parts(text, body.inner.name.clone(), taxels.collect())
    }

    /// `taxels` are ids, and the numbers of what they measure.
    fn of_parts(text: &str, body: String, taxels: Vec<(u32, u32)>) -> somatic::Result<Self> {
        let kinds: Vec<_> = taxels.iter().map(|&(id, code)| (id, Modality::from_code(code))).collect();
        let inner = Calibration::parse_for(text, &kinds)?;
        inner.check_body(&body)?;
        Ok(Self { inner, text: text.to_owned(), of: (body, taxels) })
    }

    fn is_same(&self, other: &Self) -> bool {
        (&self.text, &self.of) == (&other.text, &other.of)
    }

    /// This one laid over `own`, which comes with the file `of`, as the command does it: keys that it has replace the file's own,
    /// others stay. With it, what stays and a unit that is replaced, a line each.
    pub(crate) fn over(&self, own: &Self, of: &str, body: &PyBody) -> somatic::Result<(Self, Vec<String>)> {
        let taxels: Vec<_> = body.inner.taxels.iter().map(|taxel| (taxel.id, taxel.modality)).collect();
        let laid = Calibration::lay_over_for(&own.text, &self.text, &taxels)?;
        let stays = match &laid.stays[..] {
            [] => None,
            stays => Some(format!("{of}: of its own calibration, this stays under yours: {}", stays.join(", "))),
        };
        let replaced =
            laid.replaced_unit.map(|[own, given]| format!("{of}: your calibration replaces its unit {own} by {given}"));
        let both = Self::of_text(&laid.text, body).map_err(|e| e.at(format!("laid over the calibration of {of}")))?;
        Ok((both, stays.into_iter().chain(replaced).collect()))
    }
}

#[pymethods]
impl PyCalibration {
    #[new]
    fn new(py: Python<'_>, text: &str, body: &PyBody) -> PyResult<Self> {
        Self::of_text(text, body).or_raise(py)
    }

    /// Reads the calibration file at `path`, made for `body`.
    ///
    /// >>> import somatic_touch as st
    /// >>> st.Calibration.load("no-such.toml", st.Body.bundled("hand"))
    /// Traceback (most recent call last):
    ///     ...
    /// somatic_touch.InputError: no-such.toml: no such file or directory
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, body: &PyBody) -> PyResult<Self> {
        let text = std::fs::read_to_string(&path).map_err(|e| somatic::Error::io(&path, &e)).or_raise_of(py, &path)?;
        Self::of_text(&text, body).map_err(|e| e.at(path.display())).or_raise_of(py, &path)
    }

    /// Writes it to `path`, a TOML file; a file that exists is replaced only with `force`.
    ///
    /// >>> import somatic_touch as st, tempfile, pathlib
    /// >>> path = pathlib.Path(tempfile.mkdtemp()) / "hand.toml"
    /// >>> st.Calibration("[all]\ngain = 2", st.Body.bundled("hand")).save(path)
    /// >>> path.read_text()
    /// '[all]\ngain = 2'
    #[pyo3(signature = (path, *, force = false))]
    fn save(&self, py: Python<'_>, path: PathBuf, force: bool) -> PyResult<()> {
        OutputPath::new(&path, force, &[]).and_then(|to| to.write(self.text.as_bytes())).or_raise_of(py, &path)
    }

    /// What all taxels measure: 'Pa', 'N', 'count', or 'mixed'.
    #[getter]
    fn quantity(&self) -> &'static str {
        let mut all = self.inner.taxels.iter().map(|taxel| taxel.quantity.symbol());
        let first = all.next().unwrap_or("count");
        if all.all(|other| other == first) { first } else { "mixed" }
    }

    /// The text of the file.
    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    fn __repr__(&self) -> String {
        format!("<Calibration of {} taxels in {}>", self.inner.taxels.len(), self.quantity())
    }

    fn __eq__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        same(py, other, |other: &Self| self.is_same(other))
    }

    fn __hash__(&self) -> u64 {
        hash_of(&(&self.text, &self.of))
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyDict>) -> Py<Self> {
        slf
    }

    #[expect(clippy::type_complexity, reason = "pickle's own form: a function and its arguments")]
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String, String, Vec<(u32, u32)>))> {
        let Self { text, of: (body, taxels), .. } = slf.get();
        Ok((slf.get_type().getattr("_of_parts")?, (text.clone(), body.clone(), taxels.clone())))
    }

    #[staticmethod]
    #[pyo3(name = "_of_parts")]
    fn unpickled(py: Python<'_>, text: String, body: String, taxels: PickledTaxels) -> PyResult<Self> {
        let taxels = match taxels {
            PickledTaxels::WithKinds(taxels) => taxels,
            PickledTaxels::Ids(ids) => ids.into_iter().map(|id| (id, Modality::Pressure.code())).collect(),
        };
        // As of those in recordings, nobody can change its text.
        let (text, _) = Calibration::with_names_of_now(text);
        Self::of_parts(&text, body, taxels).map_err(|e| e.at("a pickled calibration")).or_raise(py)
    }
}
