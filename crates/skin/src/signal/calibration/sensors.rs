//! What sensors cover: the key `sensors`.

use std::str::FromStr;

use crate::error::{Error, Result};

/// How large the sensors are beside their cells, the shares of the skin that are nearest to them. It says how a taxel whose P is a
/// force or a count weighs in the place and axis of a touch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sensors {
    /// They cover their cells, and have added up over them already: each weighs by its P alone.
    Cell,
    /// They are of one size, such as FSR buttons or printed pads, and each stands for its cell: it weighs by P times the cell's area.
    Equal,
}

impl Sensors {
    /// As calibrations spell it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Cell => "cell",
            Self::Equal => "equal",
        }
    }
}

impl FromStr for Sensors {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let known = [Self::Cell, Self::Equal].into_iter().find(|known| known.name() == name);
        known.ok_or_else(|| Error::usage(format!("`{name}` is neither `cell` nor `equal`")))
    }
}
