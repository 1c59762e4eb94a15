//! `Scene`: what is asked for, with the keys of scene files.

use std::path::Path;

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyDictMethods, PyFloat, PyInt, PyString};
use somatic::internal::error::parse_toml;
use somatic::scene::file::SceneFile;
use somatic::{BackendKind, Calibration, Error, Options};

use crate::error::{OrRaise, usage};
use crate::same::{hash_of, same};

/// What is asked of a body: which fields, which outputs, with which knobs.
///
/// From keywords, or from the text of a scene file; the keys are those of docs/reference/scene.md. Keys that are the command's alone,
/// such as `source` and `sink`, are refused.
///
/// >>> import somatic_touch as st
/// >>> st.Scene(outputs=["total", "centroid"], fields="hand/palm*")
/// <Scene fields = "hand/palm*", outputs = ["total", "centroid"]>
/// >>> st.Scene('outputs = ["touches"]\nmax_gap_s = 2')
/// <Scene outputs = ["touches"], max_gap_s = 2>
/// >>> st.Scene(sink="a.csv")
/// Traceback (most recent call last):
///     ...
/// somatic_touch.UsageError: `sink` is for the command; leave it out of this scene
///
/// Two that ask for the same are equal (`==`), whether of text or of keywords.
#[pyclass(module = "somatic_touch", name = "Scene", frozen)]
pub(crate) struct PyScene {
    file: SceneFile,
    /// As TOML.
    pub(crate) text: String,
}

/// A value of Python as TOML has it.
fn toml_of(any: &Bound<'_, PyAny>, key: &str) -> PyResult<toml::Value> {
    Ok(if any.is_instance_of::<PyBool>() {
        toml::Value::Boolean(any.extract()?)
    } else if any.is_instance_of::<PyInt>() {
        toml::Value::Integer(any.extract()?)
    } else if any.is_instance_of::<PyFloat>() {
        toml::Value::Float(any.extract()?)
    } else if any.is_instance_of::<PyString>() {
        toml::Value::String(any.extract()?)
    } else if let Ok(dict) = any.cast::<PyDict>() {
        toml::Value::Table(table_of(dict)?)
    } else if let Ok(items) = any.try_iter() {
        toml::Value::Array(items.map(|item| toml_of(&item?, key)).collect::<PyResult<_>>()?)
    } else {
        let kind = any.get_type().name()?.to_string();
        return Err(usage(
            any.py(),
            format!("{key}: a {kind} is not a value of a scene; give a number, a text or a list"),
        ));
    })
}

pub(crate) fn table_of(dict: &Bound<'_, PyDict>) -> PyResult<toml::Table> {
    let mut table = toml::Table::new();
    for (key, value) in dict.iter() {
        let key: String = key.extract()?;
        if !value.is_none() {
            table.insert(key.clone(), toml_of(&value, &key)?);
        }
    }
    Ok(table)
}

/// Refuses a key that is not one of scenes, or whose value is not; the error has the key.
pub(crate) fn check_keys(py: Python<'_>, table: &toml::Table) -> PyResult<()> {
    for (key, value) in table {
        if let Err(error) = alone(key, value) {
            // The line of a text that nobody wrote says nothing.
            let text = error.to_string();
            let what = text.strip_prefix(error.place().unwrap_or_default()).and_then(|rest| rest.strip_prefix(": "));
            let what = what.unwrap_or(&text);
            return Err(match what.starts_with("there is no key") || what.starts_with(&format!("`{key}` is `")) {
                true => usage(py, what),
                false => usage(py, format!("{key}: {what}")),
            });
        }
    }
    Ok(())
}

impl PyScene {
    /// The scene in `text`, or an error that has the line.
    pub(crate) fn of_text(py: Python<'_>, text: &str) -> PyResult<Self> {
        if text.ends_with(".toml") && !text.contains(['=', '\n']) {
            return Err(usage(
                py,
                format!("`{text}` is a file's name, and this should be a scene: give Scene.load({text:?})"),
            ));
        }
        let table: toml::Table = parse_toml(text).or_raise(py)?;
        if let Some(why) = table.iter().find_map(|(key, value)| why_not(key, value)) {
            return Err(usage(py, why));
        }
        let file = SceneFile::parse(text).map_err(|error| error.at("scene")).or_raise(py)?;
        file.check().or_raise(py)?;
        Ok(Self { file, text: text.to_owned() })
    }

    /// The same of keys, where an error has the key.
    fn of_table(py: Python<'_>, table: &toml::Table) -> PyResult<Self> {
        check_keys(py, table)?;
        let text = toml::to_string(table).map_err(|why| usage(py, why.to_string()))?;
        Self::of_text(py, &text)
    }

