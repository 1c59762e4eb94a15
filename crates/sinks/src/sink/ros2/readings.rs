//! The pressures of a frame, by the body's taxels.

use crate::body::Body;

/// Which taxel of the body has which pressure.
pub(super) struct Readings {
    /// By taxel, ascending.
    ids: Vec<u32>,
    /// By taxel; those that are missing or rejected have none.
    pressures: Vec<Option<f64>>,
}

impl Readings {
    pub(super) fn new(body: &Body) -> Self {
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        Self { pressures: vec![None; ids.len()], ids }
    }

    /// Takes the pressures of a frame, by taxel id.
    pub(super) fn read(&mut self, pressures: &[(u32, f64)]) {
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
}
