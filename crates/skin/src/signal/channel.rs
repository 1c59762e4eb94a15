//! Channels: the values of a frame by name. Most taxels have one, whose name is the taxel's id; a taxel with three axes has
//! two more, `4.u` and `4.v`.

use std::collections::HashMap;
use std::fmt;

use crate::body::{Body, Modality};

/// Which value of a taxel a channel is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Axis {
    /// What the taxel measures, of one with three axes the force along the normal.
    Normal,
    /// The force along its tangent t.
    U,
    /// The force along n × t.
    V,
}

/// The number of a channel: the id of its taxel, which is at most [`crate::body::MAX_TAXEL_ID`], and its axis in the bits above.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Channel(pub u32);

/// The first bit above every taxel id.
const AXIS_SHIFT: u32 = 25;

impl Channel {
    /// The channel of `taxel` along `axis`.
    #[must_use]
    pub fn of_taxel(taxel: u32, axis: Axis) -> Self {
        Self(taxel | (axis as u32) << AXIS_SHIFT)
    }

    /// The id of its taxel.
    #[must_use]
    pub fn taxel(self) -> u32 {
        self.0 & ((1 << AXIS_SHIFT) - 1)
    }

    /// Its axis.
    #[must_use]
    pub fn axis(self) -> Axis {
        match self.0 >> AXIS_SHIFT {
            0 => Axis::Normal,
            1 => Axis::U,
            _ => Axis::V,
        }
    }

    /// The channel called `name`, if that is a name of one: `4`, `4.u` or `4.v`.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let (taxel, axis) = match name.rsplit_once('.') {
            Some((taxel, "u")) => (taxel, Axis::U),
            Some((taxel, "v")) => (taxel, Axis::V),
            _ => (name, Axis::Normal),
        };
        let taxel = taxel.parse().ok().filter(|&id: &u32| id < 1 << AXIS_SHIFT)?;
        Some(Self::of_taxel(taxel, axis))
    }

    /// The channels that `first` and `last` are the names of, and all between them: `4` and `9` are 4 to 9, `4.u` and `9.u` are the same
    /// along t. `None` where a name is none, or they are of different axes, or the last is before the first.
    #[must_use]
    pub fn run(first: &str, last: &str) -> Option<std::ops::RangeInclusive<u32>> {
        let (first, last) = (Self::named(first)?, Self::named(last)?);
        (first.axis() == last.axis() && first <= last).then_some(first.0..=last.0)
    }

    /// Puts `channels` side by side: by taxel, and of each taxel its own, then `u`, then `v`.
    pub fn side_by_side(channels: &mut [u32]) {
        channels.sort_unstable_by_key(|&channel| (Self(channel).taxel(), Self(channel).axis()));
    }

    /// The taxels that `channels` are of, each once, in the order in which they first come; and whether any channel is tangential.
    #[must_use]
    pub fn taxels_of(channels: &[u32]) -> Vec<(u32, bool)> {
        let mut place_of: HashMap<u32, usize> = HashMap::with_capacity(channels.len());
        let mut taxels: Vec<(u32, bool)> = Vec::with_capacity(channels.len());
        for channel in channels.iter().map(|&channel| Self(channel)) {
            let place = *place_of.entry(channel.taxel()).or_insert_with(|| {
                taxels.push((channel.taxel(), false));
                taxels.len() - 1
            });
            taxels[place].1 |= channel.axis() != Axis::Normal;
        }
        taxels
    }

    /// The channels of `body`, ascending: every taxel's own, then the tangential ones.
    #[must_use]
    pub fn all_of(body: &Body) -> Vec<u32> {
        let tangential = |axis| {
            let with_axes = body.taxels.iter().filter(|taxel| taxel.modality == Modality::Force3);
            with_axes.map(move |taxel| Self::of_taxel(taxel.id, axis).0)
        };
        let own = body.taxels.iter().map(|taxel| taxel.id);
        own.chain(tangential(Axis::U)).chain(tangential(Axis::V)).collect()
    }
}

/// Its name: `4`, `4.u` or `4.v`.
impl fmt::Display for Channel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axis = match self.axis() {
            Axis::Normal => "",
            Axis::U => ".u",
            Axis::V => ".v",
        };
        write!(f, "{}{axis}", self.taxel())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::MAX_TAXEL_ID;

    #[test]
    fn a_channel_is_what_its_name_says_and_follows_all_ids() {
        for (name, taxel, axis) in [("4", 4, Axis::Normal), ("4.u", 4, Axis::U), ("16777216.v", MAX_TAXEL_ID, Axis::V)]
        {
            let channel = Channel::named(name).unwrap();
            assert_eq!((channel.taxel(), channel.axis(), channel.to_string().as_str()), (taxel, axis, name));
        }
        let [own, u, v] = [Axis::Normal, Axis::U, Axis::V].map(|axis| Channel::of_taxel(MAX_TAXEL_ID, axis));
        assert!(own < Channel::of_taxel(0, Axis::U) && u < Channel::of_taxel(0, Axis::V) && u < v);
        for name in ["", "u", ".u", "4.w", "4.u.v", "x.u", "33554432", "33554436.u", "-1"] {
            assert_eq!(Channel::named(name), None, "{name}");
        }
        let run = |first, last| {
            Channel::run(first, last).map(|run| run.map(|id| Channel(id).to_string()).collect::<Vec<_>>())
        };
        assert_eq!(run("4", "6").unwrap(), ["4", "5", "6"]);
        assert_eq!(run("4.v", "5.v").unwrap(), ["4.v", "5.v"]);
        assert!(run("4", "5.u").is_none() && run("5.u", "4.u").is_none() && run("x", "5").is_none());
        let mut all: Vec<u32> = ["7.v", "4", "7.u", "9", "7"].map(|name| Channel::named(name).unwrap().0).to_vec();
        Channel::side_by_side(&mut all);
        assert_eq!(all.iter().map(|&id| Channel(id).to_string()).collect::<Vec<_>>(), ["4", "7", "7.u", "7.v", "9"]);
        all.reverse();
        assert_eq!(Channel::taxels_of(&all), [(9, false), (7, true), (4, false)]);
    }
}
