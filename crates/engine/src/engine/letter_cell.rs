//! What becomes of a cell of a letter that is not made of pressures, and what its members read.

use crate::percept::{Flags, Host, Outputs, Percepts};

/// What came of a cell.
pub(super) struct Made<'a> {
    pub(super) percepts: &'a mut Percepts,
    pub(super) cell: usize,
    pub(super) flags: Flags,
    /// Whether something is there to tell of.
    pub(super) is_there: bool,
}

impl Made<'_> {
    pub(super) fn give(&mut self, output: Outputs, host: Host, components: &[f64]) {
        if self.percepts.outputs().contains(output) {
            self.percepts.add_present(self.cell, output);
            self.percepts.set_host(host, self.cell, components);
        }
    }

    /// Flags the cell with `why` some output is absent, if any of `outputs`, which are absent for that, is asked for.
    pub(super) fn lack(&mut self, outputs: Outputs, why: Flags) {
        if self.percepts.outputs().intersects(outputs) {
            self.flags |= why;
        }
    }
}

/// What members read, in their order.
#[derive(Clone, Debug)]
pub(super) struct Readings<T> {
    /// Those with a value that counts.
    pub(super) members: Vec<usize>,
    pub(super) values: Vec<T>,
    /// Of every member that has a reading, °C or m; infinite where nothing is in range.
    pub(super) by_member: Vec<(usize, f64)>,
}

impl<T> Readings<T> {
    pub(super) fn none() -> Self {
        Self { members: Vec::new(), values: Vec::new(), by_member: Vec::new() }
    }
}
