//! The values of frames: arrays, read where they are if that is possible, and dicts by taxel.

use numpy::{PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyDictMethods, PyList, PyTuple};
use somatic::RawValue;
use somatic::internal::signal::{Axis, Channel};

use crate::arrays::{as_array, contiguous, one_line, shown, shown_type};
use crate::channels::Channels;
use crate::error::{unknown_name, usage};

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

/// The values in `any` of `frames` frames, or of a single one without that axis: `[frames, channels]`, `[frames, taxels, 3]` if all taxels
/// have three axes, or dicts; `mask` says which are missing.
pub(crate) fn values<'py>(
    any: &Bound<'py, PyAny>,
    mask: Option<&Bound<'py, PyAny>>,
    frames: Option<usize>,
    channels: &Channels,
) -> PyResult<Values<'py>> {
    let py = any.py();
    let leading: Vec<usize> = frames.into_iter().collect();
    let flat = [&leading[..], &[channels.width()]].concat();
    if mask.is_none()
        && let Ok(array) = any.cast::<PyArrayDyn<f32>>()
        && array.shape() == flat
        && array.is_c_contiguous()
        && array.is_aligned()
    {
        return Ok(Values::Borrowed(array.try_readonly()?));
    }
    if let Some(frames) = by_id(any, frames) {
        if mask.is_some() {
            return Err(usage(py, "frames that are dicts leave out what is missing; give no mask"));
        }
        return of_dicts(py, &frames, channels).map(Values::Owned);
    }
    let expected = || channels.expected(frames);
    let array =
        as_array(any).map_err(|why| usage(py, format!("{}; this is not an array: {}", expected(), one_line(&why))))?;
    let got: Vec<usize> = array.getattr("shape")?.extract()?;
    let three = channels.three().filter(|three| got == [&leading[..], &[three.len(), 3]].concat());
    if got != flat && three.is_none() {
        return Err(usage(py, format!("{}; this has shape {}", expected(), shown(&got))));
    }
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    if !["f", "i", "u"].contains(&kind.as_str()) {
        let dtype = array.getattr("dtype")?.str()?;
        return Err(usage(py, format!("{}; this is of type {dtype}, which is not a number", expected())));
    }
    let order = if three.is_none() { order_of(any, frames.is_some(), channels)? } else { None };
    let mut values = converted(&array, &kind)?;
    if let Some(mask) = mask {
        let missing = missing(mask, &leading, &got)?;
        // What is of a whole taxel is of its three values.
        let values_of_one = if missing.is_of_taxels { 3 } else { 1 };
        for (value, is_missing) in values.chunks_mut(values_of_one).zip(missing.mask.iter().cycle()) {
            if *is_missing {
                value.fill(RawValue::MISSING);
            }
        }
    }
    Ok(Values::Owned(match (three, order) {
        (Some(three), _) => side_by_side(&values, three),
        (None, Some(order)) => in_order(&values, &order),
        (None, None) => values,
    }))
}

/// Which channel each column of a table such as pandas' is of, or each entry of a `Series`: None where they are in order, or have no names
/// of channels.
///
/// # Errors
/// They are named as channels, and others than the engine's.
fn order_of(any: &Bound<'_, PyAny>, is_table: bool, channels: &Channels) -> PyResult<Option<Vec<usize>>> {
    let names = any.getattr(if is_table { "columns" } else { "index" }).and_then(|names| names.try_iter());
    let Ok(names) = names else { return Ok(None) };
    let names = names.map(|name| name.ok()?.extract::<String>().ok());
    let Some(names) = names.collect::<Option<Vec<String>>>() else { return Ok(None) };
    let Some(numbers) = names.iter().map(|name| Channel::named(name)).collect::<Option<Vec<Channel>>>() else {
        return Ok(None);
    };
    let index = channels.index();
    let mut is_there = vec![false; channels.width()];
    let mut order = Vec::with_capacity(numbers.len());
    for (name, channel) in names.iter().zip(numbers) {
        match index.get(&channel.0).copied() {
            Some(place) if !std::mem::replace(&mut is_there[place], true) => order.push(place),
            Some(_) => return Err(unknown_name(any.py(), format!("values: channel `{name}` is there twice"))),
            None => {
                let what = format!("values have a column of channel `{name}`; {}", channels.near(name));
                return Err(unknown_name(any.py(), what));
            }
        }
    }
    Ok(order.iter().enumerate().any(|(at, place)| at != *place).then_some(order))
}

