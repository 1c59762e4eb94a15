//! Which taxels drift compensation leaves out.

use super::repeats::Repeats;
use crate::engine::Engine;
use crate::signal::Unfit;

/// The taxels that are left out, as last reported.
#[derive(Default)]
pub(super) struct UnfitReport {
    unfit: Vec<(u32, Unfit)>,
    repeats: Repeats,
    /// The time of the last frame, s.
    pub(super) at_s: f64,
}

impl UnfitReport {
    /// Messages on taxels that are left out from now on, and on those that are used again. Repeated ones are held back.
    pub(super) fn changes(&mut self, engine: &Engine) -> Vec<String> {
        let now: Vec<(u32, Unfit)> = engine.unfit().collect();
        let left_out = now.iter().filter(|taxel| !self.unfit.contains(taxel));
        let left_out = left_out.map(|(id, why)| format!("taxel {id} is {why} and left out"));
        let again = self.unfit.iter().filter(|(id, _)| !now.iter().any(|(other, _)| other == id));
        let again = again.map(|(id, _)| format!("taxel {id} is used again"));
        let Self { repeats, at_s, .. } = self;
        let messages = left_out.chain(again).filter_map(|text| repeats.tell(*at_s, &text)).collect();
        self.unfit = now;
        messages
    }

    /// How often repeated messages were held back, a line each.
    pub(super) fn repeats(&self) -> impl Iterator<Item = String> + '_ {
        self.repeats.rest()
    }
}
