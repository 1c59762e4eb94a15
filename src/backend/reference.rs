//! Backend `reference`: the stages' own f64, one cell after the other, and the bounds that the others are held to.

use super::{Backend, RawBatch, Step};
use crate::error::Result;
use crate::percept::{Columns, Flags, Outputs, Percepts, Values};
use crate::scene::{Plan, PlanField};
use crate::signal::RawValue;
use crate::stage::calibrate::{Pressure, UNUSABLE};
use crate::stage::change::Heard;
use crate::stage::hysteresis::ContactState;
use crate::stage::layout::Member;
use crate::stage::touches::TouchBound;
use crate::stage::{
    Pressed, U, axis, calibrate, centroid, change, contact, filter, hysteresis, motion, orientation, position, touches,
};

/// How far a single-precision percept may be off in one cell. `None`: the reference's own margin to a decision is under
/// the bound, so that the quantity is not compared.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct CellBound {
    /// Flags that may differ.
    pub(crate) in_doubt: Flags,
    pub(crate) total: Option<f64>,
    pub(crate) peak: Option<f64>,
    pub(crate) area: Option<f64>,
    /// Per coordinate, m.
    pub(crate) centroid: Option<[f64; 2]>,
    /// As a distance, m.
    pub(crate) position: Option<f64>,
    pub(crate) normal: Option<f64>,
    pub(crate) orientation: Option<f64>,
    pub(crate) axis: Option<f64>,
    pub(crate) anisotropy: Option<f64>,
    /// As a distance, m.
    pub(crate) displacement: Option<f64>,
    pub(crate) direction: Option<f64>,
    pub(crate) distance: Option<f64>,
    pub(crate) radial_distance: Option<f64>,
    pub(crate) speed: Option<f64>,
    pub(crate) radial_speed: Option<f64>,
    /// A touch's, with its place in m; `None` from the first doubt on, as identities remember.
    pub(crate) touch: Option<TouchBound>,
    /// As a distance, m.
    pub(crate) filtered_displacement: Option<f64>,
    pub(crate) filtered_direction: Option<f64>,
    pub(crate) filtered_speed: Option<f64>,
}

/// The backend.
pub(crate) struct Reference {
    plan: Plan,
    /// Per field, what the frame before left.
    before: Vec<Before>,
    /// The raw values of the frame before, by channel.
    raw_before: Vec<RawValue>,
    /// The same two for the bounds, which are worked out apart.
    bound_before: Vec<BoundBefore>,
    bound_raw_before: Vec<RawValue>,
}

/// What a field's next percept hangs on.
#[derive(Clone, Copy, Debug, Default)]
struct Before {
    contact: bool,
    /// The centroid in the field's unit, if it was in contact and has a chart.
    centroid: Option<motion::Centroid>,
}

/// What a field's next bound hangs on.
#[derive(Clone, Copy, Debug, Default)]
struct BoundBefore {
    state: ContactState,
    /// The centroid, and its bound as a distance.
    centroid: Option<(motion::Centroid, f64)>,
    touches: touches::Doubt,
    filter: filter::Doubt,
}

impl Reference {
    pub(crate) fn new(plan: &Plan) -> Self {
        let fields = plan.fields.len();
        Self {
            plan: plan.clone(),
            before: vec![Before::default(); fields],
            raw_before: vec![RawValue::MISSING; plan.channels()],
            bound_before: vec![BoundBefore::default(); fields],
            bound_raw_before: vec![RawValue::MISSING; plan.channels()],
        }
    }

    /// One frame's pressures and changes, slot by slot; `before` has the raw values of the frame before.
    fn pressures(&self, values: &[RawValue], before: &[RawValue], step: &Step) -> Vec<Pressure> {
        let plan = &self.plan;
        let heard = |values: &[RawValue], slot: usize| {
            let (channel, knots) = (plan.channel_of(slot), plan.knots_of(slot));
            let raw = values[channel];
            Heard { raw, pressure: calibrate::reference(raw, &plan.calibrations[channel], knots) }
        };
        let mut pressures: Vec<Pressure> = (0..plan.calibrated()).map(|slot| heard(values, slot).pressure).collect();
        for taxel in &plan.taxels[plan.calibrated()..] {
            let slot = taxel.response as usize;
            let now = Heard { raw: values[plan.channel_of(slot)], pressure: pressures[slot] };
            pressures.push(change::reference(now, heard(before, slot), step.dt_s, step.flags, taxel.dead_band));
        }
        pressures
    }

