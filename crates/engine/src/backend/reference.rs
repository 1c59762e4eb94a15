//! Backend `reference`: the stages' own f64, one cell after the other, and the bounds for the others.

use super::{Backend, BackendState, FieldState, RawBatch, Step};
use crate::error::Result;
use crate::percept::{Component, Components, Flags, Outputs, Percepts, Store, Values};
use crate::scene::{Plan, PlanField};
use crate::signal::RawValue;
use crate::stage::calibrate::{Pressure, UNUSABLE};
use crate::stage::change::Heard;
use crate::stage::{
    Given, Pressed, U, calibrate, centroid, change, contact, hysteresis, motion, orientation, principal_axis,
};

/// The backend.
pub(crate) struct Reference {
    pub(super) plan: Plan,
    /// Per field, what the frame before left.
    pub(super) before: Vec<Before>,
    /// The raw values of the frame before, by channel.
    raw_before: Vec<RawValue>,
}

/// What a field's next percept depends on.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Before {
    pub(super) contact: bool,
    /// The centroid in the field's unit, if it was in contact and has a chart.
    pub(super) centroid: Option<motion::Centroid>,
}

impl Before {
    fn in_metres(self, field: &PlanField) -> FieldState {
        let in_metres = |c: motion::Centroid| motion::Centroid { place: c.place * f64::from(field.unit_m), ..c };
        FieldState { contact: self.contact, centroid: self.centroid.map(in_metres) }
    }
}

impl Reference {
    pub(crate) fn new(plan: &Plan) -> Self {
        let fields = plan.fields.len();
        Self {
            plan: plan.clone(),
            before: vec![Before::default(); fields],
            raw_before: vec![RawValue::MISSING; plan.channels()],
        }
    }

    pub(super) fn restore_field(&mut self, index: usize, state: FieldState) {
        let field = &self.plan.fields[index];
        let moves = state.contact && field.charted && self.plan.stages().motion;
        let in_unit = |c: motion::Centroid| motion::Centroid { place: c.place / f64::from(field.unit_m), ..c };
        let centroid = state.centroid.filter(|_| moves).map(in_unit);
        self.before[index] = Before { contact: state.contact, centroid };
    }

    /// One frame's pressures and changes, slot by slot; `before` has the raw values of the frame before.
    fn pressures(&self, values: &[RawValue], before: &[RawValue], step: &Step) -> Vec<Pressure> {
        let plan = &self.plan;
        let heard = |values: &[RawValue], slot: usize| {
            let (channel, curve) = (plan.channel_of(slot), plan.curve_of(slot));
            let raw = values[channel];
            Heard { raw, pressure: calibrate::reference(raw, &plan.calibrations[channel], curve) }
        };
        let mut pressures: Vec<Pressure> = (0..plan.calibrated()).map(|slot| heard(values, slot).pressure).collect();
        for taxel in &plan.taxels[plan.calibrated()..] {
            let slot = taxel.response as usize;
            let now = Heard { raw: values[plan.channel_of(slot)], pressure: pressures[slot] };
            pressures.push(change::reference(now, heard(before, slot), step.dt_s, step.flags, plan.change_dead_band));
        }
        pressures
    }

    /// A field's pressed taxels, by ascending id.
    pub(super) fn pressed(&self, field: &PlanField, pressures: &[Pressure]) -> Vec<Pressed> {
        self.plan
            .members_of(field)
            .iter()
            .enumerate()
            .filter(|(_, member)| pressures[member.slot as usize].value > 0.0)
            .map(|(index, member)| {
                let Pressure { value, bound, .. } = pressures[member.slot as usize];
                let weight = self.plan.weight(field, index);
                Pressed {
                    weight,
                    weight_rounding: (f64::from(member.weight) - weight).abs(),
                    pressure: value,
                    excess: (bound - 2.0 * U * value).max(0.0),
                    place: field.places[index],
                    area: self.plan.areas[self.plan.channel_of(member.slot as usize)],
                }
            })
            .collect()
    }

    /// Runs frame `frame` of `raw`; gives its pressures, slot by slot, and what is present in each field.
    pub(super) fn frame(
        &mut self,
        raw: &RawBatch<'_>,
        frame: usize,
        percepts: &mut Percepts,
    ) -> (Vec<Pressure>, Vec<Outputs>) {
        let (fields, step) = (self.plan.fields.len(), &raw.steps[frame]);
        let values: Vec<RawValue> = raw.rows.row(frame).collect();
        let pressures = self.pressures(&values, &self.raw_before, step);
        self.raw_before = values;
        if !percepts.pressures.is_empty() {
            let slots = self.plan.slots();
            let kept = &mut percepts.pressures[(raw.first + frame) * slots..][..slots];
            kept.iter_mut().zip(&pressures).for_each(|(kept, pressure)| *kept = pressure.value);
        }
        let mut present = Vec::with_capacity(fields);
        for index in 0..fields {
            let cell = (raw.first + frame) * fields + index;
            let Values::F64(parts) = &mut percepts.values else {
                unreachable!("the engine made percepts of this precision")
            };
            let mut made = Cell { parts, at: cell, active: 0, flags: Flags::empty(), present: Outputs::empty() };
            self.before[index] = self.cell(index, &pressures, step, &mut made);
            let Cell { active, flags, present: has, .. } = made;
            percepts.flags[cell] = flags;
            percepts.set_present(cell, has & self.plan.outputs);
            if let Some(to) = percepts.active.get_mut(cell) {
                *to = active;
            }
            present.push(has);
        }
        (pressures, present)
    }