/// Rows of `values` by `order`, the place of each.
fn in_order(values: &[RawValue], order: &[usize]) -> Vec<RawValue> {
    let mut made = vec![RawValue::MISSING; values.len()];
    for (to, from) in made.chunks_exact_mut(order.len()).zip(values.chunks_exact(order.len())) {
        order.iter().zip(from).for_each(|(&place, &value)| to[place] = value);
    }
    made
}

/// The numbers of `array`, whose kind is `kind`, as raw values.
fn converted(array: &Bound<'_, PyAny>, kind: &str) -> PyResult<Vec<RawValue>> {
    let wrong = || usage(array.py(), "values should be an array of numbers");
    let size: usize = array.getattr("dtype")?.getattr("itemsize")?.extract()?;
    if kind == "f" && size <= 4 {
        let array = contiguous(array, "float32")?;
        let array = array.cast::<PyArrayDyn<f32>>().map_err(|_| wrong())?.try_readonly()?;
        return Ok(bytemuck::cast_slice(array.as_slice()?).to_vec());
    }
    let array = contiguous(array, "float64")?;
    let array = array.cast::<PyArrayDyn<f64>>().map_err(|_| wrong())?.try_readonly()?;
    Ok(array.as_slice()?.iter().map(|&value| RawValue::new(value)).collect())
}

/// Values [frames, taxels, 3] in the order of channels.
fn side_by_side(values: &[RawValue], three: &[[usize; 3]]) -> Vec<RawValue> {
    let mut made = vec![RawValue::MISSING; values.len()];
    let width = 3 * three.len();
    for (to, from) in made.chunks_exact_mut(width).zip(values.chunks_exact(width)) {
        for (places, own) in three.iter().zip(from.as_chunks::<3>().0) {
            places.iter().zip(own).for_each(|(&place, &value)| to[place] = value);
        }
    }
    made
}

/// What a mask says is missing, which is the same for each frame if it has no frames.
struct Missing {
    mask: Vec<bool>,
    /// Whether it is of taxels whose values have three axes.
    is_of_taxels: bool,
}

/// What `mask` says of values of shape `shape`, whose first axes are `leading`.
fn missing(mask: &Bound<'_, PyAny>, leading: &[usize], shape: &[usize]) -> PyResult<Missing> {
    let py = mask.py();
    let mask = as_array(mask)?;
    let got: Vec<usize> = mask.getattr("shape")?.extract()?;
    let kind: String = mask.getattr("dtype")?.getattr("kind")?.extract()?;
    let has_axes = shape.len() == leading.len() + 2;
    let taxels = &shape[leading.len()..=leading.len()];
    let of_taxels = got == [leading, taxels].concat() || got == taxels;
    if kind != "b" || !(of_taxels || got == shape) {
        let names = ["frames", "taxels", "3"];
        let names = &names[1 - leading.len()..2 + usize::from(has_axes)];
        let what = format!(
            "mask should be bool of shape [{}] = {}, True where a value is missing; this is {} of shape {}",
            names.join(", "),
            shown(shape),
            mask.getattr("dtype")?.str()?,
            shown(&got)
        );
        return Err(usage(py, what));
    }
    let mask = contiguous(&mask, "bool")?;
    let mask = mask.cast::<PyArrayDyn<bool>>().map_err(|_| usage(py, "mask should be bool"))?.try_readonly()?;
    Ok(Missing { mask: mask.as_slice()?.to_vec(), is_of_taxels: has_axes && got != shape })
}

