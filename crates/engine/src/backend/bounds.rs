//! How far single precision may be off in every cell, what is too close to call, and where the comparison goes on after that.

use glam::DVec2;

use super::reference::{Before, Reference};
use super::{Backend, BackendState, FieldState, RawBatch, Step, sigma};
use crate::error::Result;
use crate::percept::{Flags, Outputs, Percepts};
use crate::scene::{Plan, PlanField};
use crate::stage::calibrate::Pressure;
use crate::stage::limit::Limit;
use crate::stage::{
    Given, GivenLimit, Pressed, U, centroid, contact, difference, filter, force, hysteresis, motion, orientation,
    principal_axis,
};

/// How far a single-precision percept may be off in one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CellBound {
    pub(crate) in_doubt: Flags,
    /// One for each output, at the number of its bit; for vectors the limit of a distance.
    pub(super) limits: [Limit; Outputs::all().bits().ilog2() as usize + 1],
    /// Per coordinate, m.
    pub(crate) centroid: Limit<[f64; 2]>,
    /// What of the state that the backend keeps may differ from the reference's from now on.
    pub(crate) may_remember: MayRemember,
}

/// What of a field's state may differ after a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct MayRemember {
    /// Whether there was contact, and where: the rest depends on that too.
    pub(crate) contact: bool,
    /// The last centroid that counted.
    pub(crate) filter: bool,
}

impl Default for CellBound {
    fn default() -> Self {
        Self {
            in_doubt: Flags::empty(),
            limits: std::array::from_fn(|_| Limit::default()),
            centroid: Limit::default(),
            may_remember: MayRemember::default(),
        }
    }
}

impl CellBound {
    /// For a cell whose contact is not certain, nor its flags `flags`.
    fn of_contact(flags: Flags) -> Self {
        Self {
            in_doubt: (Flags::all() - INPUT) | flags,
            limits: [Limit::TooClose; _],
            centroid: Limit::TooClose,
            may_remember: MayRemember { contact: true, filter: true },
        }
    }

    /// The limit of one output other than the centroid.
    pub(crate) fn limit(&self, output: Outputs) -> Limit {
        self.limits[output.bits().ilog2() as usize]
    }

    pub(crate) fn set(&mut self, limits: impl IntoIterator<Item = GivenLimit>) {
        limits.into_iter().for_each(|(output, limit)| self.limits[output.bits().ilog2() as usize] = limit);
    }
}

/// Flags that tell of the input and of the field, not of a touch.
const INPUT: Flags = Flags::SATURATED
    .union(Flags::FAULTY_INPUT)
    .union(Flags::OUT_OF_RANGE)
    .union(Flags::INCOMPLETE)
    .union(Flags::NO_UNIT)
    .union(Flags::NO_CHART);

/// What a field's next bound depends on, besides what its next percept depends on.
#[derive(Clone, Debug, Default)]
struct Doubt {
    /// How far the centroid of the frame before may be off, as a distance in the unit.
    place: f64,
    /// That centroid is not known, as it was too close to call and is not in the percepts.
    unread: bool,
    filter: filter::Doubt,
    difference: difference::Doubt,
}

/// One field in one frame.
struct Cell<'a> {
    index: usize,
    pressures: &'a [Pressure],
    step: &'a Step,
    /// What the reference has.
    present: Outputs,
    /// What the frame before left of it.
    before: Before,
    /// Whether what the host remembers goes on, as it does unless the percept is kept.
    advances: bool,
    /// The batch that it is of, and the frame in it.
    raw: (&'a RawBatch<'a>, usize),
}

/// The reference, which says of every cell how far single precision may be off.
pub(crate) struct BoundedReference {
    reference: Reference,
    /// Per field, how far what the frame before left may be off in single precision.
    doubts: Vec<Doubt>,
    /// The pressures of the last frame, slot by slot.
    pressures: Vec<Pressure>,
}

impl BoundedReference {
    pub(crate) fn new(plan: &Plan) -> Self {
        Self {
            reference: Reference::new(plan),
            doubts: vec![Doubt::default(); plan.fields.len()],
            pressures: Vec::new(),
        }
    }

