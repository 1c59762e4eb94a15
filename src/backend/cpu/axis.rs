//! axis in lanes; see [`crate::stage::axis`].

use fearless_simd::prelude::*;

use super::angle::of_line;
use super::simd::{F, bits_where, splat, splat_u};
use super::touch::{Line, Members, Touch};
use crate::percept::{Flags, Outputs};

/// 2⁻³⁰.
const TOGETHER: f32 = 1.0 / 1_073_741_824.0;
const ISOTROPIC_UNDER: f32 = 1e-3;

/// a, b and d of the second moments.
pub(super) struct Moments<S: Simd> {
    pub(super) a: F<S>,
    pub(super) b: F<S>,
    pub(super) d: F<S>,
}

/// Sums them up.
#[inline(always)]
pub(super) fn moments<S: Simd, P: Members<S>>(simd: S, members: P, at: usize, touch: &Touch<S>) -> Moments<S> {
    let mut sums = [splat(simd, 0.0); 3];
    for member in 0..members.count() {
        add(simd, members, member, at, touch, &mut sums);
    }
    let [a, b, d] = sums;
    Moments { a, b, d }
}

/// Adds a member's part to a, b and d.
#[inline(always)]
pub(super) fn add<S: Simd, P: Members<S>>(
    simd: S,
    members: P,
    member: usize,
    at: usize,
    touch: &Touch<S>,
    [a, b, d]: &mut [F<S>; 3],
) {
    let part = members.part(simd, member, at);
    let q = part.pull * touch.scale;
    let x = part.u - touch.u;
    let y = part.v - touch.v;
    let qx = q * x;
    *a += qx * x;
    *b += qx * y;
    *d += (q * y) * y;
}

/// The principal axis where there is one, and the anisotropy.
#[inline(always)]
pub(super) fn line<S: Simd>(simd: S, touch: &Touch<S>, &Moments { a, b, d }: &Moments<S>) -> (Line<S>, F<S>) {
    let (none, one) = (splat(simd, 0.0), splat(simd, 1.0));
    let single = touch.touched & touch.active.simd_le(splat_u(simd, 1));
    let several = touch.touched & touch.active.simd_gt(splat_u(simd, 1));
    let trace = a + d;
    let coincident = several & trace.simd_le((touch.total * touch.scale) * TOGETHER);
    let spread = several & !coincident;
    let (x, y) = (a - d, b * 2.0);
    let h = (x * x + y * y).sqrt();
    let anisotropy = spread.select((h / trace).min(one), none);
    let isotropic = spread & anisotropy.simd_lt(splat(simd, ISOTROPIC_UNDER));
    let found = spread & !isotropic;
    // Of the two equal forms of the bisector, the one that adds numbers of one sign.
    let right = x.simd_ge(none);
    let angle = of_line(simd, right.select(h + x, y), right.select(y, h - x));
    let line = Line {
        angle: found.select(angle, none),
        flags: bits_where(simd, single, Flags::ONE_TAXEL.bits())
            | bits_where(simd, coincident, Flags::COINCIDENT.bits())
            | bits_where(simd, isotropic, Flags::ISOTROPIC.bits()),
        present: bits_where(simd, spread, Outputs::ANISOTROPY.bits()) | bits_where(simd, found, Outputs::AXIS.bits()),
    };
    (line, anisotropy)
}
