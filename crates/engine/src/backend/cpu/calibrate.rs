//! calibrate in lanes: sixteen taxels of one frame abreast; see [`crate::stage::calibrate`].

use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

use fearless_simd::prelude::*;
use fearless_simd::{Level, f32x16, i32x16, u32x16};

use super::super::Rows;
use super::lanes::{
    Aligned, F, LANES, Lines, M, Row, U, bits_where, load, load_u, splat, splat_u, store, store_u, width, with_widest,
};
use super::read::OneFrame;
use crate::parallel::{self, Tasks, on_threads};
use crate::percept::Flags;
use crate::scene::Plan;
use crate::stage::calibrate::{HUGE_BITS, SIZE_BITS, TINY_BITS, UNUSABLE};
use crate::stage::layout::{FIRST_CURVE, Knot, MASKED, STRAIGHT, Taxel};

/// Tiles of a frame that are asked together whether all is plain.
const TOGETHER: usize = 16;

/// Sixteen taxels' calibration, quantity by quantity.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Tile {
    baseline: Row<f32>,
    gain: Row<f32>,
    dead_band: Row<f32>,
    p_max: Row<f32>,
    raw_low: Row<f32>,
    raw_high: Row<f32>,
    response: Row<u32>,
    sort: Sort,
}

/// What has to be done for sixteen taxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sort {
    /// P is the raw value of all of them, with nothing to check but that it is a number.
    Raw,
    /// None has a curve or is masked.
    Straight,
    Any,
}

/// All of a plan's taxels, by ascending slot.
#[derive(Clone, Debug)]
pub(super) struct Tiles {
    pub(super) all: Vec<Tile>,
    /// Each one's sort, again: where that is all there is to know, eight lines a tile need not come from memory.
    pub(super) sorts: Vec<Sort>,
}

impl Tiles {
    /// The tiles of `plan`; what fills up the last tile is unpressed.
    pub(super) fn new(plan: &Plan) -> Self {
        let all: Vec<Tile> = plan.taxels[..plan.calibrated()].chunks(LANES).map(Tile::new).collect();
        Self { sorts: all.iter().map(|tile| tile.sort).collect(), all }
    }
}

/// Calibrated values in rows: pressures, and their statuses where any says anything.
#[derive(Clone, Debug, Default)]
pub(super) struct Calibrated {
    pub(super) pressures: Lines<f32>,
    pub(super) statuses: Lines<u32>,
}

impl Calibrated {
    pub(super) fn new(rows: usize) -> Self {
        Self { pressures: Lines::new(rows, 0.0), statuses: Lines::new(rows, 0) }
    }
}

impl Tile {
    fn new(taxels: &[Taxel]) -> Self {
        let sort = if taxels.len() == LANES && taxels.iter().all(Taxel::raw_is_pressure) {
            Sort::Raw
        } else if taxels.iter().all(|taxel| taxel.response == STRAIGHT) {
            Sort::Straight
        } else {
            Sort::Any
        };
        fn row<T: Copy>(taxels: &[Taxel], rest: T, of: impl Fn(&Taxel) -> T) -> Row<T> {
            std::array::from_fn(|lane| taxels.get(lane).map_or(rest, &of))
        }
        Self {
            baseline: row(taxels, 0.0, |taxel| taxel.baseline),
            gain: row(taxels, 0.0, |taxel| taxel.gain),
            dead_band: row(taxels, 0.0, |taxel| taxel.dead_band),
            p_max: row(taxels, f32::MAX, |taxel| taxel.p_max),
            raw_low: row(taxels, f32::MIN, |taxel| taxel.raw_low),
            raw_high: row(taxels, f32::MAX, |taxel| taxel.raw_high),
            response: row(taxels, 0, |taxel| taxel.response),
            sort,
        }
    }
}