    /// A field's pressed taxels, by ascending id.
    fn pressed(&self, field: &PlanField, pressures: &[Pressure]) -> Vec<Pressed> {
        self.plan
            .members_of(field)
            .iter()
            .zip(&field.places)
            .filter(|(member, _)| pressures[member.slot as usize].value > 0.0)
            .map(|(member, &place)| {
                let Pressure { value, bound, .. } = pressures[member.slot as usize];
                Pressed {
                    weight: member.weight.into(),
                    pressure: value,
                    excess: (bound - 2.0 * U * value).max(0.0),
                    place,
                    area: self.plan.areas[self.plan.channel_of(member.slot as usize)],
                }
            })
            .collect()
    }

    /// How far single precision may be off in every cell of `raw`, frame by frame.
    pub(crate) fn bounds(&mut self, raw: &RawBatch<'_>) -> Vec<CellBound> {
        let mut bounds = Vec::with_capacity(raw.frames * self.plan.fields.len());
        for frame in 0..raw.frames {
            let values: Vec<RawValue> = raw.rows.row(frame).collect();
            let pressures = self.pressures(&values, &self.bound_raw_before, &raw.steps[frame]);
            self.bound_raw_before = values;
            for index in 0..self.plan.fields.len() {
                let (bound, before) = self.bound(index, &pressures, &raw.steps[frame]);
                self.bound_before[index] = before;
                bounds.push(bound);
            }
        }
        bounds
    }

    fn bound(&self, index: usize, pressures: &[Pressure], step: &Step) -> (CellBound, BoundBefore) {
        let (field, before) = (&self.plan.fields[index], self.bound_before[index]);
        let state = ContactState { contact: false, in_doubt: true };
        let filter = filter::Doubt::of_contact();
        let unknown = BoundBefore { state, centroid: None, touches: touches::Doubt::FOR_GOOD, filter };
        if self.plan.members_of(field).iter().any(|member| pressures[member.slot as usize].in_doubt) {
            return (CellBound { in_doubt: Flags::all(), ..CellBound::default() }, unknown);
        }
        let pressed = self.pressed(field, pressures);
        let how = self.plan.sums(field.count);
        let sums = contact::bound(&pressed, how);
        let mut bound =
            CellBound { total: Some(sums.total), peak: Some(sums.peak), area: Some(sums.area), ..CellBound::default() };
        let total = contact::reference(&pressed).total;
        let state = hysteresis::doubt(total, sums.total, field.thresholds, before.state);
        if state.in_doubt {
            // Whether there is a touch at all is in doubt, and with it all that a touch has; the sums are not.
            bound.in_doubt = Flags::all() - INPUT;
            return (bound, BoundBefore { state, ..unknown });
        }
        if !state.contact {
            return (bound, BoundBefore { state, touches: before.touches.release(), ..BoundBefore::default() });
        }
        let unit = f64::from(field.unit_m);
        let c = centroid::reference(&pressed);
        let c_bound = centroid::bound(&pressed, how);
        bound.centroid = Some([c_bound.x * unit, c_bound.y * unit]);
        match &field.lift {
            Some(lift) => {
                let (position, normal) = position::bound(lift, c_bound.truncate().length() * unit);
                (bound.position, bound.normal) = (Some(position), Some(normal));
            }
            None => bound.position = Some(c_bound.length() * unit + U * U * field.origin_in_anchor.length()),
        }
        if field.charted {
            let (c, c_bound) = (c.truncate(), c_bound.truncate());
            if self.plan.stages().orientation {
                let line = orientation::bound(&pressed, c, c_bound);
                bound.orientation = line.angle;
                bound.in_doubt |= line.in_doubt;
            }
            if self.plan.stages().axis {
                let axis = axis::bound(&pressed, how, c, c_bound);
                (bound.axis, bound.anisotropy) = (axis.line.angle, axis.anisotropy);
                bound.in_doubt |= axis.line.in_doubt;
            }
        }
        let touched = motion::Centroid { place: c.truncate(), pressed: pressed.len() as u32 };
        let kept = (field.charted && self.plan.stages().motion).then(|| (touched, c_bound.truncate().length()));
        if let Some(now) = kept {
            moved(&mut bound, field, now, before, step);
        }
        let mut touches = before.touches;
        if self.plan.stages().touches {
            let pull = |member: &Member| f64::from(member.weight) * pressures[member.slot as usize].value;
            let pulls: Vec<f64> = self.plan.members_of(field).iter().map(pull).collect();
            let lost = pressed.iter().map(|taxel| taxel.excess / taxel.pressure).fold(0.0, f64::max);
            touches = touches.after(&field.skin(), &pulls, c, lost);
            let limit = touches::bound(lost);
            bound.touch = (!touches.in_doubt).then_some(TouchBound { place: limit.place * unit, ..limit });
        }
        let mut filter = before.filter;
        if field.charted && self.plan.stages().filter {
            let clock = filter::Clock::new(step.dt_s, step.flags);
            let in_metres = motion::Centroid { place: touched.place * unit, ..touched };
            let limit = filter.follow(&field.filter, clock, in_metres, c_bound.truncate().length() * unit);
            bound.in_doubt |= limit.in_doubt;
            bound.filtered_displacement = limit.displacement;
            bound.filtered_direction = limit.direction;
            bound.filtered_speed = limit.speed;
        }
        (bound, BoundBefore { state, centroid: kept, touches, filter })
    }

