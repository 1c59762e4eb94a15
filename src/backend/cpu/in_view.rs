//! Reading and calibrating sixteen frames' values, and keeping those that the window is on.

use std::ops::Range;

use bytemuck::{cast_ref, cast_slice_mut};
use fearless_simd::Level;
use fearless_simd::prelude::*;

use super::super::Rows;
use super::lines::{Aligned, Lines};
use super::pick::SomeFrames;
use super::simd::{LANES, Row, with_widest};
use super::transpose::transpose;
use super::{Tables, calibrate};
use crate::scene::Plan;

/// Values of up to sixteen frames, as far as the window reaches.
pub(super) struct InView {
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
        let raw = SomeFrames::new(raw, frames.start, frames.len());
        with_widest!(level, simd => calibrate(simd, plan, tables, &raw, frames.len(), tiles, self))
    }
}

/// Reads and calibrates tiles, and turns them so that a taxel's frames stand abreast. Whether any value is anything but a plain number.
#[inline(always)]
fn calibrate<S: Simd>(
    simd: S,
    plan: &Plan,
    tables: &Tables,
    raw: &SomeFrames<'_>,
    frames: usize,
    tiles: Range<usize>,
    in_view: &mut InView,
) -> bool {
    let mut any = false;
    let Aligned(pressures) = &mut Aligned([[0.0; LANES]; LANES]);
    let Aligned(statuses) = &mut Aligned([[0; LANES]; LANES]);
    let Aligned(bits) = &mut Aligned([[0; LANES]; LANES]);
    let InView { pressures: kept_pressures, statuses: kept_statuses, tiles: kept_tiles, any_rests } = in_view;
    for (index, &sort) in tiles.clone().zip(&tables.tiles.sorts[tiles.clone()]) {
        let tile = &tables.tiles.all[index];
        let slot = index * LANES;
        let place = slot & tables.window.mask();
        raw.read(simd, index, plan.calibrated(), bits);
        let bits = &bits[..frames];
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
