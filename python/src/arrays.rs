//! Arrays in and out: what Python gives, as slices, and what the library has, as NumPy's arrays.

use glam::{DQuat, DVec3};
use numpy::ndarray::{ArrayD, IxDyn};
use numpy::{Element, PyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyDictMethods, PyList};
use somatic::RawValue;
use somatic::signal::Pose;

use crate::error::usage;

static ASARRAY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
static REQUIRE: PyOnceLock<Py<PyAny>> = PyOnceLock::new();

/// NumPy's view of anything.
fn as_array<'py>(any: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    ASARRAY.import(any.py(), "numpy", "asarray")?.call1((any,))
}

/// In C order, aligned, in the machine's byte order.
fn contiguous<'py>(any: &Bound<'py, PyAny>, dtype: &str) -> PyResult<Bound<'py, PyAny>> {
    REQUIRE.import(any.py(), "numpy", "require")?.call1((any, dtype, ["C", "A"]))
}

/// The raw values of some frames.
pub(crate) enum Values<'py> {
    /// Where Python has them.
    Borrowed(PyReadonlyArrayDyn<'py, f32>),
    /// Made of an array of another type or order, or with missing values.
    Owned(Vec<RawValue>),
}

impl Values<'_> {
    pub(crate) fn slice(&self) -> &[RawValue] {
        match self {
            // An array that was checked when it was borrowed.
            Self::Borrowed(array) => bytemuck::cast_slice(array.as_slice().unwrap_or_default()),
            Self::Owned(values) => values,
        }
    }
}

/// As Python writes a shape.
fn shown(shape: &[usize]) -> String {
    let parts: Vec<String> = shape.iter().map(ToString::to_string).collect();
    format!("[{}]", parts.join(", "))
}

/// The values in `any`, which should have `shape`, called `names`; `mask` says which are missing.
pub(crate) fn values<'py>(
    any: &Bound<'py, PyAny>,
    mask: Option<&Bound<'py, PyAny>>,
    shape: &[usize],
    names: &str,
) -> PyResult<Values<'py>> {
    let py = any.py();
    if mask.is_none()
        && let Ok(array) = any.cast::<PyArrayDyn<f32>>()
        && array.shape() == shape
        && array.is_c_contiguous()
        && array.is_aligned()
    {
        return Ok(Values::Borrowed(array.try_readonly()?));
    }
    let expected = || format!("values should be float32 of shape {names} = {}", shown(shape));
    let array =
        as_array(any).map_err(|why| usage(py, format!("{}; this is not an array: {}", expected(), one_line(&why))))?;
    let got: Vec<usize> = array.getattr("shape")?.extract()?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if got != shape {
        return Err(usage(py, format!("{}; this has shape {}", expected(), shown(&got))));
    }
    if !["f", "i", "u"].contains(&kind.as_str()) {
        let dtype = array.getattr("dtype")?.str()?;
        return Err(usage(py, format!("{}; this is of type {dtype}, which is not a number", expected())));
    }
    let size: usize = array.getattr("dtype")?.getattr("itemsize")?.extract()?;
    let mut values: Vec<RawValue> = if kind == "f" && size <= 4 {
        let array = contiguous(&array, "float32")?;
        let array = array.cast::<PyArrayDyn<f32>>().map_err(|_| usage(py, expected()))?.try_readonly()?;
        bytemuck::cast_slice(array.as_slice()?).to_vec()
    } else {
        let array = contiguous(&array, "float64")?;
        let array = array.cast::<PyArrayDyn<f64>>().map_err(|_| usage(py, expected()))?.try_readonly()?;
        array.as_slice()?.iter().map(|&value| RawValue::new(value)).collect()
    };
    if let Some(mask) = mask {
        let mask = as_array(mask)?;
        let got: Vec<usize> = mask.getattr("shape")?.extract()?;
        let kind: String = mask.getattr("dtype")?.getattr("kind")?.extract()?;
        if kind != "b" || (got != shape && Some(&got[..]) != shape.get(shape.len() - 1..)) {
            let what = format!(
                "mask should be bool of shape {names} = {}, True where a value is missing; this is {} of shape {}",
                shown(shape),
                mask.getattr("dtype")?.str()?,
                shown(&got)
            );
            return Err(usage(py, what));
        }
        let mask = contiguous(&mask, "bool")?;
        let mask = mask.cast::<PyArrayDyn<bool>>().map_err(|_| usage(py, "mask should be bool"))?.try_readonly()?;
        for (value, &missing) in values.iter_mut().zip(mask.as_slice()?.iter().cycle()) {
            if missing {
                *value = RawValue::MISSING;
            }
        }
    }
    Ok(Values::Owned(values))
}

