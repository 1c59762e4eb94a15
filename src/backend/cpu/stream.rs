//! Answers written past the caches, where they are more than these hold.
//!
//! A core first reads the line that it is going to store to, and waits for it. Past the caches it need not: where memory is
//! larger than they are, a core stored 22 GB/s instead of 6 to 9 (measured on an AVX-512 machine). That takes whole lines, so
//! a block's answers are first put together in the cache; there a column's lie one after the other, as in the percepts.

use super::columns;
use super::simd::{LANES, Row, soon_needed};
use crate::percept::{CellsMut, Percepts, Precision};
use crate::scene::Plan;
use crate::signal::RawValue;

/// Bytes of percepts from which on they are written past the caches; of percepts and raw values together, twice as many. What
/// is less may soon be read from there. Tests have less.
const MUCH: usize = if cfg!(test) { 1 << 16 } else { 16 << 20 };
/// Bytes of a block's percepts that a cache has room for beside everything else.
const LITTLE: usize = 256 << 10;

/// Whether answers to `cells` are better written past the caches: they, or the values that they are made of, are more than
/// caches keep, and no stage goes through them again.
pub(super) fn is_worth(plan: &Plan, cells: &mut CellsMut<'_>) -> bool {
    let stages = plan.stages();
    let again = stages.motion || stages.hysteresis || plan.kept_pressures() > 0;
    let bytes = columns::all(cells).iter().map(|column| size_of_val(*column)).sum::<usize>();
    let values = cells.frames() * plan.channels() * size_of::<RawValue>();
    let is_much = bytes >= MUCH || bytes + values >= 2 * MUCH;
    cfg!(target_arch = "x86_64") && !again && is_much && bytes / cells.frames() * LANES <= LITTLE
}

/// A block's answers, put together.
pub(super) struct Staged(Percepts);

impl Staged {
    /// For one block that is computed, and for the one before it, which is on its way.
    pub(super) fn pair(plan: &Plan) -> [Self; 2] {
        std::array::from_fn(|_| Self::new(plan))
    }

    fn new(plan: &Plan) -> Self {
        let mut percepts = Percepts::new(plan.outputs, plan.fields.len(), Precision::F32).with_columns(plan.columns, 0);
        percepts.reset(LANES);
        Self(percepts)
    }

    /// The first `frames` frames.
    pub(super) fn cells(&mut self, frames: usize) -> CellsMut<'_> {
        let Some(cells) = self.0.cells_f32() else { unreachable!("they were made of this precision") };
        cells.split_at(frames).0
    }
}

/// Has the lines fetched of which [`Outgoing`] writes only a part.
pub(super) fn announce(cells: &mut CellsMut<'_>) {
    for column in columns::all(cells) {
        if let (Some(first), Some(last)) = (column.first(), column.last()) {
            soon_needed(first);
            soon_needed(last);
        }
    }
}

/// A line of memory.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Line([u32; LANES]);

/// A block's answers on their way from where they were put together to the same columns of percepts, a few lines at a time
/// while the next block is computed: memory takes a line in the time of some ten others' work, and a core waits where it
/// has to take many.
#[derive(Default)]
pub(super) struct Outgoing<'a> {
    /// By column, what is still to be written, and where.
    columns: [(&'a [Row<u32>], &'a mut [Line]); 12],
    column: usize,
    at_a_time: usize,
}

impl<'a> Outgoing<'a> {
    /// Those of `staged`, for the same columns of `cells`, in so many `steps`.
    pub(super) fn new(staged: &'a mut CellsMut<'_>, cells: &'a mut CellsMut<'_>, steps: usize) -> Self {
        let mut lines = 0;
        let mut from = columns::all(staged).into_iter();
        let columns = columns::all(cells).map(|to| {
            let from: &[u32] = from.next().unwrap_or_default();
            let (head, middle, tail) = in_lines(to);
            head.copy_from_slice(&from[..head.len()]);
            tail.copy_from_slice(&from[from.len() - tail.len()..]);
            lines += middle.len();
            (from[head.len()..].as_chunks().0, middle)
        });
        // A step never goes on with the next column.
        let steps = steps.saturating_sub(columns.len()).max(1);
        Self { columns, column: 0, at_a_time: lines.div_ceil(steps) }
    }

