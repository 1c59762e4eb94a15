//! `Scene`: what is asked for, with the keys of scene files.

use std::fmt;
use std::str::FromStr;

use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyDictMethods, PyFloat, PyInt, PyString};
use serde::de::{Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use somatic::error::parse_toml;
use somatic::renamed::new_name;
use somatic::scene::{
    Arithmetic, AskedOutputs, Cadence, Charts, Coordinates, Coverage, FilterBy, Knobs, MotionFilter, OrientationBy,
};
use somatic::signal::{FsrSignal, Quantity};
use somatic::{BackendKind, Calibration, Error, Letter, Options, Outputs, Receptor, Scene, TouchOutputs, touch};

use crate::error::{OrRaise, usage};

/// Keys of scene files that say where frames come from and go to, and how a run is shown: the command's.
const OF_THE_COMMAND: [&str; 31] = [
    "accuracy",
    "all_fields",
    "allow_host",
    "board_rate_hz",
    "body",
    "budget",
    "calibration",
    "centroid",
    "format",
    "from_s",
    "grid",
    "header",
    "layout",
    "live_rate_hz",
    "loop",
    "orientation",
    "overwrite",
    "pitch",
    "playback_speed",
    "quiet",
    "rate_hz",
    "record",
    "sink",
    "source",
    "strict",
    "to_s",
    "unit",
    "verify",
    "wiring",
    "within",
    "zenoh_config",
];

/// When touches of the whole body begin and end.
#[derive(Clone, Copy, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct TouchKeys {
    on: f64,
    off: f64,
}

impl TouchKeys {
    fn options(self, outputs: TouchOutputs) -> touch::Options {
        touch::Options { on: self.on, off: self.off, outputs, ..touch::Options::default() }
    }
}

/// The keys of a scene that say what is computed.
#[derive(Clone, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Keys {
    #[serde(deserialize_with = "list")]
    outputs: Vec<AskedOutputs>,
    touch: Option<TouchKeys>,
    #[serde(deserialize_with = "list")]
    fields: Vec<String>,
    #[serde(deserialize_with = "list")]
    letters: Vec<Receptor>,
    #[serde(deserialize_with = "list")]
    signal: Vec<FsrSignal>,
    #[serde(deserialize_with = "word")]
    backend: Option<BackendKind>,
    batch: Option<u16>,
    tare: bool,
    #[serde(deserialize_with = "word")]
    coordinates: Option<Coordinates>,
    relative_to: Option<String>,
    max_gap_s: Option<f64>,
    contact_tolerance_m: Option<f64>,
    max_age_s: Option<f64>,
    filter_window: Option<String>,
    #[serde(deserialize_with = "word")]
    filter_by: Option<FilterBy>,
    filter_time_s: Option<f64>,
    filter_over_s: Option<f64>,
    accuracy: KnobKeys,
}

/// The knobs of a scene.
#[derive(Clone, Copy, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct KnobKeys {
    #[serde(deserialize_with = "word")]
    arithmetic: Option<Arithmetic>,
    #[serde(deserialize_with = "word")]
    charts: Option<Charts>,
    #[serde(deserialize_with = "word")]
    orientation_by: Option<OrientationBy>,
    #[serde(deserialize_with = "word")]
    coverage: Option<Coverage>,
    #[serde(deserialize_with = "word")]
    cadence: Option<Cadence>,
}

/// One text or a list of them.
struct Texts<T>(std::marker::PhantomData<T>);

impl<'de, T: FromStr<Err: fmt::Display>> Visitor<'de> for Texts<T> {
    type Value = Vec<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a text, or a list of texts")
    }

    fn visit_str<E: serde::de::Error>(self, text: &str) -> Result<Vec<T>, E> {
        text.parse().map(|one| vec![one]).map_err(E::custom)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Vec<T>, A::Error> {
        let mut all = Vec::new();
        while let Some(one) = list.next_element::<String>()? {
            all.push(one.parse().map_err(A::Error::custom)?);
        }
        Ok(all)
    }
}