/// Raw bits to pressures and statuses; whether any status says anything. `first` is the tile's first slot, which only curves
/// look at.
#[inline(always)]
pub(super) fn tile<S: Simd>(
    simd: S,
    plan: &Plan,
    tile: &Tile,
    first: usize,
    raw: &Row<u32>,
    pressures: &mut Row<f32>,
    statuses: &mut Row<u32>,
) -> bool {
    let mut any = false;
    let mut at = 0;
    while at < LANES {
        let lanes = |row: &Row<f32>| load(simd, row, at);
        let bits = load_u(simd, raw, at);
        if tile.sort == Sort::Raw && fine(simd, bits).all_true() {
            let (value, none) = (bits.bitcast::<F<S>>(), splat(simd, 0.0));
            // Not the larger of the two, which might be −0.
            store(simd, value.simd_gt(none).select(value, none), pressures, at);
            store_u(simd, splat_u(simd, 0), statuses, at);
            at += width::<S>();
            continue;
        }
        let above = bits.bitcast::<F<S>>() - lanes(&tile.baseline);
        let pressure = above * lanes(&tile.gain);
        let plain = fine(simd, bits)
            & fine(simd, pressure.bitcast())
            & bits.bitcast::<F<S>>().simd_ge(lanes(&tile.raw_low))
            & bits.bitcast::<F<S>>().simd_le(lanes(&tile.raw_high))
            & pressure.simd_le(lanes(&tile.p_max));
        if tile.sort != Sort::Any && plain.all_true() {
            let over = pressure.simd_gt(lanes(&tile.dead_band));
            store(simd, over.select(pressure, splat(simd, 0.0)), pressures, at);
            store_u(simd, splat_u(simd, 0), statuses, at);
        } else {
            any |= any_value(simd, plan, tile, first, bits, at, pressures, statuses);
        }
        at += width::<S>();
    }
    any
}

/// Calibrates a tile as [`tile`] does, for rows of raw bits, one a frame, if no value needs a flag. Returns whether any taxel is
/// pressed, and `None` if a value needs a flag: `pressures` is then of no use.
///
/// Conditions on every value are tested on each taxel's largest and smallest value only. `sort` is the tile's.
#[inline(always)]
pub(super) fn plain<S: Simd>(
    simd: S,
    sort: Sort,
    tile: &Tile,
    raw: &[Row<u32>],
    pressures: &mut [Row<f32>; LANES],
) -> Option<bool> {
    if sort == Sort::Any {
        return None;
    }
    let lanes = |row: &Row<f32>| f32x16::from_slice(simd, row);
    let (none, mut pressed, mut sizes) = (f32x16::splat(simd, 0.0), u32x16::splat(simd, 0), Sizes::new(simd));
    if sort == Sort::Raw {
        for (bits, pressures) in raw.iter().zip(pressures) {
            let bits = u32x16::from_slice(simd, bits);
            sizes.see(simd, bits);
            let pressure = unsigned(simd, bits);
            pressed |= pressure.bitcast::<u32x16<S>>();
            pressure.store_slice(pressures);
        }
        if !sizes.are_fine(simd) {
            return None;
        }
    } else {
        let (baseline, gain, dead_band) = (lanes(&tile.baseline), lanes(&tile.gain), lanes(&tile.dead_band));
        let (mut low, mut high, mut most) = (lanes(&tile.raw_high), lanes(&tile.raw_low), none);
        for (bits, pressures) in raw.iter().zip(pressures) {
            let bits = u32x16::from_slice(simd, bits);
            let value = bits.bitcast::<f32x16<S>>();
            let pressure = (value - baseline) * gain;
            sizes.see(simd, bits);
            sizes.see(simd, pressure.bitcast());
            (low, high, most) = (low.min(value), high.max(value), most.max(pressure));
            let pressure = pressure.simd_gt(dead_band).select(pressure, none);
            pressed |= pressure.bitcast::<u32x16<S>>();
            pressure.store_slice(pressures);
        }
        let within = low.simd_ge(lanes(&tile.raw_low)) & high.simd_le(lanes(&tile.raw_high));
        if !(sizes.are_fine(simd) && (within & most.simd_le(lanes(&tile.p_max))).all_true()) {
            return None;
        }
    }
    Some(pressed.simd_gt(u32x16::splat(simd, 0)).any_true())
}

/// A number of these `bits`, or 0 where that is negative: as a whole number of either sign it is less than 0 then, −0 too.
#[inline(always)]
fn unsigned<S: Simd>(simd: S, bits: u32x16<S>) -> f32x16<S> {
    bits.bitcast::<i32x16<S>>().max(i32x16::splat(simd, 0)).bitcast()
}

/// The largest size of numbers, and the smallest that is not 0, less one.
struct Sizes<S: Simd> {
    largest: u32x16<S>,
    smallest: u32x16<S>,
}

impl<S: Simd> Sizes<S> {
    #[inline(always)]
    fn new(simd: S) -> Self {
        Self { largest: u32x16::splat(simd, 0), smallest: u32x16::splat(simd, u32::MAX) }
    }

    #[inline(always)]
    fn see(&mut self, simd: S, bits: u32x16<S>) {
        let size = bits & SIZE_BITS;
        self.largest = self.largest.max(size);
        // Of 0 that is the largest there is.
        self.smallest = self.smallest.min(size - u32x16::splat(simd, 1));
    }

