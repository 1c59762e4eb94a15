//! Channels: the values of a frame by name. Most taxels have one, whose name is the taxel's id; a taxel with three axes has
//! two more, `4.u` and `4.v`.

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
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
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
        let taxel = taxel.parse().ok().filter(|&id: &u32| axis == Axis::Normal || id <= crate::body::MAX_TAXEL_ID)?;
        Some(Self::of_taxel(taxel, axis))
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
        for name in ["", "u", ".u", "4.w", "4.u.v", "x.u", "16777217.u", "-1"] {
            assert_eq!(Channel::named(name), None, "{name}");
        }
    }
}
