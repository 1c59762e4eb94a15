//! Arrays in and out: what Python gives, as slices, and what the library has, as NumPy's arrays.

use glam::{DQuat, DVec3};
use numpy::ndarray::{ArrayD, IxDyn};
use numpy::{Element, PyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyDictMethods, PyList};
use somatic::signal::Pose;

use crate::error::usage;
use crate::stream::in_python;

static ASARRAY: PyOnceLock<Py<PyAny>> = PyOnceLock::new();
static REQUIRE: PyOnceLock<Py<PyAny>> = PyOnceLock::new();

/// NumPy's view of anything.
pub(crate) fn as_array<'py>(any: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    ASARRAY.import(any.py(), "numpy", "asarray")?.call1((any,))
}

/// In C order, aligned, in the machine's byte order.
pub(crate) fn contiguous<'py>(any: &Bound<'py, PyAny>, dtype: &str) -> PyResult<Bound<'py, PyAny>> {
    REQUIRE.import(any.py(), "numpy", "require")?.call1((any, dtype, ["C", "A"]))
}

/// As Python writes a shape.
pub(crate) fn shown(shape: &[usize]) -> String {
    let parts: Vec<String> = shape.iter().map(ToString::to_string).collect();
    format!("[{}]", parts.join(", "))
}

pub(crate) fn one_line(error: &PyErr) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// `array` in seconds, where it has dates.
fn seconds<'py>(array: Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if !["M", "m", "O"].contains(&kind.as_str()) {
        return Ok(array);
    }
    let made = in_python(array.py(), "_times", "seconds", (&array,))?;
    Ok(if made.is_none() { array } else { made })
}

/// The time `any`, called `name`, s: a number, or a date.
pub(crate) fn time_s(any: &Bound<'_, PyAny>, name: &str) -> PyResult<f64> {
    if let Ok(t_s) = any.extract::<f64>() {
        return Ok(t_s);
    }
    let array = as_array(any).and_then(seconds);
    let found = match array {
        // What is wrong with a date has been said.
        Err(why) if why.is_instance_of::<PyValueError>(any.py()) => return Err(why),
        found => found.and_then(|array| array.call_method0("item")?.extract::<f64>()),
    };
    found.map_err(|_| {
        usage(any.py(), format!("{name} should be a time in seconds, or a datetime; this is {}", shown_type(any)))
    })
}

pub(crate) fn shown_type(any: &Bound<'_, PyAny>) -> String {
    any.get_type().name().map_or_else(|_| "something else".to_owned(), |name| format!("of type {name}"))
}

/// The times in `any`, s.
pub(crate) fn times<'py>(any: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    let py = any.py();
    let wrong =
        |got: &str| usage(py, format!("t should be float64 of shape [frames], in seconds, or datetimes; {got}"));
    let array = as_array(any).map_err(|why| wrong(&format!("this is not an array: {}", one_line(&why))))?;
    let array = seconds(array)?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if shape.len() != 1 || !["f", "i", "u"].contains(&kind.as_str()) {
        return Err(wrong(&format!("this is {} of shape {}", array.getattr("dtype")?.str()?, shown(&shape))));
    }
    let array = contiguous(&array, "float64")?;
    array.cast::<PyArrayDyn<f64>>().map_err(|_| wrong("this is not"))?.try_readonly().map_err(Into::into)
}

/// How many frames the poses in `any` are of, if any is of several.
pub(crate) fn pose_frames(any: &Bound<'_, PyAny>) -> PyResult<Option<usize>> {
    let Ok(dict) = any.cast::<PyDict>() else { return Ok(None) };
    for pose in dict.values() {
        let shape: Vec<usize> = as_array(&pose)?.getattr("shape")?.extract()?;
        if let [frames, _] = shape[..] {
            return Ok(Some(frames));
        }
    }
    Ok(None)
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

/// The float64 numbers in `any`, called `name`, with their shape.
pub(crate) fn doubles(any: &Bound<'_, PyAny>, name: &str) -> PyResult<(Vec<f64>, Vec<usize>)> {
    let py = any.py();
    let wrong = |got: String| usage(py, format!("{name} should be numbers; {got}"));
    let array = as_array(any).map_err(|why| wrong(format!("this is no array: {}", one_line(&why))))?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if !["f", "i", "u"].contains(&kind.as_str()) {
        return Err(wrong(format!("this is {} of shape {}", array.getattr("dtype")?.str()?, shown(&shape))));
    }
    let array = contiguous(&array, "float64")?;
    let array = array.cast::<PyArrayDyn<f64>>().map_err(|_| wrong("this is not".to_owned()))?.try_readonly()?;
    Ok((array.as_slice()?.to_vec(), shape))
}

/// Vectors of three in `any`, called `name`, which should be [rows, 3].
pub(crate) fn vectors(any: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<DVec3>> {
    let (numbers, shape) = doubles(any, name)?;
    if shape.len() != 2 || shape[1] != 3 {
        return Err(usage(any.py(), format!("{name} should have shape [rows, 3]; this has {}", shown(&shape))));
    }
    let (rows, _) = numbers.as_chunks::<3>();
    Ok(rows.iter().map(|row| DVec3::from_array(*row)).collect())
}

/// `values` as a read-only array of `shape`, which owns them.
pub(crate) fn array<T: Element>(py: Python<'_>, values: Vec<T>, shape: &[usize]) -> PyResult<Py<PyAny>> {
    let array = ArrayD::from_shape_vec(IxDyn(shape), values)
        .map_err(|why| usage(py, format!("an array of another size was made: {why}")))?;
    let array = PyArray::from_owned_array(py, array);
    array.call_method1("setflags", (false,))?;
    Ok(array.into_any().unbind())
}

/// An array of structures, whose fields are given by name with their types and values; a vector is a column for each component.
pub(crate) fn structured<'py>(
    py: Python<'py>,
    length: usize,
    fields: &[(&str, &str, usize, Py<PyAny>)],
) -> PyResult<Bound<'py, PyAny>> {
    let list = PyList::empty(py);
    for field in fields {
        list.append((field.0, field.1, field.2, field.3.bind(py)))?;
    }
    in_python(py, "_rows", "rows", (length, list))
}
