//! From coarse to fine: a field is computed where the one above it is touched.
//!
//! A field's taxels are all its parent's too, and no weight or pressure is so small that a product of them vanishes: where
//! a parent has a total of 0 and calibration says nothing of its taxels, so it is with all fields below, and their answers
//! are known without a look at them.

use super::simd::LANES;
use super::touch::{Cells, OneKind};
use crate::scene::{Coverage, Plan};

/// Where a field's answer is: a unit (a wide field, or a group of narrow ones), and a lane of it.
type Place = (usize, usize);

/// In which order units are computed, and when not.
#[derive(Clone, Debug)]
pub(super) struct Descent {
    /// By pass, the units that may be computed in it.
    passes: Vec<Vec<usize>>,
    /// By unit, the answers, of earlier passes, of the fields above its own; none where one of its own has nobody above.
    above: Vec<Vec<Place>>,
    /// By unit, what is known without a look.
    untouched: Vec<Cells>,
    /// By unit, whether its answer is that.
    rests: Vec<bool>,
    stale: Vec<bool>,
}

/// How many fields of the plan lie above `field`.
pub(super) fn depth(plan: &Plan, field: usize) -> usize {
    std::iter::successors(plan.fields[field].above, |&above| plan.fields[above].above).count()
}

impl Descent {
    /// The descent over `units`, each some fields, if the plan is to have one.
    pub(super) fn new(plan: &Plan, units: &[&[usize]]) -> Option<Self> {
        if plan.knobs().coverage != Coverage::CoarseToFine {
            return None;
        }
        let mut place = vec![(0, 0); plan.fields.len()];
        for (unit, fields) in units.iter().enumerate() {
            for (lane, &field) in fields.iter().enumerate() {
                place[field] = (unit, lane);
            }
        }
        let pass_of = |fields: &[usize]| fields.iter().map(|&field| depth(plan, field)).min().unwrap_or(0);
        let pass: Vec<usize> = units.iter().map(|fields| pass_of(fields)).collect();
        let mut passes = vec![Vec::new(); pass.iter().max().map_or(0, |last| last + 1)];
        for (unit, &pass) in pass.iter().enumerate() {
            passes[pass].push(unit);
        }
        passes.retain(|units| !units.is_empty());
        let above = |(unit, fields): (usize, &&[usize])| {
            // The nearest above that is computed before.
            let before = |&field: &usize| {
                let above = std::iter::successors(plan.fields[field].above, |&above| plan.fields[above].above);
                above.map(|above| place[above]).find(|&(other, _)| pass[other] < pass[unit])
            };
            let mut places: Vec<Place> = fields.iter().map(before).collect::<Option<_>>().unwrap_or_default();
            places.sort_unstable();
            places.dedup();
            places
        };
        let untouched = |fields: &&[usize]| {
            let mut cells = Cells::EMPTY;
            for (lane, &field) in fields.iter().enumerate() {
                (cells.flags[lane], cells.present[lane]) = OneKind::new(&plan.fields[field]).untouched();
            }
            if fields.len() == 1 {
                (cells.flags, cells.present) = ([cells.flags[0]; LANES], [cells.present[0]; LANES]);
            }
            cells
        };
        Some(Self {
            passes,
            above: units.iter().enumerate().map(above).collect(),
            untouched: units.iter().map(untouched).collect(),
            rests: vec![false; units.len()],
            stale: vec![false; units.len()],
        })
    }

    pub(super) fn passes(&self) -> usize {
        self.passes.len()
    }

    /// By unit, whether pass `pass` computes it; those that need not be have their answer.
    pub(super) fn stale(&mut self, pass: usize, answers: &mut [Cells]) -> &[bool] {
        self.stale.fill(false);
        for &unit in &self.passes[pass] {
            let above = &self.above[unit];
            let touched = |&(other, lane): &Place| {
                let said = answers[other].flags[lane] != self.untouched[other].flags[lane];
                said || answers[other].total[lane] > 0.0
            };
            let look = above.is_empty() || above.iter().any(touched);
            self.stale[unit] = look;
            if !look && !self.rests[unit] {
                answers[unit] = self.untouched[unit];
            }
            self.rests[unit] = !look;
        }
        &self.stale
    }
}