fn list<'de, T: FromStr<Err: fmt::Display>, D: Deserializer<'de>>(from: D) -> Result<Vec<T>, D::Error> {
    from.deserialize_any(Texts(std::marker::PhantomData))
}

fn word<'de, T: FromStr<Err: fmt::Display>, D: Deserializer<'de>>(from: D) -> Result<Option<T>, D::Error> {
    String::deserialize(from)?.parse().map(Some).map_err(D::Error::custom)
}

/// What is asked of a body: which fields, which outputs, with which knobs.
///
/// From keywords, or from the text of a scene file; the keys are those of docs/scenes.md. Keys that are the command's alone,
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
#[pyclass(module = "somatic_touch", name = "Scene", frozen)]
pub(crate) struct PyScene {
    keys: Keys,
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
            format!("{key}: a {kind} is no value of a scene; give a number, a text or a list"),
        ));
    })
}

fn table_of(dict: &Bound<'_, PyDict>) -> PyResult<toml::Table> {
    let mut table = toml::Table::new();
    for (key, value) in dict.iter() {
        let key: String = key.extract()?;
        if !value.is_none() {
            table.insert(key.clone(), toml_of(&value, &key)?);
        }
    }
    Ok(table)
}

impl PyScene {
    /// The scene in `text`, or an error that has the line.
    fn of_text(py: Python<'_>, text: &str) -> PyResult<Self> {
        let table: toml::Table = parse_toml(text).or_raise(py)?;
        refuse_the_commands(py, &table)?;
        let keys: Keys = parse_toml(text).map_err(|error| error.at("scene")).or_raise(py)?;
        keys.check().or_raise(py)?;
        Ok(Self { keys, text: text.to_owned() })
    }

