//! orientation in lanes; see [`crate::stage::orientation`].

use fearless_simd::prelude::*;

use super::lanes::{F, U, bits_where, of_line, splat, splat_u};
use super::members::{Members, Touch};
use super::write::Answers;
use crate::percept::{Component, Flags, Outputs};

/// What this stage fills.
pub(super) const PARTS: [Component; 1] = [Component::Orientation];

/// 2⁻¹⁴.
const NEAR: f32 = 1.0 / 16_384.0;

/// How far the two farthest points lie from the centroid, and from each other.
#[derive(Clone, Copy)]
pub(super) struct Farthest<S: Simd> {
    /// The three largest squared distances from the centroid; 0 or −1 where there are no more.
    pub(super) r: [F<S>; 3],
    /// From one of the two farthest points to the other: to which does not matter to a line.
    pub(super) x: F<S>,
    pub(super) y: F<S>,
}

/// Finds the two farthest points.
///
/// An unpressed taxel needs no mask: it stands at (0, 0) with r = 0, which is where a pressed one with r = 0 stands too,
/// so that neither's choice changes the line. How many are pressed says whether there are two or three at all.
#[inline(always)]
pub(super) fn farthest<S: Simd, P: Members<S>>(simd: S, members: P, at: usize, touch: &Touch<S>) -> Farthest<S> {
    if touch.scale.simd_eq(splat(simd, 1.0)).all_true() {
        search::<S, P, false>(simd, members, at, touch)
    } else {
        search::<S, P, true>(simd, members, at, touch)
    }
}

/// The same; not `SCALED` where every scale is 1, which saves a twentieth of the work.
#[inline(always)]
fn search<S: Simd, P: Members<S>, const SCALED: bool>(simd: S, members: P, at: usize, touch: &Touch<S>) -> Farthest<S> {
    let (unseen, none): (F<S>, F<S>) = (splat(simd, -1.0), splat(simd, 0.0));
    let mut far: Farthest<S> = Farthest { r: [unseen; 3], x: none, y: none };
    let (mut far_x, mut far_y): (F<S>, F<S>) = (none, none);
    for member in 0..members.count() {
        // Strictly larger, so that the lower id stays.
        let (r, x, y) = point::<S, P, SCALED>(simd, members, member, at, touch);
        let (first, second) = (r.simd_gt(far.r[0]), r.simd_gt(far.r[1]));
        far.r[2] = far.r[2].max(far.r[1].min(r));
        far.r[1] = far.r[1].max(far.r[0].min(r));
        far.r[0] = far.r[0].max(r);
        // Whether it is the farthest now or the second, the other one is what was the farthest before.
        far.x = second.select(x - far_x, far.x);
        far.y = second.select(y - far_y, far.y);
        far_x = first.select(x, far_x);
        far_y = first.select(y, far_y);
    }
    far
}

/// A member's point e − c, and its squared distance.
#[inline(always)]
pub(super) fn point<S: Simd, P: Members<S>, const SCALED: bool>(
    simd: S,
    members: P,
    member: usize,
    at: usize,
    touch: &Touch<S>,
) -> (F<S>, F<S>, F<S>) {
    let sample = members.sample(simd, member, at);
    let q = if SCALED { sample.pull * touch.scale } else { sample.pull };
    let x = (sample.u - touch.u) * q;
    let y = (sample.v - touch.v) * q;
    (x * x + y * y, x, y)
}

/// Puts the line through the two farthest points into `cells`, with its flags.
#[inline(always)]
pub(super) fn finish<S: Simd>(simd: S, touch: &Touch<S>, apart: &Farthest<S>, at: usize, answers: &mut Answers) {
    let (angle, flags, present) = line(simd, touch, apart);
    answers.put(simd, Component::Orientation, angle, at);
    answers.add_status(simd, (flags, present), at);
}

