//! What a plan does and does not do, and why: what `EXPLAIN` is to a query.

use super::{Plan, PlanField};
use crate::percept::Outputs;

/// A stage of a plan.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlannedStage {
    /// As in `src/stage`.
    pub name: &'static str,
    /// Whether it runs.
    pub runs: bool,
    /// Whether it runs on the host whatever the backend is.
    pub on_host: bool,
    /// Why it runs, or does not.
    pub why: String,
    /// The outputs that it gives.
    pub gives: Outputs,
    /// Fields, or of *calibrate* and *change* slots, that it goes over in a frame; 0 where it does not run.
    pub over: usize,
    /// Memberships that it goes over, once or several times; 0 where it works on what others found.
    pub memberships: usize,
}

impl Plan {
    /// All stages, in the order that they run in.
    #[must_use]
    pub fn explain(&self) -> Vec<PlannedStage> {
        let stages = self.stages();
        let all = |_: &PlanField| true;
        let charted = |field: &PlanField| field.charted;
        let of = |which: &dyn Fn(&PlanField) -> bool| {
            let chosen = self.fields.iter().filter(|field| which(field));
            chosen.fold((0, 0), |(fields, memberships), field| (fields + 1, memberships + field.count))
        };
        let place = Outputs::POSITION | Outputs::NORMAL;
        let sums = Outputs::TOTAL | Outputs::PEAK | Outputs::ACTIVE | Outputs::AREA;
        let slots = (self.calibrated(), 0);
        let found = (of(&all).0, 0);
        // What each stage gives, whether it runs, what it goes over, and why it might not.
        let rows = [
            ("calibrate", Outputs::empty(), true, slots, ""),
            ("change", Outputs::empty(), self.has_changes(), (self.slots() - slots.0, 0), "no letter is `change`"),
            ("contact", sums, true, of(&all), ""),
            ("centroid", Outputs::CENTROID, stages.centroid, of(&all), ""),
            ("orientation", Outputs::ORIENTATION, stages.orientation, of(&charted), ""),
            ("axis", Outputs::AXIS | Outputs::ANISOTROPY, stages.axis, of(&charted), ""),
            ("hysteresis", Outputs::empty(), stages.hysteresis, found, "the calibration has no thresholds"),
            ("motion", Outputs::MOTION, stages.motion, (of(&charted).0, 0), ""),
            ("position", place, stages.position, found, ""),
            ("touches", Outputs::TOUCHES, stages.touches, of(&all), ""),
            ("filter", Outputs::FILTERED, stages.filter, (of(&charted).0, 0), ""),
        ];
        let row = |&(name, gives, runs, (over, memberships), idle): &(&'static str, Outputs, bool, (_, _), &str)| {
            let asked: Vec<String> = (self.outputs() & gives).names().collect();
            let why = match (runs, asked.is_empty(), idle.is_empty()) {
                (true, false, _) => format!("asked for: {}", asked.join(", ")),
                (true, true, _) => self.needed_by(name).to_owned(),
                (false, _, false) => idle.to_owned(),
                (false, _, true) => "no output needs it".to_owned(),
            };
            PlannedStage {
                name,
                runs,
                on_host: ["position", "touches", "filter"].contains(&name),
                why,
                gives,
                over: if runs { over } else { 0 },
                memberships: if runs { memberships } else { 0 },
            }
        };
        rows.iter().map(row).collect()
    }

