//! Values over time that viewers plot: every frame's, or the least and the most of neighbouring frames where many are due.

use somatic_engine::percept::{Column, Percepts};

/// What is plotted: one component of an output of a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Series {
    /// The field, as [`Percept::field`](somatic_engine::percept::Percept::field) counts.
    pub field: usize,
    /// The output.
    pub column: &'static Column,
    /// Which of its components.
    pub component: usize,
}

impl Series {
    /// Its value in the batch's frame `frame`; NaN where it is absent.
    #[must_use]
    pub fn value(&self, percepts: &Percepts, frame: usize) -> f32 {
        let value = percepts.value(frame, self.field, self.column);
        value.map_or(f32::NAN, |components| components[self.component] as f32)
    }
}

/// Values that are due, in bounded memory: where there are too many, neighbours become one row with their least and most.
#[derive(Debug, Default)]
pub(super) struct Trail {
    width: usize,
    capacity: usize,
    /// By row, the times of its first and last frame, s.
    t_s: Vec<[f64; 2]>,
    /// By row and series, the least and the most.
    values: Vec<[f32; 2]>,
    /// Whether any row stands for several frames.
    merged: bool,
}

impl Trail {
    /// For `width` series, in at most `capacity` rows, an even number.
    pub(super) fn new(width: usize, capacity: usize) -> Self {
        debug_assert!(capacity >= 2 && capacity.is_multiple_of(2));
        Self {
            width,
            capacity,
            t_s: Vec::with_capacity(if width > 0 { capacity } else { 0 }),
            values: Vec::with_capacity(width * capacity),
            merged: false,
        }
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    pub(super) fn is_empty(&self) -> bool {
        self.t_s.is_empty()
    }

    pub(super) fn clear(&mut self) {
        self.t_s.clear();
        self.values.clear();
        self.merged = false;
    }

    /// Adds a row: times of its first and last frame, and least and most of each series.
    pub(super) fn push(&mut self, t_s: [f64; 2], values: impl Iterator<Item = [f32; 2]>) {
        if self.width == 0 {
            return;
        }
        if self.t_s.len() == self.capacity {
            self.merge_neighbours();
        }
        self.t_s.push(t_s);
        self.values.extend(values.take(self.width));
        debug_assert_eq!(self.values.len(), self.t_s.len() * self.width);
    }

    /// Adds the rows of `other`, of whose series it has those at `columns`.
    pub(super) fn append(&mut self, other: &Self, columns: &[usize]) {
        for (row, t_s) in other.t_s.iter().enumerate() {
            let values = &other.values[row * other.width..][..other.width];
            self.push(*t_s, columns.iter().map(|&column| values[column]));
        }
        self.merged |= other.merged && !other.is_empty();
    }

    fn merge_neighbours(&mut self) {
        let rows = self.t_s.len() / 2;
        for row in 0..rows {
            self.t_s[row] = [self.t_s[2 * row][0], self.t_s[2 * row + 1][1]];
            for column in 0..self.width {
                let [a, b] = [2 * row, 2 * row + 1].map(|row| self.values[row * self.width + column]);
                // What is absent is neither least nor most.
                self.values[row * self.width + column] = [a[0].min(b[0]), a[1].max(b[1])];
            }
        }
        self.t_s.truncate(rows);
        self.values.truncate(rows * self.width);
        self.merged = true;
    }

    /// Number of samples to send: a row that stands for several frames is two, its least and its most.
    pub(super) fn samples(&self) -> usize {
        if self.merged { 2 * self.t_s.len() } else { self.t_s.len() }
    }

    /// The samples' times, s.
    pub(super) fn times_s(&self) -> impl Iterator<Item = f64> + '_ {
        let ends = if self.merged { 2 } else { 1 };
        self.t_s.iter().flat_map(move |t_s| t_s.iter().copied().take(ends))
    }

    /// The samples of the series at `column`.
    pub(super) fn values(&self, column: usize) -> impl Iterator<Item = f32> + '_ {
        let ends = if self.merged { 2 } else { 1 };
        let rows = 0..self.t_s.len();
        rows.flat_map(move |row| self.values[row * self.width + column].into_iter().take(ends))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_values_are_kept_as_they_are() {
        let mut trail = Trail::new(2, 4);
        for t in 0..4_u8 {
            trail.push([t.into(); 2], [t, 10 + t].into_iter().map(|v| [f32::from(v); 2]));
        }
        assert_eq!(trail.samples(), 4);
        assert_eq!(trail.times_s().collect::<Vec<_>>(), [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(trail.values(1).collect::<Vec<_>>(), [10.0, 11.0, 12.0, 13.0]);
    }

    #[test]
    fn no_peak_is_lost_and_memory_does_not_grow() {
        let mut trail = Trail::new(1, 8);
        let capacity = (trail.t_s.capacity(), trail.values.capacity());
        let value = |t: u32| if t == 777 { 99.0 } else { (t % 7) as f32 };
        for t in 0..5000 {
            trail.push([f64::from(t); 2], std::iter::once([if t % 2 == 0 { f32::NAN } else { value(t) }; 2]));
        }
        assert!(trail.samples() <= 16 && trail.samples().is_multiple_of(2));
        assert_eq!((trail.t_s.capacity(), trail.values.capacity()), capacity);
        let values: Vec<f32> = trail.values(0).collect();
        assert_eq!(values.iter().copied().fold(f32::MIN, f32::max), 99.0);
        let times: Vec<f64> = trail.times_s().collect();
        assert!(times.is_sorted() && times[0] == 0.0 && times[times.len() - 1] == 4999.0);
    }

    #[test]
    fn a_trail_is_appended_by_columns() {
        let mut all = Trail::new(3, 4);
        for t in 0..5_u8 {
            all.push([t.into(); 2], (0..3).map(|column| [f32::from(10 * column + t); 2]));
        }
        let mut own = Trail::new(2, 8);
        own.append(&all, &[2, 0]);
        assert_eq!(own.times_s().collect::<Vec<_>>(), [0.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
        assert_eq!(own.values(0).collect::<Vec<_>>(), [20.0, 21.0, 22.0, 23.0, 24.0, 24.0]);
        assert_eq!(own.values(1).collect::<Vec<_>>(), [0.0, 1.0, 2.0, 3.0, 4.0, 4.0]);
        own.clear();
        own.push([9.0; 2], [[1.0; 2]; 2].into_iter());
        assert_eq!(own.samples(), 1);
    }
}
