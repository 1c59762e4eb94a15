//! All stages for a lot of cells, one stage after the other.
//!
//! A cell's stages wait for each other: the distances for the centroid's quotient, the angle for roots and another
//! quotient. Taken stage by stage, a core goes on with the next cells' members while one waits.

use fearless_simd::prelude::*;

use super::contact::Sums;
use super::orientation::{self, Apart};
use super::simd::{F, LANES, Row, U, bits_where, load, load_u, splat, splat_u, store, store_u, width};
use super::touch::{Cells, Kind, Line, Sweep, Touch};
use super::{axis, centroid};
use crate::percept::{Flags, Outputs};
use crate::scene::Stages;

/// What is to be computed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    pub(super) stages: Stages,
    /// Columns that no stage or output of these fills are left as they are.
    pub(super) outputs: Outputs,
    /// Whether calibration said something of any value.
    pub(super) faults: bool,
    /// Whether sums are compensated.
    pub(super) care: bool,
}

/// What a cell's stages leave for later ones, a row each.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Between {
    active: Row<u32>,
    /// The centroid's numerators, then the centroid, in the field's unit.
    u: Row<f32>,
    v: Row<f32>,
    /// What orientation has found, then what axis has.
    found: [Row<f32>; 5],
}

impl Between {
    pub(super) const EMPTY: Self =
        Self { active: [0; LANES], u: [0.0; LANES], v: [0.0; LANES], found: [[0.0; LANES]; 5] };
}

/// All stages for as many sets of cells as `cells` and `between` have, up to lane `lanes` of each; `lot` says where a
/// set finds its members, and what its fields are like.
#[inline(always)]
pub(super) fn touch<S: Simd, P: Sweep<S>, K: Kind<S>>(
    simd: S,
    lot: impl Fn(usize) -> (P, K),
    lanes: usize,
    wanted: Wanted,
    between: &mut [Between],
    cells: &mut [Cells],
) {
    let Wanted { stages, care, .. } = wanted;
    for (index, (cells, between)) in cells.iter_mut().zip(&mut *between).enumerate() {
        let (members, kind) = lot(index);
        let mut at = 0;
        while at < lanes {
            let next = at + width::<S>();
            if care || next >= lanes {
                for at in [at, next].into_iter().filter(|&at| at < lanes) {
                    let sums = match care {
                        true => members.sums_with_care(simd, at, stages.centroid),
                        false => members.sums(simd, at, stages.centroid),
                    };
                    contact(simd, members, &kind, wanted, at, &sums, between, cells);
                }
            } else {
                let [sums, next_sums] = members.two_sums(simd, at, stages.centroid);
                contact(simd, members, &kind, wanted, at, &sums, between, cells);
                contact(simd, members, &kind, wanted, next, &next_sums, between, cells);
            }
            at = next + width::<S>();
        }
    }
    if !stages.centroid {
        return;
    }
    for (index, (cells, between)) in cells.iter_mut().zip(&mut *between).enumerate() {
        let (members, kind) = lot(index);
        let mut at = 0;
        while at < lanes {
            find_centroid(simd, members, &kind, care, at, between, cells);
            at += width::<S>();
        }
    }
    if stages.orientation {
        for (index, (cells, between)) in cells.iter_mut().zip(&mut *between).enumerate() {
            let (members, kind) = lot(index);
            let mut at = 0;
            while at < lanes {
                if let Some(touch) = so_far::<S, 2>(simd, &kind, at, between, cells) {
                    let Apart { r: [r1, r2, r3], x, y } = members.farthest(simd, at, &touch);
                    keep(simd, [r1, r2, r3, x, y], at, between);
                }
                at += width::<S>();
            }
        }
        for (index, (cells, between)) in cells.iter_mut().zip(&mut *between).enumerate() {
            let (_, kind) = lot(index);
            let mut at = 0;
            while at < lanes {
                if let Some(touch) = so_far::<S, 1>(simd, &kind, at, between, cells) {
                    let [r1, r2, r3, x, y] = kept(simd, at, between);
                    let line = orientation::line(simd, &touch, &Apart { r: [r1, r2, r3], x, y });
                    store(simd, line.angle, &mut cells.orientation, at);
                    say(simd, &line, at, cells);
                }
                at += width::<S>();
            }
        }
    }
    if stages.axis {
        for (index, (cells, between)) in cells.iter_mut().zip(&mut *between).enumerate() {
            let (members, kind) = lot(index);
            let mut at = 0;
            while at < lanes {
                if let Some(touch) = so_far::<S, 1>(simd, &kind, at, between, cells) {
                    let axis::Moments { a, b, d } = if care {
                        members.moments_with_care(simd, at, &touch)
                    } else {
                        members.moments(simd, at, &touch)
                    };
                    keep(simd, [a, b, d], at, between);
                }
                at += width::<S>();
            }
        }
        for (index, (cells, between)) in cells.iter_mut().zip(&mut *between).enumerate() {
            let (_, kind) = lot(index);
            let mut at = 0;
            while at < lanes {
                if let Some(touch) = so_far::<S, 1>(simd, &kind, at, between, cells) {
                    let [a, b, d] = kept(simd, at, between);
                    let (line, anisotropy) = axis::line(simd, &touch, &axis::Moments { a, b, d });
                    store(simd, line.angle, &mut cells.axis, at);
                    store(simd, anisotropy, &mut cells.anisotropy, at);
                    say(simd, &line, at, cells);
                }
                at += width::<S>();
            }
        }
    }
}

