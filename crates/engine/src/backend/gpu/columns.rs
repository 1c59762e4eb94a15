//! Which numbers a plan has the device write, and in which column of its results.

use super::stage::Constants;
use crate::percept::{COLUMNS, Component, Outputs, Store};
use crate::scene::Plan;

/// A column of the results: a number for each frame and field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Column {
    /// A cell's flags and what is present; always the first.
    Status,
    Active,
    /// Flags and quantities present that motion adds to the cell's.
    Motion,
    Component(Component),
}

/// The columns that a plan needs, those first that are read back.
pub(super) struct Columns {
    all: Vec<Column>,
    read: usize,
}

impl Columns {
    pub(super) fn new(plan: &Plan) -> Self {
        let (outputs, stages) = (plan.read_back(), plan.stages());
        let mut all = vec![Column::Status];
        let own = [(Column::Active, Outputs::ACTIVE | Outputs::FILTERED), (Column::Motion, Outputs::MOTION)];
        let parts = Component::ALL.iter().map(|&part| match part {
            Component::CentroidU | Component::CentroidV => {
                (Column::Component(part), part.wanted_for() | Outputs::FILTERED)
            }
            _ => (Column::Component(part), part.wanted_for()),
        });
        all.extend(
            own.into_iter().chain(parts).filter(|(_, some)| outputs.intersects(*some)).map(|(column, _)| column),
        );
        let read = all.len();
        // What only later stages read.
        let needed = [
            (Column::Component(Component::Total), stages.hysteresis),
            (Column::Active, stages.motion),
            (Column::Component(Component::CentroidU), stages.motion),
            (Column::Component(Component::CentroidV), stages.motion),
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

    /// The index of `column`, as in the shaders' overrides.
    fn at(&self, column: Column) -> f64 {
        self.all.iter().position(|other| *other == column).map_or(u32::MAX.into(), |at| at as f64)
    }

    /// The overrides that say where the outputs of `stages` stand.
    fn overrides(&self, stages: &[&str]) -> Vec<(&'static str, f64)> {
        let of_stages = COLUMNS.iter().filter(|column| stages.contains(&column.stage));
        of_stages
            .filter_map(|column| match column.store {
                Store::Active => Some((column.shader_override, self.at(Column::Active))),
                Store::Backend(parts) => Some((column.shader_override, self.at(Column::Component(*parts.first()?)))),
                Store::Host(_) => None,
            })
            .collect()
    }

    pub(super) fn of_fields(&self, plan: &Plan) -> Vec<(&'static str, f64)> {
        let mut overrides = self.overrides(&["contact", "centroid", "orientation", "principal_axis"]);
        overrides.push(("DEPTH_AT", self.at(Column::Component(Component::CentroidDepth))));
        let stages = plan.stages();
        let said = [
            ("CENTRED", stages.centroid),
            ("ORIENTED", stages.orientation),
            ("AXED", stages.principal_axis),
            ("COMPENSATED", plan.is_compensated()),
            ("UNWEIGHTED", plan.fields.iter().all(|field| field.unweighted)),
        ];
        overrides.extend(said.map(|(name, is_so)| (name, f64::from(u8::from(is_so)))));
        overrides
    }

    pub(super) fn of_hysteresis(&self) -> Vec<(&'static str, f64)> {
        vec![("TOTAL_AT", self.at(Column::Component(Component::Total)))]
    }

    pub(super) fn of_motion(&self) -> Vec<(&'static str, f64)> {
        let mut overrides = self.overrides(&["motion"]);
        overrides.extend([
            ("ACTIVE_AT", self.at(Column::Active)),
            ("CENTROID_AT", self.at(Column::Component(Component::CentroidU))),
            ("MOTION_AT", self.at(Column::Motion)),
        ]);
        overrides
    }
}

/// For programs without overrides.
pub(super) const NOTHING: Constants<'static> = &[];

#[cfg(test)]
mod tests {
    use super::super::tests::plan_of;
    use super::*;
    use crate::body::Body;
    use crate::bundled;
    use crate::scene::Scene;

    #[test]
    fn what_is_read_back_is_what_a_plan_says() {
        let body = Body::from_bytes("hand.glb", bundled::HAND).unwrap();
        let of_pressure = Outputs::all() - Outputs::OF_OTHER_LETTERS;
        let wanted = of_pressure.iter().chain([Outputs::USUAL_AND_MOTION, Outputs::CENTROID | Outputs::SPEED]);
        // Those come back as pressures.
        let of_pressures = Outputs::SELF_CONTACTS | Outputs::FORCE;
        for outputs in wanted.filter(|outputs| !outputs.intersects(of_pressures)) {
            let plan = plan_of(&body, &Scene { outputs, ..Scene::default() });
            let cells = plan.fields.len() * size_of::<u32>();
            assert_eq!(plan.bytes_down(), Columns::new(&plan).read().len() * cells, "{outputs:?}");
        }
    }
}
