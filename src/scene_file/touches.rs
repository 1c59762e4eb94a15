//! What a scene asks of touches of the whole body.

#[cfg(feature = "cli")]
use schemars::JsonSchema;
use serde::Deserialize;

use crate::error::{Error, Result};
use crate::percept::TouchOutputs;
use crate::touch;

/// When touches of the whole body begin and end.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(feature = "cli", derive(JsonSchema))]
#[non_exhaustive]
pub struct TouchKeys {
    /// A touch begins when its total is over this, in the unit of P.
    pub on: f64,
    /// A touch ends when its total is this or less, in the unit of P.
    pub off: f64,
}

impl TouchKeys {
    /// The options of touches, with `outputs`.
    pub(super) fn options(self, outputs: TouchOutputs) -> touch::Options {
        touch::Options { on: self.on, off: self.off, outputs, ..touch::Options::default() }
    }

    /// Whether they are such thresholds.
    pub(super) fn check(self) -> Result<()> {
        let are_thresholds = [self.on, self.off].iter().all(|p| p.is_finite() && *p >= 0.0) && self.off <= self.on;
        if are_thresholds {
            return Ok(());
        }
        let Self { on, off } = self;
        Err(Error::usage(format!(
            "[touch] has on = {on} and off = {off}: give numbers from 0 on, off no larger than on"
        )))
    }
}
