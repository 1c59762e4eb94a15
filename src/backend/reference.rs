//! Backend `reference`: the stages' own f64, one cell after the other, and the bounds that the others are held to.

use super::{Backend, RawBatch};
use crate::error::Result;
use crate::percept::{Columns, Flags, Outputs, Percepts, Values};
use crate::scene::{Plan, PlanField};
use crate::stage::calibrate::{Pressure, UNUSABLE};
use crate::stage::{Pressed, U, axis, calibrate, centroid, contact, orientation, position};

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
}

/// The backend.
pub(crate) struct Reference {
    plan: Plan,
}

impl Reference {
    pub(crate) fn new(plan: &Plan) -> Self {
        Self { plan: plan.clone() }
    }

    /// One frame's pressures, taxel by taxel.
    fn pressures(&self, raw: &RawBatch<'_>, frame: usize) -> Vec<Pressure> {
        let values = &raw.values[frame * self.plan.slots()..][..self.plan.slots()];
        values.iter().zip(&self.plan.calibrations).map(|(&raw, taxel)| calibrate::reference(raw, taxel)).collect()
    }

    /// A field's pressed taxels, by ascending id.
    fn pressed(&self, field: &PlanField, pressures: &[Pressure]) -> Vec<Pressed> {
        self.plan
            .members_of(field)
            .iter()
            .zip(&field.places)
            .filter(|(member, _)| pressures[member.slot as usize].value > 0.0)
            .map(|(member, &place)| Pressed {
                weight: member.weight.into(),
                pressure: pressures[member.slot as usize].value,
                place,
                area: self.plan.areas[member.slot as usize],
            })
            .collect()
    }

    /// How far single precision may be off in every cell of `raw`, frame by frame.
    pub(crate) fn bounds(&self, raw: &RawBatch<'_>) -> Vec<CellBound> {
        let mut bounds = Vec::with_capacity(raw.frames * self.plan.fields.len());
        for frame in 0..raw.frames {
            let pressures = self.pressures(raw, frame);
            for field in &self.plan.fields {
                bounds.push(self.bound(field, &pressures));
            }
        }
        bounds
    }

    fn bound(&self, field: &PlanField, pressures: &[Pressure]) -> CellBound {
        if self.plan.members_of(field).iter().any(|member| pressures[member.slot as usize].in_doubt) {
            return CellBound { in_doubt: Flags::all(), ..CellBound::default() };
        }
        let pressed = self.pressed(field, pressures);
        let sums = contact::bound(&pressed);
        let mut bound =
            CellBound { total: Some(sums.total), peak: Some(sums.peak), area: Some(sums.area), ..CellBound::default() };
        if pressed.is_empty() {
            return bound;
        }
        let unit = f64::from(field.unit_m);
        let c = centroid::reference(&pressed);
        let c_bound = centroid::bound(&pressed);
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
                let axis = axis::bound(&pressed, c, c_bound);
                (bound.axis, bound.anisotropy) = (axis.line.angle, axis.anisotropy);
                bound.in_doubt |= axis.line.in_doubt;
            }
        }
        bound
    }

    fn cell(&self, field: &PlanField, pressures: &[Pressure], columns: &mut Columns<f64>, cell: usize) -> Cell {
        let statuses = self.plan.members_of(field).iter().map(|member| pressures[member.slot as usize].status);
        let (any, all) = statuses.fold((0, u32::MAX), |(any, all), status| (any | status, all & status));
        let mut flags = Flags::from_bits_truncate(any & !UNUSABLE);
        let mut present = Outputs::empty();
        if !field.charted {
            flags |= Flags::NO_CHART;
        }
        let pressed = self.pressed(field, pressures);
        let sums = contact::reference(&pressed);
        let outputs = self.plan.outputs;
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
        if pressed.is_empty() {
            flags |= Flags::NO_CONTACT;
            return Cell { flags, present, active: 0 };
        }
        let stages = self.plan.stages();
        let c = centroid::reference(&pressed);
        if stages.centroid {
            let place = if field.charted { c.truncate().extend(0.0) } else { c };
            columns.centroid[cell] = (place * f64::from(field.unit_m)).to_array();
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
        Cell { flags, present, active: sums.active }
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

    fn run(&mut self, raw: &RawBatch<'_>, percepts: &mut Percepts) -> Result<()> {
        let fields = self.plan.fields.len();
        for frame in 0..raw.frames {
            let pressures = self.pressures(raw, frame);
            for (index, field) in self.plan.fields.iter().enumerate() {
                let cell = frame * fields + index;
                let Values::F64(columns) = &mut percepts.values else {
                    unreachable!("the engine made percepts of this precision")
                };
                let done = self.cell(field, &pressures, columns, cell);
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