    /// The same of keys, where an error has the key.
    fn of_table(py: Python<'_>, table: &toml::Table) -> PyResult<Self> {
        refuse_the_commands(py, table)?;
        for (key, value) in table {
            let alone = toml::to_string(&toml::Table::from_iter([(key.clone(), value.clone())])).unwrap_or_default();
            if let Err(error) = parse_toml::<Keys>(&alone) {
                // The line of a text that nobody wrote says nothing.
                let text = error.to_string();
                let what =
                    text.strip_prefix(error.place().unwrap_or_default()).and_then(|rest| rest.strip_prefix(": "));
                let what = what.unwrap_or(&text);
                return Err(match what.starts_with("there is no key") || what.starts_with(&format!("`{key}` is `")) {
                    true => usage(py, what),
                    false => usage(py, format!("{key}: {what}")),
                });
            }
        }
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

    /// The engine's options under `calibration`; `backend` comes before the key.
    pub(crate) fn options(
        &self,
        calibration: Option<&Calibration>,
        backend: Option<BackendKind>,
        batch: usize,
    ) -> somatic::Result<Options> {
        let Keys { letters, signal, accuracy, .. } = &self.keys;
        let has_unit =
            |calibration: &Calibration| calibration.taxels.iter().any(|taxel| taxel.quantity != Quantity::Count);
        let asked = AskedOutputs::all_of(&self.keys.outputs);
        let are_usual = self.keys.outputs.is_empty();
        let force = if are_usual && calibration.is_some_and(has_unit) { Outputs::FORCE } else { Outputs::empty() };
        let outputs = asked.of_fields | force;
        // Nobody has asked for touches, and there are no pressures to find them in.
        let in_vain = are_usual && !letters.is_empty() && !letters.contains(&Receptor::Sustained);
        let touches = asked.of_touches.filter(|_| !in_vain);
        let letters = if letters.is_empty() { &[Receptor::Sustained][..] } else { letters };
        let usual = Scene::default();
        let knobs = Knobs::default()
            .arithmetic(accuracy.arithmetic)
            .charts(accuracy.charts.unwrap_or_default())
            .orientation_by(accuracy.orientation_by.unwrap_or_default())
            .coverage(accuracy.coverage.unwrap_or_default())
            .cadence(accuracy.cadence.unwrap_or_default());
        let scene = Scene::default()
            .outputs(outputs)
            .fields(self.keys.fields.clone())
            .max_age_s(self.keys.max_age_s.unwrap_or(usual.max_age_s))
            .max_gap_s(self.keys.max_gap_s.unwrap_or(usual.max_gap_s))
            .letters(Letter::all_of(letters, signal))
            .filter(self.keys.filter()?)
            .knobs(knobs)
            .contact_tolerance_m(self.keys.contact_tolerance_m)
            .touches(touches.map(|outputs| self.keys.touch.unwrap_or_default().options(outputs)))
            .relative_to(self.keys.relative_to.clone())
            .coordinates(self.keys.coordinates.unwrap_or(usual.coordinates));
        Ok(Options::default()
            .scene(scene)
            .calibration(calibration.cloned())
            .backend(backend.or(self.keys.backend).unwrap_or_default())
            .tare(self.keys.tare)
            .batch(self.keys.batch.map_or(batch, usize::from)))
    }
}

fn refuse_the_commands(py: Python<'_>, table: &toml::Table) -> PyResult<()> {
    let knobs = table.get("accuracy").and_then(toml::Value::as_table);
    let wishes = ["budget", "centroid", "orientation", "within"];
    if let Some(wish) = knobs.and_then(|knobs| wishes.into_iter().find(|wish| knobs.contains_key(*wish))) {
        let what =
            format!("accuracy: `{wish}` is measured by the command: `somatic tradeoff --write`; give knobs here");
        return Err(usage(py, what));
    }
    if let Some((key, new)) = table.keys().find_map(|key| Some((key, new_name(key, OF_THE_COMMAND)?))) {
        return Err(usage(py, format!("`{key}` is `{new}` now, and for the command; leave it out of this scene")));
    }
    match table.keys().find(|key| *key != "accuracy" && OF_THE_COMMAND.contains(&key.as_str())) {
        Some(key) => Err(usage(py, format!("`{key}` is for the command; leave it out of this scene"))),
        None => Ok(()),
    }
}

impl Keys {
    fn check(&self) -> somatic::Result<()> {
        if let Some(age) = self.max_age_s.filter(|age| !(age.is_finite() && *age >= 0.0)) {
            return Err(Error::usage(format!("max_age_s: {age} is not a time span; give seconds from 0")));
        }
        if let Some(gap) = self.max_gap_s.filter(|gap| gap.is_nan() || *gap <= 0.0) {
            return Err(Error::usage(format!("max_gap_s: {gap} is not a time span; give seconds over 0")));
        }
        if let Some(tolerance) = self.contact_tolerance_m.filter(|it| !(it.is_finite() && *it > 0.0)) {
            return Err(Error::usage(format!("contact_tolerance_m: {tolerance} is no distance; give metres over 0")));
        }
        if let Some(TouchKeys { on, off }) = self.touch
            && !([on, off].iter().all(|p| p.is_finite() && *p >= 0.0) && off <= on)
        {
            return Err(Error::usage(format!(
                "touch: on = {on} and off = {off}: give numbers from 0 on, off no larger than on"
            )));
        }
        if self.batch == Some(0) {
            return Err(Error::usage("batch: 0 is no number of frames; give one from 1 on"));
        }
        self.filter().map(drop)
    }

    fn filter(&self) -> somatic::Result<MotionFilter> {
        let usual = MotionFilter::default();
        let filter = usual
            .over_s(self.filter_over_s)
            .by(self.filter_by.unwrap_or(usual.by))
            .time_constant_s(self.filter_time_s.unwrap_or(usual.time_constant_s));
        self.filter_window.as_ref().map_or(Ok(filter), |window| filter.with_window(window))
    }
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
        let text = std::fs::read_to_string(&path).map_err(|e| Error::io(&path, &e)).or_raise_of(py, &path)?;
        let mut table: toml::Table = parse_toml(&text).map_err(|e| e.at(path.display())).or_raise_of(py, &path)?;
        table.retain(|key, _| key == "accuracy" || !OF_THE_COMMAND.contains(&key));
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

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyAny>, (String,)) {
        (slf.get_type().into_any(), (slf.get().text.clone(),))
    }
}