    /// Writes the next few lines.
    #[inline(always)]
    pub(super) fn step(&mut self) {
        let Some((from, to)) = self.columns.get_mut(self.column) else { return };
        let count = self.at_a_time.min(to.len());
        let (now, later) = std::mem::take(to).split_at_mut(count);
        let (now_from, later_from) = from.split_at(count);
        now.iter_mut().zip(now_from).for_each(|(line, from)| write_past(line, from));
        (*from, *to) = (later_from, later);
        self.column += usize::from(to.is_empty());
    }

    /// Writes all that is left.
    pub(super) fn finish(mut self) {
        self.at_a_time = usize::MAX;
        while self.column < self.columns.len() {
            self.step();
        }
        done();
    }
}

/// `column` without the lines that it has a part of: what comes before them, they, and what comes after.
#[expect(unsafe_code, reason = "there is no safe word for whole lines of something smaller")]
fn in_lines(column: &mut [u32]) -> (&mut [u32], &mut [Line], &mut [u32]) {
    // SAFETY: any bits are a line.
    unsafe { column.align_to_mut() }
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
#[expect(unsafe_code, reason = "there is no safe word for such stores")]
fn write_past(line: &mut Line, from: &Row<u32>) {
    use core::arch::x86_64::{__m128i, _mm_loadu_si128, _mm_stream_si128};
    for (part, from) in line.0.as_chunks_mut::<4>().0.iter_mut().zip(from.as_chunks::<4>().0) {
        // SAFETY: every processor of this architecture has these instructions, and a quarter of a line begins where such a
        // store has to. Nobody else has the line until `done`.
        unsafe { _mm_stream_si128(part.as_mut_ptr().cast::<__m128i>(), _mm_loadu_si128(from.as_ptr().cast())) };
    }
}

/// As there is no need to.
#[cfg(not(target_arch = "x86_64"))]
fn write_past(line: &mut Line, from: &Row<u32>) {
    line.0 = *from;
}

/// From here on all lines are there for whoever looks.
#[cfg_attr(target_arch = "x86_64", expect(unsafe_code, reason = "there is no safe word for it"))]
fn done() {
    #[cfg(target_arch = "x86_64")]
    // SAFETY: every processor of this architecture has it.
    unsafe {
        core::arch::x86_64::_mm_sfence();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::percept::Outputs;

    #[test]
    fn all_is_copied_wherever_lines_begin() {
        let cells = |fields: usize, frames: usize, first: u32| {
            let mut percepts = Percepts::new(Outputs::USUAL, fields, Precision::F32);
            percepts.reset(frames);
            let mut bits = first..;
            for column in columns::all(&mut percepts.cells_f32().unwrap()) {
                column.fill_with(|| bits.next().unwrap());
            }
            percepts
        };
        let bits = |cells: &mut CellsMut<'_>| columns::all(cells).map(|column| column.to_vec());
        for (fields, frames, before) in (1..40).flat_map(|fields| [(fields, 16, 0), (fields, 3, 1), (fields, 16, 5)]) {
            let mut from = cells(fields, frames, 1);
            let mut to = cells(fields, before + frames + 1, 1_000_000);
            let untouched = bits(&mut to.cells_f32().unwrap());
            let (mut earlier, rest) = to.cells_f32().unwrap().split_at(before);
            let (mut part, mut later) = rest.split_at(frames);
            let mut staged = from.cells_f32().unwrap();
            let mut outgoing = Outgoing::new(&mut staged, &mut part, 30);
            (0..fields).for_each(|_| outgoing.step());
            outgoing.finish();
            assert_eq!(bits(&mut part), bits(&mut from.cells_f32().unwrap()), "{fields} fields");
            for (column, untouched) in untouched.iter().enumerate().filter(|(_, untouched)| !untouched.is_empty()) {
                assert_eq!(bits(&mut earlier)[column], untouched[..before * fields]);
                assert_eq!(bits(&mut later)[column], untouched[(before + frames) * fields..]);
            }
        }
    }
}