    pub(crate) fn of_any(any: Option<&Bound<'_, PyAny>>, py: Python<'_>) -> PyResult<Py<Self>> {
        let made = match any {
            None => Self::of_table(py, &toml::Table::new())?,
            Some(any) => {
                if let Ok(scene) = any.cast::<Self>() {
                    return Ok(scene.clone().unbind());
                }
                if let Ok(text) = any.extract::<String>() {
                    Self::of_text(py, &text)?
                } else if let Ok(dict) = any.cast::<PyDict>() {
                    Self::of_table(py, &table_of(dict)?)?
                } else {
                    return Err(usage(py, "a scene is a Scene, a dict of its keys, or the text of a scene file"));
                }
            }
        };
        Py::new(py, made)
    }

    /// Frames of a call, if it says so.
    pub(crate) fn batch(&self) -> Option<usize> {
        self.file.batch.map(|frames| frames as usize)
    }

    /// The engine's options under `calibration`; `backend` comes before the key.
    pub(crate) fn options(
        &self,
        calibration: Option<&Calibration>,
        backend: Option<BackendKind>,
        batch: usize,
    ) -> somatic::Result<Options> {
        let batch = self.batch().unwrap_or(batch);
        let options = self.file.engine_options(calibration.cloned(), true, batch)?;
        Ok(match backend {
            Some(backend) => options.backend(backend),
            None => options,
        })
    }
}

/// What the scene file at `path` says of what is computed.
fn table_of_file(py: Python<'_>, path: &Path) -> PyResult<toml::Table> {
    let text = std::fs::read_to_string(path).map_err(|e| Error::io(path, &e)).or_raise_of(py, path)?;
    let mut table: toml::Table = parse_toml(&text).map_err(|e| e.at(path.display())).or_raise_of(py, path)?;
    table.retain(|key, value| key == "accuracy" || why_not(key, value).is_none());
    Ok(table)
}

/// A scene with this key alone.
fn alone(key: &str, value: &toml::Value) -> somatic::Result<SceneFile> {
    let table = toml::Table::from_iter([(key.to_owned(), value.clone())]);
    SceneFile::parse(&toml::to_string(&table).unwrap_or_default())
}

/// Why this key is not for an engine, if it is one of scenes: it says where frames come from or go to, or how a run is shown.
fn why_not(key: &str, value: &toml::Value) -> Option<String> {
    let asked = alone(key, value).ok()?;
    if asked == asked.of_engine() {
        return None;
    }
    Some(match asked.accuracy.target().is_empty() {
        true => format!("`{key}` is for the command; leave it out of this scene"),
        false => {
            format!("`{key}` has a wish, which the command measures: `somatic tradeoff --write`; give options here")
        }
    })
}

#[pymethods]
impl PyScene {
    #[new]
    #[pyo3(signature = (text = None, **keys))]
    fn new(py: Python<'_>, text: Option<&Bound<'_, PyAny>>, keys: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        match (text, keys) {
            (Some(_), Some(_)) => Err(usage(py, "give a scene's text or its keys, not both")),
            (Some(text), None) => match (text.extract::<String>(), text.cast::<PyDict>()) {
                (Ok(text), _) => Self::of_text(py, &text),
                (_, Ok(dict)) => Self::of_table(py, &table_of(dict)?),
                _ => Err(usage(py, "a scene is a dict of its keys, or the text of a scene file")),
            },
            (None, keys) => {
                let table = keys.map(table_of).transpose()?.unwrap_or_default();
                Self::of_table(py, &table)
            }
        }
    }

    /// Reads what the scene file at `path` says of what is computed; keys that are the command's are left out.
    ///
    /// >>> import somatic_touch as st
    /// >>> st.Scene.load("no.scene.toml")
    /// Traceback (most recent call last):
    ///     ...
    /// somatic_touch.InputError: no.scene.toml: no such file or directory
    #[staticmethod]
    fn load(py: Python<'_>, path: std::path::PathBuf) -> PyResult<Self> {
        Self::of_table(py, &table_of_file(py, &path)?)
    }

    /// The same without a wish, which `tradeoff` is about to replace.
    #[staticmethod]
    fn _load_without_wish(py: Python<'_>, path: std::path::PathBuf) -> PyResult<Self> {
        let mut table = table_of_file(py, &path)?;
        if let Some(accuracy) = table.get_mut("accuracy").and_then(toml::Value::as_table_mut) {
            accuracy.retain(|key, _| !["centroid", "orientation", "budget"].contains(&key));
        }
        Self::of_table(py, &table)
    }

    /// It as TOML.
    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    fn __repr__(&self) -> String {
        let lines: Vec<&str> = self.text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
        let shown = if lines.is_empty() { "of everything".to_owned() } else { lines.join(", ") };
        format!("<Scene {shown}>")
    }

    fn __eq__(&self, py: Python<'_>, other: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        same(py, other, |other: &Self| self.file == other.file)
    }

    fn __hash__(&self) -> u64 {
        // Equal scenes are written alike, but for the sign of a zero.
        hash_of(&format!("{:?}", self.file).replace("-0.0", "0.0"))
    }

    fn __copy__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    fn __deepcopy__(slf: Py<Self>, _memo: &Bound<'_, PyDict>) -> Py<Self> {
        slf
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyAny>, (String,)) {
        (slf.get_type().into_any(), (slf.get().text.clone(),))
    }
}
