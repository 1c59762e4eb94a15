//! How a plan's fields are laid out for the device. A field with very many members is cut into **parts**. Fields and parts are
//! grouped into **shares**: a device can bind a limited number of members at once, and a share fits.

use std::ops::Range;

use crate::scene::Plan;
use crate::stage::layout::{self, AREA_KNOWN, CHARTED, WIDE};

/// All fields of a plan.
pub(super) struct Shares {
    pub(super) shares: Vec<Share>,
    /// The first part of each field that is in parts.
    pub(super) firsts: Vec<layout::Part>,
    /// How many parts there are in all.
    pub(super) parts: usize,
}

/// Fields, and parts of wide ones, whose members fit into one table.
#[derive(Default)]
pub(super) struct Share {
    /// Its members, as indices into those of the plan.
    pub(super) members: Range<usize>,
    pub(super) narrow: Vec<layout::Field>,
    /// Wide fields that are not cut into parts.
    pub(super) wide: Vec<layout::Field>,
    pub(super) parts: Vec<layout::Part>,
}

/// The most parts of a field: each part reads the results of all others, so the work grows with their square.
const MOST_PARTS: usize = 256;

/// How many parts a field of `count` members is cut into: parts have at most `most_of_part` members, or as few more as keep
/// their number within [`MOST_PARTS`]. 0 leaves the field whole.
pub(super) fn parts(count: usize, most_of_part: usize) -> usize {
    match count.div_ceil(most_of_part) {
        0 | 1 => 0,
        parts => parts.min(MOST_PARTS),
    }
}

impl Shares {
    /// Lays out the fields of `plan`. Fields with more than `most_of_part` members are cut into [`parts`] of at least 64 members.
    /// A share has at most `most_of_share` members; a field or part that has more is a share of its own.
    pub(super) fn new(plan: &Plan, most_of_part: usize, most_of_share: usize) -> Self {
        let mut all = Self { shares: Vec::new(), firsts: Vec::new(), parts: 0 };
        for (index, field) in plan.fields.iter().enumerate() {
            let known = if field.charted { CHARTED } else { 0 } | if field.area_known { AREA_KNOWN } else { 0 };
            let (count, first) = (parts(field.count, most_of_part), all.parts);
            // Parts are about equally large, so that every invocation of a group has members.
            let cut = |part: usize| field.count * part / count.max(1);
            for part in 0..count.max(1) {
                let (before, end) = (cut(part), cut(part + 1));
                let share = all.with_room(field.first + before..field.first + end, most_of_share.max(end - before));
                let first_member = (field.first + before - share.members.start) as u32;
                let members =
                    layout::Field { first: first_member, count: (end - before) as u32, known, index: index as u32 };
                if count == 0 {
                    let fields = if field.count > WIDE { &mut share.wide } else { &mut share.narrow };
                    fields.push(members);
                    continue;
                }
                let [number, first, count, before] = [first + part, first, count, before].map(|number| number as u32);
                let part = layout::Part { members, number, first, count, before };
                share.parts.push(part);
                if number == first {
                    all.firsts.push(part);
                }
            }
            all.parts += count;
        }
        all
    }

