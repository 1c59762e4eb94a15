//! Which numbers a plan has the device write, and in which column of its results.

use super::stage::Constants;
use crate::percept::Outputs;
use crate::scene::Plan;

/// A column of the results: a number for each frame and field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Column {
    /// A cell's flags and what is present; always the first.
    Status,
    Total,
    Peak,
    Active,
    Area,
    U,
    V,
    Depth,
    Orientation,
    Axis,
    Anisotropy,
    /// Flags and quantities present that motion adds to the cell's.
    Motion,
    DisplacementU,
    DisplacementV,
    Direction,
    Distance,
    RadialDistance,
    Speed,
    RadialSpeed,
}

/// The columns that a plan needs, those first that are read back.
pub(super) struct Columns {
    all: Vec<Column>,
    read: usize,
}

impl Columns {
    pub(super) fn new(plan: &Plan) -> Self {
        let (outputs, stages) = (plan.outputs, plan.stages());
        let place = Outputs::POSITION | Outputs::NORMAL;
        let centroid = place | Outputs::CENTROID | Outputs::FILTERED;
        let wanted = [
            (Column::Total, Outputs::TOTAL),
            (Column::Peak, Outputs::PEAK),
            (Column::Active, Outputs::ACTIVE | Outputs::FILTERED),
            (Column::Area, Outputs::AREA),
            (Column::U, centroid),
            (Column::V, centroid),
            (Column::Depth, place),
            (Column::Orientation, Outputs::ORIENTATION),
            (Column::Axis, Outputs::AXIS),
            (Column::Anisotropy, Outputs::ANISOTROPY),
            (Column::Motion, Outputs::MOTION),
            (Column::DisplacementU, Outputs::DISPLACEMENT),
            (Column::DisplacementV, Outputs::DISPLACEMENT),
            (Column::Direction, Outputs::DIRECTION),
            (Column::Distance, Outputs::DISTANCE),
            (Column::RadialDistance, Outputs::RADIAL_DISTANCE),
            (Column::Speed, Outputs::SPEED),
            (Column::RadialSpeed, Outputs::RADIAL_SPEED),
        ];
        let mut all = vec![Column::Status];
        all.extend(wanted.iter().filter(|(_, some)| outputs.intersects(*some)).map(|(column, _)| *column));
        let read = all.len();
        // What only later stages read.
        let needed = [
            (Column::Total, stages.hysteresis),
            (Column::Active, stages.motion),
            (Column::U, stages.motion),
            (Column::V, stages.motion),
        ];
        for (column, _) in needed.iter().filter(|(_, needed)| *needed) {
            if !all.contains(column) {
                all.push(*column);
            }
        }
        Self { all, read }
    }

    /// Number of columns on the device.
    pub(super) fn count(&self) -> usize {
        self.all.len()
    }

    /// Those that are read back, in their order.
    pub(super) fn read(&self) -> &[Column] {
        &self.all[..self.read]
    }

    /// Where `column` stands, as the shaders' overrides say it.
    fn at(&self, column: Column) -> f64 {
        self.all.iter().position(|other| *other == column).map_or(u32::MAX.into(), |at| at as f64)
    }

    /// The overrides of `names`, which are columns.
    fn overrides<'a>(&self, names: &[(&'a str, Column)]) -> Vec<(&'a str, f64)> {
        names.iter().map(|&(name, column)| (name, self.at(column))).collect()
    }

    /// What the program over fields is told.
    pub(super) fn of_fields(&self, plan: &Plan) -> Vec<(&'static str, f64)> {
        let mut overrides = self.overrides(&[
            ("TOTAL_AT", Column::Total),
            ("PEAK_AT", Column::Peak),
            ("ACTIVE_AT", Column::Active),
            ("AREA_AT", Column::Area),
            ("CENTROID_AT", Column::U),
            ("DEPTH_AT", Column::Depth),
            ("ORIENTATION_AT", Column::Orientation),
            ("AXIS_AT", Column::Axis),
            ("ANISOTROPY_AT", Column::Anisotropy),
        ]);
        let stages = plan.stages();
        let said = [
            ("CENTRED", stages.centroid),
            ("ORIENTED", stages.orientation),
            ("AXED", stages.axis),
            ("COMPENSATED", plan.is_compensated()),
            ("UNWEIGHTED", plan.fields.iter().all(|field| field.unweighted)),
        ];
        overrides.extend(said.map(|(name, is_so)| (name, f64::from(u8::from(is_so)))));
        overrides
    }

    /// What hysteresis is told.
    pub(super) fn of_hysteresis(&self) -> Vec<(&'static str, f64)> {
        self.overrides(&[("TOTAL_AT", Column::Total)])
    }

    /// What motion is told.
    pub(super) fn of_motion(&self) -> Vec<(&'static str, f64)> {
        self.overrides(&[
            ("ACTIVE_AT", Column::Active),
            ("CENTROID_AT", Column::U),
            ("MOTION_AT", Column::Motion),
            ("DISPLACEMENT_AT", Column::DisplacementU),
            ("DIRECTION_AT", Column::Direction),
            ("DISTANCE_AT", Column::Distance),
            ("RADIAL_DISTANCE_AT", Column::RadialDistance),
            ("SPEED_AT", Column::Speed),
            ("RADIAL_SPEED_AT", Column::RadialSpeed),
        ])
    }
}

/// For programs that are told nothing.
pub(super) const NOTHING: Constants<'static> = &[];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Body;
    use crate::bundled;
    use crate::field::FieldSet;
    use crate::scene::Scene;
    use crate::signal::Calibration;

    #[test]
    fn what_is_read_back_is_what_a_plan_says() {
        let body = Body::from_bytes("hand.glb", bundled::HAND).unwrap();
        let fields = FieldSet::new(&body).unwrap();
        let calibration = Calibration::identity(body.taxels.len());
        let wanted = Outputs::all().iter().chain([Outputs::USUAL, Outputs::CENTROID | Outputs::SPEED]);
        for outputs in wanted.filter(|outputs| !outputs.contains(Outputs::TOUCHES)) {
            let plan = Plan::new(&body, &fields, &Scene { outputs, ..Scene::default() }, &calibration).unwrap();
            let cells = plan.fields.len() * size_of::<u32>();
            assert_eq!(plan.bytes_down(), Columns::new(&plan).read().len() * cells, "{outputs:?}");
        }
    }
}