    fn cell(
        &self,
        index: usize,
        pressures: &[Pressure],
        step: &Step,
        columns: &mut Columns<f64>,
        cell: usize,
    ) -> (Cell, Before) {
        let (field, before) = (&self.plan.fields[index], self.before[index]);
        let statuses = self.plan.members_of(field).iter().map(|member| pressures[member.slot as usize].status);
        let (any, all) = statuses.fold((0, u32::MAX), |(any, all), status| (any | status, all & status));
        let mut flags = Flags::from_bits_truncate(any & !UNUSABLE);
        let mut present = Outputs::empty();
        if !field.charted {
            flags |= Flags::NO_CHART;
        }
        let pressed = self.pressed(field, pressures);
        let sums = contact::reference(&pressed);
        let outputs = self.plan.columns;
        let write = |output, column: &mut Vec<f64>, value| {
            if outputs.contains(output) {
                column[cell] = value;
            }
        };
        if all & UNUSABLE == 0 {
            present |= Outputs::TOTAL | Outputs::PEAK | Outputs::ACTIVE;
            if field.area_known {
                present |= Outputs::AREA;
            }
            write(Outputs::TOTAL, &mut columns.total, sums.total);
            write(Outputs::PEAK, &mut columns.peak, sums.peak);
            write(Outputs::AREA, &mut columns.area, sums.area);
        }
        let contact = hysteresis::reference(sums.total, field.thresholds, before.contact);
        let mut after = Before { contact, centroid: None };
        if !contact {
            flags |= Flags::NO_CONTACT;
            return (Cell { flags, present, active: sums.active }, after);
        }
        let stages = self.plan.stages();
        let c = centroid::reference(&pressed);
        if stages.centroid {
            let place = if field.charted { c.truncate().extend(0.0) } else { c };
            // The stages that stand on it may be wanted without it.
            if !columns.centroid_u.is_empty() {
                columns.set_centroid(cell, (place * f64::from(field.unit_m)).to_array());
            }
            present |= Outputs::POSITION;
            if field.charted {
                present |= Outputs::CENTROID | Outputs::NORMAL;
            }
        }
        if field.charted && stages.orientation {
            let line = orientation::reference(&pressed, c.truncate());
            flags |= line.flags;
            if let Some(angle) = line.angle {
                write(Outputs::ORIENTATION, &mut columns.orientation, angle);
                present |= Outputs::ORIENTATION;
            }
        }
        if field.charted && stages.axis {
            let axis = axis::reference(&pressed, c.truncate());
            flags |= axis.line.flags;
            if let Some(anisotropy) = axis.anisotropy {
                write(Outputs::ANISOTROPY, &mut columns.anisotropy, anisotropy);
                present |= Outputs::ANISOTROPY;
            }
            if let Some(angle) = axis.line.angle {
                write(Outputs::AXIS, &mut columns.axis, angle);
                present |= Outputs::AXIS;
            }
        }
        if field.charted && stages.motion {
            let now = motion::Centroid { place: c.truncate(), pressed: sums.active };
            after.centroid = Some(now);
            match before.centroid {
                None => flags |= Flags::NO_PREVIOUS,
                Some(_) if !step.flags.is_empty() => flags |= step.flags,
                Some(then) => {
                    let moved = motion::reference(now, then, &field.still);
                    present |= Outputs::MOTION;
                    let unit = f64::from(field.unit_m);
                    write(Outputs::DISTANCE, &mut columns.distance, moved.distance * unit);
                    write(Outputs::RADIAL_DISTANCE, &mut columns.radial_distance, moved.radial_distance * unit);
                    write(Outputs::SPEED, &mut columns.speed, moved.distance * unit / step.dt_s);
                    write(Outputs::RADIAL_SPEED, &mut columns.radial_speed, moved.radial_distance * unit / step.dt_s);
                    if let Some(displacement) = columns.displacement.get_mut(cell) {
                        *displacement = (moved.displacement * unit).to_array();
                    }
                    match moved.direction {
                        Some(direction) => write(Outputs::DIRECTION, &mut columns.direction, direction),
                        None => {
                            flags |= Flags::STILL;
                            present -= Outputs::DIRECTION;
                        }
                    }
                }
            }
        }
        (Cell { flags, present, active: sums.active }, after)
    }
}