    /// The last share, which takes `members`, the next; a new one where they would be more than `most`.
    fn with_room(&mut self, members: Range<usize>, most: usize) -> &mut Share {
        if self.shares.last().is_none_or(|share| members.end - share.members.start > most) {
            self.shares.push(Share { members: members.start..members.start, ..Share::default() });
        }
        let last = self.shares.len() - 1;
        self.shares[last].members.end = members.end;
        &mut self.shares[last]
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{percepts_of, percepts_of_odd_values, plan_of};
    use super::super::{Gpu, adapter};
    use super::*;
    use crate::percept::{Flags, Outputs};
    use crate::scene::{Arithmetic, Knobs, Scene};
    use crate::shape::Shape;
    use crate::signal::RawValue;
    use somatic_testing::skip;

    /// The device; where there is none, that is a skip.
    fn device() -> Option<adapter::Device> {
        adapter::shared().inspect_err(|_| skip("GPU", "no adapter answers")).ok()
    }

    #[test]
    fn every_member_has_one_place_in_a_share_that_has_room() {
        let shape = Shape { sensors: 9000, fields: 150, members: 30, wide: 8500, local: true, frames: 1, seed: 1 };
        let body = shape.body();
        let plan = plan_of(&body, &Scene::default());
        let cuts = [WIDE, 2 * WIDE, 3 * WIDE]
            .into_iter()
            .flat_map(|of_part| [0, 5000, 9000, 1 << 20].map(|most| (of_part, most)));
        for (of_part, most) in cuts {
            let all = Shares::new(&plan, of_part, most);
            let (mut next, mut numbers) = (0, 0..);
            for share in &all.shares {
                assert!(share.members.start == next && share.members.len() <= most.max(of_part), "{most}");
                next = share.members.end;
                assert!(share.narrow.iter().all(|row| row.count <= WIDE as u32));
                assert!(share.wide.iter().all(|row| row.count > WIDE as u32));
                let mut rows = [&share.narrow[..], &share.wide].concat();
                for part in &share.parts {
                    assert_eq!(Some(part.number as usize), numbers.next());
                    let field = &plan.fields[part.members.index as usize];
                    let first = share.members.start + part.members.first as usize;
                    assert_eq!(first, field.first + part.before as usize);
                    rows.push(part.members);
                }
                rows.sort_by_key(|row| row.first);
                let ends = rows.iter().scan(0, |end, row| {
                    assert!(row.first == *end && (1..=of_part as u32).contains(&row.count));
                    *end += row.count;
                    Some(*end)
                });
                assert_eq!(ends.last(), Some(share.members.len() as u32));
            }
            let parts = [3, 2, 0][of_part / WIDE - 1];
            assert_eq!((next, numbers.start, all.parts), (plan.members.len(), parts, parts));
            let firsts: Vec<(u32, u32)> = all.firsts.iter().map(|part| (part.number, part.count)).collect();
            assert_eq!(firsts, if parts > 0 { vec![(0, parts as u32)] } else { Vec::new() });
        }
    }

    #[test]
    fn percepts_do_not_depend_on_how_members_are_shared_out() {
        let Some(device) = device() else { return };
        let shape = Shape { sensors: 34_000, fields: 300, members: 40, wide: 33_000, local: true, frames: 9, seed: 3 };
        let body = shape.body();
        for arithmetic in [Arithmetic::OnePass, Arithmetic::Compensated] {
            let knobs = Knobs { arithmetic: Some(arithmetic), ..Knobs::default() };
            let scene =
                Scene { outputs: Outputs::USUAL_AND_MOTION | Outputs::PRINCIPAL_AXIS, knobs, ..Scene::default() };
            let mut plan = plan_of(&body, &scene);
            // Some without a chart, whose third coordinate counts.
            let mut fields = plan.fields.to_vec();
            for field in fields.iter_mut().rev().step_by(3) {
                field.charted = false;
                field.depths.iter_mut().enumerate().for_each(|(index, depth)| *depth = (index % 7) as f32 / 7.0);
            }
            plan.fields = fields.into();
            for (frames, of_part) in [(1, 256), (9, 256), (9, WIDE)] {
                // Whole, and cut between fields and within the wide one.
                let [whole, cut] = [1 << 20, 5000].map(|most| {
                    let mut gpu = Gpu::in_shares(device.clone(), &plan, frames, (of_part, most)).unwrap();
                    percepts_of_odd_values(&mut gpu, frames)
                });
                assert!(whole == cut, "{frames} frames, {of_part} a part, {arithmetic:?}");
            }
        }
    }

    #[test]
    fn many_parts_add_up_to_what_one_has() {
        let Some(device) = device() else { return };
        let shape = Shape { sensors: 30_000, fields: 1, members: 1, wide: 30_000, local: true, frames: 5, seed: 3 };
        let body = shape.body();
        let scene = Scene { outputs: Outputs::TOTAL | Outputs::PEAK | Outputs::ACTIVE, ..Scene::default() };
        let plan = plan_of(&body, &scene);
        // Whole numbers, whose sums are exact in whatever order.
        let value = |i: usize| RawValue::new((i * i % 509) as f64);
        let values: Vec<RawValue> = (0..shape.frames * shape.sensors).map(value).collect();
        assert_eq!([1 << 20, WIDE, 150].map(|of_part| parts(30_000, of_part)), [0, 8, 200]);
        let [one, some, many] = [1 << 20, WIDE, 150].map(|of_part| {
            percepts_of(&mut Gpu::in_shares(device.clone(), &plan, shape.frames, (of_part, 1 << 20)).unwrap(), &values)
        });
        assert!((0..shape.frames).all(|frame| one.touched(frame).count() > 0));
        assert!(one == some && one == many);
    }

    #[test]
    fn a_field_has_no_more_parts_than_read_each_other_quickly() {
        assert_eq!([0, 1, WIDE, WIDE + 1, 1 << 20].map(|count| parts(count, WIDE)), [0, 0, 0, 2, 256]);
        assert_eq!(parts(100_000_000, WIDE), MOST_PARTS);
    }

    #[test]
    fn of_equals_the_first_member_is_the_farther_wherever_its_table_is() {
        let Some(device) = device() else { return };
        const SIDE: usize = 182;
        let sensors = SIDE * SIDE;
        let shape = Shape { sensors, fields: 1, members: 1, wide: sensors, local: true, frames: SIDE / 2, seed: 3 };
        let body = shape.body();
        let scene = Scene { outputs: Outputs::ORIENTATION, ..Scene::default() };
        let plan = plan_of(&body, &scene);
        // In each frame the four corners of a rectangle round the middle, which are as far from it as each other.
        let mut values = vec![RawValue::new(0.0); shape.frames * sensors];
        for row in 0..shape.frames {
            for place in [row * SIDE, (row + 1) * SIDE - 1, (SIDE - 1 - row) * SIDE, (SIDE - row) * SIDE - 1] {
                values[row * sensors + place] = RawValue::new(1.0);
            }
        }
        let [whole, cut] = [1 << 20, 5000].map(|most| {
            let mut device = device.clone();
            device.info.device_type = wgpu::DeviceType::DiscreteGpu;
            percepts_of(&mut Gpu::in_shares(device, &plan, shape.frames, (WIDE, most)).unwrap(), &values)
        });
        let ties = (0..shape.frames).filter(|&frame| whole.frame(frame).any(|of| of.flags.contains(Flags::TIE)));
        assert_eq!(ties.count(), shape.frames);
        assert!(whole == cut);
    }
}
