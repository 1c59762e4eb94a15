//! Says which taxels upkeep leaves out.

use somatic::Engine;
use somatic::signal::Unfit;

use super::repeats::Repeats;
use super::stdio::say;

/// What was told of taxels that are left out.
#[derive(Default)]
pub(super) struct UnfitReport {
    unfit: Vec<(u32, Unfit)>,
    repeats: Repeats,
    /// The time of the last frame, s.
    pub(super) at_s: f64,
}

impl UnfitReport {
    /// Says which taxels are left out from now on and which are used again, where that differs from what was told.
    pub(super) fn tell(&mut self, engine: &Engine) {
        let now: Vec<(u32, Unfit)> = engine.unfit().collect();
        let left_out = now.iter().filter(|taxel| !self.unfit.contains(taxel));
        let left_out = left_out.map(|(id, why)| format!("taxel {id} is {why} and left out"));
        let again = self.unfit.iter().filter(|(id, _)| !now.iter().any(|(other, _)| other == id));
        let again = again.map(|(id, _)| format!("taxel {id} is used again"));
        for text in left_out.chain(again) {
            if let Some(told) = self.repeats.tell(self.at_s, &text) {
                say(&told);
            }
        }
        self.unfit = now;
    }

    /// Says how often it was told what was told more than once.
    pub(super) fn tell_rest(&self) {
        self.repeats.rest().for_each(|told| say(&told));
    }
}