/// Flags that tell of the input and of the field, not of a touch.
const INPUT: Flags = Flags::SATURATED
    .union(Flags::FAULTY_INPUT)
    .union(Flags::OUT_OF_RANGE)
    .union(Flags::INCOMPLETE)
    .union(Flags::NO_CHART);

/// Adds the bounds of motion from `before` to `now`, a centroid with its bound.
fn moved(bound: &mut CellBound, field: &PlanField, now: (motion::Centroid, f64), before: BoundBefore, step: &Step) {
    let Some(then) = before.centroid else {
        if before.state.in_doubt {
            bound.in_doubt |= Flags::NO_PREVIOUS | Flags::BAD_DT | Flags::STILL;
        }
        return;
    };
    if !step.flags.is_empty() {
        return;
    }
    let unit = f64::from(field.unit_m);
    let right = motion::reference(now.0, then.0, &field.still);
    let limit = motion::bound(now.0, then.0, &field.still, now.1, then.1);
    bound.displacement = Some(limit.displacement * unit);
    bound.direction = limit.direction;
    bound.distance = Some(limit.distance * unit);
    bound.radial_distance = Some(limit.radial_distance * unit);
    bound.speed = Some(motion::rate_bound(right.distance, limit.distance, step.dt_s) * unit);
    bound.radial_speed = Some(motion::rate_bound(right.radial_distance, limit.radial_distance, step.dt_s) * unit);
    if limit.still_in_doubt {
        bound.in_doubt |= Flags::STILL;
    }
}

/// What a cell holds beside its columns.
struct Cell {
    flags: Flags,
    present: Outputs,
    active: u32,
}

impl Backend for Reference {
    fn name(&self) -> &'static str {
        "reference"
    }

    fn describe(&self) -> String {
        "double precision, as the equations read, one thread".to_owned()
    }

    fn restart(&mut self) {
        self.before.fill(Before::default());
        self.bound_before.fill(BoundBefore::default());
    }

    fn recalibrate(&mut self, plan: &Plan) {
        self.plan.recalibrate(plan);
    }

    fn run(&mut self, raw: &RawBatch<'_>, percepts: &mut Percepts) -> Result<()> {
        let fields = self.plan.fields.len();
        for frame in 0..raw.frames {
            let values: Vec<RawValue> = raw.rows.row(frame).collect();
            let pressures = self.pressures(&values, &self.raw_before, &raw.steps[frame]);
            self.raw_before = values;
            if !percepts.pressures.is_empty() {
                let slots = self.plan.slots();
                let kept = &mut percepts.pressures[(raw.first + frame) * slots..][..slots];
                kept.iter_mut().zip(&pressures).for_each(|(kept, pressure)| *kept = pressure.value);
            }
            for index in 0..fields {
                let cell = (raw.first + frame) * fields + index;
                let Values::F64(columns) = &mut percepts.values else {
                    unreachable!("the engine made percepts of this precision")
                };
                let (done, after) = self.cell(index, &pressures, &raw.steps[frame], columns, cell);
                self.before[index] = after;
                percepts.flags[cell] = done.flags;
                percepts.present[cell] = done.present & self.plan.outputs;
                if let Some(active) = percepts.active.get_mut(cell) {
                    *active = done.active;
                }
            }
        }
        Ok(())
    }
}
