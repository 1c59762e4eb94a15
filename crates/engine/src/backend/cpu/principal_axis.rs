//! principal_axis in lanes; see [`crate::stage::principal_axis`].

use fearless_simd::prelude::*;

use super::lanes::{F, bits_where, of_line, splat, splat_u};
use super::members::{Members, Sum, Touch};
use super::write::Answers;
use crate::percept::{Component, Flags, Outputs};

/// What this stage fills.
pub(super) const PARTS: [Component; 2] = [Component::PrincipalAxis, Component::Anisotropy];

/// 2⁻³⁰.
const TOGETHER: f32 = 1.0 / 1_073_741_824.0;
const ISOTROPIC_UNDER: f32 = 1e-3;

/// a, b and d of the second moments.
#[inline(always)]
pub(super) fn moments<S: Simd, A: Sum<S>, P: Members<S>>(simd: S, members: P, at: usize, touch: &Touch<S>) -> [A; 3] {
    let mut sums = [A::zero(simd); 3];
    for member in 0..members.count() {
        add(simd, members, member, at, touch, &mut sums);
    }
    sums
}

#[inline(always)]
pub(super) fn add<S: Simd, A: Sum<S>, P: Members<S>>(
    simd: S,
    members: P,
    member: usize,
    at: usize,
    touch: &Touch<S>,
    [a, b, d]: &mut [A; 3],
) {
    let sample = members.sample(simd, member, at);
    let counts = sample.pull.simd_gt(splat(simd, 0.0));
    let q = sample.pull * touch.scale;
    let x = sample.u - touch.u;
    let y = sample.v - touch.v;
    let qx = q * x;
    a.add(qx * x, counts);
    b.add(qx * y, counts);
    d.add((q * y) * y, counts);
}

/// Puts the principal axis, where there is one, and the anisotropy into `cells`, with their flags.
#[inline(always)]
pub(super) fn finish<S: Simd>(simd: S, touch: &Touch<S>, [a, b, d]: [F<S>; 3], at: usize, answers: &mut Answers) {
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
    answers.put(simd, Component::PrincipalAxis, found.select(angle, none), at);
    answers.put(simd, Component::Anisotropy, anisotropy, at);
    let flags = bits_where(simd, single, Flags::ONE_TAXEL.bits())
        | bits_where(simd, coincident, Flags::COINCIDENT.bits())
        | bits_where(simd, isotropic, Flags::ISOTROPIC.bits());
    let present =
        bits_where(simd, spread, Outputs::ANISOTROPY.low()) | bits_where(simd, found, Outputs::PRINCIPAL_AXIS.low());
    answers.add_status(simd, (flags, present), at);
}