    /// Whether [`fine`] held for all of them.
    #[inline(always)]
    fn are_fine(&self, simd: S) -> bool {
        let huge = u32x16::splat(simd, HUGE_BITS);
        let fine = self.largest.simd_le(huge) & self.smallest.simd_ge(u32x16::splat(simd, TINY_BITS - 1));
        fine.all_true()
    }
}

/// A frame's pressures, by slot, into `values`, and whether any status says anything. Where none does, statuses are of no use,
/// unless the plan has changes, which look at them in any case.
pub(super) fn frame(level: Level, plan: &Plan, tiles: &Tiles, raw: (Rows<'_>, usize), values: &mut Calibrated) -> bool {
    let raw = OneFrame::new(raw.0, raw.1, plan.calibrated());
    let Calibrated { pressures, statuses } = values;
    with_widest!(level, simd => some_tiles(simd, plan, tiles, raw, 0..tiles.all.len(), pressures, statuses))
}

/// The same by all cores. Beside the other, where it is inlined, it makes a small skin's live call longer.
#[inline(never)]
pub(super) fn shared_frame(
    level: Level,
    plan: &Plan,
    tiles: &Tiles,
    raw: (Rows<'_>, usize),
    values: &mut Calibrated,
) -> bool {
    let (count, threads) = (tiles.all.len(), parallel::threads());
    // A few parts a thread, as none knows what else its core does; and no more than a word has bits.
    let part = count.div_ceil((4 * threads).min(u64::BITS as usize)).max(1).next_multiple_of(TOGETHER);
    let faulty = AtomicU64::new(0);
    let raw = OneFrame::new(raw.0, raw.1, plan.calibrated());
    let parts = values.pressures[..count].chunks_mut(part).zip(values.statuses[..count].chunks_mut(part));
    let parts = Tasks::new(parts.enumerate());
    on_threads(threads, || {
        while let Some((index, (pressures, statuses))) = parts.take() {
            let range = index * part..index * part + pressures.len();
            if with_widest!(level, simd => some_tiles(simd, plan, tiles, raw, range.clone(), pressures, statuses)) {
                faulty.fetch_or(1 << index, Ordering::Relaxed);
            }
        }
    });
    let faulty = faulty.into_inner();
    for (index, statuses) in values.statuses[..count].chunks_mut(part).enumerate() {
        if faulty != 0 && faulty & 1 << index == 0 {
            statuses.fill([0; LANES]);
        }
    }
    faulty != 0
}

/// The tiles in `range`, which `pressures` and `statuses` begin with.
#[inline(always)]
fn some_tiles<S: Simd>(
    simd: S,
    plan: &Plan,
    tiles: &Tiles,
    raw: OneFrame<'_>,
    range: Range<usize>,
    pressures: &mut [Row<f32>],
    statuses: &mut [Row<u32>],
) -> bool {
    let mut faults = false;
    for first in range.clone().step_by(TOGETHER) {
        let group = first..range.end.min(first + TOGETHER);
        let here = first - range.start..group.end - range.start;
        if plain_tiles(simd, tiles, raw, group.clone(), &mut pressures[here.clone()]) {
            if faults || plan.has_changes() {
                statuses[here].fill([0; LANES]);
            }
            continue;
        }
        let were_plain = !faults;
        for (index, here) in group.zip(here.clone()) {
            let Aligned(bits) = &mut Aligned([0; LANES]);
            raw.read(simd, index, bits);
            let (pressures, statuses) = (&mut pressures[here], &mut statuses[here]);
            faults |= tile(simd, plan, &tiles.all[index], index * LANES, bits, pressures, statuses);
        }
        if were_plain && faults {
            statuses[..here.start].fill([0; LANES]);
        }
    }
    faults
}

/// As [`tile`], for the tiles `group` of a frame, if nothing is to be said of any value: whether that is so. If not their
/// `pressures` are of no use.
///
/// What has to hold for every value is asked once.
#[inline(always)]
fn plain_tiles<S: Simd>(
    simd: S,
    tiles: &Tiles,
    raw: OneFrame<'_>,
    group: Range<usize>,
    pressures: &mut [Row<f32>],
) -> bool {
    let (none, mut sizes, mut beyond) = (f32x16::splat(simd, 0.0), Sizes::new(simd), u32x16::splat(simd, 0));
    let sorts = &tiles.sorts[group.clone()];
    for (index, (sort, pressures)) in group.zip(sorts.iter().zip(pressures)) {
        if *sort == Sort::Any {
            return false;
        }
        let bits = raw.row(simd, index);
        sizes.see(simd, bits);
        if *sort == Sort::Raw {
            unsigned(simd, bits).store_slice(pressures);
            continue;
        }
        let tile = &tiles.all[index];
        let lanes = |row: &Row<f32>| f32x16::from_slice(simd, row);
        let value = bits.bitcast::<f32x16<S>>();
        let pressure = (value - lanes(&tile.baseline)) * lanes(&tile.gain);
        sizes.see(simd, pressure.bitcast());
        let within = value.simd_ge(lanes(&tile.raw_low))
            & value.simd_le(lanes(&tile.raw_high))
            & pressure.simd_le(lanes(&tile.p_max));
        beyond |= within.select(u32x16::splat(simd, 0), u32x16::splat(simd, 1));
        pressure.simd_gt(lanes(&tile.dead_band)).select(pressure, none).store_slice(pressures);
    }
    sizes.are_fine(simd) && !beyond.simd_gt(u32x16::splat(simd, 0)).any_true()
}

/// Where a number is 0 or neither tiny nor unbelievable.
#[inline(always)]
fn fine<S: Simd>(simd: S, bits: U<S>) -> M<S> {
    let size = bits & SIZE_BITS;
    (size - splat_u(simd, TINY_BITS)).simd_le(splat_u(simd, HUGE_BITS - TINY_BITS)) | size.simd_eq(splat_u(simd, 0))
}

/// As [`tile`], for a vector of lanes whose values may be anything.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the same as `tile`, and where")]
fn any_value<S: Simd>(
    simd: S,
    plan: &Plan,
    tile: &Tile,
    first: usize,
    bits: U<S>,
    at: usize,
    pressures: &mut Row<f32>,
    statuses: &mut Row<u32>,
) -> bool {
    let lanes = |row: &Row<f32>| load(simd, row, at);
    let response = load_u(simd, &tile.response, at);
    let (none, nothing) = (splat(simd, 0.0), splat_u(simd, 0));
    let is_tiny = |size: U<S>| size.simd_gt(nothing) & size.simd_lt(splat_u(simd, TINY_BITS));
    let is_huge = |size: U<S>| size.simd_gt(splat_u(simd, HUGE_BITS));

    let size = bits & SIZE_BITS;
    let missing = bits.simd_eq(splat_u(simd, u32::MAX));
    let value = bits.bitcast::<F<S>>();
    let beyond = value.simd_lt(lanes(&tile.raw_low)) | value.simd_gt(lanes(&tile.raw_high));
    let value = is_tiny(size).select(none, value);
    let above = value - lanes(&tile.baseline);
    let mut pressure = above * lanes(&tile.gain);
    if tile.sort == Sort::Any {
        for lane in 0..width::<S>() {
            let slot = first + at + lane;
            if tile.response[at + lane] >= FIRST_CURVE {
                pressure[lane] = on_curve(plan.curve_of(slot).rounded, above[lane]);
            }
        }
    }
    let pressure_size = pressure.bitcast::<U<S>>() & SIZE_BITS;
    let unbelievable = is_huge(size) | is_huge(pressure_size) | response.simd_eq(splat_u(simd, MASKED));
    let altered = is_tiny(size) | is_tiny(pressure_size);
    let over = pressure.simd_gt(lanes(&tile.dead_band)) & !is_tiny(pressure_size);
    let usable = !(missing | unbelievable);
    let faulty = Flags::FAULTY_INPUT.bits();
    let kept = bits_where(simd, beyond, Flags::OUT_OF_RANGE.bits())
        | bits_where(simd, altered, faulty)
        | bits_where(simd, over & pressure.simd_gt(lanes(&tile.p_max)), Flags::SATURATED.bits());
    let left_out = missing.select(splat_u(simd, Flags::INCOMPLETE.bits() | UNUSABLE), splat_u(simd, faulty | UNUSABLE));
    let status = usable.select(kept, left_out);
    store(simd, (usable & over).select(pressure, none), pressures, at);
    store_u(simd, status, statuses, at);
    status.simd_gt(nothing).any_true()
}

fn on_curve(knots: &[Knot], x: f32) -> f32 {
    let (first, last) = (knots[0], knots[knots.len() - 1]);
    if x.is_nan() || x <= first.raw {
        return first.p;
    }
    if x >= last.raw {
        return last.p;
    }
    let after = knots.partition_point(|knot| knot.raw <= x);
    let (from, to) = (knots[after - 1], knots[after]);
    (from.p + (x - from.raw) * from.slope).clamp(from.p.min(to.p), from.p.max(to.p))
}
