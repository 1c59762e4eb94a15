//! Rows in memory, each in a cache line of its own: one that lies across two costs a core two steps instead of one.

use std::ops::{Deref, DerefMut};

use super::simd::{LANES, Row};

/// Bytes of a cache line.
const LINE: usize = 64;

/// Something small that begins with a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Aligned<T>(pub(super) T);

/// Rows one after the other, of which the first begins with a cache line.
#[derive(Debug)]
pub(super) struct Lines<T> {
    memory: Vec<T>,
    first: usize,
    rows: usize,
}

impl<T: Copy> Lines<T> {
    /// `rows` rows of `value`s.
    pub(super) fn new(rows: usize, value: T) -> Self {
        let spare = LINE / size_of::<T>();
        let memory = vec![value; rows * LANES + spare];
        let first = memory.as_ptr().align_offset(LINE).min(spare);
        Self { memory, first, rows }
    }

    /// Makes it `rows` rows long; of what is in them only that much is known, that it was there before or is `value`.
    pub(super) fn make(&mut self, rows: usize, value: T) {
        if self.first + rows * LANES > self.memory.len() {
            *self = Self::new(rows, value);
        }
        self.rows = rows;
    }
}

impl<T: Copy> Default for Lines<T> {
    fn default() -> Self {
        Self { memory: Vec::new(), first: 0, rows: 0 }
    }
}

impl<T: Copy> FromIterator<Row<T>> for Lines<T> {
    fn from_iter<I: IntoIterator<Item = Row<T>>>(rows: I) -> Self {
        let rows: Vec<Row<T>> = rows.into_iter().collect();
        let Some(&[value, ..]) = rows.first() else { return Self::default() };
        let mut lines = Self::new(rows.len(), value);
        lines.copy_from_slice(&rows);
        lines
    }
}

impl<T: Copy> Clone for Lines<T> {
    fn clone(&self) -> Self {
        self.iter().copied().collect()
    }
}

impl<T> Deref for Lines<T> {
    type Target = [Row<T>];

    fn deref(&self) -> &[Row<T>] {
        self.memory[self.first..][..self.rows * LANES].as_chunks().0
    }
}

impl<T> DerefMut for Lines<T> {
    fn deref_mut(&mut self) -> &mut [Row<T>] {
        self.memory[self.first..][..self.rows * LANES].as_chunks_mut().0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_begin_with_a_line_wherever_they_are_copied() {
        for rows in 1..40 {
            let mut lines = Lines::new(rows, 0.5_f32);
            lines[rows - 1][3] = 7.0;
            for lines in [lines.clone(), lines] {
                assert_eq!((lines.len(), lines[rows - 1][3], lines[0][0]), (rows, 7.0, 0.5));
                assert_eq!(lines.as_ptr().addr() % LINE, 0);
            }
        }
    }
}
