//! Scenes: what a user asks for; and the plan made of it.

mod curves;
mod explain;
mod filter;
mod plan;
mod slots;

pub use explain::PlannedStage;
pub use filter::MotionFilter;
pub use plan::{Plan, choose_fields};
pub(crate) use plan::{PlanField, Stages};

use std::str::FromStr;

use crate::error::{Error, Result};
use crate::percept::Outputs;
use crate::signal::Letter;
pub use crate::stage::filter::FilterBy;

/// What a user asks of a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The quantities wanted.
    pub outputs: Outputs,
    /// The fields wanted, as globs over their names (`hand/palm*`, `**/forearm/*`); none means all.
    pub fields: Vec<String>,
    /// How long a channel that is absent from a frame keeps its last value, s. Recordings say 0.
    pub max_age_s: f64,
    /// The longest step between frames over which motion is measured, s.
    pub max_gap_s: f64,
    /// What sensors are read as; every field is computed once for each. Usually one, the pressure itself.
    pub letters: Vec<Letter>,
    /// Which motion counts, for [`Outputs::FILTERED`].
    pub filter: MotionFilter,
    /// Which fields are computed in a frame.
    pub coverage: Coverage,
}

/// Which fields are computed in a live frame; the others keep what they were, and percepts are the same to the last bit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Coverage {
    /// Those that changed, where a gate pays: on large skins that are mostly idle.
    #[default]
    Auto,
    /// All.
    All,
    /// Those that changed, always behind a gate.
    Touched,
}

impl FromStr for Coverage {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        match name {
            "auto" => Ok(Self::Auto),
            "all" => Ok(Self::All),
            "touched" => Ok(Self::Touched),
            _ => Err(Error::usage(format!("there is no coverage `{name}`; choose auto, all or touched"))),
        }
    }
}

impl Default for Scene {
    fn default() -> Self {
        Self {
            outputs: Outputs::USUAL,
            fields: Vec::new(),
            max_age_s: 0.0,
            max_gap_s: 10.0,
            letters: vec![Letter::default()],
            filter: MotionFilter::default(),
            coverage: Coverage::default(),
        }
    }
}
