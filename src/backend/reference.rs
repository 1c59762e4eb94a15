//! Backend `reference`: the stages' own f64, one cell after the other, and the bounds that the others are held to.

use super::bounds::{self, CellBound, Doubt};
use super::{Backend, RawBatch, Step};
use crate::error::Result;
use crate::percept::{Columns, Flags, Outputs, Percepts, Values};
use crate::scene::{Plan, PlanField};
use crate::signal::RawValue;
use crate::stage::calibrate::{Pressure, UNUSABLE};
use crate::stage::change::Heard;
use crate::stage::{Pressed, U, axis, calibrate, centroid, change, contact, hysteresis, motion, orientation};

/// The backend.
pub(crate) struct Reference {
    pub(super) plan: Plan,
    /// Per field, what the frame before left.
    pub(super) before: Vec<Before>,
    /// The raw values of the frame before, by channel.
    raw_before: Vec<RawValue>,
    /// Per field, how far that may be off in single precision.
    pub(super) doubts: Vec<Doubt>,
}

/// What a field's next percept hangs on.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Before {
    pub(super) contact: bool,
    /// The centroid in the field's unit, if it was in contact and has a chart.
    pub(super) centroid: Option<motion::Centroid>,
}

impl Reference {
    pub(crate) fn new(plan: &Plan) -> Self {
        let fields = plan.fields.len();
        Self {
            plan: plan.clone(),
            before: vec![Before::default(); fields],
            raw_before: vec![RawValue::MISSING; plan.channels()],
            doubts: vec![Doubt::default(); fields],
        }
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

    /// Runs frame `frame` of `raw`, and says how far single precision may be off in each of its cells. `advances` says
    /// whether what the host remembers of a field goes on with this frame.
    pub(crate) fn checked(
        &mut self,
        raw: &RawBatch<'_>,
        frame: usize,
        percepts: &mut Percepts,
        advances: impl Fn(usize) -> bool,
    ) -> Vec<CellBound> {
        let (before, step) = (self.before.clone(), &raw.steps[frame]);
        let (pressures, present) = self.frame(raw, frame, percepts);
        let cells = before.into_iter().zip(present).enumerate();
        cells
            .map(|(index, (before, present))| {
                let advances = advances(index);
                self.bound(&bounds::Cell { index, pressures: &pressures, step, present, before, advances })
            })
            .collect()
    }

    /// Runs frame `frame` of `raw`; gives its pressures, slot by slot, and what is present in each field.
    fn frame(&mut self, raw: &RawBatch<'_>, frame: usize, percepts: &mut Percepts) -> (Vec<Pressure>, Vec<Outputs>) {
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
            let Values::F64(columns) = &mut percepts.values else {
                unreachable!("the engine made percepts of this precision")
            };
            let (done, after) = self.cell(index, &pressures, step, columns, cell);
            self.before[index] = after;
            percepts.flags[cell] = done.flags;
            percepts.present[cell] = done.present & self.plan.outputs;
            if let Some(active) = percepts.active.get_mut(cell) {
                *active = done.active;
            }
            present.push(done.present);
        }
        (pressures, present)
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
        self.doubts.fill(Doubt::default());
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
