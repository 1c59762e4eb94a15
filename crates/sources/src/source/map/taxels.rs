//! Which channels the values of a message or a line are of.

use std::collections::BTreeSet;

use super::array_map::{ArrayMap, Pad};
use super::axes::{Axes, Signed, with_axes};
use crate::error::{Result, failed};
use crate::signal::{Channel, RawValue};

/// The channels of values in their order.
#[derive(Clone, Debug, Default)]
pub(in crate::source) struct MappedTaxels {
    pub(in crate::source) channels: Vec<u32>,
    /// The places of values that point the other way.
    turned: Vec<usize>,
    /// The places of the values that count, ascending, where the body lacks the others' taxels.
    kept: Option<Vec<usize>>,
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
        let own_ids = map.and_then(|map| map.ids.as_deref()).or(named);
        if let (Some(axes), None, Some(body)) = (map.and_then(|map| map.skin_axes), own_ids, body)
            && let Some(found) = Self::by_index(&axes, count, body)?
        {
            return Ok(found);
        }
        let axes = map.and_then(|map| map.axes);
        let wanted = if axes.is_some() { Axes::taxels(count)? } else { count };
        let things = if axes.is_some() { "taxels with three axes" } else { "values" };
        let ids = match (own_ids, body) {
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
        let (Some(axes), Some(map)) = (axes, map) else { return Ok(Self { channels: ids, ..Self::default() }) };
        let sizes: Vec<usize> = map.pads.iter().map(Pad::cells).collect();
        let signed = axes.channels(&ids, map.values.len(), &sizes)?;
        Ok(Self::signed(signed))
    }

    fn signed(signed: Vec<Signed>) -> Self {
        let turned = (0..signed.len()).filter(|&index| signed[index].1 < 0.0).collect();
        Self { channels: signed.into_iter().map(|(channel, _)| channel).collect(), turned, kept: None }
    }

    /// Of `count` values whose indices are the ids in `body`, those of their first values where they have three; `None` if they are not.
    fn by_index(axes: &Axes, count: usize, body: &[u32]) -> Result<Option<Self>> {
        let taxels = Channel::taxels_of(body);
        let Some(last) = taxels.iter().map(|&(taxel, _)| taxel).max() else { return Ok(None) };
        let indices = |of: usize| (0..u32::try_from(of).unwrap_or(u32::MAX)).collect::<Vec<u32>>();
        let with_axes = taxels.iter().filter(|&&(_, has_axes)| has_axes).count();
        if with_axes == 0 {
            let fits = (last as usize) < count;
            return Ok(fits.then(|| Self { channels: indices(count), ..Self::default() }));
        }
        if with_axes < taxels.len() || !count.is_multiple_of(3) || last as usize >= count / 3 {
            return Err(failed!(
                "a message has {count} values, which are not all of one sensor with three axes whose last taxel is {last}"
            ));
        }
        Ok(Some(Self::signed(axes.channels(&indices(count / 3), 1, &[])?)))
    }

    /// Leaves out the values of taxels that `body` lacks, if it `may_skip` any; says how many, or nothing.
    ///
    /// # Errors
    /// The body lacks taxels, and none may be skipped, or it has none of them, or not their axes. `advice` says what to do.
    pub(in crate::source) fn skip_absent(
        &mut self,
        body: &[u32],
        may_skip: bool,
        advice: &str,
    ) -> Result<Option<String>> {
        let there: BTreeSet<u32> = body.iter().copied().collect();
        let kept: Vec<usize> = (0..self.channels.len()).filter(|&at| there.contains(&self.channels[at])).collect();
        let absent: Vec<u32> = self.channels.iter().copied().filter(|channel| !there.contains(channel)).collect();
        let Some(&first) = absent.first() else { return Ok(None) };
        let taxels: BTreeSet<u32> = Channel::taxels_of(body).into_iter().map(|(taxel, _)| taxel).collect();
        let lacking: BTreeSet<u32> = Channel::taxels_of(&absent).into_iter().map(|(taxel, _)| taxel).collect();
        if !may_skip || kept.is_empty() || lacking.iter().any(|taxel| taxels.contains(taxel)) {
            let first = Channel(first);
            return Err(failed!("the body has no taxel {first}; is it the right body? {advice}"));
        }
        let all = Channel::taxels_of(&self.channels).len();
        self.channels = kept.iter().map(|&at| self.channels[at]).collect();
        self.turned = (0..kept.len()).filter(|&at| self.turned.binary_search(&kept[at]).is_ok()).collect();
        self.kept = Some(kept);
        let shown: Vec<String> = lacking.iter().take(3).map(u32::to_string).collect();
        let more = if lacking.len() > shown.len() { " …" } else { "" };
        Ok(Some(format!(
            "the body lacks {} of {all} taxels, which are skipped: {}{more}",
            lacking.len(),
            shown.join(", ")
        )))
    }

    /// Makes `values` those of its channels.
    pub(in crate::source) fn arrange(&self, values: &mut Vec<RawValue>) {
        if let Some(kept) = &self.kept {
            (0..kept.len()).for_each(|to| values[to] = values[kept[to]]);
            values.truncate(kept.len());
        }
        self.turned.iter().for_each(|&at| turn(&mut values[at]));
    }
}

/// Makes `value` that of the opposite direction.
fn turn(value: &mut RawValue) {
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