    /// Makes a cell; gives what the field's next one depends on.
    fn cell(&self, index: usize, pressures: &[Pressure], step: &Step, made: &mut Cell<'_>) -> Before {
        let (field, before) = (&self.plan.fields[index], self.before[index]);
        let statuses = self.plan.members_of(field).iter().map(|member| pressures[member.slot as usize].status);
        let (any, all) = statuses.fold((0, u32::MAX), |(any, all), status| (any | status, all & status));
        made.flags = Flags::from_bits_truncate(any & !UNUSABLE);
        made.flags.set(Flags::NO_CHART, !field.charted);
        let pressed = self.pressed(field, pressures);
        let sums = contact::reference(&pressed);
        made.active = sums.active;
        if all & UNUSABLE == 0 {
            made.give(&sums.outputs(field.area_known));
        }
        let contact = hysteresis::reference(sums.total, field.thresholds, before.contact);
        let mut after = Before { contact, centroid: None };
        if !contact {
            made.flags |= Flags::NO_CONTACT;
            return after;
        }
        let (stages, unit_m) = (self.plan.stages(), f64::from(field.unit_m));
        let c = centroid::reference(&pressed);
        if stages.centroid {
            let place = if field.charted { c.truncate().extend(0.0) } else { c };
            made.put_centroid((place * unit_m).to_array());
            made.present |= Outputs::POSITION;
            if field.charted {
                made.present |= Outputs::CENTROID | Outputs::NORMAL;
            }
        }
        if !field.charted {
            return after;
        }
        if stages.orientation {
            let line = orientation::reference(&pressed, c.truncate());
            made.flags |= line.flags;
            made.give(&line.outputs());
        }
        if stages.principal_axis {
            let axis = principal_axis::reference(&pressed, c.truncate());
            made.flags |= axis.line.flags;
            made.give(&axis.outputs());
        }
        if stages.motion {
            let now = motion::Centroid { place: c.truncate(), pressed: sums.active };
            after.centroid = Some(now);
            match before.centroid {
                None => made.flags |= Flags::NO_PREVIOUS,
                Some(_) if !step.flags.is_empty() => made.flags |= step.flags,
                Some(then) => {
                    let moved = motion::reference(now, then, &field.still);
                    made.flags.set(Flags::STILL, moved.direction.is_none());
                    made.give(&moved.outputs(unit_m, step.dt_s));
                }
            }
        }
        after
    }
}

struct Cell<'a> {
    parts: &'a mut Components<f64>,
    at: usize,
    active: u32,
    flags: Flags,
    present: Outputs,
}

impl Cell<'_> {
    /// Takes what a stage gives, where that is kept; it is present in any case, as later stages may stand on it.
    fn give(&mut self, outputs: &[Given]) {
        for &(output, components) in outputs {
            let Some(components) = components else { continue };
            self.present |= output;
            for column in output.columns() {
                let Store::Backend(parts) = column.store else { continue };
                for (&part, component) in parts.iter().zip(components) {
                    self.put(part, component);
                }
            }
        }
    }

    fn put(&mut self, part: Component, value: f64) {
        if let Some(to) = self.parts[part].get_mut(self.at) {
            *to = value;
        }
    }

    /// (u, v, depth), m.
    fn put_centroid(&mut self, place: [f64; 3]) {
        let parts = [Component::CentroidU, Component::CentroidV, Component::CentroidDepth];
        parts.into_iter().zip(place).for_each(|(part, value)| self.put(part, value));
    }
}

impl Backend for Reference {
    fn name(&self) -> &'static str {
        "reference"
    }

    fn describe(&self) -> String {
        "double precision, as the equations read, one thread".to_owned()
    }

    fn state(&mut self) -> Result<BackendState> {
        let fields = self.before.iter().zip(self.plan.fields.iter());
        let fields = fields.map(|(before, field)| before.in_metres(field)).collect();
        Ok(BackendState { raw: self.raw_before.clone(), fields })
    }

    fn restore(&mut self, state: &BackendState) -> Result<()> {
        self.raw_before.clone_from(&state.raw);
        for (index, field) in state.fields.iter().enumerate() {
            self.restore_field(index, *field);
        }
        Ok(())
    }

    fn recalibrate(&mut self, plan: &Plan) {
        self.plan.recalibrate(plan);
    }

    fn run(&mut self, raw: &RawBatch<'_>, percepts: &mut Percepts) -> Result<()> {
        for frame in 0..raw.frames {
            self.frame(raw, frame, percepts);
        }
        Ok(())
    }
}
