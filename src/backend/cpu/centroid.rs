//! centroid in lanes; see [`crate::stage::centroid`].

use fearless_simd::prelude::*;

use super::simd::{F, M, splat};
use super::touch::Members;

/// (u, v) where `touched`, 0 elsewhere.
#[inline(always)]
pub(super) fn quotients<S: Simd>(simd: S, total: F<S>, (u, v): (F<S>, F<S>), touched: M<S>) -> (F<S>, F<S>) {
    let none = splat(simd, 0.0);
    // One division for both: a unit in the last place more, of the five that the bound allows.
    let share = touched.select(splat(simd, 1.0) / total, none);
    (u * share, v * share)
}

/// The numerator of the third coordinate, which only fields without a chart need.
#[inline(always)]
pub(super) fn depth<S: Simd, P: Members<S>>(simd: S, members: P, at: usize) -> F<S> {
    let mut sum = splat(simd, 0.0);
    for member in 0..members.count() {
        let part = members.part(simd, member, at);
        sum += part.pull * members.depth(simd, member, at);
    }
    sum
}