/// The frames in `any` if they are dicts of the taxels that have a value: `frames`, or a single one.
fn by_id<'py>(any: &Bound<'py, PyAny>, frames: Option<usize>) -> Option<Vec<Bound<'py, PyDict>>> {
    let Some(count) = frames else {
        return any.cast::<PyDict>().ok().map(|frame| vec![frame.clone()]);
    };
    let frames: Vec<Bound<'py, PyDict>> = if let Ok(list) = any.cast::<PyList>() {
        list.iter().map(|frame| frame.cast_into().ok()).collect::<Option<_>>()?
    } else {
        any.cast::<PyTuple>().ok()?.iter().map(|frame| frame.cast_into().ok()).collect::<Option<_>>()?
    };
    (frames.len() == count && !frames.is_empty()).then_some(frames)
}

/// The values of `frames`, which are by taxel or by channel. What a frame does not have, or None, is missing.
fn of_dicts(py: Python<'_>, frames: &[Bound<'_, PyDict>], channels: &Channels) -> PyResult<Vec<RawValue>> {
    let (index, width) = (channels.index(), channels.width());
    let mut values = vec![RawValue::MISSING; frames.len() * width];
    let mut seen_in = vec![usize::MAX; width];
    for (number, frame) in frames.iter().enumerate() {
        let row = &mut values[number * width..][..width];
        for (key, value) in frame.iter() {
            let known = match key.extract::<u32>() {
                Ok(id) => Some(id),
                Err(_) => key.extract::<String>().ok().and_then(|name| Channel::named(&name)).map(|channel| channel.0),
            };
            let Some(channel) = known.filter(|channel| index.contains_key(channel)) else {
                let near = channels.near(&key.str()?.to_string());
                return Err(unknown_name(py, format!("frame {number} has a value of taxel {}; {near}", key.repr()?)));
            };
            let mut put = |channel: u32, value: RawValue| match index.get(&channel) {
                Some(&place) if std::mem::replace(&mut seen_in[place], number) == number => {
                    Err(usage(py, format!("frame {number}: taxel {} is there twice", Channel(channel))))
                }
                Some(&place) => {
                    row[place] = value;
                    Ok(())
                }
                None => Err(usage(
                    py,
                    format!(
                        "frame {number}: taxel {key} has one value, and three are given; its modality is not force3"
                    ),
                )),
            };
            match given(&value) {
                Some(Given::One(one)) => put(channel, one)?,
                Some(Given::Three(three)) if Channel(channel).axis() == Axis::Normal => {
                    for (axis, one) in [Axis::U, Axis::V, Axis::Normal].into_iter().zip([three[1], three[2], three[0]])
                    {
                        put(Channel::of_taxel(channel, axis).0, one)?;
                    }
                }
                _ => {
                    let what = format!(
                        "frame {number}: taxel {key} should have a number, or None if it is missing, or three if it has three axes; \
                         this is {}",
                        shown_type(&value)
                    );
                    return Err(usage(py, what));
                }
            }
        }
    }
    Ok(values)
}

/// What a dict has of a taxel.
enum Given {
    One(RawValue),
    /// Along the normal, t and n × t.
    Three([RawValue; 3]),
}

/// What `value` is, if it is a number, None, or three of these.
fn given(value: &Bound<'_, PyAny>) -> Option<Given> {
    let one = |value: &Bound<'_, PyAny>| match value.extract::<Option<f64>>() {
        Ok(Some(number)) => Some(RawValue::new(number)),
        Ok(None) => Some(RawValue::MISSING),
        Err(_) => None,
    };
    if let Some(one) = one(value) {
        return Some(Given::One(one));
    }
    let three: Vec<RawValue> = value.try_iter().ok()?.map(|value| one(&value.ok()?)).collect::<Option<_>>()?;
    three.try_into().ok().map(Given::Three)
}