/// The angle of the line through the two farthest points, where there is one; flags; and what is present. Where no lane has
/// one, what was found is not looked at.
#[inline(always)]
fn line<S: Simd>(simd: S, touch: &Touch<S>, &Farthest { r, x, y }: &Farthest<S>) -> (F<S>, U<S>, U<S>) {
    let (none, one, two) = (splat(simd, 0.0), splat_u(simd, 1), splat_u(simd, 2));
    let single = bits_where(simd, touch.touched & touch.active.simd_le(one), Flags::ONE_TAXEL.bits());
    let several = touch.touched & touch.active.simd_gt(one);
    if !several.any_true() {
        return (none, single, splat_u(simd, 0));
    }
    // Distances are compared by their squares, as roots are dear.
    let apart = x * x + y * y;
    let (far, third) = (r[0].max(none), r[2].max(none));
    let is_third = touch.active.simd_gt(two);
    // The limits below are near² = 2⁻²⁸ far and (√third + near)² ≤ third + (2⁻¹³ + 2⁻²⁸) far, up to roundings: where there
    // is twice as much between, as there nearly always is, both answers are no without a root.
    let is_clear = apart.simd_gt(far * (2.0 * NEAR * NEAR)) & (!is_third | r[1].simd_gt(third + far * (4.0 * NEAR)));
    let (coincident, tie) = if (!several | is_clear).all_true() {
        (none.simd_gt(none), none.simd_gt(none))
    } else {
        let near = far.sqrt() * NEAR;
        let limit = third.sqrt() + near;
        let coincident = several & apart.simd_le(near * near);
        (coincident, several & !coincident & is_third & r[1].simd_le(limit * limit))
    };
    let found = several & !coincident;
    let coincident = bits_where(simd, coincident, Flags::COINCIDENT.bits());
    (
        found.select(of_line(simd, x, y), none),
        single | coincident | bits_where(simd, tie, Flags::TIE.bits()),
        bits_where(simd, found, Outputs::ORIENTATION.low()),
    )
}

#[cfg(test)]
mod tests {
    use fearless_simd::Level;
    use proptest::prelude::*;

    use super::super::lanes::{LANES, Row, load, load_u, store_u, with_widest};
    use super::*;

    /// Flags of a lane, with the roots of both distances.
    fn with_roots(active: u32, r: [f32; 3], x: f32, y: f32) -> Flags {
        let near = r[0].max(0.0).sqrt() * NEAR;
        let limit = r[2].max(0.0).sqrt() + near;
        if active == 1 {
            Flags::ONE_TAXEL
        } else if x * x + y * y <= near * near {
            Flags::COINCIDENT
        } else if active > 2 && r[1] <= limit * limit {
            Flags::TIE
        } else {
            Flags::empty()
        }
    }

    proptest! {
        #[test]
        fn roots_that_are_left_out_would_say_the_same(
            active in 1_u32..5,
            exponent in -149_i32..40,
            far in 1.0_f32..2.0,
            // How far the second and the third stay behind, and the two points' distance, as powers of two of the first.
            behind in prop::array::uniform3(-32.0_f32..0.5),
            shares in prop::array::uniform2(0.0_f32..1.0),
        ) {
            let first = far * 2.0_f32.powi(exponent);
            let second = first - first * behind[0].exp2().min(1.0) * shares[0];
            let third = second - second * behind[1].exp2().min(1.0) * shares[1];
            let (x, y) = (first.sqrt() * behind[2].exp2() * 0.6, first.sqrt() * behind[2].exp2() * 0.8);
            let level = Level::new();
            let mut flags: Row<u32> = [0; LANES];
            with_widest!(level, simd => {
                let all = |value: f32| load(simd, &[value; LANES], 0);
                let touch = Touch {
                    active: load_u(simd, &[active; LANES], 0),
                    touched: all(1.0).simd_gt(all(0.0)),
                    total: all(1.0),
                    scale: all(1.0),
                    u: all(0.0),
                    v: all(0.0),
                };
                let apart = Farthest { r: [all(first), all(second), all(third)], x: all(x), y: all(y) };
                store_u(simd, line(simd, &touch, &apart).1, &mut flags, 0);
            });
            prop_assert_eq!(Flags::from_bits_retain(flags[0]), with_roots(active, [first, second, third], x, y));
        }
    }
}
