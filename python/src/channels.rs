//! Channels: whose value each number of a frame is.

use std::collections::HashMap;

use pyo3::prelude::*;
use somatic::internal::error::suggestion;
use somatic::internal::signal::{Axis, Channel};

use crate::arrays::shown;
use crate::error::unknown_name;

/// A channel as it is given: by the id of its taxel, or by its name, such as `4.u`.
#[derive(FromPyObject)]
pub(crate) enum GivenChannel {
    Id(u32),
    Name(String),
}

/// The numbers of the channels `given`.
pub(crate) fn numbers_of(py: Python<'_>, given: Vec<GivenChannel>) -> PyResult<Vec<u32>> {
    let number = |channel| match channel {
        GivenChannel::Id(id) => Ok(id),
        GivenChannel::Name(name) => Channel::named(&name).map(|channel| channel.0).ok_or_else(|| {
            unknown_name(
                py,
                format!("taxels: `{name}` is no channel; write a taxel's id, or a name such as 4, 4.u or 4.v"),
            )
        }),
    };
    given.into_iter().map(number).collect()
}

/// The names of the channels `numbers`.
pub(crate) fn names_of(numbers: &[u32]) -> Vec<String> {
    numbers.iter().map(|&number| Channel(number).to_string()).collect()
}

/// The ids of the taxels of the channels `numbers`.
pub(crate) fn taxels_of(numbers: &[u32]) -> Vec<u32> {
    numbers.iter().map(|&number| Channel(number).taxel()).collect()
}

/// How many taxels the channels `numbers` are of.
pub(crate) fn count_of(numbers: &[u32]) -> usize {
    let mut ids = taxels_of(numbers);
    ids.sort_unstable();
    ids.dedup();
    ids.len()
}

/// The channels of a frame's values.
pub(crate) struct Channels {
    numbers: Vec<u32>,
    /// By taxel, which values are its three; only if every value is one of three.
    three: Option<Vec<[usize; 3]>>,
}

impl Channels {
    pub(crate) fn new(numbers: Vec<u32>) -> Self {
        let three = three_of(&numbers);
        Self { numbers, three }
    }

    /// Their numbers, in the order of the values.
    pub(crate) fn numbers(&self) -> &[u32] {
        &self.numbers
    }

    /// How many values a frame has.
    pub(crate) fn width(&self) -> usize {
        self.numbers.len()
    }

    /// By taxel, which values are its three: along the normal, t and n × t; only if every value is one of three.
    pub(crate) fn three(&self) -> Option<&[[usize; 3]]> {
        self.three.as_deref()
    }

    /// Which value each channel's is.
    pub(crate) fn index(&self) -> HashMap<u32, usize> {
        self.numbers.iter().enumerate().map(|(index, number)| (*number, index)).collect()
    }

    /// What the values of `frames` frames should be, or of a single one.
    pub(crate) fn expected(&self, frames: Option<usize>) -> String {
        let named = |names: &[&str], sizes: &[usize]| {
            let (names, sizes) = match frames {
                Some(frames) => (["frames"].iter().chain(names).copied().collect(), [&[frames], sizes].concat()),
                None => (names.to_vec(), sizes.to_vec()),
            };
            format!("[{}] = {}", names.join(", "), shown(&sizes))
        };
        let width = self.width();
        if let Some(three) = self.three() {
            let (arrays, rows) = (named(&["taxels", "3"], &[three.len(), 3]), named(&["channels"], &[width]));
            return format!("values should be float32 of shape {arrays} or {rows}");
        }
        let is_plain = self.numbers.iter().all(|&number| Channel(number).axis() == Axis::Normal);
        format!(
            "values should be float32 of shape {}",
            named(&[if is_plain { "taxels" } else { "channels" }], &[width])
        )
    }

    /// The name that is given, and the nearest ones that there are.
    pub(crate) fn near(&self, given: &str) -> String {
        let names = names_of(&self.numbers);
        let few: Vec<&str> = names.iter().take(5).map(String::as_str).collect();
        match Channel::named(given) {
            Some(_) => format!("the engine's are {}{}", few.join(", "), if names.len() > 5 { ", …" } else { "" }),
            None => suggestion(given, names.iter().map(String::as_str)),
        }
    }
}

/// By taxel the places of its three channels in `numbers`, if every one is of such a taxel.
fn three_of(numbers: &[u32]) -> Option<Vec<[usize; 3]>> {
    if !numbers.iter().any(|&number| Channel(number).axis() != Axis::Normal) {
        return None;
    }
    let index: HashMap<u32, usize> = numbers.iter().enumerate().map(|(index, number)| (*number, index)).collect();
    let own = numbers.iter().filter(|&&number| Channel(number).axis() == Axis::Normal);
    let of_taxel = |&number: &u32| {
        let place = |axis| index.get(&Channel::of_taxel(number, axis).0).copied();
        Some([place(Axis::Normal)?, place(Axis::U)?, place(Axis::V)?])
    };
    let three: Vec<[usize; 3]> = own.map(of_taxel).collect::<Option<_>>()?;
    (3 * three.len() == numbers.len()).then_some(three)
}