    pub(crate) fn recalibrate(&mut self, plan: &Plan) {
        self.reference.recalibrate(plan);
    }

    /// Runs frame `frame` of `raw`, and says how far single precision may be off in each of its cells. `advances` says
    /// whether what the host remembers of a field goes on with this frame.
    pub(crate) fn run(
        &mut self,
        raw: &RawBatch<'_>,
        frame: usize,
        percepts: &mut Percepts,
        advances: impl Fn(usize) -> bool,
    ) -> Vec<CellBound> {
        let (before, step) = (self.reference.before.clone(), &raw.steps[frame]);
        let (pressures, present) = self.reference.frame(raw, frame, percepts);
        let raw = (raw, frame);
        let cells = before.into_iter().zip(present).enumerate();
        let bounds = cells
            .map(|(index, (before, present))| {
                let advances = advances(index);
                self.bound(&Cell { index, pressures: &pressures, step, present, before, advances, raw })
            })
            .collect();
        self.pressures = pressures;
        bounds
    }

    /// The pressures of the frame that was run last, slot by slot.
    pub(crate) fn pressures(&self) -> &[Pressure] {
        &self.pressures
    }

    pub(crate) fn restore(&mut self, state: &BackendState) -> Result<()> {
        self.reference.restore(state)?;
        state.fields.iter().enumerate().for_each(|(index, field)| self.restore_field(index, *field));
        Ok(())
    }

    /// The same in field `index`, where the reference cannot tell what the other chose.
    pub(crate) fn restore_field(&mut self, index: usize, state: FieldState) {
        self.reference.restore_field(index, state);
        let field = &self.reference.plan.fields[index];
        let moves = state.contact && field.charted && self.reference.plan.stages().motion;
        (self.doubts[index].place, self.doubts[index].unread) = (0.0, moves && state.centroid.is_none());
    }

    /// The same for what the host's filter remembers.
    pub(crate) fn restore_filter(&mut self, index: usize, memory: &filter::Memory, trail: &difference::Memory) {
        self.doubts[index].filter = filter::Doubt::after(memory);
        self.doubts[index].difference = difference::Doubt::after(trail);
    }

    /// How far single precision may be off in `cell`.
    fn bound(&mut self, cell: &Cell<'_>) -> CellBound {
        let mut doubt = std::mem::take(&mut self.doubts[cell.index]);
        let bound = self.bound_after(cell, &mut doubt);
        self.doubts[cell.index] = doubt;
        bound
    }

