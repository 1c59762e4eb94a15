//! Reading and calibrating sixteen frames' values, and keeping those that the window is on.

use std::ops::Range;

use bytemuck::{cast_ref, cast_slice_mut};
use fearless_simd::Level;
use fearless_simd::prelude::*;

use super::super::Rows;
use super::ahead::Ahead;
use super::lines::{Aligned, Lines};
use super::pick::{OneFrame, SomeFrames, Values};
use super::simd::{LANES, Row, reads_rows_abreast, with_widest};
use super::transpose::transpose;
use super::{Tables, ahead, calibrate};
use crate::scene::Plan;

/// Tiles whose raw bits are read together where rows are not read abreast: frame by frame, as they lie in memory, so that the
/// processor sees it coming.
const GROUP: usize = 64;
/// Tiles that are read together where nobody has fetched them: the next ones are, meanwhile.
const UNFETCHED: usize = 16;

/// Values of up to sixteen frames, as far as the window reaches.
pub(super) struct InView {
    /// Raw bits of a few tiles, a row a frame.
    bits: Lines<u32>,
    /// By slot, a lane a frame.
    pub(super) pressures: Lines<f32>,
    pub(super) statuses: Lines<u32>,
    pub(super) tiles: Vec<TileInView>,
    /// Whether any tile rests that was read for this block; each block unsets it.
    pub(super) any_rests: bool,
}

/// What is known of sixteen taxels in sixteen frames.
#[derive(Clone, Copy)]
pub(super) struct TileInView {
    /// All pressures and statuses are 0.
    pub(super) rests: bool,
    /// Statuses say something.
    faulty: bool,
}

impl InView {
    /// Of so many slots, which are whole tiles.
    pub(super) fn new(slots: usize) -> Self {
        Self {
            bits: Lines::new(GROUP * LANES, 0),
            pressures: Lines::new(slots, 0.0),
            statuses: Lines::new(slots, 0),
            tiles: vec![TileInView { rests: true, faulty: false }; slots / LANES],
            any_rests: false,
        }
    }

    /// Reads and calibrates some tiles of up to sixteen frames. Whether any value is anything but a plain number.
    pub(super) fn read(
        &mut self,
        level: Level,
        plan: &Plan,
        tables: &Tables,
        raw: Rows<'_>,
        frames: Range<usize>,
        tiles: Range<usize>,
    ) -> bool {
        let groups_of = |count: usize| {
            let tiles = tiles.clone();
            tiles.clone().step_by(count).map(move |start| start..tiles.end.min(start + count))
        };
        let is_fetched = ahead::worth(raw, tiles.clone()).is_some();
        let count = if is_fetched { tiles.len() } else { UNFETCHED };
        if is_fetched
            || ahead::are_near(raw)
            || reads_rows_abreast(level)
            || groups_of(count).any(|group| ahead::worth(raw, group).is_some())
        {
            let (some, mut faults) = (SomeFrames::new(raw, frames.start, frames.len()), false);
            for group in groups_of(count) {
                let next = group.end..tiles.end.min(group.end + count);
                let mut ahead = Ahead::new(raw, frames.clone(), next, group.len());
                faults |= with_widest!(level, simd => calibrate(simd, plan, tables, Some((&some, &mut ahead)), frames.len(), group, self));
            }
            return faults;
        }
        let mut faults = false;
        for group in groups_of(GROUP) {
            for (row, frame) in frames.clone().enumerate() {
                let values = OneFrame::new(raw, frame, plan.calibrated());
                with_widest!(level, simd => {
                    for (tile, bits) in group.clone().zip(self.bits.chunks_mut(LANES)) {
                        values.read(simd, tile, &mut bits[row]);
                    }
                });
            }
            faults |= with_widest!(level, simd => calibrate(simd, plan, tables, None, frames.len(), group, self));
        }
        faults
    }
}

/// Calibrates tiles whose bits are there, or read from `raw` where they are not, while others are fetched; and turns them so
/// that a taxel's frames stand abreast. Whether any value is anything but a plain number.
#[inline(always)]
fn calibrate<S: Simd>(
    simd: S,
    plan: &Plan,
    tables: &Tables,
    mut raw: Option<(&SomeFrames<'_>, &mut Ahead<'_>)>,
    frames: usize,
    tiles: Range<usize>,
    in_view: &mut InView,
) -> bool {
    let mut any = false;
    let Aligned(pressures) = &mut Aligned([[0.0; LANES]; LANES]);
    let Aligned(statuses) = &mut Aligned([[0; LANES]; LANES]);
    let Aligned(bits) = &mut Aligned([[0; LANES]; LANES]);
    let InView { bits: there, pressures: kept_pressures, statuses: kept_statuses, tiles: kept_tiles, any_rests } =
        in_view;
    for (index, &sort) in tiles.clone().zip(&tables.tiles.sorts[tiles.clone()]) {
        let tile = &tables.tiles.all[index];
        let slot = index * LANES;
        let place = slot & tables.window.mask();
        let bits = match &mut raw {
            Some((raw, ahead)) => {
                ahead.step();
                raw.read(simd, index, plan.calibrated(), bits);
                &bits[..frames]
            }
            None => &there[(index - tiles.start) * LANES..][..frames],
        };
        let mut faults = false;
        let is_pressed = calibrate::plain(simd, sort, tile, bits, pressures).unwrap_or_else(
            #[inline(always)]
            || {
                for ((bits, pressures), statuses) in bits.iter().zip(&mut *pressures).zip(&mut *statuses) {
                    faults |= calibrate::tile(simd, plan, tile, slot, bits, pressures, statuses);
                }
                faults || pressures[..frames].as_flattened().iter().any(|&pressure| pressure > 0.0)
            },
        );
        let rests = !is_pressed;
        *any_rests |= rests;
        let (abreast, kept) = (&mut kept_pressures[place..place + LANES], &mut kept_tiles[place / LANES]);
        if !rests {
            transpose(simd, |frame| cast_ref(&pressures[frame]), cast_slice_mut::<Row<f32>, Row<u32>>(abreast));
        } else if !kept.rests {
            abreast.fill([0.0; LANES]);
        }
        let abreast = &mut kept_statuses[place..place + LANES];
        if faults {
            transpose(simd, |frame| &statuses[frame], abreast);
        } else if kept.faulty {
            abreast.fill([0; LANES]);
        }
        *kept = TileInView { rests, faulty: faults };
        any |= faults;
    }
    any
}
