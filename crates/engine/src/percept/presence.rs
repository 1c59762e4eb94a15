//! Which quantities a cell holds.
//!
//! Backends write the first 32 outputs, in words of 32 bits; outputs after these are the host's, and are kept apart so that a
//! run without them does not carry them.

use super::{Outputs, Percepts};

/// Bits of the outputs that backends know.
const LOW: u32 = u32::BITS;

impl Outputs {
    /// The bits of the first 32.
    pub(crate) const fn low(self) -> u32 {
        self.bits() as u32
    }

    const fn high(self) -> u32 {
        (self.bits() >> LOW) as u32
    }
}

impl Percepts {
    /// The quantities that a cell holds.
    pub(crate) fn present(&self, cell: usize) -> Outputs {
        let high = self.present_high.get(cell).copied().unwrap_or(0);
        Outputs::from_bits_truncate(u64::from(self.present[cell]) | u64::from(high) << LOW)
    }

    /// Whether a cell holds `output`, which is one quantity.
    pub(super) fn presence_of(&self, output: Outputs) -> impl Fn(usize) -> bool + Copy + '_ {
        // One of the two words has its bit.
        let (words, bit) =
            if output.low() != 0 { (&self.present, output.low()) } else { (&self.present_high, output.high()) };
        move |cell| words.get(cell).is_some_and(|word| word & bit != 0)
    }

    /// Makes `outputs` what a cell holds.
    #[doc(hidden)]
    pub fn set_present(&mut self, cell: usize, outputs: Outputs) {
        self.present[cell] = outputs.low();
        if let Some(high) = self.present_high.get_mut(cell) {
            *high = outputs.high();
        }
    }

    pub(crate) fn add_present(&mut self, cell: usize, outputs: Outputs) {
        self.set_present(cell, self.present(cell) | outputs);
    }

    pub(crate) fn remove_present(&mut self, cell: usize, outputs: Outputs) {
        self.set_present(cell, self.present(cell) - outputs);
    }

    /// Room for `cells` cells: the low bits as they are, as backends write all of them, the others none.
    pub(super) fn reset_presence(&mut self, cells: usize) {
        self.present.resize(cells, 0);
        self.present_high.clear();
        self.present_high.resize(if self.outputs().high() == 0 { 0 } else { cells }, 0);
    }
}