fn one_line(error: &PyErr) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The times in `any`, s.
pub(crate) fn times<'py>(any: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    let py = any.py();
    let wrong = |got: &str| usage(py, format!("t should be float64 of shape [frames], in seconds; {got}"));
    let array = as_array(any).map_err(|why| wrong(&format!("this is not an array: {}", one_line(&why))))?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if shape.len() != 1 || !["f", "i", "u"].contains(&kind.as_str()) {
        return Err(wrong(&format!("this is {} of shape {}", array.getattr("dtype")?.str()?, shown(&shape))));
    }
    let array = contiguous(&array, "float64")?;
    array.cast::<PyArrayDyn<f64>>().map_err(|_| wrong("this is not"))?.try_readonly().map_err(Into::into)
}

/// The poses in `any`: by link `[x, y, z, qx, qy, qz, qw]`, one for all frames or one for each.
pub(crate) fn poses(any: &Bound<'_, PyAny>, frames: usize) -> PyResult<Vec<(String, Vec<Pose>)>> {
    let py = any.py();
    let wrong =
        |what: String| usage(py, format!("pose should be a dict of links to [x, y, z, qx, qy, qz, qw]; {what}"));
    let dict = any.cast::<PyDict>().map_err(|_| wrong("this is not a dict".to_owned()))?;
    let mut poses = Vec::new();
    for (link, pose) in dict.iter() {
        let link: String = link.extract().map_err(|_| wrong("a key is not text".to_owned()))?;
        let array = as_array(&pose)?;
        let shape: Vec<usize> = array.getattr("shape")?.extract()?;
        let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
        if (shape != [7] && shape != [frames, 7]) || !["f", "i", "u"].contains(&kind.as_str()) {
            let expected = format!("the pose of `{link}` should have shape [7] or [{frames}, 7]");
            return Err(wrong(format!(
                "{expected}, and is {} of shape {}",
                array.getattr("dtype")?.str()?,
                shown(&shape)
            )));
        }
        let array = contiguous(&array, "float64")?;
        let array = array.cast::<PyArrayDyn<f64>>().map_err(|_| wrong("this is not".to_owned()))?.try_readonly()?;
        let (rows, _) = array.as_slice()?.as_chunks::<7>();
        let mut made = Vec::with_capacity(frames);
        for &[x, y, z, qx, qy, qz, qw] in rows {
            let quaternion = DQuat::from_xyzw(qx, qy, qz, qw);
            let length = quaternion.length();
            // As on standard input: a direction is taken, noise is not.
            if !(DVec3::new(x, y, z).is_finite() && (1e-3..=1e3).contains(&length)) {
                return Err(wrong(format!(
                    "the pose of `{link}` is not finite, or its quaternion has length {length:e}"
                )));
            }
            made.push(Pose { translation: DVec3::new(x, y, z), rotation: quaternion.normalize() });
        }
        if shape.len() == 1 {
            made = vec![made[0]; frames];
        }
        poses.push((link, made));
    }
    Ok(poses)
}

/// `values` as a read-only array of `shape`, which owns them.
pub(crate) fn array<T: Element>(py: Python<'_>, values: Vec<T>, shape: &[usize]) -> PyResult<Py<PyAny>> {
    let array = ArrayD::from_shape_vec(IxDyn(shape), values)
        .map_err(|why| usage(py, format!("an array of another size was made: {why}")))?;
    let array = PyArray::from_owned_array(py, array);
    array.call_method1("setflags", (false,))?;
    Ok(array.into_any().unbind())
}

/// An array of structures, whose fields are given by name with their types and values.
pub(crate) fn structured<'py>(
    py: Python<'py>,
    length: usize,
    fields: &[(&str, &str, usize, Py<PyAny>)],
) -> PyResult<Bound<'py, PyAny>> {
    let numpy = py.import("numpy")?;
    let dtype = PyList::empty(py);
    for (name, kind, width, _) in fields {
        match width {
            1 => dtype.append((name, kind))?,
            _ => dtype.append((name, kind, (*width,)))?,
        }
    }
    let made = numpy.call_method1("empty", (length, numpy.call_method1("dtype", (dtype,))?))?;
    for (name, _, _, values) in fields {
        made.set_item(name, values)?;
    }
    made.call_method1("setflags", (false,))?;
    Ok(made)
}