    fn bound_after(&self, cell: &Cell<'_>, doubt: &mut Doubt) -> CellBound {
        let (plan, pressures) = (&self.reference.plan, cell.pressures);
        let field = &plan.fields[cell.index];
        let of_members = plan.members_of(field).iter().map(|member| pressures[member.slot as usize]);
        let (flags, in_doubt) = of_members.fold((Flags::empty(), false), |(flags, in_doubt), pressure| {
            (flags | pressure.flags_in_doubt, in_doubt || pressure.in_doubt)
        });
        if in_doubt {
            return CellBound::of_contact(flags);
        }
        let pressed = self.reference.pressed(field, pressures);
        let how = plan.sums(field.count);
        let sums = contact::bound(&pressed, how);
        let mut bound = CellBound { in_doubt: flags, ..CellBound::default() };
        bound.set(sums.limits());
        bound.set([(Outputs::FORCE, Limit::Within(force::bound(field.quantity, &pressed)))]);
        let total = contact::reference(&pressed).total;
        if hysteresis::in_doubt(total, sums.total, field.thresholds, cell.before.contact) {
            // Whether there is a touch at all is in doubt, and with it all that a touch has; the sums are not.
            let mut unsure = CellBound::of_contact(flags);
            unsure.set(
                (Outputs::of_stage("contact") | Outputs::FORCE).iter().map(|output| (output, bound.limit(output))),
            );
            return unsure;
        }
        let before = std::mem::replace(&mut doubt.place, 0.0);
        let unread = std::mem::take(&mut doubt.unread);
        if !hysteresis::reference(total, field.thresholds, cell.before.contact) {
            if cell.advances {
                doubt.filter.release();
                doubt.difference.release();
            }
            return bound;
        }
        let unit = f64::from(field.unit_m);
        let c = centroid::reference(&pressed);
        let c_bound = centroid::bound(&pressed, how);
        doubt.place = c_bound.truncate().length();
        bound.centroid = Limit::Within([c_bound.x * unit, c_bound.y * unit]);
        match &field.surface {
            Some(surface) => {
                let (position, normal) = surface.bound(doubt.place * unit);
                bound.set([(Outputs::POSITION, Limit::Within(position)), (Outputs::NORMAL, Limit::Within(normal))]);
            }
            None => {
                let position = c_bound.length() * unit + U * U * field.origin_in_anchor.length();
                bound.set([(Outputs::POSITION, Limit::Within(position))]);
            }
        }
        if field.charted {
            self.lines(&mut bound, &pressed, cell, [c.truncate(), c_bound.truncate()]);
        }
        let touched = motion::Centroid { place: c.truncate(), pressed: pressed.len() as u32 };
        if field.charted && plan.stages().motion {
            if unread {
                bound.set(Outputs::MOTION.iter().map(|output| (output, Limit::Unread)));
                bound.in_doubt |= Flags::NO_PREVIOUS | Flags::BAD_DT | Flags::STILL;
            } else {
                moved(&mut bound, field, cell, (touched, doubt.place), before);
            }
        }
        if field.charted && plan.stages().filter && cell.advances {
            followed(&mut bound, field, cell, touched, doubt);
        }
        if plan.stages().sigma {
            let sigmas = sigma::of_field(plan, field, cell.raw.0, cell.raw.1);
            let off = |components: [f64; 2]| sigmas.rounding() * components[0].hypot(components[1]);
            let limit = |(_, (output, components)): (_, Given)| (output, Limit::Within(components.map_or(0.0, off)));
            bound.set(sigmas.outputs().map(limit));
        }
        bound
    }

    /// Adds the bounds of orientation and axis about a centroid, which comes with its bound.
    fn lines(&self, bound: &mut CellBound, pressed: &[Pressed], cell: &Cell<'_>, [c, c_bound]: [DVec2; 2]) {
        if self.reference.plan.stages().orientation {
            let line = orientation::bound(pressed, c, c_bound);
            bound.set(line.limits(cell.present));
            bound.in_doubt |= line.in_doubt;
        }
        if self.reference.plan.stages().principal_axis {
            let how = self.reference.plan.sums(self.reference.plan.fields[cell.index].count);
            let axis = principal_axis::bound(pressed, how, c, c_bound);
            bound.set(axis.limits(cell.present));
            bound.in_doubt |= axis.line.in_doubt;
        }
    }
}

/// Adds the bounds of filtered motion, and follows the doubt about `touched` on.
fn followed(bound: &mut CellBound, field: &PlanField, cell: &Cell<'_>, touched: motion::Centroid, doubt: &mut Doubt) {
    let unit = f64::from(field.unit_m);
    let clock = filter::Clock::new(cell.step.dt_s, cell.step.flags);
    let in_metres = motion::Centroid { place: touched.place * unit, ..touched };
    let off = doubt.place * unit;
    let limit = match field.filter.over_s {
        Some(over_s) => doubt.difference.follow(&field.filter, over_s, clock, in_metres, off),
        None => doubt.filter.follow(&field.filter, clock, in_metres, off),
    };
    bound.in_doubt |= limit.in_doubt;
    bound.set(limit.limits());
    bound.may_remember.filter = limit.may_remember;
}

/// Adds the bounds of motion to `now`, a centroid with its bound as the one before has `before`.
fn moved(bound: &mut CellBound, field: &PlanField, cell: &Cell<'_>, now: (motion::Centroid, f64), before: f64) {
    let Some(then) = cell.before.centroid else { return };
    if !cell.step.flags.is_empty() {
        return;
    }
    let (unit, dt_s) = (f64::from(field.unit_m), cell.step.dt_s);
    let right = motion::reference(now.0, then, &field.still);
    let limit = motion::bound(now.0, then, &field.still, now.1, before);
    bound.set(limit.limits(&right, unit, dt_s));
    if limit.still_in_doubt {
        bound.in_doubt |= Flags::STILL;
    }
}
