//! What the taxels of a body read in a frame.

use crate::body::Body;
use crate::scene::SensedValue;
use crate::signal::{Reading, Receptor};

/// Which taxel of the body reads what.
pub(super) struct Readings {
    /// By taxel, ascending.
    ids: Vec<u32>,
    /// By taxel; those that are missing or rejected have none.
    pressures: Vec<Option<f64>>,
    /// Of those that read something else, by ascending taxel.
    sensed: Vec<SensedValue>,
}

impl Readings {
    pub(super) fn new(body: &Body) -> Self {
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        Self { pressures: vec![None; ids.len()], ids, sensed: Vec::new() }
    }

    /// Takes the pressures of a frame, by taxel id, and what is `sensed` beside.
    pub(super) fn read(&mut self, pressures: &[(u32, f64)], sensed: &[SensedValue]) {
        self.sensed.clear();
        self.sensed.extend_from_slice(sensed);
        self.pressures.fill(None);
        let mut next = 0;
        for &(id, pressure) in pressures {
            // Most frames have the taxels in the body's order.
            let found = if self.ids.get(next) == Some(&id) { Ok(next) } else { self.ids.binary_search(&id) };
            let Ok(taxel) = found else { continue };
            self.pressures[taxel] = Some(pressure);
            next = taxel + 1;
        }
    }

    /// The pressure of taxel `taxel` of the body.
    pub(super) fn pressure(&self, taxel: usize) -> Option<f64> {
        self.pressures[taxel]
    }

    /// What taxel `taxel` of the body reads beside.
    pub(super) fn sensed(&self, taxel: usize) -> Option<&SensedValue> {
        self.sensed.binary_search_by_key(&taxel, |value| value.taxel).ok().map(|at| &self.sensed[at])
    }

    /// The tangential forces of taxel `taxel` of the body along t and n × t, where both are known.
    pub(super) fn pull(&self, taxel: usize) -> Option<[f64; 2]> {
        let value = self.sensed(taxel).filter(|value| value.receptor == Receptor::Shear)?;
        matches!(value.reading, Reading::Value(..)).then_some(value.shear)
    }
}
