//! The gate: what has not changed since the frame before is not computed again.
//!
//! Most of a skin is idle. A tile of sixteen values whose bits are the same is not calibrated, and one whose pressures and
//! statuses come out the same lets no field through: a group of fields all of whose tiles are the same keeps its answers.
//! What comes out has the same bits as without a gate.

use bytemuck::cast_ref;
use fearless_simd::prelude::*;
use fearless_simd::{Level, u32x16};

use super::super::Rows;
use super::super::raw::TILES_A_BLOCK;
use super::calibrate::{self, Calibrated, Tile, Tiles};
use super::lanes::{Aligned, LANES, Lines, Row, with_widest};
use super::read::OneFrame;
use crate::scene::{Cadence, Coverage, Knobs, Plan};

/// A plan of fewer values than this is computed before a gate has looked at it.
const WORTH_IT: usize = 1 << 12;
/// Frames without a gate after two in which it held back less than half.
const PAUSE: u32 = 62;

/// What is known of the last frame that went through it.
#[derive(Clone, Debug)]
pub(super) struct Gate {
    /// By tile.
    bits: Lines<u32>,
    /// By tile, whether calibration said something; and of how many.
    faulty: Vec<bool>,
    faults: usize,
    /// By tile, where its readers begin among all of them, and one beyond the last.
    starts: Vec<u32>,
    /// Units (wide fields, then groups of narrow ones) that read something of a tile.
    readers: Vec<u32>,
    /// By unit, whether it is to be computed.
    stale: Vec<bool>,
    /// Whether the tables and answers stand for `bits`.
    known: bool,
    /// Whether it may step aside.
    always: bool,
    /// Frames to come without it, and how many it has let through nearly whole.
    pause: u32,
    open: u32,
}

impl Gate {
    /// A gate before `units` units, where `reads` says which slots a unit reads; if the plan is to have one.
    pub(super) fn new(plan: &Plan, units: usize, reads: impl Fn(usize) -> Vec<u32>) -> Option<Self> {
        let Knobs { coverage, cadence, .. } = plan.knobs();
        let wanted = match coverage {
            Coverage::All => false,
            Coverage::Auto => plan.slots() >= WORTH_IT || cadence == Cadence::OnChange,
            Coverage::Touched => true,
        };
        // Changes also depend on the time between frames.
        if !wanted || plan.has_changes() {
            return None;
        }
        let tiles = plan.slots().div_ceil(LANES);
        let mut of_tile: Vec<Vec<u32>> = vec![Vec::new(); tiles];
        for unit in 0..units {
            for slot in reads(unit) {
                let readers = &mut of_tile[slot as usize / LANES];
                if readers.last() != Some(&(unit as u32)) {
                    readers.push(unit as u32);
                }
            }
        }
        let mut starts = vec![0];
        starts.extend(of_tile.iter().scan(0, |end, readers| {
            *end += readers.len() as u32;
            Some(*end)
        }));
        Some(Self {
            bits: Lines::new(tiles, 0),
            faulty: vec![false; tiles],
            faults: 0,
            starts,
            readers: of_tile.concat(),
            stale: vec![true; units],
            known: false,
            always: plan.knobs().coverage == Coverage::Touched,
            pause: 0,
            open: 0,
        })
    }

    /// Forgets what it knows: another calibration makes other pressures of the same values.
    pub(super) fn forget(&mut self) {
        self.known = false;
    }

    /// Whether it stands before the next frame.
    pub(super) fn is_due(&mut self) -> bool {
        self.pause = self.pause.saturating_sub(1);
        self.pause == 0
    }

    /// By unit, whether it is to be computed.
    pub(super) fn stale(&self) -> &[bool] {
        &self.stale
    }

    /// Calibrates what has changed; whether any status says anything.
    pub(super) fn pass(
        &mut self,
        level: Level,
        plan: &Plan,
        tiles: &Tiles,
        raw: (Rows<'_>, usize),
        values: &mut Calibrated,
    ) -> bool {
        if !self.known {
            self.faulty.fill(false);
            self.faults = 0;
        }
        self.stale.fill(!self.known);
        with_widest!(level, simd => self.all_tiles(simd, plan, tiles, raw, values));
        self.known = true;
        self.open =
            if 2 * self.stale.iter().filter(|&&stale| stale).count() > self.stale.len() { self.open + 1 } else { 0 };
        if self.open > 1 && !self.always {
            (self.open, self.pause, self.known) = (0, PAUSE, false);
        }
        self.faults > 0
    }

    #[inline(always)]
    fn all_tiles<S: Simd>(
        &mut self,
        simd: S,
        plan: &Plan,
        tiles: &Tiles,
        (raw, frame): (Rows<'_>, usize),
        calibrated: &mut Calibrated,
    ) {
        let mut index = 0;
        while let Some(tile) = tiles.all.get(index) {
            // Many at once, while they are the same.
            if self.known
                && index % TILES_A_BLOCK == 0
                && let Some(values) = raw.straight_block(frame, index / TILES_A_BLOCK)
                && *values == *self.bits[index..index + TILES_A_BLOCK].as_flattened()
            {
                index += TILES_A_BLOCK;
                continue;
            }
            self.tile(simd, plan, (raw, frame), (index, tile), calibrated);
            index += 1;
        }
    }

    #[inline(always)]
    fn tile<S: Simd>(
        &mut self,
        simd: S,
        plan: &Plan,
        (raw, frame): (Rows<'_>, usize),
        (index, tile): (usize, &Tile),
        Calibrated { pressures, statuses }: &mut Calibrated,
    ) {
        let Aligned(bits) = &mut Aligned([0; LANES]);
        let (Aligned(p), Aligned(status)) = (&mut Aligned([0.0; LANES]), &mut Aligned([0; LANES]));
        let last = &mut self.bits[index];
        if self.known && raw.straight(frame, index).is_some_and(|values| same(simd, values, last)) {
            return;
        }
        OneFrame::new(raw, frame, plan.calibrated()).read(simd, index, bits);
        if self.known && same(simd, bits, last) {
            return;
        }
        *last = *bits;
        let faulty = calibrate::tile(simd, plan, tile, index * LANES, bits, p, status);
        // Pressures are never NaN or −0: where they are equal their bits are.
        if self.known && same(simd, cast_ref(p), cast_ref(&pressures[index])) && same(simd, status, &statuses[index]) {
            return;
        }
        (pressures[index], statuses[index]) = (*p, *status);
        self.faults += usize::from(faulty);
        self.faults -= usize::from(std::mem::replace(&mut self.faulty[index], faulty));
        let readers = self.starts[index] as usize..self.starts[index + 1] as usize;
        for &unit in &self.readers[readers] {
            self.stale[unit as usize] = true;
        }
    }
}

#[inline(always)]
fn same<S: Simd>(simd: S, a: &Row<u32>, b: &Row<u32>) -> bool {
    u32x16::from_slice(simd, a).simd_eq(u32x16::from_slice(simd, b)).all_true()
}
