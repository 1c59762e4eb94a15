//! The pressures of a frame, and its tangential forces, by the body's taxels.

use crate::body::{Body, Modality};

/// Which taxel of the body has which pressure.
pub(super) struct Readings {
    /// By taxel, ascending.
    ids: Vec<u32>,
    /// By taxel; those that are missing or rejected have none.
    pressures: Vec<Option<f64>>,
    /// By taxel, if any has three axes: along t and n × t, where it is pressed and both are known.
    pulls: Vec<Option<[f64; 2]>>,
}

impl Readings {
    pub(super) fn new(body: &Body) -> Self {
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let has_pulls = body.taxels.iter().any(|taxel| taxel.modality == Modality::Force3);
        let pulls = vec![None; if has_pulls { ids.len() } else { 0 }];
        Self { pressures: vec![None; ids.len()], pulls, ids }
    }

    /// Takes the pressures and the tangential forces of a frame, by taxel id.
    pub(super) fn read(&mut self, pressures: &[(u32, f64)], pulls: &[(u32, [f64; 2])]) {
        self.pressures.fill(None);
        let mut next = 0;
        for &(id, pressure) in pressures {
            // Most frames have the taxels in the body's order.
            let found = if self.ids.get(next) == Some(&id) { Ok(next) } else { self.ids.binary_search(&id) };
            let Ok(taxel) = found else { continue };
            self.pressures[taxel] = Some(pressure);
            next = taxel + 1;
        }
        self.pulls.fill(None);
        for &(id, pull) in pulls {
            if let Ok(taxel) = self.ids.binary_search(&id) {
                self.pulls[taxel] = Some(pull);
            }
        }
    }

    /// The pressure of taxel `taxel` of the body.
    pub(super) fn pressure(&self, taxel: usize) -> Option<f64> {
        self.pressures[taxel]
    }

    /// The tangential forces of taxel `taxel` of the body.
    pub(super) fn pull(&self, taxel: usize) -> Option<[f64; 2]> {
        self.pulls.get(taxel).copied().flatten()
    }
}
