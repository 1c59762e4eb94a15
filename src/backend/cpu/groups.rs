//! Sixteen narrow fields, a lane each, as one frame's programs read them.

use fearless_simd::prelude::*;

use super::lines::Lines;
use super::simd::{F, LANES, Row, U, load, load_u};
use super::touch::{Kinds, Members, Part};
use crate::scene::Plan;

/// Sixteen narrow fields of about as many members, a lane each.
#[derive(Clone, Debug)]
pub(super) struct Narrow {
    /// Per lane, which field; fewer at the end.
    pub(super) fields: Vec<usize>,
    /// Where they are, if one stands after the other.
    pub(super) together: Option<usize>,
    pub(super) kinds: Kinds,
    /// By member, where it has its value.
    slots: Lines<u32>,
    pub(super) places: Vec<PlaceRow>,
    /// Rows of the groups before it.
    pub(super) first_row: usize,
    /// None where all are 1.
    pub(super) weights: Option<Lines<f32>>,
    pub(super) depths: Lines<f32>,
    pub(super) areas: Lines<f32>,
}

/// Where a member of each field of a group is.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct PlaceRow {
    pub(super) u: Row<f32>,
    pub(super) v: Row<f32>,
}

impl Narrow {
    /// The group of `fields`, whose lanes go on with slot `unpressed` where they have no more members.
    pub(super) fn new(plan: &Plan, fields: &[usize], unpressed: usize) -> Self {
        let rows = fields.iter().map(|&field| plan.fields[field].count).max().unwrap_or(0);
        let blank = Lines::new(rows, 0.0);
        let mut group = Self {
            fields: fields.to_vec(),
            together: fields.iter().zip(fields[0]..).all(|(&field, expected)| field == expected).then_some(fields[0]),
            kinds: Kinds::EMPTY,
            slots: Lines::new(rows, unpressed as u32),
            places: vec![PlaceRow { u: [0.0; LANES], v: [0.0; LANES] }; rows],
            first_row: 0,
            weights: (!fields.iter().all(|&field| plan.fields[field].unweighted)).then(|| blank.clone()),
            depths: blank.clone(),
            areas: blank,
        };
        for (lane, field) in fields.iter().map(|&field| &plan.fields[field]).enumerate() {
            group.kinds.set(lane, field);
            for (row, (member, depth)) in plan.members_of(field).iter().zip(&field.depths).enumerate() {
                group.slots[row][lane] = member.slot;
                if let Some(weights) = &mut group.weights {
                    weights[row][lane] = member.weight;
                }
                group.places[row].u[lane] = member.u;
                group.places[row].v[lane] = member.v;
                group.depths[row][lane] = *depth;
                group.areas[row][lane] = plan.taxels[member.slot as usize].area;
            }
        }
        group
    }

    /// Brings its members' values side by side.
    pub(super) fn gather<T: Copy>(&self, values: &[T], rows: &mut [Row<T>]) {
        for (row, slots) in rows.iter_mut().zip(&self.slots[..]) {
            for (value, &slot) in row.iter_mut().zip(slots) {
                *value = values[slot as usize];
            }
        }
    }

    pub(super) fn is_weighted(&self) -> bool {
        self.weights.is_some()
    }

    /// Has weights from now on, of 1 if it had none.
    pub(super) fn weigh(&mut self) {
        self.weights.get_or_insert_with(|| Lines::new(self.places.len(), 1.0));
    }
}

/// A group's values in this frame; `WEIGHTED` where weights are not all 1.
#[derive(Clone, Copy)]
pub(super) struct InFrame<'a, const WEIGHTED: bool> {
    pub(super) group: &'a Narrow,
    /// Empty if not `WEIGHTED`.
    pub(super) weights: &'a [Row<f32>],
    pub(super) pressures: &'a [Row<f32>],
    pub(super) statuses: &'a [Row<u32>],
}

impl<S: Simd, const WEIGHTED: bool> Members<S> for InFrame<'_, WEIGHTED> {
    #[inline(always)]
    fn count(self) -> usize {
        self.group.places.len()
    }

    #[inline(always)]
    fn part(self, simd: S, member: usize, at: usize) -> Part<S> {
        let PlaceRow { u, v } = &self.group.places[member];
        let pressure = load(simd, &self.pressures[member], at);
        Part {
            pressure,
            pull: if WEIGHTED { load(simd, &self.weights[member], at) * pressure } else { pressure },
            u: load(simd, u, at),
            v: load(simd, v, at),
        }
    }

    #[inline(always)]
    fn depth(self, simd: S, member: usize, at: usize) -> F<S> {
        load(simd, &self.group.depths[member], at)
    }

    #[inline(always)]
    fn area(self, simd: S, member: usize, at: usize) -> F<S> {
        load(simd, &self.group.areas[member], at)
    }

    #[inline(always)]
    fn status(self, simd: S, member: usize, at: usize) -> U<S> {
        load_u(simd, &self.statuses[member], at)
    }
}