    /// Why a stage runs that gives nothing that is asked for.
    fn needed_by(&self, stage: &str) -> &'static str {
        match stage {
            "calibrate" => "raw values become pressures",
            "change" => "a letter is `change`",
            "contact" => "says which fields are touched",
            "hysteresis" => "the calibration has thresholds",
            "centroid" => "later stages need it",
            "position" => "touches need it",
            _ => "others need it",
        }
    }

    /// Bytes of raw values that a frame brings to the backend: those of the taxels that are read, and no others.
    #[must_use]
    pub fn bytes_up(&self) -> usize {
        self.channels() * size_of::<f32>()
    }

    /// Bytes of results that a frame brings back from a device: a status, and the numbers of the outputs, a field.
    #[must_use]
    pub fn bytes_down(&self) -> usize {
        self.fields.len() * (1 + self.numbers_a_field()) * size_of::<f32>() + self.kept_pressures() * size_of::<f32>()
    }

    /// Numbers that a field's percept takes on the way back from a device.
    fn numbers_a_field(&self) -> usize {
        let place = Outputs::POSITION | Outputs::NORMAL;
        let numbers = [
            (Outputs::TOTAL, 1),
            (Outputs::PEAK, 1),
            (Outputs::ACTIVE, 1),
            (Outputs::AREA, 1),
            (place | Outputs::CENTROID | Outputs::FILTERED, 2),
            (place, 1),
            (Outputs::ORIENTATION, 1),
            (Outputs::AXIS, 1),
            (Outputs::ANISOTROPY, 1),
            // What motion says, and then its numbers.
            (Outputs::MOTION, 1),
            (Outputs::DISPLACEMENT, 2),
            (Outputs::DIRECTION, 1),
            (Outputs::DISTANCE, 1),
            (Outputs::RADIAL_DISTANCE, 1),
            (Outputs::SPEED, 1),
            (Outputs::RADIAL_SPEED, 1),
        ];
        let wanted = numbers.iter().filter(|(some, _)| self.outputs().intersects(*some));
        wanted.map(|(_, numbers)| numbers).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Body;
    use crate::bundled;
    use crate::field::FieldSet;
    use crate::scene::Scene;
    use crate::signal::Calibration;

    fn plan(outputs: Outputs, fields: &[&str]) -> Plan {
        let body = Body::from_bytes("humanoid.glb", bundled::HUMANOID).unwrap();
        let scene =
            Scene { outputs, fields: fields.iter().map(|glob| (*glob).to_owned()).collect(), ..Scene::default() };
        let calibration = Calibration::identity(body.taxels.len());
        Plan::new(&body, &FieldSet::new(&body).unwrap(), &scene, &calibration).unwrap()
    }

    fn running(plan: &Plan) -> Vec<&'static str> {
        plan.explain().into_iter().filter(|stage| stage.runs).map(|stage| stage.name).collect()
    }

    #[test]
    fn only_stages_that_an_output_needs_run() {
        assert_eq!(running(&plan(Outputs::TOTAL, &[])), ["calibrate", "contact"]);
        assert_eq!(running(&plan(Outputs::CENTROID, &[])), ["calibrate", "contact", "centroid"]);
        assert_eq!(running(&plan(Outputs::SPEED, &[])), ["calibrate", "contact", "centroid", "motion"]);
        let touches = ["calibrate", "contact", "centroid", "position", "touches"];
        assert_eq!(running(&plan(Outputs::TOUCHES, &[])), touches);
        let explained = plan(Outputs::ORIENTATION, &[]).explain();
        let why = |name: &str| explained.iter().find(|stage| stage.name == name).unwrap().why.clone();
        assert_eq!(why("orientation"), "asked for: orientation");
        assert_eq!(why("centroid"), "later stages need it");
        assert_eq!(why("axis"), "no output needs it");
        assert_eq!(why("change"), "no letter is `change`");
    }

    #[test]
    fn one_region_moves_only_its_own_bytes() {
        let whole = plan(Outputs::CENTROID, &[]);
        let part = whole.fields.iter().find(|field| field.name.contains('/') && field.count < 40).unwrap();
        let (name, count) = (part.name.clone(), part.count);
        let one = plan(Outputs::CENTROID, &[&name]);
        assert_eq!((one.bytes_up(), one.bytes_down()), (count * 4, 3 * 4));
        assert_eq!(whole.bytes_down(), whole.fields.len() * 3 * 4);
        let contact = &one.explain()[2];
        assert_eq!((contact.name, contact.over, contact.memberships), ("contact", 1, count));
    }
}