/// Total, contact, peak, area and active; and the centroid's numerators.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a cell, what it is made of, and where")]
fn contact<S: Simd, P: Sweep<S>>(
    simd: S,
    members: P,
    kind: &impl Kind<S>,
    wanted: Wanted,
    at: usize,
    sums: &Sums<S>,
    between: &mut Between,
    cells: &mut Cells,
) {
    let Wanted { outputs, faults, .. } = wanted;
    let none = splat(simd, 0.0);
    let touched = sums.total.simd_gt(none);
    let mut flags = kind.always(simd, at) | bits_where(simd, !touched, Flags::NO_CONTACT.bits());
    let mut present = kind.sums(simd, at);
    if faults {
        let (said, unusable) = members.statuses(simd, at);
        flags |= said;
        present = unusable.select(splat_u(simd, 0), present);
    }
    store_u(simd, flags, &mut cells.flags, at);
    store_u(simd, present, &mut cells.present, at);
    store(simd, sums.total, &mut cells.total, at);
    store_u(simd, sums.active, &mut between.active, at);
    store(simd, sums.u, &mut between.u, at);
    store(simd, sums.v, &mut between.v, at);
    if outputs.intersects(Outputs::PEAK | Outputs::AREA) {
        let (peak, area) = members.peak_and_area(simd, at);
        store(simd, peak, &mut cells.peak, at);
        store(simd, area, &mut cells.area, at);
    }
    if outputs.contains(Outputs::ACTIVE) {
        store_u(simd, sums.active, &mut cells.active, at);
    }
    if !(touched.any_true() && kind.any_charted()) {
        for column in [&mut cells.orientation, &mut cells.axis, &mut cells.anisotropy] {
            store(simd, none, column, at);
        }
    }
    if !touched.any_true() {
        for column in [&mut cells.u, &mut cells.v, &mut cells.depth] {
            store(simd, none, column, at);
        }
    }
}

/// The centroid from its numerators, where there is a touch.
#[inline(always)]
fn find_centroid<S: Simd, P: Sweep<S>>(
    simd: S,
    members: P,
    kind: &impl Kind<S>,
    care: bool,
    at: usize,
    between: &mut Between,
    cells: &mut Cells,
) {
    let none = splat(simd, 0.0);
    let total = load(simd, &cells.total, at);
    let touched = total.simd_gt(none);
    if !touched.any_true() {
        return;
    }
    let found = kind.found(simd, at);
    let present = load_u(simd, &cells.present, at) | touched.select(found, splat_u(simd, 0));
    store_u(simd, present, &mut cells.present, at);
    let numerators = (load(simd, &between.u, at), load(simd, &between.v, at));
    let (u, v) = centroid::quotients(simd, total, numerators, touched);
    store(simd, u, &mut between.u, at);
    store(simd, v, &mut between.v, at);
    let unit = kind.unit_m(simd, at);
    store(simd, u * unit, &mut cells.u, at);
    store(simd, v * unit, &mut cells.v, at);
    let depth = if kind.any_uncharted() {
        let charted = (found & Outputs::CENTROID.bits()).simd_gt(splat_u(simd, 0));
        let sum = if care { members.depth_with_care(simd, at) } else { members.depth(simd, at) };
        let depth = sum / total;
        (touched & !charted).select(depth, none) * unit
    } else {
        none
    };
    store(simd, depth, &mut cells.depth, at);
}

/// What is known of touches in charts after the centroid, if there are any of `LEAST` taxels and more.
#[inline(always)]
fn so_far<S: Simd, const LEAST: u32>(
    simd: S,
    kind: &impl Kind<S>,
    at: usize,
    between: &Between,
    cells: &Cells,
) -> Option<Touch<S>> {
    let total = load(simd, &cells.total, at);
    let touched = total.simd_gt(splat(simd, 0.0));
    let active = load_u(simd, &between.active, at);
    let enough = if LEAST > 1 { touched & active.simd_ge(splat_u(simd, LEAST)) } else { touched };
    if !(enough.any_true() && kind.any_charted()) {
        return None;
    }
    let charted = (kind.found(simd, at) & Outputs::CENTROID.bits()).simd_gt(splat_u(simd, 0));
    Some(Touch {
        active,
        touched: touched & charted,
        total,
        scale: scale_of(simd, total),
        u: load(simd, &between.u, at),
        v: load(simd, &between.v, at),
    })
}

#[inline(always)]
fn keep<S: Simd, const N: usize>(simd: S, found: [F<S>; N], at: usize, between: &mut Between) {
    for (row, found) in between.found.iter_mut().zip(found) {
        store(simd, found, row, at);
    }
}

#[inline(always)]
fn kept<S: Simd, const N: usize>(simd: S, at: usize, between: &Between) -> [F<S>; N] {
    let mut found = [splat(simd, 0.0); N];
    for (found, row) in found.iter_mut().zip(&between.found) {
        *found = load(simd, row, at);
    }
    found
}

/// Adds to a cell's flags, and to what it gives.
#[inline(always)]
fn say<S: Simd>(simd: S, line: &Line<S>, at: usize, cells: &mut Cells) {
    let flags = load_u(simd, &cells.flags, at) | line.flags;
    store_u(simd, flags, &mut cells.flags, at);
    let present = load_u(simd, &cells.present, at) | line.present;
    store_u(simd, present, &mut cells.present, at);
}

/// 1 where `total` is neither under 1 nor so large that squares would be none; the power of two that brings it into [1, 2)
/// elsewhere.
#[inline(always)]
fn scale_of<S: Simd>(simd: S, total: F<S>) -> F<S> {
    const ONE: u32 = 127 << 23;
    const LARGE: u32 = (127 + 40) << 23;
    let exponent = total.bitcast::<U<S>>() & 0x7F80_0000;
    let is_fit = (exponent - splat_u(simd, ONE)).simd_lt(splat_u(simd, LARGE - ONE));
    is_fit.select(splat_u(simd, ONE), splat_u(simd, 2 * ONE) - exponent).bitcast()
}
