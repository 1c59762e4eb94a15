//! Answers written past the caches, where they are more than these hold.
//!
//! A core first reads the line that it is going to store to, and waits for it. Past the caches it need not: where memory is
//! larger than they are, a core stored 22 GB/s instead of 6 to 9 (measured on an AVX-512 machine). That takes whole lines, so
//! a block's answers are first put together in the cache; there a column's lie one after the other, as in the percepts.

use super::columns;
use super::simd::{LANES, soon_needed};
use crate::percept::{CellsMut, Percepts, Precision};
use crate::scene::Plan;

/// Bytes of percepts from which on they are written past the caches. What is less may soon be read from there. Tests have
/// less.
const MUCH: usize = if cfg!(test) { 1 << 16 } else { 16 << 20 };
/// Bytes of a block's percepts that a cache has room for beside everything else.
const LITTLE: usize = 256 << 10;

/// Whether answers to `cells` are better written past the caches: they are many, and no stage goes through them again.
pub(super) fn is_worth(plan: &Plan, cells: &mut CellsMut<'_>) -> bool {
    let stages = plan.stages();
    let again = stages.motion || stages.hysteresis || plan.kept_pressures() > 0;
    let bytes = columns::all(cells).iter().map(|column| size_of_val(*column)).sum::<usize>();
    cfg!(target_arch = "x86_64") && !again && bytes >= MUCH && bytes / cells.frames() * LANES <= LITTLE
}

/// A block's answers, on their way.
pub(super) struct Staged(Percepts);

impl Staged {
    pub(super) fn new(plan: &Plan) -> Self {
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

/// Has the lines fetched of which [`copy`] writes only a part.
pub(super) fn announce(cells: &mut CellsMut<'_>) {
    for column in columns::all(cells) {
        if let (Some(first), Some(last)) = (column.first(), column.last()) {
            soon_needed(first);
            soon_needed(last);
        }
    }
}

/// Copies the answers of `staged` to the same columns of `cells`.
#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "there is no safe word for such stores")]
pub(super) fn copy(staged: &mut CellsMut<'_>, cells: &mut CellsMut<'_>) {
    use core::arch::x86_64::{__m128i, _mm_loadu_si128, _mm_sfence, _mm_stream_si128};
    #[repr(align(64))]
    struct Line([__m128i; 4]);
    for (from, to) in columns::all(staged).into_iter().zip(columns::all(cells)) {
        // SAFETY: any bits are a line.
        let (head, lines, tail) = unsafe { to.align_to_mut::<Line>() };
        let (from_head, from) = from.split_at(head.len());
        let (from_lines, from_tail) = from.split_at(from.len() - tail.len());
        head.copy_from_slice(from_head);
        tail.copy_from_slice(from_tail);
        for (line, from) in lines.iter_mut().zip(from_lines.as_chunks::<16>().0) {
            for (part, from) in line.0.iter_mut().zip(from.as_chunks::<4>().0) {
                // SAFETY: every processor of this architecture has these instructions, and a line begins where such a
                // store has to. Nobody else has `cells` until the fence below.
                unsafe { _mm_stream_si128(part, _mm_loadu_si128(from.as_ptr().cast::<__m128i>())) };
            }
        }
    }
    // SAFETY: every processor of this architecture has it. From here on all stores are there for whoever looks.
    unsafe { _mm_sfence() };
}

/// As there is no need to.
#[cfg(not(target_arch = "x86_64"))]
pub(super) fn copy(staged: &mut CellsMut<'_>, cells: &mut CellsMut<'_>) {
    for (from, to) in columns::all(staged).into_iter().zip(columns::all(cells)) {
        to.copy_from_slice(from);
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
            copy(&mut from.cells_f32().unwrap(), &mut part);
            assert_eq!(bits(&mut part), bits(&mut from.cells_f32().unwrap()), "{fields} fields");
            for (column, untouched) in untouched.iter().enumerate().filter(|(_, untouched)| !untouched.is_empty()) {
                assert_eq!(bits(&mut earlier)[column], untouched[..before * fields]);
                assert_eq!(bits(&mut later)[column], untouched[(before + frames) * fields..]);
            }
        }
    }
}
