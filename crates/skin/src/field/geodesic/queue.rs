//! The priority queue of a search: the nearest first.

use std::cmp::Ordering;

/// An entry of the queue; small, as a queue of windows themselves is slow.
pub(super) struct QueueEntry {
    pub(super) distance_m: f64,
    /// Sequence number, which makes the order total.
    pub(super) turn: u32,
    /// Index of a window; or with [`VERTEX_FLAG`] set, of a vertex.
    pub(super) what: u32,
}

/// Flag of an entry for a vertex.
pub(super) const VERTEX_FLAG: u32 = 1 << 31;

impl Ord for QueueEntry {
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance_m.total_cmp(&self.distance_m).then(other.turn.cmp(&self.turn))
    }
}

impl PartialOrd for QueueEntry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for QueueEntry {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for QueueEntry {}
