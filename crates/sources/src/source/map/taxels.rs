//! Which channels the values of a message or a line are of.

use super::array_map::{ArrayMap, Pad};
use super::axes::{Axes, with_axes};
use crate::error::{Result, failed};
use crate::signal::{Channel, RawValue};

/// The channels of values in their order.
#[derive(Clone, Debug, Default)]
pub(in crate::source) struct MappedTaxels {
    pub(in crate::source) channels: Vec<u32>,
    /// The places of values that point the other way.
    pub(in crate::source) turned: Vec<usize>,
}

impl MappedTaxels {
    /// Of `count` values by `map`. The taxels are those of the map, else `named`, else those of a `body` with these channels, else they
    /// count from 0.
    ///
    /// # Errors
    /// There are more or fewer values than taxels.
    pub(in crate::source) fn new(
        map: Option<&ArrayMap>,
        named: Option<&[u32]>,
        count: usize,
        body: Option<&[u32]>,
    ) -> Result<Self> {
        let axes = map.and_then(|map| map.axes);
        let wanted = if axes.is_some() { Axes::taxels(count)? } else { count };
        let things = if axes.is_some() { "taxels with three axes" } else { "values" };
        let ids = match (map.and_then(|map| map.ids.as_deref()).or(named), body) {
            (Some(ids), _) if ids.len() != wanted => {
                return Err(failed!("ids names {} taxels, and a message has {wanted} {things}", ids.len()));
            }
            (Some(ids), _) => ids.to_vec(),
            (None, Some(body)) => {
                let ids = if axes.is_some() { with_axes(body) } else { side_by_side(body) };
                if ids.len() != wanted {
                    let of_body = if axes.is_some() { "taxels with three axes" } else { "taxels" };
                    return Err(failed!("a message has {wanted} {things}, and the body {} {of_body}", ids.len()));
                }
                ids
            }
            (None, None) => (0..u32::try_from(wanted).unwrap_or(u32::MAX)).collect(),
        };
        let (Some(axes), Some(map)) = (axes, map) else { return Ok(Self { channels: ids, turned: Vec::new() }) };
        let sizes: Vec<usize> = map.pads.iter().map(Pad::cells).collect();
        let signed = axes.channels(&ids, map.values.len(), &sizes)?;
        let turned = (0..signed.len()).filter(|&index| signed[index].1 < 0.0).collect();
        Ok(Self { channels: signed.into_iter().map(|(channel, _)| channel).collect(), turned })
    }
}

/// Makes `value` that of the opposite direction.
pub(in crate::source) fn turn(value: &mut RawValue) {
    if let Some(number) = value.number() {
        *value = RawValue::new(-number);
    }
}

/// `channels` by taxel, and of each taxel its own, then `u`, then `v`.
fn side_by_side(channels: &[u32]) -> Vec<u32> {
    let mut channels = channels.to_vec();
    Channel::side_by_side(&mut channels);
    channels
}
